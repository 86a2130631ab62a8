// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Conversions that are killed at any moment: what lies under the final name is whole, or isn't
// there.
#include "FileContents.h"
#include "HDF5BrickSource.h"
#include "ProgramRunner.h"
#include "VTKTestSupport.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <gtest/gtest.h>
#include <random>
#include <string>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <vector>

using namespace teravox;
using namespace teravox::test;
using teravox::testing::ContentsOf;

namespace
{

int NumberOfKills()
{
  const char* wanted = std::getenv("TERAVOX_TEST_KILLS");
  return wanted != nullptr ? std::max(std::atoi(wanted), 1) : 8;
}

std::vector<std::string> Conversion(const std::string& out)
{
  return { "convert", "formula:marschner-lobb", out, "--dimensions", "160", "160", "160",
    "--compression", "deflate", "--level", "9", "--quiet" };
}

/// Starts the program, kills it after this time, and returns whether it was killed.
bool RunAndKill(const std::vector<std::string>& arguments, std::chrono::microseconds after)
{
  std::vector<char*> all{ const_cast<char*>(TERAVOX_PROGRAM) };
  for (const std::string& argument : arguments)
  {
    all.push_back(const_cast<char*>(argument.c_str()));
  }
  all.push_back(nullptr);
  const pid_t child = ::fork();
  if (child == 0)
  {
    ::execv(all[0], all.data());
    ::_exit(127);
  }
  std::this_thread::sleep_for(after);
  ::kill(child, SIGKILL);
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFSIGNALED(status);
}

} // namespace

TEST(ProgramConvert, KilledAtAnyMomentNothingLooksWhole)
{
  const std::string reference = FreshFileName("undisturbed.h5");
  const auto began = std::chrono::steady_clock::now();
  ASSERT_EQ(RunProgram(Conversion(reference)).ExitCode, 0);
  const auto took =
    std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - began);
  const std::string whole = ContentsOf(reference);
  const std::string out = FreshFileName("killed-often.h5");
  const std::filesystem::path folder = std::filesystem::path(out).parent_path();
  std::mt19937 random(12);
  int killed = 0;
  int unfinished = 0;
  for (int i = 0; i < NumberOfKills(); ++i)
  {
    // Each in a part of the time of its own, and a little beyond the end.
    const double at = 1.1 * (i % 8 + static_cast<double>(random()) / 4294967296.0) / 8;
    killed += RunAndKill(Conversion(out),
                std::chrono::microseconds(
                  static_cast<std::int64_t>(at * static_cast<double>(took.count()))))
      ? 1
      : 0;
    EXPECT_TRUE(!std::filesystem::exists(out) || ContentsOf(out) == whole) << "kill " << i;
    std::filesystem::remove(out);
    for (const auto& entry : std::filesystem::directory_iterator(folder))
    {
      const std::string name = entry.path().string();
      if (name.find("killed-often.h5") != std::string::npos)
      {
        ++unfinished;
        HDF5OpenOptions options;
        EXPECT_TRUE(!HDF5BrickSource::Open(name, options).Ok() || ContentsOf(name) == whole)
          << name;
      }
    }
  }
  EXPECT_GE(killed, NumberOfKills() / 2);
  EXPECT_GT(unfinished, 0) << "no kill has met a conversion";
  // The next one takes away what they left, and is as any other.
  ASSERT_EQ(RunProgram(Conversion(out)).ExitCode, 0);
  EXPECT_TRUE(ContentsOf(out) == whole);
  for (const auto& entry : std::filesystem::directory_iterator(folder))
  {
    const std::string name = entry.path().filename().string();
    EXPECT_TRUE(name.find("killed-often.h5") == std::string::npos || entry.path() == out) << name;
  }
  std::filesystem::remove(out);
  std::filesystem::remove(reference);
}
