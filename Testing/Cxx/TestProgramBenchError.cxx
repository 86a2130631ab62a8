// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// `teravox bench error` on one small picture: the shape of what it writes, and that errors are
// errors. No times.
#include "ProgramRunner.h"
#include "VTKTestSupport.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace
{

using teravox::test::FreshFileName;
using teravox::test::Outcome;
using teravox::test::RunProgram;

std::vector<std::string> LinesOf(const std::string& file)
{
  std::ifstream stream(file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);)
  {
    lines.push_back(line);
  }
  return lines;
}

class ProgramBenchError : public ::testing::Test
{
protected:
  void SetUp() override
  {
    const char* display = std::getenv("DISPLAY");
    if (!display || !*display)
    {
      GTEST_SKIP() << "There is no display.";
    }
  }
};

TEST(ProgramBenchErrorUsage, NamesItsScenes)
{
  const Outcome list = RunProgram({ "bench", "error", "--list" });
  EXPECT_EQ(list.ExitCode, 0) << list.Error;
  for (const char* name :
    { "brain-surface ", "head-bone-shaded ", "shells-256 ", "noise-512-far " })
  {
    EXPECT_NE(list.Output.find(name), std::string::npos) << name;
  }
}

TEST_F(ProgramBenchError, UnknownNamesAreOneSentence)
{
  const Outcome scene = RunProgram({ "bench", "error", "--scenes", "teapot" });
  EXPECT_EQ(scene.ExitCode, 1);
  EXPECT_NE(scene.Error.find("'teapot' is no scene"), std::string::npos) << scene.Error;
  const Outcome mapper = RunProgram({ "bench", "error", "--mappers", "pencil" });
  EXPECT_EQ(mapper.ExitCode, 1);
  EXPECT_NE(mapper.Error.find("'pencil' is no mapper"), std::string::npos) << mapper.Error;
}

TEST_F(ProgramBenchError, OneSmallScene)
{
  const std::string jsonFile = FreshFileName("bench-error.json");
  const std::string csvFile = FreshFileName("bench-error.csv");
  const std::string folder = FreshFileName("bench-error");
  const std::string cache = folder + "-cache";
  const std::vector<std::string> arguments{ "bench", "error", "--scenes", "shells-256", "--size",
    "64", "64", "--frames", "1", "--every", "2", "--tolerances", "16,1", "--distances", "2,1",
    "--fixed-point-distances", "1", "--mappers", "teravox,teravox-levels,vtk-gpu,vtk-fixed-point",
    "--cache", cache, "--json", jsonFile, "--csv", csvFile, "--plots", folder };
  const Outcome outcome = RunProgram(arguments);
  ASSERT_EQ(outcome.ExitCode, 0) << outcome.Error;
  EXPECT_NE(outcome.Output.find("geometric mean of 1 scenes, vtk-gpu:"), std::string::npos);

  const auto json = nlohmann::json::parse(std::ifstream(jsonFile));
  EXPECT_EQ(json["size"], (std::vector<int>{ 64, 64 }));
  ASSERT_EQ(json["scenes"].size(), 1u);
  const auto& scene = json["scenes"][0];
  EXPECT_EQ(scene["name"], "shells-256");
  ASSERT_EQ(scene["points"].size(), 7u);
  for (const auto& point : scene["points"])
  {
    const auto& error = point["error"];
    SCOPED_TRACE(point.dump());
    EXPECT_GT(point["median_seconds"], 0);
    EXPECT_GT(point["median_cpu_seconds"], 0);
    EXPECT_GT(error["max"], 0);
    EXPECT_LE(error["percentile_99_9"], error["max"]);
    EXPECT_LE(error["percentile_99"], error["percentile_99_9"]);
    EXPECT_LE(error["envelope_max"], error["max"]);
    EXPECT_LE(error["envelope_percentile_99_9"], error["percentile_99_9"]);
    const std::string mapper = point["mapper"];
    if (mapper.compare(0, 7, "teravox") == 0)
    {
      EXPECT_TRUE(point["converged"]);
      EXPECT_LT(error["percentile_99"], point["tolerance"]);
      EXPECT_GT(point["samples_per_pixel"], point["contributing_samples_per_pixel"]);
      const double fetches = 64.0 * 64.0 * double(point["contributing_samples_per_pixel"]);
      const double limit = fetches * double(scene["bare_fetch_seconds"]);
      EXPECT_GT(limit, 0);
      EXPECT_NEAR(point["limit_cpu_seconds"], limit, 1e-9 * limit);
    }
    else
    {
      // They step by voxels; less than that would mean that nothing was compared.
      EXPECT_GT(error["max"], 1.0 / 255);
      EXPECT_LT(error["percentile_99"], 0.5);
    }
  }
  ASSERT_EQ(scene["ratios"].size(), 3u);
  for (const auto& ratio : scene["ratios"])
  {
    EXPECT_TRUE(ratio["reached"]);
    EXPECT_GT(ratio["ratio"], 0);
  }
  EXPECT_EQ(scene["ratios_cpu_envelope"].size(), 3u);
  ASSERT_EQ(json["summary"].size(), 2u);
  EXPECT_EQ(json["summary"][0]["mapper"], "vtk-gpu");
  EXPECT_EQ(LinesOf(csvFile).size(), 8u);
  EXPECT_GT(std::filesystem::file_size(folder + "/shells-256.png"), 1000u);

  // Two truths were kept; a second run takes them and finds the same errors.
  const auto files = std::distance(
    std::filesystem::directory_iterator(cache), std::filesystem::directory_iterator());
  EXPECT_EQ(files, 2);
  const Outcome again = RunProgram(arguments);
  ASSERT_EQ(again.ExitCode, 0) << again.Error;
  const auto second = nlohmann::json::parse(std::ifstream(jsonFile));
  for (std::size_t i = 0; i < 7; ++i)
  {
    EXPECT_EQ(second["scenes"][0]["points"][i]["error"], scene["points"][i]["error"]) << i;
  }
}

} // namespace
