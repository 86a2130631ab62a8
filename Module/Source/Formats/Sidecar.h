// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "VolumeDescription.h"

#include <memory>
#include <optional>
#include <string>

namespace teravox
{

/// A pyramid beside a file that has one level: `FILE.teravox.h5`. The file itself is never written
/// to. Attributes of the sidecar's /Pyramid say what it was made of: SourceSize (bytes), SourceTime
/// (last change, nanoseconds), SourcePath, SourceChannel, SourceTimePoint.
namespace sidecar
{

std::string NameFor(const std::string& fileName);

/// Writes those attributes into a finished pyramid. Errors: NotFound (the file); InputOutput.
Status Mark(
  const std::string& pyramidName, const std::string& fileName, const VolumeRequest& request);

/// The sidecar, if there is one of this very version of the file and this volume. Else `note` says
/// why one that is there isn't used.
std::optional<OpenedVolume> Find(
  const std::string& fileName, const VolumeRequest& request, std::string& note);

} // namespace sidecar
} // namespace teravox
