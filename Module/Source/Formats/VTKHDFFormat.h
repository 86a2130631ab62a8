// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "VolumeDescription.h"

namespace teravox
{

/// VTKHDF ImageData, static and with steps: (z,y,x[,component]) or (t,z,y,x[,component]); axes of
/// one voxel may be left out. Source: "VTKHDF File Format Specification" of VTK.
extern const VolumeFormat VTKHDFFormat;

/// Names of the arrays of a group of point or cell data, the active one first.
std::vector<std::string> VTKHDFArrays(const HDF5File& file, const std::string& group);

/// The times of a file's Steps, their numbers where it doesn't tell. Errors: Corrupt.
Status ReadVTKHDFTimes(const HDF5File& file, VolumeDescription& d);

/// What a dataset with a number for each of `steps` steps says of one; `entry` stays if there is no
/// such dataset. Errors: Corrupt for numbers that can't be offsets.
Status ReadVTKHDFStep(const HDF5File& file, const std::string& list, std::size_t steps,
  std::size_t step, std::int64_t& entry);

} // namespace teravox
