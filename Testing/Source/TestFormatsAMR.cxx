// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TestFormatsSupport.h"

#include <gtest/gtest.h>

namespace teravox::testing
{
namespace
{

/// All levels, against arrays that numpy put together from the boxes.
void ExpectLevelsAre(const FormatFiles& files, const std::string& name,
  const std::vector<Int3>& factors, const Int3& size, std::size_t voxelBytes)
{
  SCOPED_TRACE(name);
  const auto source = OpenFormat(files.File(name + ".vtkhdf"));
  ASSERT_TRUE(source);
  const PyramidLayout& layout = source->Info().Layout;
  ASSERT_EQ(layout.NumberOfLevels(), static_cast<int>(factors.size()));
  EXPECT_EQ(layout.Dimensions(0), size);
  EXPECT_TRUE(source->Info().CellData);
  EXPECT_EQ(source->Info().ArrayName, "density");
  for (int level = 0; level < layout.NumberOfLevels(); ++level)
  {
    SCOPED_TRACE(level);
    EXPECT_EQ(layout.Factor(level), factors[static_cast<std::size_t>(level)]);
    ExpectLevelIs(*source, level, layout.Dimensions(level),
      files.Array(name + std::to_string(level)), voxelBytes);
  }
}

TEST(FormatsAMR, BoxesAreAPyramid)
{
  TERAVOX_FORMAT_FILES(files, "amr");
  const std::vector<Int3> three{ { 1, 1, 1 }, { 2, 2, 2 }, { 4, 4, 4 } };
  ExpectLevelsAre(*files, "boxes", three, { 48, 36, 24 }, 4);
  ExpectLevelsAre(*files, "packed", three, { 48, 36, 24 }, 2);
  ExpectLevelsAre(*files, "vectors", { { 1, 1, 1 }, { 2, 2, 2 } }, { 24, 18, 12 }, 3);
  ExpectLevelsAre(*files, "uneven", { { 1, 1, 1 }, { 3, 3, 1 } }, { 30, 30, 4 }, 8);
}

TEST(FormatsAMR, CellsLieWhereTheFileSays)
{
  TERAVOX_FORMAT_FILES(files, "amr");
  const auto source = OpenFormat(files->File("boxes.vtkhdf"));
  ASSERT_TRUE(source);
  const VolumeInfo& info = source->Info();
  EXPECT_EQ(info.Spacing, (Double3{ 0.25, 0.5, 1 }));
  EXPECT_EQ(info.ExtentStart, (Int3{ -16, 8, 0 }));
  // The centre of the first cell: the origin, and 15.5, 8.5 and 0.5 cells from it.
  EXPECT_EQ(info.Origin, (Double3{ 10 - 15.5 * 0.25, 20 + 8.5 * 0.5, 30.5 }));
  EXPECT_NE(SeenBy(*source).find("3 levels of refinement, 2 boxes"), std::string::npos)
    << SeenBy(*source);
  const auto both = OpenFormat(files->File("both.vtkhdf"));
  ASSERT_TRUE(both);
  EXPECT_NE(SeenBy(*both).find("1 array of points left out"), std::string::npos) << SeenBy(*both);
  const auto open = OpenFormat(files->File("uneven.vtkhdf"));
  ASSERT_TRUE(open);
  EXPECT_NE(SeenBy(*open).find("are NaN"), std::string::npos) << SeenBy(*open);
}

TEST(FormatsAMR, BoxesAndCellsChangeWithTheSteps)
{
  TERAVOX_FORMAT_FILES(files, "amr");
  for (const std::string name : { "moving", "moving_older" })
  {
    for (int t = 0; t < 4; ++t)
    {
      SCOPED_TRACE(name + ", step " + std::to_string(t));
      const auto source = OpenFormat(files->File(name + ".vtkhdf"), FormatOptions(0, t));
      ASSERT_TRUE(source);
      EXPECT_EQ(source->Description().Times, (std::vector<double>{ 1, 1.25, 1.5, 1.75 }));
      const PyramidLayout& layout = source->Info().Layout;
      // The same levels at all times, whether they have boxes or not.
      ASSERT_EQ(layout.NumberOfLevels(), 3);
      EXPECT_EQ(layout.Dimensions(0), (Int3{ 48, 36, 24 }));
      for (int level = 0; level < 3; ++level)
      {
        ExpectLevelIs(*source, level, layout.Dimensions(level),
          files->Array(name + "." + std::to_string(t) + "." + std::to_string(level)), 2);
      }
    }
    // An array that doesn't change.
    const auto still = OpenFormat(files->File(name + ".vtkhdf"), FormatOptions(1, 1));
    ASSERT_TRUE(still);
    ExpectLevelIs(*still, 0, { 48, 36, 24 }, files->Array(name + ".0.0"), 2);
  }
}

TEST(FormatsAMR, LittleMemoryIsEnough)
{
  TERAVOX_FORMAT_FILES(files, "amr");
  HDF5OpenOptions options = FormatOptions();
  options.MemoryBudget = 4096; // a few of the chunks of 97 cells
  const auto source = OpenFormat(files->File("packed.vtkhdf"), options);
  ASSERT_TRUE(source);
  ExpectLevelIs(*source, 0, { 48, 36, 24 }, files->Array("packed0"), 2);
  EXPECT_LE(source->MemoryUsed(), options.MemoryBudget);
}

TEST(FormatsAMR, ContradictionsAreNamed)
{
  TERAVOX_FORMAT_FILES(files, "amr");
  const auto fails = [&](const char* name, StatusCode code, const char* text)
  {
    SCOPED_TRACE(name);
    ExpectOpenFails(files->File(name + std::string(".vtkhdf")), FormatOptions(), code, text);
  };
  fails("short", StatusCode::Corrupt, "'/VTKHDF/Level1/CellData/density'");
  fails("outside", StatusCode::Corrupt, "reaches beyond");
  fails("turned", StatusCode::Corrupt, "empty or too far");
  fails("table", StatusCode::Corrupt, "'/VTKHDF/Level0/AMRBox'");
  fails("spacing", StatusCode::Unsupported, "whole number along x");
  fails("hole", StatusCode::Unsupported, "leave cells open");
  fails("steps", StatusCode::Corrupt, "NSteps");
  fails("no_offsets", StatusCode::Corrupt, "Level1/AMRBoxOffsets' doesn't have 4 entries");
  const auto failsAt = [&](const char* name, int time, StatusCode code, const char* text)
  {
    const std::string file = files->File(name + std::string(".vtkhdf"));
    ExpectOpenFails(file, FormatOptions(0, time), code, text);
  };
  failsAt("few_boxes", 3, StatusCode::Corrupt, "Level1/AMRBox' lacks boxes of step 3");
  failsAt("few_cells", 3, StatusCode::Corrupt, "Level0/CellData/density' doesn't have the");
  failsAt("no_step", 1, StatusCode::Corrupt, "no possible entry for step 1");
  failsAt("moving", 4, StatusCode::InvalidArgument, "4 time points");
  ExpectOpenFails(files->File("moving.vtkhdf"), FormatOptions(VolumeRequest::AllChannels, 1),
    StatusCode::Unsupported, "choose one of them");
  fails("nothing", StatusCode::NotFound, "no cell data");
  fails("points", StatusCode::Unsupported, "values at points ('density')");
  fails("no_levels", StatusCode::Corrupt, "/VTKHDF/Level0");
}

} // namespace
} // namespace teravox::testing
