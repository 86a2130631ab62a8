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

} // namespace teravox
