// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"
#include "VoxelReader.h"

#include <cstdint>
#include <memory>
#include <string>

namespace teravox
{

/// VolVis's volumes of bytes (.slc), plain or as runs, slice by slice; what vtkSLCReader reads: the
/// same voxels in the same order, with the spacing of the file, whose unit isn't looked at. Its
/// pictures of itself are left out. Errors: NotFound, InputOutput, Corrupt; Unsupported (voxels of
/// other than 8 bits, other kinds of compression).
Result<std::shared_ptr<VoxelReader>> OpenSLC(const std::string& fileName, std::uint64_t cacheBytes);

} // namespace teravox
