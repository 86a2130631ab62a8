// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// The pictures of README.md and of the demo, drawn by the program as the demo draws them, at half
// the size, and compared with the baselines that README.md shows.
#include "ImageMetrics.h"
#include "ProgramRunner.h"
#include "VTKTestSupport.h"

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGReader.h>

namespace
{

using teravox::test::FreshFileName;
using teravox::test::Outcome;
using teravox::test::RunOptions;
using teravox::test::RunProgram;

constexpr const char* BrainFile = "/usr/share/mricron/templates/ch2better.nii.gz";

/// RGBA in 0...1 with alpha 1; empty if the file can't be read.
std::vector<float> ReadPicture(const std::string& fileName)
{
  if (!std::filesystem::exists(fileName))
  {
    return {};
  }
  vtkNew<vtkPNGReader> reader;
  reader->SetFileName(fileName.c_str());
  reader->Update();
  vtkImageData* image = reader->GetOutput();
  const auto* bytes = static_cast<const unsigned char*>(image->GetScalarPointer());
  const int components = image->GetNumberOfScalarComponents();
  std::vector<float> picture;
  for (vtkIdType i = 0; i < image->GetNumberOfPoints(); ++i)
  {
    for (int c = 0; c < 3; ++c)
    {
      picture.push_back(static_cast<float>(bytes[i * components + c]) / 255.0F);
    }
    picture.push_back(1.0F);
  }
  return picture;
}

/// Draws with these arguments and compares with a baseline. Drivers differ in the last bit of a
/// value; where that moves a value across a rounding of the 8-bit picture, or an edge of the volume
/// across a pixel, single pixels differ: hence the mean and the 99th percentile, not the maximum.
nlohmann::json ExpectBaseline(std::vector<std::string> arguments, const std::string& name)
{
  const std::string picture = FreshFileName(name + ".png");
  const std::string stats = FreshFileName(name + ".json");
  arguments.insert(arguments.begin(), "render");
  arguments.insert(arguments.begin() + 2, picture);
  for (const char* more : { "--size", "400", "300", "--stats" })
  {
    arguments.emplace_back(more);
  }
  arguments.push_back(stats);
  const Outcome outcome = RunProgram(arguments);
  EXPECT_EQ(outcome.ExitCode, 0) << outcome.Error;
  if (outcome.ExitCode != 0)
  {
    return {};
  }
  const std::string baselineName = std::string(TERAVOX_BASELINES) + "/" + name + ".png";
  const std::vector<float> drawn = ReadPicture(picture);
  const std::vector<float> baseline = ReadPicture(baselineName);
  EXPECT_EQ(drawn.size(), 400u * 300 * 4);
  EXPECT_EQ(baseline.size(), drawn.size()) << "There is no usable baseline " << baselineName;
  if (baseline.size() == drawn.size())
  {
    const teravox::ImageDifference difference = teravox::CompareImages(drawn, baseline);
    EXPECT_LE(difference.Mean, 0.5 / 255) << picture;
    EXPECT_LE(difference.Percentile99, 3.0 / 255) << picture;
  }
  auto json = nlohmann::json::parse(std::ifstream(stats));
  EXPECT_TRUE(json["converged"]);
  EXPECT_EQ(json["failed_bricks"], 0);
  EXPECT_LE(json["gpu_memory_peak"], json["gpu_memory_budget"]);
  EXPECT_LE(json["host_memory_used"], json["host_memory_budget"]);
  EXPECT_GT(json["bricks_loaded"], 0);
  return json;
}

class ProgramPictures : public ::testing::Test
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

  /// The pyramid of the brain, made once. Empty if Debian's mricron-data isn't there.
  static std::string Brain()
  {
    static const std::string file = []
    {
      if (!std::filesystem::exists(BrainFile))
      {
        return std::string();
      }
      std::string name = FreshFileName("brain.h5");
      const Outcome outcome = RunProgram({ "convert", BrainFile, name, "--quiet" });
      EXPECT_EQ(outcome.ExitCode, 0) << outcome.Error;
      return name;
    }();
    return file;
  }
};

