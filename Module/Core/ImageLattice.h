// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace teravox
{
/// Pixels of a picture in the order in which they are decided on: a lattice of rays is cast first,
/// then the pixels between them are interpolated where that is good enough, stage by stage
/// (M. Levoy, "Volume rendering by adaptive refinement", The Visual Computer 6, 1990; with the
/// lattice made denser by the square root of two at a time, its centres first and its edges then).
/// Stage s, from the first down to 1, halves the area per ray: an even one adds the centres of a
/// lattice of LatticeEdge(s) pixels, an odd one the middles of its edges.
constexpr int MostLatticeStages = 4;

/// When a pixel may be interpolated.
struct LatticeLimits
{
  double Error = 0;    ///< most that it is estimated to err, per channel
  double Missed = 0;   ///< most that something between the rays which they don't meet may add
  double Distance = 0; ///< most that the nearest ray may pass by, in voxels of the level drawn
};

// Compiled into each kernel by itself.
namespace
{
/// Pixels between the corners of the lattice that a stage refines, a power of two.
constexpr int LatticeEdge(int stage)
{
  return 1 << ((stage + 1) / 2);
}

/// Whether the ray of a pixel is cast before `stage`. Stage 0: all are.
constexpr bool IsInLattice(int stage, int x, int y)
{
  const int edge = LatticeEdge(stage);
  const int half = edge / 2;
  const bool corner = x % edge == 0 && y % edge == 0;
  return stage == 0 || corner || (stage % 2 == 1 && x % edge == half && y % edge == half);
}
} // namespace

} // namespace teravox
