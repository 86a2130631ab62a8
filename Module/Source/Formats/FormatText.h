// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "HDF5File.h"
#include "Status.h"
#include "Types.h"
#include "VolumeDescription.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

/// What the layouts share: sentences, numbers in texts, factors between levels.
namespace teravox::formats
{

/// "The file 'a.ims' is damaged: WHAT."
Status Corrupt(const HDF5File& file, const std::string& what);

/// "1 level", "2 levels".
std::string Counted(std::size_t n, const std::string& what);
std::string Text(const Int3& v);
std::string Text(const Double3& v);

/// The numbers of a text, separated by blanks or commas; nothing if there is anything else in it,
/// or more than `limit`.
std::optional<std::vector<double>> ParseNumbers(const std::string& text, std::size_t limit);
/// A whole number from 0 to `most` without sign or blanks.
std::optional<std::int64_t> ParseIndex(const std::string& text, std::int64_t most);
/// The number behind a prefix, "TimePoint 12"; nothing for other names.
std::optional<std::int64_t> IndexBehind(const std::string& name, const std::string& prefix);
/// Names with such a number, in its order; gaps are kept out of the count.
std::vector<std::int64_t> IndicesBehind(
  const std::vector<std::string>& names, const std::string& prefix);

/// Checks the request against the number of channels and time points.
/// Errors: InvalidArgument; Unsupported (more than four channels at once).
Status CheckRequest(
  const HDF5File& file, const VolumeRequest& request, std::size_t channels, std::size_t timePoints);
/// The channels of a request: one, or all.
std::vector<std::size_t> ChannelsOf(const VolumeRequest& request, std::size_t channels);

/// How much coarser an axis of `coarse` voxels is than one of `fine`: the power of two, else the
/// least number, by which `fine` divided and rounded either way is `coarse`; 0: none.
std::int64_t FactorBetween(std::int64_t fine, std::int64_t coarse);

/// Factors of numbers such as a file has them for x, y, z. Errors: nothing where one isn't a whole
/// number from 1 to 2^31.
std::optional<Int3> WholeFactors(const double* xyz);

/// The first group that has a reason to be taken, breadth first, at most 256 of them; each once,
/// however many links lead to it.
std::optional<std::string> FindGroup(const HDF5File& file,
  const std::function<std::optional<std::string>(const std::string& group)>& reasonOf,
  std::string& reason);

/// The same for a request: the reason of the group that is named, else of the first one that has
/// one.
std::optional<std::string> RecogniseGroup(const HDF5File& file, const std::string& path,
  const std::function<std::optional<std::string>(const std::string& group)>& reasonOf);

/// A path from the root, with or without its slash before it.
std::string Absolute(const std::string& path);

/// True for finite numbers above zero.
bool IsSpacing(const Double3& spacing);

/// Largest number of links of a group that is looked at.
inline constexpr std::size_t MostChildren = 1 << 17;

} // namespace teravox::formats
