// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Binary masks of volumes with several components, composite blending (other blend modes:
// TestRenderComponentBlend): the truth, VTK's own mapper, and that the picture depends on no budget
// and on no skipping.
#include "BesideVTK.h"
#include "ComponentScene.h"
#include "EachWay.h"
#include "MaskImages.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cstdlib>
#include <gtest/gtest.h>
#include <string>
#include <vector>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPiecewiseFunction.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr int BrickEdge = 16;

void Show(Stage& stage, vtkImageData* image, int functions, const ImageOptions& options = {})
{
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.SetImage(image);
  const std::vector<OpacityShape> shapes = { OpacityShape::Ramp, OpacityShape::Peak,
    OpacityShape::Box, OpacityShape::Wall };
  SetComponentTransfer(
    stage, { shapes.begin(), shapes.begin() + functions }, options.Low, options.High, 1);
  stage.Look({ 0.3, 1, -0.4 }, 0.8);
}

} // namespace

TEST(ComponentMasks, EachWayAndTypeWithinTheTolerance)
{
  struct Case
  {
    ScalarType Type;
    int Count;
    bool Dependent;
  };
  for (const Case& c : { Case{ ScalarType::UInt8, 2, false }, Case{ ScalarType::Float32, 3, false },
         Case{ ScalarType::Int16, 4, false }, Case{ ScalarType::UInt8, 4, true } })
  {
    // Each way of each case is a shader to compile.
    if (!TakesAll() && (c.Count == 2 || c.Type == ScalarType::Int16))
    {
      continue;
    }
    const ImageOptions options = OptionsOfType(c.Type);
    const InMask isIn = Sponge(options.Dimensions);
    const auto image = MakeComponentImage(options, c.Count);
    const auto source = SourceOfImage(image, BrickEdge, false);
    Stage stage(24, 24);
    Show(stage, image, c.Dependent ? 1 : c.Count, options);
    stage.Property->SetIndependentComponents(c.Dependent ? 0 : 1);
    SetMask(stage.Mapper, MaskImage(options.Dimensions, isIn));
    ForEachWay(stage,
      [&](const std::string& way)
      {
        ExpectComponentTruth(stage, source,
          std::to_string(c.Count) + (c.Dependent ? " dependent, " : " independent, ") +
            ToString(c.Type) + way,
          {}, MaskLevels(source->Info().Layout, isIn));
      });
  }
}

// With opacity by gradient, and of several levels in a few slots.
TEST(ComponentMasks, GradientsAndLevelsWithinTheTolerance)
{
  ImageOptions options;
  options.Dimensions = { 96, 80, 112 };
  const InMask isIn = Sponge(options.Dimensions);
  const auto image = MakeComponentImage(options, 2);
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(28, 28);
  Show(stage, image, 2);
  vtkNew<vtkPiecewiseFunction> gradient;
  gradient->AddPoint(1, 0);
  gradient->AddPoint(6, 1);
  stage.Property->SetGradientOpacity(0, gradient);
  stage.Mapper->SetMaximumNumberOfSlots(12);
  stage.Mapper->SetLevelOfDetailBias(1);
  stage.LookFrom({ 30, -12, 40 }, { 50, 60, 60 }, 0.5, 400, 65);
  SetMask(stage.Mapper, MaskImage(options.Dimensions, isIn));
  ExpectComponentTruth(
    stage, source, "gradients, levels, 12 slots", {}, MaskLevels(source->Info().Layout, isIn));
}

// Contracts 1 to 3; both instruction sets, where there are two. A mask of ones changes nothing.
TEST(ComponentMasks, SameBitsAtAnyBudgetAndWithoutSkipping)
{
  ImageOptions options;
  options.Dimensions = { 56, 48, 64 };
  const auto image = MakeComponentImage(options, 3);
  const auto sponge = MaskImage(options.Dimensions, Sponge(options.Dimensions));
  const auto ones = MaskImage(options.Dimensions, [](auto, auto, auto) { return true; });
  for (const bool nearest : { false, true })
  {
    if (nearest && !TakesAll())
    {
      break;
    }
    vtkTypeUInt64 evictions = 0;
    const auto draw = [&](vtkImageData* mask, vtkTypeUInt32 slots, bool skip)
    {
      setenv("TERAVOX_NATIVE_ISA", slots == 3 ? "baseline" : "any", 1);
      Stage stage(28, 28);
      Show(stage, image, 3);
      stage.SetShade(!nearest);
      stage.Property->SetInterpolationType(
        nearest ? VTK_NEAREST_INTERPOLATION : VTK_LINEAR_INTERPOLATION);
      stage.Mapper->SetMaximumLevel(0);
      stage.Mapper->SetMaximumNumberOfSlots(slots);
      stage.Mapper->SetEmptySpaceSkipping(skip ? 1 : 0);
      stage.Mapper->SetArrivalShuffleSeed(slots);
      if (mask)
      {
        SetMask(stage.Mapper, mask);
      }
      std::vector<float> picture = stage.Draw();
      unsetenv("TERAVOX_NATIVE_ISA");
      EXPECT_TRUE(stage.Mapper->IsConverged());
      EXPECT_EQ(stage.Mapper->CheckInvariants(), "");
      evictions += stage.Mapper->GetNumberOfEvictions();
      return picture;
    };
    const std::vector<float> masked = draw(sponge, 0, true);
    EXPECT_GT(*std::max_element(masked.begin(), masked.end()), 0.1f);
    EXPECT_TRUE(AreImagesIdentical(masked, draw(sponge, 0, false))) << "nothing skipped";
    EXPECT_TRUE(AreImagesIdentical(masked, draw(sponge, 3, true))) << "3 slots, baseline";
    EXPECT_TRUE(AreImagesIdentical(masked, draw(sponge, 6, false))) << "6 slots, nothing skipped";
    EXPECT_GT(evictions, 20u);
    const std::vector<float> whole = draw(nullptr, 0, true);
    EXPECT_FALSE(AreImagesIdentical(masked, whole));
    EXPECT_TRUE(AreImagesIdentical(whole, draw(ones, 0, true))) << "a mask of ones";
  }
}

// Composite blending and maxima; VTK's masks end where a sample's voxel does, too.
TEST(ComponentMasks, BesideVTK)
{
  ImageOptions options;
  const auto mask = MaskImage(options.Dimensions, Sponge(options.Dimensions));
  const auto image = MakeComponentImage(options, 2);
  options.Type = ScalarType::UInt16;
  const auto wide = MakeComponentImage(options, 2);
  BesideVTK both({}, 24);
  Show(both.Shown, image, 2);
  SetComponentTransfer(both.Shown, { OpacityShape::Ramp, OpacityShape::Ramp }, 0, 255, 1);
  both.Shown.Mapper->SetMaximumLevel(0);
  both.Theirs->SetInputData(wide);
  SetMask(both.Shown.Mapper, mask);
  SetMask(both.Theirs, mask);
  both.Expect("two components, masked");
  both.Shown.Mapper->SetBlendModeToMaximumIntensity();
  both.Theirs->SetBlendModeToMaximumIntensity();
  both.Expect("two components, masked, maxima");
}
