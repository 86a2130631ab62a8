// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ProgramRunner.h"
#include "TestFormatsSupport.h"

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace teravox::testing
{
namespace
{

using test::Outcome;
using test::RunProgram;

/// Converts, and compares all voxels of level 0 with an array.
void ExpectConverted(const FormatFiles& files, std::vector<std::string> arguments,
  const std::string& array, const Int3& size, std::size_t voxelBytes, VolumeInfo* info = nullptr)
{
  static int count = 0;
  const std::string output = files.File("converted" + std::to_string(++count) + ".h5");
  arguments.insert(arguments.begin(), "convert");
  arguments.insert(arguments.end(), { output, "--brick", "16", "--quiet" });
  const Outcome converted = RunProgram(arguments);
  ASSERT_EQ(converted.ExitCode, 0) << converted.Error;
  EXPECT_EQ(converted.Error, "");
  const auto source = OpenFormat(output);
  ASSERT_TRUE(source);
  ASSERT_EQ(source->Info().Layout.Dimensions(0), size);
  ExpectLevelIs(*source, 0, size, files.Array(array), voxelBytes);
  if (info != nullptr)
  {
    *info = source->Info();
  }
  EXPECT_EQ(RunProgram({ "verify", output }).ExitCode, 0);
}

TEST(ProgramImport, FoldersPatternsAndFilesBecomePyramids)
{
  TERAVOX_FORMAT_FILES(files, "images");
  VolumeInfo info;
  ExpectConverted(*files, { files->File("ct") }, "ct", { 23, 17, 7 }, 2, &info);
  EXPECT_EQ(info.Type, ScalarType::Int16);
  EXPECT_NEAR(info.Spacing[2], 2.5, 1e-9);
  ExpectConverted(*files, { files->File("mr") }, "mr", { 23, 17, 7 }, 2, &info);
  EXPECT_NEAR(info.Direction[2], -1, 1e-9);
  ExpectConverted(*files, { files->File("stack") }, "stack", { 47, 33, 12 }, 2);
  ExpectConverted(*files, { files->File("numbered/a_%03d.tif"), "--spacing", "0.5", "1", "2.5" },
    "numbered_a_p03d.tif", { 47, 33, 12 }, 2, &info);
  EXPECT_EQ(info.Spacing, (Double3{ 0.5, 1, 2.5 }));
  ExpectConverted(*files, { files->File("colours.nrrd") }, "colours.nrrd", { 23, 17, 9 }, 4, &info);
  EXPECT_EQ(info.Components, 4);
  ExpectConverted(*files, { files->File("sform.nii.gz"), "--memory", "64M" }, "sform.nii.gz",
    { 23, 17, 9 }, 2, &info);
  EXPECT_NEAR(info.Origin[2], 30.5, 1e-5);
  ExpectConverted(*files, { files->File("colours.tif") }, "colours.tif", { 47, 33, 5 }, 6);
}

TEST(ProgramImport, RawVoxelsAreDescribedByArguments)
{
  TERAVOX_FORMAT_FILES(files, "images");
  VolumeInfo info;
  ExpectConverted(*files,
    { files->File("apart.dat"), "--raw", "--dimensions", "23", "17", "9", "--type", "f32",
      "--header", "6", "--spacing", "1", "2", "3", "--origin", "4", "5", "-6" },
    "apart.nhdr", { 23, 17, 9 }, 4, &info);
  EXPECT_EQ(info.Spacing, (Double3{ 1, 2, 3 }));
  EXPECT_EQ(info.Origin, (Double3{ 4, 5, -6 }));
  ExpectConverted(*files,
    { files->File("big.bin"), "--raw", "--dimensions", "23", "17", "9", "--type", "u16",
      "--components", "3", "--header", "-1", "--big-endian" },
    "big.mhd", { 23, 17, 9 }, 6);
  const std::string out = files->File("never.h5");
  const auto expect = [&](std::vector<std::string> arguments, int code, const char* text)
  {
    arguments.insert(arguments.begin(), "convert");
    const Outcome outcome = RunProgram(arguments);
    EXPECT_EQ(outcome.ExitCode, code) << outcome.Error;
    EXPECT_NE(outcome.Error.find(text), std::string::npos) << outcome.Error;
  };
  const std::string raw = files->File("apart.dat");
  expect({ raw, out, "--raw" }, 2, "--dimensions");
  expect({ raw, out, "--raw", "--dimensions", "23", "17", "9", "--type", "f32" }, 1, "--header");
  expect({ raw, out, "--raw", "--dimensions", "23", "17", "10", "--type", "f32" }, 1, "too short");
  expect({ raw, out, "--raw", "--dimensions", "23", "17", "9", "--type", "f16" }, 1, "'f16'");
  expect({ files->File("gap"), out }, 1, "evenly spaced");
  expect({ files->File("two"), out }, 1, "choose one by its UID");
  expect({ files->File("stack/*.png"), out }, 1,
    "matches no DICOM, TIFF, PNG, JPEG, PNM, BMP or TGA files");
  expect({ files->File("local_u2.mha"), out, "--array", "density" }, 1, "MetaImage");
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST(ProgramImport, WhatOnlyVTKReadsMustFitIntoTheMemory)
{
  const TemporaryFolder kept;
  const std::string text = kept.File("vectors.vtk");
  {
    std::ofstream out(text);
    out << "# vtk DataFile Version 3.0\nvectors\nASCII\nDATASET STRUCTURED_POINTS\n"
           "DIMENSIONS 400 400 400\nSPACING 1 1 1\nORIGIN 0 0 0\nPOINT_DATA 64000000\n"
           "VECTORS v float\n1 2 3\n";
  }
  const Outcome outcome = RunProgram({ "convert", text, kept.File("out.h5"), "--memory", "100M" });
  EXPECT_EQ(outcome.ExitCode, 1);
  EXPECT_NE(outcome.Error.find("can only be read as a whole"), std::string::npos) << outcome.Error;
  EXPECT_NE(outcome.Error.find("--memory"), std::string::npos) << outcome.Error;
}

} // namespace
} // namespace teravox::testing
