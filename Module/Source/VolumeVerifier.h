// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "HDF5BrickSource.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace teravox
{

/// What VerifyVolume() found.
struct VerifyReport
{
  std::uint64_t Bricks = 0;           ///< looked at
  std::uint64_t UnreadableBricks = 0; ///< chunks that are missing, damaged or have a wrong checksum
  std::uint64_t WrongRanges = 0;      ///< bricks with a voxel outside of their range
  /// One sentence per fault: per level for its content, per brick for the rest (the first hundred).
  std::vector<std::string> Findings;
};

/// Reads every brick of every level, and compares: each with its value range; each level with the
/// level before, made coarser as levels are (average, or mode for labels). A level that differs is
/// compared with what is usually wrong: moved by a voxel, decimated instead of averaged, the
/// outermost voxels averaged with zeros. Voxels that a level lacks at its end aren't compared.
/// Differences of one (integers) or 1e-5 of the largest
/// magnitude (floats) are rounding. Memory: about (factor + 1)^3 bricks.
/// `progress` gets the fraction done; false cancels.
/// Errors: Cancelled. What is wrong with the volume is no error but a finding.
Status VerifyVolume(
  HDF5BrickSource& source, VerifyReport& report, const std::function<bool(double)>& progress = {});

} // namespace teravox
