// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "LevelsBrickSource.h"
#include "SourceChecks.h"
#include "WaitScope.h"

#include <atomic>
#include <condition_variable>
#include <cstring>
#include <gtest/gtest.h>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>

namespace teravox
{

namespace
{
using test::Dense;

/// Reads boxes of dense levels, as a function would that knows nothing of bricks.
template <typename T>
LevelsDescription::ReadFunction ReadFrom(std::vector<Dense<T>> levels)
{
  return [levels = std::move(levels)](int level, const Int3& start, const Int3& size, void* out)
  {
    const Dense<T>& from = levels[static_cast<std::size_t>(level)];
    T* to = static_cast<T*>(out);
    for (std::size_t a = 0; a < 3; ++a)
    {
      EXPECT_GE(start[a], 0);
      EXPECT_LE(start[a] + size[a], from.Dimensions[a]);
    }
    for (std::int64_t z = 0; z < size[2]; ++z)
    {
      for (std::int64_t y = 0; y < size[1]; ++y)
      {
        to =
          std::copy_n(from.At(start[0], start[1] + y, start[2] + z), size[0] * from.Components, to);
      }
    }
    return Status();
  };
}

template <typename T>
LevelsDescription Describe(const std::vector<Dense<T>>& levels, int brickSize)
{
  LevelsDescription description;
  description.Read = ReadFrom(levels);
  description.Type = test::TypeOf<T>();
  description.Components = levels.front().Components;
  description.BrickSize = brickSize;
  for (const Dense<T>& level : levels)
  {
    Int3 factor{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      factor[a] = (levels.front().Dimensions[a] + level.Dimensions[a] - 1) / level.Dimensions[a];
    }
    description.Levels.push_back({ level.Dimensions, factor });
  }
  return description;
}

template <typename T>
void ExpectPyramid(const LevelsDescription& description, const Dense<T>& volume)
{
  const auto source = LevelsBrickSource::Make(description);
  ASSERT_TRUE(source.Ok()) << source.GetStatus().Message();
  // A budget that is just enough.
  source.Value()->SetMemoryBudget(source.Value()->LeastMemory());
  const auto levels = test::Pyramid(volume, source.Value()->Info().Layout,
    description.Labels ? Downsampling::Mode : Downsampling::Average);
  for (int l = static_cast<int>(levels.size()) - 1; l >= 0; --l)
  {
    const auto& level = levels[static_cast<std::size_t>(l)];
    test::ExpectBricks(*source.Value(), l, level);
    const test::RangeCounts counts = test::ExpectRanges(*source.Value(), l, level);
    EXPECT_GT(counts.Exact, 0);
  }
  EXPECT_LE(source.Value()->MemoryUsed(), source.Value()->LeastMemory());
  EXPECT_GT(source.Value()->BytesRead(), 0u);
}
} // namespace

TEST(LevelsBrickSource, AddsLevelsWithTheBitsOfAnyPyramid)
{
  for (const ScalarType type : AllScalarTypes)
  {
    DispatchScalarType(type,
      [](auto tag)
      {
        const auto volume = test::RandomVolume<decltype(tag)>({ 45, 30, 37 }, 1, 5);
        ExpectPyramid(Describe(std::vector{ volume }, 8), volume);
      });
  }
  const auto colors = test::RandomVolume<std::uint8_t>({ 21, 18, 9 }, 3, 6);
  ExpectPyramid(Describe(std::vector{ colors }, 8), colors);
  auto labels = test::RandomVolume<std::int16_t>({ 33, 21, 17 }, 1, 7);
  for (std::int16_t& v : labels.Voxels)
  {
    v = static_cast<std::int16_t>(v % 5);
  }
  LevelsDescription description = Describe(std::vector{ labels }, 6);
  description.Labels = true;
  ExpectPyramid(description, labels);
}

TEST(LevelsBrickSource, GivenLevelsAreTakenAsTheyAre)
{
  // Not an average of anything: what is given counts. The last one is larger than a brick.
  const auto fine = test::RandomVolume<std::uint16_t>({ 60, 44, 32 }, 1, 8);
  const auto coarse = test::RandomVolume<std::uint16_t>({ 30, 22, 16 }, 1, 9);
  const auto source = LevelsBrickSource::Make(Describe(std::vector{ fine, coarse }, 8)).Value();
  ASSERT_EQ(source->Info().Layout.NumberOfLevels(), 4);
  test::ExpectBricks(*source, 0, fine);
  test::ExpectBricks(*source, 1, coarse);
  test::ExpectBricks(*source, 2, test::Coarser(coarse, { 2, 2, 2 }, Downsampling::Average));
  EXPECT_GT(test::ExpectRanges(*source, 1, coarse).Exact, 0);
  // Nobody knows what the finest level has without reading it.
  EXPECT_FALSE(source->ReadRanges({}, { 1, 1, 1 }).Value()[0].IsKnown());
}

TEST(LevelsBrickSource, ALevelThatWasRoundedDownRepeatsItsOutermostVoxels)
{
  const auto fine = test::RandomVolume<float>({ 17, 12, 9 }, 1, 10);
  const auto coarse = test::RandomVolume<float>({ 8, 6, 4 }, 1, 11);
  LevelsDescription description = Describe(std::vector{ fine, coarse }, 16);
  description.Levels[1].Factor = { 2, 2, 2 };
  const auto source = LevelsBrickSource::Make(description);
  ASSERT_TRUE(source.Ok()) << source.GetStatus().Message();
  Dense<float> expected{ { 9, 6, 5 }, 1, {} };
  for (std::int64_t i = 0; i < 9 * 6 * 5; ++i)
  {
    expected.Voxels.push_back(*coarse.Clamped(i % 9, i / 9 % 6, i / 54));
  }
  test::ExpectBricks(*source.Value(), 1, expected);
}

TEST(LevelsBrickSource, RangesAreThoseOfCells)
{
  Dense<std::uint8_t> volume{ { 128, 64, 64 }, 1, {} };
  volume.Voxels.assign(128 * 64 * 64, 7);
  volume.Voxels[127] = 200; // far from the first brick
  const auto source = LevelsBrickSource::Make(Describe(std::vector{ volume }, 64)).Value();
  const auto ranges = source->ReadRanges({}, { 2, 1, 1 }).Value();
  EXPECT_EQ(ranges[0], (ValueRange{ 7, 7 }));
  EXPECT_EQ(ranges[1], (ValueRange{ 7, 200 }));
}

TEST(LevelsBrickSource, ManyThreadsReadEachBlockOnceAndAgree)
{
  const auto volume = test::RandomVolume<std::uint8_t>({ 96, 80, 64 }, 1, 12);
  LevelsDescription description = Describe(std::vector{ volume }, 8);
  std::atomic<std::int64_t> reads{ 0 };
  description.Read = [&reads, inner = description.Read](
                       int level, const Int3& start, const Int3& size, void* out)
  {
    ++reads;
    return inner(level, start, size, out);
  };
  const auto source = LevelsBrickSource::Make(description).Value();
  const auto levels = test::Pyramid(volume, source->Info().Layout, Downsampling::Average);
  std::vector<std::thread> threads;
  for (int t = 0; t < 8; ++t)
  {
    threads.emplace_back(
      [&, t]
      {
        const int count = static_cast<int>(levels.size()) - 1;
        for (int l = 0; l < count; ++l)
        {
          const int level = 1 + (l + t) % count;
          test::ExpectBricks(*source, level, levels[static_cast<std::size_t>(level)]);
        }
      });
  }
  for (std::thread& thread : threads)
  {
    thread.join();
  }
  const Int3 bricks = source->Info().Layout.Bricks(0);
  EXPECT_EQ(reads.load(), bricks[0] * bricks[1] * bricks[2]);
}

TEST(LevelsBrickSource, FailuresAreOfTheirBricksAndNotRemembered)
{
  const auto volume = test::RandomVolume<std::uint8_t>({ 32, 16, 16 }, 1, 13);
  LevelsDescription description = Describe(std::vector{ volume }, 8);
  std::atomic<bool> broken{ true };
  std::atomic<bool> throws{ false };
  description.Read = [&, inner = description.Read](
                       int level, const Int3& start, const Int3& size, void* out)
  {
    if (broken && start[0] < 8)
    {
      if (throws)
      {
        throw std::runtime_error("the disk is on fire");
      }
      return Status(StatusCode::InputOutput, "no such chunk");
    }
    return inner(level, start, size, out);
  };
  const auto source = LevelsBrickSource::Make(description).Value();
  const int coarsest = source->Info().Layout.NumberOfLevels() - 1;
  for (const bool thrown : { false, true })
  {
    throws = thrown;
    for (const BrickKey& key : { BrickKey{}, BrickKey::Of(coarsest, { 0, 0, 0 }) })
    {
      const auto brick = source->ReadBrick(key);
      ASSERT_FALSE(brick.Ok());
      EXPECT_NE(brick.GetStatus().Message().find(thrown ? "the disk is on fire" : "no such chunk"),
        std::string::npos)
        << brick.GetStatus().Message();
      EXPECT_NE(brick.GetStatus().Message().find(key.ToString()), std::string::npos);
    }
    EXPECT_TRUE(source->ReadBrick(BrickKey::Of(0, { 3, 0, 0 })).Ok());
  }
  throws = false;
  // What can't be read may be anything; the others are known.
  const auto ranges = source->ReadRanges({}, { 4, 1, 1 });
  ASSERT_TRUE(ranges.Ok());
  EXPECT_FALSE(ranges.Value()[0].IsKnown());
  EXPECT_TRUE(ranges.Value()[3].IsKnown());
  broken = false;
  const auto levels = test::Pyramid(volume, source->Info().Layout, Downsampling::Average);
  for (int l = 0; l <= coarsest; ++l)
  {
    test::ExpectBricks(*source, l, levels[static_cast<std::size_t>(l)]);
  }
}

TEST(LevelsBrickSource, TooSmallABudgetIsANamedError)
{
  const auto volume = test::RandomVolume<std::uint8_t>({ 64, 64, 64 }, 1, 14);
  const auto source = LevelsBrickSource::Make(Describe(std::vector{ volume }, 16)).Value();
  source->SetMemoryBudget(source->LeastMemory() - 1);
  const auto brick = source->ReadBrick({});
  ASSERT_FALSE(brick.Ok());
  EXPECT_EQ(brick.GetStatus().Code(), StatusCode::ResourceExhausted);
  EXPECT_NE(
    brick.GetStatus().Message().find(std::to_string(source->LeastMemory())), std::string::npos);
  EXPECT_EQ(source->BytesRead(), 0u);
  source->SetMemoryBudget(source->LeastMemory());
  EXPECT_TRUE(source->ReadBrick({}).Ok());
}

TEST(LevelsBrickSource, WhatCannotBeIsRefused)
{
  const auto fine = test::RandomVolume<std::uint8_t>({ 20, 20, 20 }, 1, 15);
  const auto coarse = test::RandomVolume<std::uint8_t>({ 7, 10, 10 }, 1, 16);
  std::vector<LevelsDescription> wrong(6, Describe(std::vector{ fine }, 8));
  wrong[0].Read = nullptr;
  wrong[1].Levels.clear();
  wrong[2].Levels[0].Factor = { 2, 1, 1 };
  wrong[3].Components = 5;
  wrong[4].Spacing[1] = 0;
  wrong[5].BrickSize = 7; // levels are made of whole bricks
  wrong.push_back(Describe(std::vector{ fine, coarse }, 8));
  wrong.back().Levels[1].Factor = { 2, 2, 2 };
  std::set<std::string> reasons;
  for (const LevelsDescription& description : wrong)
  {
    const auto source = LevelsBrickSource::Make(description);
    ASSERT_FALSE(source.Ok());
    reasons.insert(source.GetStatus().Message());
  }
  EXPECT_EQ(reasons.size(), wrong.size());
}

TEST(WaitScope, HooksAreCalledInPairsAroundWaiting)
{
  static int begun = 0;
  static int ended = 0;
  SetWaitHooks({ []() -> void* { return begun++ == 0 ? &ended : nullptr; },
    [](void* state) { *static_cast<int*>(state ? state : &ended) += 1; } });
  {
    const WaitScope outer;
    EXPECT_EQ(begun, 1);
    {
      const WaitScope inner;
      EXPECT_EQ(begun, 2);
    }
    EXPECT_EQ(ended, 1);
    SetWaitHooks({}); // the outer one still ends as it began
  }
  EXPECT_EQ(ended, 2);
  const WaitScope none;
  EXPECT_EQ(begun, 2);
}

} // namespace teravox
