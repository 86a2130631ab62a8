// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Blend modes other than composite of voxels with two to four independent components: against the
// fields themselves, sampled densely in double precision, against VTK's GPU mapper, and the
// contracts.
#include "BesideVTK.h"
#include "ComponentScene.h"
#include "ExpectTruth.h"
#include "MaskImages.h"
#include "MessageRecorder.h"
#include "RayOfTruth.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <gtest/gtest.h>
#include <vtkColorTransferFunction.h>
#include <vtkContourValues.h>
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
constexpr std::array<double, 4> Weights{ 0.7, 1, 0.4, 0.85 };

struct Mode
{
  const char* Name;
  int Blend;
};

constexpr Mode Maximum{ "maximum", vtkVolumeMapper::MAXIMUM_INTENSITY_BLEND };
constexpr Mode Minimum{ "minimum", vtkVolumeMapper::MINIMUM_INTENSITY_BLEND };
constexpr Mode Average{ "average", vtkVolumeMapper::AVERAGE_INTENSITY_BLEND };
constexpr Mode Additive{ "additive", vtkVolumeMapper::ADDITIVE_BLEND };

// Each component from another view of the field and of another part of the values, so that a mode
// shows something of all of them.
vtkSmartPointer<vtkImageData> ImageFor(
  const Mode& mode, const ImageOptions& options, int components)
{
  const bool inverse = mode.Blend == vtkVolumeMapper::MINIMUM_INTENSITY_BLEND;
  return MakeComponentImage(options, components,
    [=](int c, double x, double y, double z)
    {
      const std::array<double, 4> views{ BlobField(x, y, z), BlobField(1 - z, 1 - x, y),
        BlobField(y, 1 - z, 1 - x), BlobField(z, x, 1 - y) };
      const double v = views[static_cast<std::size_t>(c)] * (1 - 0.12 * c) + 0.03 * c;
      return inverse ? 1 - v : v;
    });
}

// Functions of component `c` over low...high, smooth; `mirrored`: of the negative.
void SetFunctions(
  vtkVolumeProperty* property, int components, double low, double high, bool mirrored = false)
{
  constexpr std::array<std::array<double, 3>, 4> tints = { { { 1, 0.5, 0.2 }, { 0.2, 0.9, 0.4 },
    { 0.3, 0.3, 1 }, { 0.7, 0.7, 0.1 } } };
  const auto at = [&](double t) { return low + (mirrored ? 1 - t : t) * (high - low); };
  for (int c = 0; c < components; ++c)
  {
    const auto i = static_cast<std::size_t>(c);
    vtkNew<vtkPiecewiseFunction> opacity;
    opacity->AddPoint(at(0), 0.05 + 0.1 * c);
    opacity->AddPoint(at(0.3), 0.25);
    opacity->AddPoint(at(0.7), 0.4);
    opacity->AddPoint(at(1), 0.9 - 0.1 * c);
    vtkNew<vtkColorTransferFunction> color;
    color->AddRGBPoint(at(0), 0.3 * tints[i][0], 0.6 * tints[i][1], tints[i][2]);
    color->AddRGBPoint(at(0.45), 0.9 * tints[i][0], 0.4 * tints[i][1], 0.5 * tints[i][2]);
    color->AddRGBPoint(at(1), tints[i][0], tints[i][1], tints[i][2]);
    property->SetScalarOpacity(c, opacity);
    property->SetColor(c, color);
    property->SetScalarOpacityUnitDistance(c, 20 + 3 * c);
    property->SetComponentWeight(c, Weights[i]);
  }
}

void SetMode(vtkVolumeMapper* mapper, const Mode& mode, const ImageOptions& options)
{
  const double width = options.High - options.Low;
  mapper->SetBlendMode(mode.Blend);
  mapper->SetAverageIPScalarRange(options.Low + 0.1 * width, options.Low + 0.6 * width);
}

// The truth of a stage that shows an image, component by component.
class BlendTruth
{
public:
  BlendTruth(Stage& stage, vtkImageData* image, const InMask& isIn)
    : Shown(stage)
    , Source(SourceOfImage(image, BrickEdge, false))
    , Components(stage, Source)
  {
    if (isIn)
    {
      this->Components.SetMask(MaskLevels(this->Source->Info().Layout, isIn));
    }
    vtkDataArray* array = image->GetPointData()->GetScalars();
    for (int c = 0; c < array->GetNumberOfComponents(); ++c)
    {
      double range[2];
      array->GetRange(range, c);
      this->Ranges.push_back({ range[0], range[1] });
    }
  }

