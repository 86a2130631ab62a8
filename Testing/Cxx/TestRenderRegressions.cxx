// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// What went wrong in the history of VTK's own mapper, where no other test has it: see the list in
// README.md. Beside VTK's mapper, or an equality.
#include "BesideVTK.h"
#include "MessageRecorder.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cstdio>
#include <gtest/gtest.h>
#include <string>
#include <vector>
#include <vtkCommand.h>
#include <vtkImageData.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkTrivialProducer.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{
void Furnish(Stage& stage, vtkImageData* image)
{
  stage.Mapper->SetBrickSize(16);
  stage.SetImage(image);
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
}
} // namespace

// Neither a function that isn't there nor one that is switched off hides anything.
TEST(Regressions, NoGradientFunction)
{
  Stage stage(48, 48);
  Furnish(stage, MakeImage({}));
  const std::vector<float> plain = stage.Draw();
  stage.Property->SetGradientOpacity(0, nullptr);
  EXPECT_TRUE(AreImagesIdentical(plain, stage.Draw()));
  stage.SetGradientOpacity({ { 0, 0 }, { 20, 1 } });
  EXPECT_GT(CompareImages(plain, stage.Draw()).Max, 0.02) << "a function has to matter";
  stage.Property->SetDisableGradientOpacity(1);
  EXPECT_TRUE(AreImagesIdentical(plain, stage.Draw()));
}

// Light that adds up to more than 1 per channel is cut off in the window, and wraps nowhere.
TEST(Regressions, ColorOverflow)
{
  BesideVTK both({}, 48);
  Furnish(both.Shown, both.Image);
  both.Shown.SetTransfer(MakeTransfer(OpacityShape::Wall));
  both.Shown.SetShade(true);
  both.Shown.Property->SetAmbient(0.9);
  both.Shown.Property->SetDiffuse(1);
  both.Shown.Property->SetSpecular(1);
  both.Shown.Property->SetSpecularPower(4);
  const std::vector<float> ours = WithoutAlpha(both.Shown.DrawPicture());
  const std::vector<float> theirs = WithoutAlpha(both.Shown.DrawPictureWith(both.Theirs));
  EXPECT_GT(std::count(theirs.begin(), theirs.end(), 1.0f), 200) << "there has to be an overflow";
  const ImageDifference d = CompareImages(ours, theirs);
  std::printf("  mean %.3f/255, p99 %.2f/255\n", 255 * d.Mean, 255 * d.Percentile99);
  EXPECT_LE(d.Mean, 1.0 / 255);
}

// Two-dimensional functions of several volumes: each is drawn by its own.
TEST(Regressions, TwoDimensionalFunctionsOfSeveralVolumes)
{
  Stage stage(48, 48);
  Stage second(8, 8);
  vtkNew<MessageRecorder> messages;
  for (Stage* s : { &stage, &second })
  {
    Furnish(*s, MakeImage({}));
    s->Mapper->AddObserver(vtkCommand::WarningEvent, messages);
    const bool isFirst = s == &stage;
    s->SetTransferImage(8, 8,
      [=](double value, double) -> std::array<double, 4> {
        return { isFirst ? 1.0 : 0.0, 0, isFirst ? 0.0 : 1.0, value > 0.5 ? 0.1 : 0 };
      });
  }
  stage.Renderer->AddVolume(second.Volume);
  const auto largestOf = [&](std::size_t channel)
  {
    const std::vector<float> picture = stage.DrawPicture();
    float largest = 0;
    for (std::size_t i = channel; i < picture.size(); i += 4)
    {
      largest = std::max(largest, picture[i]);
    }
    return largest;
  };
  for (const bool red : { true, false })
  {
    stage.Volume->SetVisibility(red);
    second.Volume->SetVisibility(!red);
    EXPECT_GT(largestOf(red ? 0 : 2), 0.1f);
    EXPECT_EQ(largestOf(red ? 2 : 0), 0);
  }
  stage.Volume->SetVisibility(true);
  EXPECT_GT(largestOf(0), 0.02f);
  EXPECT_GT(largestOf(2), 0.1f);
  EXPECT_TRUE(messages->Messages.empty());
  stage.Renderer->RemoveVolume(second.Volume);
}

// Budgets that nobody set are one for all mappers that draw.
TEST(Regressions, AutomaticBudgetsAreShared)
{
  Stage stage(32, 32);
  Furnish(stage, MakeImage({}));
  stage.Mapper->SetGPUMemoryBudget(0);
  stage.Mapper->SetHostMemoryBudget(0);
  stage.Draw();
  const auto gpu = stage.Mapper->GetEffectiveGPUMemoryBudget();
  const auto host = stage.Mapper->GetEffectiveHostMemoryBudget();
  const std::vector<float> alone = stage.Accumulator();
  {
    Stage second(32, 32);
    Furnish(second, MakeImage({}));
    second.Mapper->SetGPUMemoryBudget(0);
    second.Mapper->SetHostMemoryBudget(0);
    // All that the first one can't use; what the second one can isn't known yet.
    EXPECT_GT(second.Mapper->GetEffectiveHostMemoryBudget(), host / 2);
    EXPECT_LT(second.Mapper->GetEffectiveHostMemoryBudget(), host);
    EXPECT_EQ(stage.Mapper->GetEffectiveHostMemoryBudget(), host) << "it hasn't drawn";
    second.Draw();
    EXPECT_EQ(stage.Mapper->GetEffectiveGPUMemoryBudget(), gpu / 2);
    EXPECT_EQ(second.Mapper->GetEffectiveGPUMemoryBudget(), gpu / 2);
    EXPECT_EQ(stage.Mapper->GetEffectiveHostMemoryBudget(), host / 2);
    EXPECT_TRUE(AreImagesIdentical(alone, stage.Draw()));
  }
  EXPECT_EQ(stage.Mapper->GetEffectiveGPUMemoryBudget(), gpu);
  EXPECT_EQ(stage.Mapper->GetEffectiveHostMemoryBudget(), host);
}
