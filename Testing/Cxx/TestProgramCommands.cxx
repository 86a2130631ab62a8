// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ProgramRunner.h"
#include "VTKTestSupport.h"

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>
#include <vtkImageData.h>
#include <vtkMetaImageWriter.h>
#include <vtkNIFTIImageWriter.h>
#include <vtkNew.h>
#include <vtkTIFFWriter.h>
#include <vtkXMLImageDataWriter.h>

namespace
{

using teravox::test::FreshFileName;
using teravox::test::MakeRandomImage;
using teravox::test::Outcome;
using teravox::test::RunOptions;
using teravox::test::RunProgram;

/// A failure is one sentence on standard error that contains `text`, nothing on standard output.
void ExpectFailure(const Outcome& outcome, int code, const std::string& text)
{
  EXPECT_EQ(outcome.ExitCode, code) << outcome.Error;
  EXPECT_NE(outcome.Error.find(text), std::string::npos)
    << "\"" << outcome.Error << "\" lacks \"" << text << "\"";
  EXPECT_EQ(outcome.Output, "");
  EXPECT_EQ(outcome.Error.compare(0, 7, "teravox"), 0) << outcome.Error;
  EXPECT_EQ(outcome.Error.find('\n'), outcome.Error.size() - 1) << outcome.Error;
}

RunOptions Limited(std::uint64_t bytes)
{
  RunOptions options;
  options.FileSizeLimit = bytes;
  return options;
}

RunOptions Interrupted(const std::string& file, const std::vector<int>& signals)
{
  RunOptions options;
  options.InterruptWhenExists = file;
  options.Signals = signals;
  return options;
}

/// Files beside this one whose name begins with its name, itself included.
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

RunOptions OnDisplay(const std::string& name)
{
  RunOptions options;
  options.Display = name;
  return options;
}

/// Some image on disk as VTI.
std::string MakeImageFile(const std::string& name, int type = VTK_UNSIGNED_CHAR, int size = 40)
{
  const int extent[6] = { 0, size - 1, 0, 29, 0, 19 };
  vtkNew<vtkXMLImageDataWriter> writer;
  writer->SetInputData(MakeRandomImage(type, extent, 1, false, 4));
  const std::string file = FreshFileName(name);
  writer->SetFileName(file.c_str());
  writer->Write();
  return file;
}

TEST(ProgramUsage, WrongUsageIsOneSentenceAndExitCodeTwo)
{
  ExpectFailure(RunProgram({}), 2, "subcommand");
  ExpectFailure(RunProgram({ "fly" }), 2, "fly");
  ExpectFailure(RunProgram({ "convert" }), 2, "input");
  ExpectFailure(RunProgram({ "convert", "a.nii" }), 2, "output");
  ExpectFailure(RunProgram({ "convert", "a", "b", "c" }), 2, "c");
  ExpectFailure(RunProgram({ "convert", "a", "b", "--memory", "much" }), 2, "much");
  ExpectFailure(RunProgram({ "convert", "a", "b", "--compression", "zip" }), 2, "zip");
  ExpectFailure(RunProgram({ "convert", "a", "b", "--level", "13" }), 2, "13");
  ExpectFailure(RunProgram({ "plan", "10", "10" }), 2, "nz");
  ExpectFailure(RunProgram({ "plan", "10", "10", "ten" }), 2, "ten");
  ExpectFailure(RunProgram({ "plan", "10", "10", "10", "--type", "u64" }), 2, "u64");
  ExpectFailure(RunProgram({ "render", "a.h5", "b.png", "--marcher", "cpu" }), 2, "cpu");
  ExpectFailure(RunProgram({ "bench", "fly" }), 2, "fly");
  ExpectFailure(RunProgram({ "bench", "scale", "--files", "64" }), 2, "64");
  ExpectFailure(RunProgram({ "render", "a.h5", "b.png", "--size", "0", "5" }), 2, "0");
  ExpectFailure(RunProgram({ "render", "a.h5", "b.png", "--brick", "1" }), 2, "1");
  ExpectFailure(RunProgram({ "render", "a.h5", "b.png", "--gpu-memory", "-3" }), 2, "-3");
}

TEST(ProgramUsage, HelpAndVersionSucceed)
{
  for (const char* command : { "", "convert", "info", "plan", "render", "bench" })
  {
    const Outcome outcome = *command ? RunProgram({ command, "--help" }) : RunProgram({ "--help" });
    EXPECT_EQ(outcome.ExitCode, 0);
    EXPECT_NE(outcome.Output.find("Usage"), std::string::npos);
    EXPECT_EQ(outcome.Error, "");
  }
  for (const char* bench : { "frame", "scale" })
  {
    const Outcome outcome = RunProgram({ "bench", bench, "--help" });
    EXPECT_EQ(outcome.ExitCode, 0);
    EXPECT_NE(outcome.Output.find("--volumes"), std::string::npos) << outcome.Output;
  }
  EXPECT_EQ(RunProgram({ "--version" }).Output.compare(0, 8, "teravox "), 0);
}

TEST(ProgramConvert, EveryReadableFormatGivesTheSameVolume)
{
  const int extent[6] = { 0, 39, 0, 29, 0, 19 };
  const auto image = MakeRandomImage(VTK_SHORT, extent, 1, false, 4);
  const std::string vti = FreshFileName("volume.vti");
  const std::string nii = FreshFileName("volume.nii.gz");
  const std::string mha = FreshFileName("volume.mha");
  vtkNew<vtkXMLImageDataWriter> vtiWriter;
  vtiWriter->SetInputData(image);
  vtiWriter->SetFileName(vti.c_str());
  vtiWriter->Write();
  vtkNew<vtkNIFTIImageWriter> niiWriter;
  niiWriter->SetInputData(image);
  niiWriter->SetFileName(nii.c_str());
  niiWriter->Write();
  vtkNew<vtkMetaImageWriter> mhaWriter;
  mhaWriter->SetInputData(image);
  mhaWriter->SetFileName(mha.c_str());
  mhaWriter->SetCompression(false);
  mhaWriter->Write();
  nlohmann::json first;
  for (const std::string& input : { vti, nii, mha })
  {
    const std::string output = FreshFileName("volume.h5");
    const Outcome converted = RunProgram({ "convert", input, output, "--brick", "16" });
    ASSERT_EQ(converted.ExitCode, 0) << converted.Error;
    EXPECT_NE(converted.Output.find("levels"), std::string::npos) << converted.Output;
    EXPECT_EQ(converted.Error, "");
    const Outcome info = RunProgram({ "info", output, "--json" });
    ASSERT_EQ(info.ExitCode, 0) << info.Error;
    const auto json = nlohmann::json::parse(info.Output);
    EXPECT_EQ(json["dimensions"], nlohmann::json({ 40, 30, 20 })) << input;
    EXPECT_EQ(json["type"], "i16");
    if (first.is_null())
    {
      first = json;
    }
    EXPECT_EQ(json["histogram"], first["histogram"]) << input;
    EXPECT_EQ(json["range"], first["range"]) << input;
    EXPECT_EQ(json["levels"], first["levels"]) << input;
  }
}

TEST(ProgramConvert, PyramidsCanBeConvertedAgain)
{
  const std::string vti = MakeImageFile("again.vti");
  const std::string first = FreshFileName("first.h5");
  const std::string second = FreshFileName("second.h5");
  ASSERT_EQ(RunProgram({ "convert", vti, first, "--quiet" }).ExitCode, 0);
  const Outcome outcome = RunProgram({ "convert", first, second, "--brick", "16", "--compression",
    "deflate", "--level", "6", "--quiet" });
  ASSERT_EQ(outcome.ExitCode, 0) << outcome.Error;
  EXPECT_EQ(outcome.Output, "");
  const auto a = nlohmann::json::parse(RunProgram({ "info", first, "--json" }).Output);
  const auto b = nlohmann::json::parse(RunProgram({ "info", second, "--json" }).Output);
  EXPECT_EQ(a["histogram"], b["histogram"]);
  EXPECT_LT(a["levels"].size(), b["levels"].size());
}

TEST(ProgramConvert, BadInputIsOneSentenceAndExitCodeOne)
{
  const std::string out = FreshFileName("out.h5");
  const std::string absent = FreshFileName("absent.nii");
  ExpectFailure(RunProgram({ "convert", absent, out }), 1, "absent.nii doesn't exist");
  const std::string odd = FreshFileName("volume.xyz");
  std::ofstream(odd) << "x";
  ExpectFailure(RunProgram({ "convert", odd, out }), 1, "extension");
  const std::string folder = FreshFileName("folder.vti");
  std::filesystem::create_directory(folder);
  ExpectFailure(RunProgram({ "convert", folder, out }), 1, "is a folder");
  for (const char* name :
    { "text.nii", "text.mha", "text.nrrd", "text.vti", "text.vtk", "text.tif" })
  {
    const std::string file = FreshFileName(name);
    std::ofstream(file) << "This is text.";
    ExpectFailure(RunProgram({ "convert", file, out }), 1, name);
  }
  const std::string h5 = FreshFileName("text.h5");
  std::ofstream(h5) << "This is text.";
  ExpectFailure(RunProgram({ "convert", h5, out }), 1, "text.h5");
  const std::string wide = MakeImageFile("wide.vti", VTK_LONG_LONG);
  ExpectFailure(RunProgram({ "convert", wide, out }), 1, "long long");
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST(ProgramConvert, TruncatedInputIsAnErrorAndLeavesNothing)
{
  const int extent[6] = { 0, 63, 0, 63, 0, 63 };
  const std::string file = FreshFileName("short.nii");
  vtkNew<vtkNIFTIImageWriter> writer;
  writer->SetInputData(MakeRandomImage(VTK_SHORT, extent, 1, false, 4));
  writer->SetFileName(file.c_str());
  writer->Write();
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  const std::string out = FreshFileName("short.h5");
  ExpectFailure(RunProgram({ "convert", file, out }), 1, "short.nii");
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST(ProgramConvert, BadOutputAndBudgetsAreNamed)
{
  const std::string vti = MakeImageFile("fine.vti");
  ExpectFailure(RunProgram({ "convert", vti, "/nowhere/out.h5" }), 1, "/nowhere/out.h5");
  const std::string out = FreshFileName("out.h5");
  ExpectFailure(RunProgram({ "convert", vti, out, "--memory", "10K" }), 1, "bytes");
  ExpectFailure(RunProgram({ "convert", vti, out, "--brick", "7" }), 1, "brick");
  ExpectFailure(RunProgram({ "convert", vti, out, "--array", "absent" }), 1, "absent");
  ExpectFailure(RunProgram({ "convert", vti, vti }), 1, "input as well as the output");
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST(ProgramConvert, FullDiskIsNamedAndLeavesNothing)
{
  // A limit on the size of files is what a full disk is for the one who writes.
  const std::string vti = MakeImageFile("large.vti", VTK_INT, 400);
  const std::string out = FreshFileName("full.h5");
  const Outcome outcome =
    RunProgram({ "convert", vti, out, "--compression", "none" }, Limited(200 * 1024));
  ExpectFailure(outcome, 1, "full.h5");
  for (const auto& entry :
    std::filesystem::directory_iterator(std::filesystem::path(out).parent_path()))
  {
    EXPECT_EQ(entry.path().filename().string().find("full.h5"), std::string::npos);
  }
}

TEST(ProgramConvert, SignalsLeaveNothing)
{
  const std::string vti = MakeImageFile("huge.vti", VTK_DOUBLE, 16000);
  const auto convert = [&](const std::string& out, const std::vector<int>& signals)
  {
    return RunProgram(
      { "convert", vti, out, "--compression", "deflate", "--level", "12", "--memory", "200M" },
      Interrupted(out, signals));
  };
  for (const int number : { SIGINT, SIGTERM, SIGHUP })
  {
    const std::string out = FreshFileName("interrupted.h5");
    ExpectFailure(convert(out, { number }), 1, "interrupted");
    EXPECT_EQ(FilesLike(out), 0u) << "signal " << number;
  }
  // Who is in a hurry gets the signal's own end; the unfinished file goes all the same.
  const std::string hurried = FreshFileName("hurried.h5");
  const Outcome outcome = convert(hurried, { SIGINT, SIGINT });
  EXPECT_TRUE(outcome.ExitCode == -SIGINT || outcome.ExitCode == 1) << outcome.ExitCode;
  EXPECT_EQ(FilesLike(hurried), 0u);
  // Nobody can clean up after this one but the next conversion to the same name.
  const std::string killed = FreshFileName("killed.h5");
  EXPECT_EQ(convert(killed, { SIGKILL }).ExitCode, -SIGKILL);
  const std::size_t left = FilesLike(killed);
  EXPECT_TRUE(left == 1 || left == 2) << left;  // the file, and its log, if there was time for one
  const std::string other = killed + ".1.part"; // process 1 lives
  std::ofstream(other) << "somebody else's";
  const std::string small = MakeImageFile("small.vti");
  EXPECT_EQ(RunProgram({ "convert", small, killed, "--quiet" }).ExitCode, 0);
  EXPECT_TRUE(std::filesystem::exists(killed));
  EXPECT_TRUE(std::filesystem::exists(other));
  EXPECT_EQ(FilesLike(killed), 2u);
  std::filesystem::remove(other);
}

TEST(ProgramInfo, BadFilesAreNamed)
{
  const std::string absent = FreshFileName("absent.h5");
  ExpectFailure(RunProgram({ "info", absent }), 1, "absent.h5");
  const std::string text = FreshFileName("text.h5");
  std::ofstream(text) << "This is text.";
  ExpectFailure(RunProgram({ "info", text }), 1, "text.h5");
  const std::string vti = MakeImageFile("ok.vti");
  const std::string good = FreshFileName("good.h5");
  ASSERT_EQ(RunProgram({ "convert", vti, good, "--quiet" }).ExitCode, 0);
  EXPECT_EQ(RunProgram({ "info", good }).ExitCode, 0);
  ExpectFailure(RunProgram({ "info", good, "--dataset", "/absent" }), 1, "/absent");
  std::filesystem::resize_file(good, std::filesystem::file_size(good) / 3);
  ExpectFailure(RunProgram({ "info", good }), 1, "good.h5");
}

TEST(ProgramPlan, CountsBricksAsThePublishedTable)
{
  // Sarton 2018, table 3.1, mouse brain with bricks of 32^3: the levels are halved on all axes.
  const Outcome outcome = RunProgram({ "plan", "64000", "50000", "114", "--type", "rgba8",
    "--brick", "32", "--gpu", "4G", "--json" });
  ASSERT_EQ(outcome.ExitCode, 0) << outcome.Error;
  const auto json = nlohmann::json::parse(outcome.Output);
  EXPECT_EQ(json["components"], 4);
  EXPECT_EQ(json["levels"][0]["bricks"], nlohmann::json({ 2000, 1563, 4 }));
  EXPECT_LE(json["addressing_bytes"].get<double>(), 2e6);
  EXPECT_LE(json["total_bytes"].get<double>(), 4294967296.0);
  EXPECT_GT(json["total_bytes"].get<double>(), 1e9);
}

/// A plan of the mouse brain, with these options more.
nlohmann::json PlanOf(const std::vector<std::string>& more)
{
  std::vector<std::string> arguments{ "plan", "64000", "50000", "114", "--brick", "32", "--gpu",
    "4G", "--json" };
  arguments.insert(arguments.end(), more.begin(), more.end());
  const Outcome outcome = RunProgram(arguments);
  EXPECT_EQ(outcome.ExitCode, 0) << outcome.Error;
  return outcome.ExitCode == 0 ? nlohmann::json::parse(outcome.Output) : nlohmann::json();
}

TEST(ProgramPlan, StatesWhatItAssumesOfTheDriver)
{
  const auto usual = PlanOf({ "--type", "u8" });
  EXPECT_EQ(usual["assumed"]["marcher"], "gpu");
  EXPECT_EQ(usual["assumed"]["size"], nlohmann::json({ 800, 600 }));
  EXPECT_EQ(usual["bytes_per_texel"], 1);
  EXPECT_GT(PlanOf({ "--type", "u8", "--size", "8000", "6000" })["reserved_bytes"],
    usual["reserved_bytes"]);
  for (const bool native : { false, true })
  {
    std::vector<std::string> rgba{ "--type", "rgba8" };
    std::vector<std::string> f32{ "--type", "f32" };
    if (native)
    {
      rgba.emplace_back("--native");
      f32.emplace_back("--native");
    }
    // RGBA of 8 bits and floats are both 4 bytes: the same atlas, the same addressing, but for 16
    // bytes per slot that floats need.
    const auto colors = PlanOf(rgba);
    const auto floats = PlanOf(f32);
    EXPECT_EQ(colors["bytes_per_texel"], 4) << native;
    EXPECT_EQ(floats["bytes_per_texel"], 4) << native;
    const auto slots = floats["atlas_slots"].get<std::uint64_t>();
    EXPECT_NEAR(colors["atlas_slots"].get<double>() / static_cast<double>(slots), 1, 1e-3)
      << native;
    EXPECT_EQ(colors["addressing_bytes"].get<std::uint64_t>(),
      floats["addressing_bytes"].get<std::uint64_t>() - 16 * slots)
      << native;
    EXPECT_LE(colors["addressing_bytes"].get<double>(), 2e6) << native;
    std::printf("  %s: %llu slots, %llu bytes of addressing\n", native ? "native" : "GPU",
      colors["atlas_slots"].get<unsigned long long>(),
      colors["addressing_bytes"].get<unsigned long long>());
  }
  const Outcome text = RunProgram({ "plan", "1000", "1000", "1000" });
  EXPECT_NE(text.Output.find("Assumed"), std::string::npos) << text.Output;
}

TEST(ProgramPlan, ImpossibleVolumesAreErrors)
{
  ExpectFailure(RunProgram({ "plan", "0", "10", "10" }), 1, "0");
  ExpectFailure(RunProgram({ "plan", "2147483648", "10", "10" }), 1, "2147483648");
  ExpectFailure(RunProgram({ "plan", "10", "10", "10", "--brick", "1" }), 1, "brick");
  ExpectFailure(
    RunProgram({ "plan", "1000", "1000", "1000", "--gpu", "1K" }), 1, "least that works");
  EXPECT_EQ(RunProgram({ "plan", "1000", "1000", "1000" }).ExitCode, 0);
}

TEST(ProgramRender, BadInputIsOneSentenceAndExitCodeOne)
{
  const std::string out = FreshFileName("out.png");
  const std::string absent = FreshFileName("absent.h5");
  ExpectFailure(RunProgram({ "render", absent, out }), 1, "absent.h5");
  ExpectFailure(RunProgram({ "render", "formula:teapot", out }), 1, "teapot");
  ExpectFailure(RunProgram({ "render", "formula:shells", out, "--type", "u64" }), 1, "u64");
  ExpectFailure(
    RunProgram({ "render", "formula:shells", out, "--dimensions", "0", "5", "5" }), 1, "0");
  ExpectFailure(
    RunProgram({ "render", "formula:shells", out, "--repeat", "0", "1", "1" }), 1, "repe");
  ExpectFailure(RunProgram({ "render", "formula:shells", "/nowhere/out.png" }), 1, "/nowhere");
  ExpectFailure(
    RunProgram({ "render", "formula:shells", out, "--transfer-function", "/nowhere/tf.json" }), 1,
    "/nowhere/tf.json");
  ExpectFailure(RunProgram({ "render", "formula:shells", out }, OnDisplay("")), 1, "display");
  ExpectFailure(RunProgram({ "render", "formula:shells", out }, OnDisplay(":987")), 1, ":987");
  ExpectFailure(RunProgram({ "bench" }, OnDisplay("")), 1, "display");
  ExpectFailure(RunProgram({ "bench", "frame" }, OnDisplay("")), 1, "display");
  ExpectFailure(RunProgram({ "bench", "scale" }, OnDisplay("")), 1, "display");
  EXPECT_FALSE(std::filesystem::exists(out));
}

} // namespace
