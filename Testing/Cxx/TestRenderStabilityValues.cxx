// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Numerical stability against the reference integrator: extreme opacities, transfer functions and
// values.
#include "ExpectTruth.h"
#include "Scene.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <ostream>
#include <random>
#include <vtkCamera.h>
#include <vtkColorTransferFunction.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkPiecewiseFunction.h>
#include <vtkPointData.h>
#include <vtkRenderer.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr int BrickEdge = 16;
constexpr double Infinity = std::numeric_limits<double>::infinity();

void SetImage(Stage& stage, vtkImageData* image)
{
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.SetImage(image);
}

// Draws an image with a transfer function, and compares with the truth.
void ExpectImage(vtkImageData* image, const std::function<void(Stage&)>& setTransfer,
  const std::string& name, const std::vector<bool>& interpolations = { false, true })
{
  const auto source = SourceOfImage(image, BrickEdge, false);
  ASSERT_TRUE(source) << name;
  for (const bool nearest : interpolations)
  {
    Stage stage(40, 40);
    SetImage(stage, image);
    setTransfer(stage);
    stage.Property->SetInterpolationType(
      nearest ? VTK_NEAREST_INTERPOLATION : VTK_LINEAR_INTERPOLATION);
    stage.Look({ 0.5, 1, -0.3 }, 0.8);
    ExpectTruth(stage, *source, name + (nearest ? ", nearest" : ", linear"));
  }
}

void SetColors(Stage& stage, double low, double high)
{
  stage.Color->RemoveAllPoints();
  stage.Color->AddRGBPoint(low, 0.1, 0.2, 0.9);
  stage.Color->AddRGBPoint(high, 0.9, 0.8, 0.1);
}

} // namespace

// 8192 voxels deep, each of which takes a millionth of the light, or two. Together that is 0.012: a
// smaller tolerance makes an error of 2 % of it a failure.
TEST(StabilityOfOpacity, ThinOverALongPath)
{
  ImageOptions options;
  options.Type = ScalarType::Float32;
  options.Dimensions = { 4, 4, 8192 };
  options.High = 1;
  const auto image = MakeImage(options,
    [](double x, double y, double z) { return 0.5 + 0.25 * (x - y) + 0.24 * std::sin(150 * z); });
  const auto source = SourceOfImage(image, 64, false);
  Stage stage(8, 8);
  stage.Mapper->SetBrickSize(64);
  stage.Mapper->SetMaximumLevel(0);
  stage.SetImage(image);
  stage.Mapper->SetImageErrorTolerance(1.0 / 4096);
  stage.SetTransfer({ { { 0, 1e-6 }, { 1, 2e-6 } }, {}, 1 });
  SetColors(stage, 0, 1);
  vtkCamera* camera = stage.Renderer->GetActiveCamera();
  camera->SetParallelProjection(1);
  camera->SetFocalPoint(1.5, 1.5, 4096);
  camera->SetPosition(0.8, 0.9, -100);
  camera->SetViewUp(0, 1, 0);
  camera->SetParallelScale(0.7);
  camera->SetClippingRange(1, 20000);
  ExpectTruth(stage, *source, "opacity 1e-6, 8192 voxels");
}

// A single voxel lets a ten millionth of the light pass, its neighbours nearly all of it.
TEST(StabilityOfOpacity, AlmostOpaqueVoxel)
{
  ImageOptions options;
  options.Dimensions = { 20, 20, 20 };
  for (const ScalarType type : { ScalarType::UInt8, ScalarType::Float32 })
  {
    options.Type = type;
    const auto image = MakeImage(options,
      [](double x, double y, double z)
      {
        const auto in = [](double v) { return std::floor(20 * v) == 9; };
        return in(x) && in(y) && in(z) ? 1.0 : 0.05 * x;
      });
    for (const auto& [opacity, text] :
      { std::pair{ 1 - 1e-7, "1 - 1e-7" }, { 1 - 1e-12, "1 - 1e-12" }, { 1.0, "1" } })
    {
      ExpectImage(
        image,
        [&, nearly = opacity](Stage& stage)
        {
          stage.SetTransfer({ { { 0, 0 }, { 100, 1e-4 }, { 255, nearly } }, {}, 1 });
          SetColors(stage, 0, 255);
        },
        std::string("one voxel of opacity ") + text + ", " + ToString(type));
    }
  }
}

