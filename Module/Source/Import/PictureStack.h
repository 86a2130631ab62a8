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

/// Slices in PNG, JPEG, PNM, BMP or TGA files, one in each; read and decoded slice by slice.
class PictureStack
{
public:
  struct Request
  {
    std::vector<std::string> Files; ///< in the order of the slices
    std::uint64_t CacheBytes = std::uint64_t{ 64 } << 20;
  };

  /// By the first bytes of the file; TGA by its name.
  static bool IsPicture(const std::string& fileName);

  /// Row 0 is the lower one of the picture, as in VTK's readers of these formats; components are
  /// 8-bit or 16-bit numbers: grey, grey and alpha, RGB, RGBA, also from palettes (of BMP and TGA
  /// grey ones are grey) and transparent colours. Spacing is that of the first file's resolution in
  /// mm, along z as along x; 1 where it has none. All headers are read. Errors: as
  /// PictureFile::Open() with the name of the file; InvalidArgument (no files, pictures of
  /// different sizes, types or formats).
  static Result<std::shared_ptr<VoxelReader>> Open(const Request& request);
};

} // namespace teravox
