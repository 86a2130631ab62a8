// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"

#include <cstdint>
#include <string>

namespace teravox::program
{

/// Writes the pyramid of a cube of u16 with data in two opposite corners of 1/16 of its edge, all
/// else empty: 8192 voxels per axis are 1 TiB, and a few MiB on disk. What is in the corners
/// depends on the place in the cube only: all sizes look the same from the same place. `edge`:
/// voxels per axis, a multiple of 128.
Status WriteSparseFile(const std::string& fileName, std::int64_t edge);

} // namespace teravox::program
