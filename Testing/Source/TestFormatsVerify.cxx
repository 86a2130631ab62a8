// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TestFormatsSupport.h"
#include "VolumeVerifier.h"

#include <hdf5.h>

namespace teravox::testing
{
namespace
{

VerifyReport Verify(const std::string& file)
{
  VerifyReport report;
  const auto source = OpenFormat(file);
  EXPECT_TRUE(source && VerifyVolume(*source, report).Ok());
  return report;
}

TEST(FormatsVerify, ARightPyramidHasNoFindings)
{
  TERAVOX_FORMAT_FILES(files, "verify");
  // One that lacks the groups that aren't whole is right, too.
  EXPECT_TRUE(Verify(files->File("floored.h5")).Findings.empty());
  const VerifyReport report = Verify(files->File("right.h5"));
  EXPECT_TRUE(report.Findings.empty()) << report.Findings.front();
  // 51 x 42 x 33 and 26 x 21 x 17 in bricks of 16.
  EXPECT_EQ(report.Bricks, 4u * 3 * 3 + 2 * 2 * 2);
}

TEST(FormatsVerify, WhatIsUsuallyWrongIsRecognised)
{
  TERAVOX_FORMAT_FILES(files, "verify");
  const std::vector<std::pair<std::string, std::string>> faults{
    { "moved", "moved by one voxel towards higher x" }, { "decimated", "every n-th voxel" },
    { "dark", "dark borders" }, { "noise", "values differ" }
  };
  for (const auto& [name, text] : faults)
  {
    SCOPED_TRACE(name);
    const VerifyReport report = Verify(files->File(name + ".h5"));
    ASSERT_EQ(report.Findings.size(), 1u);
    EXPECT_NE(report.Findings[0].find(text), std::string::npos) << report.Findings[0];
    EXPECT_NE(report.Findings[0].find(name + ".h5"), std::string::npos) << report.Findings[0];
    EXPECT_EQ(report.UnreadableBricks, 0u);
  }
}

TEST(FormatsVerify, AFlippedBitIsFound)
{
  TERAVOX_FORMAT_FILES(files, "verify");
  const VerifyReport report = Verify(files->File("bit.h5"));
  EXPECT_GT(report.UnreadableBricks, 0u);
  ASSERT_FALSE(report.Findings.empty());
  EXPECT_NE(report.Findings[0].find("checksum is wrong"), std::string::npos) << report.Findings[0];
}

TEST(FormatsVerify, RangesOfTheProjectsOwnFilesAreChecked)
{
  const TemporaryFolder folder;
  ArrayVoxelReader reader(Describe({ 50, 40, 30 }, ScalarType::UInt16));
  reader.GenerateMixed(3);
  PyramidWriterOptions options;
  options.BrickSize = 16;
  options.Compression = PyramidCompression::None;
  const std::string file = folder.File("own.h5");
  ASSERT_TRUE(PyramidWriter::Write(file, reader, options).Ok());
  EXPECT_TRUE(Verify(file).Findings.empty());
  // A larger value where the ranges don't know of it.
  const std::string level = "/Pyramid/0";
  const hid_t id = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  const hid_t dataset = H5Dopen2(id, level.c_str(), H5P_DEFAULT);
  const hid_t space = H5Dget_space(dataset);
  const hsize_t at[3] = { 3, 4, 5 };
  H5Sselect_elements(space, H5S_SELECT_SET, 1, at);
  const hsize_t one = 1;
  const hid_t memory = H5Screate_simple(1, &one, nullptr);
  const std::uint16_t value = 60000;
  EXPECT_GE(H5Dwrite(dataset, H5T_NATIVE_UINT16, memory, space, H5P_DEFAULT, &value), 0);
  H5Sclose(memory);
  H5Sclose(space);
  H5Dclose(dataset);
  H5Fclose(id);
  const VerifyReport report = Verify(file);
  EXPECT_EQ(report.WrongRanges, 1u);
  ASSERT_EQ(report.Findings.size(), 2u); // and the average above it
  EXPECT_NE(report.Findings[0].find("60000"), std::string::npos) << report.Findings[0];
}

} // namespace
} // namespace teravox::testing
