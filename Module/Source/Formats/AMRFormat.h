// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "HDF5File.h"
#include "VolumeDescription.h"

namespace teravox
{

/// VTKHDF of the type OverlappingAMR: boxes of cells, level by level (AMRBoxes.h), as a pyramid.
/// The finest level is level 0 of the pyramid. Cell data only; the active array first, others as
/// channels. What no box covers is NaN, and an error where cells are integers.
/// Errors: Corrupt, Unsupported (point data, steps), NotFound, InvalidArgument; each naming file
/// and object.
Result<VolumeDescription> DescribeAMR(const HDF5File& file, const VolumeRequest& request);

} // namespace teravox
