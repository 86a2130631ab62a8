// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "VolumeEngine.h"

#include <array>
#include <cstdint>
#include <vector>

namespace teravox
{

/// What hardware selection asks for: the points, or the cells, that are seen.
enum class VoxelIdKind
{
  Points,
  Cells
};

/// How many ids there are. Those of the image of level 0, x fastest, from 0 on.
/// `dimensions`: voxels of level 0; `cellData`: voxels are cells, else points.
std::int64_t NumberOfIds(const Int3& dimensions, bool cellData, VoxelIdKind kind);

/// Per pixel the id of what its ray met, as three bytes from bit `shift` on, and an alpha of 255;
/// all 0 where it met nothing. `hits`: of all rays of the picture of `request`. The point is the
/// nearest one, the cell that in which the hit lies.
std::vector<std::array<std::uint8_t, 4>> EncodeIds(const FirstHits& hits,
  const FrameRequest& request, const Int3& dimensions, VoxelIdKind kind, int shift);

} // namespace teravox