TEST(StabilityOfOpacity, UnitDistance)
{
  for (const double unit : { 1e-6, 1e6 })
  {
    for (const bool fits : { true, false })
    {
      // Voxels of the size of the unit distance, and voxels a million times larger or, because a
      // picture has to show something, five thousand times smaller.
      const double spacing = fits ? unit : unit < 1 ? 1 : 2e2;
      ImageOptions options;
      options.Spacing = { spacing, spacing, spacing };
      const auto image = MakeImage(options);
      for (const OpacityShape shape : { OpacityShape::Ramp, OpacityShape::Wall, OpacityShape::Fog })
      {
        ExpectImage(
          image,
          [&](Stage& stage)
          {
            TransferNodes nodes = MakeTransfer(shape, 0, 255, unit);
            if (unit > 1 && !fits)
            {
              for (auto& node : nodes.Opacity) // dense where there is anything at all
              {
                node[1] = node[1] > 0 && node[1] < 1 ? 1 - 1e-7 : node[1];
              }
            }
            stage.SetTransfer(nodes);
          },
          std::string("unit distance ") + (unit < 1 ? "1e-6" : "1e6") +
            (fits ? ", such voxels, " : ", other voxels, ") + ToString(shape));
      }
    }
  }
}

namespace
{

struct Function
{
  const char* Name;
  std::function<void(Stage&)> Set;
};

void PrintTo(const Function& function, std::ostream* out)
{
  *out << function.Name;
}

void AddOpacity(Stage& stage, const std::vector<std::array<double, 2>>& nodes)
{
  stage.Opacity->AllowDuplicateScalarsOn();
  for (const auto& node : nodes)
  {
    stage.Opacity->AddPoint(node[0], node[1]);
  }
  SetColors(stage, 0, 255);
}

// For 8-bit values and floats in 0 to 255.
std::vector<Function> Functions()
{
  std::vector<Function> functions;
  functions.push_back({ "StepOfSharpness",
    [](Stage& s)
    {
      s.Opacity->AddPoint(60.3, 0, 0.37, 1);
      s.Opacity->AddPoint(140.9, 0.3, 0.61, 1);
      s.Opacity->AddPoint(220, 0.02);
      SetColors(s, 0, 255);
    } });
  functions.push_back({ "StepOfTwoNodes", [](Stage& s) {
                         AddOpacity(s, { { 0, 0 }, { 90.7, 0 }, { 90.7, 0.2 }, { 255, 0.1 } });
                       } });
  functions.push_back({ "PeakWithoutWidth",
    [](Stage& s)
    {
      AddOpacity(s,
        { { 0, 0 }, { 60, 0.02 }, { 110.3, 0.03 }, { 110.3, 1 }, { 110.3, 0.03 }, { 255, 0.1 } });
    } });
  functions.push_back(
    { "GapWithoutWidth", [](Stage& s) {
       AddOpacity(s, { { 0, 0.01 }, { 80.5, 0.03 }, { 80.5, 0 }, { 80.5, 0.03 }, { 255, 0.1 } });
     } });
  functions.push_back({ "PeakOfATenthousandth",
    [](Stage& s)
    {
      AddOpacity(
        s, { { 0, 0.001 }, { 110.3, 0.001 }, { 110.35, 0.99 }, { 110.4, 0.001 }, { 255, 0.001 } });
    } });
  functions.push_back({ "OnePoint", [](Stage& s) { AddOpacity(s, { { 100, 0.02 } }); } });
  functions.push_back({ "OnePointOfColorAndOpacity",
    [](Stage& s)
    {
      s.Opacity->AddPoint(1e4, 0.02);
      s.Color->AddRGBPoint(-1e4, 0.3, 0.6, 0.9);
    } });
  functions.push_back({ "NotClamped",
    [](Stage& s)
    {
      // The only knots are those of the opacity, beyond which it is 0.
      s.Opacity->AddPoint(40.2, 0.02);
      s.Opacity->AddPoint(120.8, 0.1);
      s.Opacity->ClampingOff();
      s.Color->AddRGBPoint(90, 0.3, 0.6, 0.9);
    } });
  functions.push_back({ "FarBeyondTheData", [](Stage& s) {
                         AddOpacity(s, { { -1e9, 0 }, { 100, 0.04 }, { 1e9, 0.9 } });
                       } });
  return functions;
}

} // namespace

