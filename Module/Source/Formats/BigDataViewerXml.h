// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"
#include "Types.h"

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

namespace teravox
{

/// What a BigDataViewer XML file (SpimData) says of an HDF5 file beside it.
/// Source: bdv-core, XmlIoSpimDataMinimal and XmlIoHdf5ImageLoader.
struct BigDataViewerXml
{
  struct Setup
  {
    std::string Name;
    std::optional<Double3> VoxelSize;
    std::string Unit;
  };
  /// Rows of three by four: from the indices of voxels to the world.
  using Affine = std::array<double, 12>;

  std::string HDF5File; ///< with the XML file's folder before it, if it is relative
  std::map<std::int64_t, Setup> Setups;
  /// By time point and set-up; transforms are multiplied in the order of the file, so that the last
  /// one is applied first.
  std::map<std::pair<std::int64_t, std::int64_t>, Affine> Registrations;

  /// Errors: NotFound, InputOutput, ResourceExhausted (above 64 MiB), Corrupt (not XML, no numbers
  /// where there must be), Unsupported (images that aren't in HDF5).
  static Result<BigDataViewerXml> Read(const std::string& fileName);

  /// Does the file begin as XML does?
  static bool IsXml(const std::string& fileName);
};

} // namespace teravox
