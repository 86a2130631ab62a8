// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "FileContents.h"
#include "ProgramRunner.h"
#include "TestFormatsSupport.h"

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace teravox::testing
{
namespace
{

using test::Outcome;
using test::RunProgram;

TEST(ProgramFormats, InfoSaysWhatItSawAndWhy)
{
  TERAVOX_FORMAT_FILES(files, "imaris");
  const std::string file = files->File("small.ims");
  const Outcome text = RunProgram({ "info", file, "--channel", "1", "--time", "2" });
  EXPECT_EQ(text.ExitCode, 0) << text.Error;
  for (const char* part : { "Taken as Imaris", "ImarisDataSet", "channel 1   Membrane",
         "time points 3", "TimePoint 2/Channel 1" })
  {
    EXPECT_NE(text.Output.find(part), std::string::npos) << part << " isn't in\n" << text.Output;
  }
  const Outcome all = RunProgram({ "info", file, "--channel", "all", "--json" });
  const nlohmann::json json = nlohmann::json::parse(all.Output);
  EXPECT_EQ(json["format"], "Imaris");
  EXPECT_EQ(json["components"], 2);
  EXPECT_EQ(json["channels"][0]["color"][2], 0.5);
  EXPECT_EQ(json["times"].size(), 3u);
  const Outcome none = RunProgram({ "info", file, "--channel", "7" });
  EXPECT_EQ(none.ExitCode, 1);
  EXPECT_NE(none.Error.find("no channel 7"), std::string::npos) << none.Error;
  EXPECT_EQ(RunProgram({ "info", file, "--channel", "first" }).ExitCode, 2);
  EXPECT_EQ(RunProgram({ "info", file, "--time", "-1" }).ExitCode, 2);
}

TEST(ProgramFormats, ConvertTakesTheChannelAndTimePoint)
{
  TERAVOX_FORMAT_FILES(files, "imaris");
  const std::string output = files->File("converted.h5");
  const Outcome converted = RunProgram({ "convert", files->File("small.ims"), output, "--channel",
    "1", "--time", "2", "--brick", "16", "--quiet" });
  ASSERT_EQ(converted.ExitCode, 0) << converted.Error;
  const auto source = OpenFormat(output);
  ASSERT_TRUE(source);
  ExpectLevelIs(*source, 0, { 101, 53, 21 }, files->Array("small.2.1.0"), 2);
  EXPECT_NEAR(source->Info().Spacing[2], 1.5, 1e-9);
  EXPECT_NEAR(source->Info().Origin[0], 10.125, 1e-9);
  EXPECT_EQ(RunProgram({ "verify", output }).ExitCode, 0);
}

TEST(ProgramFormats, VerifyFailsWithAList)
{
  TERAVOX_FORMAT_FILES(files, "verify");
  const Outcome good = RunProgram({ "verify", files->File("right.h5") });
  EXPECT_EQ(good.ExitCode, 0) << good.Error;
  EXPECT_NE(good.Output.find("all readable"), std::string::npos) << good.Output;
  const Outcome dark = RunProgram({ "verify", files->File("dark.h5") });
  EXPECT_EQ(dark.ExitCode, 1);
  EXPECT_NE(dark.Output.find("dark borders"), std::string::npos) << dark.Output;
  const Outcome bit = RunProgram({ "verify", files->File("bit.h5") });
  EXPECT_EQ(bit.ExitCode, 1);
  EXPECT_NE(bit.Output.find("checksum is wrong"), std::string::npos) << bit.Output;
}

TEST(ProgramFormats, ASidecarIsReadInsteadOfTheOneLevelItWasMadeOf)
{
  TERAVOX_FORMAT_FILES(files, "single");
  const std::string file = files->File("one.h5");
  const auto before = std::filesystem::last_write_time(file);
  const std::string bytes = ContentsOf(file);
  const Outcome converted = RunProgram({ "convert", file, "--brick", "8", "--quiet" });
  ASSERT_EQ(converted.ExitCode, 0) << converted.Error;
  EXPECT_EQ(std::filesystem::last_write_time(file), before);
  EXPECT_TRUE(ContentsOf(file) == bytes);
  const auto source = OpenFormat(file);
  ASSERT_TRUE(source);
  EXPECT_GT(source->Info().Layout.NumberOfLevels(), 1);
  EXPECT_TRUE(source->Info().Range.IsKnown());
  ExpectLevelIs(*source, 0, { 13, 11, 9 }, files->Array("a"), 2);
  EXPECT_NE(SeenBy(*source).find("sidecar"), std::string::npos) << SeenBy(*source);
  // By path it is another request, and one that wasn't converted.
  const auto named = OpenFormat(file, FormatOptions(0, 0, "/some/where"));
  ASSERT_TRUE(named);
  EXPECT_EQ(named->Info().Layout.NumberOfLevels(), 1);
  // The file has changed: what was made of the old one isn't used.
  std::filesystem::last_write_time(file, before + std::chrono::seconds(1));
  const auto changed = OpenFormat(file);
  ASSERT_TRUE(changed);
  EXPECT_EQ(changed->Info().Layout.NumberOfLevels(), 1);
  EXPECT_NE(SeenBy(*changed).find("another version"), std::string::npos) << SeenBy(*changed);
  // Converted again, also while the old one is there.
  EXPECT_EQ(RunProgram({ "convert", file, "--quiet", "--brick", "8" }).ExitCode, 0);
  EXPECT_GT(OpenFormat(file)->Info().Layout.NumberOfLevels(), 1);
  std::filesystem::remove(file + ".teravox.h5");
}

} // namespace
} // namespace teravox::testing
