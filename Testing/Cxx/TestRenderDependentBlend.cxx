// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Maxima and minima of voxels with dependent components: the opacity of the last one's extreme, and
// the colour that the others have at that place. Against the fields themselves, sampled densely in
// double precision, against VTK's GPU mapper, and the contracts.
#include "BesideVTK.h"
#include "ComponentScene.h"
#include "ExpectTruth.h"
#include "RayOfTruth.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <gtest/gtest.h>
#include <string>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkPiecewiseFunction.h>
#include <vtkPointData.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr int BrickEdge = 16;

// No two places of a ray have the same best last component, or nearly so.
vtkSmartPointer<vtkImageData> ImageOf(const ImageOptions& options, int components, bool least)
{
  return MakeComponentImage(options, components,
    [=](int c, double x, double y, double z)
    {
      if (c + 1 == components)
      {
        const double v = 0.1 + 0.8 * BlobField(x, y, z) + 0.05 * (x + 0.3 * y * z);
        return least ? 1 - v : v;
      }
      const double p = 5.0 * (c + 1);
      return 0.5 + 0.25 * std::sin(p * x + 3 * z) + 0.25 * std::cos(7 * y - p * z);
    });
}

void Furnish(Stage& stage, const ImageOptions& options, bool least)
{
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.Property->IndependentComponentsOff();
  stage.Property->SetInterpolationType(VTK_LINEAR_INTERPOLATION);
  SetComponentTransfer(stage, { OpacityShape::Ramp }, options.Low, options.High, 1);
  if (least)
  {
    // The least values have an opacity, too.
    stage.Property->GetScalarOpacity(0)->AddPoint(options.Low, 0.7);
  }
  stage.Mapper->SetBlendMode(
    least ? vtkVolumeMapper::MINIMUM_INTENSITY_BLEND : vtkVolumeMapper::MAXIMUM_INTENSITY_BLEND);
}

TruthColor TruthOf(const TruthComponents& scene, bool least, int x, int y, double dx, double dy)
{
  const std::size_t last = scene.Parts.size() - 1;
  const TruthExtreme extreme =
    PlaceOfExtreme(RayOfTruth(*scene.Parts[last], x, y, dx, dy), least ? -1 : 1);
  if (std::isnan(extreme.Value))
  {
    return {};
  }
  const auto valueOf = [&](std::size_t c)
  { return RayOfTruth(*scene.Parts[c], x, y, dx, dy).Field(extreme.Level, extreme.Depth); };
  const TruthTransfer& function = scene.Parts.front()->Transfer;
  Double3 color = last == 1 ? function.GetColor(valueOf(0)) : Double3{};
  for (std::size_t c = 0; c < 3 && last == 3; ++c)
  {
    color[c] = std::clamp(valueOf(c) / scene.FullColor, 0.0, 1.0);
  }
  const double opacity = function.GetAlpha(extreme.Value);
  return { opacity * color[0], opacity * color[1], opacity * color[2], opacity };
}

// A third of the pixels, within the tolerance of the envelope of 9 rays.
void ExpectBlend(Stage& stage, vtkImageData* image, bool least, const std::string& name)
{
  const std::vector<float> picture = stage.Draw();
  ASSERT_TRUE(stage.Mapper->IsConverged()) << name;
  const auto source = SourceOfImage(image, BrickEdge, false);
  const ComponentTruth truth(stage, source);
  double worst = 0;
  double seen = 0;
  std::string where;
  for (int y = 0; y < stage.Height(); ++y)
  {
    for (int x = y % 3; x < stage.Width(); x += 3)
    {
      const float* pixel = picture.data() + 4 * (y * stage.Width() + x);
      const PixelExcess excess = ExcessOfPixel(
        pixel, [&](double dx, double dy) { return TruthOf(truth.Scene(), least, x, y, dx, dy); });
      seen = std::max(seen, *std::max_element(excess.Middle.begin(), excess.Middle.end()));
      if (!(excess.Beyond <= worst))
      {
        worst = excess.Beyond;
        where = ", pixel " + std::to_string(x) + ", " + std::to_string(y);
      }
    }
  }
  std::printf("  %-52s max %.3f/255 beyond the envelope\n", name.c_str(), 255 * worst);
  EXPECT_GT(seen, 0.05) << name << ": empty";
  EXPECT_LE(worst, 1.0 / 255) << name << where;
}

ImageOptions OptionsOf(ScalarType type)
{
  ImageOptions options = OptionsOfType(type);
  options.ShareOfNaN = type == ScalarType::Float32 ? 0.01 : 0;
  if (type == ScalarType::UInt16)
  {
    options.Low = 0;
    options.High = 65535;
  }
  return options;
}

} // namespace

