// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PyramidHistogram.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <omp.h>

namespace teravox
{

namespace
{
constexpr std::size_t FineBins = 65536;

template <typename T>
bool IsFinite(T v)
{
  return std::isfinite(static_cast<double>(v));
}
} // namespace

PyramidHistogram::PyramidHistogram(ScalarType type)
  : Type(type)
  , Exact(SizeOf(type) <= 2)
  , Counts(FineBins, 0)
{
  if (this->Exact)
  {
    // One bin per value: i16 begins at -32768.
    const bool isSigned = type == ScalarType::Int8 || type == ScalarType::Int16;
    this->Low = isSigned ? -32768.0 : 0.0;
    this->Width = 1;
    this->Empty = false;
  }
}

std::size_t PyramidHistogram::Index(double value) const
{
  if (this->Width == 0)
  {
    return 0;
  }
  // Divided before subtracting: the difference of two huge values may overflow.
  const double i = value / this->Width - this->Low / this->Width;
  return static_cast<std::size_t>(std::clamp(i, 0.0, static_cast<double>(FineBins - 1)));
}

void PyramidHistogram::Widen(double low, double high)
{
  if (this->Exact)
  {
    return;
  }
  if (this->Empty)
  {
    this->Low = low;
    this->Empty = false;
  }
  const double bins = static_cast<double>(FineBins);
  if (this->Width == 0)
  {
    const double all = std::min(low, this->Low);
    const double top = std::max(high, this->Low);
    if (all == top)
    {
      return;
    }
    const std::uint64_t count = this->Counts[0];
    const double value = this->Low;
    this->Counts[0] = 0;
    this->Low = all;
    this->Width = std::max(top / bins - all / bins, std::numeric_limits<double>::min());
    this->Counts[this->Index(value)] += count;
    return;
  }
  while (high / this->Width - this->Low / this->Width > bins && std::isfinite(this->Width * 2))
  {
    for (std::size_t i = 0; i < FineBins; ++i)
    {
      this->Counts[i] =
        i < FineBins / 2 ? this->Counts[2 * i] + this->Counts[2 * i + 1] : std::uint64_t{ 0 };
    }
    this->Width *= 2;
  }
  while (low < this->Low && std::isfinite(this->Low - bins * this->Width))
  {
    for (std::size_t i = FineBins; i-- > 0;)
    {
      const std::size_t j = i - FineBins / 2;
      this->Counts[i] =
        i >= FineBins / 2 ? this->Counts[2 * j] + this->Counts[2 * j + 1] : std::uint64_t{ 0 };
    }
    this->Low -= bins * this->Width;
    this->Width *= 2;
  }
}

void PyramidHistogram::Add(const void* values, std::size_t count, const ValueRange& range)
{
  if (range.IsVoid())
  {
    return;
  }
  DispatchScalarType(this->Type,
    [&](auto example)
    {
      using T = decltype(example);
      const T* v = static_cast<const T*>(values);
      ValueRange finite = range;
      if (!range.IsKnown())
      {
        finite = ValueRange::Void();
        for (std::size_t i = 0; i < count; ++i)
        {
          if (IsFinite(v[i]))
          {
            finite.Include(static_cast<double>(v[i]));
          }
        }
        if (finite.IsVoid())
        {
          return;
        }
      }
      this->Widen(finite.Min, finite.Max);
      const auto n = static_cast<std::int64_t>(count);
      const int low = this->Exact ? static_cast<int>(this->Low) : 0;
      // Allocated here: nothing may be thrown inside the parallel region.
      std::vector<std::vector<std::uint64_t>> locals(
        static_cast<std::size_t>(omp_get_max_threads()), std::vector<std::uint64_t>(FineBins, 0));
#pragma omp parallel
      {
        std::vector<std::uint64_t>& local = locals[static_cast<std::size_t>(omp_get_thread_num())];
#pragma omp for schedule(static)
        for (std::int64_t i = 0; i < n; ++i)
        {
          if constexpr (sizeof(T) <= 2)
          {
            ++local[static_cast<std::size_t>(v[i] - low)];
          }
          else if (IsFinite(v[i]))
          {
            ++local[this->Index(static_cast<double>(v[i]))];
          }
        }
#pragma omp critical(teravox_histogram)
        for (std::size_t i = 0; i < FineBins; ++i)
        {
          this->Counts[i] += local[i];
        }
      }
    });
}

void PyramidHistogram::AddRepeated(double value, std::uint64_t count)
{
  if (std::isfinite(value) && count > 0)
  {
    this->Widen(value, value);
    this->Counts[this->Index(value)] += count;
  }
}

std::vector<std::uint64_t> PyramidHistogram::Bins(int bins, const ValueRange& range) const
{
  std::vector<std::uint64_t> result;
  if (!range.IsKnown() || range.IsVoid())
  {
    return result;
  }
  result.assign(static_cast<std::size_t>(bins), 0);
  for (std::size_t i = 0; i < FineBins; ++i)
  {
    if (this->Counts[i] == 0)
    {
      continue;
    }
    const double within = this->Exact ? 0.0 : 0.5;
    const double value = this->Low + (static_cast<double>(i) + within) * this->Width;
    // Small integers: the product is exact. Others: halved, because the extent may overflow.
    const double extent = range.Max / 2 - range.Min / 2;
    double position = 0;
    if (extent > 0)
    {
      position = this->Exact ? (value - range.Min) * bins / (range.Max - range.Min)
                             : (value / 2 - range.Min / 2) / extent * bins;
    }
    result[static_cast<std::size_t>(std::clamp(position, 0.0, bins - 1.0))] += this->Counts[i];
  }
  return result;
}

} // namespace teravox
