// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// The bodies of VoxelLoops. A translation unit sets TERAVOX_LOOPS to a namespace of its own and
// includes this file; nothing here calls an inline function, which the linker might take from
// another unit, compiled for another processor.
#include "VoxelLoops.h"

namespace teravox::TERAVOX_LOOPS
{
namespace
{

// Comparisons with NaN are false: it is left out.
template <typename T>
void AddRange(
  const T* __restrict row, std::size_t n, T* __restrict low, T* __restrict high, T* __restrict nan)
{
  for (std::size_t i = 0; i < n; ++i)
  {
    const T v = row[i];
    low[i] = v < low[i] ? v : low[i];
    high[i] = v > high[i] ? v : high[i];
    if constexpr (std::is_floating_point_v<T>)
    {
      nan[i] += v != v ? v : T{ 0 };
    }
  }
  static_cast<void>(nan);
}

template <typename T>
typename VoxelLoops<T>::Real Square(T above, T below, typename VoxelLoops<T>::Real weight)
{
  using Real = typename VoxelLoops<T>::Real;
  if constexpr (sizeof(T) <= 2)
  {
    // Subtracted as integers, exactly: one conversion instead of two.
    const Real d = static_cast<Real>(static_cast<int>(above) - static_cast<int>(below)) * weight;
    return d * d;
  }
  else
  {
    const Real d = (static_cast<Real>(above) - static_cast<Real>(below)) * weight;
    // NaN beside a value: the gradient isn't defined along this axis.
    return std::is_floating_point_v<T> && !(d == d) ? Real{ 0 } : d * d;
  }
}

template <typename T>
void AddSquares(const T* __restrict row, std::size_t n, const std::int64_t* below,
  const std::int64_t* above, const typename VoxelLoops<T>::Real* weight,
  typename VoxelLoops<T>::Real* __restrict squared)
{
  using Real = typename VoxelLoops<T>::Real;
  const T* const x0 = row + below[0];
  const T* const x1 = row + above[0];
  const T* const y0 = row + below[1];
  const T* const y1 = row + above[1];
  const T* const z0 = row + below[2];
  const T* const z1 = row + above[2];
  const Real wx = weight[0];
  const Real wy = weight[1];
  const Real wz = weight[2];
  for (std::size_t i = 0; i < n; ++i)
  {
    Real sum = Square<T>(x1[i], x0[i], wx);
    sum += Square<T>(y1[i], y0[i], wy);
    sum += Square<T>(z1[i], z0[i], wz);
    squared[i] = sum > squared[i] ? sum : squared[i];
  }
}

template <typename T>
void FindBins(const T* __restrict values, std::size_t n, double low, double width,
  std::uint32_t* __restrict bins)
{
  constexpr double last = VoxelLoops<T>::Bins - 1;
  // Divided before subtracting: the difference of two huge values may overflow.
  const double first = width == 0 ? 0 : low / width;
  const double divisor = width == 0 ? 1 : width;
  const double top = width == 0 ? 0 : last;
  for (std::size_t i = 0; i < n; ++i)
  {
    const auto v = static_cast<double>(values[i]);
    double bin = v / divisor - first;
    bin = bin > 0 ? bin : 0;
    bin = bin < top ? bin : top;
    const bool finite = v - v == 0;
    bins[i] = static_cast<std::uint32_t>(
      static_cast<std::int32_t>(finite ? bin : static_cast<double>(VoxelLoops<T>::Bins)));
  }
}

template <typename T>
constexpr VoxelLoops<T> Make()
{
  return { AddRange<T>, AddSquares<T>, FindBins<T> };
}

} // namespace

template <typename T>
struct Loops
{
  static const VoxelLoops<T>& Get();
};

#define TERAVOX_LOOPS_OF(T)                                                                        \
  template <>                                                                                      \
  const VoxelLoops<T>& Loops<T>::Get()                                                             \
  {                                                                                                \
    static constexpr VoxelLoops<T> loops = Make<T>();                                              \
    return loops;                                                                                  \
  }
TERAVOX_LOOPS_OF(std::uint8_t)
TERAVOX_LOOPS_OF(std::int8_t)
TERAVOX_LOOPS_OF(std::uint16_t)
TERAVOX_LOOPS_OF(std::int16_t)
TERAVOX_LOOPS_OF(std::uint32_t)
TERAVOX_LOOPS_OF(std::int32_t)
TERAVOX_LOOPS_OF(float)
TERAVOX_LOOPS_OF(double)
#undef TERAVOX_LOOPS_OF

} // namespace teravox::TERAVOX_LOOPS
