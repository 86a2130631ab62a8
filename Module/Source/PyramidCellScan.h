// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "PyramidCells.h"
#include "Types.h"

#include <cstddef>
#include <cstdint>

namespace teravox
{

/// Finds the statistics of a box of voxels of a level, one row of cells at a time.
/// Thread: any, for different rows.
class PyramidCellScan
{
public:
  /// The box starts at a multiple of the cell edge and ends at one, or with the level, whose
  /// dimensions and spacing are given. `cells` and `voxels` (dense, x fastest) outlive this object.
  PyramidCellScan(PyramidCells& cells, const std::byte* voxels, const Int3& start, const Int3& size,
    const Int3& dimensions, const Double3& spacing);

  /// Rows of cells, y fastest.
  std::int64_t Rows() const { return this->Cells.Size[1] * this->Cells.Size[2]; }
  /// Rows for which the first `slices` slices of the box suffice, and none beyond.
  std::int64_t RowsOf(std::int64_t slices) const;

  /// Ranges and gradients of the cells of a row. Differences across faces of the box inside the
  /// level are left out. Throws std::bad_alloc.
  void Scan(std::int64_t row) const;

private:
  template <typename T>
  void ScanTyped(std::int64_t row) const;

  PyramidCells& Cells;
  const std::byte* Voxels;
  Int3 Start;
  Int3 Size;
  Int3 Dimensions;
  Double3 Spacing;
};

} // namespace teravox
