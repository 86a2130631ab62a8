// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "FileContents.h"
#include "ProgramRunner.h"
#include "VTKTestSupport.h"

#include <chrono>
#include <csignal>
#include <filesystem>
#include <gtest/gtest.h>
#include <random>
#include <string>
#include <vector>

namespace
{

using teravox::test::FreshFileName;
using teravox::test::Outcome;
using teravox::test::RunOptions;
using teravox::test::RunProgram;
using teravox::testing::ContentsOf;

std::vector<std::string> Command(const std::string& out)
{
  return { "convert", "formula:marschner-lobb", out, "--dimensions", "200", "180", "170", "--type",
    "u16", "--brick", "32", "--memory", "48M", "--compression", "deflate", "--level", "9",
    "--resume" };
}

std::size_t FilesLike(const std::string& file)
{
  const std::filesystem::path path(file);
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(path.parent_path()))
  {
    count += entry.path().filename().string().rfind(path.filename().string(), 0) == 0 ? 1 : 0;
  }
  return count;
}

TEST(ProgramResume, KilledAtRandomMomentsTheFileIsTheSame)
{
  const std::string whole = FreshFileName("whole.h5");
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_EQ(RunProgram(Command(whole)).ExitCode, 0);
  const int length = static_cast<int>(
    std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - begin)
      .count());
  const std::string truth = ContentsOf(whole);
  const std::string out = FreshFileName("killed.h5");
  std::mt19937 random(9);
  int kills = 0;

  // Who is faster than the signal is complete, and begins again.
  for (int attempt = 0; kills < 6 && attempt < 200; ++attempt)
  {
    RunOptions options;
    options.InterruptWhenExists = out + ".";
    options.Signals = { SIGKILL };
    options.DelayMilliseconds = static_cast<int>(random() % static_cast<unsigned>(length));
    const Outcome outcome = RunProgram(Command(out), options);
    if (outcome.ExitCode == -SIGKILL)
    {
      ++kills;
      // Killed after the file got its name, it is whole; before, nothing is there.
      EXPECT_TRUE(!std::filesystem::exists(out) || ContentsOf(out) == truth);
    }
    else
    {
      ASSERT_EQ(outcome.ExitCode, 0) << outcome.Error;
      EXPECT_TRUE(ContentsOf(out) == truth);
    }
    std::filesystem::remove(out);
  }
  ASSERT_EQ(kills, 6);
  const Outcome last = RunProgram(Command(out));
  ASSERT_EQ(last.ExitCode, 0) << last.Error;
  EXPECT_TRUE(ContentsOf(out) == truth);
  EXPECT_EQ(FilesLike(out), 1u);
  EXPECT_EQ(RunProgram({ "verify", out }).ExitCode, 0);
}

TEST(ProgramResume, AnInterruptLeavesWhatThereIsAndAnotherCommandIsRefused)
{
  const std::string out = FreshFileName("interrupted.h5");
  RunOptions options;
  options.InterruptWhenExists = out + ".";
  options.Signals = { SIGINT };
  options.DelayMilliseconds = 30;
  Outcome outcome;
  for (int attempt = 0; attempt < 50; ++attempt)
  {
    outcome = RunProgram(Command(out), options);
    if (outcome.ExitCode != 0)
    {
      break;
    }
    std::filesystem::remove(out); // it was faster
  }
  ASSERT_EQ(outcome.ExitCode, 1);
  EXPECT_NE(outcome.Error.find("--resume goes on"), std::string::npos) << outcome.Error;
  EXPECT_FALSE(std::filesystem::exists(out));
  if (FilesLike(out) == 2) // else it had no chunk yet
  {
    std::vector<std::string> other = Command(out);
    other[5] = "180"; // y
    other[4] = "199"; // x
    const Outcome refused = RunProgram(other);
    EXPECT_EQ(refused.ExitCode, 1);
    EXPECT_NE(refused.Error.find("without --resume"), std::string::npos) << refused.Error;
    EXPECT_EQ(FilesLike(out), 2u);
  }
  EXPECT_EQ(RunProgram(Command(out)).ExitCode, 0);
  EXPECT_EQ(FilesLike(out), 1u);
}

} // namespace
