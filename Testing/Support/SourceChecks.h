// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"
#include "Downsampling.h"

#include <algorithm>
#include <cstring>
#include <gtest/gtest.h>
#include <random>
#include <vector>

namespace teravox::test
{

/// The scalar type that belongs to a C++ type.
template <typename T>
ScalarType TypeOf()
{
  ScalarType found = ScalarType::Float64;
  for (const ScalarType type : AllScalarTypes)
  {
    found = DispatchScalarType(type, [](auto v) { return std::is_same_v<decltype(v), T>; }) ? type
                                                                                            : found;
  }
  return found;
}

/// A level as one dense array.
template <typename T>
struct Dense
{
  Int3 Dimensions{ 0, 0, 0 };
  int Components = 1;
  std::vector<T> Voxels;

  const T* At(std::int64_t x, std::int64_t y, std::int64_t z) const
  {
    return this->Voxels.data() +
      ((z * this->Dimensions[1] + y) * this->Dimensions[0] + x) * this->Components;
  }
  const T* Clamped(std::int64_t x, std::int64_t y, std::int64_t z) const
  {
    const auto limit = [&](std::int64_t v, std::size_t a)
    { return std::clamp<std::int64_t>(v, 0, this->Dimensions[a] - 1); };
    return this->At(limit(x, 0), limit(y, 1), limit(z, 2));
  }
};

/// Blocks of constant values, noise and background, so that ranges have something to say.
template <typename T>
Dense<T> RandomVolume(const Int3& dims, int components, std::uint64_t seed)
{
  Dense<T> volume{ dims, components, {} };
  std::mt19937_64 random(seed);
  const auto draw = [&]() -> T
  {
    if constexpr (std::is_floating_point_v<T>)
    {
      return static_cast<T>(static_cast<double>(random() % 100000) / 7.0 - 5000.0);
    }
    else
    {
      return static_cast<T>(random());
    }
  };
  for (std::int64_t z = 0; z < dims[2]; ++z)
  {
    for (std::int64_t y = 0; y < dims[1]; ++y)
    {
      for (std::int64_t x = 0; x < dims[0]; ++x)
      {
        const std::int64_t block = (x / 9 + y / 7 * 3 + z / 11 * 5) % 4;
        for (int c = 0; c < components; ++c)
        {
          const T noise = draw();
          volume.Voxels.push_back(block < 2 ? static_cast<T>(block * 3) : noise);
        }
      }
    }
  }
  return volume;
}

/// The next coarser level, by the group arithmetic that all pyramids share.
template <typename T>
Dense<T> Coarser(const Dense<T>& fine, const Int3& group, Downsampling method)
{
  Dense<T> coarse;
  coarse.Components = fine.Components;
  for (std::size_t a = 0; a < 3; ++a)
  {
    coarse.Dimensions[a] = CeilDiv(fine.Dimensions[a], group[a]);
  }
  coarse.Voxels.resize(static_cast<std::size_t>(
    coarse.Dimensions[0] * coarse.Dimensions[1] * coarse.Dimensions[2] * coarse.Components));
  DownsampleDense(TypeOf<T>(), reinterpret_cast<const std::byte*>(fine.Voxels.data()),
    fine.Dimensions, fine.Components, group, method,
    reinterpret_cast<std::byte*>(coarse.Voxels.data()));
  return coarse;
}

/// All levels of a layout, made of level 0.
template <typename T>
std::vector<Dense<T>> Pyramid(Dense<T> finest, const PyramidLayout& layout, Downsampling method)
{
  std::vector<Dense<T>> levels{ std::move(finest) };
  for (int l = 1; l < layout.NumberOfLevels(); ++l)
  {
    Int3 group{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      group[a] = layout.Factor(l)[a] / layout.Factor(l - 1)[a];
    }
    levels.push_back(Coarser(levels.back(), group, method));
  }
  return levels;
}

/// All bricks of a level, border included, against the dense level; NaN equals NaN.
template <typename T>
void ExpectBricks(BrickSource& source, int level, const Dense<T>& truth)
{
  const PyramidLayout& layout = source.Info().Layout;
  ASSERT_EQ(layout.Dimensions(level), truth.Dimensions);
  const Int3 bricks = layout.Bricks(level);
  const std::int64_t edge = layout.StoredSize();
  for (std::int64_t i = 0; i < bricks[0] * bricks[1] * bricks[2]; ++i)
  {
    BrickKey key;
    key.Level = static_cast<std::uint8_t>(level);
    key.X = static_cast<std::uint32_t>(i % bricks[0]);
    key.Y = static_cast<std::uint32_t>(i / bricks[0] % bricks[1]);
    key.Z = static_cast<std::uint32_t>(i / bricks[0] / bricks[1]);
    const Result<BrickPointer> brick = source.ReadBrick(key);
    ASSERT_TRUE(brick.Ok()) << brick.GetStatus().Message();
    ASSERT_EQ(brick.Value()->Type, TypeOf<T>());
    ASSERT_EQ(brick.Value()->StoredSize, edge);
    ASSERT_EQ(brick.Value()->Components, truth.Components);
    const T* voxel = reinterpret_cast<const T*>(brick.Value()->Voxels.data());
    for (std::int64_t v = 0; v < edge * edge * edge; ++v, voxel += truth.Components)
    {
      const Int3 at{ std::int64_t{ key.X } * layout.BrickSize() - BrickBorder + v % edge,
        std::int64_t{ key.Y } * layout.BrickSize() - BrickBorder + v / edge % edge,
        std::int64_t{ key.Z } * layout.BrickSize() - BrickBorder + v / edge / edge };
      const T* expected = truth.Clamped(at[0], at[1], at[2]);
      for (int c = 0; c < truth.Components; ++c)
      {
        const bool bothNaN = voxel[c] != voxel[c] && expected[c] != expected[c];
        ASSERT_TRUE(bothNaN || voxel[c] == expected[c])
          << key.ToString() << ", voxel " << at[0] << " " << at[1] << " " << at[2] << ": "
          << +voxel[c] << " instead of " << +expected[c];
      }
    }
  }
}

/// What ExpectRanges() met.
struct RangeCounts
{
  int Regions = 0;
  int Exact = 0;
  int Single = 0;
};

/// All regions of all page levels of a level: the range contains the voxels of the region and
/// BrickBorder more on each side; regions outside are void.
template <typename T>
RangeCounts ExpectRanges(BrickSource& source, int level, const Dense<T>& truth)
{
  RangeCounts counts;
  const PyramidLayout& layout = source.Info().Layout;
  std::int64_t edge = layout.BrickSize();
  for (std::uint8_t page = 0; page <= layout.PageDepth() + 1; ++page, edge *= PageBlockEdge)
  {
    BrickKey first;
    first.Level = static_cast<std::uint8_t>(level);
    first.PageLevel = page;
    const Int3 pages = layout.Pages(level, page);
    const Int3 count{ pages[0] + 1, pages[1] + 1, pages[2] + 1 };
    const auto ranges = source.ReadRanges(first, count);
    EXPECT_TRUE(ranges.Ok()) << ranges.GetStatus().Message();
    if (!ranges ||
      ranges.Value().size() != static_cast<std::size_t>(count[0] * count[1] * count[2]))
    {
      ADD_FAILURE() << "wrong number of ranges";
      return counts;
    }
    for (std::size_t i = 0; i < ranges.Value().size(); ++i)
    {
      const ValueRange& range = ranges.Value()[i];
      const std::int64_t n = static_cast<std::int64_t>(i);
      const Int3 region{ n % count[0], n / count[0] % count[1], n / count[0] / count[1] };
      if (region[0] == pages[0] || region[1] == pages[1] || region[2] == pages[2])
      {
        EXPECT_TRUE(range.IsVoid());
        continue;
      }
      Int3 low{};
      Int3 high{};
      for (std::size_t a = 0; a < 3; ++a)
      {
        low[a] = std::max<std::int64_t>(0, region[a] * edge - BrickBorder);
        high[a] = std::min(truth.Dimensions[a], (region[a] + 1) * edge + BrickBorder);
      }
      ValueRange expected = ValueRange::Void();
      for (std::int64_t z = low[2]; z < high[2]; ++z)
      {
        for (std::int64_t y = low[1]; y < high[1]; ++y)
        {
          const T* row = truth.At(low[0], y, z);
          for (const T* v = row; v != row + (high[0] - low[0]) * truth.Components; ++v)
          {
            expected.Include(static_cast<double>(*v));
          }
        }
      }
      EXPECT_TRUE(range.Contains(expected))
        << "level " << level << " page level " << int{ page } << " region " << region[0] << " "
        << region[1] << " " << region[2] << ": [" << range.Min << ", " << range.Max
        << "] instead of [" << expected.Min << ", " << expected.Max << "]";
      ++counts.Regions;
      counts.Exact += range == expected ? 1 : 0;
      counts.Single += range.IsSingle() ? 1 : 0;
    }
  }
  return counts;
}

} // namespace teravox::test
