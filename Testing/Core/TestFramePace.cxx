// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "FramePace.h"

#include <functional>
#include <gtest/gtest.h>
#include <vector>

using namespace teravox;

namespace
{

// The looseness of so many frames, and whether each is within the budget, of which `secondsOf`
// tells what a frame takes.
struct Frames
{
  std::vector<double> Looseness;
  int Slow = 0;
};
Frames FramesOf(FramePace& pace, int frames, double budget,
  const std::function<double(double looseness, bool guesses)>& secondsOf)
{
  Frames run;
  for (int i = 0; i < frames; ++i)
  {
    pace.Begin();
    run.Looseness.push_back(pace.Looseness());
    const double seconds = secondsOf(pace.Looseness(), pace.MayGuess());
    pace.Spend(seconds / 2, budget);
    pace.Spend(seconds / 2, budget);
    run.Slow += seconds > budget ? 1 : 0;
  }
  return run;
}

} // namespace

TEST(FramePace, LoosensAndTightens)
{
  FramePace pace;
  const Frames slow = FramesOf(pace, 9, 1, [](double, bool) { return 2.0; });
  EXPECT_EQ(slow.Looseness, (std::vector<double>{ 1, 4, 16, 64, 256, 1024, 4096, 4096, 4096 }));
  EXPECT_TRUE(pace.MayGuess());
  const Frames fast = FramesOf(pace, 20, 1, [](double, bool) { return 0.01; });
  EXPECT_EQ(fast.Looseness.front(), 4096);
  EXPECT_EQ(fast.Looseness[1], 2048);
  EXPECT_EQ(fast.Looseness.back(), 1);
  FramesOf(pace, 3, 1, [](double, bool) { return 2.0; });
  EXPECT_GT(pace.Looseness(), 1);
  pace.Tighten();
  EXPECT_EQ(pace.Looseness(), 1);
}

// What fits stays as it is, and so does all without a budget.
TEST(FramePace, StaysWhereFramesFit)
{
  FramePace pace;
  FramesOf(pace, 3, 1, [](double, bool) { return 2.0; });
  const Frames fits = FramesOf(pace, 5, 1, [](double, bool) { return 0.7; });
  EXPECT_EQ(fits.Looseness, (std::vector<double>{ 64, 64, 64, 64, 64 }));
  const Frames unlimited = FramesOf(pace, 5, 0, [](double, bool) { return 9.0; });
  EXPECT_EQ(unlimited.Looseness.back(), 64);
}

// Frames that steps don't make fast are slow until pixels are guessed, and never again.
TEST(FramePace, GuessesStayWhileTheyAreNeeded)
{
  FramePace pace;
  const auto costs = [](double, bool guesses) { return guesses ? 0.03 : 0.4; };
  const Frames run = FramesOf(pace, 100, 0.1, costs);
  EXPECT_EQ(run.Slow, 3);
  EXPECT_TRUE(pace.MayGuess());
  // Of something that is ten times as fast they aren't.
  const Frames light = FramesOf(
    pace, 100, 0.1, [&](double looseness, bool guesses) { return costs(looseness, guesses) / 10; });
  EXPECT_EQ(light.Slow, 0);
  EXPECT_EQ(pace.Looseness(), 1);
}
