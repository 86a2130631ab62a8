// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ArrayBrickSource.h"
#include "ProcessMemory.h"
#include "SourceChecks.h"

#include <atomic>
#include <gtest/gtest.h>
#include <set>
#include <thread>

namespace teravox
{

namespace
{
using test::Dense;

template <typename T>
ArrayDescription Describe(const Dense<T>& volume, int brickSize)
{
  ArrayDescription array;
  array.Data = volume.Voxels.data();
  array.Type = test::TypeOf<T>();
  array.Components = volume.Components;
  array.Dimensions = volume.Dimensions;
  array.BrickSize = brickSize;
  return array;
}

template <typename T>
void ExpectPyramid(const ArrayDescription& array, const Dense<T>& volume)
{
  const auto source = ArrayBrickSource::Make(array);
  ASSERT_TRUE(source.Ok()) << source.GetStatus().Message();
  const auto levels = test::Pyramid(volume, source.Value()->Info().Layout,
    array.Labels ? Downsampling::Mode : Downsampling::Average);
  for (int l = static_cast<int>(levels.size()) - 1; l >= 0; --l)
  {
    const auto& level = levels[static_cast<std::size_t>(l)];
    test::ExpectBricks(*source.Value(), l, level);
    const test::RangeCounts counts = test::ExpectRanges(*source.Value(), l, level);
    EXPECT_EQ(counts.Exact, counts.Regions);
  }
}
} // namespace

TEST(ArrayBrickSource, AllTypesAllLevelsAllVoxels)
{
  for (const ScalarType type : AllScalarTypes)
  {
    DispatchScalarType(type,
      [](auto tag)
      {
        const auto volume = test::RandomVolume<decltype(tag)>({ 45, 30, 37 }, 1, 5);
        ExpectPyramid(Describe(volume, 8), volume);
      });
  }
}

TEST(ArrayBrickSource, ComponentsAndLabels)
{
  for (int components = 2; components <= 4; ++components)
  {
    const auto volume = test::RandomVolume<std::uint8_t>({ 21, 18, 9 }, components, 6);
    ExpectPyramid(Describe(volume, 8), volume);
  }
  auto labels = test::RandomVolume<std::int16_t>({ 33, 21, 17 }, 1, 7);
  for (std::int16_t& v : labels.Voxels)
  {
    v = static_cast<std::int16_t>(v % 5);
  }
  ArrayDescription array = Describe(labels, 8);
  array.Labels = true;
  ExpectPyramid(array, labels);
}

TEST(ArrayBrickSource, NaNAndInfinity)
{
  auto volume = test::RandomVolume<float>({ 40, 24, 16 }, 1, 8);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (std::int64_t i = 0; i < 16 * 24 * 40; ++i)
  {
    if (i % 40 < 24 || i % 7 == 0) // whole bricks of NaN at small x
    {
      volume.Voxels[static_cast<std::size_t>(i)] = nan;
    }
  }
  volume.Voxels.back() = std::numeric_limits<float>::infinity();
  ExpectPyramid(Describe(volume, 8), volume);
  const auto source = ArrayBrickSource::Make(Describe(volume, 8)).Value();
  EXPECT_TRUE(source->ReadRanges({}, { 1, 1, 1 }).Value()[0].IsVoid());
  BrickKey last;
  last.X = 4;
  last.Y = 2;
  last.Z = 1;
  EXPECT_FALSE(source->ReadRanges(last, { 1, 1, 1 }).Value()[0].IsKnown()); // never skipped
}

// Where one value lies beside NaN, in a cell, in cells beside each other or in a coarser region, a
// brick isn't one of a single value: that would be drawn without being read.
TEST(ArrayBrickSource, OneValueBesideNaNIsNotSingle)
{
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const std::int64_t first : { 5, 8, 32, 33 }) // x from which on there is no value
  {
    test::Dense<float> volume{ { 80, 24, 16 }, 1, std::vector<float>(80 * 24 * 16, 5.0f) };
    for (std::int64_t i = 0; i < 80 * 24 * 16; ++i)
    {
      if (i % 80 >= first && i % 80 < 64)
      {
        volume.Voxels[static_cast<std::size_t>(i)] = nan;
      }
    }
    const auto source = ArrayBrickSource::Make(Describe(volume, 16)).Value();
    const std::vector<ValueRange> ranges = source->ReadRanges({}, { 5, 1, 1 }).Value();
    const std::int64_t b = (first - 1) / 16;
    EXPECT_FALSE(ranges[static_cast<std::size_t>(b)].IsSingle()) << first;
    EXPECT_TRUE(ranges[static_cast<std::size_t>(b)].Contains({ 5, 5 }));
    EXPECT_LT(ranges[static_cast<std::size_t>(b)].Max, 5.00001);
    EXPECT_FALSE(ranges[3].IsSingle()); // its border reaches the values behind
    EXPECT_TRUE(b == 0 || ranges[0] == (ValueRange{ 5, 5 })) << first;
    EXPECT_EQ(source->ReadRanges({}, { 1, 1, 1 }).Value()[0].IsSingle(), b > 0);
  }
}

