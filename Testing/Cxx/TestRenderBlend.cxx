// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Blend modes other than composite: against VTK's GPU mapper, against the field itself, sampled
// densely in double precision, and the contracts.
#include "BesideVTK.h"
#include "BrickVoxels.h"
#include "ExpectTruth.h"
#include "MaskImages.h"
#include "RayOfTruth.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <vtkCamera.h>
#include <vtkContourValues.h>
#include <vtkImageData.h>
#include <vtkOpenGLGPUVolumeRayCastMapper.h>
#include <vtkPiecewiseFunction.h>
#include <vtkPlane.h>
#include <vtkPointData.h>
#include <vtkRenderer.h>
#include <vtkSphere.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr int BrickEdge = 16;
constexpr double None = std::numeric_limits<double>::quiet_NaN();

struct Mode
{
  const char* Name;
  int Blend;
  std::vector<double> IsoValues; ///< from 0 to 1 over the field's values
  bool Shade = false;
};

const Mode Maximum{ "maximum", vtkVolumeMapper::MAXIMUM_INTENSITY_BLEND, {} };
const Mode Minimum{ "minimum", vtkVolumeMapper::MINIMUM_INTENSITY_BLEND, {} };
const Mode Average{ "average", vtkVolumeMapper::AVERAGE_INTENSITY_BLEND, {} };
const Mode Additive{ "additive", vtkVolumeMapper::ADDITIVE_BLEND, {} };
const Mode Surfaces{ "isosurfaces", vtkVolumeMapper::ISOSURFACE_BLEND, { 0.62, 0.2, 0.4 } };
const Mode Lit{ "lit isosurfaces", vtkVolumeMapper::ISOSURFACE_BLEND, { 0.62, 0.2, 0.4 }, true };
const Mode Slice{ "slice", vtkVolumeMapper::SLICE_BLEND, {} };
const Mode LitSlice{ "lit slice", vtkVolumeMapper::SLICE_BLEND, {}, true };
const std::vector<Mode> Modes{ Maximum, Minimum, Average, Additive, Surfaces, Lit, Slice,
  LitSlice };

// Nodes over low...high: smooth, opaque at the upper end.
TransferNodes NodesOf(double low, double high)
{
  const auto at = [&](double t) { return low + t * (high - low); };
  TransferNodes nodes;
  nodes.UnitDistance = 12;
  nodes.Opacity = { { at(0), 0.1 }, { at(0.3), 0.3 }, { at(0.7), 0.5 }, { at(1), 1 } };
  nodes.Color = { { at(0), 0.1, 0.2, 0.9 }, { at(0.4), 0.9, 0.3, 0.2 }, { at(1), 0.6, 1, 0.9 } };
  return nodes;
}

void SetMode(Stage& stage, const Mode& mode, vtkVolumeMapper* mapper, double low, double high)
{
  mapper->SetBlendMode(mode.Blend);
  mapper->SetAverageIPScalarRange(low + 0.1 * (high - low), low + 0.6 * (high - low));
  stage.SetShade(mode.Shade);
  for (std::size_t i = 0; i < mode.IsoValues.size(); ++i)
  {
    stage.Property->GetIsoSurfaceValues()->SetValue(
      static_cast<int>(i), low + mode.IsoValues[i] * (high - low));
  }
  vtkNew<vtkPlane> plane;
  plane->SetOrigin(19.3, 17.1, 23.7);
  plane->SetNormal(0.3, 0.9, -0.2);
  stage.Property->SetSliceFunction(plane);
}

// A field of which the mode shows something.
vtkSmartPointer<vtkImageData> ImageFor(const Mode& mode, const ImageOptions& options)
{
  return mode.Blend == vtkVolumeMapper::MINIMUM_INTENSITY_BLEND
    ? MakeImage(options, [](double x, double y, double z) { return 1 - BlobField(x, y, z); })
    : MakeImage(options);
}

