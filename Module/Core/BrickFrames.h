// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickKey.h"
#include "PyramidLayout.h"
#include "ViewGeometry.h"

#include <array>
#include <vector>

namespace teravox
{

/// An end of a line: OpenGL's clip coordinates and a colour.
struct FrameVertex
{
  std::array<float, 4> Clip{};
  std::array<float, 3> Color{};
};

/// Lines of one brick: its 12 edges, two vertices each.
constexpr int FrameVerticesPerBrick = 24;

/// The colour of a level's frames: white, yellow, cyan, magenta, green, red, blue, orange for the
/// levels 0 to 7, and again.
std::array<float, 3> FrameColor(int level);

/// The edges of bricks as lines of a view, as far as the bricks lie in what is drawn of the volume
/// and in its block. Coarse levels first, so that lines of finer ones lie over them; the order of
/// `bricks` doesn't matter.
std::vector<FrameVertex> BrickFrames(
  const PyramidLayout& layout, const ViewInput& view, std::vector<BrickKey> bricks);

} // namespace teravox
