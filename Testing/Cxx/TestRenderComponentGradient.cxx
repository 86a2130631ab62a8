// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Opacity by gradient of voxels with several components: the truth, the picture of a single
// component, VTK's own mapper, and that the picture depends on no budget and on no skipping.
#include "BesideVTK.h"
#include "ComponentScene.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <gtest/gtest.h>
#include <random>
#include <string>
#include <vector>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPiecewiseFunction.h>
#include <vtkPointData.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr int BrickEdge = 16;
using Nodes = std::vector<std::array<double, 2>>;

// For values of 0 to 255.
const Nodes Rising = { { 2, 0 }, { 14, 1 } };
const Nodes Peak = { { 6, 0.1 }, { 9, 1 }, { 12, 0.2 } };
const Nodes Step = { { 9.999, 0 }, { 10.001, 0.8 } };
const Nodes Falling = { { 3, 1 }, { 12, 0.3 } };

void SetGradient(Stage& stage, int component, const Nodes& nodes, double stretch = 1)
{
  vtkNew<vtkPiecewiseFunction> function;
  for (const auto& node : nodes)
  {
    function->AddPoint(node[0] * stretch, node[1]);
  }
  stage.Property->SetGradientOpacity(component, function);
}

const std::vector<OpacityShape> Mixed = { OpacityShape::Ramp, OpacityShape::Peak, OpacityShape::Box,
  OpacityShape::Fog };

void Show(Stage& stage, vtkImageData* image, int functions, const ImageOptions& options = {})
{
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.SetImage(image);
  SetComponentTransfer(
    stage, { Mixed.begin(), Mixed.begin() + functions }, options.Low, options.High, 1);
  stage.Look({ 0.3, 1, -0.4 }, 0.8);
}

} // namespace

// Each component by a function of its own, one of them by none.
TEST(ComponentGradients, IndependentOnesWithinTheTolerance)
{
  for (const int n : { 2, 3, 4 })
  {
    if (n > 2 && !TakesAll())
    {
      break; // each way is a shader to compile
    }
    Stage stage(32, 32);
    const auto image = MakeComponentImage({}, n);
    const auto source = SourceOfImage(image, BrickEdge, false);
    Show(stage, image, n);
    SetGradient(stage, 0, Rising);
    SetGradient(stage, 1, n == 3 ? Step : Peak);
    if (n == 4)
    {
      SetGradient(stage, 3, Falling);
    }
    const std::string name = std::to_string(n) + " independent";
    ExpectComponentTruth(stage, source, name + ", 1/255");
    stage.Property->SetComponentWeight(0, 0.7);
    stage.SetShade(true);
    ExpectComponentTruth(stage, source, name + ", weight, shaded");
    if (n == 2)
    {
      stage.Mapper->SetImageErrorTolerance(1.0 / 1020);
      stage.LookFrom({ 14, 15, 16 }, { 30, 22, 25 }, 0.01, 100, 60);
      ExpectComponentTruth(stage, source, name + ", inside, 1/1020");
    }
  }
}

// By the gradient of the last one.
TEST(ComponentGradients, DependentOnesWithinTheTolerance)
{
  for (const int n : { 4, 2 })
  {
    if (n == 2 && !TakesAll())
    {
      break;
    }
    Stage stage(32, 32);
    const auto image = MakeComponentImage({}, n);
    const auto source = SourceOfImage(image, BrickEdge, false);
    Show(stage, image, 1);
    stage.Property->IndependentComponentsOff();
    for (const Nodes& nodes : { Rising, Step })
    {
      SetGradient(stage, 0, nodes);
      ExpectComponentTruth(stage, source, std::to_string(n) + " dependent");
    }
    stage.SetShade(true);
    ExpectComponentTruth(stage, source, std::to_string(n) + " dependent, shaded");
  }
}

