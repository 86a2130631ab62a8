// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ImageMetrics.h"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>

namespace teravox
{
namespace
{

TEST(ImageMetrics, KnownDifferences)
{
  std::vector<float> a(400, 0.5f); // 100 pixels
  std::vector<float> b = a;
  b[42] = 0.75f;
  b[43] = 0.25f;
  b[81] = 0.0f;
  const ImageDifference d = CompareImages(a, b);
  EXPECT_DOUBLE_EQ(d.Max, 0.5);
  EXPECT_DOUBLE_EQ(d.Mean, 1.0 / 400);
  EXPECT_DOUBLE_EQ(d.Rms, std::sqrt((2 * 0.0625 + 0.25) / 400));
  EXPECT_EQ(d.Percentile99, 0); // 3 of 400 is less than one percent
  EXPECT_EQ(d.WorstPixel, 20u);
  EXPECT_EQ(d.WorstChannel, 1u);
  EXPECT_DOUBLE_EQ(CompareImages(b, a).Max, 0.5);
}

TEST(ImageMetrics, PercentileIsTheExactRank)
{
  std::vector<float> a(400, 0.0f);
  std::vector<float> b = a;
  for (std::size_t i = 0; i < 400; ++i)
  {
    b[(i * 7) % 400] = static_cast<float>(i); // a permutation of 0..399
  }
  EXPECT_DOUBLE_EQ(CompareImages(a, b).Percentile99, 395); // 396 of 400 are <= 395
}

TEST(ImageMetrics, NotFiniteIsInfinitelyFar)
{
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  const std::vector<float> clean{ 0, 0, 0, 1 };
  EXPECT_EQ(CompareImages(clean, { 0, nan, 0, 1 }).Max, std::numeric_limits<double>::infinity());
  EXPECT_EQ(
    CompareImages(clean, { 0, 0, infinity, 1 }).Max, std::numeric_limits<double>::infinity());
  EXPECT_EQ(CompareImages({ nan, infinity, 0, 1 }, { nan, infinity, 0, 1 }).Max, 0);
  EXPECT_EQ(ExcessOverEnvelope({ 0, nan, 0, 1 }, clean, clean).Max,
    std::numeric_limits<double>::infinity());
}

TEST(ImageMetrics, ExcessCountsOnlyWhatLeavesTheEnvelope)
{
  const std::vector<float> lower{ 0, 0.25f, 0.5f, 1 };
  const std::vector<float> upper{ 0.5f, 0.25f, 1, 1 };
  const ImageDifference d = ExcessOverEnvelope({ 0.5f, 0.375f, 0.25f, 1 }, lower, upper);
  EXPECT_DOUBLE_EQ(d.Max, 0.25);
  EXPECT_EQ(d.WorstChannel, 2u);
  EXPECT_DOUBLE_EQ(d.Mean, (0.125 + 0.25) / 4);
  EXPECT_EQ(ExcessOverEnvelope(lower, lower, upper).Max, 0);
  EXPECT_EQ(ExcessOverEnvelope(upper, lower, upper).Max, 0);
}

TEST(ImageMetrics, BitsAreCompared)
{
  const std::vector<float> a{ 0, 0.1f, 0.2f, 1 };
  std::vector<float> b = a;
  EXPECT_TRUE(AreImagesIdentical(a, b));
  EXPECT_EQ(CountDifferentBits(a, b), 0u);
  b[0] = -0.0f;
  EXPECT_FALSE(AreImagesIdentical(a, b));
  EXPECT_EQ(CompareImages(a, b).Max, 0);
  b[2] = std::nextafter(b[2], 1.0f);
  EXPECT_EQ(CountDifferentBits(a, b), 2u);
  b.resize(8);
  EXPECT_FALSE(AreImagesIdentical(a, b));
  EXPECT_TRUE(AreImagesIdentical({}, {}));
}

} // namespace
} // namespace teravox
