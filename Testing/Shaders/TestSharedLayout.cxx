// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Shaders/Shared/Layout.glsl, compiled as C++, against Core and against naive code.
#include "AtlasPlan.h"
#include "PageTable.h"
#include "SharedLayout.h"

#include <algorithm>
#include <gtest/gtest.h>
#include <random>
#include <set>
#include <vector>

namespace teravox
{

TEST(SharedLayout, ConstantsEqualThoseOfCore)
{
  EXPECT_EQ(shared::PAGE_UNMAPPED, PageEntry::Unmapped);
  EXPECT_EQ(shared::PAGE_MAPPED, PageEntry::Mapped);
  EXPECT_EQ(shared::PAGE_FAILED, PageEntry::Failed);
  EXPECT_EQ(shared::PAGE_SINGLE, PageEntry::Single);
  EXPECT_EQ(shared::PAGE_SLOT_MASK, PageEntry::SlotMask);
  EXPECT_EQ(1 << shared::PAGE_SHIFT, PageBlockEdge);
  EXPECT_EQ(shared::PAGE_BLOCK_ENTRIES, PageTable::EntriesPerBlock);
  EXPECT_EQ(shared::REQUEST_ENTRIES, RequestTableEntries);
  EXPECT_EQ(shared::REQUEST_WORDS, RequestTableWords);
  EXPECT_EQ(shared::FEEDBACK_HEADER_WORDS, FeedbackHeaderWords);
  EXPECT_EQ(shared::FEEDBACK_STAMPS, FeedbackHeaderWords + RequestTableEntries * RequestTableWords);
  // The counters have a word each, in the header.
  const std::set<std::uint32_t> words{ shared::FEEDBACK_WAITING, shared::FEEDBACK_UNFINISHED,
    shared::FEEDBACK_OVERFLOW, shared::FEEDBACK_FALLBACK, shared::FEEDBACK_SAMPLES,
    shared::FEEDBACK_CONTRIBUTING, shared::FEEDBACK_EVALUATED, shared::FEEDBACK_GRADIENTS,
    shared::FEEDBACK_VISITS };
  EXPECT_EQ(words.size(), 9u);
  EXPECT_LT(*words.rbegin(), shared::FEEDBACK_HEADER_WORDS);
}

TEST(SharedLayout, EntriesArePackedAsCorePacksThem)
{
  for (const auto state :
    { PageEntry::Unmapped, PageEntry::Mapped, PageEntry::Failed, PageEntry::Single })
  {
    for (const std::uint32_t slot : { 0u, 1u, 12345u, PageEntry::SlotMask })
    {
      const std::uint32_t word = PageEntry::Pack(state, slot);
      EXPECT_EQ(shared::PageState(word), state);
      EXPECT_EQ(shared::PageSlot(word), slot);
    }
  }
}

TEST(SharedLayout, IndexInBlockCountsXFirst)
{
  std::uint32_t index = 0;
  for (std::uint32_t z = 0; z < 8; ++z)
  {
    for (std::uint32_t y = 0; y < 8; ++y)
    {
      for (std::uint32_t x = 0; x < 8; ++x)
      {
        ASSERT_EQ(shared::IndexInBlock(x, y, z), index++);
        ASSERT_EQ(shared::IndexInBlock(x + 8 * 77, y + 8 * 3, z + 0x7ffffff8u),
          shared::IndexInBlock(x, y, z));
      }
    }
  }
}

TEST(SharedLayout, PagesAlongRoundsUp)
{
  const auto naive = [](std::uint64_t bricks, std::uint32_t pageLevel)
  {
    for (std::uint32_t k = 0; k < pageLevel; ++k)
    {
      bricks = (bricks + 7) / 8;
    }
    return bricks;
  };
  std::mt19937 random(6);
  for (std::uint32_t pageLevel = 0; pageLevel <= 12; ++pageLevel)
  {
    for (std::uint32_t bricks = 1; bricks < 1000; ++bricks)
    {
      ASSERT_EQ(shared::PagesAlong(bricks, pageLevel), naive(bricks, pageLevel));
    }
    for (int i = 0; i < 1000; ++i)
    {
      const std::uint32_t bricks = std::max(1u, static_cast<std::uint32_t>(random()) >> 1);
      ASSERT_EQ(shared::PagesAlong(bricks, pageLevel), naive(bricks, pageLevel)) << bricks;
    }
    ASSERT_EQ(shared::PagesAlong(1u << 30, pageLevel), naive(1u << 30, pageLevel));
  }
}

TEST(SharedLayout, RequestTagsAreNeverZeroAndRarelyMeet)
{
  // Neighbours in space and level, as one pass reports them, at the near and the far end.
  std::set<std::uint32_t> tags;
  std::vector<int> load(shared::REQUEST_ENTRIES, 0);
  int count = 0;
  for (const std::uint32_t base : { 0u, 33554416u })
  {
    for (std::uint32_t level = 0; level < 4; ++level)
    {
      for (std::uint32_t i = 0; i < 512; ++i)
      {
        const std::uint32_t tag =
          shared::RequestTag(base + i % 8, base + i / 8 % 8, base + i / 64, level);
        ASSERT_NE(tag, 0u);
        tags.insert(tag);
        ++load[tag % shared::REQUEST_ENTRIES];
        ++count;
      }
    }
  }
  EXPECT_GE(tags.size() + 4, static_cast<std::size_t>(count));
  // A full table's worth of requests, spread: as even as chance would have it.
  EXPECT_LE(*std::max_element(load.begin(), load.end()), 10);
  EXPECT_NE(shared::RequestTag(0, 0, 0, 0), 0u);
}

} // namespace teravox
