// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PyramidHistogram.h"

#include "VoxelLoops.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

namespace teravox
{

namespace
{
constexpr std::size_t FineBins = VoxelLoops<double>::Bins;

template <typename T>
bool IsFinite(T v)
{
  return std::isfinite(static_cast<double>(v));
}
/// ++counts[v[i] + offset]. Equal neighbours at once: each addition to one place waits for the one
/// before, and much of a volume is air of one value.
template <typename T>
void CountEach(const T* v, std::size_t n, int offset, std::uint64_t* counts)
{
  constexpr std::size_t group = sizeof(T) == 4 ? 4 : 8 / sizeof(T);
  const auto at = [&](T value) -> std::uint64_t&
  { return counts[static_cast<std::int64_t>(value) + offset]; };
  std::size_t i = 0;
  for (; i + group <= n; i += group)
  {
    // Equal to itself one value further on.
    if (std::memcmp(v + i, v + i + 1, (group - 1) * sizeof(T)) == 0)
    {
      at(v[i]) += group;
      continue;
    }
    for (std::size_t k = 0; k < group; ++k)
    {
      ++at(v[i + k]);
    }
  }
  for (; i < n; ++i)
  {
    ++at(v[i]);
  }
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

bool PyramidHistogram::Prepare(const void* values, std::size_t count, const ValueRange& range)
{
  ValueRange finite = range;
  if (!range.IsVoid() && !range.IsKnown())
  {
    finite = ValueRange::Void();
    DispatchScalarType(this->Type,
      [&](auto example)
      {
        const auto* const v = static_cast<const decltype(example)*>(values);
        for (std::size_t i = 0; i < count; ++i)
        {
          if (IsFinite(v[i]))
          {
            finite.Include(static_cast<double>(v[i]));
          }
        }
      });
  }
  if (finite.IsVoid())
  {
    return false;
  }
  this->Widen(finite.Min, finite.Max);
  return true;
}

void PyramidHistogram::Count(const void* values, std::size_t count, Part& part) const
{
  part.Counts.resize(FineBins + 1); // the last: what isn't finite
  std::uint64_t* const counts = part.Counts.data();
  DispatchScalarType(this->Type,
    [&](auto example)
    {
      using T = decltype(example);
      const T* const v = static_cast<const T*>(values);
      if constexpr (sizeof(T) <= 2)
      {
        CountEach(v, count, std::is_signed_v<T> ? 32768 : 0, counts);
      }
      else
      {
        std::array<std::uint32_t, 1024> bins{};
        for (std::size_t i = 0; i < count; i += bins.size())
        {
          const std::size_t n = std::min(bins.size(), count - i);
          VoxelLoops<T>::Get().FindBins(v + i, n, this->Low, this->Width, bins.data());
          CountEach(bins.data(), n, 0, counts);
        }
      }
    });
}

void PyramidHistogram::Add(Part& part)
{
  for (std::size_t i = 0; i < std::min(FineBins, part.Counts.size()); ++i)
  {
    this->Counts[i] += part.Counts[i];
  }
  std::fill(part.Counts.begin(), part.Counts.end(), 0);
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