TEST(ArrayBrickSource, StridesNameAPartOfALargerArray)
{
  const auto whole = test::RandomVolume<std::uint16_t>({ 40, 30, 20 }, 2, 9);
  Dense<std::uint16_t> part{ { 25, 20, 11 }, 2, {} };
  for (std::int64_t i = 0; i < 25 * 20 * 11; ++i)
  {
    const std::uint16_t* v = whole.At(3 + i % 25, 5 + i / 25 % 20, 6 + i / 500);
    part.Voxels.insert(part.Voxels.end(), v, v + 2);
  }
  ArrayDescription array = Describe(part, 8);
  array.Data = whole.At(3, 5, 6);
  array.RowStride = 40 * 2;
  array.SliceStride = 40 * 30 * 2;
  ExpectPyramid(array, part);
}

TEST(ArrayBrickSource, AnisotropicSpacingAndASingleVoxel)
{
  const auto flat = test::RandomVolume<std::uint8_t>({ 70, 50, 5 }, 1, 10);
  ArrayDescription array = Describe(flat, 8);
  array.Spacing = { 1, 1, 5 };
  ExpectPyramid(array, flat);
  const auto voxel = test::RandomVolume<double>({ 1, 1, 1 }, 1, 11);
  ExpectPyramid(Describe(voxel, 64), voxel);
}

// Two identical pages of 1 TiB each would be needed if making it cost anything.
TEST(ArrayBrickSource, MakingItReadsNothing)
{
  const std::uint8_t nothing = 0;
  ArrayDescription array;
  array.Data = &nothing;
  array.Dimensions = { 100000, 100000, 100000 };
  const auto source = ArrayBrickSource::Make(array);
  ASSERT_TRUE(source.Ok());
  EXPECT_EQ(source.Value()->MemoryUsed(), 0u);
}

TEST(ArrayBrickSource, KeepsItsOwnerAlive)
{
  auto volume =
    std::make_shared<Dense<std::uint8_t>>(test::RandomVolume<std::uint8_t>({ 20, 20, 20 }, 1, 12));
  const std::weak_ptr<Dense<std::uint8_t>> watch = volume;
  ArrayDescription array = Describe(*volume, 8);
  array.Owner = volume;
  auto source = ArrayBrickSource::Make(array).Value();
  array.Owner.reset();
  const Dense<std::uint8_t> copy = *volume;
  volume.reset();
  EXPECT_FALSE(watch.expired());
  test::ExpectBricks(*source, 0, copy);
  source.reset();
  EXPECT_TRUE(watch.expired());
}

TEST(ArrayBrickSource, ManyThreadsBuildEachLevelOnce)
{
  const auto volume = test::RandomVolume<std::uint16_t>({ 60, 50, 40 }, 1, 13);
  const auto source = ArrayBrickSource::Make(Describe(volume, 8)).Value();
  const auto levels = test::Pyramid(volume, source->Info().Layout, Downsampling::Average);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
  {
    threads.emplace_back(
      [&, t]
      {
        for (std::size_t i = 0; i < levels.size(); ++i)
        {
          const std::size_t l = (i + static_cast<std::size_t>(t)) % levels.size();
          test::ExpectBricks(*source, static_cast<int>(l), levels[l]);
          test::ExpectRanges(*source, static_cast<int>(l), levels[l]);
        }
      });
  }
  for (std::thread& thread : threads)
  {
    thread.join();
  }
  std::uint64_t voxels = 0;
  for (std::size_t l = 1; l < levels.size(); ++l)
  {
    voxels += levels[l].Voxels.size() * 2;
  }
  EXPECT_GT(source->MemoryUsed(), voxels);
  EXPECT_LT(source->MemoryUsed(), voxels + volume.Voxels.size());
}

