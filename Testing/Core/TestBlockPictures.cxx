// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BlockPictures.h"

#include <algorithm>
#include <array>
#include <gtest/gtest.h>
#include <vector>

namespace teravox
{

namespace
{
constexpr float Nothing = MarchParameters::NothingMet;
}

// 17 x 9 pixels: 3 x 2 tiles, those at the upper and right borders one pixel wide.
TEST(BlockPictures, LeastOpacityOfEachTile)
{
  constexpr int width = 17;
  constexpr int height = 9;
  std::vector<float> colors(std::size_t{ 4 } * width * height, 1.0f);
  const auto set = [&](int x, int y, float opacity) {
    colors[4 * (static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)) + 3] = opacity;
  };
  EXPECT_EQ(LeastOpacities(colors, width, height), std::vector<float>(6, 1.0f));
  set(7, 7, 0.5f);
  set(3, 0, 0.75f);
  set(8, 0, 0.25f);
  set(16, 7, 0.125f);
  set(0, 8, 0.0f);
  set(16, 8, 0.625f);
  EXPECT_EQ(LeastOpacities(colors, width, height),
    (std::vector<float>{ 0.5f, 0.25f, 0.125f, 0.0f, 1.0f, 0.625f }));
}

TEST(BlockPictures, OpacityInFrontFollowsTheOrder)
{
  // Three blocks of two tiles.
  const std::vector<float> all{ 0.5f, 0.0f, 0.75f, 1.0f, 0.25f, 0.5f };
  const std::vector<int> order{ 2, 0, 1 };
  EXPECT_EQ(OpacityInFront(all, 2, order, 2), (std::vector<float>{ 0, 0 }));
  EXPECT_EQ(OpacityInFront(all, 2, order, 0), (std::vector<float>{ 0.25f, 0.5f }));
  EXPECT_EQ(OpacityInFront(all, 2, order, 1), (std::vector<float>{ 1 - 0.75f * 0.5f, 0.5f }));
  // Not listed: an empty block.
  EXPECT_EQ(OpacityInFront(all, 2, { 2, 1 }, 0), (std::vector<float>{ 0, 0 }));
}

TEST(BlockPictures, HiddenIsWhatBothHide)
{
  constexpr int width = 12;
  constexpr int height = 7;
  const auto counts = [&](const std::vector<float>& suspected, const std::vector<float>& confirmed)
  {
    const std::vector<std::uint8_t> hidden =
      HiddenPixels(suspected, confirmed, 0.25f, width, height);
    std::array<int, 2> n{ 0, 0 };
    for (std::size_t i = 0; i < hidden.size(); ++i)
    {
      n[i % width < 8 ? 0 : 1] += hidden[i];
    }
    return n;
  };
  using Counts = std::array<int, 2>;
  EXPECT_EQ(counts({ 0.75f, 0.74f }, {}), (Counts{ 56, 0 }));
  EXPECT_EQ(counts({ 0.75f, 1 }, {}), (Counts{ 56, 28 }));
  EXPECT_EQ(counts({ 1, 1 }, { 0, 1 }), (Counts{ 0, 28 }));
  EXPECT_EQ(counts({ 0, 1 }, { 1, 1 }), (Counts{ 0, 28 })); // not suspected: it was drawn
  EXPECT_TRUE(HiddenPixels({ 1, 1 }, { 0, 0 }, 0.25f, width, height).empty());
  EXPECT_TRUE(HiddenPixels({ 1, 1, 1 }, {}, 0.25f, width, height).empty()); // of another picture
  EXPECT_TRUE(HiddenPixels({ 1, 1 }, { 1 }, 0.25f, width, height).empty());
}

TEST(BlockPictures, JoinsRaysOfOneComponent)
{
  using Ray = std::array<float, 4>;
  const Ray none{ 0, 0, 0, 1 }; // met nothing
  const auto join = [](BlendKind blend, const Ray& more, Ray ray)
  {
    JoinRays(blend, 1, more.data(), ray.data());
    return ray;
  };
  for (const BlendKind blend : { BlendKind::Maximum, BlendKind::Minimum })
  {
    // Minima are the largest negative.
    EXPECT_EQ(join(blend, { -3, 1, 0, 0 }, { -2, 1, 0, 0 }), (Ray{ -2, 1, 0, 0 }));
    EXPECT_EQ(join(blend, { -2, 1, 0, 0 }, { -3, 1, 0, 0 }), (Ray{ -2, 1, 0, 0 }));
    EXPECT_EQ(join(blend, none, { -3, 1, 0, 0 }), (Ray{ -3, 1, 0, 0 }));
    EXPECT_EQ(join(blend, { -3, 1, 0, 0 }, none), (Ray{ -3, 1, 0, 0 }));
    EXPECT_EQ(join(blend, none, none), none);
  }
  for (const BlendKind blend : { BlendKind::Average, BlendKind::Additive })
  {
    EXPECT_EQ(join(blend, { 2, 1, 4, 0 }, { 3, 1, 5, 0 }), (Ray{ 5, 1, 9, 0 }));
    EXPECT_EQ(join(blend, none, { 3, 1, 5, 0 }), (Ray{ 3, 1, 5, 0 }));
    EXPECT_EQ(join(blend, { 2, 1, 4, 0 }, none), (Ray{ 2, 1, 4, 0 }));
    EXPECT_EQ(join(blend, none, none), none);
  }
}

TEST(BlockPictures, JoinsRaysOfSeveralComponents)
{
  EXPECT_EQ(GatheredChannels(BlendKind::Average, 1), 4);
  EXPECT_EQ(GatheredChannels(BlendKind::Additive, 3), 4);
  EXPECT_EQ(GatheredChannels(BlendKind::Average, 2), 8);
  std::vector<float> ray{ 1, -5, Nothing, Nothing };
  const std::vector<float> more{ 0.5f, -4, 2, Nothing };
  JoinRays(BlendKind::Minimum, 3, more.data(), ray.data());
  EXPECT_EQ(ray, (std::vector<float>{ 1, -4, 2, Nothing }));
  JoinRays(BlendKind::Additive, 3, more.data(), ray.data());
  EXPECT_EQ(ray, (std::vector<float>{ 1.5f, -8, 4, Nothing }));
  std::vector<float> mean{ 1, 2, Nothing, Nothing, 4, 5, 0, 0 };
  const std::vector<float> other{ 3, Nothing, Nothing, Nothing, 2, 0, 0, 0 };
  JoinRays(BlendKind::Average, 2, other.data(), mean.data());
  EXPECT_EQ(mean, (std::vector<float>{ 4, 2, Nothing, Nothing, 6, 5, 0, 0 }));
}

} // namespace teravox
