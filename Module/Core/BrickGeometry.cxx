// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BrickGeometry.h"

#include <algorithm>
#include <cstring>
#include <limits>

namespace teravox
{

VoxelBox Clamp(const VoxelBox& box, const Int3& dimensions)
{
  VoxelBox clamped = box;
  for (std::size_t a = 0; a < 3; ++a)
  {
    clamped.Low[a] = std::max<std::int64_t>(box.Low[a], 0);
    clamped.High[a] = std::min(box.High[a], dimensions[a]);
  }
  return clamped;
}

VoxelBox StoredBox(const PyramidLayout& layout, const BrickKey& brick)
{
  const Int3 index{ brick.X, brick.Y, brick.Z };
  VoxelBox box;
  for (std::size_t a = 0; a < 3; ++a)
  {
    box.Low[a] = index[a] * layout.BrickSize() - BrickBorder;
    box.High[a] = box.Low[a] + layout.StoredSize();
  }
  return box;
}

VoxelBox SupportBox(const PyramidLayout& layout, const BrickKey& region)
{
  const Int3 index{ region.X, region.Y, region.Z };
  const Int3& dims = layout.Dimensions(region.Level);
  VoxelBox box;
  for (std::size_t a = 0; a < 3; ++a)
  {
    std::int64_t edge = layout.BrickSize();
    // Beyond 2^31 voxels one region covers everything.
    for (int k = 0; k < region.PageLevel && edge < (std::int64_t{ 1 } << 31); ++k)
    {
      edge *= layout.PageEdge()[a];
    }
    const std::int64_t low = index[a] * edge;
    if (low >= dims[a])
    {
      return {};
    }
    box.Low[a] = low - BrickBorder;
    box.High[a] = low + edge + BrickBorder;
  }
  return Clamp(box, dims);
}

std::string Subject(const BrickKey& key, const VolumeInfo& info)
{
  return key.ToString() + " of " + (info.Name.empty() ? "an unnamed volume" : info.Name);
}

Status CheckKey(const BrickKey& key, const VolumeInfo& info)
{
  const PyramidLayout& layout = info.Layout;
  if (key.Level < layout.NumberOfLevels() && key.Time < static_cast<std::uint32_t>(info.TimeSteps))
  {
    const Int3 pages = layout.Pages(key.Level, key.PageLevel);
    if (key.X < pages[0] && key.Y < pages[1] && key.Z < pages[2])
    {
      return {};
    }
  }
  return Status(StatusCode::InvalidArgument, "There is no " + Subject(key, info) + ".");
}

std::uint64_t BrickVoxelBytes(const VolumeInfo& info)
{
  const auto edge = static_cast<std::uint64_t>(info.Layout.StoredSize());
  return edge * edge * edge * static_cast<std::uint64_t>(info.Components) * SizeOf(info.Type);
}

std::uint64_t BrickMaskBytes(const VolumeInfo& info)
{
  const auto edge = static_cast<std::uint64_t>(info.Layout.StoredSize());
  return info.Masked ? edge * edge * edge * static_cast<std::uint64_t>(MaskBytesOf(info)) : 0;
}

std::shared_ptr<Brick> MakeEmptyBrick(const VolumeInfo& info)
{
  auto brick = std::make_shared<Brick>();
  brick->Type = info.Type;
  brick->Components = info.Components;
  brick->StoredSize = info.Layout.StoredSize();
  brick->Voxels.resize(static_cast<std::size_t>(BrickVoxelBytes(info)));
  return brick;
}

namespace
{
/// Copies items along a row of `count` items of `bytes` each: those before `low` and from `high` on
/// become the nearest one in between.
void ExtendItems(
  std::byte* items, std::size_t bytes, std::int64_t count, std::int64_t low, std::int64_t high)
{
  const auto at = [&](std::int64_t i) { return items + static_cast<std::size_t>(i) * bytes; };
  for (std::int64_t i = 0; i < low; ++i)
  {
    std::memcpy(at(i), at(low), bytes);
  }
  for (std::int64_t i = high; i < count; ++i)
  {
    std::memcpy(at(i), at(high - 1), bytes);
  }
}
} // namespace

void RepeatOutermostVoxels(Brick& brick, const VoxelBox& stored, const VoxelBox& inside)
{
  const std::int64_t edge = brick.StoredSize;
  Int3 low{};
  Int3 high{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    low[a] = inside.Low[a] - stored.Low[a];
    high[a] = inside.High[a] - stored.Low[a];
  }
  const std::size_t voxel = static_cast<std::size_t>(brick.Components) * SizeOf(brick.Type);
  const std::size_t row = voxel * static_cast<std::size_t>(edge);
  const std::size_t slice = row * static_cast<std::size_t>(edge);
  for (std::int64_t z = low[2]; z < high[2]; ++z)
  {
    std::byte* const rows = brick.Voxels.data() + static_cast<std::size_t>(z) * slice;
    if (low[0] > 0 || high[0] < edge)
    {
      for (std::int64_t y = low[1]; y < high[1]; ++y)
      {
        ExtendItems(rows + static_cast<std::size_t>(y) * row, voxel, edge, low[0], high[0]);
      }
    }
    ExtendItems(rows, row, edge, low[1], high[1]);
  }
  ExtendItems(brick.Voxels.data(), slice, edge, low[2], high[2]);
}

} // namespace teravox
