// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Frames that must be fast: the tolerance is loosened until they are, and tightened again.
#include "Scene.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <gtest/gtest.h>
#include <random>
#include <vtkImageData.h>
#include <vtkRenderWindow.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

// Something that takes more pieces the smaller the tolerance is.
vtkSmartPointer<vtkImageData> MakeNoise()
{
  ImageOptions options;
  options.Dimensions = { 48, 48, 48 };
  std::mt19937 random(11);
  return MakeImage(options,
    [&random](double, double, double) { return static_cast<double>(random()) / 4294967296.0; });
}

double LargestEstimate(Stage& stage)
{
  vtkNew<vtkImageData> image;
  EXPECT_TRUE(stage.Mapper->GetErrorEstimateImage(image));
  return image->GetScalarRange()[1];
}

} // namespace

// Nothing here depends on how fast the machine is: no frame is done in a nanosecond, and any is in
// a day.
TEST(Interactive, ToleranceIsLoosenedAndTightened)
{
  Stage stage(64, 64);
  stage.SetImage(MakeNoise());
  stage.SetTransfer(MakeTransfer(OpacityShape::Fog));
  stage.Look({ 1, 0.4, 0.3 });
  stage.Mapper->SetImageErrorTolerance(0.25 / 255);
  stage.Mapper->ErrorEstimateOn();
  const std::vector<float> exact = stage.Draw();
  ASSERT_TRUE(stage.Mapper->IsConverged());
  // Where samples are far apart already, the same sum of estimates is made of other parts.
  constexpr double Rounding = 1e-4;
  const double tight = LargestEstimate(stage);
  EXPECT_LT(tight, 0.02);

  stage.Mapper->SetFrameTimeBudget(1e-9);
  double looser = 0;
  for (int i = 0; i < 8; ++i)
  {
    stage.Window->Render();
    if (i > 0) // the first one is as exact as the picture before
    {
      EXPECT_FALSE(stage.Mapper->IsConverged()) << i;
    }
    const double estimate = LargestEstimate(stage);
    EXPECT_GE(estimate, looser * (1 - Rounding)) << i;
    looser = estimate;
  }
  const std::vector<float> fast = stage.Accumulator();
  EXPECT_FALSE(AreImagesIdentical(fast, exact));
  EXPECT_GT(looser, 2 * tight);
  // Looser isn't wrong: the estimate tells by how much.
  EXPECT_LE(CompareImages(fast, exact).Max, looser + tight);

  stage.Mapper->SetFrameTimeBudget(1e5);
  int frames = 0;
  double before = looser;
  while (!stage.Mapper->IsConverged() && frames < 20)
  {
    stage.Window->Render();
    const double estimate = LargestEstimate(stage);
    EXPECT_LE(estimate, before * (1 + Rounding)) << frames;
    before = estimate;
    ++frames;
  }
  EXPECT_TRUE(stage.Mapper->IsConverged());
  EXPECT_GT(frames, 3) << "tightened step by step";
  EXPECT_TRUE(AreImagesIdentical(stage.Accumulator(), exact));
}

// Whatever lies between rays, no picture errs by more than 1.
TEST(Interactive, TheLargestToleranceCastsTheFewestRays)
{
  if (TestedMarcher() != vtkOutOfCoreVolumeMapper::MARCHER_NATIVE)
  {
    GTEST_SKIP() << "the shaders cast all rays";
  }
  Stage stage(96, 96);
  stage.SetImage(MakeNoise());
  stage.SetTransfer(MakeTransfer(OpacityShape::Fog));
  stage.Look({ 1, 0.4, 0.3 });
  stage.Mapper->CountSamplesOn();
  const auto samplesAt = [&](double tolerance)
  {
    stage.Mapper->SetImageErrorTolerance(tolerance);
    stage.Draw();
    EXPECT_TRUE(stage.Mapper->IsConverged());
    return stage.Mapper->GetNumberOfSamples();
  };
  const vtkTypeUInt64 below = samplesAt(0.99);
  EXPECT_LT(samplesAt(1), below / 2);
  stage.Mapper->ErrorEstimateOn();
  EXPECT_GT(samplesAt(1), below / 2); // an estimate judges
}

// Where coarser steps don't make frames fast, there are fewer rays; with an estimate of the error
// there aren't. The picture that is kept is as exact as ever.
TEST(Interactive, RaysBecomeFewerWhereStepsAreNotEnough)
{
  if (TestedMarcher() != vtkOutOfCoreVolumeMapper::MARCHER_NATIVE)
  {
    GTEST_SKIP() << "the shaders cast all rays";
  }
  Stage stage(96, 96);
  stage.SetImage(MakeNoise());
  stage.SetTransfer(MakeTransfer(OpacityShape::Fog));
  stage.SetShade(true);
  stage.Look({ 1, 0.4, 0.3 });
  stage.Mapper->CountSamplesOn();
  const std::vector<float> exact = stage.Draw();
  ASSERT_TRUE(stage.Mapper->IsConverged());
  stage.Mapper->SetFrameTimeBudget(1e-9);
  std::vector<vtkTypeUInt64> samples;
  for (int i = 0; i < 8; ++i)
  {
    stage.Window->Render();
    samples.push_back(stage.Mapper->GetNumberOfSamples());
  }
  EXPECT_LT(samples.back(), samples[2] / 2); // the edge of the volume is cast as it was
  const ImageDifference off = CompareImages(stage.Accumulator(), exact);
  EXPECT_GT(off.Max, 0);
  EXPECT_LT(off.Mean, 16.0 / 255);
  stage.Mapper->ErrorEstimateOn();
  stage.Window->Render();
  EXPECT_GT(stage.Mapper->GetNumberOfSamples(), samples[2] / 2);
  stage.Mapper->ErrorEstimateOff();
  stage.Mapper->SetFrameTimeBudget(1e5);
  for (int i = 0; i < 20 && !stage.Mapper->IsConverged(); ++i)
  {
    stage.Window->Render();
  }
  EXPECT_TRUE(stage.Mapper->IsConverged());
  EXPECT_TRUE(AreImagesIdentical(stage.Accumulator(), exact));
}