  TruthColor At(int x, int y, double dx, double dy) const
  {
    const TruthComponents& scene = this->Components.Scene();
    const int mode = this->Shown.Mapper->GetBlendMode();
    const bool averages = mode == vtkVolumeMapper::AVERAGE_INTENSITY_BLEND;
    const bool extremes = !averages && mode != vtkVolumeMapper::ADDITIVE_BLEND;
    TruthColor sum{};
    double gray = 0;
    bool crossed = false;
    for (std::size_t c = 0; c < scene.Parts.size(); ++c)
    {
      const RayOfTruth ray(*scene.Parts[c], x, y, dx, dy);
      crossed = crossed || !ray.Spans.empty();
      if (extremes)
      {
        const double sign = mode == vtkVolumeMapper::MAXIMUM_INTENSITY_BLEND ? 1 : -1;
        const TruthColor own = Premultiplied(*scene.Parts[c], ExtremeAlong(ray, sign));
        for (std::size_t i = 0; i < 4; ++i)
        {
          sum[i] += scene.Weights[c] * own[i];
        }
        continue;
      }
      const TruthSum own = SumAlong(
        ray, this->Ranges[c], averages ? this->Shown.Mapper->GetAverageIPScalarRange() : nullptr);
      const double over = averages
        ? own.Length
        : this->Shown.Property->GetScalarOpacityUnitDistance(static_cast<int>(c));
      gray += over > 0 ? scene.Weights[c] * own.Sum / over : 0;
    }
    sum[3] = std::min(sum[3], 1.0);
    return extremes ? sum : GrayOf(crossed, gray);
  }

private:
  Stage& Shown;
  std::shared_ptr<BrickSource> Source;
  ComponentTruth Components;
  std::vector<ValueRange> Ranges;
};

// A third of the pixels, within the tolerance of the envelope of 9 rays.
void ExpectBlend(
  Stage& stage, vtkImageData* image, const std::string& name, const InMask& isIn = nullptr)
{
  const std::vector<float> picture = stage.Draw();
  ASSERT_TRUE(stage.Mapper->IsConverged()) << name;
  const BlendTruth truth(stage, image, isIn);
  double plain = 0;
  double worst = 0;
  double seen = 0;
  std::string where;
  for (int y = 0; y < stage.Height(); ++y)
  {
    for (int x = y % 3; x < stage.Width(); x += 3)
    {
      const float* pixel = picture.data() + 4 * (y * stage.Width() + x);
      const PixelExcess excess =
        ExcessOfPixel(pixel, [&](double dx, double dy) { return truth.At(x, y, dx, dy); });
      plain = std::max(plain, excess.Plain);
      seen = std::max(seen, *std::max_element(excess.Middle.begin(), excess.Middle.end()));
      if (!(excess.Beyond <= worst))
      {
        worst = excess.Beyond;
        where = ", pixel " + std::to_string(x) + ", " + std::to_string(y) + ": " +
          std::to_string(pixel[0]) + " " + std::to_string(pixel[3]) + " instead of " +
          std::to_string(excess.Middle[0]) + " " + std::to_string(excess.Middle[3]);
      }
    }
  }
  std::printf("  %-52s max %.3f/255 beyond the envelope, plain max %.3f/255\n", name.c_str(),
    255 * worst, 255 * plain);
  EXPECT_GT(seen, 0.05) << name << ": empty";
  EXPECT_LE(worst, 1.0 / 255) << name << where;
}

void Show(Stage& stage, vtkImageData* image, const Mode& mode, const ImageOptions& options)
{
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.SetImage(image);
  SetFunctions(stage.Property, image->GetPointData()->GetScalars()->GetNumberOfComponents(),
    options.Low, options.High);
  SetMode(stage.Mapper, mode, options);
  stage.Look({ 0.5, 1, -0.3 }, 0.8);
}