TEST_F(ProgramPictures, Brain)
{
  if (Brain().empty())
  {
    GTEST_SKIP() << "mricron-data isn't installed.";
  }
  const auto stats = ExpectBaseline({ Brain() }, "DemoBrain");
  EXPECT_LE(stats["bytes_read"], std::filesystem::file_size(Brain()));
}

TEST_F(ProgramPictures, BrainsFromOutside)
{
  if (Brain().empty())
  {
    GTEST_SKIP() << "mricron-data isn't installed.";
  }
  ExpectBaseline({ Brain(), "--repeat", "32", "32", "32", "--pitch", "320", "384", "320",
                   "--gpu-memory", "256M", "--host-memory", "512M" },
    "DemoBrainsOutside");
}

TEST_F(ProgramPictures, BrainsFromInside)
{
  if (Brain().empty())
  {
    GTEST_SKIP() << "mricron-data isn't installed.";
  }
  ExpectBaseline({ Brain(), "--repeat", "32", "32", "32", "--pitch", "320", "384", "320",
                   "--gpu-memory", "256M", "--host-memory", "512M", "--camera", "0.5", "0.4844",
                   "0.5156", "0.53", "0.75", "0.53", "0", "0", "1", "--view-angle", "60" },
    "DemoBrainsInside");
}

TEST_F(ProgramPictures, Sponge)
{
  ExpectBaseline({ "formula:sponge", "--dimensions", "1073741824", "1073741824", "1073741824",
                   "--gpu-memory", "256M", "--host-memory", "512M" },
    "DemoSponge");
}

TEST_F(ProgramPictures, BudgetTooSmallNamesTheLeastThatWorks)
{
  const std::string out = FreshFileName("small.png");
  const Outcome outcome = RunProgram({ "render", "formula:shells", out, "--gpu-memory", "1M" });
  EXPECT_EQ(outcome.ExitCode, 1);
  EXPECT_NE(outcome.Error.find("least"), std::string::npos) << outcome.Error;
  EXPECT_FALSE(std::filesystem::exists(out));
}

// Sarton's mouse brain, in an atlas that a software renderer can hold: `plan` tells what the mapper
// then allocates, to the byte.
TEST_F(ProgramPictures, PlansWhatIsAllocated)
{
  const std::string out = FreshFileName("planned.png");
  const std::string stats = FreshFileName("planned.json");
  // Bricks of 8 make so many slots that the pool of page blocks follows from them.
  for (const auto& [type, brick] :
    { std::pair{ "u8", "32" }, { "u16", "32" }, { "f32", "32" }, { "f64", "32" }, { "u8", "8" } })
  {
    const std::vector<std::string> volume{ "64000", "50000", "114", "--brick", brick, "--size",
      "64", "48" };
    std::vector<std::string> render{ "render", "formula:shells", out, "--type", type,
      "--gpu-memory", "100M", "--stats", stats, "--dimensions" };
    render.insert(render.end(), volume.begin(), volume.end());
    const Outcome drawn = RunProgram(render);
    ASSERT_EQ(drawn.ExitCode, 0) << drawn.Error;
    const auto json = nlohmann::json::parse(std::ifstream(stats));
    std::vector<std::string> plan{ "plan", "--type", type, "--gpu", "100M", "--texture-size",
      std::to_string(json["texture_size"].get<int>()), "--json" };
    if (json["marcher"] == "native")
    {
      plan.emplace_back("--native");
    }
    plan.insert(plan.end(), volume.begin(), volume.end());
    const Outcome planned = RunProgram(plan);
    ASSERT_EQ(planned.ExitCode, 0) << planned.Error;
    const auto told = nlohmann::json::parse(planned.Output);
    EXPECT_EQ(told["addressing_bytes"], json["addressing_memory_used"]) << type;
    EXPECT_EQ(told["atlas_slots"], json["atlas_slots"]) << type;
    EXPECT_GE(told["total_bytes"], json["gpu_memory_used"]) << type;
    EXPECT_LE(told["total_bytes"].get<double>(), 1.02 * json["gpu_memory_used"].get<double>())
      << type;
    std::printf("  %s, bricks of %s: %llu slots, %llu bytes of addressing\n", type, brick,
      told["atlas_slots"].get<unsigned long long>(),
      told["addressing_bytes"].get<unsigned long long>());
  }
}

