// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// The threads of a conversion: each item once, exceptions come out, turns in order.
#include "WorkerTeam.h"

#include <atomic>
#include <gtest/gtest.h>
#include <stdexcept>
#include <vector>

using namespace teravox;

namespace
{

TEST(WorkerTeam, DoesEachItemOnce)
{
  for (const int threads : { 1, 2, 5 })
  {
    WorkerTeam team(threads);
    EXPECT_EQ(team.Size(), threads);
    // Often, and with fewer items than members: who wakes late must find nothing of the last round.
    for (std::int64_t round = 0; round < 2000; ++round)
    {
      const std::int64_t count = round % 7;
      std::vector<std::atomic<int>> done(static_cast<std::size_t>(count));
      std::atomic<bool> known{ true };
      team.Run(count,
        [&](std::int64_t item, int worker)
        {
          ++done[static_cast<std::size_t>(item)];
          known = known && worker >= 0 && worker < team.Size();
        });
      for (const std::atomic<int>& times : done)
      {
        ASSERT_EQ(times, 1);
      }
      ASSERT_TRUE(known);
    }
  }
}

TEST(WorkerTeam, TheCallerMayDoSomethingElseMeanwhile)
{
  WorkerTeam team(2);
  std::atomic<int> done{ 0 };
  const WorkerTeam::Work work = [&](std::int64_t, int) { ++done; };
  team.Start(10, work);
  // The other member needs nobody's help.
  while (done < 10)
  {
    std::this_thread::yield();
  }
  team.Finish();
  EXPECT_EQ(done, 10);
}

TEST(WorkerTeam, ThrowsTheFirstExceptionAndWorksOn)
{
  WorkerTeam team(3);
  for (int round = 0; round < 100; ++round)
  {
    std::atomic<int> running{ 0 };
    EXPECT_THROW(team.Run(50,
                   [&](std::int64_t item, int)
                   {
                     ++running;
                     const bool bad = item == 5;
                     --running;
                     if (bad)
                     {
                       throw std::runtime_error("five");
                     }
                   }),
      std::runtime_error);
    EXPECT_EQ(running, 0);
    std::atomic<int> done{ 0 };
    team.Run(20, [&](std::int64_t, int) { ++done; });
    EXPECT_EQ(done, 20);
  }
}

TEST(WorkerTeam, TurnsAreTakenInOrder)
{
  WorkerTeam team(4);
  std::vector<std::int64_t> order;
  Turns turns(0);
  team.Run(500, [&](std::int64_t item, int) { turns.Take(item, [&] { order.push_back(item); }); });
  ASSERT_EQ(order.size(), 500U);
  for (std::int64_t i = 0; i < 500; ++i)
  {
    EXPECT_EQ(order[static_cast<std::size_t>(i)], i);
  }
}

} // namespace