// A value at a depth of a ray, premultiplied, in the light that it has there.
TruthColor SeenAt(const RayOfTruth& ray, int level, double depth, double value)
{
  TruthColor seen = Premultiplied(ray.Scene, value);
  const TruthShading* shading = ray.Scene.Shading;
  if (shading && seen[3] > 0)
  {
    TruthShadingRay light;
    light.Ray = ray.Ray;
    light.Entry = ray.Ray.At(ray.Ray.LengthAtDepth(ray.Spans.front().DepthBegin));
    const Double3 color = shading->Shade(light, ray.Scene.Volume, level,
      ray.Scene.Volume.CentralDifference(
        level, ray.VoxelAt(depth), shading->GradientStep(ray.Scene.Volume, level)),
      ray.Scene.Transfer.GetColor(value));
    for (std::size_t c = 0; c < 3; ++c)
    {
      seen[c] = seen[3] * std::clamp(color[c], 0.0, 1.0);
    }
  }
  return seen;
}

// All surfaces along a ray, front to back.
TruthColor SurfacesAlong(const RayOfTruth& ray, std::vector<double> values)
{
  std::sort(values.begin(), values.end());
  const auto sideOf = [&](double v)
  { return std::upper_bound(values.begin(), values.end(), v) - values.begin(); };
  std::ptrdiff_t side = -1;
  double before = 0;
  TruthColor sum{};
  ray.Sample(40,
    [&](int level, double depth, double)
    {
      const double value = ray.Field(level, depth);
      const std::ptrdiff_t here = std::isnan(value) ? -1 : sideOf(value);
      while (side >= 0 && here >= 0 && side != here)
      {
        const bool up = here > side;
        const double iso = values[static_cast<std::size_t>(up ? side : side - 1)];
        double a = before;
        double b = depth;
        for (int i = 0; i < 40; ++i)
        {
          const double m = 0.5 * (a + b);
          const double there = ray.Field(level, m);
          (!std::isnan(there) && (there >= iso) == up ? b : a) = m;
        }
        const TruthColor seen = SeenAt(ray, level, b, iso);
        const double left = 1 - sum[3];
        for (std::size_t c = 0; c < 4; ++c)
        {
          sum[c] += left * seen[c];
        }
        side += up ? 1 : -1;
      }
      // Where a mask has holes, a ray stays on its side.
      const bool isHole = ray.Scene.Mask && std::isnan(value);
      side = isHole ? side : here;
      before = isHole ? before : depth;
    });
  return sum;
}

// The mean, or the sum over `unit`, of opacity times value.
TruthColor GrayAlong(
  const RayOfTruth& ray, const ValueRange& data, const double* range, double unit)
{
  const TruthSum sum = SumAlong(ray, data, range);
  return range ? GrayOf(sum.Length > 0, sum.Sum / sum.Length)
               : GrayOf(!ray.Spans.empty(), sum.Sum / unit);
}

TruthColor SliceAlong(const RayOfTruth& ray, vtkImplicitFunction* function)
{
  double before = 0;
  double depthBefore = None;
  for (const TruthLevelSpan& span : ray.Spans)
  {
    for (int i = 0; i <= 200; ++i)
    {
      const double depth = span.DepthBegin + i * (span.DepthEnd - span.DepthBegin) / 200;
      const auto valueAt = [&](double d)
      {
        Double3 p = ray.Ray.At(ray.Ray.LengthAtDepth(d));
        return function->FunctionValue(p.data());
      };
      const double here = valueAt(depth);
      if (!std::isnan(depthBefore) && (here > 0) != (before > 0))
      {
        double a = depthBefore;
        double b = depth;
        for (int k = 0; k < 50; ++k)
        {
          const double m = 0.5 * (a + b);
          ((valueAt(m) > 0) == (here > 0) ? b : a) = m;
        }
        return SeenAt(ray, span.Level, b, ray.Field(span.Level, b));
      }
      before = here;
      depthBefore = depth;
    }
  }
  return {};
}

TruthColor TruthOf(Stage& stage, const ValueRange& data, const RayOfTruth& ray)
{
  switch (stage.Mapper->GetBlendMode())
  {
    case vtkVolumeMapper::MAXIMUM_INTENSITY_BLEND:
      return Premultiplied(ray.Scene, ExtremeAlong(ray, 1));
    case vtkVolumeMapper::MINIMUM_INTENSITY_BLEND:
      return Premultiplied(ray.Scene, ExtremeAlong(ray, -1));
    case vtkVolumeMapper::AVERAGE_INTENSITY_BLEND:
      return GrayAlong(ray, data, stage.Mapper->GetAverageIPScalarRange(), 1);
    case vtkVolumeMapper::ADDITIVE_BLEND:
      return GrayAlong(ray, data, nullptr, stage.Property->GetScalarOpacityUnitDistance());
    case vtkVolumeMapper::ISOSURFACE_BLEND:
    {
      vtkContourValues* contours = stage.Property->GetIsoSurfaceValues();
      return SurfacesAlong(
        ray, { contours->GetValues(), contours->GetValues() + contours->GetNumberOfContours() });
    }
    default:
      return SliceAlong(ray, stage.Property->GetSliceFunction());
  }
}

