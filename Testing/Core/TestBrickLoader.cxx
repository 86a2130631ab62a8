// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BrickLoader.h"
#include "FaultyBrickSource.h"

#include <algorithm>
#include <cstring>
#include <gtest/gtest.h>
#include <map>
#include <random>
#include <set>

namespace teravox
{

namespace
{
using test::Fault;
using test::FaultyBrickSource;

/// u16 volume of 32 x 16 x 16 bricks whose bricks and ranges are made of their own key.
class KeySource : public BrickSource
{
public:
  explicit KeySource(std::uint16_t tag = 0)
    : Tag(tag)
  {
    this->Info_.Layout = PyramidLayout::MakeDefault({ 256, 128, 128 }, { 1, 1, 1 }, 8).Value();
    this->Info_.Type = ScalarType::UInt16;
    this->Info_.TimeSteps = 2;
    this->Info_.Name = "made of keys";
  }

  static std::uint16_t ValueOf(const BrickKey& key, std::uint16_t tag)
  {
    return static_cast<std::uint16_t>(BrickKeyHash()(key) % 60000 + tag);
  }

  const VolumeInfo& Info() const override { return this->Info_; }

  Result<BrickPointer> ReadBrick(const BrickKey& key) override
  {
    auto brick = std::make_shared<Brick>();
    brick->Type = ScalarType::UInt16;
    brick->StoredSize = this->Info_.Layout.StoredSize();
    const std::uint16_t value = ValueOf(key, this->Tag);
    const std::vector<std::uint16_t> voxels(
      static_cast<std::size_t>(brick->StoredSize * brick->StoredSize * brick->StoredSize), value);
    brick->Voxels.resize(voxels.size() * 2);
    std::memcpy(brick->Voxels.data(), voxels.data(), brick->Voxels.size());
    return BrickPointer(std::move(brick));
  }

  Result<std::vector<ValueRange>> ReadRanges(const BrickKey& first, const Int3& count) override
  {
    std::vector<ValueRange> ranges;
    for (std::int64_t i = 0; i < count[0] * count[1] * count[2]; ++i)
    {
      BrickKey key = first;
      key.X += static_cast<std::uint32_t>(i % count[0]);
      key.Y += static_cast<std::uint32_t>(i / count[0] % count[1]);
      key.Z += static_cast<std::uint32_t>(i / count[0] / count[1]);
      ValueRange range = ValueRange::Void();
      range.Include(ValueOf(key, this->Tag));
      ranges.push_back(range);
    }
    return ranges;
  }

private:
  VolumeInfo Info_;
  const std::uint16_t Tag;
};

constexpr std::uint64_t BrickBytes = CacheItem::Charge(12 * 12 * 12 * 2 + sizeof(Brick));
constexpr std::uint64_t BlockBytes = CacheItem::Charge(512 * sizeof(ValueRange));
constexpr double Patience = 60; // seconds until a hang counts as a failure

BrickKey KeyAt(std::uint32_t x, std::uint32_t y = 0, std::uint32_t z = 0, std::uint32_t volume = 0)
{
  BrickKey key;
  key.X = x;
  key.Y = y;
  key.Z = z;
  key.Volume = volume;
  return key;
}

std::vector<LoadRequest> Wishes(std::uint32_t first, std::uint32_t last)
{
  std::vector<LoadRequest> wishes;
  for (std::uint32_t x = first; x < last; ++x)
  {
    wishes.push_back({ KeyAt(x), 1.0 / (1.0 + x) });
  }
  return wishes;
}

std::uint16_t FirstVoxel(const LoadResult& result)
{
  std::uint16_t value = 0;
  std::memcpy(&value, result.Brick->Voxels.data(), sizeof(value));
  return value;
}

/// Takes results until nothing is pending.
std::vector<LoadResult> TakeAll(BrickLoader& loader)
{
  std::vector<LoadResult> all;
  while (loader.Pending() != 0)
  {
    EXPECT_TRUE(loader.WaitFinished(Patience));
    if (testing::Test::HasFailure())
    {
      break;
    }
    for (LoadResult& result : loader.TakeFinished())
    {
      all.push_back(std::move(result));
    }
  }
  return all;
}

/// A cache, a faulty source and a loader.
struct Bench
{
  explicit Bench(
    std::uint64_t budget, int threads = 2, std::optional<std::uint64_t> seed = std::nullopt)
    : Cache(std::make_shared<BrickCache>(budget))
    , Source(std::make_shared<FaultyBrickSource>(std::make_shared<KeySource>()))
    , Loader(std::make_unique<BrickLoader>(this->Cache, threads, seed))
  {
  }
  void Start() { this->Loader->SetSource(0, this->Source); }

