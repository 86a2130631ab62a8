// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"

#include <vtkDataArray.h>
#include <vtkSmartPointer.h>

namespace teravox
{

/// An array for so many voxels along each axis, x fastest, named and typed as the volume, its
/// values not set. Null if the memory can't be had: vtkDataArray::SetNumberOfTuples() throws then
/// in one version of VTK, and ends the program in another.
vtkSmartPointer<vtkDataArray> NewVoxelArray(const VolumeInfo& info, const Int3& size);

} // namespace teravox
