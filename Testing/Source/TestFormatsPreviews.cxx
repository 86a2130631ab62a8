// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TestFormatsSupport.h"

#include <array>
#include <gtest/gtest.h>

namespace teravox::testing
{
namespace
{

HDF5OpenOptions PreviewOptions(std::uint64_t from = 1)
{
  HDF5OpenOptions options;
  options.PreviewsFrom = from;
  return options;
}

struct Expected
{
  const char* Name;
  Int3 Size;
  std::size_t VoxelBytes;
  std::vector<Int3> Factors;
};

// Against levels that numpy made.
TEST(PreviewLevels, AreTheMiddleOfEachGroup)
{
  TERAVOX_FORMAT_FILES(files, "previews");
  const std::vector<Int3> halves{ { 1, 1, 1 }, { 2, 2, 2 }, { 4, 4, 4 }, { 8, 8, 8 } };
  std::vector<Int3> more = halves;
  more.push_back({ 16, 16, 16 });
  const std::vector<Int3> fewer(halves.begin(), halves.begin() + 3);
  for (const Expected& e : { Expected{ "rows", { 600, 70, 40 }, 2, more },
         Expected{ "chunks", { 260, 66, 131 }, 1, halves },
         Expected{ "slices", { 140, 150, 270 }, 1, { { 1, 1, 1 }, { 4, 4, 4 }, { 8, 8, 8 } } },
         Expected{ "holes", { 300, 100, 90 }, 4, halves },
         Expected{ "labels", { 260, 80, 70 }, 4, halves },
         Expected{ "huge", { 130, 66, 66 }, 8, fewer },
         Expected{ "colors", { 140, 70, 66 }, 3, fewer } })
  {
    SCOPED_TRACE(e.Name);
    const auto source = OpenFormat(files->File(e.Name + std::string(".h5")), PreviewOptions());
    ASSERT_TRUE(source);
    const PyramidLayout& layout = source->Info().Layout;
    ASSERT_EQ(layout.NumberOfLevels(), static_cast<int>(e.Factors.size()));
    EXPECT_EQ(layout.Dimensions(0), e.Size);
    for (int level = 0; level < layout.NumberOfLevels(); ++level)
    {
      SCOPED_TRACE(level);
      EXPECT_EQ(layout.Factor(level), e.Factors[static_cast<std::size_t>(level)]);
      ExpectLevelIs(*source, level, layout.Dimensions(level),
        files->Array(e.Name + std::to_string(level)), e.VoxelBytes);
    }
    EXPECT_NE(SeenBy(*source).find("are previews"), std::string::npos) << SeenBy(*source);
  }
}

TEST(PreviewLevels, OnlyWhereAVolumeIsLarge)
{
  TERAVOX_FORMAT_FILES(files, "previews");
  const std::string name = files->File("chunks.h5");
  const std::uint64_t voxels = 260 * 66 * 131;
  const auto levels = [&](const HDF5OpenOptions& options)
  { return OpenFormat(name, options)->Info().Layout.NumberOfLevels(); };
  EXPECT_EQ(levels(PreviewOptions(voxels)), 4);
  EXPECT_EQ(levels(PreviewOptions(voxels + 1)), 1);
  EXPECT_EQ(levels(HDF5OpenOptions()), 1);
  EXPECT_EQ(levels(PreviewOptions(HDF5OpenOptions::NoPreviews)), 1);
  EXPECT_GT(
    OpenFormat(files->File("sparse.h5"), HDF5OpenOptions())->Info().Layout.NumberOfLevels(), 1);
}

// Of rows and slices only those that a brick is made of; of chunks nothing twice.
TEST(PreviewLevels, ReadLittle)
{
  TERAVOX_FORMAT_FILES(files, "previews");
  const auto slices = OpenFormat(files->File("slices.h5"), PreviewOptions());
  ASSERT_TRUE(slices);
  std::uint64_t before = slices->BytesRead();
  ASSERT_TRUE(slices->ReadBrick(BrickKey::Of(2, { 0, 0, 0 })).Ok());
  EXPECT_EQ(slices->BytesRead() - before, 2U * 34 * 150 * 140); // 34 slices of 8, two of each
  const auto rows = OpenFormat(files->File("rows.h5"), PreviewOptions());
  ASSERT_TRUE(rows);
  before = rows->BytesRead();
  ASSERT_TRUE(rows->ReadBrick(BrickKey::Of(4, { 0, 0, 0 })).Ok());
  // 3 x 5 voxels of the level, two rows for each and axis; the last ones lie outside and are one.
  EXPECT_EQ(rows->BytesRead() - before, (2U * 3 - 1) * (2U * 5 - 1) * 600 * 2);
  const auto chunks = OpenFormat(files->File("chunks.h5"), PreviewOptions());
  ASSERT_TRUE(chunks);
  before = chunks->BytesRead();
  ASSERT_TRUE(chunks->ReadBrick(BrickKey::Of(3, { 0, 0, 0 })).Ok());
  const std::uint64_t once = chunks->BytesRead() - before;
  EXPECT_GT(once, 0U);
  ASSERT_TRUE(chunks->ReadBrick(BrickKey::Of(2, { 0, 0, 0 })).Ok());
  ASSERT_TRUE(chunks->ReadBrick(BrickKey::Of(0, { 1, 0, 0 })).Ok());
  EXPECT_EQ(chunks->BytesRead() - before, once);
}

TEST(PreviewLevels, WhatIsNotStoredIsTheFillValue)
{
  TERAVOX_FORMAT_FILES(files, "previews");
  const auto source = OpenFormat(files->File("sparse.h5"), PreviewOptions());
  ASSERT_TRUE(source);
  const PyramidLayout& layout = source->Info().Layout;
  // 150 x 175 x 175 voxels in 3^3 bricks; stored are x 125...137, y 25...37, z 75...87.
  const int level = 2;
  ASSERT_EQ(layout.Factor(level), (Int3{ 4, 4, 4 }));
  ASSERT_EQ(layout.Bricks(level), (Int3{ 3, 3, 3 }));
  const Result<std::vector<ValueRange>> ranges =
    source->ReadRanges(BrickKey::Of(level, { 0, 0, 0 }), layout.Bricks(level));
  ASSERT_TRUE(ranges.Ok());
  int unknown = 0;
  for (std::uint32_t i = 0; i < 27; ++i)
  {
    const auto brick = source->ReadBrick(BrickKey::Of(level, { i % 3, i / 3 % 3, i / 9 }));
    ASSERT_TRUE(brick.Ok());
    bool other = false;
    for (const std::byte voxel : brick.Value()->Voxels)
    {
      other = other || std::to_integer<int>(voxel) != 9;
    }
    const ValueRange& range = ranges.Value()[i];
    EXPECT_TRUE(range == ValueRange::Unknown() || range == ValueRange({ 9, 9 })) << i;
    EXPECT_TRUE(!other || range == ValueRange::Unknown()) << i;
    unknown += range == ValueRange::Unknown() ? 1 : 0;
  }
  // The chunk is looked up with the border of the bricks beside it.
  EXPECT_GE(unknown, 1);
  EXPECT_LE(unknown, 8);
  EXPECT_EQ(ranges.Value()[0], (ValueRange{ 9, 9 }));
  EXPECT_EQ(ranges.Value()[26], (ValueRange{ 9, 9 }));
}

} // namespace
} // namespace teravox::testing
