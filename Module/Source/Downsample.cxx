// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Downsample.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <type_traits>

namespace teravox
{

namespace
{
/// One group of voxels: `First`, and how many along each axis with which strides in values.
template <typename T>
struct Group
{
  const T* First = nullptr;
  Int3 Count{ 1, 1, 1 };
  Int3 Stride{ 1, 1, 1 };

  template <typename F>
  void ForEach(const F& f) const
  {
    for (std::int64_t z = 0; z < this->Count[2]; ++z)
    {
      for (std::int64_t y = 0; y < this->Count[1]; ++y)
      {
        const T* row = this->First + z * this->Stride[2] + y * this->Stride[1];
        for (std::int64_t x = 0; x < this->Count[0]; ++x)
        {
          f(row[x * this->Stride[0]]);
        }
      }
    }
  }
};

template <typename T>
T Average(const Group<T>& group)
{
  if constexpr (std::is_floating_point_v<T>)
  {
    // The wider type makes the average of equal values that value, exactly.
    using Wide = std::conditional_t<sizeof(T) == 4, double, long double>;
    Wide sum = 0;
    std::int64_t n = 0;
    group.ForEach(
      [&](T v)
      {
        if (!std::isnan(v))
        {
          sum += v;
          ++n;
        }
      });
    return n == 0 ? std::numeric_limits<T>::quiet_NaN()
                  : static_cast<T>(sum / static_cast<Wide>(n));
  }
  else
  {
    std::int64_t sum = 0;
    group.ForEach([&](T v) { sum += v; });
    const std::int64_t n = group.Count[0] * group.Count[1] * group.Count[2];
    const std::int64_t numerator = 2 * sum + n;
    const std::int64_t quotient = numerator / (2 * n);
    const bool below = numerator % (2 * n) < 0;
    return static_cast<T>(quotient - (below ? 1 : 0));
  }
}

template <typename T>
T Mode(const Group<T>& group)
{
  T best = T{};
  std::int64_t most = 0;
  // Groups are small (8 voxels): counting each value costs less than sorting.
  group.ForEach(
    [&](T v)
    {
      if (most > 0 && v == best)
      {
        return;
      }
      std::int64_t n = 0;
      group.ForEach([&](T w) { n += w == v ? 1 : 0; });
      if (n > most || (n == most && n > 0 && v < best))
      {
        most = n;
        best = v;
      }
    });
  if constexpr (std::is_floating_point_v<T>)
  {
    return most == 0 ? std::numeric_limits<T>::quiet_NaN() : best;
  }
  else
  {
    return best;
  }
}

template <typename T, typename Combine>
void Run(int components, const Int3& ratio, const T* in, const Int3& inSize, T* out,
  const Int3& outSize, const Combine& combine)
{
  const std::int64_t rows = outSize[1] * outSize[2];
#pragma omp parallel for schedule(static)
  for (std::int64_t row = 0; row < rows; ++row)
  {
    const std::int64_t y = row % outSize[1];
    const std::int64_t z = row / outSize[1];
    Group<T> group;
    group.Stride = { components, inSize[0] * components, inSize[0] * inSize[1] * components };
    group.Count[1] = std::min(ratio[1], inSize[1] - y * ratio[1]);
    group.Count[2] = std::min(ratio[2], inSize[2] - z * ratio[2]);
    const T* from = in + z * ratio[2] * group.Stride[2] + y * ratio[1] * group.Stride[1];
    T* to = out + row * outSize[0] * components;
    for (std::int64_t x = 0; x < outSize[0]; ++x)
    {
      group.Count[0] = std::min(ratio[0], inSize[0] - x * ratio[0]);
      for (int c = 0; c < components; ++c)
      {
        group.First = from + x * ratio[0] * components + c;
        to[x * components + c] = combine(group);
      }
    }
  }
}
} // namespace

void Downsample(ScalarType type, int components, DownsampleMode mode, const Int3& ratio,
  const void* in, const Int3& inSize, void* out, const Int3& outSize)
{
  DispatchScalarType(type,
    [&](auto example)
    {
      using T = decltype(example);
      const auto* from = static_cast<const T*>(in);
      auto* to = static_cast<T*>(out);
      if (mode == DownsampleMode::Mode)
      {
        Run(
          components, ratio, from, inSize, to, outSize, [](const Group<T>& g) { return Mode(g); });
      }
      else
      {
        Run(components, ratio, from, inSize, to, outSize,
          [](const Group<T>& g) { return Average(g); });
      }
    });
}

} // namespace teravox
