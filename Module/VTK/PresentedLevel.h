// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"

#include <array>

namespace teravox
{

/// One level of a pyramid in the terms of a vtkImageData. Thread: immutable value.
///
/// Level 0 keeps the extent of the data; coarser levels begin at 0. For cell data the extent counts
/// points, one more than voxels along each axis, and the origin is a corner instead of a centre.
struct PresentedLevel
{
  std::array<int, 6> WholeExtent{ 0, -1, 0, -1, 0, -1 };
  Double3 Origin{ 0, 0, 0 };
  Double3 Spacing{ 1, 1, 1 };
  std::array<double, 9> Direction{ 1, 0, 0, 0, 1, 0, 0, 0, 1 };
  bool CellData = false;

  /// Voxels of a level: the first, counted from 0, and how many along each axis.
  struct Box
  {
    Int3 First{ 0, 0, 0 };
    Int3 Size{ 0, 0, 0 };
  };

  /// Errors: an extent beyond the 32 bits that VTK has for it.
  static Result<PresentedLevel> Make(const VolumeInfo& info, int level);

  /// The voxels of an extent that lies inside WholeExtent; of the empty extent none.
  Box VoxelsOf(const int extent[6]) const;
};

} // namespace teravox