/// Runs with a folder of its own for temporary files, which has to be empty in the end.
Outcome RunAndLeaveNothing(const std::vector<std::string>& arguments, bool interrupt = false)
{
  RunOptions options;
  options.TemporaryFolder = FreshFileName("temporary");
  std::filesystem::create_directory(options.TemporaryFolder);
  if (interrupt)
  {
    options.InterruptWhenExists = options.TemporaryFolder + "/teravox-bench-";
    options.Signals = { SIGINT };
  }
  const Outcome outcome = RunProgram(arguments, options);
  EXPECT_TRUE(std::filesystem::is_empty(options.TemporaryFolder));
  return outcome;
}

TEST_F(ProgramPictures, BenchScaleCostsFollowThePicture)
{
  const Outcome outcome = RunAndLeaveNothing({ "bench", "scale", "--volumes", "512", "1048576",
    "--files", "512", "1048576", "--size", "64", "48", "--frames", "1", "--repetitions", "2",
    "--gpu-memory", "32M", "--host-memory", "256M", "--json" });
  ASSERT_EQ(outcome.ExitCode, 0) << outcome.Error;
  EXPECT_EQ(outcome.Error, "");
  const auto json = nlohmann::json::parse(outcome.Output);
  EXPECT_EQ(json["frames"], 1);
  // Depends on when bricks come, as well as on what is drawn. (So would bytes read, if chunks of
  // the file found no room.)
  const std::set<std::string> timed{ "operations", "allocations" };
  const std::set<std::string> seconds{ "first_seconds", "first_cpu_seconds", "frame_seconds",
    "frame_cpu_seconds" };
  for (const char* group : { "formula", "file" })
  {
    for (const char* view : { "outside", "inside" })
    {
      SCOPED_TRACE(std::string(group) + " " + view);
      const bool file = std::string(group) == "file";
      const auto& rows = json[group][view]["rows"];
      ASSERT_EQ(rows.size(), 2u);
      EXPECT_EQ(rows[1]["voxels_per_axis"], 1048576);
      const auto& ratio = json[group][view]["ratio"];
      for (const char* column : { "first_seconds", "first_cpu_seconds", "frame_seconds",
             "frame_cpu_seconds", "addressing_bytes", "host_bytes", "process_bytes", "bytes_read",
             "bytes_uploaded", "traffic_bytes", "frame_traffic_bytes", "bricks", "operations",
             "frame_operations", "allocations", "frame_allocations" })
      {
        SCOPED_TRACE(column);
        const std::string name = column;
        ASSERT_TRUE(rows[0][column].is_number());
        ASSERT_TRUE(rows[1][column].is_number());
        const double first = rows[0][column];
        const double last = rows[1][column];
        if (first > 0)
        {
          EXPECT_NEAR(ratio[column].get<double>(), last / first, 1e-9);
        }
        else
        {
          EXPECT_TRUE(ratio[column].is_null());
        }
        if (seconds.count(name) == 0)
        {
          // So small a picture's costs are few: a brick or two more in view are much beside them.
          const double slack = name == "frame_traffic_bytes" ? 1e6
            : name == "frame_operations"                     ? 8
            : name == "frame_allocations"                    ? 100
                                                             : 0;
          EXPECT_LE(last, (timed.count(name) != 0 ? 2.0 : 1.2) * first + slack);
        }
      }
      for (const auto& row : rows)
      {
        EXPECT_GT(row["bricks"], 0);
        EXPECT_GT(row["bytes_uploaded"], 0);
        EXPECT_GE(row["traffic_bytes"], row["bytes_uploaded"]);
        EXPECT_GT(row["allocations"], row["frame_allocations"]);
        EXPECT_GT(row["frame_allocations"], 0);
        EXPECT_EQ(row["bytes_read"].get<double>() > 0, file);
      }
    }
  }

  const Outcome table =
    RunAndLeaveNothing({ "bench", "scale", "--volumes", "64", "--files", "128", "--size", "16",
      "16", "--frames", "1", "--repetitions", "1", "--gpu-memory", "16M", "--host-memory", "64M" });
  EXPECT_EQ(table.ExitCode, 0) << table.Error;
  EXPECT_NE(table.Output.find("last / first"), std::string::npos) << table.Output;
}

