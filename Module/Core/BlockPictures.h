// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "MarchParameters.h"

#include <cstddef>
#include <cstdint>
#include <vector>

// What blocks of a sort-last rendering know of each other's pictures.
namespace teravox
{

/// Whether opacities along a ray add up: pictures of blocks, one behind the other, can be blended.
constexpr bool AddsUpOpacity(BlendKind kind)
{
  return kind == BlendKind::Composite || kind == BlendKind::Isosurface || kind == BlendKind::Slice;
}

/// Edge of the squares of pixels that ranks tell each other of.
constexpr int OpacityTileEdge = 8;

/// Tiles along an axis of so many pixels.
constexpr int OpacityTilesAlong(int pixels)
{
  return (pixels + OpacityTileEdge - 1) / OpacityTileEdge;
}

/// The least opacity of each tile of a picture, rows from the bottom. `colors`: RGBA of width x
/// height pixels.
std::vector<float> LeastOpacities(const std::vector<float>& colors, int width, int height);

/// What lies in front of a block hides: per tile the opacity of all blocks that are listed in
/// `order` (front to back) ahead of `block`. `ofAll`: the tiles of each block, one block after the
/// other. Nothing lies in front of a block that isn't listed.
/// Requires: ofAll holds `tiles` values for each block in `order`.
std::vector<float> OpacityInFront(
  const std::vector<float>& ofAll, std::size_t tiles, const std::vector<int>& order, int block);

/// Per pixel (0 or 1) whether its tile is hidden: both opacities in front leave no more than
/// `share`. `confirmed`: empty: the first decides alone. Empty if no tile is hidden, or there
/// aren't as many as the picture has.
std::vector<std::uint8_t> HiddenPixels(const std::vector<float>& suspected,
  const std::vector<float>& confirmed, float share, int width, int height);

/// Floats per pixel of what rays gather, see JoinRays().
int GatheredChannels(BlendKind blend, int components);

/// Adds what a ray has gathered in another block, in blend modes where the order doesn't matter:
/// maximum, minimum, average, additive. Of voxels with one component four floats: value, whether
/// there is one, length; of several what each component holds, for averages followed by the
/// lengths. `dependent`: of components of which the last decides.
void JoinRays(
  BlendKind blend, int components, const float* more, float* ray, bool dependent = false);

} // namespace teravox
