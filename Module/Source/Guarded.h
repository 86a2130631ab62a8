// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickGeometry.h"
#include "Status.h"

#include <exception>
#include <new>

namespace teravox
{

/// Runs `f`, which returns a Result, and turns exceptions into a status about `key`: the boundary
/// that no exception of a source crosses.
template <typename F>
auto Guarded(const BrickKey& key, const VolumeInfo& info, const F& f) -> decltype(f())
{
  try
  {
    return f();
  }
  catch (const std::bad_alloc&)
  {
    return Status(StatusCode::ResourceExhausted,
      "There was not enough memory to make " + Subject(key, info) + ".");
  }
  catch (const std::exception& error)
  {
    return Status(
      StatusCode::InputOutput, "Making " + Subject(key, info) + " failed: " + error.what());
  }
}

/// Ranges of a box of regions, each by `rangeOf(region key)`; Void() outside of the volume.
/// Errors: InvalidArgument for a level or time step that isn't there, or an unreasonable count.
template <typename F>
Result<std::vector<ValueRange>> RangesOfRegions(
  const BrickKey& first, const Int3& count, const VolumeInfo& info, const F& rangeOf)
{
  constexpr std::int64_t most = std::int64_t{ 1 } << 24;
  if (first.Level >= info.Layout.NumberOfLevels() ||
    first.Time >= static_cast<std::uint32_t>(info.TimeSteps) || count[0] < 0 || count[1] < 0 ||
    count[2] < 0 || count[0] > most || count[1] > most || count[2] > most ||
    count[0] * count[1] > most || count[0] * count[1] * count[2] > most)
  {
    return Status(StatusCode::InvalidArgument,
      "There are no such ranges: " + Subject(first, info) + " and " + std::to_string(count[0]) +
        " x " + std::to_string(count[1]) + " x " + std::to_string(count[2]) + " regions.");
  }
  const Int3 pages = info.Layout.Pages(first.Level, first.PageLevel);
  std::vector<ValueRange> ranges;
  ranges.reserve(static_cast<std::size_t>(count[0] * count[1] * count[2]));
  for (std::int64_t z = first.Z; z < first.Z + count[2]; ++z)
  {
    for (std::int64_t y = first.Y; y < first.Y + count[1]; ++y)
    {
      for (std::int64_t x = first.X; x < first.X + count[0]; ++x)
      {
        if (x >= pages[0] || y >= pages[1] || z >= pages[2])
        {
          ranges.push_back(ValueRange::Void());
          continue;
        }
        BrickKey region = first;
        region.X = static_cast<std::uint32_t>(x);
        region.Y = static_cast<std::uint32_t>(y);
        region.Z = static_cast<std::uint32_t>(z);
        Result<ValueRange> range = rangeOf(region);
        if (!range)
        {
          return range.GetStatus();
        }
        ranges.push_back(range.Value());
      }
    }
  }
  return ranges;
}

} // namespace teravox