ImageOptions OptionsOf(ScalarType type)
{
  ImageOptions options = OptionsOfType(type);
  options.ShareOfNaN = type == ScalarType::Float32 ? 0.01 : 0;
  return options;
}

class ComponentBlendOf : public testing::TestWithParam<Mode>
{
};

std::string NameOf(const testing::TestParamInfo<Mode>& test)
{
  return test.param.Name;
}

void SetNearest(Stage& stage, bool nearest)
{
  stage.Property->SetInterpolationType(
    nearest ? VTK_NEAREST_INTERPOLATION : VTK_LINEAR_INTERPOLATION);
}

} // namespace

// An atlas of four bricks; formats as they are and relative to bricks, voxels without a value.
TEST_P(ComponentBlendOf, Truth)
{
  struct Case
  {
    int Count;
    ScalarType Type;
  };
  for (const Case& c :
    { Case{ 2, ScalarType::UInt8 }, Case{ 3, ScalarType::Float32 }, Case{ 4, ScalarType::UInt16 },
      Case{ 2, ScalarType::Int32 }, Case{ 3, ScalarType::Float64 } })
  {
    // Shaders know texels of 8 and 16 bits and floats.
    if (!TakesAll() && (c.Type == ScalarType::Int32 || c.Type == ScalarType::Float64))
    {
      continue;
    }
    const ImageOptions options = OptionsOf(c.Type);
    const auto image = ImageFor(GetParam(), options, c.Count);
    Stage stage(36, 36);
    Show(stage, image, GetParam(), options);
    stage.Mapper->SetMaximumNumberOfSlots(4);
    const std::string name =
      std::string(GetParam().Name) + ", " + std::to_string(c.Count) + " of " + ToString(c.Type);
    for (const bool nearest : { false, true })
    {
      SetNearest(stage, nearest);
      ExpectBlend(stage, image, name + (nearest ? ", nearest" : ", linear"));
    }
    if (c.Type == ScalarType::UInt8)
    {
      SetNearest(stage, false);
      stage.LookFrom({ 14, 15, 16 }, { 30, 22, 25 }, 0.01, 100, 60);
      ExpectBlend(stage, image, name + ", inside");
      stage.Look({ -1, 0.4, 0.2 }, 0.7, true);
      stage.Property->SetComponentWeight(0, 0);
      ExpectBlend(stage, image, name + ", parallel, one without a weight");
    }
  }
}

// Only what is in a binary mask.
TEST_P(ComponentBlendOf, MaskedTruth)
{
  for (const ScalarType type : { ScalarType::UInt8, ScalarType::Float32 })
  {
    if (!TakesAll() && type == ScalarType::UInt8)
    {
      continue;
    }
    const ImageOptions options = OptionsOf(type);
    const InMask isIn = Sponge(options.Dimensions);
    const auto image = ImageFor(GetParam(), options, 2);
    Stage stage(36, 36);
    Show(stage, image, GetParam(), options);
    SetMask(stage.Mapper, MaskImage(options.Dimensions, isIn));
    for (const bool nearest : { false, true })
    {
      SetNearest(stage, nearest);
      ExpectBlend(stage, image,
        std::string(GetParam().Name) + ", masked, " + ToString(type) +
          (nearest ? ", nearest" : ", linear"),
        isIn);
    }
  }
}

// Far away: of several levels.
TEST_P(ComponentBlendOf, TruthOfLevels)
{
  ImageOptions options;
  options.Dimensions = { 96, 80, 112 };
  const auto image = ImageFor(GetParam(), options, 3);
  Stage stage(36, 36);
  Show(stage, image, GetParam(), options);
  stage.LookFrom({ 30, -15, 40 }, { 50, 60, 60 }, 0.5, 400, 60);
  ExpectBlend(stage, image, std::string(GetParam().Name) + ", levels in one picture");
}

