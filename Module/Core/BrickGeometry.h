// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"

#include <string>

namespace teravox
{

/// A box of voxels, [Low, High).
struct VoxelBox
{
  Int3 Low{ 0, 0, 0 };
  Int3 High{ 0, 0, 0 };

  bool IsEmpty() const
  {
    return this->Low[0] >= this->High[0] || this->Low[1] >= this->High[1] ||
      this->Low[2] >= this->High[2];
  }
  Int3 Size() const
  {
    return { this->High[0] - this->Low[0], this->High[1] - this->Low[1],
      this->High[2] - this->Low[2] };
  }
  std::int64_t Count() const
  {
    const Int3 size = this->Size();
    return this->IsEmpty() ? 0 : size[0] * size[1] * size[2];
  }
  bool operator==(const VoxelBox& o) const { return this->Low == o.Low && this->High == o.High; }
};

/// The part of a box that lies inside [0, dimensions).
VoxelBox Clamp(const VoxelBox& box, const Int3& dimensions);

/// Voxels that the stored brick covers, border included; reaches beyond the level at its ends.
VoxelBox StoredBox(const PyramidLayout& layout, const BrickKey& brick);

/// Voxels that matter to samples inside a region of any page level: its bricks and BrickBorder
/// voxels around them, inside the level. Empty if the region lies outside.
VoxelBox SupportBox(const PyramidLayout& layout, const BrickKey& region);

/// "level 2, brick (3, 0, 7) of brain.h5".
std::string Subject(const BrickKey& key, const VolumeInfo& info);

/// Whether the volume has this brick or region; else InvalidArgument.
Status CheckKey(const BrickKey& key, const VolumeInfo& info);

/// Bytes of the voxels of a stored brick, and of its mask.
std::uint64_t BrickVoxelBytes(const VolumeInfo& info);
std::uint64_t BrickMaskBytes(const VolumeInfo& info);

/// A brick of the right shape whose voxels are 0.
std::shared_ptr<Brick> MakeEmptyBrick(const VolumeInfo& info);

/// Fills the part of a stored brick that lies outside of the level with the nearest voxels inside
/// (clamp). `inside` is Clamp(StoredBox()), whose voxels are in place already.
void RepeatOutermostVoxels(Brick& brick, const VoxelBox& stored, const VoxelBox& inside);

} // namespace teravox
