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
/// left out. Thread: one at a time; Count() any.
class PyramidHistogram
{
public:
  /// What one thread has counted and not yet added.
  class Part
  {
  private:
    friend class PyramidHistogram;
    std::vector<std::uint64_t> Counts;
  };
  /// Of a Part.
  static constexpr std::size_t PartBytes = std::size_t{ 65537 } * sizeof(std::uint64_t);

  explicit PyramidHistogram(ScalarType type);

  /// Whether Prepare() must come before Count().
  bool NeedsRange() const { return !this->Exact; }
  /// `count` values, which lie in `range`, are about to be counted. False: none of them is finite.
  /// Requires: no Part has counts that weren't added.
  bool Prepare(const void* values, std::size_t count, const ValueRange& range);
  /// Counts `count` values into a part.
  void Count(const void* values, std::size_t count, Part& part) const;
  /// Adds a part, which is empty afterwards.
  void Add(Part& part);
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
