// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Images larger than the memory that is allowed, of every kind that is converted piece by piece:
// how much memory that takes, and whether it goes on where it was killed.
#include "FileContents.h"
#include "ProgramRunner.h"
#include "TestFormatsSupport.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

namespace teravox::testing
{
namespace
{

using test::Outcome;
using test::RunOptions;
using test::RunProgram;

constexpr Int3 Size{ 288, 256, 224 };
constexpr std::uint64_t VolumeBytes = std::uint64_t{ 288 } * 256 * 224 * 2;

std::vector<std::string> Conversion(const std::string& input, const std::string& output)
{
  std::vector<std::string> all{ "convert", input, output, "--brick", "32", "--memory", "28M",
    "--quiet", "--resume" };
  if (input.find(".bin") != std::string::npos)
  {
    all.insert(all.end(), { "--raw", "--dimensions", "288", "256", "224", "--type", "u16" });
  }
  return all;
}

void ExpectStreamed(const FormatFiles& files, const std::string& name, std::uint64_t without)
{
  SCOPED_TRACE(name);
  const std::string input = files.File(name);
  const std::string whole = files.File("whole.h5");
  const std::string out = files.File("killed.h5");
  const auto begin = std::chrono::steady_clock::now();
  const Outcome converted = RunProgram(Conversion(input, whole));
  const auto took =
    std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - begin);
  ASSERT_EQ(converted.ExitCode, 0) << converted.Error;
  const std::uint64_t more = converted.PeakBytes - std::min(converted.PeakBytes, without);
  std::printf("  %-14s %5.1f of %.1f MB, %lld ms\n", name.c_str(), static_cast<double>(more) / 1e6,
    static_cast<double>(VolumeBytes) / 1e6, static_cast<long long>(took.count()));
  const bool indices = name == "palette.tif"; // a byte each
  EXPECT_LT(more, VolumeBytes * 3 / 4);
  const auto source = OpenFormat(whole);
  ASSERT_TRUE(source);
  ASSERT_EQ(source->Info().Layout.Dimensions(0), Size);
  ExpectLevelIs(*source, 0, Size, files.Array(indices ? "indices" : "volume"), indices ? 1 : 2);
  // Killed earlier and earlier, until it isn't faster than that.
  int exit = 0;
  for (auto after = took * 2 / 3; exit == 0 && after.count() > 0; after = after * 2 / 3)
  {
    RunOptions options;
    options.InterruptWhenExists = out + ".";
    options.Signals = { SIGKILL };
    options.DelayMilliseconds = static_cast<int>(after.count());
    std::filesystem::remove(out);
    exit = RunProgram(Conversion(input, out), options).ExitCode;
    // Killed when all was done is not killed.
    exit = std::filesystem::exists(out) ? 0 : exit;
  }
  ASSERT_EQ(exit, -SIGKILL);
  EXPECT_FALSE(std::filesystem::exists(out));
  const Outcome resumed = RunProgram(Conversion(input, out));
  ASSERT_EQ(resumed.ExitCode, 0) << resumed.Error;
  EXPECT_TRUE(ContentsOf(out) == ContentsOf(whole));
  std::filesystem::remove(out);
  std::filesystem::remove(whole);
}

TEST(ProgramStreams, TakeTheMemoryThatIsAllowedAndGoOnWhereTheyWereKilled)
{
  TERAVOX_FORMAT_FILES(files, "streams");
  // What the program takes without a volume.
  const Outcome nothing = RunProgram({ "convert", "formula:marschner-lobb", files->File("tiny.h5"),
    "--dimensions", "16", "16", "16", "--quiet" });
  ASSERT_EQ(nothing.ExitCode, 0) << nothing.Error;
  for (const char* name : { "plain.mha", "packed.nii.gz", "plain.mrc", "text.nrrd", "binary.vtk",
         "text.vtk", "palette.tif", "pages.tif", "stack", "series", "plain.vti", "pieces.pvti",
         "chunks.h5", "volume.bin" })
  {
    ExpectStreamed(*files, name, nothing.PeakBytes);
  }
}

} // namespace
} // namespace teravox::testing