// Contract 5: levels that don't fit are computed brick by brick, with the same bits.
TEST(ArrayBrickSource, AnyBudgetGivesTheSameBricks)
{
  const auto check = [](const auto& volume, bool labels)
  {
    ArrayDescription array = Describe(volume, 8);
    array.Labels = labels;
    const auto source = ArrayBrickSource::Make(array).Value();
    const auto levels = test::Pyramid(
      volume, source->Info().Layout, labels ? Downsampling::Mode : Downsampling::Average);
    const auto count = static_cast<int>(levels.size());
    ASSERT_GE(count, 4);
    std::uint64_t all = source->LeastMemory();
    for (const auto& level : levels)
    {
      all += level.Voxels.size() * sizeof(level.Voxels[0]);
    }
    std::set<int> kept;
    // Up and down: what was kept goes, and comes back.
    for (const double share : { 1.0, 0.0, 0.1, 0.3, 0.02, 0.0, 0.6, 1.0, 0.05 })
    {
      const std::uint64_t budget = source->LeastMemory() +
        static_cast<std::uint64_t>(share * static_cast<double>(all - source->LeastMemory()));
      source->SetMemoryBudget(budget);
      kept.insert(source->FirstKeptLevel());
      for (int l = count - 1; l >= 0; --l)
      {
        test::ExpectBricks(*source, l, levels[static_cast<std::size_t>(l)]);
        ASSERT_LE(source->MemoryUsed(), budget);
        test::ExpectRanges(*source, l, levels[static_cast<std::size_t>(l)]);
        ASSERT_LE(source->MemoryUsed(), budget);
      }
    }
    EXPECT_GE(kept.size(), 3u) << "budgets in between keep some of the levels";
    EXPECT_EQ(*kept.begin(), 1);
  };
  check(test::RandomVolume<std::uint16_t>({ 130, 70, 90 }, 1, 21), false);
  check(test::RandomVolume<float>({ 100, 90, 110 }, 1, 22), false);
  check(test::RandomVolume<std::uint8_t>({ 131, 71, 89 }, 1, 23), true);
}

TEST(ArrayBrickSource, TooSmallABudgetNamesTheLeastThatWorks)
{
  const auto volume = test::RandomVolume<std::uint8_t>({ 90, 80, 70 }, 1, 24);
  const auto source = ArrayBrickSource::Make(Describe(volume, 8)).Value();
  const std::uint64_t least = source->LeastMemory();
  EXPECT_GT(least, 0u);
  EXPECT_TRUE(source->ReadRanges({}, { 1, 1, 1 }).Ok());
  source->SetMemoryBudget(least - 1);
  EXPECT_EQ(source->MemoryUsed(), 0u) << "what was made goes at once";
  const auto refused = [&](const Status& status)
  {
    EXPECT_EQ(status.Code(), StatusCode::ResourceExhausted);
    EXPECT_NE(status.Message().find(std::to_string(least)), std::string::npos) << status.Message();
  };
  refused(source->ReadBrick({}).GetStatus());
  refused(source->ReadRanges({}, { 1, 1, 1 }).GetStatus());
  source->SetMemoryBudget(least);
  EXPECT_TRUE(source->ReadBrick({}).Ok());
  EXPECT_TRUE(source->ReadRanges({}, { 1, 1, 1 }).Ok());
  EXPECT_LE(source->MemoryUsed(), least);
}

// The counter is the truth: what the allocator has given out grows and shrinks with it.
TEST(ArrayBrickSource, MemoryUsedIsWhatIsAllocated)
{
  const auto volume = test::RandomVolume<std::uint16_t>({ 200, 180, 160 }, 1, 26);
  const auto source = ArrayBrickSource::Make(Describe(volume, 16)).Value();
  const auto readAll = [&](std::uint64_t budget)
  {
    source->SetMemoryBudget(budget);
    for (int l = source->Info().Layout.NumberOfLevels() - 1; l >= 0; --l)
    {
      BrickKey key;
      key.Level = static_cast<std::uint8_t>(l);
      EXPECT_TRUE(source->ReadBrick(key).Ok());
      EXPECT_TRUE(source->ReadRanges(key, { 1, 1, 1 }).Ok());
    }
  };
  readAll(source->LeastMemory()); // OpenMP's own memory is there from now on
  source->SetMemoryBudget(0);
  ASSERT_EQ(source->MemoryUsed(), 0u);
  const std::uint64_t before = test::AllocatedBytes();
  if (before == 0)
  {
    GTEST_SKIP() << "the allocator doesn't tell what it has given out";
  }
  const std::uint64_t least = source->LeastMemory();
  for (const std::uint64_t budget : { least, least + 200000, std::uint64_t{ 1 } << 30, least })
  {
    readAll(budget);
    const auto counted = static_cast<double>(source->MemoryUsed());
    const auto allocated =
      static_cast<double>(test::AllocatedBytes()) - static_cast<double>(before);
    EXPECT_LE(source->MemoryUsed(), budget);
    // Room for pieces is counted as a whole when a thread asks for it.
    EXPECT_LE(allocated, counted + 65536) << "budget " << budget;
    EXPECT_GE(allocated, 0.5 * counted) << "budget " << budget;
  }
}

