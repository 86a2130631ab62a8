// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BrickVoxels.h"

#include <cstddef>
#include <limits>

namespace teravox::test
{

BrickVoxels::BrickVoxels(BrickSource& source, int level)
  : Source(source)
  , Level(level)
  , BrickSize(source.Info().Layout.BrickSize())
  , StoredSize(source.Info().Layout.StoredSize())
{
}

double BrickVoxels::Voxel(std::int64_t i, std::int64_t j, std::int64_t k)
{
  const Int3 index{ i / this->BrickSize, j / this->BrickSize, k / this->BrickSize };
  // Neighbours in a box of 8 x 8 x 8 bricks never share a place.
  const auto place =
    static_cast<std::size_t>((index[0] & 7) | (index[1] & 7) << 3 | (index[2] & 7) << 6);
  Place& kept = this->Places[place];
  // Held while the brick is read, so that a second thread waits for it instead of reading it, too.
  const std::lock_guard<std::mutex> lock(kept.Mutex);
  if (kept.Index != index)
  {
    BrickKey key;
    key.Level = static_cast<std::uint8_t>(this->Level);
    key.X = static_cast<std::uint32_t>(index[0]);
    key.Y = static_cast<std::uint32_t>(index[1]);
    key.Z = static_cast<std::uint32_t>(index[2]);
    const Result<BrickPointer> brick = this->Source.ReadBrick(key);
    kept.Voxels = brick ? brick.Value() : nullptr;
    kept.Index = index;
  }
  if (!kept.Voxels)
  {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const std::int64_t x = i - index[0] * this->BrickSize + BrickBorder;
  const std::int64_t y = j - index[1] * this->BrickSize + BrickBorder;
  const std::int64_t z = k - index[2] * this->BrickSize + BrickBorder;
  const std::int64_t at =
    ((z * this->StoredSize + y) * this->StoredSize + x) * kept.Voxels->Components;
  return DispatchScalarType(kept.Voxels->Type,
    [&](auto zero)
    {
      return static_cast<double>(
        reinterpret_cast<const decltype(zero)*>(kept.Voxels->Voxels.data())[at]);
    });
}

} // namespace teravox::test
