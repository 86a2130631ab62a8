// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Types.h"

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

namespace teravox
{

/// How one level of a pyramid is made from the level before.
enum class Downsampling
{
  Average, ///< box average of each group; integers rounded to nearest, halves upwards; NaN left out
  Mode,    ///< the most frequent value of each group, the smallest of equals; NaN left out
  Any      ///< of masks: 1 where any value of a group is above 0, else 0
};

/// A box of voxels in memory, x fastest, components interleaved. Strides count scalars, not bytes
/// and not voxels, so that a part of a larger array can be named.
template <typename T>
struct BoxView
{
  T* Data = nullptr;
  Int3 Dimensions{ 0, 0, 0 };
  int Components = 1;
  std::int64_t RowStride = 0;   ///< from (x, y, z) to (x, y+1, z)
  std::int64_t SliceStride = 0; ///< from (x, y, z) to (x, y, z+1)

  static BoxView Dense(T* data, const Int3& dimensions, int components)
  {
    const std::int64_t row = dimensions[0] * components;
    return { data, dimensions, components, row, row * dimensions[1] };
  }
  T* Row(std::int64_t y, std::int64_t z) const
  {
    return this->Data + y * this->RowStride + z * this->SliceStride;
  }
};

/// The arithmetic of one group of voxels. All pyramids (in memory, on disk, repeated) are made by
/// it, so that they agree bit for bit.
namespace downsampling
{

/// Integers add up exactly; both float types add up in double, in the order z, y, x.
template <typename T>
using Sum = std::conditional_t<std::is_floating_point_v<T>, double, std::int64_t>;

/// sum / count to the nearest integer, halves upwards: rounding commutes with adding a constant.
/// Requires: 1 <= count <= 2^29.
inline std::int64_t DivideRounded(std::int64_t sum, std::int64_t count)
{
  const std::int64_t numerator = 2 * sum + count;
  const std::int64_t denominator = 2 * count;
  const std::int64_t quotient = numerator / denominator;
  return quotient - (numerator % denominator < 0 ? 1 : 0);
}

/// Most frequent value of the `values`, which are reordered; NaN where there is none. For each type
/// of voxels.
template <typename T>
T Mode(std::vector<T>& values);

} // namespace downsampling

/// Makes one level from the level before: voxel i of `out` is made of the voxels
/// [i, i+1) * group of `in`, the last group of what it has. A box that begins at a multiple of the
/// group and ends at one, or at the end of the volume, gives what the whole volume would give; work
/// is therefore split at such planes.
/// Requires: out.Dimensions = ceil(in.Dimensions / group), equal components, group <= 2^9 per axis.
/// For each type of voxels.
template <typename T>
void DownsampleBox(
  const BoxView<const T>& in, const Int3& group, Downsampling method, const BoxView<T>& out);

/// DownsampleBox for a type known at run time; dense boxes.
void DownsampleDense(ScalarType type, const std::byte* in, const Int3& dimensions, int components,
  const Int3& group, Downsampling method, std::byte* out);

} // namespace teravox