// A third of the pixels, within the tolerance of the envelope of 9 rays.
void ExpectBlend(
  Stage& stage, BrickSource& source, const std::string& name, const InMask& isIn = nullptr)
{
  const std::vector<float> picture = stage.Draw();
  ASSERT_TRUE(stage.Mapper->IsConverged()) << name;
  StageTruth truth(stage, source);
  if (isIn)
  {
    truth.SetMask(MaskLevels(source.Info().Layout, isIn));
  }
  double plain = 0;
  double worst = 0;
  double seen = 0;
  std::string where;
  for (int y = 0; y < stage.Height(); ++y)
  {
    for (int x = y % 3; x < stage.Width(); x += 3)
    {
      const float* pixel = picture.data() + 4 * (y * stage.Width() + x);
      const auto at = [&](double dx, double dy)
      { return TruthOf(stage, source.Info().Range, RayOfTruth(truth.Scene(), x, y, dx, dy)); };
      const PixelExcess excess = ExcessOfPixel(pixel, at);
      const TruthColor& center = excess.Middle;
      const double off = excess.Beyond;
      plain = std::max(plain, excess.Plain);
      seen = std::max(seen, *std::max_element(center.begin(), center.end()));
      if (off > worst)
      {
        worst = off;
        where = ", pixel " + std::to_string(x) + ", " + std::to_string(y) + ": " +
          std::to_string(pixel[0]) + " " + std::to_string(pixel[3]) + " instead of " +
          std::to_string(center[0]) + " " + std::to_string(center[3]);
      }
    }
  }
  std::printf("  %-52s max %.3f/255 beyond the envelope, plain max %.3f/255\n", name.c_str(),
    255 * worst, 255 * plain);
  EXPECT_GT(seen, 0.05) << name << ": empty";
  EXPECT_LE(worst, 1.0 / 255) << name << where;
}

// Floats with voxels without a value among them.
ImageOptions OptionsOf(ScalarType type)
{
  ImageOptions options = OptionsOfType(type);
  options.ShareOfNaN = type == ScalarType::Float32 ? 0.01 : 0;
  return options;
}

bool IsSignedInteger(ScalarType type)
{
  return type == ScalarType::Int8 || type == ScalarType::Int16 || type == ScalarType::Int32;
}

class BlendOf : public testing::TestWithParam<Mode>
{
};

std::string NameOf(const testing::TestParamInfo<Mode>& test)
{
  std::string name = test.param.Name;
  name.erase(std::remove(name.begin(), name.end(), ' '), name.end());
  return name;
}

} // namespace

// All types, both interpolations, the camera outside and inside, an atlas of four bricks.
TEST_P(BlendOf, Truth)
{
  for (const ScalarType type : AllScalarTypes)
  {
    // Signed or not, the shaders get the same texels.
    if (!TakesAll() && IsSignedInteger(type))
    {
      continue;
    }
    const ImageOptions options = OptionsOf(type);
    const auto image = ImageFor(GetParam(), options);
    const auto source = SourceOfImage(image, BrickEdge, false);
    Stage stage(36, 36);
    stage.Mapper->SetBrickSize(BrickEdge);
    stage.Mapper->SetMaximumNumberOfSlots(4);
    stage.SetImage(image);
    stage.SetTransfer(NodesOf(options.Low, options.High));
    SetMode(stage, GetParam(), stage.Mapper, options.Low, options.High);
    const std::string name = std::string(GetParam().Name) + ", " + ToString(type);
    for (const bool nearest : { false, true })
    {
      stage.Property->SetInterpolationType(
        nearest ? VTK_NEAREST_INTERPOLATION : VTK_LINEAR_INTERPOLATION);
      stage.Look({ 0.5, 1, -0.3 }, 0.8);
      ExpectBlend(stage, *source, name + (nearest ? ", nearest" : ", linear"));
    }
    if (type == ScalarType::UInt8)
    {
      stage.Property->SetInterpolationTypeToLinear();
      stage.LookFrom({ 14, 15, 16 }, { 30, 22, 25 }, 0.01, 100, 60);
      ExpectBlend(stage, *source, name + ", inside");
      stage.Look({ -1, 0.4, 0.2 }, 0.7, true);
      ExpectBlend(stage, *source, name + ", parallel");
    }
  }
}

