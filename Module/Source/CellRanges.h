// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickGeometry.h"
#include "RangeUnion.h"

#include <functional>
#include <vector>

namespace teravox
{

/// Answers exact range queries on a volume of voxels: minimum and maximum of 8^3 cells, of 8^3 such
/// cells, and so on; only the voxels at the faces of a box are looked at again.
/// Thread: immutable once made; Query() as thread-safe as the scan function.
class CellRanges
{
public:
  /// Range of the voxels of a box that isn't empty.
  using ScanFunction = std::function<ValueRange(const VoxelBox&)>;

  static constexpr int CellEdge = 8;

  CellRanges() = default;
  /// Looks at each voxel once, with OpenMP.
  CellRanges(const Int3& dimensions, const ScanFunction& scan);

  /// Range of a box inside the volume; Void() for an empty one.
  ValueRange Query(const VoxelBox& box, const ScanFunction& scan) const;
  std::uint64_t MemoryUsed() const;
  /// MemoryUsed() of the cells of a volume; saturates.
  static std::uint64_t BytesFor(const Int3& dimensions);

private:
  struct Grid
  {
    Int3 Dimensions{ 0, 0, 0 };
    std::int64_t Edge = 1; ///< of a cell, in voxels
    std::vector<ValueRange> Cells;
  };

  void Descend(int grid, const VoxelBox& box, const VoxelBox& cells, const ScanFunction& scan,
    RangeUnion& range) const;

  Int3 Dimensions{ 0, 0, 0 };
  std::vector<Grid> Grids; // the finest first
};

} // namespace teravox
