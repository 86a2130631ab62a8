// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"
#include "Types.h"
#include "VoxelReader.h"

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

/// What the headers of image files share.
namespace teravox::headers
{

/// A descriptor of a regular file, open for reading; the caller closes it. Errors: NotFound,
/// InputOutput; Unsupported for what isn't a regular file: reading of a pipe may never end.
Result<int> OpenRegular(const std::string& fileName);

/// The first bytes of a file, at most `most`. Errors: as OpenRegular().
Result<std::string> Begin(const std::string& fileName, std::size_t most);

/// "'FILE' WHAT.", as Corrupt or Unsupported.
Status Corrupt(const std::string& fileName, const std::string& what);
Status Unsupported(const std::string& fileName, const std::string& what);

std::string Trimmed(const std::string& text);
std::string Lower(std::string text);
std::vector<std::string> Words(const std::string& text);

/// A name in a header is relative to the header's folder.
std::string Beside(const std::string& header, const std::string& name);
/// Names of numbered files from a pattern with one %d, %3d, %03d or the like; nothing if there is
/// another thing to be printed in it, or too many files.
std::optional<std::vector<std::string>> Numbered(
  const std::string& pattern, std::int64_t first, std::int64_t last, std::int64_t step);

/// Spacing and direction of a volume whose axes have these steps in the world.
/// Errors: Corrupt if they are of no length or lie in a plane, or if the origin is nowhere.
Status TakeSteps(const std::string& fileName, const std::array<Double3, 3>& steps,
  VoxelReader::Description& volume);

} // namespace teravox::headers