// Far away: of several levels.
TEST_P(BlendOf, TruthOfLevels)
{
  ImageOptions options;
  options.Dimensions = { 96, 80, 112 };
  const auto image = ImageFor(GetParam(), options);
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(36, 36);
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.SetImage(image);
  stage.SetTransfer(NodesOf(options.Low, options.High));
  SetMode(stage, GetParam(), stage.Mapper, options.Low, options.High);
  stage.LookFrom({ 30, -15, 40 }, { 50, 60, 60 }, 0.5, 400, 60);
  ExpectBlend(stage, *source, std::string(GetParam().Name) + ", levels in one picture");
}

// Of what a binary mask leaves.
TEST_P(BlendOf, MaskedTruth)
{
  const ImageOptions options;
  const InMask isIn = Sponge(options.Dimensions);
  const auto image = ImageFor(GetParam(), options);
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(24, 24);
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.Mapper->SetMaximumNumberOfSlots(4);
  stage.SetImage(image);
  stage.SetTransfer(NodesOf(options.Low, options.High));
  SetMode(stage, GetParam(), stage.Mapper, options.Low, options.High);
  SetMask(stage.Mapper, MaskImage(options.Dimensions, isIn));
  stage.Look({ 0.5, 1, -0.3 }, 0.8);
  for (const bool nearest : { false, true })
  {
    stage.Property->SetInterpolationType(
      nearest ? VTK_NEAREST_INTERPOLATION : VTK_LINEAR_INTERPOLATION);
    ExpectBlend(stage, *source,
      std::string(GetParam().Name) + (nearest ? ", mask, nearest" : ", mask, linear"), isIn);
  }
}

TEST_P(BlendOf, MaskedSameBits)
{
  ImageOptions options;
  options.Dimensions = { 96, 80, 112 };
  const auto image = ImageFor(GetParam(), options);
  const auto mask = MaskImage(options.Dimensions, Sponge(options.Dimensions));
  const auto ones = MaskImage(options.Dimensions, [](auto, auto, auto) { return true; });
  for (const bool nearest : { false, true })
  {
    Stage stage(32, 32);
    stage.Mapper->SetBrickSize(BrickEdge);
    stage.SetImage(image);
    stage.SetTransfer(NodesOf(options.Low, options.High));
    SetMode(stage, GetParam(), stage.Mapper, options.Low, options.High);
    stage.Property->SetInterpolationType(
      nearest ? VTK_NEAREST_INTERPOLATION : VTK_LINEAR_INTERPOLATION);
    stage.LookFrom({ 30, -12, 40 }, { 50, 60, 60 }, 0.5, 400, 65);
    const std::vector<float> plain = stage.Draw();
    SetMask(stage.Mapper, ones);
    EXPECT_TRUE(AreImagesIdentical(stage.Draw(), plain)) << GetParam().Name << ", a mask of ones";
    SetMask(stage.Mapper, mask);
    const std::vector<float> masked = stage.Draw();
    EXPECT_FALSE(AreImagesIdentical(masked, plain)) << GetParam().Name;
    stage.Mapper->EmptySpaceSkippingOff();
    EXPECT_TRUE(AreImagesIdentical(stage.Draw(), masked)) << GetParam().Name << ", no skipping";
    stage.Mapper->SetMaximumNumberOfSlots(12);
    EXPECT_TRUE(AreImagesIdentical(stage.Draw(), masked)) << GetParam().Name << ", both";
    stage.Mapper->EmptySpaceSkippingOn();
    stage.Mapper->SetArrivalShuffleSeed(7);
    EXPECT_TRUE(AreImagesIdentical(stage.Draw(), masked)) << GetParam().Name << ", 12 slots";
    EXPECT_TRUE(stage.Mapper->IsConverged());
  }
}

