// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "RawVolume.h"
#include "VoxelReader.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace teravox
{

/// A volume of image files that is read piece by piece: MetaImage, NRRD, NIfTI, MRC, legacy VTK,
/// stacks of TIFF files or pages, of PNG, JPEG, PNM, BMP or TGA files, series of DICOM files,
/// voxels without a header.
struct ImageVolume
{
  struct Request
  {
    std::string Name;   ///< a file, a folder, or a pattern of files (IsPattern)
    int Channel = 0;    ///< of TIFF stacks, counted from 0
    int TimePoint = 0;  ///< of TIFF stacks, NIfTI and MRC, counted from 0
    std::string Series; ///< UID of a DICOM series; empty: there is only one
    std::uint64_t Memory = std::uint64_t{ 1 } << 30; ///< bytes, of which the reader takes a part
  };

  std::shared_ptr<VoxelReader> Reader;
  std::vector<std::string> Files; ///< that it is made of
  std::uint64_t ReaderBytes = 0;  ///< of memory that the reader takes

  /// Whether Open() reads such files: by extension, by their first bytes (DICOM, PNG, JPEG, MRC),
  /// or because they are several.
  static bool IsImage(const std::string& name);

  /// Errors: NotFound; Unsupported for what isn't read here, other readers may; Corrupt;
  /// InvalidArgument for a channel, time point or series that isn't there; ResourceExhausted if a
  /// slice takes more than half of the memory, or the system has none. Never throws.
  static Result<ImageVolume> Open(const Request& request);
  /// Voxels without a header, or those of any header that was read.
  static Result<ImageVolume> Open(
    const Result<RawVolume>& volume, const std::string& name, std::uint64_t memory);

  /// Tells apart what voxels are made of: `choice` (what was chosen in the files), and of each file
  /// its name, size and time.
  static std::string SourceName(const std::string& choice, const std::vector<std::string>& files);
};

} // namespace teravox