TEST(ArrayBrickSource, ManyThreadsAndAChangingBudget)
{
  const auto volume = test::RandomVolume<std::uint8_t>({ 60, 50, 40 }, 1, 25);
  const auto source = ArrayBrickSource::Make(Describe(volume, 8)).Value();
  const auto levels = test::Pyramid(volume, source->Info().Layout, Downsampling::Average);
  std::atomic<bool> stop{ false };
  std::thread changes(
    [&]
    {
      for (std::uint64_t i = 0; !stop; ++i)
      {
        source->SetMemoryBudget(source->LeastMemory() + (i % 3) * 20000);
        std::this_thread::yield();
      }
    });
  std::vector<std::thread> readers;
  for (int t = 0; t < 3; ++t)
  {
    readers.emplace_back(
      [&]
      {
        for (std::size_t l = 0; l < levels.size(); ++l)
        {
          test::ExpectBricks(*source, static_cast<int>(l), levels[l]);
          test::ExpectRanges(*source, static_cast<int>(l), levels[l]);
        }
      });
  }
  for (std::thread& reader : readers)
  {
    reader.join();
  }
  stop = true;
  changes.join();
}

TEST(ArrayBrickSource, RangeOfAllVoxels)
{
  const auto volume = test::RandomVolume<std::int32_t>({ 30, 30, 30 }, 1, 14);
  const auto [low, high] = std::minmax_element(volume.Voxels.begin(), volume.Voxels.end());
  EXPECT_EQ(ArrayBrickSource::Make(Describe(volume, 8)).Value()->ComputeRange().Value(),
    (ValueRange{ static_cast<double>(*low), static_cast<double>(*high) }));
}

TEST(ArrayBrickSource, ErrorsSayWhatIsWrong)
{
  const auto volume = test::RandomVolume<std::uint8_t>({ 8, 8, 8 }, 1, 15);
  const auto fails = [&](auto change, const char* words)
  {
    ArrayDescription array = Describe(volume, 8);
    array.Name = "density of ct.vti";
    change(array);
    const auto source = ArrayBrickSource::Make(array);
    ASSERT_FALSE(source.Ok());
    EXPECT_NE(source.GetStatus().Message().find(words), std::string::npos)
      << source.GetStatus().Message();
    EXPECT_NE(source.GetStatus().Message().find("density of ct.vti"), std::string::npos);
  };
  fails([](ArrayDescription& a) { a.Data = nullptr; }, "no data");
  fails([](ArrayDescription& a) { a.Components = 5; }, "5 components");
  fails([](ArrayDescription& a) { a.Dimensions[1] = 0; }, "8 x 0 x 8");
  fails([](ArrayDescription& a) { a.RowStride = 7; }, "overlap");
  fails([](ArrayDescription& a) { a.SliceStride = 63; }, "overlap");
  fails([](ArrayDescription& a) { a.Spacing[2] = 0; }, "spacing");
  const auto source = ArrayBrickSource::Make(Describe(volume, 8)).Value();
  BrickKey key;
  key.X = 1;
  EXPECT_EQ(source->ReadBrick(key).GetStatus().Code(), StatusCode::InvalidArgument);
  key.Level = 9;
  EXPECT_EQ(source->ReadRanges(key, { 1, 1, 1 }).GetStatus().Code(), StatusCode::InvalidArgument);
  EXPECT_FALSE(source->ReadRanges({}, { 1, -1, 1 }).Ok());
  EXPECT_FALSE(source->ReadRanges({}, { 1 << 20, 1 << 20, 1 << 30 }).Ok());
}

} // namespace teravox
