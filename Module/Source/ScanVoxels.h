// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickGeometry.h"
#include "Downsampling.h"
#include "RangeUnion.h"

#include <algorithm>
#include <limits>
#include <type_traits>

namespace teravox
{

/// Smallest and largest value of a box inside the view, over all components, without NaN; Void() if
/// there is nothing else. Not single where NaN lies beside one value.
template <typename T>
ValueRange ScanVoxels(const BoxView<const T>& view, const VoxelBox& box)
{
  T low = std::numeric_limits<T>::max();
  T high = std::numeric_limits<T>::lowest();
  if constexpr (std::is_floating_point_v<T>)
  {
    low = std::numeric_limits<T>::infinity();
    high = -low;
  }
  for (std::int64_t z = box.Low[2]; z < box.High[2]; ++z)
  {
    for (std::int64_t y = box.Low[1]; y < box.High[1]; ++y)
    {
      const T* const row = view.Row(y, z);
      const T* const end = row + box.High[0] * view.Components;
      for (const T* p = row + box.Low[0] * view.Components; p != end; ++p)
      {
        // Comparisons with NaN are false: it is left out.
        low = *p < low ? *p : low;
        high = *p > high ? *p : high;
      }
    }
  }
  const ValueRange range{ static_cast<double>(low), static_cast<double>(high) };
  if constexpr (std::is_floating_point_v<T>)
  {
    for (std::int64_t z = box.Low[2]; range.IsSingle() && z < box.High[2]; ++z)
    {
      for (std::int64_t y = box.Low[1]; y < box.High[1]; ++y)
      {
        const T* const row = view.Row(y, z);
        if (std::any_of(row + box.Low[0] * view.Components, row + box.High[0] * view.Components,
              [](T v) { return v != v; }))
        {
          return NotSingle(range);
        }
      }
    }
  }
  return range;
}

} // namespace teravox
