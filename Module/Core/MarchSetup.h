// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

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

/// MarchParameters::Transfer.
MarchParameters::Vec TransferParameters(const TransferTable& table);

/// The tiles (x | y << 16) that meet a rectangle of pixels: left, bottom, right, top, the last two
/// exclusive.
std::vector<std::uint32_t> TilesOf(const std::array<int, 4>& rectangle);

} // namespace teravox
