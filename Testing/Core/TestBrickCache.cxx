// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BrickCache.h"
#include "ProcessMemory.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <iostream>
#include <list>
#include <map>
#include <random>
#include <thread>

namespace teravox
{

namespace
{
BrickKey KeyAt(std::uint32_t x, std::uint32_t volume = 0)
{
  BrickKey key;
  key.X = x;
  key.Volume = volume;
  return key;
}

CacheItem ItemOf(std::size_t voxels)
{
  auto brick = std::make_shared<Brick>();
  brick->Voxels.resize(voxels);
  return { std::move(brick), nullptr };
}

constexpr std::uint64_t BytesOf(std::size_t voxels)
{
  return CacheItem::Charge(voxels + sizeof(Brick));
}

bool Put(BrickCache& cache, const BrickKey& key, std::size_t voxels)
{
  if (!cache.Reserve(BytesOf(voxels)))
  {
    return false;
  }
  cache.Commit(key, ItemOf(voxels), BytesOf(voxels));
  return true;
}
} // namespace

TEST(BrickCache, TheLeastRecentlyUsedGoesFirst)
{
  BrickCache cache(3 * BytesOf(1000));
  EXPECT_TRUE(Put(cache, KeyAt(1), 1000));
  EXPECT_TRUE(Put(cache, KeyAt(2), 1000));
  EXPECT_TRUE(Put(cache, KeyAt(3), 1000));
  EXPECT_TRUE(cache.Find(KeyAt(1)));
  EXPECT_TRUE(Put(cache, KeyAt(4), 1000));
  EXPECT_EQ(cache.Keys(), (std::vector<BrickKey>{ KeyAt(3), KeyAt(1), KeyAt(4) }));
  EXPECT_FALSE(cache.Find(KeyAt(2)));
  const BrickCache::Counters counters = cache.GetCounters();
  EXPECT_EQ(counters.Hits, 1u);
  EXPECT_EQ(counters.Misses, 1u);
  EXPECT_EQ(counters.Evictions, 1u);
  EXPECT_EQ(counters.BytesUsed, 3 * BytesOf(1000));
  EXPECT_EQ(counters.PeakBytes, cache.Budget());
}

TEST(BrickCache, WhatIsHeldStaysAndCounts)
{
  BrickCache cache(2 * BytesOf(1000));
  Put(cache, KeyAt(1), 1000);
  Put(cache, KeyAt(2), 1000);
  BrickPointer held = cache.Find(KeyAt(1))->Brick;
  EXPECT_TRUE(Put(cache, KeyAt(3), 1000)); // evicts 2, although 1 was the candidate by age
  EXPECT_TRUE(cache.Contains(KeyAt(1)));
  EXPECT_FALSE(cache.Contains(KeyAt(2)));
  BrickPointer held3 = cache.Find(KeyAt(3))->Brick;
  EXPECT_FALSE(Put(cache, KeyAt(4), 1));
  EXPECT_EQ(cache.GetCounters().BytesPinned, 2 * BytesOf(1000));
  held3.reset();
  EXPECT_TRUE(Put(cache, KeyAt(4), 1));
  // Erased but held: counts until it is let go.
  cache.Erase(KeyAt(1));
  EXPECT_FALSE(cache.Contains(KeyAt(1)));
  EXPECT_EQ(cache.GetCounters().BytesUsed, BytesOf(1000) + BytesOf(1));
  EXPECT_FALSE(cache.Reserve(2 * BytesOf(1000)));
  EXPECT_TRUE(cache.Contains(KeyAt(4))); // a failed reservation evicts nothing
  held.reset();
  EXPECT_EQ(cache.GetCounters().BytesUsed, BytesOf(1));
  EXPECT_TRUE(cache.Reserve(2 * BytesOf(1000)));
}

TEST(BrickCache, ReservationsCountAndCanBeGivenBack)
{
  BrickCache cache(1000);
  EXPECT_FALSE(cache.Reserve(1001));
  EXPECT_FALSE(cache.Reserve(std::numeric_limits<std::uint64_t>::max()));
  EXPECT_FALSE(cache.Reserve(600, 401));
  EXPECT_FALSE(cache.Reserve(600, std::numeric_limits<std::uint64_t>::max()));
  EXPECT_TRUE(cache.Reserve(600, 400));
  EXPECT_FALSE(cache.Reserve(401));
  EXPECT_TRUE(cache.Reserve(400));
  cache.Release(600);
  EXPECT_TRUE(cache.Reserve(600));
  cache.ForceReserve(500);
  EXPECT_EQ(cache.GetCounters().BytesReserved, 1500u);
}

TEST(BrickCache, BudgetChangesTakeEffectAtOnce)
{
  BrickCache cache(10 * BytesOf(100));
  for (std::uint32_t i = 0; i < 10; ++i)
  {
    Put(cache, KeyAt(i), 100);
  }
  const BrickPointer held = cache.Find(KeyAt(0))->Brick;
  cache.SetBudget(2 * BytesOf(100));
  EXPECT_EQ(cache.Keys(), (std::vector<BrickKey>{ KeyAt(9), KeyAt(0) }));
  cache.SetBudget(0);
  EXPECT_EQ(cache.Keys(), (std::vector<BrickKey>{ KeyAt(0) }));
  EXPECT_FALSE(cache.Reserve(1));
  cache.SetBudget(4 * BytesOf(100));
  EXPECT_TRUE(Put(cache, KeyAt(11), 100));
}

TEST(BrickCache, PageBlocksAreItemsLikeBricks)
{
  const auto ranges = std::make_shared<const std::vector<ValueRange>>(512);
  const std::uint64_t bytes = CacheItem::Charge(512 * sizeof(ValueRange));
  BrickCache cache(bytes);
  BrickKey key = KeyAt(1);
  key.PageLevel = 1;
  ASSERT_TRUE(cache.Reserve(bytes));
  cache.Commit(key, { nullptr, ranges }, bytes);
  EXPECT_EQ(cache.Find(key)->Ranges, ranges);
  EXPECT_FALSE(cache.Contains(KeyAt(1)));
  EXPECT_EQ(cache.GetCounters().BytesPinned, bytes);
}

TEST(BrickCache, AVolumeGoesAsAWhole)
{
  BrickCache cache(1 << 20);
  for (std::uint32_t i = 0; i < 10; ++i)
  {
    Put(cache, KeyAt(i, i % 2), 100);
  }
  cache.EraseVolume(1);
  EXPECT_EQ(cache.GetCounters().Items, 5u);
  EXPECT_EQ(cache.GetCounters().Evictions, 0u);
  for (const BrickKey& key : cache.Keys())
  {
    EXPECT_EQ(key.Volume, 0u);
  }
}

namespace
{
/// The cache beside a plain model of it, compared after each step.
class CacheModel
{
public:
  explicit CacheModel(std::uint64_t budget)
    : Cache(budget)
  {
  }