class StabilityOfFunctions : public testing::TestWithParam<Function>
{
};

TEST_P(StabilityOfFunctions, BytesAndFloats)
{
  ImageOptions options;
  ExpectImage(MakeImage(options), GetParam().Set, std::string(GetParam().Name) + ", u8");
  options.Type = ScalarType::Float32;
  ExpectImage(
    MakeImage(options), GetParam().Set, std::string(GetParam().Name) + ", f32", { false });
}

// Up to four points in an interval of the transfer table, in disorder.
TEST(StabilityOfManyPoints, TenThousand)
{
  ImageOptions options;
  options.Dimensions = { 12, 12, 40 };
  options.Type = ScalarType::Float32;
  const auto image =
    MakeImage(options, [](double x, double, double z) { return 0.9 * z + 0.1 * x; });
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(8, 8);
  SetImage(stage, image);
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  SetColors(stage, 0, 255);
  stage.Look({ 0.2, 0.3, 1 }, 0.5);
  StageTruth truth(stage, *source);
  // VTK's functions go through all of their points at each evaluation.
  std::vector<TruthTransfer::AlphaNode> nodes;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  stage.Opacity->RemoveAllPoints();
  for (int i = 0; i < 10000; ++i)
  {
    nodes.push_back({ 255 * (i + unit(random)) / 10000, 0.1 * unit(random) });
    stage.Opacity->AddPoint(nodes.back().Value, nodes.back().Alpha);
  }
  truth.SetTransfer(TruthTransfer::PiecewiseLinear(
    std::move(nodes), { { 0, { 0.1, 0.2, 0.9 } }, { 255, { 0.9, 0.8, 0.1 } } }, 1));
  ExpectTruth(stage, truth, "10000 points");
}

INSTANTIATE_TEST_SUITE_P(Functions, StabilityOfFunctions, testing::ValuesIn(Functions()),
  [](const auto& test) { return std::string(test.param.Name); });

namespace
{

struct Values
{
  const char* Name;
  ScalarType Type;
  double Low;
  double High;
};

void PrintTo(const Values& values, std::ostream* out)
{
  *out << values.Name;
}

} // namespace

class StabilityOfValues : public testing::TestWithParam<Values>
{
};

TEST_P(StabilityOfValues, RampAndBox)
{
  const Values& values = GetParam();
  ImageOptions options;
  options.Type = values.Type;
  options.Low = values.Low;
  options.High = values.High;
  const auto image = MakeImage(options);
  for (const OpacityShape shape : { OpacityShape::Ramp, OpacityShape::Box })
  {
    ExpectImage(
      image, [&](Stage& stage) { stage.SetTransfer(MakeTransfer(shape, values.Low, values.High)); },
      std::string(values.Name) + ", " + ToString(shape));
  }
}

