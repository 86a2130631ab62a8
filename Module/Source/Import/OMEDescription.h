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

/// What the OME-XML in the first page of an OME-TIFF says of its first image: which page has which
/// slice of which channel and time point, and how large voxels are (OME schema 2016-06, and older
/// ones). Thread: a value.
struct OMEDescription
{
  std::int64_t Channels = 1;
  std::int64_t Times = 1;
  /// Physical sizes, in the unit of x, usually micrometres; 1 where nothing is said.
  Double3 Spacing{ 1, 1, 1 };
  /// Directories of the file, counted from 0, of the slices of the chosen channel and time point.
  std::vector<std::uint32_t> Pages;

  static bool IsOME(const std::string& description);

  /// `samples`: values of a pixel, which count as channels in OME. Errors: Corrupt;
  /// InvalidArgument (there is no such channel or time point; slices lie in other files).
  static Result<OMEDescription> Read(const std::string& fileName, const std::string& description,
    int samples, int channel, int timePoint);
};

} // namespace teravox