// An atlas of four bricks; formats as they are and relative to bricks, voxels without a value.
TEST(DependentBlend, Truth)
{
  struct Case
  {
    int Count;
    ScalarType Type;
  };
  for (const Case& c : { Case{ 2, ScalarType::Float32 }, Case{ 4, ScalarType::UInt8 },
         Case{ 2, ScalarType::Int32 }, Case{ 4, ScalarType::UInt16 } })
  {
    // Shaders know texels of 8 and 16 bits and floats.
    if (!TakesAll() && (c.Type == ScalarType::Int32 || c.Type == ScalarType::UInt16))
    {
      continue;
    }
    const ImageOptions options = OptionsOf(c.Type);
    for (const bool least : { false, true })
    {
      if (least && c.Type == ScalarType::UInt8)
      {
        continue; // of 256 values several places of a ray have the least
      }
      const auto image = ImageOf(options, c.Count, least);
      Stage stage(36, 36);
      stage.SetImage(image);
      Furnish(stage, options, least);
      stage.Mapper->SetMaximumNumberOfSlots(4);
      stage.Look({ 0.5, 1, -0.3 }, 0.8);
      const std::string name = std::string(least ? "minimum" : "maximum") + ", " +
        std::to_string(c.Count) + " of " + ToString(c.Type);
      ExpectBlend(stage, image, least, name);
      stage.Property->SetInterpolationType(VTK_NEAREST_INTERPOLATION);
      ExpectBlend(stage, image, least, name + ", nearest");
    }
  }
}

TEST(DependentBlend, TruthOfLevels)
{
  ImageOptions options;
  options.Dimensions = { 96, 80, 112 };
  const auto image = ImageOf(options, 4, false);
  Stage stage(36, 36);
  stage.SetImage(image);
  Furnish(stage, options, false);
  stage.LookFrom({ 30, -15, 40 }, { 50, 60, 60 }, 0.5, 400, 60);
  ExpectBlend(stage, image, false, "maximum, levels in one picture");
}

// Contracts 1 to 3.
TEST(DependentBlend, SameBits)
{
  for (const bool least : { false, true })
  {
    ImageOptions options = OptionsOf(least ? ScalarType::Float32 : ScalarType::UInt8);
    options.Dimensions = { 96, 80, 112 };
    const auto source = SourceOfImage(ImageOf(options, least ? 2 : 4, least), BrickEdge, false);
    std::vector<float> reference;
    const auto expect = [&](const std::string& what, const std::function<void(Stage&)>& set)
    {
      Stage stage(32, 32);
      stage.SetSource(source);
      Furnish(stage, options, least);
      stage.LookFrom({ 30, -12, 40 }, { 50, 60, 60 }, 0.5, 400, 65);
      set(stage);
      return ExpectSamePicture(
        stage, reference, std::string(least ? "minimum, " : "maximum, ") + what);
    };
    const std::uint64_t loaded = expect("unlimited", [](Stage&) {});
    expect("16 slots", [](Stage& s) { s.Mapper->SetMaximumNumberOfSlots(16); });
    const std::uint64_t all =
      expect("no skipping", [](Stage& s) { s.Mapper->EmptySpaceSkippingOff(); });
    EXPECT_GE(all, loaded);
    expect("another order",
      [](Stage& s)
      {
        s.Mapper->SetArrivalShuffleSeed(7);
        s.Mapper->SetNumberOfLoaderThreads(4);
        s.Mapper->SetMaximumNumberOfSlots(24);
      });
    if (TestedMarcher() == vtkOutOfCoreVolumeMapper::NATIVE)
    {
      setenv("TERAVOX_NATIVE_ISA", "baseline", 1);
      expect("baseline", [](Stage& s) { s.Mapper->SetMaximumNumberOfSlots(8); });
      unsetenv("TERAVOX_NATIVE_ISA");
    }
  }
}

// VTK's mapper takes samples a tenth of a voxel apart, and of these the place. Of two components
// VTK 9.1 compares a fourth one, which there isn't.
TEST(DependentBlend, BesideVTKsMapper)
{
  for (const bool least : { false, true })
  {
    ImageOptions options;
    options.Type = ScalarType::Float32;
    // The range that VTK maps to full colours where it isn't 8-bit.
    options.Low = 0;
    options.High = 1;
    BesideVTK both(options, 28);
    both.Image = ImageOf(options, 4, least);
    vtkDataArray* values = both.Image->GetPointData()->GetScalars();
    for (int c = 0; c < 4; ++c)
    {
      values->SetComponent(0, c, 0);
      values->SetComponent(1, c, 1);
    }
    both.Shown.SetImage(both.Image);
    both.Theirs->SetInputData(both.Image);
    Furnish(both.Shown, options, least);
    both.Shown.Mapper->SetMaximumLevel(0);
    both.Theirs->SetBlendMode(both.Shown.Mapper->GetBlendMode());
    both.Shown.Look({ 0.4, 1, -0.3 }, 0.8);
    both.Expect(least ? "minimum" : "maximum", { 1, 12 });
  }
}
