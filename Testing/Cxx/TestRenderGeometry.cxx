// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Contracts 7 and 8: accuracy depends on neither size nor place of the volume, and the picture lies
// where vtkGPUVolumeRayCastMapper puts it.
#include "FormulaBrickSource.h"
#include "Scene.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>
#include <ostream>
#include <vtkCamera.h>
#include <vtkImageData.h>
#include <vtkOpenGLGPUVolumeRayCastMapper.h>
#include <vtkRenderer.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

// The same pattern every `Period` voxels, so that a place far away looks like one near the origin.
class PeriodicFormula : public Formula
{
public:
  static constexpr std::int64_t Period = 64;

  double Value(const Int3& place, const Int3& /*factor*/) const override
  {
    double phase[3];
    for (std::size_t a = 0; a < 3; ++a)
    {
      const std::int64_t inside = place[a] % (2 * Period);
      phase[a] = 2 * M_PI * static_cast<double>(inside) / (2.0 * Period);
    }
    const double wave = std::cos(phase[0] * 2) * std::cos(phase[1] + 0.4) +
      0.7 * std::sin(phase[2] + phase[0] + 1) * std::cos(2 * phase[1]);
    return std::clamp(0.5 + 0.45 * wave, 0.0, 1.0);
  }
  ValueRange Bound(const Int3& /*low*/, const Int3& /*high*/, const Int3& /*factor*/) const override
  {
    return { 0, 1 };
  }
};

struct Moments
{
  double Sum = 0;
  double X = 0;
  double Y = 0;
};

// Weight and centre of a picture's colours.
Moments MomentsOf(const std::vector<float>& picture, int width)
{
  Moments m;
  for (std::size_t i = 0; i < picture.size(); i += 4)
  {
    const double weight = static_cast<double>(picture[i]) + picture[i + 1] + picture[i + 2];
    const std::size_t pixel = i / 4;
    m.Sum += weight;
    m.X += weight * (static_cast<double>(pixel % static_cast<std::size_t>(width)) + 0.5);
    m.Y += weight * (static_cast<double>(pixel / static_cast<std::size_t>(width)) + 0.5);
  }
  m.X /= m.Sum;
  m.Y /= m.Sum;
  return m;
}

// Against VTK's mapper: centre within 0.1 pixel, weight within half a percent.
void ExpectWhereVTKPutsIt(Stage& stage, vtkImageData* image, const std::string& name)
{
  const std::vector<float> ours = stage.Draw();
  ASSERT_TRUE(stage.Mapper->IsConverged()) << name;
  vtkNew<vtkOpenGLGPUVolumeRayCastMapper> vtk;
  const auto wide = WithWideScalars(image);
  vtk->SetInputData(wide);
  vtk->SetScalarMode(stage.Mapper->GetScalarMode());
  vtk->SetAutoAdjustSampleDistances(0);
  double shortest = 1e300;
  for (int a = 0; a < 3; ++a)
  {
    shortest = std::min(shortest, image->GetSpacing()[a]);
  }
  vtk->SetSampleDistance(static_cast<float>(0.1 * shortest));
  const std::vector<float> theirs = stage.DrawPictureWith(vtk);
  const Moments a = MomentsOf(ours, stage.Width());
  const Moments b = MomentsOf(theirs, stage.Width());
  const ImageDifference d = CompareImages(ours, theirs);
  std::printf(
    "  %-36s centre off by %.4f, %.4f pixel, weight by %.3f %%, mean difference %.3f/255\n",
    name.c_str(), a.X - b.X, a.Y - b.Y, 100 * (a.Sum / b.Sum - 1), 255 * d.Mean);
  EXPECT_GT(b.Sum, 20) << name << ": the picture shows nothing";
  EXPECT_NEAR(a.X, b.X, 0.1) << name;
  EXPECT_NEAR(a.Y, b.Y, 0.1) << name;
  EXPECT_NEAR(a.Sum / b.Sum, 1, 0.005) << name;
}

struct Place
{
  const char* Name;
  ImageOptions Image;
  bool Moved = false;
};

void PrintTo(const Place& place, std::ostream* out)
{
  *out << place.Name;
}

std::vector<Place> Places()
{
  std::vector<Place> places;
  places.push_back({ "Plain", {}, false });
  ImageOptions options;
  options.ExtentStart = { 17, 4, 9 };
  options.Spacing = { 0.8, 1.3, 1.1 };
  options.Origin = { -4, 12, 100 };
  places.push_back({ "ExtentFromElsewhere", options, false });
  options.ExtentStart = { -23, -5, -60 };
  places.push_back({ "NegativeExtent", options, false });
  options.CellData = true;
  places.push_back({ "CellsNegativeExtent", options, false });
  options.CellData = false;
  const double c = std::cos(0.7);
  const double s = std::sin(0.7);
  options.Direction = { c, -s, 0, s, c, 0, 0, 0, 1 };
  places.push_back({ "Rotated", options, false });
  places.push_back({ "RotatedAndMoved", options, true });
  options.CellData = true;
  places.push_back({ "CellsRotatedAndMoved", options, true });
  // Left-handed direction matrices are compared with the truth (TestRenderTruth.cxx): VTK 9.1 culls
  // the faces of the mirrored box and draws nothing.
  options = {};
  places.push_back({ "Moved", options, true });
  return places;
}

} // namespace

class SamePlaceAsVTK : public testing::TestWithParam<Place>
{
};

