// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Types.h"

#include <cstddef>
#include <cstring>
#include <vector>

namespace teravox
{

/// The chunks of a box of voxels, numbered with x fastest.
struct ChunkBox
{
  /// Requires: the box starts at a chunk.
  ChunkBox(const Int3& start, const Int3& size, const Int3& chunk)
  {
    for (std::size_t a = 0; a < 3; ++a)
    {
      this->First[a] = start[a] / chunk[a];
      this->Count[a] = CeilDiv(size[a], chunk[a]);
    }
  }
  std::int64_t Number() const { return this->Count[0] * this->Count[1] * this->Count[2]; }
  Int3 Index(std::int64_t i) const
  {
    return { this->First[0] + i % this->Count[0],
      this->First[1] + i / this->Count[0] % this->Count[1],
      this->First[2] + i / (this->Count[0] * this->Count[1]) };
  }

  Int3 First{};
  Int3 Count{};
};

/// Voxels of a part of one box to a part of another one; x fastest in both.
inline void CopyBox(const std::byte* from, const Int3& fromSize, const Int3& fromStart,
  std::byte* to, const Int3& toSize, const Int3& toStart, const Int3& count, std::size_t voxelBytes)
{
  for (std::int64_t z = 0; z < count[2]; ++z)
  {
    for (std::int64_t y = 0; y < count[1]; ++y)
    {
      const std::int64_t a =
        ((fromStart[2] + z) * fromSize[1] + fromStart[1] + y) * fromSize[0] + fromStart[0];
      const std::int64_t b =
        ((toStart[2] + z) * toSize[1] + toStart[1] + y) * toSize[0] + toStart[0];
      std::memcpy(to + static_cast<std::size_t>(b) * voxelBytes,
        from + static_cast<std::size_t>(a) * voxelBytes,
        static_cast<std::size_t>(count[0]) * voxelBytes);
    }
  }
}

/// Repeats one voxel through a buffer.
inline void FillWith(const std::vector<std::byte>& voxel, std::byte* to, std::size_t voxels)
{
  for (std::size_t i = 0; i < voxels; ++i)
  {
    std::memcpy(to + i * voxel.size(), voxel.data(), voxel.size());
  }
}

} // namespace teravox