// Contracts 1 to 3: the same accumulators, bit for bit.
TEST_P(BlendOf, SameBits)
{
  for (const ScalarType type : { ScalarType::UInt8, ScalarType::Float32, ScalarType::Float64 })
  {
    for (const bool nearest : { false, true })
    {
      if (nearest && type == ScalarType::Float64)
      {
        continue;
      }
      ImageOptions options = OptionsOf(type);
      options.Dimensions = { 96, 80, 112 };
      const auto source = SourceOfImage(ImageFor(GetParam(), options), BrickEdge, false);
      std::vector<float> reference;
      const auto expect = [&](const std::string& what, const std::function<void(Stage&)>& set)
      {
        Stage stage(32, 32);
        stage.SetSource(source);
        stage.SetTransfer(NodesOf(options.Low, options.High));
        SetMode(stage, GetParam(), stage.Mapper, options.Low, options.High);
        stage.Property->SetInterpolationType(
          nearest ? VTK_NEAREST_INTERPOLATION : VTK_LINEAR_INTERPOLATION);
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
        });
      // Ranges of doubles far from 0 tell nothing.
      if (type == ScalarType::UInt8 &&
        (GetParam().Blend == vtkVolumeMapper::MAXIMUM_INTENSITY_BLEND ||
          GetParam().Blend == vtkVolumeMapper::MINIMUM_INTENSITY_BLEND ||
          GetParam().Blend == vtkVolumeMapper::ISOSURFACE_BLEND))
      {
        EXPECT_LT(loaded, all) << GetParam().Name << ", " << ToString(type);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Contract, BlendOf, testing::ValuesIn(Modes), NameOf);

// What samples see of a mask. Not where a ray meets nothing of it: VTK 9.1 shows the value there
// that it begins with, 0 or the largest. Not of surfaces: VTK 9.1 draws one where a ray comes out
// of a hole that begins at the face of the volume.
TEST(Blend, MaskedAsVTK)
{
  ImageOptions options = OptionsOf(ScalarType::UInt16);
  options.Low = 0;
  const auto mask = MaskImage(options.Dimensions, Sponge(options.Dimensions));
  for (const Mode& mode : { Maximum, Minimum, Average, Additive })
  {
    const auto image = ImageFor(mode, options);
    Stage stage(48, 48);
    stage.Mapper->SetBrickSize(BrickEdge);
    stage.SetImage(image);
    stage.SetTransfer(NodesOf(options.Low, options.High));
    vtkNew<vtkOpenGLGPUVolumeRayCastMapper> theirs;
    theirs->SetInputData(image);
    theirs->SetAutoAdjustSampleDistances(0);
    theirs->UseJitteringOff();
    theirs->SetSampleDistance(0.1f);
    SetMode(stage, mode, stage.Mapper, options.Low, options.High);
    SetMode(stage, mode, theirs, options.Low, options.High);
    SetMask(stage.Mapper, mask);
    SetMask(theirs, mask);
    stage.Look({ 0.4, 1, -0.3 }, 0.8);
    const std::vector<float> drawn = stage.Draw();
    const std::vector<float> ours = WithoutAlpha(drawn);
    PictureEnvelope envelope = EnvelopeOf(stage, theirs);
    for (std::size_t i = 0; i < ours.size(); ++i)
    {
      if (drawn[i / 4 * 4 + 3] == 0)
      {
        envelope.Low[i] = envelope.High[i] = envelope.Middle[i] = ours[i];
      }
    }
    const ImageDifference plain = CompareImages(ours, envelope.Middle);
    const ImageDifference excess = ExcessOverEnvelope(ours, envelope.Low, envelope.High);
    std::printf("  %-16s mask: mean %.3f/255, beyond the envelope p99 %.2f/255, max %.2f/255\n",
      mode.Name, 255 * plain.Mean, 255 * excess.Percentile99, 255 * excess.Max);
    EXPECT_GT(*std::max_element(envelope.Middle.begin(), envelope.Middle.end()), 0.1f) << "empty";
    EXPECT_LE(plain.Mean, 1.0 / 255) << mode.Name;
    EXPECT_LE(excess.Percentile99, 4.0 / 255) << mode.Name;
  }
}

// Only bricks that hold a value are loaded, and of a slice those that it touches.
TEST(Blend, BricksLoaded)
{
  ImageOptions options;
  options.Dimensions = { 96, 80, 112 };
  const auto image = MakeImage(options);
  const auto source = SourceOfImage(image, BrickEdge, false);
  const Int3 bricks = source->Info().Layout.Bricks(0);
  const auto whole = static_cast<std::uint64_t>(bricks[0] * bricks[1] * bricks[2]);
  std::uint64_t holding = 0;
  const double value = 0.55 * 255;
  for (std::uint64_t i = 0; i < whole; ++i)
  {
    const auto b = static_cast<std::int64_t>(i);
    BrickKey key;
    key.X = static_cast<std::uint32_t>(b % bricks[0]);
    key.Y = static_cast<std::uint32_t>(b / bricks[0] % bricks[1]);
    key.Z = static_cast<std::uint32_t>(b / bricks[0] / bricks[1]);
    const auto brick = source->ReadBrick(key);
    ASSERT_TRUE(brick.Ok());
    const auto& voxels = brick.Value()->Voxels;
    const auto ends = std::minmax_element(voxels.begin(), voxels.end(),
      [](auto a, auto c) { return static_cast<int>(a) < static_cast<int>(c); });
    holding += static_cast<int>(*ends.first) < value && value <= static_cast<int>(*ends.second);
  }
  const auto draw = [&](const Mode& mode)
  {
    Stage stage(64, 64);
    stage.SetSource(source);
    stage.SetTransfer(NodesOf(0, 255));
    SetMode(stage, mode, stage.Mapper, 0, 255);
    stage.Mapper->SetMaximumLevel(0);
    stage.Look({ 0.4, 1, -0.3 }, 0.9);
    stage.Draw();
    EXPECT_TRUE(stage.Mapper->IsConverged());
    return stage.Mapper->GetNumberOfBricksLoaded();
  };
  Mode one = Surfaces;
  one.IsoValues = { 0.55 };
  const std::uint64_t surface = draw(one);
  const std::uint64_t maximum = draw(Maximum);
  const std::uint64_t slice = draw(Slice);
  std::printf("  of %llu bricks: isosurface %llu (%llu hold the value), maximum %llu, slice %llu\n",
    static_cast<unsigned long long>(whole), static_cast<unsigned long long>(surface),
    static_cast<unsigned long long>(holding), static_cast<unsigned long long>(maximum),
    static_cast<unsigned long long>(slice));
  EXPECT_LE(surface, holding);
  EXPECT_GT(surface, 0u);
  EXPECT_LT(maximum, whole);
  EXPECT_LT(slice, whole / 3);
}

// A slice that isn't flat: VTK draws planes only.
TEST(Blend, SliceBySphere)
{
  const auto image = MakeImage({});
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(36, 36);
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.SetImage(image);
  stage.SetTransfer(NodesOf(0, 255));
  SetMode(stage, Slice, stage.Mapper, 0, 255);
  vtkNew<vtkSphere> sphere;
  sphere->SetCenter(20, 18, 22);
  sphere->SetRadius(13);
  stage.Property->SetSliceFunction(sphere);
  stage.Look({ 0.5, 1, -0.3 }, 0.8);
  ExpectBlend(stage, *source, "slice by a sphere");
  const std::vector<float> large = stage.Draw();
  sphere->SetRadius(9);
  EXPECT_FALSE(AreImagesIdentical(stage.Draw(), large));
}

// A slice on the outermost voxels of the volume, which rounding puts on either side of them.
TEST(Blend, SliceOnTheFaceOfTheVolume)
{
  Stage stage(36, 36);
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.SetImage(MakeImage({}));
  stage.SetTransfer(NodesOf(0, 255));
  SetMode(stage, Slice, stage.Mapper, 0, 255);
  for (const double z : { 0.0, 43.0 })
  {
    vtkNew<vtkPlane> plane;
    plane->SetOrigin(0, 0, z);
    plane->SetNormal(0, 0, 1);
    stage.Property->SetSliceFunction(plane);
    stage.Look({ 0.02, 0.3, 1 }, 0.6);
    const std::vector<float> picture = stage.Draw();
    for (std::size_t y = 14; y < 22; ++y)
    {
      for (std::size_t x = 14; x < 22; ++x)
      {
        EXPECT_GT(picture[4 * (y * 36 + x) + 3], 0.09f) << z << ": " << x << ", " << y;
      }
    }
  }
}

// The same property with another range, other values: another picture.
TEST(Blend, PropertiesMatter)
{
  Stage stage(36, 36);
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.SetImage(MakeImage({}));
  stage.SetTransfer(NodesOf(0, 255));
  stage.Look({ 0.5, 1, -0.3 }, 0.8);
  SetMode(stage, Average, stage.Mapper, 0, 255);
  const std::vector<float> average = stage.Draw();
  stage.Mapper->SetAverageIPScalarRange(0, 255);
  EXPECT_FALSE(AreImagesIdentical(stage.Draw(), average));
  SetMode(stage, Surfaces, stage.Mapper, 0, 255);
  const std::vector<float> surfaces = stage.Draw();
  stage.Property->GetIsoSurfaceValues()->SetValue(0, 90);
  EXPECT_FALSE(AreImagesIdentical(stage.Draw(), surfaces));
  SetMode(stage, Maximum, stage.Mapper, 0, 255);
  const std::vector<float> maximum = stage.Draw();
  stage.Opacity->AddPoint(255, 0.2);
  EXPECT_FALSE(AreImagesIdentical(stage.Draw(), maximum));
  stage.Mapper->SetBlendModeToComposite();
  const std::vector<float> composite = stage.Draw();
  SetMode(stage, Maximum, stage.Mapper, 0, 255);
  stage.Draw();
  stage.Mapper->SetBlendModeToComposite();
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), composite));
}

