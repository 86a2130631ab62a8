// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ChunkCache.h"
#include "SpareBuffers.h"

#include <atomic>
#include <gtest/gtest.h>
#include <random>
#include <stdexcept>
#include <thread>

namespace teravox::testing
{

namespace
{
ChunkCache::Loader Make(std::size_t bytes, int& loads)
{
  return [bytes, &loads](const ChunkCache::Reserve& reserve) -> Result<ChunkPointer>
  {
    ++loads;
    const Status status = reserve(2 * bytes, bytes);
    if (!status.Ok())
    {
      return status;
    }
    const auto chunk = std::make_shared<Chunk>();
    chunk->Voxels.resize(bytes);
    return ChunkPointer(chunk);
  };
}
} // namespace

TEST(ChunkCache, KeepsWhatFitsAndDropsTheLeastRecentlyUsed)
{
  ChunkCache cache(5000); // three chunks of 1000 with their overhead, and room to decode a fourth
  int loads = 0;
  const auto get = [&](std::int64_t i) { return cache.Get({ 0, { i, 0, 0 } }, Make(1000, loads)); };
  EXPECT_TRUE(get(0).Ok());
  EXPECT_TRUE(get(1).Ok());
  EXPECT_TRUE(get(0).Ok());
  EXPECT_EQ(loads, 2);
  EXPECT_TRUE(get(2).Ok()); // 1256 + 1256 + 2256 fit
  EXPECT_TRUE(get(3).Ok()); // drops 1
  EXPECT_EQ(loads, 4);
  EXPECT_TRUE(get(0).Ok());
  EXPECT_EQ(loads, 4);
  EXPECT_TRUE(get(1).Ok());
  EXPECT_EQ(loads, 5);
  EXPECT_LE(cache.MemoryUsed(), 5000u);
  cache.SetBudget(1500);
  EXPECT_LE(cache.MemoryUsed(), 1500u);
  cache.SetBudget(0);
  EXPECT_EQ(cache.MemoryUsed(), 0u);
}

TEST(ChunkCache, CountsChunksThatAreReferenced)
{
  ChunkCache cache(10000);
  int loads = 0;
  Result<ChunkPointer> held = cache.Get({ 0, { 0, 0, 0 } }, Make(1000, loads));
  cache.SetBudget(0);
  EXPECT_GE(cache.MemoryUsed(), 1000u);
  held = ChunkPointer();
  EXPECT_EQ(cache.MemoryUsed(), 0u);
}

TEST(ChunkCache, DoesNotRememberFailures)
{
  ChunkCache cache(10000);
  int loads = 0;
  const ChunkKey key{ 1, { 1, 2, 3 } };
  const auto failing = [&](const ChunkCache::Reserve&) -> Result<ChunkPointer>
  {
    ++loads;
    return Status(StatusCode::Corrupt, "broken");
  };
  EXPECT_EQ(cache.Get(key, failing).GetStatus().Message(), "broken");
  EXPECT_EQ(cache.Get(key, failing).GetStatus().Message(), "broken");
  EXPECT_EQ(loads, 2);
  const auto throwing = [&](const ChunkCache::Reserve& reserve) -> Result<ChunkPointer>
  {
    static_cast<void>(reserve(100, 50));
    throw std::runtime_error("thrown");
  };
  EXPECT_NE(cache.Get(key, throwing).GetStatus().Message().find("thrown"), std::string::npos);
  EXPECT_EQ(cache.MemoryUsed(), 0u);
  EXPECT_TRUE(cache.Get(key, Make(100, loads)).Ok());
  EXPECT_EQ(
    cache.Get({ 0, {} }, Make(6000, loads)).GetStatus().Code(), StatusCode::ResourceExhausted);
}

TEST(ChunkCache, ReadsAChunkOnceForManyThreads)
{
  ChunkCache cache(1 << 20);
  std::atomic<int> loads{ 0 };
  std::atomic<bool> go{ false };
  std::vector<std::thread> threads;
  for (int t = 0; t < 8; ++t)
  {
    threads.emplace_back(
      [&]
      {
        while (!go)
        {
          std::this_thread::yield();
        }
        const auto chunk = cache.Get({ 0, { 5, 5, 5 } },
          [&](const ChunkCache::Reserve& reserve) -> Result<ChunkPointer>
          {
            ++loads;
            static_cast<void>(reserve(100, 100));
            std::this_thread::yield();
            const auto made = std::make_shared<Chunk>();
            made->Voxels.resize(100);
            return ChunkPointer(made);
          });
        EXPECT_TRUE(chunk.Ok());
      });
  }
  go = true;
  for (std::thread& thread : threads)
  {
    thread.join();
  }
  EXPECT_EQ(loads, 1);
}

TEST(ChunkCache, TriesWithoutWaiting)
{
  ChunkCache cache(1 << 20);
  int loads = 0;
  const ChunkKey key{ 0, { 1, 1, 1 } };
  const auto outer = cache.TryGet(key,
    [&](const ChunkCache::Reserve& reserve) -> Result<ChunkPointer>
    {
      // Another thread would see the same: the chunk is on its way, other chunks aren't.
      EXPECT_FALSE(cache.TryGet(key, Make(100, loads)).has_value());
      EXPECT_EQ(loads, 0);
      const Status status = reserve(100, 100);
      EXPECT_TRUE(status.Ok());
      const auto made = std::make_shared<Chunk>();
      made->Voxels.resize(100);
      return ChunkPointer(made);
    });
  ASSERT_TRUE(outer.has_value());
  EXPECT_TRUE(outer->Ok());
  const auto again = cache.TryGet(key, Make(100, loads));
  ASSERT_TRUE(again.has_value());
  EXPECT_EQ(again->Value(), outer->Value());
  EXPECT_EQ(loads, 0);
}

TEST(ChunkCache, HandsOnTheMemoryOfWhatItDrops)
{
  ChunkCache cache(2 * (1000 + 256) + 500);
  std::vector<const std::byte*> places;
  std::vector<std::size_t> rooms;
  const auto load = [&](std::size_t bytes)
  {
    return [&, bytes](const ChunkCache::Reserve& reserve) -> Result<ChunkPointer>
    {
      const Status status = reserve(bytes, bytes);
      EXPECT_TRUE(status.Ok());
      const auto made = std::make_shared<Chunk>();
      made->Voxels = reserve.TakeRoom();
      rooms.push_back(made->Voxels.size());
      made->Voxels.resize(bytes);
      places.push_back(made->Voxels.data());
      return ChunkPointer(made);
    };
  };
  EXPECT_TRUE(cache.Get({ 0, { 0, 0, 0 } }, load(1000)).Ok());
  Result<ChunkPointer> held = cache.Get({ 0, { 1, 0, 0 } }, load(1000));
  ASSERT_TRUE(held.Ok());
  EXPECT_TRUE(cache.Get({ 0, { 2, 0, 0 } }, load(1000)).Ok()); // drops 0, which nobody holds
  EXPECT_EQ(rooms, (std::vector<std::size_t>{ 0, 0, 1000 }));
  EXPECT_EQ(places[2], places[0]);
  EXPECT_EQ(held.Value()->Voxels.size(), 1000u); // still whole
  held = ChunkPointer();
  EXPECT_TRUE(cache.Get({ 0, { 3, 0, 0 } }, load(900)).Ok()); // drops 1, of another size
  EXPECT_EQ(rooms.back(), 0u);
  EXPECT_LE(cache.MemoryUsed(), cache.Budget());
}

TEST(SpareBuffers, KeepTheNewestWithinTheirLimit)
{
  SpareBuffers spare;
  spare.Give(SpareBuffers::Buffer(100));
  EXPECT_EQ(spare.MemoryUsed(), 0u); // no limit was set
  spare.SetLimit(250);
  for (const std::size_t bytes : { 100, 101, 102 })
  {
    spare.Give(SpareBuffers::Buffer(bytes));
  }
  EXPECT_EQ(spare.MemoryUsed(), 203u);
  EXPECT_TRUE(spare.Take(100).empty());
  EXPECT_EQ(spare.Take(102).size(), 102u);
  EXPECT_TRUE(spare.Take(102).empty());
  spare.Give(SpareBuffers::Buffer(1000));
  EXPECT_EQ(spare.MemoryUsed(), 101u);
  spare.SetLimit(0);
  EXPECT_EQ(spare.MemoryUsed(), 0u);
}

TEST(ChunkCache, HoldsItsBudgetUnderRandomLoad)
{
  constexpr std::uint64_t budget = 20000;
  ChunkCache cache(budget);
  std::atomic<bool> exceeded{ false };
  std::vector<std::thread> threads;
  for (unsigned t = 0; t < 4; ++t)
  {
    threads.emplace_back(
      [&, t]
      {
        std::mt19937 random(t);
        int loads = 0;
        for (int i = 0; i < 3000; ++i)
        {
          const auto key = static_cast<std::int64_t>(random() % 30);
          const auto chunk =
            cache.Get({ 0, { key, 0, 0 } }, Make(500 + static_cast<std::size_t>(key) * 100, loads));
          EXPECT_TRUE(chunk.Ok());
          exceeded = exceeded || cache.MemoryUsed() > budget;
        }
      });
  }
  for (std::thread& thread : threads)
  {
    thread.join();
  }
  EXPECT_FALSE(exceeded);
}

} // namespace teravox::testing