TEST_F(ProgramPictures, BenchScaleFailsInOneSentenceAndLeavesNothing)
{
  const auto expect = [](const Outcome& outcome, const char* text)
  {
    EXPECT_EQ(outcome.ExitCode, 1);
    EXPECT_EQ(outcome.Output, "");
    EXPECT_NE(outcome.Error.find(text), std::string::npos) << outcome.Error;
    EXPECT_EQ(outcome.Error.find('\n'), outcome.Error.size() - 1) << outcome.Error;
  };
  const std::vector<std::string> small{ "bench", "scale", "--volumes", "64", "--size", "64", "48",
    "--frames", "1", "--repetitions", "1", "--json" };
  const auto with = [&small](const std::vector<std::string>& more)
  {
    std::vector<std::string> arguments = small;
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  };
  expect(RunAndLeaveNothing(with({ "--gpu-memory", "100K" })), "least that works");
  expect(RunAndLeaveNothing(with({ "--gpu-memory", "32M", "--files", "128", "4096" }), true),
    "interrupted");
}

TEST_F(ProgramPictures, BenchIsBenchFrame)
{
  const std::vector<std::string> options{ "--volumes", "32", "--size", "32", "32", "--frames", "1",
    "--json" };
  for (const std::vector<std::string>& name :
    { std::vector<std::string>{ "bench" }, std::vector<std::string>{ "bench", "frame" } })
  {
    std::vector<std::string> arguments = name;
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Outcome outcome = RunProgram(arguments);
    ASSERT_EQ(outcome.ExitCode, 0) << outcome.Error;
    const auto json = nlohmann::json::parse(outcome.Output);
    EXPECT_EQ(json["frames"], 1);
    ASSERT_EQ(json["measurements"].size(), 6u);
    EXPECT_EQ(json["measurements"][0]["mapper"], "teravox");
    EXPECT_EQ(json["measurements"][0]["voxels_per_axis"], 32);
  }
}

// The default of a large machine, a quarter of its memory, is more than some drivers give to one
// texture: the atlas is then what they give.
TEST_F(ProgramPictures, BudgetBeyondTheDriverIsNoError)
{
  RunOptions options;
  options.AddressSpaceLimit = std::uint64_t{ 1500 } << 20;
  const std::string out = FreshFileName("beyond.png");
  const std::string stats = FreshFileName("beyond.json");
  const Outcome outcome = RunProgram(
    { "render", "formula:sponge", out, "--dimensions", "1073741824", "1073741824", "1073741824",
      "--gpu-memory", "8G", "--host-memory", "64M", "--size", "64", "48", "--stats", stats },
    options);
  ASSERT_EQ(outcome.ExitCode, 0) << outcome.Error;
  const auto json = nlohmann::json::parse(std::ifstream(stats));
  EXPECT_TRUE(json["converged"]);
  EXPECT_LE(json["gpu_memory_peak"].get<std::uint64_t>(), options.AddressSpaceLimit);
  EXPECT_GE(json["gpu_memory_used"].get<std::uint64_t>(), options.AddressSpaceLimit / 32);
}

TEST_F(ProgramPictures, OldOpenGLIsOneClearError)
{
  RunOptions options;
  options.GLVersion = "3.2";
  const std::string out = FreshFileName("old.png");
  const Outcome outcome = RunProgram({ "render", "formula:shells", out }, options);
  EXPECT_EQ(outcome.ExitCode, 1);
  EXPECT_NE(outcome.Error.find("4.3"), std::string::npos) << outcome.Error;
  EXPECT_EQ(outcome.Error.find('\n'), outcome.Error.size() - 1) << outcome.Error;
  EXPECT_FALSE(std::filesystem::exists(out));
}

} // namespace