// VTK's mapper takes samples a tenth of a voxel apart and reads tables of about a thousand entries:
// it misses what lies between, and its surfaces are lit up to a tenth of a voxel behind themselves.
// So means are compared, and the largest differences of all but the hundredth part of the channels
// beyond the envelope of nine pictures within +-1/32 pixel.
TEST_P(BlendOf, AgainstVTK)
{
  ImageOptions options = OptionsOf(ScalarType::UInt16);
  options.Low = 0;
  // VTK 9.1 takes the place of a slice for that in its texture, which is so for cell data only: of
  // points it shows what lies up to half a voxel beside the slice.
  options.CellData = GetParam().Blend == vtkVolumeMapper::SLICE_BLEND;
  const auto image = ImageFor(GetParam(), options);
  Stage stage(64, 64);
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.SetImage(image);
  TransferNodes nodes = NodesOf(options.Low, options.High);
  if (GetParam().Blend == vtkVolumeMapper::SLICE_BLEND)
  {
    nodes.Opacity = { { options.Low, 1 }, { options.High, 1 } }; // VTK 9.1 doesn't weight colours
  }
  stage.SetTransfer(nodes);
  vtkNew<vtkOpenGLGPUVolumeRayCastMapper> theirs;
  theirs->SetInputData(image);
  theirs->SetScalarMode(stage.Mapper->GetScalarMode());
  theirs->SetAutoAdjustSampleDistances(0);
  theirs->UseJitteringOff();
  theirs->SetSampleDistance(0.1f);
  SetMode(stage, GetParam(), stage.Mapper, options.Low, options.High);
  SetMode(stage, GetParam(), theirs, options.Low, options.High);
  for (const bool inside : { false, true })
  {
    stage.Look({ 0.4, 1, -0.3 }, 0.8);
    if (inside)
    {
      stage.LookFrom({ 14, 15, 16 }, { 30, 22, 25 }, 0.1, 100, 60);
    }
    const std::vector<float> ours = WithoutAlpha(stage.Draw());
    const PictureEnvelope envelope = EnvelopeOf(stage, theirs);
    const ImageDifference plain = CompareImages(ours, envelope.Middle);
    const ImageDifference excess = ExcessOverEnvelope(ours, envelope.Low, envelope.High);
    std::printf("  %-16s %s: mean %.3f/255, beyond the envelope p99 %.2f/255, max %.2f/255\n",
      GetParam().Name, inside ? "inside" : "outside", 255 * plain.Mean, 255 * excess.Percentile99,
      255 * excess.Max);
    EXPECT_GT(*std::max_element(envelope.Middle.begin(), envelope.Middle.end()), 0.1f) << "empty";
    EXPECT_LE(plain.Mean, 1.0 / 255) << GetParam().Name;
    EXPECT_LE(excess.Percentile99, 4.0 / 255) << GetParam().Name;
  }
}