INSTANTIATE_TEST_SUITE_P(Values, StabilityOfValues,
  testing::Values(
    // All in one step of a float, whose steps are 256 wide there.
    Values{ "UInt32", ScalarType::UInt32, 4294967100, 4294967230 },
    Values{ "Int32", ScalarType::Int32, -2147483640, -2147483550 },
    Values{ "Float64", ScalarType::Float64, 1e15, 1e15 + 100 },
    Values{ "Float64TinyRange", ScalarType::Float64, 1, 1 + 1e-9 },
    Values{ "Float64Large", ScalarType::Float64, -1e30, 1e30 },
    Values{ "Float32Large", ScalarType::Float32, -1e30, 1e30 },
    Values{ "Float32Small", ScalarType::Float32, 1e-30, 2e-30 },
    Values{ "Float32Narrow", ScalarType::Float32, 1000, 1000.0625 }),
  [](const auto& test) { return std::string(test.param.Name); });

namespace
{

// Blobs whose clumps of voxels are replaced by a value.
vtkSmartPointer<vtkImageData> WithClumps(ScalarType type, double value)
{
  ImageOptions options;
  options.Type = type;
  options.ShareOfNaN = 0.02;
  const auto image = MakeImage(options);
  vtkDataArray* scalars = image->GetPointData()->GetScalars();
  for (vtkIdType i = 0; i < scalars->GetNumberOfTuples(); ++i)
  {
    if (std::isnan(scalars->GetComponent(i, 0)))
    {
      scalars->SetComponent(i, 0, value);
    }
  }
  return image;
}

} // namespace

TEST(StabilityOfSpecialValues, Denormals)
{
  for (const ScalarType type : { ScalarType::Float32, ScalarType::Float64 })
  {
    const double tiny = type == ScalarType::Float32 ? 1e-42 : 1e-310;
    for (const double sign : { 1.0, -1.0 })
    {
      ExpectImage(
        WithClumps(type, sign * tiny),
        [](Stage& stage) { stage.SetTransfer(MakeTransfer(OpacityShape::Fog)); },
        std::string(ToString(type)) + (sign > 0 ? ", denormals" : ", negative denormals"));
    }
  }
}

// An infinite voxel lies beyond all nodes of the function.
TEST(StabilityOfSpecialValues, InfinitiesNearest)
{
  for (const ScalarType type : { ScalarType::Float32, ScalarType::Float64 })
  {
    for (const double sign : { 1.0, -1.0 })
    {
      const auto image = WithClumps(type, sign * Infinity);
      const auto source = SourceOfImage(image, BrickEdge, false);
      Stage stage(40, 40);
      SetImage(stage, image);
      stage.SetTransfer(MakeTransfer(OpacityShape::Fog));
      stage.Property->SetInterpolationTypeToNearest();
      stage.Look({ 0.5, 1, -0.3 }, 0.8);
      ExpectTruth(stage, *source, std::string(ToString(type)) + (sign > 0 ? ", +Inf" : ", -Inf"));
    }
  }
}

// The same function on other values, or on voxels of another size, is sampled anew.
TEST(StabilityOfOtherValues, SameFunction)
{
  ImageOptions options;
  options.High = 60;
  const auto dark = MakeImage(options);
  options.High = 255;
  const auto bright = MakeImage(options);
  options.Spacing = { 1e-3, 1e-3, 1e-3 };
  const auto small = MakeImage(options);
  Stage walked(40, 40);
  walked.SetTransfer(MakeTransfer(OpacityShape::Wall));
  for (const auto& image : { dark, bright, small, bright, dark })
  {
    const auto draw = [&](Stage& stage)
    {
      SetImage(stage, image);
      stage.Look({ 0.5, 1, -0.3 }, 0.8);
      return stage.Draw();
    };
    const std::vector<float> after = draw(walked);
    Stage fresh(40, 40);
    fresh.SetTransfer(MakeTransfer(OpacityShape::Wall));
    const std::vector<float> alone = draw(fresh);
    ASSERT_FALSE(after.empty());
    EXPECT_TRUE(AreImagesIdentical(after, alone))
      << CountDifferentBits(after, alone) << " values differ";
  }
}
