// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "HDF5File.h"
#include "Status.h"
#include "Types.h"

#include <array>
#include <memory>
#include <string>
#include <vector>

namespace teravox
{

/// What a file says about its volume, besides the voxels' type and number. Values, checked.
/// Thread: immutable.
struct PyramidMetadata
{
  std::vector<std::string> LevelPaths; ///< absolute, level 0 first
  std::vector<Int3> Factors;           ///< cumulative, per level
  std::string StatisticsPath;          ///< empty: there are none
  bool Labels = false;
  bool CellData = false;
  std::string ArrayName = "scalars";
  Double3 Origin{ 0, 0, 0 }; ///< centre of voxel (0,0,0)
  Double3 Spacing{ 1, 1, 1 };
  std::array<double, 9> Direction{ 1, 0, 0, 0, 1, 0, 0, 0, 1 };
  Int3 ExtentStart{ 0, 0, 0 };
  ValueRange Range;
  std::vector<double> Histogram;

  /// The pyramid of a file.
  /// Errors: NotFound (no pyramid); Corrupt (damaged, contradictory); Unsupported (newer version).
  static Result<PyramidMetadata> Read(const HDF5File& file);

  /// The multiscales attribute (JSON) of these factors and spacings.
  std::string MultiscalesText() const;

  /// Errors: InvalidArgument, with a sentence about spacing, origin or direction.
  static Status CheckGeometry(
    const Double3& origin, const Double3& spacing, const std::array<double, 9>& direction);

  /// direction * (spacing * index): from VTK's origin to the point with this (fractional) index.
  static Double3 Offset(
    const std::array<double, 9>& direction, const Double3& spacing, const Double3& index);
};

} // namespace teravox