  std::shared_ptr<BrickCache> Cache;
  std::shared_ptr<FaultyBrickSource> Source;
  std::unique_ptr<BrickLoader> Loader;
};
} // namespace

TEST(BrickLoader, BricksAndPageBlocksArriveAndAreCached)
{
  Bench bench(1 << 20);
  bench.Start();
  std::vector<LoadRequest> wishes = Wishes(0, 10);
  BrickKey block = KeyAt(1, 1);
  block.PageLevel = 1;
  wishes.push_back({ block, 5 });
  bench.Loader->Request(wishes);
  const std::vector<LoadResult> results = TakeAll(*bench.Loader);
  ASSERT_EQ(results.size(), 11u);
  for (const LoadResult& result : results)
  {
    ASSERT_TRUE(result.Outcome) << result.Outcome.Message();
    if (result.Key.PageLevel == 0)
    {
      EXPECT_EQ(FirstVoxel(result), KeySource::ValueOf(result.Key, 0));
      EXPECT_FALSE(result.Ranges);
      continue;
    }
    ASSERT_EQ(result.Ranges->size(), 512u);
    // Entry (3, 2, 1) of the block at (1, 1, 0) is brick (11, 10, 1).
    EXPECT_EQ((*result.Ranges)[3 + 8 * (2 + 8 * 1)].Min, KeySource::ValueOf(KeyAt(11, 10, 1), 0));
    EXPECT_FALSE(result.Brick);
  }
  EXPECT_EQ(bench.Source->Reads(), 11);
  EXPECT_EQ(bench.Cache->GetCounters().BytesUsed, 10 * BrickBytes + BlockBytes);
  bench.Loader->Request(wishes);
  EXPECT_TRUE(bench.Loader->WaitFinished(0));
  EXPECT_EQ(bench.Loader->TakeFinished().size(), 11u); // at once
  EXPECT_EQ(bench.Source->Reads(), 11);
  EXPECT_EQ(bench.Loader->GetCounters().FromCache, 11u);
  EXPECT_EQ(bench.Loader->GetCounters().BricksRead, 10u);
}

TEST(BrickLoader, OneThreadServesInTheOrderOfUrgency)
{
  Bench bench(1 << 20, 1);
  std::vector<std::uint32_t> order;
  bench.Source->SetFaults(
    [&](const BrickKey& key)
    {
      order.push_back(key.X);
      return Fault::None;
    });
  bench.Source->CloseGate();
  bench.Start();
  bench.Loader->Request({ { KeyAt(9), 0 } });
  bench.Source->WaitForReads(1); // what follows is queued behind it
  bench.Loader->Request(
    { { KeyAt(1), 1 }, { KeyAt(2), 2 }, { KeyAt(3), 3 }, { KeyAt(4), 2 }, { KeyAt(9), 7 } });
  EXPECT_EQ(bench.Loader->Pending(), 5u);
  EXPECT_EQ(bench.Loader->BytesInFlight(), BrickBytes);
  bench.Source->OpenGate();
  EXPECT_EQ(TakeAll(*bench.Loader).size(), 5u);
  EXPECT_EQ(order, (std::vector<std::uint32_t>{ 9, 3, 2, 4, 1 }));
  EXPECT_EQ(bench.Loader->BytesInFlight(), 0u);
}

TEST(BrickLoader, ANewFrameReplacesWhatWasNotStarted)
{
  Bench bench(1 << 20, 1);
  bench.Source->CloseGate();
  bench.Start();
  bench.Loader->Request(Wishes(0, 20));
  bench.Source->WaitForReads(1);
  bench.Loader->Request({ { KeyAt(30), 1 } });
  EXPECT_EQ(bench.Loader->Pending(), 2u);
  EXPECT_FALSE(bench.Loader->WaitFinished(0.001));
  bench.Source->OpenGate();
  EXPECT_EQ(TakeAll(*bench.Loader).size(), 2u);
  EXPECT_EQ(bench.Source->Reads(), 2);
}

TEST(BrickLoader, FailuresAreReportedOnceAndTriedAgain)
{
  struct Case
  {
    Fault Kind;
    StatusCode Code;
    const char* Words;
  };
  const std::array<Case, 6> cases{ { { Fault::Status, StatusCode::InputOutput, "Injected fault" },
    { Fault::Throw, StatusCode::InputOutput, "injected exception" },
    { Fault::ThrowOdd, StatusCode::InputOutput, "unknown exception" },
    { Fault::OutOfMemory, StatusCode::ResourceExhausted, "not enough memory" },
    { Fault::ShortData, StatusCode::Corrupt, "instead of 3456" },
    { Fault::NullBrick, StatusCode::Corrupt, "0 bytes" } } };
  for (const Case& c : cases)
  {
    Bench bench(1 << 20);
    std::atomic<bool> healed{ false };
    bench.Source->SetFaults(
      [&](const BrickKey& key) { return key.X == 3 && !healed ? c.Kind : Fault::None; });
    bench.Start();
    bench.Loader->Request(Wishes(0, 8));
    int failed = 0;
    for (const LoadResult& result : TakeAll(*bench.Loader))
    {
      EXPECT_EQ(result.Outcome.Ok(), result.Key.X != 3);
      if (!result.Outcome)
      {
        ++failed;
        EXPECT_EQ(result.Outcome.Code(), c.Code);
        EXPECT_NE(result.Outcome.Message().find(c.Words), std::string::npos)
          << result.Outcome.Message();
        EXPECT_NE(result.Outcome.Message().find("brick (3, 0, 0)"), std::string::npos);
      }
    }
    EXPECT_EQ(failed, 1);
    EXPECT_FALSE(bench.Cache->Contains(KeyAt(3)));
    EXPECT_EQ(bench.Cache->GetCounters().BytesReserved, 0u);
    healed = true;
    bench.Loader->Request({ { KeyAt(3), 1 } });
    const std::vector<LoadResult> again = TakeAll(*bench.Loader);
    ASSERT_EQ(again.size(), 1u);
    EXPECT_TRUE(again[0].Outcome);
  }
}

TEST(BrickLoader, ShortRangesAreCorrupt)
{
  Bench bench(1 << 20);
  bench.Source->SetFaults([](const BrickKey&) { return Fault::ShortData; });
  bench.Start();
  BrickKey block;
  block.PageLevel = 1;
  bench.Loader->Request({ { block, 1 } });
  const std::vector<LoadResult> results = TakeAll(*bench.Loader);
  ASSERT_EQ(results.size(), 1u);
  EXPECT_EQ(results[0].Outcome.Code(), StatusCode::Corrupt);
  EXPECT_NE(results[0].Outcome.Message().find("256 instead of 512"), std::string::npos);
}

TEST(BrickLoader, WishesThatCannotBeAreErrors)
{
  Bench bench(1 << 20);
  bench.Start();
  BrickKey level = KeyAt(0);
  level.Level = 40;
  BrickKey time = KeyAt(0);
  time.Time = 2;
  BrickKey page = KeyAt(4);
  page.PageLevel = 1;
  bench.Loader->Request(
    { { KeyAt(32), 1 }, { KeyAt(0, 16), 1 }, { level, 1 }, { time, 1 }, { page, 1 } });
  for (const LoadResult& result : TakeAll(*bench.Loader))
  {
    EXPECT_EQ(result.Outcome.Code(), StatusCode::InvalidArgument);
    EXPECT_NE(result.Outcome.Message().find("made of keys"), std::string::npos);
  }
  EXPECT_EQ(bench.Source->Reads(), 0);
  bench.Loader->Request({ { KeyAt(0, 0, 0, 5), 1 } });
  const std::vector<LoadResult> orphan = TakeAll(*bench.Loader);
  ASSERT_EQ(orphan.size(), 1u);
  EXPECT_EQ(orphan[0].Outcome.Code(), StatusCode::NotFound);
}

TEST(BrickLoader, ABudgetBelowOneBrickNamesTheLeastThatWorks)
{
  const std::uint64_t least = std::max(BrickBytes, BlockBytes);
  Bench bench(BrickBytes - 1);
  bench.Start();
  bench.Loader->Request({ { KeyAt(0), 1 } });
  const std::vector<LoadResult> results = TakeAll(*bench.Loader);
  ASSERT_EQ(results.size(), 1u);
  EXPECT_EQ(results[0].Outcome.Code(), StatusCode::ResourceExhausted);
  EXPECT_NE(
    results[0].Outcome.Message().find("at least " + std::to_string(least)), std::string::npos)
    << results[0].Outcome.Message();
  bench.Cache->SetBudget(least);
  BrickKey block;
  block.PageLevel = 1;
  bench.Loader->Request({ { KeyAt(0), 1 }, { block, 1 } });
  for (const LoadResult& result : TakeAll(*bench.Loader))
  {
    EXPECT_TRUE(result.Outcome) << result.Outcome.Message();
  }
  EXPECT_LE(bench.Cache->GetCounters().PeakBytes, 2 * least);
}

// Results are let go before the next ones are taken: the budget holds to the byte.
TEST(BrickLoader, AnyBudgetMakesProgressAndIsKept)
{
  for (const std::uint64_t bricks : { 1, 2, 3, 7 })
  {
    for (const int threads : { 1, 4 })
    {
      Bench bench(bricks * std::max(BrickBytes, BlockBytes), threads);
      bench.Start();
      bench.Loader->Request(Wishes(0, 32));
      std::set<std::uint32_t> seen;
      while (bench.Loader->Pending() != 0)
      {
        ASSERT_TRUE(bench.Loader->WaitFinished(Patience));
        for (const LoadResult& result : bench.Loader->TakeFinished())
        {
          EXPECT_TRUE(result.Outcome) << result.Outcome.Message();
          seen.insert(result.Key.X);
        }
      }
      EXPECT_EQ(seen.size(), 32u);
      const BrickCache::Counters counters = bench.Cache->GetCounters();
      // While a taken brick is looked at, one read may already run beside it.
      EXPECT_LE(counters.PeakBytes, bench.Cache->Budget() + (bricks == 1 ? BrickBytes : 0));
      EXPECT_EQ(counters.BytesPinned, 0u);
      EXPECT_GT(counters.Evictions, 0u);
    }
  }
}

TEST(BrickLoader, ResultsThatNobodyTakesHoldTheReadsBack)
{
  Bench bench(5 * BrickBytes, 4);
  bench.Start();
  bench.Loader->Request(Wishes(0, 32));
  // Nothing is taken: at most what fits beside the headroom is read, however long one waits.
  while (bench.Loader->BytesInFlight() != 0 || bench.Source->Reads() == 0)
  {
    std::this_thread::yield();
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(30));
  EXPECT_LE(bench.Source->Reads(), 4);
  EXPECT_LE(bench.Cache->GetCounters().PeakBytes, bench.Cache->Budget());
  EXPECT_EQ(TakeAll(*bench.Loader).size(), 32u); // all of them held here
}

TEST(BrickLoader, ProgressEvenWhenOthersHoldTheWholeBudget)
{
  Bench bench(3 * BlockBytes, 2);
  bench.Start();
  std::vector<BrickPointer> held;
  for (std::uint32_t x = 0; x < 12; ++x)
  {
    bench.Loader->Request({ { KeyAt(x), 1 } });
    for (LoadResult& result : TakeAll(*bench.Loader))
    {
      ASSERT_TRUE(result.Outcome) << result.Outcome.Message();
      held.push_back(result.Brick);
    }
  }
  EXPECT_EQ(held.size(), 12u);
}

TEST(BrickLoader, AReplacedSourceLeavesNoTrace)
{
  Bench bench(1 << 20, 2);
  bench.Source->CloseGate();
  bench.Start();
  const auto fresh = std::make_shared<KeySource>(std::uint16_t{ 7 });
  bench.Loader->Request(Wishes(0, 4));
  bench.Source->WaitForReads(2);
  bench.Loader->SetSource(0, fresh);
  EXPECT_EQ(bench.Loader->Pending(), 0u);
  EXPECT_TRUE(bench.Loader->WaitFinished(0)); // nothing to wait for
  bench.Loader->Request(Wishes(0, 4));
  bench.Source->OpenGate();
  const std::vector<LoadResult> results = TakeAll(*bench.Loader);
  ASSERT_EQ(results.size(), 4u);
  for (const LoadResult& result : results)
  {
    EXPECT_EQ(FirstVoxel(result), KeySource::ValueOf(result.Key, 7));
  }
  bench.Loader->SetSource(0, nullptr);
  EXPECT_EQ(bench.Cache->GetCounters().Items, 0u);
  bench.Loader.reset(); // the reads of the old source have ended now
  EXPECT_EQ(bench.Cache->GetCounters().BytesReserved, 0u);
}

TEST(BrickLoader, FinishedResultsOfARemovedSourceAreDropped)
{
  Bench bench(1 << 20, 1);
  bench.Start();
  bench.Loader->SetSource(1, std::make_shared<KeySource>());
  bench.Loader->Request({ { KeyAt(0, 0, 0, 0), 1 }, { KeyAt(0, 0, 0, 1), 1 } });
  while (bench.Cache->GetCounters().Items < 2)
  {
    std::this_thread::yield();
  }
  bench.Loader->SetSource(1, nullptr);
  const std::vector<LoadResult> results = TakeAll(*bench.Loader);
  ASSERT_EQ(results.size(), 1u);
  EXPECT_EQ(results[0].Key.Volume, 0u);
}

TEST(BrickLoader, TheDestructorWaitsForRunningReadsOnly)
{
  Bench bench(1 << 20, 2);
  bench.Source->SetDelay(std::chrono::milliseconds(20));
  bench.Start();
  bench.Loader->Request(Wishes(0, 32));
  bench.Source->WaitForReads(1);
  bench.Loader.reset();
  EXPECT_LT(bench.Source->Reads(), 32);
  EXPECT_EQ(bench.Cache->GetCounters().BytesReserved, 0u);
}

TEST(BrickLoader, ThreadsReadSideBySide)
{
  Bench bench(1 << 20, 4);
  bench.Source->CloseGate();
  bench.Start();
  bench.Loader->Request(Wishes(0, 8));
  bench.Source->WaitForReads(4);
  EXPECT_EQ(bench.Loader->BytesInFlight(), 4 * BrickBytes);
  bench.Source->OpenGate();
  TakeAll(*bench.Loader);
  EXPECT_EQ(bench.Source->MostAtOnce(), 4);
}

TEST(BrickLoader, ShuffledArrivalLosesNothing)
{
  std::vector<std::vector<std::uint32_t>> orders;
  for (const std::uint64_t seed : { 1u, 2u })
  {
    Bench bench(1 << 20, 1, seed);
    bench.Start();
    bench.Loader->Request(Wishes(0, 32));
    while (bench.Cache->GetCounters().Items < 32)
    {
      std::this_thread::yield();
    }
    std::vector<std::uint32_t> order;
    for (const LoadResult& result : TakeAll(*bench.Loader))
    {
      order.push_back(result.Key.X);
    }
    EXPECT_FALSE(std::is_sorted(order.begin(), order.end()));
    orders.push_back(order);
    std::sort(order.begin(), order.end());
    EXPECT_EQ(std::unique(order.begin(), order.end()) - order.begin(), 32);
  }
  EXPECT_NE(orders[0], orders[1]);
}

// Random frames, faults, removals and budgets; each wish that is still wanted ends exactly once.
TEST(BrickLoader, RandomFramesWithFaults)
{
  for (const std::uint64_t seed : { 3u, 4u })
  {
    Bench bench(8 * BlockBytes, 3, seed);
    bench.Source->SetFaults(
      [](const BrickKey& key)
      {
        constexpr std::array<Fault, 5> kinds{ Fault::Status, Fault::Throw, Fault::OutOfMemory,
          Fault::ShortData, Fault::None };
        return key.X % 7 == 3 ? kinds[key.Y % 5] : Fault::None;
      });
    bench.Start();
    std::mt19937_64 random(seed);
    std::uint64_t taken = 0;
    for (int frame = 0; frame < 400; ++frame)
    {
      std::vector<LoadRequest> wishes;
      for (std::uint64_t i = random() % 12; i > 0; --i)
      {
        BrickKey key = KeyAt(static_cast<std::uint32_t>(random() % 4),
          static_cast<std::uint32_t>(random() % 2), static_cast<std::uint32_t>(random() % 2));
        key.PageLevel = static_cast<std::uint8_t>(random() % 2);
        wishes.push_back({ key, static_cast<double>(random() % 5) });
      }
      bench.Loader->Request(wishes);
      if (random() % 40 == 0)
      {
        bench.Loader->SetSource(0, bench.Source);
      }
      bench.Cache->SetBudget((2 + random() % 8) * BlockBytes);
      std::set<BrickKey> keys;
      for (const LoadResult& result : bench.Loader->TakeFinished())
      {
        ++taken;
        EXPECT_TRUE(keys.insert(result.Key).second);
        EXPECT_NE(result.Outcome.Ok(), !result.Brick && !result.Ranges);
        if (result.Brick)
        {
          EXPECT_EQ(FirstVoxel(result), KeySource::ValueOf(result.Key, 0));
        }
      }
      if (random() % 3 == 0) // often enough that "taken" below hangs on no machine's speed
      {
        taken += TakeAll(*bench.Loader).size();
      }
    }
    TakeAll(*bench.Loader);
    EXPECT_GT(taken, 300u);
    const BrickCache::Counters counters = bench.Cache->GetCounters();
    EXPECT_LE(counters.BytesUsed + counters.BytesReserved, bench.Cache->Budget());
    EXPECT_EQ(bench.Loader->Pending(), 0u);
  }
}

} // namespace teravox
