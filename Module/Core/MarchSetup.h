// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "ImageLattice.h"
#include "MarchParameters.h"
#include "TransferTable.h"

#include <array>
#include <cstdint>
#include <vector>

namespace teravox
{

/// MarchParameters::Step: how the tolerance of a picture is divided. `sampleDistance` in world
/// units, for a tolerance of 0. `looseness`: factor of the tolerance of pieces while frames must be
/// fast.
MarchParameters::Vec StepParameters(double sampleDistance, double tolerance, double looseness);

/// Up to a tolerance of 1/255 no voxel hides between rays: what one adds to the field reaches a
/// voxel far. A larger one allows for more, up to two voxels.
LatticeLimits LatticeLimitsOf(double tolerance, double looseness);
/// Of frames that must be fast: all between rays that meet the same level of the volume is
/// interpolated, however different they are.
LatticeLimits GuessedLattice();

/// MarchParameters::Transfer.
MarchParameters::Vec TransferParameters(const TransferTable& table);

/// The stage (ImageLattice.h) at which a picture begins whose pixels may be interpolated: the
/// largest up to `most` at which rays through the middle of the volume pass by the pixels between
/// them near enough; 0 if there is none, or if cropping cuts the rays into stretches.
int FirstLatticeStage(const MarchParameters& p, const IntervalParameters& intervals,
  const LatticeLimits& limits, int most);

/// The tiles (x | y << 16) that meet a rectangle of pixels: left, bottom, right, top, the last two
/// exclusive.
std::vector<std::uint32_t> TilesOf(const std::array<int, 4>& rectangle);

} // namespace teravox
