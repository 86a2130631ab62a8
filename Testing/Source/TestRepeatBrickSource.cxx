// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ArrayBrickSource.h"
#include "FaultyBrickSource.h"
#include "RepeatBrickSource.h"
#include "SourceChecks.h"

#include <gtest/gtest.h>
#include <thread>

namespace teravox
{

namespace
{
using test::Dense;

template <typename T>
std::shared_ptr<ArrayBrickSource> SourceOf(
  const Dense<T>& volume, int brickSize, bool labels = false, const Double3& spacing = { 1, 1, 1 })
{
  ArrayDescription array;
  array.Data = volume.Voxels.data();
  array.Type = test::TypeOf<T>();
  array.Components = volume.Components;
  array.Dimensions = volume.Dimensions;
  array.BrickSize = brickSize;
  array.Labels = labels;
  array.Spacing = spacing;
  return ArrayBrickSource::Make(array).Value();
}

/// The array of all copies.
template <typename T>
Dense<T> RepeatDense(
  const Dense<T>& volume, const Int3& pitch, const Int3& repetitions, T background)
{
  Dense<T> all;
  all.Components = volume.Components;
  for (std::size_t a = 0; a < 3; ++a)
  {
    all.Dimensions[a] = pitch[a] * repetitions[a];
  }
  for (std::int64_t z = 0; z < all.Dimensions[2]; ++z)
  {
    for (std::int64_t y = 0; y < all.Dimensions[1]; ++y)
    {
      for (std::int64_t x = 0; x < all.Dimensions[0]; ++x)
      {
        const Int3 p{ x % pitch[0], y % pitch[1], z % pitch[2] };
        const bool inside =
          p[0] < volume.Dimensions[0] && p[1] < volume.Dimensions[1] && p[2] < volume.Dimensions[2];
        for (int c = 0; c < all.Components; ++c)
        {
          all.Voxels.push_back(inside ? volume.At(p[0], p[1], p[2])[c] : background);
        }
      }
    }
  }
  return all;
}

struct Case
{
  Int3 Size;
  Int3 Pitch;
  Int3 Repetitions;
  int InnerBrick = 8;
  int Brick = 8;
  Double3 Spacing{ 1, 1, 1 };
  int Components = 1;
  bool Labels = false;
};

/// All voxels and ranges of all levels against the dense array, with levels kept whole and without.
template <typename T>
void ExpectRepetition(const Case& c, T background)
{
  auto volume = test::RandomVolume<T>(c.Size, c.Components, 21);
  if (c.Labels)
  {
    for (T& v : volume.Voxels)
    {
      v = static_cast<T>(static_cast<std::int64_t>(v) % 4);
    }
  }
  RepeatDescription repeat;
  repeat.Inner = SourceOf(volume, c.InnerBrick, c.Labels, c.Spacing);
  repeat.Pitch = c.Pitch;
  repeat.Repetitions = c.Repetitions;
  repeat.Background = static_cast<double>(background);
  repeat.BrickSize = c.Brick;
  for (const std::int64_t limit : { 0, 1 << 18 })
  {
    repeat.WholeLevelLimit = limit;
    const auto source = RepeatBrickSource::Make(repeat);
    ASSERT_TRUE(source.Ok()) << source.GetStatus().Message();
    const auto levels = test::Pyramid(RepeatDense(volume, c.Pitch, c.Repetitions, background),
      source.Value()->Info().Layout, c.Labels ? Downsampling::Mode : Downsampling::Average);
    ASSERT_GE(levels.size(), 3u);
    for (std::size_t l = levels.size(); l-- > 0;)
    {
      SCOPED_TRACE("level " + std::to_string(l) + ", limit " + std::to_string(limit));
      test::ExpectBricks(*source.Value(), static_cast<int>(l), levels[l]);
      const test::RangeCounts counts =
        test::ExpectRanges(*source.Value(), static_cast<int>(l), levels[l]);
      if (l > 0 && limit > 0)
      {
        EXPECT_EQ(counts.Exact, counts.Regions);
      }
    }
  }
}
} // namespace

TEST(RepeatBrickSource, PitchThatFitsTheLevels)
{
  ExpectRepetition<std::uint8_t>({ { 16, 16, 16 }, { 16, 16, 16 }, { 3, 2, 4 } }, 0);
}

TEST(RepeatBrickSource, PaddedPitch)
{
  ExpectRepetition<std::uint8_t>({ { 29, 25, 21 }, { 32, 32, 24 }, { 3, 2, 3 } }, 0);
  ExpectRepetition<std::int16_t>({ { 29, 25, 21 }, { 40, 32, 24 }, { 2, 3, 2 } }, -700);
}

TEST(RepeatBrickSource, OddPitches)
{
  ExpectRepetition<std::uint8_t>({ { 13, 11, 7 }, { 13, 11, 7 }, { 5, 4, 7 } }, 0);
  ExpectRepetition<std::uint16_t>({ { 13, 10, 7 }, { 15, 11, 9 }, { 4, 5, 5 } }, 77);
  ExpectRepetition<std::uint8_t>({ { 21, 12, 6 }, { 22, 20, 6 }, { 3, 3, 5 } }, 200);
}

TEST(RepeatBrickSource, TinyPeriodsAndOneVoxel)
{
  ExpectRepetition<std::uint8_t>({ { 1, 1, 1 }, { 3, 2, 5 }, { 11, 17, 7 } }, 9);
  ExpectRepetition<float>({ { 2, 2, 2 }, { 2, 2, 2 }, { 20, 17, 13 } }, 0.5F);
}

TEST(RepeatBrickSource, OneCopyAlongSomeAxes)
{
  ExpectRepetition<std::uint8_t>({ { 45, 30, 13 }, { 45, 30, 13 }, { 1, 1, 3 } }, 0);
  ExpectRepetition<std::uint8_t>({ { 45, 30, 13 }, { 47, 30, 13 }, { 1, 2, 1 } }, 5);
  ExpectRepetition<std::uint8_t>({ { 45, 30, 33 }, { 45, 30, 33 }, { 1, 1, 1 } }, 5);
}

TEST(RepeatBrickSource, OtherBrickSizesThanTheInnerOnes)
{
  ExpectRepetition<std::uint8_t>({ { 29, 25, 21 }, { 32, 32, 32 }, { 3, 2, 2 }, 16, 8 }, 0);
  ExpectRepetition<std::uint8_t>({ { 29, 25, 21 }, { 32, 32, 24 }, { 3, 2, 2 }, 4, 16 }, 0);
}

TEST(RepeatBrickSource, AnisotropicComponentsAndLabels)
{
  Case anisotropic{ { 30, 28, 6 }, { 32, 32, 6 }, { 3, 2, 4 } };
  anisotropic.Spacing = { 1, 1, 5 };
  ExpectRepetition<std::uint16_t>(anisotropic, 3);
  Case colours{ { 15, 13, 9 }, { 16, 16, 10 }, { 3, 2, 3 } };
  colours.Components = 3;
  ExpectRepetition<std::uint8_t>(colours, 1);
  Case labels{ { 15, 13, 9 }, { 16, 15, 10 }, { 3, 2, 3 } };
  labels.Labels = true;
  ExpectRepetition<std::int32_t>(labels, 2);
}

TEST(RepeatBrickSource, AllTypes)
{
  for (const ScalarType type : AllScalarTypes)
  {
    DispatchScalarType(type,
      [](auto tag)
      {
        ExpectRepetition<decltype(tag)>(
          { { 13, 14, 7 }, { 16, 15, 8 }, { 2, 2, 3 } }, decltype(tag){ 1 });
      });
  }
}

TEST(RepeatBrickSource, AlignedBricksHaveTheInnerRanges)
{
  const auto volume = test::RandomVolume<std::uint8_t>({ 64, 64, 64 }, 1, 31);
  const auto inner = SourceOf(volume, 8);
  RepeatDescription repeat;
  repeat.Inner = inner;
  repeat.Repetitions = { 4, 4, 4 };
  repeat.WholeLevelLimit = 0;
  const auto source = RepeatBrickSource::Make(repeat).Value();
  // Away from the faces of a copy nothing is lost.
  BrickKey here;
  here.X = here.Y = here.Z = 9;
  BrickKey there;
  there.X = there.Y = there.Z = 1;
  EXPECT_EQ(
    source->ReadRanges(here, { 6, 6, 6 }).Value(), inner->ReadRanges(there, { 6, 6, 6 }).Value());
}

// A budget of nothing only costs time.
TEST(RepeatBrickSource, ManyThreadsAndNoBudget)
{
  const auto volume = test::RandomVolume<std::uint8_t>({ 21, 12, 6 }, 1, 32);
  for (const std::uint64_t budget : { 0, 1 << 20 })
  {
    RepeatDescription repeat;
    repeat.Inner = SourceOf(volume, 8);
    repeat.Pitch = { 22, 20, 6 };
    repeat.Repetitions = { 2, 2, 4 };
    repeat.MemoryBudget = budget;
    repeat.WholeLevelLimit = 0;
    const auto source = RepeatBrickSource::Make(repeat).Value();
    const auto levels =
      test::Pyramid(RepeatDense<std::uint8_t>(volume, repeat.Pitch, repeat.Repetitions, 0),
        source->Info().Layout, Downsampling::Average);
    std::vector<std::thread> threads;
    for (std::size_t t = 0; t < 3; ++t)
    {
      threads.emplace_back(
        [&, t]
        {
          for (std::size_t i = 0; i < levels.size(); ++i)
          {
            const std::size_t l = (i + t) % levels.size();
            test::ExpectBricks(*source, static_cast<int>(l), levels[l]);
            test::ExpectRanges(*source, static_cast<int>(l), levels[l]);
          }
        });
    }
    for (std::thread& thread : threads)
    {
      thread.join();
    }
    EXPECT_LE(source->MemoryUsed() - repeat.Inner->MemoryUsed(), budget);
  }
}

// 1.2e18 voxels per level-0 axis triple: what the far corner shows is known.
TEST(RepeatBrickSource, TheLargestVolume)
{
  const auto volume = test::RandomVolume<std::uint8_t>({ 61, 60, 50 }, 1, 33);
  RepeatDescription repeat;
  repeat.Inner = SourceOf(volume, 16);
  repeat.Pitch = { 64, 64, 64 };
  const std::int64_t copies = (std::int64_t{ 1 } << 25) - 1;
  repeat.Repetitions = { copies, copies, copies };
  repeat.Background = 6;
  const auto source = RepeatBrickSource::Make(repeat).Value();
  const PyramidLayout& layout = source->Info().Layout;
  BrickKey key;
  key.X = static_cast<std::uint32_t>(layout.Bricks(0)[0] - 4);
  key.Y = static_cast<std::uint32_t>(layout.Bricks(0)[1] - 3);
  key.Z = static_cast<std::uint32_t>(layout.Bricks(0)[2] - 2);
  const BrickPointer brick = source->ReadBrick(key).Value();
  const auto* voxels = reinterpret_cast<const std::uint8_t*>(brick->Voxels.data());
  for (std::int64_t i = 0; i < 20 * 20 * 20; ++i)
  {
    // Brick (0, 1, 2) of its copy.
    const Int3 p{ (i % 20 - 2 + 64) % 64, i / 20 % 20 + 14, i / 400 + 30 };
    const bool inside = p[0] < 61 && p[1] < 60 && p[2] < 50;
    ASSERT_EQ(voxels[i], inside ? *volume.At(p[0], p[1], p[2]) : 6);
  }
  // Where one voxel covers whole copies the field is a single value, and the ranges say so.
  for (int l = 6; l < layout.NumberOfLevels() - 1; ++l)
  {
    BrickKey page;
    page.Level = static_cast<std::uint8_t>(l);
    page.PageLevel = static_cast<std::uint8_t>(layout.PageDepth());
    const ValueRange range = source->ReadRanges(page, { 1, 1, 1 }).Value()[0];
    EXPECT_TRUE(range.IsSingle()) << "level " << l << ": " << range.Min << " to " << range.Max;
  }
  EXPECT_LT(source->MemoryUsed(), 8u << 20);
}

// What is skipped must not depend on memory: the picture would.
TEST(RepeatBrickSource, NoBudgetChangesARange)
{
  const auto volume = test::RandomVolume<std::uint16_t>({ 45, 41, 30 }, 1, 37);
  RepeatDescription repeat;
  repeat.Inner = SourceOf(volume, 8);
  repeat.Pitch = { 48, 47, 32 };
  repeat.Repetitions = { 5, 4, 3 };
  repeat.WholeLevelLimit = 20000;
  const auto rich = RepeatBrickSource::Make(repeat).Value();
  repeat.MemoryBudget = 0;
  const auto poor = RepeatBrickSource::Make(repeat).Value();
  const PyramidLayout& layout = rich->Info().Layout;
  for (int l = layout.NumberOfLevels() - 1; l >= 0; --l)
  {
    for (int page = 0; page <= layout.PageDepth(); ++page)
    {
      BrickKey key;
      key.Level = static_cast<std::uint8_t>(l);
      key.PageLevel = static_cast<std::uint8_t>(page);
      const Int3 pages = layout.Pages(l, page);
      const Int3 count{ std::min<std::int64_t>(pages[0], 9), std::min<std::int64_t>(pages[1], 9),
        std::min<std::int64_t>(pages[2], 9) };
      EXPECT_EQ(rich->ReadRanges(key, count).Value(), poor->ReadRanges(key, count).Value());
    }
  }
  EXPECT_GT(rich->MemoryUsed(), poor->MemoryUsed());
}

TEST(RepeatBrickSource, RangeAndHistogramCountTheBackground)
{
  class Known : public test::FaultyBrickSource
  {
  public:
    explicit Known(std::shared_ptr<BrickSource> inner)
      : FaultyBrickSource(inner)
      , Copy(inner->Info())
    {
      this->Copy.Range = { 0, 8 };
      this->Copy.Histogram = { 300, 200, 100, 400 };
    }
    const VolumeInfo& Info() const override { return this->Copy; }

  private:
    VolumeInfo Copy;
  };
  const auto volume = test::RandomVolume<std::uint8_t>({ 10, 10, 10 }, 1, 34);
  RepeatDescription repeat;
  repeat.Inner = std::make_shared<Known>(SourceOf(volume, 8));
  repeat.Repetitions = { 2, 1, 1 };
  repeat.Pitch = { 11, 10, 10 };
  repeat.Background = 5;
  EXPECT_EQ(RepeatBrickSource::Make(repeat).Value()->Info().Histogram,
    (std::vector<double>{ 600, 400, 400, 800 }));
  repeat.Background = 9;
  const auto outside = RepeatBrickSource::Make(repeat).Value();
  EXPECT_EQ(outside->Info().Range, (ValueRange{ 0, 9 }));
  EXPECT_TRUE(outside->Info().Histogram.empty());
}

TEST(RepeatBrickSource, ErrorsSayWhatIsWrong)
{
  const auto volume = test::RandomVolume<std::uint8_t>({ 10, 10, 10 }, 1, 35);
  const auto fails = [&](auto change, const char* words)
  {
    RepeatDescription repeat;
    repeat.Inner = SourceOf(volume, 8);
    repeat.Repetitions = { 2, 2, 2 };
    change(repeat);
    const auto source = RepeatBrickSource::Make(repeat);
    ASSERT_FALSE(source.Ok());
    EXPECT_NE(source.GetStatus().Message().find(words), std::string::npos)
      << source.GetStatus().Message();
  };
  fails([](RepeatDescription& r) { r.Inner.reset(); }, "no source");
  fails([](RepeatDescription& r) { r.Pitch = { 9, 10, 10 }; }, "pitch of 9");
  fails([](RepeatDescription& r) { r.Repetitions[2] = 0; }, "0 repetitions");
  fails([](RepeatDescription& r) { r.Repetitions[0] = std::int64_t{ 1 } << 62; }, "repetitions");
  fails([](RepeatDescription& r) { r.Repetitions[0] = std::int64_t{ 1 } << 30; }, "2^31");
  fails([](RepeatDescription& r) { r.Background = 256; }, "u8");
  fails([](RepeatDescription& r) { r.Background = 0.5; }, "u8");
}

TEST(RepeatBrickSource, AFailingInnerBrickFailsTheBricksThatNeedIt)
{
  const auto volume = test::RandomVolume<std::uint8_t>({ 32, 32, 32 }, 1, 36);
  const auto faulty = std::make_shared<test::FaultyBrickSource>(SourceOf(volume, 8));
  faulty->SetFaults(
    [](const BrickKey& key)
    {
      return key.Level == 0 && key.X == 1 && key.PageLevel == 0 ? test::Fault::Status
                                                                : test::Fault::None;
    });
  RepeatDescription repeat;
  repeat.Inner = faulty;
  repeat.Repetitions = { 3, 3, 3 };
  const auto source = RepeatBrickSource::Make(repeat).Value();
  int failures = 0;
  for (std::uint32_t x = 0; x < 12; ++x)
  {
    BrickKey key;
    key.X = x;
    const auto brick = source->ReadBrick(key);
    failures += brick.Ok() ? 0 : 1;
    if (!brick)
    {
      EXPECT_EQ(brick.GetStatus().Code(), StatusCode::InputOutput);
      EXPECT_NE(brick.GetStatus().Message().find("brick (1, 0, 0)"), std::string::npos);
    }
  }
  EXPECT_GE(failures, 3);
  EXPECT_LE(failures, 9); // neighbours need it for their border
}

} // namespace teravox
