// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Commands.h"
#include "Import/ImageVolume.h"
#include "Status.h"

#include <cstdint>
#include <string>
#include <vtkAlgorithm.h>
#include <vtkSmartPointer.h>

namespace teravox::program
{

/// What `convert` reads: a reader of our own, which streams, or one of VTK's.
struct ImageInput
{
  ImageVolume Volume;                     ///< without a reader, its files are those that are known
  vtkSmartPointer<vtkAlgorithm> Pipeline; ///< if there is no reader
};

/// By extension: NIfTI, MetaImage, NRRD, MRC, TIFF, PNG, JPEG and voxels without a header by our
/// own readers, VTK's formats and whatever ours leave by VTK's; HDF5. `array`: of a parallel VTK
/// image, empty for its active scalars. A folder is a DICOM series, else
/// a stack of TIFF files, else of other pictures; so is a pattern. Errors: no such file, an
/// extension without a reader, a file that its reader refuses; ResourceExhausted, if VTK reads the
/// file as a whole and half of `memory` bytes isn't enough.
Result<ImageInput> OpenImage(const VolumeOptions& options, const ImportOptions& import,
  const std::string& array, std::uint64_t memory);

/// Is it voxels without a header, by its extension or because the user says so?
bool IsRaw(const VolumeOptions& options, const ImportOptions& import);

/// Is it by its extension an HDF5 file, or an XML file that names one?
bool IsHDF5Name(const std::string& fileName);

} // namespace teravox::program
