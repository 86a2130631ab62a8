// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "ChunkCache.h"
#include "Types.h"

#include <cstddef>
#include <cstdint>

namespace teravox
{

class HDF5Dataset;

/// A box of voxels of one level that becomes a brick.
struct BrickTarget
{
  std::byte* Voxels = nullptr;
  std::size_t VoxelBytes = 1;
  std::int64_t StoredSize = 0;
  Int3 Start{ 0, 0, 0 }; ///< of the brick with its border; may lie outside the level
  Int3 Low{ 0, 0, 0 };   ///< the part of it that lies inside
  Int3 High{ 0, 0, 0 };

  std::byte* Row(std::int64_t y, std::int64_t z) const
  {
    return this->Voxels +
      static_cast<std::size_t>((z * this->StoredSize + y) * this->StoredSize) * this->VoxelBytes;
  }
};

/// Copies what a chunk has of the target; a chunk without voxels is the fill value.
void PutChunk(const Chunk& chunk, const Int3& chunkStart, const HDF5Dataset& dataset,
  const BrickTarget& target);

/// Repeats the outermost voxels inside the level over what lies outside.
void RepeatOutside(const BrickTarget& target);

} // namespace teravox
