// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BrickTarget.h"

#include "HDF5Dataset.h"

#include <algorithm>
#include <cstring>

namespace teravox
{

namespace
{
/// Rows of voxels in two arrays: the first one, and bytes from row to row and slice to slice.
struct Rows
{
  std::int64_t Count = 0;
  std::int64_t Slices = 0;
  std::ptrdiff_t FromRow = 0;
  std::ptrdiff_t FromSlice = 0;
  std::ptrdiff_t ToRow = 0;
  std::ptrdiff_t ToSlice = 0;
};

// `Bytes` as a constant: a row is a few instructions, and not a call. 0: not known.
template <std::size_t Bytes>
void CopyRows(const Rows& rows, const std::byte* from, std::byte* to, std::size_t bytes)
{
  for (std::int64_t z = 0; z < rows.Slices; ++z)
  {
    const std::byte* a = from + z * rows.FromSlice;
    std::byte* b = to + z * rows.ToSlice;
    for (std::int64_t y = 0; y < rows.Count; ++y, a += rows.FromRow, b += rows.ToRow)
    {
      std::memcpy(b, a, Bytes == 0 ? bytes : Bytes);
    }
  }
}

// The usual rows: of a whole chunk, and of a border.
void CopyRows(const Rows& rows, const std::byte* from, std::byte* to, std::size_t bytes)
{
  switch (bytes)
  {
    case 2:
      return CopyRows<2>(rows, from, to, bytes);
    case 4:
      return CopyRows<4>(rows, from, to, bytes);
    case 8:
      return CopyRows<8>(rows, from, to, bytes);
    case 64:
      return CopyRows<64>(rows, from, to, bytes);
    case 128:
      return CopyRows<128>(rows, from, to, bytes);
    default:
      return CopyRows<0>(rows, from, to, bytes);
  }
}
} // namespace

void PutChunk(
  const Chunk& chunk, const Int3& chunkStart, const HDF5Dataset& dataset, const BrickTarget& target)
{
  const Int3& size = dataset.ChunkSize();
  Int3 low{};
  Int3 high{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    low[a] = std::max(target.Low[a], chunkStart[a]);
    high[a] = std::min(target.High[a], chunkStart[a] + size[a]);
  }
  const std::size_t bytes = target.VoxelBytes;
  const auto count = static_cast<std::size_t>(high[0] - low[0]);
  if (!chunk.Voxels.empty())
  {
    const auto voxel = static_cast<std::ptrdiff_t>(bytes);
    const std::int64_t first =
      ((low[2] - chunkStart[2]) * size[1] + low[1] - chunkStart[1]) * size[0] + low[0] -
      chunkStart[0];
    const Rows rows{ high[1] - low[1], high[2] - low[2], size[0] * voxel, size[0] * size[1] * voxel,
      target.StoredSize * voxel, target.StoredSize * target.StoredSize * voxel };
    CopyRows(rows, chunk.Voxels.data() + first * voxel,
      target.Row(low[1] - target.Start[1], low[2] - target.Start[2]) +
        (low[0] - target.Start[0]) * voxel,
      count * bytes);
    return;
  }
  for (std::int64_t z = low[2]; z < high[2]; ++z)
  {
    for (std::int64_t y = low[1]; y < high[1]; ++y)
    {
      std::byte* to = target.Row(y - target.Start[1], z - target.Start[2]) +
        static_cast<std::size_t>(low[0] - target.Start[0]) * bytes;
      for (std::size_t x = 0; x < count; ++x)
      {
        std::memcpy(to + x * bytes, dataset.Fill().data(), bytes);
      }
    }
  }
}

void RepeatOutside(const BrickTarget& t)
{
  Int3 low{};
  Int3 high{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    low[a] = t.Low[a] - t.Start[a];
    high[a] = t.High[a] - t.Start[a];
  }
  const auto rowBytes = static_cast<std::size_t>(t.StoredSize) * t.VoxelBytes;
  for (std::int64_t z = low[2]; z < high[2]; ++z)
  {
    for (std::int64_t y = low[1]; y < high[1]; ++y)
    {
      std::byte* row = t.Row(y, z);
      const auto voxel = [&](std::int64_t x)
      { return row + static_cast<std::size_t>(x) * t.VoxelBytes; };
      for (std::int64_t x = 0; x < low[0]; ++x)
      {
        std::memcpy(voxel(x), voxel(low[0]), t.VoxelBytes);
      }
      for (std::int64_t x = high[0]; x < t.StoredSize; ++x)
      {
        std::memcpy(voxel(x), voxel(high[0] - 1), t.VoxelBytes);
      }
    }
    for (std::int64_t y = 0; y < t.StoredSize; ++y)
    {
      const std::int64_t inside = std::clamp(y, low[1], high[1] - 1);
      if (inside != y)
      {
        std::memcpy(t.Row(y, z), t.Row(inside, z), rowBytes);
      }
    }
  }
  for (std::int64_t z = 0; z < t.StoredSize; ++z)
  {
    const std::int64_t inside = std::clamp(z, low[2], high[2] - 1);
    if (inside != z)
    {
      std::memcpy(t.Row(0, z), t.Row(0, inside), rowBytes * static_cast<std::size_t>(t.StoredSize));
    }
  }
}

} // namespace teravox
