// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"
#include "TexelFormat.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace teravox
{

/// Texels of one brick, and what the slot table holds for it.
struct ConvertedBrick
{
  std::vector<std::uint8_t> Bytes; ///< 8- or 16-bit texels or floats, by the format
  std::vector<std::uint8_t> Cells; ///< least and largest texel of each cell, x fastest
  float OffsetHigh = 0;
  float OffsetLow = 0;
  float Scale = 1;
};

/// Conversion before an atlas sees the data (OpenGL's drivers convert ten times slower).
/// Cells are of CellEdge^3 voxels inside the border; their ranges include the voxels that linear
/// interpolation reaches from them, and leave NaN out.
/// Requires: a brick of one component, and the format of its type.
ConvertedBrick ConvertBrick(const Brick& brick, const TexelFormat& format);

/// One component of a brick, as a brick of its own.
std::shared_ptr<Brick> TakeComponent(const Brick& brick, int component);

/// The same for each component of a brick of any number of them: each is relative to a value of its
/// own, and has ranges of its own. Behind them, where the brick has one, its mask as texels of its
/// values; cells of which nothing is in the mask have no range then, as if they had no values.
std::vector<ConvertedBrick> ConvertComponents(const Brick& brick, const TexelFormat& format);

} // namespace teravox
