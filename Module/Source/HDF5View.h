// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Types.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace teravox
{

/// How a volume lies in a dataset of any rank. Axes are counted as HDF5 does, 0 varies slowest.
struct HDF5View
{
  static constexpr std::size_t MaximumRank = 8;

  /// The axes of x, y and z; -1: there is none, the volume has one voxel along it.
  std::array<int, 3> Spatial{ -1, -1, -1 };
  /// The axis of the components; -1: there is none.
  int Component = -1;
  /// Where the volume lies along all other axes (time, channel).
  std::array<std::int64_t, MaximumRank> Index{};
  /// Signed integers hold the bits of unsigned ones.
  bool Unsigned = false;
  /// The axes follow from the rank instead: (y,x), (z,y,x) or (z,y,x,component).
  bool Automatic = true;
  /// Boxes of voxels in which a dataset without chunks is read. 0: of 64 along that axis.
  Int3 Box{ 0, 0, 0 };
};

} // namespace teravox
