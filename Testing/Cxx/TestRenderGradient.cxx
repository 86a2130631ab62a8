// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Opacity by gradient: closed forms in VTK's terms, the truth, VTK's own mapper, and that the
// picture depends on no budget and on no skipping.
#include "BesideVTK.h"
#include "ExpectTruth.h"
#include "Scene.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <string>
#include <vtkImageData.h>
#include <vtkPiecewiseFunction.h>
#include <vtkRenderer.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr int BrickEdge = 16;

using Nodes = std::vector<std::array<double, 2>>;

// For values of 0...255: rises over the gradients of smooth fields; a peak, which single values of
// the gradient fall into; a step.
const Nodes Rising = { { 2, 0 }, { 14, 1 } };
const Nodes Peak = { { 8, 0.1 }, { 10, 1 }, { 12, 0 } };
const Nodes Step = { { 9.999, 0 }, { 10.001, 0.8 } };

Nodes Stretched(Nodes nodes, double factor)
{
  for (auto& node : nodes)
  {
    node[0] *= factor;
  }
  return nodes;
}

struct Shape
{
  const char* Name;
  Nodes Function;
};
const Shape Shapes[] = { { "rising", Rising }, { "peak", Peak }, { "step", Step } };

// Walls that let one part in ten thousand through per unit distance.
TransferNodes WithoutWalls(TransferNodes nodes)
{
  for (auto& node : nodes.Opacity)
  {
    node[1] = std::min(node[1], 0.9999);
  }
  return nodes;
}

void SetImage(Stage& stage, vtkImageData* image)
{
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.SetImage(image);
}

} // namespace

// 4 values per voxel along x, 2 apart: 2 per world length, of which a mean spacing is 4/3. Where
// the transfer function sees it, the gradient is the same all over.
TEST(GradientOpacity, OfARampIsAFactorOfTheExtinction)
{
  ImageOptions options;
  options.Type = ScalarType::UInt16;
  options.Dimensions = { 40, 20, 24 };
  options.Spacing = { 2, 1, 1 };
  const auto image = MakeImage(options, [](double x, double, double) { return x; });
  double range[2];
  image->GetScalarRange(range);
  const double magnitude = (range[1] - range[0]) / 39 / 2 * (4.0 / 3);
  Stage stage(48, 48);
  SetImage(stage, image);
  stage.SetTransfer({ { { 50, 0 }, { 90, 0.2 }, { 140, 0.05 }, { 200, 0 } },
    { { 50, 0.2, 0.3, 0.9 }, { 200, 1, 0.7, 0.2 } }, 1.5 });
  for (const bool shade : { false, true })
  {
    stage.SetShade(shade);
    stage.Look({ 0.4, 1, -0.3 }, 0.8);
    stage.SetGradientOpacity({ { 0.5 * magnitude, 0 }, { 1.75 * magnitude, 1 } });
    stage.Property->SetScalarOpacityUnitDistance(1.5);
    const std::vector<float> attenuated = stage.Draw();
    ASSERT_TRUE(stage.Mapper->IsConverged());
    stage.SetGradientOpacity({});
    const std::vector<float> whole = stage.Draw();
    stage.Property->SetScalarOpacityUnitDistance(1.5 / 0.4);
    const std::vector<float> thinner = stage.Draw();
    // Whole numbers step unevenly by one in six of a step.
    EXPECT_LT(CompareImages(attenuated, thinner).Max, 0.02f) << shade;
    EXPECT_GT(CompareImages(attenuated, whole).Max, 0.1f) << shade;
  }
}

// Up to a quarter of the range of the data, as in VTK; from a quarter of its own range where that
// is native.
TEST(GradientOpacity, ReachesAsFarAsVTKs)
{
  const auto image = MakeImage({}, NoiseField);
  Stage stage(40, 40);
  SetImage(stage, image);
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
  const std::vector<float> plain = stage.Draw();
  double range[2];
  image->GetScalarRange(range);
  const double quarter = 0.25 * (range[1] - range[0]);
  stage.SetGradientOpacity({ { 0, 1 }, { 1000, 0 } });
  const std::vector<float> far = stage.Draw();
  stage.SetGradientOpacity({ { 0, 1 }, { quarter, 1 - quarter / 1000 }, { quarter + 1, 0 } });
  EXPECT_LT(CompareImages(stage.Draw(), far).Max, 1e-4f);
  // 1 everywhere, or nothing that counts: as if there were none, to the bit.
  stage.SetGradientOpacity({ { 0, 1 }, { 255, 1 } });
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), plain));
  stage.SetGradientOpacity({ { 0, 0.2 }, { 50, 1 } });
  const std::vector<float> scalar = stage.Draw();
  EXPECT_FALSE(AreImagesIdentical(scalar, plain));
  stage.Property->DisableGradientOpacityOn();
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), plain));
  stage.Property->DisableGradientOpacityOff();
  // The function's own range is 50: m becomes m * 50 / range.
  stage.Mapper->SetGradientOpacityRangeType(vtkGPUVolumeRayCastMapper::NATIVE);
  const std::vector<float> native = stage.Draw();
  EXPECT_FALSE(AreImagesIdentical(native, scalar));
  stage.Mapper->SetGradientOpacityRangeType(vtkGPUVolumeRayCastMapper::SCALAR);
  const double stretch = 50 / (range[1] - range[0]);
  stage.SetGradientOpacity({ { 0, 0.2 }, { quarter, 0.2 + 0.8 * quarter * stretch / 50 } });
  EXPECT_LT(CompareImages(stage.Draw(), native).Max, 1e-4f);
}

