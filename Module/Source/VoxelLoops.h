// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace teravox
{

/// The loops over all voxels of a conversion, element by element without branches, compiled once
/// for any processor and once for AVX2. Both give the same bits: nothing is contracted, no order of
/// additions depends on the width of a register.
template <typename T>
struct VoxelLoops
{
  // 32-bit floats hold differences of 8- and 16-bit integers exactly.
  using Real = std::conditional_t<sizeof(T) <= 2, float, double>;

  /// low[i] = min(low[i], row[i]), high[i] = max(high[i], row[i]); NaN is left out. Of floats only:
  /// nan[i] becomes NaN where row[i] is, and stays 0 elsewhere; else it isn't touched.
  void (*AddRange)(const T* row, std::size_t n, T* low, T* high, T* nan);
  /// squared[i] = max(squared[i], squared length of the gradient at row[i]): of the differences of
  /// row[i + above[a]] and row[i + below[a]] times weight[a] along three axes; NaN counts as 0.
  void (*AddSquares)(const T* row, std::size_t n, const std::int64_t* below,
    const std::int64_t* above, const Real* weight, Real* squared);
  /// Of values of more than 16 bits, which of Bins bins of `width` from `low` on they lie in, the
  /// outermost for values beyond them; Bins for what isn't finite.
  void (*FindBins)(const T* values, std::size_t n, double low, double width, std::uint32_t* bins);

  static constexpr std::uint32_t Bins = 65536;

  /// For this processor.
  static const VoxelLoops& Get();
};

} // namespace teravox
