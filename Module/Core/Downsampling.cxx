// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Downsampling.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace teravox
{
namespace downsampling
{

template <typename T>
T Mode(std::vector<T>& values)
{
  if (values.empty())
  {
    return std::numeric_limits<T>::quiet_NaN();
  }
  if (std::all_of(values.begin(), values.end(), [&](T v) { return v == values.front(); }))
  {
    return values.front();
  }
  std::sort(values.begin(), values.end());
  T best = values.front();
  std::ptrdiff_t longest = 0;
  for (auto run = values.begin(); run != values.end();)
  {
    const auto end = std::find_if(run, values.end(), [&](T v) { return v != *run; });
    if (end - run > longest)
    {
      longest = end - run;
      best = *run;
    }
    run = end;
  }
  return best;
}

namespace
{

/// Average of a group of `count` voxels whose sum overflowed in double.
template <typename T>
T AverageWide(const BoxView<const T>& in, const Int3& first, const Int3& count, int component)
{
  long double sum = 0;
  std::int64_t used = 0;
  for (std::int64_t z = 0; z < count[2]; ++z)
  {
    for (std::int64_t y = 0; y < count[1]; ++y)
    {
      const T* row = in.Row(first[1] + y, first[2] + z) + first[0] * in.Components + component;
      for (std::int64_t x = 0; x < count[0]; ++x)
      {
        const T v = row[x * in.Components];
        sum += v == v ? v : T{};
        used += v == v ? 1 : 0;
      }
    }
  }
  return static_cast<T>(sum / static_cast<long double>(used));
}

/// Extent of group `index` along an axis of `size` voxels: the last group has what is left.
inline std::int64_t GroupCount(std::int64_t index, std::int64_t group, std::int64_t size)
{
  return std::min(group, size - index * group);
}

/// Adds one input row to the sums of one output row.
template <typename T>
void AddRow(const T* row, std::int64_t width, std::int64_t group, int components, Sum<T>* sums,
  std::int32_t* used)
{
  for (std::int64_t begin = 0; begin < width; begin += group)
  {
    const T* p = row + begin * components;
    for (std::int64_t x = std::min(group, width - begin); x > 0; --x)
    {
      for (int c = 0; c < components; ++c, ++p)
      {
        if constexpr (std::is_floating_point_v<T>)
        {
          const bool valid = *p == *p;
          sums[c] += valid ? static_cast<double>(*p) : 0.0;
          used[c] += valid ? 1 : 0;
        }
        else
        {
          sums[c] += *p;
        }
      }
    }
    sums += components;
    used += components;
  }
}

template <typename T>
void AverageRow(const BoxView<const T>& in, const Int3& group, std::int64_t y, std::int64_t z,
  std::vector<Sum<T>>& sums, std::vector<std::int32_t>& used, T* out)
{
  const std::int64_t width = CeilDiv(in.Dimensions[0], group[0]);
  const std::int64_t rows = GroupCount(y, group[1], in.Dimensions[1]);
  const std::int64_t slices = GroupCount(z, group[2], in.Dimensions[2]);
  sums.assign(static_cast<std::size_t>(width * in.Components), Sum<T>{});
  used.assign(sums.size(), 0);
  for (std::int64_t k = 0; k < slices; ++k)
  {
    for (std::int64_t j = 0; j < rows; ++j)
    {
      AddRow(in.Row(y * group[1] + j, z * group[2] + k), in.Dimensions[0], group[0], in.Components,
        sums.data(), used.data());
    }
  }
  for (std::int64_t x = 0; x < width; ++x)
  {
    const std::int64_t columns = GroupCount(x, group[0], in.Dimensions[0]);
    for (int c = 0; c < in.Components; ++c)
    {
      const std::size_t i = static_cast<std::size_t>(x * in.Components + c);
      if constexpr (std::is_floating_point_v<T>)
      {
        out[i] = used[i] == 0      ? std::numeric_limits<T>::quiet_NaN()
          : std::isfinite(sums[i]) ? static_cast<T>(sums[i] / used[i])
                                   : AverageWide(in, { x * group[0], y * group[1], z * group[2] },
                                       { columns, rows, slices }, c);
      }
      else
      {
        out[i] = static_cast<T>(DivideRounded(sums[i], columns * rows * slices));
      }
    }
  }
}

/// AverageRow() of groups that are all whole and of 2 x 2 x 2 voxels, as most are: the same
/// numbers, without a division and without a row of sums. False: a group has values that aren't
/// finite, or adds up to one, and the row is for AverageRow().
template <typename T>
bool AverageEights(const BoxView<const T>& in, std::int64_t y, std::int64_t z, T* __restrict out)
{
  const T* const a = in.Row(2 * y, 2 * z);
  const T* const b = in.Row(2 * y + 1, 2 * z);
  const T* const c = in.Row(2 * y, 2 * z + 1);
  const T* const d = in.Row(2 * y + 1, 2 * z + 1);
  const std::int64_t width = in.Dimensions[0] / 2;
  if constexpr (std::is_floating_point_v<T>)
  {
    std::int32_t odd = 0;
    for (std::int64_t x = 0; x < width; ++x)
    {
      const std::int64_t i = 2 * x;
      // In the order of AverageRow(), from 0 on: eight times -0 is 0.
      const double sum =
        0.0 + a[i] + a[i + 1] + b[i] + b[i + 1] + c[i] + c[i + 1] + d[i] + d[i + 1];
      out[x] = static_cast<T>(sum * 0.125);
      odd |= sum - sum == 0 ? 0 : 1;
    }
    return odd == 0;
  }
  else
  {
    using Wide = std::conditional_t<sizeof(T) <= 2, std::int32_t, std::int64_t>;
    for (std::int64_t x = 0; x < width; ++x)
    {
      const std::int64_t i = 2 * x;
      const Wide sum =
        Wide{ a[i] } + a[i + 1] + b[i] + b[i + 1] + c[i] + c[i + 1] + d[i] + d[i + 1] + 4;
      out[x] = static_cast<T>(sum >> 3); // rounds down, also below zero
    }
    return true;
  }
}

template <typename T>
bool IsOfEights(const BoxView<const T>& in, const Int3& group)
{
  return in.Components == 1 && group == Int3{ 2, 2, 2 } && in.Dimensions[0] % 2 == 0 &&
    in.Dimensions[1] % 2 == 0 && in.Dimensions[2] % 2 == 0;
}

template <typename T>
void ModeRow(const BoxView<const T>& in, const Int3& group, std::int64_t y, std::int64_t z,
  std::vector<T>& values, T* out)
{
  const std::int64_t width = CeilDiv(in.Dimensions[0], group[0]);
  const std::int64_t rows = GroupCount(y, group[1], in.Dimensions[1]);
  const std::int64_t slices = GroupCount(z, group[2], in.Dimensions[2]);
  for (std::int64_t x = 0; x < width; ++x)
  {
    const std::int64_t columns = GroupCount(x, group[0], in.Dimensions[0]);
    for (int c = 0; c < in.Components; ++c)
    {
      values.clear();
      for (std::int64_t k = 0; k < slices * rows; ++k)
      {
        const T* p = in.Row(y * group[1] + k % rows, z * group[2] + k / rows) +
          x * group[0] * in.Components + c;
        for (std::int64_t i = 0; i < columns; ++i)
        {
          const T v = p[i * in.Components];
          if (v == v)
          {
            values.push_back(v);
          }
        }
      }
      out[x * in.Components + c] = Mode(values);
    }
  }
}

template <typename T>
void AnyRow(const BoxView<const T>& in, const Int3& group, std::int64_t y, std::int64_t z, T* out)
{
  const std::int64_t width = CeilDiv(in.Dimensions[0], group[0]) * in.Components;
  const std::int64_t rows = GroupCount(y, group[1], in.Dimensions[1]);
  const std::int64_t slices = GroupCount(z, group[2], in.Dimensions[2]);
  std::fill_n(out, width, T{});
  for (std::int64_t k = 0; k < slices * rows; ++k)
  {
    const T* row = in.Row(y * group[1] + k % rows, z * group[2] + k / rows);
    for (std::int64_t x = 0; x < in.Dimensions[0]; ++x)
    {
      for (int c = 0; c < in.Components; ++c)
      {
        T& any = out[x / group[0] * in.Components + c];
        any = row[x * in.Components + c] > 0 ? T{ 1 } : any;
      }
    }
  }
}

} // namespace
} // namespace downsampling

template <typename T>
void DownsampleBox(
  const BoxView<const T>& in, const Int3& group, Downsampling method, const BoxView<T>& out)
{
  assert(in.Components == out.Components);
  std::vector<downsampling::Sum<T>> sums;
  std::vector<std::int32_t> used;
  std::vector<T> values;
  const bool eights = method == Downsampling::Average && downsampling::IsOfEights(in, group);
  for (std::int64_t z = 0; z < out.Dimensions[2]; ++z)
  {
    for (std::int64_t y = 0; y < out.Dimensions[1]; ++y)
    {
      if (method == Downsampling::Mode)
      {
        downsampling::ModeRow(in, group, y, z, values, out.Row(y, z));
      }
      else if (method == Downsampling::Any)
      {
        downsampling::AnyRow(in, group, y, z, out.Row(y, z));
      }
      else if (!eights || !downsampling::AverageEights(in, y, z, out.Row(y, z)))
      {
        downsampling::AverageRow(in, group, y, z, sums, used, out.Row(y, z));
      }
    }
  }
}

void DownsampleDense(ScalarType type, const std::byte* in, const Int3& dimensions, int components,
  const Int3& group, Downsampling method, std::byte* out)
{
  DispatchScalarType(type,
    [&](auto tag)
    {
      using T = decltype(tag);
      const Int3 outDims{ CeilDiv(dimensions[0], group[0]), CeilDiv(dimensions[1], group[1]),
        CeilDiv(dimensions[2], group[2]) };
      DownsampleBox<T>(
        BoxView<const T>::Dense(reinterpret_cast<const T*>(in), dimensions, components), group,
        method, BoxView<T>::Dense(reinterpret_cast<T*>(out), outDims, components));
    });
}

// Compiled here once, for all who make levels: it takes a compiler long.
#define TERAVOX_DOWNSAMPLING_OF(type)                                                              \
  template type downsampling::Mode(std::vector<type>&);                                            \
  template void DownsampleBox(                                                                     \
    const BoxView<const type>&, const Int3&, Downsampling, const BoxView<type>&);
TERAVOX_DOWNSAMPLING_OF(std::uint8_t)
TERAVOX_DOWNSAMPLING_OF(std::int8_t)
TERAVOX_DOWNSAMPLING_OF(std::uint16_t)
TERAVOX_DOWNSAMPLING_OF(std::int16_t)
TERAVOX_DOWNSAMPLING_OF(std::uint32_t)
TERAVOX_DOWNSAMPLING_OF(std::int32_t)
TERAVOX_DOWNSAMPLING_OF(float)
TERAVOX_DOWNSAMPLING_OF(double)
#undef TERAVOX_DOWNSAMPLING_OF

} // namespace teravox