// Contracts 1 to 3: the same accumulators, bit for bit.
TEST_P(ComponentBlendOf, SameBits)
{
  for (const ScalarType type : { ScalarType::UInt8, ScalarType::Float32, ScalarType::Float64 })
  {
    for (const bool nearest : { false, true })
    {
      if ((nearest && type != ScalarType::UInt8) || (!TakesAll() && type == ScalarType::Float64))
      {
        continue;
      }
      ImageOptions options = OptionsOf(type);
      options.Dimensions = { 96, 80, 112 };
      const int count = type == ScalarType::UInt8 ? 4 : 3;
      const auto source = SourceOfImage(ImageFor(GetParam(), options, count), BrickEdge, false);
      std::vector<float> reference;
      const auto expect = [&](const std::string& what, const std::function<void(Stage&)>& set)
      {
        Stage stage(32, 32);
        stage.SetSource(source);
        SetFunctions(stage.Property, count, options.Low, options.High);
        SetMode(stage.Mapper, GetParam(), options);
        SetNearest(stage, nearest);
        stage.LookFrom({ 30, -12, 40 }, { 50, 60, 60 }, 0.5, 400, 65);
        set(stage);
        return ExpectSamePicture(stage, reference,
          std::string(GetParam().Name) + ", " + ToString(type) +
            (nearest ? ", nearest, " : ", linear, ") + what);
      };
      const std::uint64_t loaded = expect("unlimited", [](Stage&) {});
      const std::uint64_t few =
        expect("16 slots", [](Stage& s) { s.Mapper->SetMaximumNumberOfSlots(16); });
      EXPECT_LE(static_cast<double>(few), 1.5 * static_cast<double>(loaded) + 2);
      const std::uint64_t all =
        expect("no skipping", [](Stage& s) { s.Mapper->EmptySpaceSkippingOff(); });
      EXPECT_GE(all, loaded);
      expect("another order",
        [](Stage& s)
        {
          s.Mapper->SetArrivalShuffleSeed(7);
          s.Mapper->SetNumberOfLoaderThreads(4);
          s.Mapper->SetMaximumNumberOfSlots(24);
          s.Mapper->EmptySpaceSkippingOff();
        });
      if (TestedMarcher() == vtkOutOfCoreVolumeMapper::NATIVE)
      {
        setenv("TERAVOX_NATIVE_ISA", "baseline", 1);
        expect("baseline", [](Stage& s) { s.Mapper->SetMaximumNumberOfSlots(8); });
        unsetenv("TERAVOX_NATIVE_ISA");
      }
      // Ranges of doubles far from 0 tell nothing.
      if (type == ScalarType::UInt8 &&
        (GetParam().Blend == vtkVolumeMapper::MAXIMUM_INTENSITY_BLEND ||
          GetParam().Blend == vtkVolumeMapper::MINIMUM_INTENSITY_BLEND))
      {
        std::printf("  %s: %llu bricks, without skipping %llu\n", GetParam().Name,
          static_cast<unsigned long long>(loaded), static_cast<unsigned long long>(all));
        EXPECT_LT(loaded, all) << GetParam().Name << ", " << ToString(type);
      }
    }
  }
}

