// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Types.h"

#include <cstddef>
#include <vector>

namespace teravox
{

/// Statistics of a box of cells of one level: what a PyramidFileWriter stores.
/// Thread: value.
struct PyramidCells
{
  ScalarType Type = ScalarType::UInt8;
  int Components = 1;
  Int3 Start{ 0, 0, 0 }; ///< in cells
  Int3 Size{ 0, 0, 0 };
  /// Per cell (x fastest) and component: minimum, maximum in Type. No value: +inf, -inf.
  std::vector<std::byte> Ranges;
  /// Per cell and component.
  std::vector<float> Gradients;

  PyramidCells(ScalarType type, int components, const Int3& start, const Int3& size);
  /// Of a box of voxels that starts at a multiple of the cell edge.
  static PyramidCells Covering(
    ScalarType type, int components, const Int3& start, const Int3& size);

  std::size_t Count() const
  {
    return static_cast<std::size_t>(this->Size[0] * this->Size[1] * this->Size[2]);
  }
  static std::size_t BytesPerCell(ScalarType type, int components)
  {
    return static_cast<std::size_t>(components) * (2 * SizeOf(type) + sizeof(float));
  }
  std::size_t SizeInBytes() const
  {
    return this->Count() * BytesPerCell(this->Type, this->Components);
  }
  /// Index of a cell (relative to Start) and component in Gradients; twice that in Ranges.
  std::size_t Index(const Int3& cell, int component) const
  {
    return static_cast<std::size_t>(
      ((cell[2] * this->Size[1] + cell[1]) * this->Size[0] + cell[0]) * this->Components +
      component);
  }
  /// An upper bound of a gradient magnitude, 0 or more, as it is stored.
  static float UpperFloat(double magnitude);
  /// Void() where the cell has no value.
  ValueRange Range(std::size_t index) const;
  void SetRange(std::size_t index, const ValueRange& range);
  ValueRange TotalRange() const;
  /// True if nothing needs to be stored: all is the fill value and flat.
  bool IsFill(const std::byte* fillValue) const;

  /// The next coarser cells; Start must be a multiple of the factor between them.
  PyramidCells Coarser() const;

  /// Raises the gradients of the cells in [low, high) (relative) to a bound that follows from the
  /// ranges of each cell and its six neighbours. Requires: the neighbours are among the cells here,
  /// unless the level ends.
  void BoundGradients(const Int3& low, const Int3& high, const Double3& spacing);
};

} // namespace teravox
