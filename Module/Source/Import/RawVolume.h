// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"
#include "VoxelReader.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace teravox
{

/// A volume whose voxels lie in files as they are in memory, x fastest, or as one compressed stream
/// of that. What headers of MetaImage, NRRD, NIfTI and MRC describe, and users for files without
/// one.
struct RawVolume
{
  VoxelReader::Description Volume;
  /// One with all voxels, or several with equally many slices each.
  std::vector<std::string> Files;
  std::int64_t Offset = 0; ///< bytes before the voxels of each file; -1: the voxels end the file
  bool BigEndian = false;
  bool Compressed = false; ///< as zlib or gzip stream; `Before` bytes of it come before the voxels
  std::int64_t Before = 0;
  bool Half = false; ///< floats of 16 bits in the file, which are read as ones of 32
  bool Text = false; ///< as numbers that are written out, in one file

  /// From now on voxels are read when they are asked for: as they are, or, of compressed data or
  /// text, slices, of which `cacheBytes` are kept. Errors: InvalidArgument (numbers that can't be),
  /// NotFound, Corrupt (a file is too short, says by how much), InputOutput.
  static Result<std::shared_ptr<VoxelReader>> Open(
    const RawVolume& volume, std::uint64_t cacheBytes);
};

/// MetaImage: .mha, or .mhd with its file or files. Direction and position are taken.
/// Binary or text. Errors: NotFound, Corrupt; Unsupported (more than three axes, 64-bit integers).
Result<RawVolume> ReadMetaImageHeader(const std::string& fileName);

/// NRRD: .nrrd, or .nhdr with its file or files; raw, gzip and text. Directions and origin are
/// taken in the space of the file; up to four values along a first axis without a direction are
/// components. Errors: as above; Unsupported also for other encodings.
Result<RawVolume> ReadNRRDHeader(const std::string& fileName);

/// NIfTI 1 and 2: .nii, .nii.gz, or .hdr with its .img; of a series the time point. The place of
/// the voxels is that of the sform, else of the qform. Values are those stored: the header's slope
/// is left out, as in VTK. Errors: as above; InvalidArgument (no such time point).
Result<RawVolume> ReadNIfTIHeader(const std::string& fileName, int timePoint);

/// MRC and CCP4 (MRC2014, with what IMOD adds), also compressed by gzip; of a stack of volumes the
/// one that `timePoint` says. Columns, rows and sections stay what they are: the direction says
/// along which axes of the cell they lie. Lengths are in Angstrom; the first voxel lies at ORIGIN,
/// or, where that is 0, where NXSTART and the others put it. Bytes are signed unless IMOD says
/// otherwise. Errors: as above; Unsupported (complex numbers, 4 bits).
Result<RawVolume> ReadMRCHeader(const std::string& fileName, int timePoint);
/// By its word "MAP " and the stamp of its byte order.
bool IsMRC(const std::string& fileName);

/// Legacy VTK: structured points whose first array are scalars of up to four components, binary or
/// ASCII. Errors: NotFound, Corrupt; Unsupported (all else that such files hold).
Result<RawVolume> ReadLegacyVTKHeader(const std::string& fileName);

} // namespace teravox