// Types, missing values, nearest neighbours, spacings, turned and stretched, coarser levels.
TEST(ComponentGradients, RandomScenesWithinTheTolerance)
{
  RandomNumbers random(2207);
  for (int scene = 0; scene < (TakesAll() ? 12 : 4); ++scene)
  {
    const RandomComponents chosen(random, 0.005);
    const int n = chosen.Count;
    const bool dependent = chosen.Dependent;
    const ImageOptions& options = chosen.Options;
    const auto image = MakeComponentImage(options, n);
    const auto source = SourceOfImage(image, BrickEdge, false);
    Stage stage(14, 14);
    Show(stage, image, dependent ? 1 : n, options);
    stage.Property->SetIndependentComponents(dependent ? 0 : 1);
    const double stretch = (options.High - options.Low) / 255 * random.Uniform(0.5, 2);
    for (int c = 0; c < (dependent ? 1 : n); ++c)
    {
      if (c == 0 || random.Uniform(0, 1) < 0.6)
      {
        SetGradient(stage, c, *random.Chosen(&Rising, &Peak, &Step, &Falling), stretch);
      }
      stage.Property->SetComponentWeight(c, random.Chosen(1.0, 1.0, 0.8, 0.3, c == 0 ? 1.0 : 0.0));
      stage.Property->SetScalarOpacityUnitDistance(c, std::exp(random.Uniform(-2.5, -0.5)));
    }
    const bool shaded = random.Uniform(0, 1) < 0.4;
    const bool nearest = random.Uniform(0, 1) < 0.25;
    stage.SetShade(shaded);
    stage.Property->SetInterpolationType(
      nearest ? VTK_NEAREST_INTERPOLATION : VTK_LINEAR_INTERPOLATION);
    stage.Volume->RotateX(random.Uniform(0, 90));
    stage.Volume->SetScale(random.Uniform(0.7, 1.4), random.Uniform(0.7, 1.4), 1);
    stage.Look({ random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(0.1, 1) },
      random.Chosen(0.3, 0.8, 1.2, 3.0), random.Uniform(0, 1) < 0.3);
    ExpectComponentTruth(stage, source,
      std::to_string(scene) + ": " + std::to_string(n) + " of " + ToString(options.Type) +
        (dependent ? ", dependent" : "") + (shaded ? ", shaded" : "") +
        (nearest ? ", nearest" : ""));
  }
}

// Of two, one of which has no weight: what a volume of the other alone shows.
TEST(ComponentGradients, OneOfTwoIsThePictureOfOne)
{
  const auto image = MakeComponentImage({}, 2);
  vtkDataArray* both = image->GetPointData()->GetScalars();
  const auto one = MakeImage({});
  one->GetPointData()->GetScalars()->CopyComponent(0, both, 1);
  const auto draw = [](vtkImageData* of, int component)
  {
    Stage stage(40, 40);
    stage.Mapper->SetImageErrorTolerance(1.0 / 1020);
    Show(stage, of, component + 1);
    SetComponentTransfer(stage, { OpacityShape::Box, OpacityShape::Box }, 0, 255, 1);
    SetGradient(stage, component, Rising);
    stage.Property->SetComponentWeight(0, component == 0 ? 1 : 0);
    stage.SetShade(true);
    std::vector<float> picture = stage.Draw();
    EXPECT_TRUE(stage.Mapper->IsConverged());
    return picture;
  };
  std::vector<float> single = draw(one, 0);
  // Component 1 has colours of its own; opacities are the same.
  const std::vector<float> second = draw(image, 1);
  double largest = 0;
  double difference = 0;
  for (std::size_t i = 3; i < single.size(); i += 4)
  {
    largest = std::max(largest, static_cast<double>(single[i]));
    difference = std::max(difference, std::abs(static_cast<double>(single[i] - second[i])));
  }
  EXPECT_GT(largest, 0.3);
  EXPECT_LE(difference, 2.0 / 1020);
}

// Contracts 1 to 3; both instruction sets, where there are two.
TEST(ComponentGradients, SameBitsAtAnyBudgetAndWithoutSkipping)
{
  struct Case
  {
    unsigned Slots;
    bool Skip;
    bool Baseline;
  };
  ImageOptions options;
  options.Dimensions = { 56, 48, 64 };
  const auto image = MakeComponentImage(options, 4);
  for (const bool dependent : { false, true })
  {
    if (dependent && !TakesAll())
    {
      break;
    }
    std::vector<float> first;
    vtkTypeUInt64 evictions = 0;
    for (const Case& c : { Case{ 0, true, false }, Case{ 0, false, false }, Case{ 3, true, true },
           Case{ 6, false, false } })
    {
      setenv("TERAVOX_NATIVE_ISA", c.Baseline ? "baseline" : "any", 1);
      Stage stage(28, 28);
      Show(stage, image, 4);
      for (int k = 0; k < 4; ++k)
      {
        SetGradient(stage, k, k % 2 == 0 ? Rising : Peak);
      }
      stage.Property->SetIndependentComponents(dependent ? 0 : 1);
      stage.SetShade(true);
      stage.Mapper->SetMaximumLevel(0);
      stage.Mapper->SetMaximumNumberOfSlots(c.Slots);
      stage.Mapper->SetEmptySpaceSkipping(c.Skip ? 1 : 0);
      stage.Mapper->SetArrivalShuffleSeed(c.Slots);
      const std::vector<float> picture = stage.Draw();
      unsetenv("TERAVOX_NATIVE_ISA");
      ASSERT_TRUE(stage.Mapper->IsConverged());
      EXPECT_EQ(stage.Mapper->CheckInvariants(), "");
      evictions += stage.Mapper->GetNumberOfEvictions();
      first = first.empty() ? picture : first;
      EXPECT_TRUE(AreImagesIdentical(picture, first))
        << c.Slots << " slots, skipping " << c.Skip << ", baseline " << c.Baseline
        << ": largest difference " << CompareImages(picture, first).Max;
    }
    EXPECT_GT(evictions, 20u);
    EXPECT_GT(*std::max_element(first.begin(), first.end()), 0.1f);
  }
}

