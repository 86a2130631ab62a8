// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace teravox::program
{

struct BenchVolume;

/// Processor seconds of one bare fetch: the eight voxels around a place, and the value between them
/// in single precision. Measured along rays, a voxel per step, in a brick's worth of voxels of the
/// volume's middle, all processors at once; median of five. A mapper that did nothing but fetch
/// the samples that its picture needs would take that long for each.
double BareFetchSeconds(const BenchVolume& volume);

} // namespace teravox::program