// VTK's mapper takes samples a tenth of a voxel apart and reads tables of about a thousand entries.
// VTK 9.1 takes maxima for minima of components: it is shown the negative of the image and of the
// functions, and asked for maxima.
TEST_P(ComponentBlendOf, AgainstVTK)
{
  const bool isMinimum = GetParam().Blend == vtkVolumeMapper::MINIMUM_INTENSITY_BLEND;
  for (const int count : { 2, 3, 4 })
  {
    ImageOptions options = OptionsOf(ScalarType::UInt16);
    options.Low = 0;
    const auto image = ImageFor(GetParam(), options, count);
    Stage stage(40, 40);
    Show(stage, image, GetParam(), options);
    vtkNew<vtkImageData> negative;
    negative->DeepCopy(image);
    vtkDataArray* values = negative->GetPointData()->GetScalars();
    for (vtkIdType i = 0; isMinimum && i < values->GetNumberOfTuples(); ++i)
    {
      for (int c = 0; c < count; ++c)
      {
        values->SetComponent(i, c, options.High - values->GetComponent(i, c));
      }
    }
    vtkNew<vtkOpenGLGPUVolumeRayCastMapper> theirs;
    theirs->SetInputData(negative);
    theirs->SetAutoAdjustSampleDistances(0);
    theirs->UseJitteringOff();
    theirs->SetSampleDistance(0.1f);
    SetMode(theirs, isMinimum ? Maximum : GetParam(), options);
    for (const bool nearest : { false, true })
    {
      SetNearest(stage, nearest);
      stage.Look({ 0.4, 1, -0.3 }, 0.8);
      SetFunctions(stage.Property, count, options.Low, options.High);
      std::vector<float> ours = WithoutAlpha(stage.Draw());
      std::transform(
        ours.begin(), ours.end(), ours.begin(), [](float v) { return std::min(v, 1.0f); });
      SetFunctions(stage.Property, count, options.Low, options.High, isMinimum);
      const PictureEnvelope envelope = EnvelopeOf(stage, theirs);
      const ImageDifference plain = CompareImages(ours, envelope.Middle);
      const ImageDifference excess = ExcessOverEnvelope(ours, envelope.Low, envelope.High);
      std::printf("  %-10s %d, %s: mean %.3f/255, beyond the envelope p99 %.2f/255, max %.2f/255\n",
        GetParam().Name, count, nearest ? "nearest" : "linear", 255 * plain.Mean,
        255 * excess.Percentile99, 255 * excess.Max);
      EXPECT_GT(*std::max_element(envelope.Middle.begin(), envelope.Middle.end()), 0.1f) << "empty";
      EXPECT_LE(plain.Mean, 1.0 / 255) << GetParam().Name;
      EXPECT_LE(excess.Percentile99, 4.0 / 255) << GetParam().Name;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
  Contract, ComponentBlendOf, testing::Values(Maximum, Minimum, Average, Additive), NameOf);

// A volume of one value but for a corner that no ray meets: what is shown is a closed form.
TEST(ComponentBlend, OneValueHasAClosedForm)
{
  ImageOptions options;
  options.Dimensions = { 64, 64, 24 };
  const double value = 100;
  const auto image = MakeComponentImage(options, 3,
    [&](int c, double x, double y, double z)
    {
      const bool corner = x + y + z < 0.04;
      return (corner ? (c == 0 ? 255 : 0) : value) / 255;
    });
  for (const Mode& mode : { Maximum, Minimum, Average, Additive })
  {
    Stage stage(16, 16);
    Show(stage, image, mode, options);
    stage.LookFrom({ 40, 40, -60 }, { 40, 40, 12 }, 1, 300, 6);
    stage.Mapper->SetAverageIPScalarRange(value - 1, value + 1);
    const std::vector<float> picture = stage.Draw();
    const float* pixel = &picture[4 * (8 * 16 + 8)];
    std::array<double, 4> expected{};
    for (int c = 0; c < 3; ++c)
    {
      const double weight = Weights[static_cast<std::size_t>(c)];
      const double opacity = stage.Property->GetScalarOpacity(c)->GetValue(value);
      if (mode.Blend == Maximum.Blend || mode.Blend == Minimum.Blend)
      {
        double rgb[3];
        stage.Property->GetRGBTransferFunction(c)->GetColor(value, rgb);
        for (std::size_t i = 0; i < 3; ++i)
        {
          expected[i] += weight * opacity * rgb[i];
        }
        expected[3] += weight * opacity;
        continue;
      }
      // The first component goes from here to 255, the others from 0 to here.
      const double place = c == 0 ? 0 : 1;
      const double length =
        mode.Blend == Average.Blend ? 1 : 23 / stage.Property->GetScalarOpacityUnitDistance(c);
      expected[0] += weight * opacity * place * length;
    }
    if (mode.Blend == Average.Blend || mode.Blend == Additive.Blend)
    {
      const double gray = std::min(expected[0], 1.0);
      expected = { gray, gray, gray, 1 };
    }
    for (std::size_t i = 0; i < 4; ++i)
    {
      EXPECT_NEAR(pixel[i], expected[i], 0.3 / 255) << mode.Name << ", channel " << i;
    }
  }
}

// Functions, weights and modes that change; back again is the same picture.
TEST(ComponentBlend, PropertiesMatter)
{
  Stage stage(36, 36);
  const ImageOptions options;
  const auto image = ImageFor(Maximum, options, 2);
  Show(stage, image, Maximum, options);
  const std::vector<float> maximum = stage.Draw();
  stage.Property->SetComponentWeight(1, 0.3);
  EXPECT_FALSE(AreImagesIdentical(stage.Draw(), maximum));
  stage.Property->SetComponentWeight(1, Weights[1]);
  stage.Mapper->SetBlendModeToComposite();
  const std::vector<float> composite = stage.Draw();
  EXPECT_FALSE(AreImagesIdentical(composite, maximum));
  for (const Mode& mode : { Average, Additive, Minimum })
  {
    SetMode(stage.Mapper, mode, options);
    const std::vector<float> picture = stage.Draw();
    EXPECT_FALSE(AreImagesIdentical(picture, maximum)) << mode.Name;
    EXPECT_FALSE(AreImagesIdentical(picture, composite)) << mode.Name;
  }
  SetMode(stage.Mapper, Average, options);
  const std::vector<float> average = stage.Draw();
  stage.Mapper->SetAverageIPScalarRange(options.Low, options.High);
  EXPECT_FALSE(AreImagesIdentical(stage.Draw(), average));
  SetMode(stage.Mapper, Maximum, options);
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), maximum));
  stage.Mapper->SetBlendModeToComposite();
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), composite));
}

