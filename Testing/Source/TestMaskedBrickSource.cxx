// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ArrayBrickSource.h"
#include "BrickTexels.h"
#include "MaskedBrickSource.h"

#include <gtest/gtest.h>

namespace teravox
{

namespace
{
std::shared_ptr<BrickSource> Bytes(
  const Int3& n, std::uint8_t first, std::uint8_t rest, int components = 1, int brickSize = 8)
{
  const auto voxels = std::make_shared<std::vector<std::uint8_t>>(
    static_cast<std::size_t>(n[0] * n[1] * n[2] * components), rest);
  std::fill_n(voxels->begin(), n[0] * n[1] * components * n[2] / 2, first);
  ArrayDescription array;
  array.Data = voxels->data();
  array.Owner = voxels;
  array.Dimensions = n;
  array.Components = components;
  array.BrickSize = brickSize;
  array.Name = "bytes";
  array.Mask = true;
  return ArrayBrickSource::Make(array).Value();
}
constexpr Int3 Size{ 16, 16, 48 };

std::vector<ValueRange> RangesAlongZ(BrickSource& source)
{
  return source.ReadRanges(BrickKey{}, { 1, 1, 6 }).Value();
}
} // namespace

// Of 6 bricks the border of two voxels reaches from one side to the other in the two in the middle.
TEST(MaskedBrickSource, RegionsOutsideHaveNoValuesAndThoseAtTheBorderNotOne)
{
  const auto masked = MaskedBrickSource::Make(Bytes(Size, 7, 7), Bytes(Size, 3, 0)).Value();
  EXPECT_TRUE(masked->Info().Masked);
  const std::vector<ValueRange> ranges = RangesAlongZ(*masked);
  for (const std::size_t i : { 0u, 1u })
  {
    EXPECT_EQ(ranges[i].Min, 7);
    EXPECT_EQ(ranges[i].Max, 7) << i;
  }
  for (const std::size_t i : { 2u, 3u })
  {
    EXPECT_EQ(ranges[i].Min, 7);
    EXPECT_GT(ranges[i].Max, 7) << i;
    EXPECT_LT(ranges[i].Max, 7.001) << i;
  }
  EXPECT_TRUE(ranges[4].IsVoid() && ranges[5].IsVoid());
  const auto none = MaskedBrickSource::Make(Bytes(Size, 7, 7), Bytes(Size, 0, 0)).Value();
  for (const ValueRange& range : RangesAlongZ(*none))
  {
    EXPECT_TRUE(range.IsVoid());
  }
}

TEST(MaskedBrickSource, BricksHaveBoth)
{
  const auto masked = MaskedBrickSource::Make(Bytes(Size, 7, 9), Bytes(Size, 200, 0)).Value();
  BrickKey key;
  key.Z = 2; // voxels 16 to 23, stored from 14 to 25; the mask ends at 23
  const BrickPointer brick = masked->ReadBrick(key).Value();
  ASSERT_EQ(brick->Mask.size(), 12u * 12 * 12);
  ASSERT_EQ(brick->Voxels.size(), brick->Mask.size());
  for (std::size_t i = 0; i < brick->Mask.size(); ++i)
  {
    ASSERT_EQ(brick->Mask[i], i / 144 < 10 ? 1 : 0);
    ASSERT_EQ(static_cast<int>(brick->Voxels[i]), i / 144 < 10 ? 7 : 9);
  }
  const TexelFormat format = TexelFormat::Choose(ScalarType::UInt8);
  const std::vector<ConvertedBrick> planes = ConvertComponents(*brick, format);
  ASSERT_EQ(planes.size(), 2u);
  EXPECT_EQ(planes[1].Bytes[0], 1);
  EXPECT_EQ(planes[1].Bytes.back(), 0);
  // Cells of four voxels, two along each axis: those below lie in the mask as a whole.
  EXPECT_EQ(planes[1].Cells[0], 1);
  EXPECT_EQ(planes[1].Cells[8], 0);
  EXPECT_EQ(planes[1].Cells[9], 1);
  key.Z = 5;
  const std::vector<ConvertedBrick> out =
    ConvertComponents(*masked->ReadBrick(key).Value(), format);
  EXPECT_GT(out[0].Cells[0], out[0].Cells[1]) << "no range";
}

TEST(MaskedBrickSource, OtherSizesAndComponentsAreErrors)
{
  const auto volume = Bytes(Size, 7, 7);
  const auto messageOf = [&](const std::shared_ptr<BrickSource>& mask)
  { return MaskedBrickSource::Make(volume, mask).GetStatus().Message(); };
  EXPECT_NE(messageOf(Bytes({ 16, 16, 47 }, 1, 0)).find("16 x 16 x 47"), std::string::npos);
  EXPECT_NE(messageOf(Bytes(Size, 1, 0, 2)).find("2 components"), std::string::npos);
  EXPECT_NE(messageOf(Bytes(Size, 1, 0, 1, 16)).find("levels or bricks"), std::string::npos);
}

// Each source gets what it needs.
TEST(MaskedBrickSource, BudgetsAddUp)
{
  const auto volume = Bytes(Size, 7, 7);
  const auto mask = Bytes(Size, 1, 0);
  const auto masked = MaskedBrickSource::Make(volume, mask).Value();
  EXPECT_EQ(masked->LeastMemory(), volume->LeastMemory() + mask->LeastMemory());
  masked->SetMemoryBudget(masked->LeastMemory());
  EXPECT_TRUE(masked->ReadRanges(BrickKey{}, { 1, 1, 1 }).Ok());
  EXPECT_EQ(masked->MemoryUsed(), volume->MemoryUsed() + mask->MemoryUsed());
  masked->SetMemoryBudget(masked->LeastMemory() / 4);
  EXPECT_FALSE(masked->ReadRanges(BrickKey{}, { 1, 1, 1 }).Ok());
}

} // namespace teravox
