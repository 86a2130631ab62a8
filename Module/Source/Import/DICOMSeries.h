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

/// A series of DICOM slices, one file each, read slice by slice.
class DICOMSeries
{
public:
  struct Request
  {
    std::vector<std::string> Files; ///< in any order; those that aren't DICOM are left out
    std::string Series;             ///< its UID; empty: there is only one
    std::uint64_t CacheBytes = std::uint64_t{ 64 } << 20;
  };

  static bool IsDICOM(const std::string& fileName);

  /// Slices are sorted along the normal of their planes, the first with the least position; rows
  /// and columns are as stored, so that direction and origin are those of the patient's space (mm).
  /// Values are rescaled (slope and intercept): to integers where both are such, else to f32.
  /// Errors: NotFound; Corrupt (cut off, of different sizes); InvalidArgument (several series, or
  /// not the one asked for); Unsupported (compressed or big-endian pixels, several frames, slices
  /// that aren't evenly spaced: says where).
  static Result<std::shared_ptr<VoxelReader>> Open(const Request& request);
};

} // namespace teravox