// Steps of a given length, with their square; and no gradients for functions that are 1.
TEST(ComponentGradients, StepsOfAGivenLengthConverge)
{
  Stage stage(32, 32);
  const auto image = MakeComponentImage({}, 2);
  const auto source = SourceOfImage(image, BrickEdge, false);
  Show(stage, image, 2);
  SetComponentTransfer(stage, { OpacityShape::Ramp, OpacityShape::Fog }, 0, 255, 1);
  stage.Mapper->CountSamplesOn();
  SetGradient(stage, 0, { { 0, 1 }, { 100, 1 } });
  stage.Draw();
  EXPECT_EQ(stage.Mapper->GetNumberOfGradients(), 0u);
  SetGradient(stage, 0, Rising);
  SetGradient(stage, 1, Falling);
  stage.Draw();
  EXPECT_GT(stage.Mapper->GetNumberOfGradients(), 0u);
  const ComponentTruth truth(stage, source);
  stage.Mapper->SetImageErrorTolerance(0);
  double before = 0;
  for (const float step : { 1.0f, 0.5f, 0.25f })
  {
    stage.Mapper->SetSampleDistance(step);
    const ImageDifference plain = truth.Excess(stage.Draw(), 1e9);
    EXPECT_TRUE(before == 0 || plain.Mean < 0.4 * before) << step << ": " << 255 * plain.Mean;
    before = plain.Mean;
  }
}

// VTK 9.1 multiplies the opacity of each independent component with the functions of all of them at
// its own gradient: there the others are 1. Of dependent ones it takes the gradient of the first,
// here the same as that of the last. Its magnitudes are larger by 1/43 to 1/35 (see
// GradientOpacity.BesideVTK).
TEST(ComponentGradients, BesideVTK)
{
  struct Case
  {
    int Count;
    bool Dependent;
    bool Shade;
  };
  for (const Case& c : { Case{ 2, false, true }, Case{ 2, true, false } })
  {
    const auto field = [&](int i, double x, double y, double z)
    { return i == 0 || c.Dependent ? BlobField(x, y, z) : BlobField(1 - z, 1 - x, y); };
    ImageOptions options;
    const auto image = MakeComponentImage(options, c.Count, field);
    options.Type = ScalarType::UInt16;
    const auto wide = MakeComponentImage(options, c.Count, field);
    BesideVTK both({}, 24);
    Stage& stage = both.Shown;
    Show(stage, image, 1);
    SetComponentTransfer(stage,
      std::vector<OpacityShape>(static_cast<std::size_t>(c.Count), OpacityShape::Ramp), 0, 255, 1);
    both.Prepare = [&](bool theirs)
    {
      for (int k = 0; k < c.Count; ++k)
      {
        SetGradient(stage, k, theirs && k > 0 ? Nodes{ { 0, 1 } } : Rising);
      }
    };
    stage.Property->SetIndependentComponents(c.Dependent ? 0 : 1);
    stage.SetShade(c.Shade);
    stage.Mapper->SetMaximumLevel(0);
    both.Theirs->SetInputData(wide);
    both.Expect(std::to_string(c.Count) + (c.Dependent ? " dependent" : " independent") +
      (c.Shade ? ", shaded" : ""));
  }
}

// Native functions are stretched over the range that the component itself has, as VTK's are.
TEST(ComponentGradients, NativeRangesAreThoseOfTheComponent)
{
  const auto field = [](int c, double x, double y, double z)
  { return c == 0 ? BlobField(x, y, z) : 0.2 + 0.3 * BlobField(1 - z, 1 - x, y); };
  ImageOptions options;
  const auto image = MakeComponentImage(options, 2, field);
  options.Type = ScalarType::UInt16;
  const auto wide = MakeComponentImage(options, 2, field);
  BesideVTK both({}, 24);
  Stage& stage = both.Shown;
  Show(stage, image, 2);
  SetComponentTransfer(stage, { OpacityShape::Ramp, OpacityShape::Ramp }, 0, 1, 1);
  both.Theirs->SetInputData(wide);
  stage.Mapper->SetMaximumLevel(0);
  for (vtkGPUVolumeRayCastMapper* mapper :
    { static_cast<vtkGPUVolumeRayCastMapper*>(both.Theirs.Get()),
      static_cast<vtkGPUVolumeRayCastMapper*>(stage.Mapper.Get()) })
  {
    mapper->SetScalarOpacityRangeType(vtkGPUVolumeRayCastMapper::NATIVE);
    mapper->SetColorRangeType(vtkGPUVolumeRayCastMapper::NATIVE);
  }
  both.Expect("native ranges of two components");
}