  void Step(std::mt19937_64& random)
  {
    const BrickKey key = KeyAt(static_cast<std::uint32_t>(random() % 40), random() % 2);
    switch (random() % 8)
    {
      case 0:
      case 1:
      case 2:
        this->Insert(key, random() % 3000);
        break;
      case 3:
      case 4:
        this->Look(key, random() % 3 == 0);
        break;
      case 5:
        if (!this->Held.empty())
        {
          this->Held.erase(std::next(
            this->Held.begin(), static_cast<std::ptrdiff_t>(random() % this->Held.size())));
        }
        break;
      case 6:
        this->Cache.Erase(key);
        break;
      default:
        if (random() % 10 == 0)
        {
          this->Cache.SetBudget(5000 + random() % 40000);
        }
        break;
    }
    this->Check();
  }

private:
  void Insert(const BrickKey& key, std::size_t voxels)
  {
    const std::uint64_t bytes = BytesOf(voxels);
    const std::uint64_t pinned = this->Cache.GetCounters().BytesPinned;
    const bool fits = bytes <= this->Cache.Budget() && pinned <= this->Cache.Budget() - bytes;
    ASSERT_EQ(this->Cache.Reserve(bytes), fits);
    if (fits)
    {
      this->Cache.Commit(key, ItemOf(voxels), bytes);
      ASSERT_EQ(this->Cache.Keys().back(), key);
    }
  }

