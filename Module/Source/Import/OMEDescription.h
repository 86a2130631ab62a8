// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"
#include "Types.h"

#include <cstdint>
#include <string>
#include <vector>

namespace teravox
{

/// What the OME-XML in the first page of an OME-TIFF, or in the companion that it names, says of
/// its first image: which page of which file has which slice of which channel and time point, and
/// how large voxels are (OME schema 2016-06, and older ones). Thread: a value.
struct OMEDescription
{
  std::int64_t Channels = 1;
  std::int64_t Times = 1;
  /// Physical sizes, in the unit of x, usually micrometres; 1 where nothing is said.
  Double3 Spacing{ 1, 1, 1 };
  /// The file itself, then others beside it that have slices of the chosen channel and time point.
  std::vector<std::string> Files;
  struct Page
  {
    std::size_t File = 0;     ///< of Files
    std::int64_t Number = -1; ///< directory of the file, counted from 0
  };
  std::vector<Page> Pages; ///< of the slices
  /// The file that has the XML, where that isn't the first page; else empty.
  std::string Companion;

  static bool IsOME(const std::string& description);

  /// `samples`: values of a pixel, which count as channels in OME. Errors: Corrupt;
  /// InvalidArgument (there is no such channel or time point); NotFound, InputOutput (a companion,
  /// or another file that slices lie in).
  static Result<OMEDescription> Read(const std::string& fileName, const std::string& description,
    int samples, int channel, int timePoint);
};

} // namespace teravox
