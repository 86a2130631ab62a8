// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "RepeatPeriod.h"

#include <algorithm>

namespace teravox
{

// What the reading and the ranges of RepeatPeriod share.

/// The volume number under which the inner source's bricks are asked for and cached.
inline constexpr std::uint32_t InnerVolume = 0;

struct Segment
{
  std::int64_t Index = 0; ///< of the brick or region
  std::int64_t Low = 0;
  std::int64_t High = 0;
};

/// Cuts [low, high) into parts that one stored brick, or the support of one region, covers each.
/// The border counts: an aligned box of a brick with its border needs this one brick only.
inline std::vector<Segment> Cut(
  std::int64_t low, std::int64_t high, std::int64_t edge, std::int64_t regions)
{
  std::vector<Segment> segments;
  while (low < high)
  {
    const std::int64_t index = std::min((low + BrickBorder) / edge, regions - 1);
    const std::int64_t end = std::min(high, (index + 1) * edge + BrickBorder);
    segments.push_back({ index, low, end });
    low = end;
  }
  return segments;
}

/// Calls f(index triple) for all combinations of three lists; stops at the first failure.
template <typename F>
Status ForEachTriple(const std::array<std::size_t, 3>& counts, const F& f)
{
  for (std::size_t z = 0; z < counts[2]; ++z)
  {
    for (std::size_t y = 0; y < counts[1]; ++y)
    {
      for (std::size_t x = 0; x < counts[0]; ++x)
      {
        Status status = f(std::array<std::size_t, 3>{ x, y, z });
        if (!status)
        {
          return status;
        }
      }
    }
  }
  return {};
}

inline BrickKey KeyOf(std::uint32_t volume, int level, std::uint32_t time, const Int3& index)
{
  BrickKey key = BrickKey::Of(level, index);
  key.Volume = volume;
  key.Time = time;
  return key;
}
/// Calls f(box of classes, where it begins in the windows) for each combination of runs.
template <typename F>
Status RepeatPeriod::ForEachRun(const std::array<Window, 3>& windows, const F& f)
{
  return ForEachTriple({ windows[0].Runs.size(), windows[1].Runs.size(), windows[2].Runs.size() },
    [&](const std::array<std::size_t, 3>& run)
    {
      VoxelBox box;
      Int3 offset{ 0, 0, 0 };
      for (std::size_t a = 0; a < 3; ++a)
      {
        for (std::size_t r = 0; r < run[a]; ++r)
        {
          offset[a] += windows[a].Runs[r].second - windows[a].Runs[r].first;
        }
        box.Low[a] = windows[a].Runs[run[a]].first;
        box.High[a] = windows[a].Runs[run[a]].second;
      }
      return f(box, offset);
    });
}

/// Cuts a box of classes of an inner-backed level at the ends of the inner volume.
template <typename F>
Status RepeatPeriod::ForEachPart(int level, const VoxelBox& box, const F& f) const
{
  const Level& l = this->Levels[static_cast<std::size_t>(level)];
  return ForEachTriple({ 3, 3, 3 },
    [&](const std::array<std::size_t, 3>& third)
    {
      VoxelBox part;
      for (std::size_t a = 0; a < 3; ++a)
      {
        const std::array<std::int64_t, 4> cuts{ 0, l.Axes[a].Full, l.Axes[a].Touch,
          l.Axes[a].Classes };
        part.Low[a] = std::max(box.Low[a], cuts[third[a]]);
        part.High[a] = std::min(box.High[a], cuts[third[a] + 1]);
      }
      if (part.IsEmpty())
      {
        return Status();
      }
      const std::size_t farthest = std::max({ third[0], third[1], third[2] });
      return f(part,
        farthest == 0     ? Part::Inside
          : farthest == 1 ? Part::Across
                          : Part::Background);
    });
}

} // namespace teravox
