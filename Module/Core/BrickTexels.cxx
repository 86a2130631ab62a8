// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BrickTexels.h"

#include "AtlasPlan.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

namespace teravox
{

namespace
{
template <typename T>
void ConvertIntegers(const Brick& brick, ConvertedBrick& out)
{
  using Unsigned = std::make_unsigned_t<T>;
  // Flipping the sign bit adds half the range: the order of values is that of unsigned numbers.
  constexpr Unsigned flip = std::is_signed_v<T>
    ? static_cast<Unsigned>(Unsigned{ 1 } << (sizeof(T) * 8 - 1))
    : Unsigned{ 0 };
  const std::size_t count = brick.Voxels.size() / sizeof(T);
  const auto* in = reinterpret_cast<const Unsigned*>(brick.Voxels.data());
  auto* texels = reinterpret_cast<Unsigned*>(out.Bytes.data());
  for (std::size_t i = 0; i < count; ++i)
  {
    texels[i] = static_cast<Unsigned>(in[i] ^ flip);
  }
}

// What is subtracted from the values of a brick before they become floats: the median of a few, or
// the end of the range that is closer to 0. Where values lie close together and far from 0, floats
// tell them (and what lies between them) apart only then, and a plateau keeps what little it
// varies. But one voxel far from all others, or a plateau far from 0, must not cost the others
// their precision: then it is 0.
template <typename T>
double OffsetOf(const T* values, std::size_t count, const ValueRange& range)
{
  constexpr std::size_t most = 63;
  std::vector<double> taken;
  for (std::size_t i = 0; i < most; ++i)
  {
    const std::size_t at = i * count / most;
    const auto value = static_cast<double>(values[at]);
    if (std::isfinite(value))
    {
      taken.push_back(value);
    }
  }
  if (taken.empty() || range.IsVoid())
  {
    return 0;
  }
  const auto middle = taken.begin() + static_cast<std::ptrdiff_t>(taken.size() / 2);
  std::nth_element(taken.begin(), middle, taken.end());
  const double width = range.Max - range.Min;
  const bool far = width < 0.5 * std::max(std::abs(range.Min), std::abs(range.Max));
  if (far || std::is_same_v<T, float>)
  {
    return far ? *middle : 0; // floats themselves are exact as they are
  }
  // What lies near 0 keeps 2^-30 of the range.
  const double end = std::abs(range.Min) < std::abs(range.Max) ? range.Min : range.Max;
  return std::abs(*middle) * 64 <= width ? *middle : std::abs(end) * 64 <= width ? end : 0;
}

template <typename T>
void ConvertRelative(const Brick& brick, ConvertedBrick& out)
{
  const std::size_t count = brick.Voxels.size() / sizeof(T);
  const auto* in = reinterpret_cast<const T*>(brick.Voxels.data());
  ValueRange range = ValueRange::Void();
  for (std::size_t i = 0; i < count; ++i)
  {
    if (std::isfinite(static_cast<double>(in[i])))
    {
      range.Include(static_cast<double>(in[i]));
    }
  }
  const double wanted = OffsetOf(in, count, range);
  out.OffsetHigh = static_cast<float>(wanted);
  out.OffsetLow = static_cast<float>(wanted - static_cast<double>(out.OffsetHigh));
  // What the pair of floats holds of it.
  const double offset = static_cast<double>(out.OffsetHigh) + static_cast<double>(out.OffsetLow);
  auto* texels = reinterpret_cast<float*>(out.Bytes.data());
  if (std::is_same_v<T, float> && offset == 0)
  {
    std::memcpy(texels, in, out.Bytes.size());
    return;
  }
  for (std::size_t i = 0; i < count; ++i)
  {
    texels[i] = static_cast<float>(static_cast<double>(in[i]) - offset);
  }
}

// One value beside NaN isn't one value: whoever takes a cell as such needn't read its texels.
template <typename T>
void WidenBesideNaN(int stored, int cells, const T* texels, T* ranges)
{
  const int inner = stored - 2 * BrickBorder;
  for (int i = 0; i < cells * cells * cells; ++i)
  {
    T* range = ranges + 2 * static_cast<std::size_t>(i);
    if (!(range[0] == range[1]))
    {
      continue;
    }
    const int cell[3] = { i % cells, i / cells % cells, i / cells / cells };
    int low[3];
    int high[3];
    for (int a = 0; a < 3; ++a)
    {
      low[a] = cell[a] * CellEdge - 1 + BrickBorder;
      high[a] = std::min(cell[a] * CellEdge + CellEdge, inner) + BrickBorder;
    }
    bool any = false;
    for (int z = low[2]; z <= high[2] && !any; ++z)
    {
      for (int y = low[1]; y <= high[1] && !any; ++y)
      {
        const T* row = texels +
          (static_cast<std::size_t>(z) * static_cast<std::size_t>(stored) +
            static_cast<std::size_t>(y)) *
            static_cast<std::size_t>(stored);
        any = std::any_of(row + low[0], row + high[0] + 1, [](T v) { return v != v; });
      }
    }
    if (any)
    {
      range[1] = std::nextafter(range[1], std::numeric_limits<T>::max());
    }
  }
}

// Least and largest texel per cell: first along x for all rows, then over rows and slices, so that
// each voxel is read about twice.
template <typename T>
void FindCells(int stored, ConvertedBrick& out)
{
  const int inner = stored - 2 * BrickBorder;
  const int cells = static_cast<int>(CeilDiv(inner, CellEdge));
  const auto* texels = reinterpret_cast<const T*>(out.Bytes.data());
  const auto count = static_cast<std::size_t>(cells);
  out.Cells.resize(count * count * count * 2 * sizeof(T));
  auto* ranges = reinterpret_cast<T*>(out.Cells.data());
  // Voxels from 4 c - 1 to 4 c + 4 of the inner brick, as indices of the stored one.
  const auto first = [](int c) { return c * CellEdge - 1 + BrickBorder; };
  const auto last = [inner](int c)
  { return std::min(c * CellEdge + CellEdge, inner) + BrickBorder; };
  constexpr T high = std::numeric_limits<T>::max();
  constexpr T low = std::numeric_limits<T>::lowest();
  std::fill_n(ranges, count * count * count * 2, high);
  for (std::size_t i = 1; i < count * count * count * 2; i += 2)
  {
    ranges[i] = low;
  }
  std::vector<T> row(count * 2);
  for (int z = 0; z < stored; ++z)
  {
    for (int y = 0; y < stored; ++y)
    {
      const T* line = texels +
        (static_cast<std::size_t>(z) * static_cast<std::size_t>(stored) +
          static_cast<std::size_t>(y)) *
          static_cast<std::size_t>(stored);
      for (int c = 0; c < cells; ++c)
      {
        T least = high;
        T largest = low;
        for (int x = first(c); x <= last(c); ++x)
        {
          // Comparisons with NaN are false: it is left out.
          least = line[x] < least ? line[x] : least;
          largest = line[x] > largest ? line[x] : largest;
        }
        row[2 * static_cast<std::size_t>(c)] = least;
        row[2 * static_cast<std::size_t>(c) + 1] = largest;
      }
      for (int cz = 0; cz < cells; ++cz)
      {
        if (z < first(cz) || z > last(cz))
        {
          continue;
        }
        for (int cy = 0; cy < cells; ++cy)
        {
          if (y < first(cy) || y > last(cy))
          {
            continue;
          }
          T* cell = ranges +
            2 * (static_cast<std::size_t>(cz) * count + static_cast<std::size_t>(cy)) * count;
          for (std::size_t c = 0; c < count * 2; c += 2)
          {
            cell[c] = std::min(cell[c], row[c]);
            cell[c + 1] = std::max(cell[c + 1], row[c + 1]);
          }
        }
      }
    }
  }
  if constexpr (std::is_floating_point_v<T>)
  {
    WidenBesideNaN(stored, cells, texels, ranges);
  }
}

// The mask as a component behind the others, whose cells lose their ranges where it is 0.
template <typename T>
void AddMask(const Brick& brick, std::vector<ConvertedBrick>& all)
{
  ConvertedBrick mask;
  const std::size_t voxels = brick.Mask.size() / static_cast<std::size_t>(brick.MaskBytes);
  mask.Bytes.resize(voxels * sizeof(T));
  auto* texels = reinterpret_cast<T*>(mask.Bytes.data());
  if (brick.MaskBytes == 1)
  {
    std::copy(brick.Mask.begin(), brick.Mask.end(), texels);
  }
  else
  {
    const auto* values = reinterpret_cast<const std::uint16_t*>(brick.Mask.data());
    std::transform(
      values, values + voxels, texels, [](std::uint16_t value) { return static_cast<T>(value); });
  }
  FindCells<T>(brick.StoredSize, mask);
  const auto* in = reinterpret_cast<const T*>(mask.Cells.data());
  const std::size_t cells = mask.Cells.size() / (2 * sizeof(T));
  for (ConvertedBrick& component : all)
  {
    auto* ranges = reinterpret_cast<T*>(component.Cells.data());
    for (std::size_t i = 0; i < cells; ++i)
    {
      if (in[2 * i + 1] == 0)
      {
        ranges[2 * i] = std::numeric_limits<T>::max();
        ranges[2 * i + 1] = std::numeric_limits<T>::lowest();
      }
    }
  }
  all.push_back(std::move(mask));
}
} // namespace

ConvertedBrick ConvertBrick(const Brick& brick, const TexelFormat& format)
{
  ConvertedBrick out;
  const std::size_t count = brick.Voxels.size() / SizeOf(brick.Type);
  out.Bytes.resize(count * format.BytesPerTexel);
  DispatchScalarType(brick.Type,
    [&](auto zero)
    {
      using T = decltype(zero);
      if constexpr (std::is_integral_v<T> && sizeof(T) <= 2)
      {
        ConvertIntegers<T>(brick, out);
      }
      else
      {
        ConvertRelative<T>(brick, out);
      }
    });
  switch (format.BytesPerTexel)
  {
    case 1:
      FindCells<std::uint8_t>(brick.StoredSize, out);
      break;
    case 2:
      FindCells<std::uint16_t>(brick.StoredSize, out);
      break;
    default:
      FindCells<float>(brick.StoredSize, out);
      break;
  }
  return out;
}

std::shared_ptr<Brick> TakeComponent(const Brick& brick, int component)
{
  auto one = std::make_shared<Brick>();
  one->Type = brick.Type;
  one->StoredSize = brick.StoredSize;
  const std::size_t size = SizeOf(brick.Type);
  const std::size_t stride = size * static_cast<std::size_t>(brick.Components);
  const std::size_t count = brick.Voxels.size() / stride;
  const std::byte* from = brick.Voxels.data() + size * static_cast<std::size_t>(component);
  one->Voxels.resize(count * size);
  for (std::size_t i = 0; i < count; ++i)
  {
    std::memcpy(one->Voxels.data() + i * size, from + i * stride, size);
  }
  return one;
}

std::vector<ConvertedBrick> ConvertComponents(const Brick& brick, const TexelFormat& format)
{
  std::vector<ConvertedBrick> all;
  if (brick.Components == 1)
  {
    all.push_back(ConvertBrick(brick, format));
  }
  for (int c = 0; c < brick.Components && brick.Components > 1; ++c)
  {
    all.push_back(ConvertBrick(*TakeComponent(brick, c), format));
  }
  if (!brick.Mask.empty())
  {
    switch (format.BytesPerTexel)
    {
      case 1:
        AddMask<std::uint8_t>(brick, all);
        break;
      case 2:
        AddMask<std::uint16_t>(brick, all);
        break;
      default:
        AddMask<float>(brick, all);
        break;
    }
  }
  return all;
}

} // namespace teravox