class TruthOfGradients : public testing::TestWithParam<OpacityShape>
{
};

TEST_P(TruthOfGradients, SmoothAndNoisyShadedAndNot)
{
  for (const bool noisy : { false, true })
  {
    const auto image = noisy ? MakeImage({}, NoiseField) : MakeImage({});
    const auto source = SourceOfImage(image, BrickEdge, false);
    Stage stage(36, 36);
    SetImage(stage, image);
    for (const Shape& shape : Shapes)
    {
      // What falls to 0 little by little does something else to walls (see WallsThatFade).
      const bool fades = shape.Function == Peak;
      TransferNodes nodes = MakeTransfer(GetParam());
      nodes.UnitDistance *= GetParam() == OpacityShape::Fog ? 0.5 : 1; // else too faint
      stage.SetTransfer(fades ? WithoutWalls(nodes) : nodes);
      stage.SetGradientOpacity(Stretched(shape.Function, noisy ? 4 : 1));
      for (const bool shade : { false, true })
      {
        stage.SetShade(shade);
        const std::string name = std::string(ToString(GetParam())) + (noisy ? ", noisy, " : ", ") +
          shape.Name + (shade ? ", shaded" : "");
        stage.Look({ 0.3, 1, -0.4 }, 0.8);
        ExpectTruth(stage, *source, name);
        if (noisy != shade)
        {
          stage.LookFrom({ 14, 15, 16 }, { 30, 22, 25 }, 0.01, 100, 60);
          ExpectTruth(stage, *source, name + ", inside");
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Contract, TruthOfGradients,
  testing::Values(OpacityShape::Ramp, OpacityShape::Peak, OpacityShape::Box, OpacityShape::Wall,
    OpacityShape::Fog),
  [](const auto& test) { return std::string(ToString(test.param)); });

// The truth's walls are opaque up to where the gradient leaves nothing; those drawn have an
// extinction, 40 per shortest length, which is attenuated there: they begin up to a tenth of a
// voxel behind, whatever the tolerance, which shows where light changes. As VTK's, whose opacity
// per step is the gradient's there.
TEST(GradientOpacity, WallsThatFade)
{
  const auto image = MakeImage({});
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(36, 36);
  SetImage(stage, image);
  stage.SetTransfer(MakeTransfer(OpacityShape::Wall));
  stage.SetGradientOpacity(Peak);
  for (const bool shade : { false, true })
  {
    stage.SetShade(shade);
    const std::string name = shade ? "shaded" : "not shaded";
    const Bounds bounds = shade ? Bounds{ 5, 3 } : Bounds{};
    stage.Look({ 0.3, 1, -0.4 }, 0.8);
    ExpectTruth(stage, *source, name, bounds);
    stage.LookFrom({ 14, 15, 16 }, { 30, 22, 25 }, 0.01, 100, 60);
    ExpectTruth(stage, *source, name + ", inside", bounds);
  }
}

TEST(GradientOpacity, TruthOfAllTypesLinearAndNearest)
{
  for (const ScalarType type : AllScalarTypes)
  {
    ImageOptions options = OptionsOfType(type);
    options.ShareOfNaN = IsFloat(type) ? 0.02 : 0;
    options.CellData = type == ScalarType::Int16;
    const auto image = MakeImage(options);
    const auto source = SourceOfImage(image, BrickEdge, options.CellData);
    Stage stage(32, 32);
    SetImage(stage, image);
    stage.SetTransfer(MakeTransfer(OpacityShape::Ramp, options.Low, options.High));
    stage.SetGradientOpacity(Stretched(Rising, (options.High - options.Low) / 255));
    stage.Look({ 0.5, 1, -0.3 }, 0.8);
    ExpectTruth(stage, *source, std::string(ToString(type)) + ", linear");
    stage.Property->SetInterpolationTypeToNearest();
    ExpectTruth(stage, *source, std::string(ToString(type)) + ", nearest");
  }
}

// The magnitude is measured before the prop's matrix, whatever lights there are.
TEST(GradientOpacity, TruthStretchedTurnedScaledAndInLevels)
{
  ImageOptions options;
  options.Dimensions = { 60, 64, 40 };
  options.Spacing = { 1, 0.8, 2.5 };
  const double c = std::cos(0.6);
  const double s = std::sin(0.6);
  options.Direction = { c, -s, 0, s, c, 0, 0, 0, 1 };
  const auto image = MakeImage(options);
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(40, 40);
  SetImage(stage, image);
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.SetGradientOpacity(Rising);
  stage.Volume->RotateX(25);
  stage.Volume->SetScale(1.5, 0.8, 1.2);
  stage.Volume->SetPosition(10, 4, -2);
  for (const double distance : { 0.8, 4.0 })
  {
    for (const bool shade : { false, true })
    {
      stage.SetShade(shade);
      stage.Look({ 0.5, 1, -0.6 }, distance);
      ExpectTruth(stage, *source,
        (distance > 1 ? std::string("levels") : std::string("turned and scaled")) +
          (shade ? ", shaded" : ""));
    }
  }
}

// Steps of a given length come to the truth with their square.
TEST(GradientOpacity, FixedStepsConverge)
{
  const auto image = MakeImage({});
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(32, 32);
  SetImage(stage, image);
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.SetGradientOpacity(Rising);
  stage.Look({ 0.3, 1, -0.4 }, 0.8);
  ExpectFixedStepsConverge(stage, *source, 0.15);
}

// VTK's step is n / (n - 1) voxels long and taken as one: its magnitudes are larger by 1/43 to
// 1/35, which the rising function makes up to 1/35 of the opacity.
TEST(GradientOpacity, BesideVTK)
{
  for (const bool shade : { false, true })
  {
    ImageOptions options;
    options.Dimensions = { 60, 54, 66 };
    BesideVTK comparison(options, 28);
    comparison.Shown.Mapper->SetMaximumLevel(0);
    comparison.Shown.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    comparison.Shown.SetShade(shade);
    comparison.Shown.Look({ 0.4, 1, -0.3 }, 0.8);
    for (const bool native : { false, true })
    {
      comparison.Shown.SetGradientOpacity(native ? Nodes{ { 0, 0.1 }, { 100, 1 } } : Rising);
      const int type =
        native ? vtkGPUVolumeRayCastMapper::NATIVE : vtkGPUVolumeRayCastMapper::SCALAR;
      comparison.Shown.Mapper->SetGradientOpacityRangeType(type);
      comparison.Theirs->SetGradientOpacityRangeType(type);
      comparison.Expect(
        std::string(native ? "native range" : "rising") + (shade ? ", shaded" : ""));
    }
  }
}

// Contracts 1 to 3.
TEST(GradientOpacity, SameBitsInASmallAtlasAndWithoutSkipping)
{
  ImageOptions options;
  options.Dimensions = { 72, 66, 80 };
  for (const ScalarType type : { ScalarType::UInt8, ScalarType::Float64 })
  {
    options.Type = type;
    const auto image = MakeImage(options);
    for (const bool nearest : { false, true })
    {
      vtkTypeUInt64 evictions = 0;
      const auto draw = [&](const std::function<void(Stage&)>& change)
      {
        Stage stage(48, 48);
        SetImage(stage, image);
        stage.SetTransfer(MakeTransfer(OpacityShape::Box));
        stage.SetGradientOpacity(Rising);
        stage.SetShade(nearest);
        stage.Property->SetInterpolationType(
          nearest ? VTK_NEAREST_INTERPOLATION : VTK_LINEAR_INTERPOLATION);
        stage.Look({ 0.4, 1, -0.3 }, 0.8);
        change(stage);
        std::vector<float> picture = stage.Draw();
        EXPECT_TRUE(stage.Mapper->IsConverged());
        evictions += stage.Mapper->GetNumberOfEvictions();
        return picture;
      };
      const std::vector<float> whole = draw([](Stage&) {});
      ASSERT_GT(*std::max_element(whole.begin(), whole.end()), 0.1f);
      EXPECT_TRUE(
        AreImagesIdentical(whole, draw([](Stage& s) { s.Mapper->SetMaximumNumberOfSlots(12); })));
      EXPECT_TRUE(AreImagesIdentical(whole,
        draw(
          [](Stage& s)
          {
            s.Mapper->SetMaximumNumberOfSlots(12);
            s.Mapper->SetArrivalShuffleSeed(5);
          })));
      EXPECT_TRUE(
        AreImagesIdentical(whole, draw([](Stage& s) { s.Mapper->EmptySpaceSkippingOff(); })));
      EXPECT_GT(evictions, 20u);
    }
  }
}

// Gradients are computed where something is seen only, and not at all for a function that is 1.
TEST(GradientOpacity, CostsNothingWhereNothingIsSeen)
{
  const auto image = MakeImage({});
  Stage stage(40, 40);
  SetImage(stage, image);
  stage.SetTransfer(MakeTransfer(OpacityShape::Peak));
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
  stage.Mapper->CountSamplesOn();
  stage.Draw();
  const vtkTypeUInt64 seen = stage.Mapper->GetNumberOfEvaluatedSamples();
  EXPECT_EQ(stage.Mapper->GetNumberOfGradients(), 0u);
  stage.SetGradientOpacity({ { 0, 1 }, { 100, 1 } });
  stage.Draw();
  EXPECT_EQ(stage.Mapper->GetNumberOfGradients(), 0u);
  stage.SetGradientOpacity(Rising);
  stage.Draw();
  EXPECT_GT(stage.Mapper->GetNumberOfGradients(), 0u);
  EXPECT_LT(stage.Mapper->GetNumberOfGradients(), stage.Mapper->GetNumberOfSamples() / 2);
  EXPECT_GT(seen, 0u);
}
