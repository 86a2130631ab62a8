// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// `teravox bench load` and `bench convert` on small cubes: the shape of what they write, what is
// counted, and that nothing is left behind. No times.
#include "ProgramRunner.h"
#include "VTKTestSupport.h"

#include <filesystem>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

namespace
{

using teravox::test::FreshFileName;
using teravox::test::Outcome;
using teravox::test::RunOptions;
using teravox::test::RunProgram;

Outcome RunAndLeaveNothing(std::vector<std::string> arguments)
{
  RunOptions options;
  options.TemporaryFolder = FreshFileName("temporary");
  std::filesystem::create_directory(options.TemporaryFolder);
  const Outcome outcome = RunProgram(arguments, options);
  EXPECT_TRUE(std::filesystem::is_empty(options.TemporaryFolder));
  return outcome;
}

// By one thread: which chunks of a full cache go first depends on how far several are apart.
TEST(ProgramBenchLoad, ReadsEachChunkOnce)
{
  const Outcome outcome = RunAndLeaveNothing({ "bench", "load", "--edge", "320", "--repetitions",
    "1", "--types", "u8,u16", "--threads", "1", "--json" });
  ASSERT_EQ(outcome.ExitCode, 0) << outcome.Error;
  const auto json = nlohmann::json::parse(outcome.Output);
  ASSERT_EQ(json["rows"].size(), 8u);
  std::set<std::string> names;
  for (const auto& row : json["rows"])
  {
    SCOPED_TRACE(row.dump());
    names.insert(row["filter"].get<std::string>() + " " + row["type"].get<std::string>());
    const double decoded = row["decoded_bytes"];
    EXPECT_EQ(row["bricks"], 125);
    EXPECT_NEAR(
      row["delivered_bytes"].get<double>() / decoded, 68.0 * 68 * 68 / (64 * 64 * 64), 1e-9);
    EXPECT_NEAR(row["reads_per_chunk"].get<double>(), 1, 0.1);
    EXPECT_GT(row["ratio"], 0);
    EXPECT_GT(row["cpu_ratio"], 0);
    if (row["filter"] == "none")
    {
      EXPECT_EQ(row["stored_bytes"], row["decoded_bytes"]);
    }
    else
    {
      EXPECT_LT(row["stored_bytes"].get<double>(), 0.8 * decoded);
    }
  }
  EXPECT_EQ(names.size(), 8u);
}

TEST(ProgramBenchLoad, DecodesEveryFilterThatIsRead)
{
  const Outcome outcome =
    RunAndLeaveNothing({ "bench", "load", "--edge", "320", "--repetitions", "1", "--types", "u16",
      "--filters", "scale-offset,szip,lzf,blosc,bitshuffle+lz4,zstd", "--json" });
  ASSERT_EQ(outcome.ExitCode, 0) << outcome.Error;
  const auto json = nlohmann::json::parse(outcome.Output);
  ASSERT_EQ(json["rows"].size(), 6u);
  for (const auto& row : json["rows"])
  {
    SCOPED_TRACE(row.dump());
    EXPECT_EQ(row["bricks"], 125);
    EXPECT_GT(row["ratio"], 0);
    EXPECT_LE(row["stored_bytes"].get<double>(), row["decoded_bytes"].get<double>());
  }
  const Outcome floats = RunAndLeaveNothing(
    { "bench", "load", "--edge", "320", "--filters", "scale-offset", "--types", "f32" });
  EXPECT_EQ(floats.ExitCode, 1);
  EXPECT_NE(floats.Error.find("for integers"), std::string::npos) << floats.Error;
}

TEST(ProgramBenchLoad, PrintsATable)
{
  const Outcome outcome = RunAndLeaveNothing({ "bench", "load", "--edge", "320", "--repetitions",
    "1", "--filters", "lz4", "--types", "u16" });
  EXPECT_EQ(outcome.ExitCode, 0) << outcome.Error;
  EXPECT_NE(outcome.Output.find("lz4"), std::string::npos) << outcome.Output;
  const Outcome unknown = RunAndLeaveNothing({ "bench", "load", "--filters", "rot13" });
  EXPECT_EQ(unknown.ExitCode, 1);
  EXPECT_NE(unknown.Error.find("'rot13' is no filter"), std::string::npos) << unknown.Error;
  const Outcome odd = RunAndLeaveNothing({ "bench", "load", "--edge", "350" });
  EXPECT_EQ(odd.ExitCode, 1);
  EXPECT_NE(odd.Error.find("multiple of 64"), std::string::npos) << odd.Error;
}

TEST(ProgramBenchConvert, MeasuresEachFormat)
{
  const Outcome outcome = RunAndLeaveNothing({ "bench", "convert", "--edge", "40", "--formats",
    "mha,nii,vti", "--repetitions", "1", "--json" });
  ASSERT_EQ(outcome.ExitCode, 0) << outcome.Error;
  const auto json = nlohmann::json::parse(outcome.Output);
  ASSERT_EQ(json["rows"].size(), 18u);
  for (const auto& row : json["rows"])
  {
    SCOPED_TRACE(row.dump());
    const double voxel = row["type"] == "u8" ? 1 : row["type"] == "u16" ? 2 : 4;
    EXPECT_GE(row["input_bytes"].get<double>(), 40 * 40 * 40 * voxel);
    EXPECT_LT(row["input_bytes"].get<double>(), 40 * 40 * 40 * voxel + 1000);
    EXPECT_GT(row["ratio"], 0);
  }
}

} // namespace
