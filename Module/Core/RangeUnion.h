// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Types.h"

#include <cmath>
#include <limits>

namespace teravox
{

/// A range that isn't single though all its values are the same: places without a value lie among
/// them, and a brick of one value is drawn without being read.
inline ValueRange NotSingle(const ValueRange& range)
{
  if (!range.IsSingle())
  {
    return range;
  }
  constexpr double infinity = std::numeric_limits<double>::infinity();
  return range.Max < infinity ? ValueRange{ range.Min, std::nextafter(range.Max, infinity) }
                              : ValueRange{ std::nextafter(range.Min, 0.0), range.Max };
}

/// The range of several parts; where some have values and some none, it isn't single.
struct RangeUnion
{
  ValueRange Range = ValueRange::Void();
  bool SomeAreVoid = false;

  void Include(const ValueRange& part)
  {
    this->SomeAreVoid = this->SomeAreVoid || part.IsVoid();
    this->Range.Include(part);
  }
  ValueRange Get() const { return this->SomeAreVoid ? NotSingle(this->Range) : this->Range; }
};

} // namespace teravox
