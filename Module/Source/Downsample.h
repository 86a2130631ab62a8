// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Types.h"

namespace teravox
{

enum class DownsampleMode
{
  Average, ///< integers rounded to nearest, halves upwards; NaN left out, all NaN gives NaN
  Mode     ///< most frequent value, the smallest of equally frequent ones; NaN as above
};

/// Combines groups of ratio[0] x ratio[1] x ratio[2] voxels (at most 4096) into one, each component
/// by itself; a group that is cut off by the end of the input combines what it has.
/// Requires: outSize == ceil(inSize / ratio). Parallel with OpenMP.
void Downsample(ScalarType type, int components, DownsampleMode mode, const Int3& ratio,
  const void* in, const Int3& inSize, void* out, const Int3& outSize);

} // namespace teravox
