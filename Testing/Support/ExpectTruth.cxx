// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ExpectTruth.h"

#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cstdio>
#include <gtest/gtest.h>
#include <sstream>

namespace teravox::test
{

namespace
{
// The pixel with the largest excess: where it is, what is drawn there, and the truth.
std::string Worst(Stage& stage, const std::vector<float>& picture, const StageTruth& truth,
  const ImageDifference& excess)
{
  const int x = static_cast<int>(excess.WorstPixel % static_cast<std::size_t>(stage.Width()));
  const int y = static_cast<int>(excess.WorstPixel / static_cast<std::size_t>(stage.Width()));
  const TruthColor color = IntegratePixel(truth.Scene(), x, y);
  std::ostringstream text;
  text << ": pixel " << x << ", " << y << " is";
  for (std::size_t c = 0; c < 4; ++c)
  {
    text << " " << picture[4 * excess.WorstPixel + c];
  }
  text << " instead of";
  for (std::size_t c = 0; c < 4; ++c)
  {
    text << " " << color[c];
  }
  return text.str();
}
} // namespace

void ExpectTruth(Stage& stage, BrickSource& source, const std::string& name, const Bounds& bounds)
{
  ExpectTruth(stage, StageTruth(stage, source), name, bounds);
}

void ExpectTruth(
  Stage& stage, const StageTruth& truth, const std::string& name, const Bounds& bounds)
{
  ExpectExcess(
    stage,
    [&](const std::vector<float>& picture, double small, ImageDifference* plain)
    { return truth.Excess(picture, small, plain); },
    [&](const std::vector<float>& picture, const ImageDifference& excess)
    { return Worst(stage, picture, truth, excess); },
    name, bounds);
}

void ExpectExcess(Stage& stage,
  const std::function<ImageDifference(const std::vector<float>&, double, ImageDifference*)>& find,
  const std::function<std::string(const std::vector<float>&, const ImageDifference&)>& where,
  const std::string& name, const Bounds& bounds)
{
  const std::vector<float> picture = stage.Draw();
  ASSERT_FALSE(picture.empty()) << name;
  EXPECT_TRUE(stage.Mapper->IsConverged()) << name;
  ImageDifference plain;
  const double tolerance = stage.Mapper->GetImageErrorTolerance();
  const ImageDifference excess = find(picture, 0.5 * tolerance, &plain);
  double visible = 0;
  for (std::size_t i = 3; i < picture.size(); i += 4)
  {
    visible = std::max(visible, static_cast<double>(picture[i]));
  }
  std::printf("  %-44s in units of the tolerance: max %.3f beyond the envelope, plain max %.3f, "
              "mean %.4f, p99 %.3f\n",
    name.c_str(), excess.Max / tolerance, plain.Max / tolerance, plain.Mean / tolerance,
    plain.Percentile99 / tolerance);
  EXPECT_GT(visible, 0.01) << name << ": the picture is empty and shows nothing";
  EXPECT_LE(excess.Percentile99, bounds.Percentile99 * tolerance) << name;
  EXPECT_LE(excess.Max, bounds.Max * tolerance) << name << where(picture, excess);
}

void ExpectFixedStepsConverge(Stage& stage, BrickSource& source, double share)
{
  const StageTruth truth(stage, source);
  stage.Mapper->SetImageErrorTolerance(0);
  double errors[2] = { 0, 0 };
  for (int i = 0; i < 2; ++i)
  {
    stage.Mapper->SetSampleDistance(i == 0 ? 0.4f : 0.1f);
    ImageDifference plain;
    truth.Excess(stage.Draw(), 1, &plain);
    errors[i] = plain.Mean;
  }
  EXPECT_GT(errors[0], 0);
  EXPECT_LT(errors[1], share * errors[0]);
}

std::uint64_t ExpectSamePicture(
  Stage& stage, std::vector<float>& reference, const std::string& name)
{
  const std::vector<float> picture = stage.Draw();
  EXPECT_TRUE(stage.Mapper->IsConverged()) << name;
  EXPECT_EQ(stage.Mapper->CheckInvariants(), "") << name;
  if (reference.empty())
  {
    reference = picture;
    EXPECT_GT(*std::max_element(picture.begin(), picture.end()), 0.1f) << name;
  }
  EXPECT_TRUE(AreImagesIdentical(picture, reference))
    << name << ": " << CountDifferentBits(picture, reference) << " channels differ, by "
    << CompareImages(picture, reference).Max << " at most";
  return stage.Mapper->GetNumberOfBricksLoaded();
}

} // namespace teravox::test