  void Look(const BrickKey& key, bool hold)
  {
    const bool there = this->Cache.Contains(key);
    const auto item = this->Cache.Find(key);
    ASSERT_EQ(item.has_value(), there);
    if (item && hold)
    {
      this->Held.push_back(item->Brick);
    }
  }

  void Check()
  {
    const BrickCache::Counters counters = this->Cache.GetCounters();
    std::map<const Brick*, std::uint64_t> held;
    for (const BrickPointer& brick : this->Held)
    {
      held[brick.get()] = CacheItem::Charge(brick->SizeInBytes());
    }
    std::uint64_t pinned = 0;
    for (const auto& [brick, bytes] : held)
    {
      pinned += bytes;
    }
    ASSERT_EQ(counters.BytesPinned, pinned);
    ASSERT_EQ(counters.BytesReserved, 0u);
    ASSERT_LE(counters.BytesPinned, counters.BytesUsed);
    ASSERT_LE(counters.BytesUsed, std::max(this->Cache.Budget(), pinned));
    std::vector<BrickKey> keys = this->Cache.Keys();
    ASSERT_EQ(keys.size(), counters.Items);
    std::sort(keys.begin(), keys.end());
    ASSERT_EQ(std::adjacent_find(keys.begin(), keys.end()), keys.end());
  }

  BrickCache Cache;
  std::list<BrickPointer> Held;
};
} // namespace

TEST(BrickCache, TenThousandRandomSteps)
{
  std::mt19937_64 random(1234);
  CacheModel model(30000);
  for (int step = 0; step < 10000 && !testing::Test::HasFatalFailure(); ++step)
  {
    model.Step(random);
  }
}

// Contract 5: what the cache counts is what the allocator has given out, after each step.
TEST(BrickCache, ChargesAreWhatIsAllocated)
{
  const std::uint64_t before = test::AllocatedBytes();
  if (before == 0)
  {
    GTEST_SKIP() << "the allocator doesn't tell what it has given out";
  }
  std::mt19937_64 random(77);
  BrickCache cache(32 << 20);
  std::list<BrickPointer> held;
  double worst = 0;
  for (int step = 0; step < 500; ++step)
  {
    const BrickKey key = KeyAt(static_cast<std::uint32_t>(random() % 300));
    Put(cache, key, 20000 + random() % 300000);
    if (const auto item = cache.Find(KeyAt(static_cast<std::uint32_t>(random() % 300))))
    {
      held.push_back(item->Brick);
    }
    if (held.size() > 20)
    {
      held.pop_front();
    }
    if (step % 50 == 49)
    {
      cache.SetBudget((8 + random() % 24) << 20);
    }
    const auto counted = static_cast<double>(cache.GetCounters().BytesUsed);
    const auto allocated =
      static_cast<double>(test::AllocatedBytes()) - static_cast<double>(before);
    ASSERT_LE(std::abs(allocated - counted), 0.02 * counted + 65536) << "step " << step;
    worst = std::max(worst, std::abs(allocated - counted));
  }
  std::cout << "counted and allocated bytes differ by " << worst << " at most\n";
}

TEST(BrickCache, ManyThreadsStayWithinTheBudget)
{
  BrickCache cache(20 * BytesOf(500));
  std::vector<std::thread> threads;
  for (unsigned t = 0; t < 4; ++t)
  {
    threads.emplace_back(
      [&cache, t]
      {
        std::mt19937_64 random(t);
        for (int i = 0; i < 2000; ++i)
        {
          const BrickKey key = KeyAt(static_cast<std::uint32_t>(random() % 50));
          const auto item = cache.Find(key);
          if (!item)
          {
            Put(cache, key, 500);
          }
          else
          {
            EXPECT_EQ(item->Brick->Voxels.size(), 500u);
          }
        }
      });
  }
  for (std::thread& thread : threads)
  {
    thread.join();
  }
  const BrickCache::Counters counters = cache.GetCounters();
  EXPECT_LE(counters.PeakBytes, cache.Budget());
  EXPECT_EQ(counters.BytesReserved, 0u);
  EXPECT_EQ(counters.BytesPinned, 0u);
  EXPECT_EQ(counters.BytesUsed, counters.Items * BytesOf(500));
  EXPECT_EQ(counters.Hits + counters.Misses, 8000u);
}

} // namespace teravox
