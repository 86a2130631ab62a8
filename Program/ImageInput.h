// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"

#include <string>
#include <vtkAlgorithm.h>
#include <vtkSmartPointer.h>

namespace teravox::program
{

/// The reader for a file, by its extension: NIfTI, MetaImage, NRRD, VTK's own, TIFF, HDF5.
/// Errors: no such file, an extension without a reader, a file that its reader refuses.
Result<vtkSmartPointer<vtkAlgorithm>> OpenImage(
  const std::string& fileName, const std::string& dataset);

} // namespace teravox::program
