// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Numerical stability: colours that jump where the extinction doesn't, floats and doubles close
// together, huge or tiny, and steps of a function between float voxels.
#include "ExpectTruth.h"
#include "Scene.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <vtkColorTransferFunction.h>
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

void ExpectImage(vtkImageData* image, BrickSource& source, const std::function<void(Stage&)>& set,
  const std::string& name)
{
  Stage stage(40, 40);
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.SetImage(image);
  set(stage);
  stage.Look({ 0.5, 1, -0.3 }, 0.8);
  ExpectTruth(stage, source, name);
}

void ExpectColors(const std::function<void(vtkColorTransferFunction*)>& set, const char* name)
{
  const auto image = MakeImage({});
  const auto source = SourceOfImage(image, BrickEdge, false);
  ExpectImage(
    image, *source,
    [&](Stage& stage)
    {
      stage.Opacity->AddPoint(100, 0.02);
      set(stage.Color);
    },
    name);
}

} // namespace

// The extinction doesn't say where the colour changes.
TEST(StabilityOfColors, KinkInEvenFog)
{
  ExpectColors(
    [](vtkColorTransferFunction* color)
    {
      color->AddRGBPoint(0, 0.1, 0.2, 0.9);
      color->AddRGBPoint(102, 0.9, 0.3, 0.2);
      color->AddRGBPoint(255, 0.4, 1, 1);
    },
    "colour with a kink");
}

TEST(StabilityOfColors, StepInEvenFog)
{
  ExpectColors(
    [](vtkColorTransferFunction* color)
    {
      color->AddRGBPoint(0, 1, 0, 0, 0.47, 1);
      color->AddRGBPoint(200.7, 0, 1, 0.5);
    },
    "colour with a step");
}

TEST(StabilityOfColors, BandsInEvenFog)
{
  ExpectColors(
    [](vtkColorTransferFunction* color)
    {
      for (int i = 0; i <= 32; ++i)
      {
        color->AddRGBPoint(8 * i, i % 2, 0.5, 1 - i % 2);
      }
    },
    "colour with 32 bands");
}

// A cell with an infinite corner has no value inside, as with NaN.
TEST(StabilityOfSpecialValues, InfinitiesLinear)
{
  for (const double value :
    { std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity() })
  {
    ImageOptions options;
    options.Type = ScalarType::Float32;
    options.ShareOfNaN = 0.02;
    const auto withNaN = MakeImage(options);
    const auto image = MakeImage(options);
    vtkDataArray* scalars = image->GetPointData()->GetScalars();
    for (vtkIdType i = 0; i < scalars->GetNumberOfTuples(); ++i)
    {
      if (std::isnan(scalars->GetComponent(i, 0)))
      {
        scalars->SetComponent(i, 0, value);
      }
    }
    const auto source = SourceOfImage(withNaN, BrickEdge, false);
    ExpectImage(
      image, *source,
      [](Stage& stage)
      {
        stage.Opacity->AddPoint(100, 0.05);
        stage.Color->AddRGBPoint(0, 0.1, 0.2, 0.9);
        stage.Color->AddRGBPoint(255, 0.9, 0.8, 0.1);
      },
      value > 0 ? "+Inf" : "-Inf");
  }
}

namespace
{

void ExpectFloats(ScalarType type, double low, double high, const char* name)
{
  ImageOptions options;
  options.Type = type;
  options.Low = low;
  options.High = high;
  const auto image = MakeImage(options);
  const auto source = SourceOfImage(image, BrickEdge, false);
  ExpectImage(
    image, *source,
    [&](Stage& stage) { stage.SetTransfer(MakeTransfer(OpacityShape::Ramp, low, high)); }, name);
}

} // namespace

// What lies between two neighbouring floats is no float: interpolation must not round to one of
// them (BrickTexels stores differences).
TEST(StabilityOfFloats, RangeOfOneStep)
{
  const float low = 1000;
  ExpectFloats(ScalarType::Float32, low, std::nextafter(low, 2000.0f), "range of one ulp");
}

TEST(StabilityOfFloats, RangeOfSixteenSteps)
{
  const float low = 1024;
  ExpectFloats(ScalarType::Float32, low, low + 16.0 / 8192, "range of 16 ulp");
}

// Differences of voxels and ends of a range would overflow in float (ScaledBrickSource).
TEST(StabilityOfFloats, WholeRangeOfFloat)
{
  ExpectFloats(ScalarType::Float32, -3.4e38, 3.4e38, "whole range, f32");
  ExpectFloats(ScalarType::Float64, -3.4e38, 3.4e38, "whole range, f64");
}

// Nodes per unit of value would overflow in float.
TEST(StabilityOfFloats, TinyRange)
{
  ExpectFloats(ScalarType::Float32, 0, 1e-36, "0...1e-36, f32");
  ExpectFloats(ScalarType::Float32, 0, 1e-39, "all denormal, f32");
}

// Doubles beyond the range of floats.
TEST(StabilityOfFloats, BeyondFloat)
{
  ExpectFloats(ScalarType::Float64, 0, 1e-100, "0...1e-100, f64");
  ExpectFloats(ScalarType::Float64, 0, 1e100, "0...1e100, f64");
}

// No voxel has a value between both sides of a jump, however close to it.
TEST(StabilityOfSteps, Nearest)
{
  ImageOptions options;
  options.Type = ScalarType::Float32;
  const auto image = MakeImage(options);
  const auto source = SourceOfImage(image, BrickEdge, false);
  ExpectImage(
    image, *source,
    [](Stage& stage)
    {
      stage.Opacity->AddPoint(60.3, 0, 0.37, 1);
      stage.Opacity->AddPoint(140.9, 0.3, 0.61, 1);
      stage.Opacity->AddPoint(220, 0.02);
      stage.Color->AddRGBPoint(0, 0.1, 0.2, 0.9);
      stage.Color->AddRGBPoint(255, 0.9, 0.8, 0.1);
      stage.Property->SetInterpolationTypeToNearest();
    },
    "step, nearest, f32");
}

// Nor does anything even out what a table is off where a steep function bends.
TEST(StabilityOfSteps, SteepRampsNearest)
{
  ImageOptions options;
  options.Type = ScalarType::Float32;
  const auto image = MakeImage(options);
  const auto source = SourceOfImage(image, BrickEdge, false);
  ExpectImage(
    image, *source,
    [](Stage& stage)
    {
      for (double v = 20.37; v < 240; v += 12.1)
      {
        stage.Opacity->AddPoint(v, 0.001);
        stage.Opacity->AddPoint(v + 0.51, 0.4);
        stage.Opacity->AddPoint(v + 1.02, 0.001);
      }
      stage.Color->AddRGBPoint(0, 0.1, 0.2, 0.9);
      stage.Color->AddRGBPoint(255, 0.9, 0.8, 0.1);
      stage.Property->SetScalarOpacityUnitDistance(0.05);
      stage.Property->SetInterpolationTypeToNearest();
    },
    "steep ramps, nearest, f32");
}