TEST_P(SamePlaceAsVTK, CentreAndWeight)
{
  const auto image = MakeImage(GetParam().Image);
  Stage stage(96, 80);
  stage.Mapper->SetBrickSize(16);
  stage.SetImage(image);
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  if (GetParam().Moved)
  {
    stage.Volume->RotateX(25);
    stage.Volume->RotateZ(-40);
    stage.Volume->SetScale(1.5, 0.8, 1.2);
    stage.Volume->SetPosition(10, 4, -2);
  }
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
  ExpectWhereVTKPutsIt(stage, image, std::string(GetParam().Name) + ", perspective");
  stage.Look({ 1, -0.5, 0.4 }, 0.8, true);
  ExpectWhereVTKPutsIt(stage, image, std::string(GetParam().Name) + ", parallel");
}

INSTANTIATE_TEST_SUITE_P(Contract8, SamePlaceAsVTK, testing::ValuesIn(Places()),
  [](const auto& test) { return std::string(test.param.Name); });

// A silhouette: a wall in the outermost voxels shows where the volume ends, to a part of a pixel.
TEST(Contract8, SilhouetteOfTheWholeBox)
{
  for (const bool cells : { false, true })
  {
    ImageOptions options;
    options.CellData = cells;
    options.ExtentStart = { -9, 3, 20 };
    options.Dimensions = { 12, 10, 14 };
    const auto image = MakeImage(options, [](double, double, double) { return 1.0; });
    Stage stage(96, 96);
    stage.SetImage(image);
    stage.SetTransfer(MakeTransfer(OpacityShape::Wall));
    stage.Look({ 0.4, 1, -0.3 }, 0.9);
    ExpectWhereVTKPutsIt(stage, image, cells ? "box of cells" : "box of points");
  }
}

TEST(Contract7, PlaceAndSizeOfVoxelsDontMatter)
{
  struct Case
  {
    const char* Name;
    double Origin;
    double Spacing;
  };
  std::vector<float> reference;
  for (const Case& c : { Case{ "unit voxels at 0", 0, 1 }, Case{ "origin 6.2e6", 6.2e6, 1 },
         Case{ "spacing 1e-9", 0, 1e-9 }, Case{ "spacing 1.5e20", 0, 1.5e20 },
         Case{ "spacing 1e-6 at -3", -3, 1e-6 } })
  {
    ImageOptions options;
    options.Origin = { c.Origin, -c.Origin, 0.5 * c.Origin };
    options.Spacing = { c.Spacing, c.Spacing, c.Spacing };
    const auto image = MakeImage(options);
    const auto source = SourceOfImage(image, 16, false);
    Stage stage(64, 64);
    stage.SetSource(source);
    stage.SetTransfer(MakeTransfer(OpacityShape::Ramp, 0, 255, c.Spacing));
    vtkCamera* camera = stage.Renderer->GetActiveCamera();
    const double h = c.Spacing;
    const auto& o = options.Origin;
    camera->SetPosition(o[0] + 60 * h, o[1] - 40 * h, o[2] + 40 * h);
    camera->SetFocalPoint(o[0] + 20 * h, o[1] + 18 * h, o[2] + 22 * h);
    camera->SetViewUp(0, 0, 1);
    camera->SetViewAngle(40);
    camera->SetClippingRange(2 * h, 300 * h);
    const std::vector<float> picture = stage.Draw();
    ASSERT_TRUE(stage.Mapper->IsConverged()) << c.Name;
    if (reference.empty())
    {
      reference = picture;
      ASSERT_GT(*std::max_element(picture.begin(), picture.end()), 0.1f);
      continue;
    }
    const ImageDifference d = CompareImages(picture, reference);
    std::printf("  %-20s differs by %.2e at most\n", c.Name, d.Max);
    EXPECT_LE(d.Max, 1e-4) << c.Name;
  }
}

TEST(Contract7, FarCornerOfAHugeVolumeLooksLikeTheNearOne)
{
  const std::int64_t edge = std::int64_t{ 1 } << 30;
  FormulaDescription formula;
  formula.Field = std::make_shared<PeriodicFormula>();
  formula.Dimensions = { edge, edge, edge };
  formula.Type = ScalarType::Float32;
  formula.BrickSize = 32;
  const auto source = FormulaBrickSource::Make(formula);
  ASSERT_TRUE(source.Ok()) << source.GetStatus().Message();
  for (const bool shade : { false, true })
  {
    std::vector<float> reference;
    for (const std::int64_t shift : { std::int64_t{ 0 }, edge - 512 })
    {
      ASSERT_EQ(shift % PeriodicFormula::Period, 0);
      Stage stage(64, 64);
      stage.SetSource(source.Value());
      stage.SetTransfer(MakeTransfer(OpacityShape::Ramp, 0, 1));
      stage.SetShade(shade);
      stage.Mapper->SetMaximumLevel(0);
      // Of rays: whether a pixel is interpolated between them hangs on their last bits.
      stage.Mapper->AutoAdjustSampleDistancesOff();
      const auto s = static_cast<double>(shift);
      stage.LookFrom({ s + 130, s + 125, s + 140 }, { s + 160, s + 185, s + 170 }, 0.5, 120, 50);
      const std::vector<float> picture = stage.Draw();
      ASSERT_TRUE(stage.Mapper->IsConverged());
      if (reference.empty())
      {
        reference = picture;
        ASSERT_GT(*std::max_element(picture.begin(), picture.end()), 0.1f);
        continue;
      }
      const ImageDifference d = CompareImages(picture, reference);
      std::printf("  %s: differs by %.2e at most\n", shade ? "shaded" : "unshaded", d.Max);
      EXPECT_LE(d.Max, 1e-4);
    }
  }
}
