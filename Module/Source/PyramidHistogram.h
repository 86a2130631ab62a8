// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Types.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace teravox
{

/// Counts values whose range isn't known beforehand, in one pass. Types of 8 and 16 bits are
/// counted exactly; for others each value is known to 1/32768 of the range. NaN and infinities are
/// left out. Thread: one at a time; Add() counts in parallel with OpenMP.
class PyramidHistogram
{
public:
  explicit PyramidHistogram(ScalarType type);

  /// Adds `count` values whose finite ones lie in `range`.
  void Add(const void* values, std::size_t count, const ValueRange& range);
  /// Adds one value many times.
  void AddRepeated(double value, std::uint64_t count);

  /// Counts in equal bins over the range, its upper end included; empty if the range isn't finite.
  std::vector<std::uint64_t> Bins(int bins, const ValueRange& range) const;

private:
  void Widen(double low, double high);
  std::size_t Index(double value) const;

  ScalarType Type;
  bool Exact;
  // Bin i covers Low + [i, i+1) * Width. Width 0: no value yet, or all were Low.
  double Low = 0;
  double Width = 0;
  bool Empty = true;
  std::vector<std::uint64_t> Counts;
};

} // namespace teravox
