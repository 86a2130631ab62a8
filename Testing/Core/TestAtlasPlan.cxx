// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "AtlasPlan.h"
#include "PageTable.h"

#include <algorithm>
#include <gtest/gtest.h>
#include <iostream>
#include <string>
#include <vector>

namespace teravox
{

namespace
{
constexpr std::uint64_t MiB = 1u << 20;

PyramidLayout Layout(const Int3& dimensions, int brickSize)
{
  return PyramidLayout::MakeDefault(dimensions, { 1, 1, 1 }, brickSize).Value();
}

void CheckPlan(const PyramidLayout& layout, const AtlasRequest& request, const AtlasPlan& plan)
{
  const std::int64_t edge = layout.StoredSize();
  ASSERT_LE(plan.TotalBytes() + request.ReservedBytes, request.BudgetBytes);
  ASSERT_GE(plan.Slots, 2u);
  ASSERT_LE(plan.Slots, plan.SlotsPerAxis[0] * plan.SlotsPerAxis[1] * plan.SlotsPerAxis[2]);
  ASSERT_LE(plan.Slots, std::max<std::int64_t>(2, layout.TotalBricks()));
  ASSERT_LE(plan.Slots, request.MaximumSlots);
  ASSERT_LE(plan.Slots, PageEntry::SlotMask);
  std::uint64_t texels = 1;
  for (std::size_t a = 0; a < 3; ++a)
  {
    ASSERT_LE(plan.SlotsPerAxis[a] * edge, plan.AtlasSize[a]);
    ASSERT_TRUE(plan.Native || plan.AtlasSize[a] <= request.MaximumTextureSize);
    texels *= static_cast<std::uint64_t>(plan.AtlasSize[a]);
  }
  ASSERT_EQ(plan.AtlasBytes, texels * request.BytesPerTexel);
  ASSERT_EQ(plan.Native, request.Native);
  // One chain of page blocks, and what a table of this plan allocates.
  ASSERT_GE(plan.PageBlocks, static_cast<std::uint32_t>(layout.PageDepth()));
  ASSERT_EQ(
    plan.DirectoryBytes + plan.PageBlockBytes, PageTable(layout, plan.PageBlocks).SizeInBytes());
  ASSERT_EQ(plan.SlotTableBytes, request.SlotTable ? plan.Slots * std::uint64_t{ 16 } : 0);
  ASSERT_GE(plan.FeedbackBytes,
    4u *
      (FeedbackHeaderWords + RequestTableEntries * RequestTableWords + plan.Slots +
        plan.PageBlocks));
}

// The number before " bytes." at the end of the message.
std::uint64_t LeastIn(const std::string& message)
{
  const std::size_t end = message.rfind(" bytes");
  const std::size_t begin = message.rfind(' ', end - 1) + 1;
  return std::stoull(message.substr(begin, end - begin));
}
} // namespace

TEST(AtlasPlan, StaysWithinAnyBudget)
{
  const std::vector<PyramidLayout> layouts{ Layout({ 301, 370, 316 }, 32),
    Layout({ 64000, 50000, 114 }, 32), Layout({ 1 << 30, 1 << 30, 1 << 30 }, 64),
    Layout({ 40, 40, 40 }, 32), Layout({ 512, 512, 512 }, 16) };
  int plans = 0;
  for (const PyramidLayout& layout : layouts)
  {
    for (const std::uint32_t bytesPerTexel : { 1u, 2u, 4u, 16u })
    {
      for (const bool native : { false, true })
      {
        for (const std::uint64_t reserved : { std::uint64_t{ 0 }, 3 * MiB + 17 })
        {
          for (std::uint64_t budget = 1; budget < 20000 * MiB; budget = budget * 5 / 2 + 12345)
          {
            AtlasRequest request;
            request.BudgetBytes = budget;
            request.ReservedBytes = reserved;
            request.BytesPerTexel = bytesPerTexel;
            request.Native = native;
            request.SlotTable = bytesPerTexel == 4;
            const auto plan = PlanAtlas(layout, request);
            if (plan)
            {
              CheckPlan(layout, request, plan.Value());
              ++plans;
            }
            else
            {
              ASSERT_EQ(plan.GetStatus().Code(), StatusCode::ResourceExhausted);
            }
            if (testing::Test::HasFatalFailure())
            {
              FAIL() << "budget " << budget << ", brick " << layout.BrickSize();
            }
          }
        }
      }
    }
  }
  EXPECT_GT(plans, 100);
}

TEST(AtlasPlan, TheLeastInTheMessageIsTheLeast)
{
  for (const int brick : { 16, 32, 64 })
  {
    for (const bool native : { false, true })
    {
      for (const std::uint64_t reserved : { std::uint64_t{ 0 }, std::uint64_t{ 999999 } })
      {
        const PyramidLayout layout = Layout({ 5000, 4000, 3000 }, brick);
        AtlasRequest request;
        request.BudgetBytes = 1000;
        request.ReservedBytes = reserved;
        request.BytesPerTexel = 2;
        request.Native = native;
        const auto refused = PlanAtlas(layout, request);
        ASSERT_FALSE(refused.Ok());
        EXPECT_NE(refused.GetStatus().Message().find("1000 bytes"), std::string::npos);
        const std::uint64_t least = LeastIn(refused.GetStatus().Message());
        request.BudgetBytes = least;
        const auto works = PlanAtlas(layout, request);
        ASSERT_TRUE(works.Ok()) << least << ": " << works.GetStatus().Message();
        CheckPlan(layout, request, works.Value());
        request.BudgetBytes = least - 1;
        EXPECT_FALSE(PlanAtlas(layout, request).Ok());
      }
    }
  }
}

TEST(AtlasPlan, BricksThatFitNoTextureAreNamed)
{
  AtlasRequest request;
  request.BudgetBytes = 20000 * MiB;
  request.MaximumTextureSize = 512;
  const auto plan = PlanAtlas(Layout({ 5000, 4000, 3000 }, 1024), request);
  ASSERT_FALSE(plan.Ok());
  EXPECT_NE(plan.GetStatus().Message().find("1028"), std::string::npos);
}

TEST(AtlasPlan, MoreMemoryNeverMeansFewerSlots)
{
  const PyramidLayout layout = Layout({ 2160, 2560, 1072 }, 32);
  for (const bool native : { false, true })
  {
    std::uint32_t before = 0;
    for (std::uint64_t budget = 4 * MiB; budget < 4096 * MiB; budget += budget / 7)
    {
      AtlasRequest request;
      request.BudgetBytes = budget;
      request.BytesPerTexel = 2;
      request.Native = native;
      const auto plan = PlanAtlas(layout, request);
      if (plan)
      {
        EXPECT_GE(plan.Value().Slots, before) << budget;
        before = plan.Value().Slots;
      }
    }
    EXPECT_GT(before, 10000u);
  }
}

TEST(AtlasPlan, UsesMostOfTheBudget)
{
  AtlasRequest request;
  request.BudgetBytes = 1024 * MiB;
  request.BytesPerTexel = 2;
  const PyramidLayout layout = Layout({ 64000, 50000, 114 }, 32);
  EXPECT_GT(PlanAtlas(layout, request).Value().TotalBytes(), request.BudgetBytes * 9 / 10);
  request.Native = true;
  EXPECT_GT(PlanAtlas(layout, request).Value().TotalBytes(), request.BudgetBytes * 99 / 100);
}

TEST(AtlasPlan, SmallVolumesGetSmallAtlases)
{
  AtlasRequest request;
  request.BudgetBytes = 4096 * MiB;
  const PyramidLayout layout = Layout({ 100, 100, 100 }, 32);
  const AtlasPlan plan = PlanAtlas(layout, request).Value();
  EXPECT_EQ(plan.Slots, layout.TotalBricks());
  EXPECT_LT(plan.TotalBytes(), 64 * MiB);
  request.MaximumSlots = 16;
  EXPECT_EQ(PlanAtlas(layout, request).Value().Slots, 16u);
}

// Sarton 2018, the mouse brain (64000 x 50000 x 114, RGBA): 501 MB with one level of
// virtualisation, 101 MB with two.
TEST(AtlasPlan, AddressingOfTheMouseBrainFitsTwoMegabytes)
{
  const PyramidLayout layout = Layout({ 64000, 50000, 114 }, 32);
  for (const bool native : { false, true })
  {
    AtlasRequest request;
    request.BudgetBytes = std::uint64_t{ 4 } << 30;
    request.BytesPerTexel = 4;
    request.Native = native;
    const AtlasPlan plan = PlanAtlas(layout, request).Value();
    std::cout << "addressing " << plan.AddressingBytes() << " bytes for " << plan.Slots
              << " slots and " << plan.PageBlocks << " page blocks\n";
    EXPECT_LE(plan.AddressingBytes(), 2000000u);
    // Not by being useless: a page block for every hundred bricks or so.
    EXPECT_GE(std::uint64_t{ plan.PageBlocks } * 128, plan.Slots);
  }
}

// Contract 4: what addressing allocates depends on the budget, not on the volume.
TEST(AtlasPlan, AddressingDoesNotGrowWithTheVolume)
{
  int compared = 0;
  for (const std::uint64_t budget : { 64 * MiB, 256 * MiB, 4096 * MiB })
  {
    AtlasRequest request;
    request.BudgetBytes = budget;
    request.BytesPerTexel = 2;
    const AtlasPlan small = PlanAtlas(Layout({ 512, 512, 512 }, 32), request).Value();
    const AtlasPlan large = PlanAtlas(Layout({ 1 << 30, 1 << 30, 1 << 30 }, 32), request).Value();
    // The smaller volume needs fewer slots where all of it fits.
    if (small.Slots == large.Slots)
    {
      ++compared;
      EXPECT_LE(static_cast<double>(large.AddressingBytes()),
        1.2 * static_cast<double>(small.AddressingBytes()))
        << budget;
    }
    EXPECT_LE(large.AddressingBytes(), std::max<std::uint64_t>(2 * MiB, budget / 500)) << budget;
  }
  EXPECT_GE(compared, 2);
}

} // namespace teravox
