// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "RequestQueue.h"

#include <algorithm>
#include <gtest/gtest.h>
#include <map>
#include <random>
#include <set>

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
} // namespace

TEST(RequestQueue, TheMostUrgentFirstTiesByKeyWithoutDuplicates)
{
  RequestQueue queue;
  queue.Replace({ { KeyAt(5), 1 }, { KeyAt(3), 2 }, { KeyAt(4), 1 }, { KeyAt(5), 3 },
    { KeyAt(9), std::numeric_limits<double>::quiet_NaN() }, { KeyAt(3), 2 } });
  ASSERT_EQ(queue.Queued(), 4u);
  for (const std::uint32_t x : { 5u, 3u, 4u, 9u })
  {
    EXPECT_EQ(queue.Pop()->Request.Key, KeyAt(x));
  }
  EXPECT_FALSE(queue.Pop());
  EXPECT_EQ(queue.InFlight(), 4u);
}

TEST(RequestQueue, WhatIsInFlightIsNotHandedOutTwice)
{
  RequestQueue queue;
  queue.Replace({ { KeyAt(1), 1 }, { KeyAt(2), 2 } });
  const RequestQueue::Flight flight = *queue.Pop();
  queue.Replace({ { KeyAt(2), 9 }, { KeyAt(3), 1 } });
  EXPECT_EQ(queue.Wishes().size(), 1u); // 1 was replaced, 2 is in flight
  EXPECT_EQ(queue.Wishes()[0].Key, KeyAt(3));
  queue.Finish(flight);
  queue.Replace({ { KeyAt(2), 9 } });
  EXPECT_EQ(queue.Pop()->Request.Key, KeyAt(2));
}

TEST(RequestQueue, AForgottenFlightDoesNotEndALaterOne)
{
  RequestQueue queue;
  queue.Replace({ { KeyAt(1, 7), 1 }, { KeyAt(2, 7), 0 }, { KeyAt(1, 8), 0 } });
  const RequestQueue::Flight old = *queue.Pop();
  queue.RemoveVolume(7);
  EXPECT_EQ(queue.Queued(), 1u);
  EXPECT_FALSE(queue.IsInFlight(old));
  queue.Replace({ { KeyAt(1, 7), 1 } });
  const RequestQueue::Flight fresh = *queue.Pop();
  queue.Finish(old);
  EXPECT_TRUE(queue.IsInFlight(fresh));
  queue.PutBack(old);
  EXPECT_EQ(queue.Queued(), 0u);
  queue.PutBack(fresh);
  EXPECT_EQ(queue.Queued(), 1u);
  EXPECT_EQ(queue.InFlight(), 0u);
}

TEST(RequestQueue, PutBackKeepsTheOrder)
{
  RequestQueue queue;
  queue.Replace({ { KeyAt(1), 1 }, { KeyAt(2), 2 }, { KeyAt(3), 3 }, { KeyAt(4), 3 } });
  const std::vector<LoadRequest> before = queue.Wishes();
  const RequestQueue::Flight first = *queue.Pop();
  const RequestQueue::Flight second = *queue.Pop();
  queue.PutBack(first);
  queue.PutBack(second);
  const std::vector<LoadRequest> after = queue.Wishes();
  ASSERT_EQ(before.size(), after.size());
  for (std::size_t i = 0; i < before.size(); ++i)
  {
    EXPECT_EQ(before[i].Key, after[i].Key);
  }
}

TEST(RequestQueue, ShuffleChangesTheOrderAndLosesNothing)
{
  RequestQueue queue;
  queue.Shuffle(11);
  std::vector<LoadRequest> wishes;
  for (std::uint32_t i = 0; i < 50; ++i)
  {
    wishes.push_back({ KeyAt(i), static_cast<double>(i) });
  }
  queue.Replace(wishes);
  std::set<std::uint32_t> seen;
  bool sorted = true;
  std::uint32_t last = 50;
  while (const auto flight = queue.Pop())
  {
    sorted = sorted && flight->Request.Key.X < last;
    last = flight->Request.Key.X;
    seen.insert(last);
  }
  EXPECT_EQ(seen.size(), 50u);
  EXPECT_FALSE(sorted);
}

// The queue against a plain map of wishes and a set of flights.
TEST(RequestQueue, TenThousandRandomSteps)
{
  std::mt19937_64 random(42);
  RequestQueue queue;
  std::map<BrickKey, double> wished;
  std::map<BrickKey, RequestQueue::Flight> flying;
  for (int step = 0; step < 10000; ++step)
  {
    const std::uint64_t action = random() % 10;
    if (action < 2)
    {
      std::vector<LoadRequest> wishes;
      wished.clear();
      for (std::uint64_t i = random() % 20; i > 0; --i)
      {
        const LoadRequest wish{ KeyAt(static_cast<std::uint32_t>(random() % 30),
                                  static_cast<std::uint32_t>(random() % 2)),
          static_cast<double>(random() % 4) };
        wishes.push_back(wish);
        if (flying.count(wish.Key) == 0)
        {
          const auto [place, fresh] = wished.emplace(wish.Key, wish.Priority);
          place->second = std::max(place->second, wish.Priority);
        }
      }
      queue.Replace(std::move(wishes));
    }
    else if (action < 6)
    {
      const auto flight = queue.Pop();
      ASSERT_EQ(flight.has_value(), !wished.empty());
      if (flight)
      {
        const BrickKey& key = flight->Request.Key;
        ASSERT_EQ(wished.count(key), 1u);
        for (const auto& [other, priority] : wished)
        {
          ASSERT_TRUE(priority < wished[key] || (priority == wished[key] && !(other < key)));
        }
        wished.erase(key);
        ASSERT_TRUE(flying.emplace(key, *flight).second);
      }
    }
    else if (action < 9 && !flying.empty())
    {
      const auto flight =
        std::next(flying.begin(), static_cast<std::ptrdiff_t>(random() % flying.size()));
      if (action == 8)
      {
        queue.PutBack(flight->second);
        wished.emplace(flight->first, flight->second.Request.Priority);
      }
      else
      {
        queue.Finish(flight->second);
      }
      flying.erase(flight);
    }
    else if (random() % 20 == 0)
    {
      queue.RemoveVolume(1);
      const auto isGone = [](const auto& item) { return item.first.Volume == 1; };
      for (auto i = wished.begin(); i != wished.end();)
      {
        i = isGone(*i) ? wished.erase(i) : std::next(i);
      }
      for (auto i = flying.begin(); i != flying.end();)
      {
        i = isGone(*i) ? flying.erase(i) : std::next(i);
      }
    }
    ASSERT_EQ(queue.Queued(), wished.size());
    ASSERT_EQ(queue.InFlight(), flying.size());
  }
}

} // namespace teravox
