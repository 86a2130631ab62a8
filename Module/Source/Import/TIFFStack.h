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

/// Slices in TIFF files, one file with many pages or many files, each with one, or where OME-XML
/// says; read and decoded slice by slice, whatever their compression.
class TIFFStack
{
public:
  struct Request
  {
    std::vector<std::string> Files; ///< in the order of the slices
    int Channel = 0;                ///< of pages that ImageJ wrote
    int TimePoint = 0;              ///< of such
    std::uint64_t CacheBytes = std::uint64_t{ 64 } << 20;
  };

  /// Row 0 is the upper one of the picture, as in VTK's reader. Spacing is that of the resolution
  /// (in mm, or in ImageJ's unit), along z ImageJ's, else that of x; 1 where there is none.
  /// Thumbnails are left out. Pixels of a palette become its colours, u8: one value where the first
  /// palette is grey, else three. Errors: NotFound, InputOutput, Corrupt; InvalidArgument (no such
  /// channel, slices of different sizes); Unsupported (planes, mirrored pictures, samples of other
  /// than 8, 16, 32 or 64 bits, or, with a palette, 1, 2, 4, 8 or 16 bits). `others`: set to the
  /// files beside those of the request that are read, or were, for their names in OME-XML.
  static Result<std::shared_ptr<VoxelReader>> Open(
    const Request& request, std::vector<std::string>& others);
};

} // namespace teravox
