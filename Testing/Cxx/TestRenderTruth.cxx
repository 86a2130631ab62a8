// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// The picture against the reference integrator: accumulators within the image error tolerance of
// the envelope of truth over 9 rays within +-1/32 pixel.
#include "ExpectTruth.h"
#include "Scene.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <cmath>
#include <gtest/gtest.h>
#include <set>
#include <vtkCamera.h>
#include <vtkCellData.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkRenderer.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr int BrickEdge = 16;

void SetImage(Stage& stage, vtkImageData* image)
{
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.SetImage(image);
}

} // namespace

class TruthOfShapes : public testing::TestWithParam<OpacityShape>
{
};

TEST_P(TruthOfShapes, EveryCameraShadedAndNot)
{
  Stage stage(48, 48);
  const auto image = MakeImage({});
  const auto source = SourceOfImage(image, BrickEdge, false);
  SetImage(stage, image);
  stage.SetTransfer(MakeTransfer(GetParam()));
  for (const double tolerance : { 1.0 / 255, 1.0 / 1020 })
  {
    stage.Mapper->SetImageErrorTolerance(tolerance);
    for (const bool shade : { false, true })
    {
      stage.SetShade(shade);
      const std::string suffix = std::string(shade ? ", shaded" : ", unshaded") +
        (tolerance < 1.0 / 500 ? ", 1/1020" : ", 1/255");
      stage.Look({ 0.3, 1, -0.4 }, 0.8);
      ExpectTruth(stage, *source, ToString(GetParam()) + std::string(", perspective") + suffix);
      stage.Renderer->GetActiveCamera()->SetWindowCenter(0.35, -0.2);
      ExpectTruth(stage, *source, ToString(GetParam()) + std::string(", off-axis") + suffix);
      stage.Renderer->GetActiveCamera()->SetWindowCenter(0, 0);
      stage.Look({ -1, 0.4, 0.2 }, 0.7, true);
      ExpectTruth(stage, *source, ToString(GetParam()) + std::string(", parallel") + suffix);
      stage.LookFrom({ 14, 15, 16 }, { 30, 22, 25 }, 0.01, 100, 60);
      ExpectTruth(stage, *source, ToString(GetParam()) + std::string(", inside") + suffix);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Contract, TruthOfShapes,
  testing::Values(OpacityShape::Ramp, OpacityShape::Peak, OpacityShape::Box, OpacityShape::Wall,
    OpacityShape::Fog),
  [](const auto& test) { return std::string(ToString(test.param)); });

class TruthOfTypes : public testing::TestWithParam<ScalarType>
{
};

TEST_P(TruthOfTypes, PointAndCellDataLinearAndNearest)
{
  ImageOptions options = OptionsOfType(GetParam());
  for (const bool cellData : { false, true })
  {
    options.CellData = cellData;
    const auto image = MakeImage(options);
    const auto source = SourceOfImage(image, BrickEdge, cellData);
    ASSERT_TRUE(source);
    Stage stage(40, 40);
    SetImage(stage, image);
    for (const OpacityShape shape : { OpacityShape::Ramp, OpacityShape::Box })
    {
      stage.SetTransfer(MakeTransfer(shape, options.Low, options.High));
      for (const bool nearest : { false, true })
      {
        stage.Property->SetInterpolationType(
          nearest ? VTK_NEAREST_INTERPOLATION : VTK_LINEAR_INTERPOLATION);
        stage.Look({ 0.5, 1, -0.3 }, 0.8);
        ExpectTruth(stage, *source,
          std::string(ToString(GetParam())) + (cellData ? ", cells" : ", points") +
            (nearest ? ", nearest, " : ", linear, ") + ToString(shape));
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Contract, TruthOfTypes, testing::ValuesIn(AllScalarTypes),
  [](const auto& test) { return std::string(ToString(test.param)); });

// A place with a NaN among its voxels adds nothing. Rays are cut where that begins and ends, at the
// faces between voxel centres.
// Between two voxels a ray may meet the peak only where the field turns back, twice in a cell.
TEST(Truth, NarrowPeakInNoise)
{
  const auto image = MakeImage({}, NoiseField);
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(36, 36);
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.SetImage(image);
  stage.SetTransfer(MakeTransfer(OpacityShape::Peak));
  for (const bool shade : { false, true })
  {
    stage.SetShade(shade);
    const std::string shaded = shade ? ", shaded" : "";
    stage.Look({ 0.3, 1, -0.4 }, 0.8);
    ExpectTruth(stage, *source, "outside" + shaded);
    stage.LookFrom({ 14, 15, 16 }, { 30, 22, 25 }, 0.01, 100, 60);
    ExpectTruth(stage, *source, "inside" + shaded);
  }
}

TEST(Truth, NaN)
{
  for (const ScalarType type : { ScalarType::Float32, ScalarType::Float64 })
  {
    ImageOptions options;
    options.Type = type;
    options.ShareOfNaN = 0.02;
    const auto image = MakeImage(options);
    const auto source = SourceOfImage(image, BrickEdge, false);
    Stage stage(40, 40);
    SetImage(stage, image);
    stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    stage.Look({ 0.5, 1, -0.3 }, 0.8);
    ExpectTruth(stage, *source, std::string("NaN, linear, ") + ToString(type));
    stage.Property->SetInterpolationTypeToNearest();
    ExpectTruth(stage, *source, std::string("NaN, nearest, ") + ToString(type));
  }
}

TEST(Truth, StretchedVoxels)
{
  ImageOptions options;
  options.Dimensions = { 40, 44, 12 };
  options.Spacing = { 1, 1, 5 };
  const auto image = MakeImage(options);
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(48, 48);
  SetImage(stage, image);
  for (const bool shade : { false, true })
  {
    stage.SetShade(shade);
    for (const OpacityShape shape : { OpacityShape::Ramp, OpacityShape::Box })
    {
      stage.SetTransfer(MakeTransfer(shape));
      stage.Look({ 0.5, 1, -0.6 }, 0.8);
      ExpectTruth(stage, *source,
        std::string("1:1:5, ") + ToString(shape) + (shade ? ", shaded" : ", unshaded"));
    }
  }
}

TEST(Truth, RotatedLeftHandedMovedAndScaled)
{
  ImageOptions options;
  options.ExtentStart = { -7, 5, 11 };
  options.Origin = { 3, -20, 8 };
  options.Spacing = { 0.7, 1.1, 0.9 };
  const double c = std::cos(0.6);
  const double s = std::sin(0.6);
  for (const bool left : { false, true })
  {
    const double sign = left ? -1 : 1;
    options.Direction = { c, -s, 0, s, c, 0, 0, 0, sign };
    const auto image = MakeImage(options);
    const auto source = SourceOfImage(image, BrickEdge, false);
    Stage stage(48, 48);
    SetImage(stage, image);
    stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    for (const bool shade : { false, true })
    {
      stage.SetShade(shade);
      for (const bool moved : { false, true })
      {
        // Uneven scales: the unit distance is measured before them.
        stage.Volume->SetOrientation(0, 0, 0);
        stage.Volume->SetScale(1, 1, 1);
        stage.Volume->SetPosition(0, 0, 0);
        if (moved)
        {
          stage.Volume->RotateX(25);
          stage.Volume->RotateZ(-40);
          stage.Volume->SetScale(1.5, 0.8, 1.2);
          stage.Volume->SetPosition(10, 4, -2);
        }
        stage.Look({ 0.5, 1, -0.6 }, 0.8);
        ExpectTruth(stage, *source,
          std::string(left ? "left-handed" : "rotated") + (moved ? ", prop matrix" : "") +
            (shade ? ", shaded" : ", unshaded"));
      }
    }
  }
}

// Far away: several levels in one picture, each where the closed form of the camera puts it.
TEST(Truth, LevelsInOnePicture)
{
  ImageOptions options;
  options.Dimensions = { 96, 80, 112 };
  const auto image = MakeImage(options);
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(40, 40);
  SetImage(stage, image);
  for (const bool shade : { false, true })
  {
    stage.SetShade(shade);
    for (const OpacityShape shape : { OpacityShape::Ramp, OpacityShape::Box, OpacityShape::Fog })
    {
      stage.SetTransfer(MakeTransfer(shape, 0, 255, 2));
      const std::string suffix = std::string(ToString(shape)) + (shade ? ", shaded" : ", unshaded");
      stage.LookFrom({ 30, -15, 40 }, { 50, 60, 60 }, 0.5, 400, 60);
      ExpectTruth(stage, *source, "levels 0 to 2, perspective, " + suffix);
      stage.Look({ 0.3, 1, -0.4 }, 3);
      ExpectTruth(stage, *source, "coarse level, far, " + suffix);
      stage.Look({ 0.3, 1, -0.4 }, 2, true);
      ExpectTruth(stage, *source, "coarse level, parallel, " + suffix);
      stage.Mapper->SetLevelOfDetailBias(1);
      stage.LookFrom({ 30, -15, 40 }, { 50, 60, 60 }, 0.5, 400, 60);
      ExpectTruth(stage, *source, "bias 1, " + suffix);
      stage.Mapper->SetLevelOfDetailBias(0);
      stage.Mapper->SetMaximumLevel(1);
      stage.Look({ 0.3, 1, -0.4 }, 3);
      ExpectTruth(stage, *source, "at most level 1, " + suffix);
      stage.Mapper->SetMaximumLevel(31);
      stage.Mapper->SetMinimumLevel(2);
      stage.Look({ 0.3, 1, -0.4 }, 1);
      ExpectTruth(stage, *source, "at least level 2, " + suffix);
      stage.Mapper->SetMinimumLevel(0);
    }
  }
}

// Levels shown: the level of the first contribution. In fog that is where the ray enters the box.
TEST(Truth, LevelsShown)
{
  ImageOptions options;
  options.Dimensions = { 96, 80, 112 };
  const auto image = MakeImage(options);
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(64, 64);
  SetImage(stage, image);
  TransferNodes nodes = MakeTransfer(OpacityShape::Fog);
  nodes.Opacity = { { 0, 0.01 }, { 255, 0.01 } };
  stage.SetTransfer(nodes);
  stage.Mapper->SetDebugViewToLevels();
  for (const bool parallel : { false, true })
  {
    if (parallel)
    {
      stage.Look({ 0.5, 0.7, -0.4 }, 2.5, true);
    }
    else
    {
      stage.LookFrom({ -30, -100, 170 }, { 60, 60, 30 }, 0.5, 500, 70);
    }
    const std::vector<float> picture = stage.Draw();
    const StageTruth truth(stage, *source);
    int different = 0;
    int seen = 0;
    std::set<int> levels;
    for (int y = 0; y < stage.Height(); ++y)
    {
      for (int x = 0; x < stage.Width(); ++x)
      {
        const float* pixel = picture.data() + 4 * (static_cast<std::size_t>(y) * stage.Width() + x);
        const auto spans = LevelSpans(truth.Scene(), x, y);
        if (spans.empty())
        {
          EXPECT_EQ(pixel[0], 0) << x << ", " << y;
          continue;
        }
        // Within a rounding of the plane where the level changes, both are right.
        const bool sharp =
          spans.size() < 2 || spans[0].DepthEnd - spans[0].DepthBegin > 1e-3 * spans[0].DepthEnd;
        if (!sharp || spans.back().DepthEnd - spans[0].DepthBegin < 0.05)
        {
          continue;
        }
        ++seen;
        levels.insert(spans[0].Level);
        const int shown = static_cast<int>(std::lround(pixel[0] * 32)) - 1;
        different += shown != spans[0].Level ? 1 : 0;
        if (shown != spans[0].Level && different < 5)
        {
          ADD_FAILURE() << "pixel " << x << ", " << y << ": level " << shown << " instead of "
                        << spans[0].Level << ", which ends "
                        << spans[0].DepthEnd - spans[0].DepthBegin << " behind the entry";
        }
      }
    }
    EXPECT_EQ(different, 0);
    EXPECT_GT(seen, 300);
    EXPECT_GE(levels.size(), parallel ? 1u : 2u);
  }
}
