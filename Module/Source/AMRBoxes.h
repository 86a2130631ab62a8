// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "ChunkCache.h"
#include "Status.h"
#include "Types.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace teravox
{

class HDF5Dataset;

/// Levels of refinement whose cells lie in boxes, one array per level with box after box in it.
/// Level 0 is the coarsest; where a finer one has no box, the finest cell that there is stands for
/// its children.
/// Thread: immutable once it was made.
struct AMRBoxes
{
  struct Box
  {
    Int3 Low{ 0, 0, 0 }; ///< first cell, counted from the domain's, in cells of its level
    Int3 Size{ 0, 0, 0 };
    std::int64_t First = 0; ///< its first cell in the array; x fastest
  };
  struct Level
  {
    Int3 Ratio{ 1, 1, 1 }; ///< cells of this level along the edges of one of level 0
    std::vector<Box> Boxes;
  };
  /// Voxels low...high-1 of a level in memory.
  struct Region
  {
    Int3 Low{ 0, 0, 0 };
    Int3 High{ 0, 0, 0 };
    std::byte* Voxels = nullptr; ///< the one at Low; x fastest
    std::ptrdiff_t RowBytes = 0; ///< from (x, y, z) to (x, y+1, z)
    std::ptrdiff_t SliceBytes = 0;
  };

  std::vector<Level> Levels;

  /// Fills a region of a level from its own boxes, and what they leave open from coarser ones. What
  /// no box covers is NaN, or 0 where cells are integers. `arrays`: of the levels. `read` reads one
  /// chunk of an array; at most one chunk is held, and none while it is called. Reads no level that
  /// isn't needed. Time: boxes of the levels, and voxels.
  /// Errors: those of `read`.
  Status Fill(int level, const Region& region, const std::vector<const HDF5Dataset*>& arrays,
    const std::function<Result<ChunkPointer>(int level, const Int3& chunk)>& read) const;
};

} // namespace teravox