// Of the component with the largest weight, as VTK does: the very picture of that component alone,
// with its functions and its material.
TEST(ComponentBlend, SurfacesOfTheHeaviest)
{
  ImageOptions options = OptionsOf(ScalarType::UInt16);
  options.Low = 0;
  // VTK 9.1 takes values for those of the first component's range.
  const auto image = MakeComponentImage(options, 3);
  const auto show = [&](Stage& stage)
  {
    stage.Mapper->SetBrickSize(BrickEdge);
    stage.Mapper->SetBlendModeToIsoSurface();
    stage.SetShade(true);
    stage.Property->GetIsoSurfaceValues()->SetValue(0, 0.3 * options.High);
    stage.Property->GetIsoSurfaceValues()->SetValue(1, 0.55 * options.High);
    stage.Look({ 0.4, 1, -0.3 }, 0.8);
  };
  Stage stage(64, 64);
  stage.SetImage(image);
  SetFunctions(stage.Property, 3, options.Low, options.High);
  const auto setMaterial = [](Stage& of, int component)
  {
    of.Property->SetAmbient(component, 0.2);
    of.Property->SetDiffuse(component, 0.5);
    of.Property->SetSpecular(component, 0.3);
    of.Property->SetSpecularPower(component, 8);
  };
  show(stage);
  setMaterial(stage, 1);
  const std::vector<float> ours = stage.Draw();
  Stage alone(64, 64);
  alone.SetImage(image);
  alone.Mapper->SetVectorMode(vtkOutOfCoreVolumeMapper::COMPONENT);
  alone.Mapper->SetVectorComponent(1);
  alone.Property->SetScalarOpacity(stage.Property->GetScalarOpacity(1));
  alone.Property->SetColor(stage.Property->GetRGBTransferFunction(1));
  show(alone);
  setMaterial(alone, 0);
  EXPECT_TRUE(AreImagesIdentical(ours, alone.Draw()));
  stage.Property->SetComponentWeight(1, 0.1);
  EXPECT_FALSE(AreImagesIdentical(stage.Draw(), ours));
  stage.Property->SetComponentWeight(1, 1);
  stage.SetShade(false);
  const std::vector<float> unlit = WithoutAlpha(stage.Draw());
  vtkNew<vtkOpenGLGPUVolumeRayCastMapper> theirs;
  theirs->SetInputData(image);
  theirs->SetAutoAdjustSampleDistances(0);
  theirs->UseJitteringOff();
  theirs->SetSampleDistance(0.1f);
  theirs->SetBlendModeToIsoSurface();
  const PictureEnvelope envelope = EnvelopeOf(stage, theirs);
  const ImageDifference plain = CompareImages(unlit, envelope.Middle);
  const ImageDifference excess = ExcessOverEnvelope(unlit, envelope.Low, envelope.High);
  std::printf("  isosurfaces: mean %.3f/255, beyond the envelope p99 %.2f/255\n", 255 * plain.Mean,
    255 * excess.Percentile99);
  EXPECT_GT(*std::max_element(envelope.Middle.begin(), envelope.Middle.end()), 0.1f) << "empty";
  EXPECT_LE(plain.Mean, 1.0 / 255);
  EXPECT_LE(excess.Percentile99, 4.0 / 255);
}

// Where all components are as bright in front as anywhere, what lies behind isn't loaded.
TEST(ComponentBlend, BricksThatCanWin)
{
  ImageOptions options;
  options.Dimensions = { 64, 64, 64 };
  for (const Mode& mode : { Maximum, Minimum })
  {
    const bool inverse = mode.Blend == Minimum.Blend;
    const auto image = MakeComponentImage(options, 2,
      [=](int c, double x, double y, double z)
      {
        const double behind = 0.3 + 0.3 * (c == 0 ? BlobField(x, y, z) : BlobField(z, x, y));
        const double v = z < 0.1 ? 0.8 - 0.05 * c : behind;
        return inverse ? 1 - v : v;
      });
    std::uint64_t loaded[2] = { 0, 0 };
    std::vector<float> pictures[2];
    for (const bool skip : { false, true })
    {
      Stage stage(48, 48);
      Show(stage, image, mode, options);
      stage.LookFrom({ 32, 32, -100 }, { 32, 32, 32 }, 1, 300, 40);
      stage.Mapper->SetMaximumLevel(0);
      stage.Mapper->SetEmptySpaceSkipping(skip ? 1 : 0);
      pictures[skip ? 1 : 0] = stage.Draw();
      loaded[skip ? 1 : 0] = stage.Mapper->GetNumberOfBricksLoaded();
    }
    EXPECT_TRUE(AreImagesIdentical(pictures[0], pictures[1])) << mode.Name;
    EXPECT_EQ(loaded[0], 64u) << mode.Name;
    EXPECT_EQ(loaded[1], 16u) << mode.Name;
  }
}

// A ray isn't over where one component has its largest value and another doesn't.
TEST(ComponentBlend, RaysGoOnForAllComponents)
{
  ImageOptions options;
  options.Dimensions = { 64, 64, 64 };
  for (const Mode& mode : { Maximum, Minimum })
  {
    const bool inverse = mode.Blend == Minimum.Blend;
    const auto image = MakeComponentImage(options, 2,
      [=](int c, double, double, double z)
      {
        const double v = c == 0 ? (z < 0.3 ? 1 : 0.2) : (z > 0.7 ? 0.8 : 0.1);
        return inverse ? 1 - v : v;
      });
    for (const bool fromFront : { false, true })
    {
      Stage stage(16, 16);
      Show(stage, image, mode, options);
      stage.LookFrom({ 32, 32, fromFront ? -60.0 : 124.0 }, { 32, 32, 32 }, 1, 300, 6);
      const std::vector<float> picture = stage.Draw();
      double green = 0;
      for (int c = 0; c < 2; ++c)
      {
        const double v = c == 0 ? 1 : 0.8;
        const double value = 255 * (inverse ? 1 - v : v);
        double rgb[3];
        stage.Property->GetRGBTransferFunction(c)->GetColor(value, rgb);
        green += Weights[static_cast<std::size_t>(c)] *
          stage.Property->GetScalarOpacity(c)->GetValue(value) * rgb[1];
      }
      EXPECT_NEAR(picture[4 * (8 * 16 + 8) + 1], green, 0.5 / 255) << mode.Name;
    }
  }
}

// What isn't supported warns by name and is drawn as composite.
TEST(ComponentBlend, OthersWarn)
{
  const ImageOptions options;
  for (const bool dependent : { false, true })
  {
    Stage stage(24, 24);
    const auto image = ImageFor(Maximum, options, 2);
    Show(stage, image, Maximum, options);
    stage.Property->SetIndependentComponents(dependent ? 0 : 1);
    stage.Mapper->SetBlendModeToComposite();
    const std::vector<float> composite = stage.Draw();
    vtkNew<MessageRecorder> warnings;
    stage.Mapper->AddObserver(vtkCommand::WarningEvent, warnings);
    stage.Mapper->SetBlendMode(
      dependent ? vtkVolumeMapper::AVERAGE_INTENSITY_BLEND : vtkVolumeMapper::SLICE_BLEND);
    EXPECT_TRUE(AreImagesIdentical(stage.Draw(), composite));
    ASSERT_EQ(warnings->Messages.size(), 1u);
    EXPECT_NE(warnings->Messages[0].find("BlendMode with components"), std::string::npos);
  }
}
