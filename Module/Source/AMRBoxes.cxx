// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "AMRBoxes.h"

#include "HDF5Dataset.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <type_traits>

namespace teravox
{

namespace
{
using ReadChunk = std::function<Result<ChunkPointer>(int level, const Int3& chunk)>;

/// Runs of cells out of the chunks of one array. Neighbouring runs mostly lie in one chunk.
class Runs
{
public:
  Runs(int level, const HDF5Dataset& array, const ReadChunk& read)
    : Level(level)
    , Array(array)
    , Read(read)
  {
  }

  /// Cells first...first+count-1, one after another.
  Status Get(std::int64_t first, std::int64_t count, std::vector<std::byte>& cells)
  {
    const std::size_t bytes = this->Array.VoxelBytes();
    cells.resize(static_cast<std::size_t>(count) * bytes);
    const std::int64_t edge = this->Array.ChunkSize()[0];
    std::byte* out = cells.data();
    for (std::int64_t at = first; at < first + count;)
    {
      const std::int64_t chunk = at / edge;
      if (!this->Held || chunk != this->Index)
      {
        this->Held.reset();
        Result<ChunkPointer> got = this->Read(this->Level, { chunk, 0, 0 });
        if (!got.Ok())
        {
          return got.GetStatus();
        }
        this->Held = std::move(got.Value());
        this->Index = chunk;
      }
      const std::int64_t end = std::min(first + count, (chunk + 1) * edge);
      for (; at < end && this->Held->Voxels.empty(); ++at, out += bytes)
      {
        std::memcpy(out, this->Array.Fill().data(), bytes);
      }
      if (at < end)
      {
        const std::size_t length = static_cast<std::size_t>(end - at) * bytes;
        std::memcpy(out,
          this->Held->Voxels.data() + static_cast<std::size_t>(at - chunk * edge) * bytes, length);
        out += length;
        at = end;
      }
    }
    return {};
  }

private:
  int Level;
  const HDF5Dataset& Array;
  const ReadChunk& Read;
  ChunkPointer Held;
  std::int64_t Index = -1;
};

/// Voxels of a region, and which of them have a value.
class Filling
{
public:
  Filling(const AMRBoxes::Region& region, std::size_t voxelBytes)
    : Region(region)
    , VoxelBytes(voxelBytes)
  {
    std::size_t voxels = 1;
    for (std::size_t a = 0; a < 3; ++a)
    {
      this->Size[a] = region.High[a] - region.Low[a];
      voxels *= static_cast<std::size_t>(this->Size[a]);
    }
    this->Filled.assign(voxels, 0);
    this->Open_ = voxels;
  }

  std::size_t Open() const { return this->Open_; }

  /// A row of cells, the first one at `low` in cells that have `ratio` voxels along their edges;
  /// what lies outside, and voxels that have a value, are left alone.
  void Put(const Int3& low, const Int3& ratio, const std::vector<std::byte>& cells)
  {
    const auto count = static_cast<std::int64_t>(cells.size() / this->VoxelBytes);
    Int3 from{};
    Int3 to{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      const std::int64_t end = low[a] + (a == 0 ? count : 1);
      from[a] = std::max(low[a] * ratio[a], this->Region.Low[a]);
      to[a] = std::min(end * ratio[a], this->Region.High[a]);
    }
    for (std::int64_t z = from[2]; z < to[2]; ++z)
    {
      for (std::int64_t y = from[1]; y < to[1]; ++y)
      {
        for (std::int64_t x = from[0]; x < to[0]; ++x)
        {
          this->PutVoxel({ x, y, z },
            cells.data() + static_cast<std::size_t>(x / ratio[0] - low[0]) * this->VoxelBytes);
        }
      }
    }
  }

  /// Gives one value to all that have none.
  void PutRest(const std::vector<std::byte>& value)
  {
    for (std::int64_t z = this->Region.Low[2]; z < this->Region.High[2] && this->Open_ > 0; ++z)
    {
      for (std::int64_t y = this->Region.Low[1]; y < this->Region.High[1]; ++y)
      {
        for (std::int64_t x = this->Region.Low[0]; x < this->Region.High[0]; ++x)
        {
          this->PutVoxel({ x, y, z }, value.data());
        }
      }
    }
  }

private:
  void PutVoxel(const Int3& at, const std::byte* value)
  {
    const std::int64_t x = at[0] - this->Region.Low[0];
    const std::int64_t y = at[1] - this->Region.Low[1];
    const std::int64_t z = at[2] - this->Region.Low[2];
    auto& filled =
      this->Filled[static_cast<std::size_t>((z * this->Size[1] + y) * this->Size[0] + x)];
    if (filled == 0)
    {
      filled = 1;
      --this->Open_;
      std::memcpy(this->Region.Voxels + z * this->Region.SliceBytes + y * this->Region.RowBytes +
          x * static_cast<std::ptrdiff_t>(this->VoxelBytes),
        value, this->VoxelBytes);
    }
  }

  const AMRBoxes::Region& Region;
  std::size_t VoxelBytes;
  Int3 Size{};
  std::vector<std::uint8_t> Filled;
  std::size_t Open_ = 0;
};

std::vector<std::byte> NoValue(const HDF5Dataset& array)
{
  std::vector<std::byte> voxel(array.VoxelBytes());
  DispatchScalarType(array.Type(),
    [&](auto example)
    {
      using T = decltype(example);
      const T nothing = std::is_floating_point_v<T> ? std::numeric_limits<T>::quiet_NaN() : T{ 0 };
      for (std::size_t at = 0; at < voxel.size(); at += sizeof(T))
      {
        std::memcpy(voxel.data() + at, &nothing, sizeof(T));
      }
    });
  return voxel;
}
} // namespace

Status AMRBoxes::Fill(int level, const Region& region,
  const std::vector<const HDF5Dataset*>& arrays, const ReadChunk& read) const
{
  const Int3& own = this->Levels[static_cast<std::size_t>(level)].Ratio;
  Filling filling(region, arrays[static_cast<std::size_t>(level)]->VoxelBytes());
  std::vector<std::byte> cells;
  for (int l = level; l >= 0 && filling.Open() > 0; --l)
  {
    const Level& from = this->Levels[static_cast<std::size_t>(l)];
    Runs runs(l, *arrays[static_cast<std::size_t>(l)], read);
    Int3 ratio{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      ratio[a] = own[a] / from.Ratio[a];
    }
    for (const Box& box : from.Boxes)
    {
      Int3 low{};
      Int3 high{};
      for (std::size_t a = 0; a < 3; ++a)
      {
        low[a] = std::max(region.Low[a] / ratio[a], box.Low[a]);
        high[a] = std::min(CeilDiv(region.High[a], ratio[a]), box.Low[a] + box.Size[a]);
      }
      if (low[0] >= high[0])
      {
        continue;
      }
      for (std::int64_t z = low[2]; z < high[2]; ++z)
      {
        for (std::int64_t y = low[1]; y < high[1]; ++y)
        {
          const std::int64_t first = box.First +
            ((z - box.Low[2]) * box.Size[1] + y - box.Low[1]) * box.Size[0] + low[0] - box.Low[0];
          Status status = runs.Get(first, high[0] - low[0], cells);
          if (!status.Ok())
          {
            return status;
          }
          filling.Put({ low[0], y, z }, ratio, cells);
        }
      }
    }
  }
  if (filling.Open() > 0)
  {
    filling.PutRest(NoValue(*arrays[static_cast<std::size_t>(level)]));
  }
  return {};
}

} // namespace teravox
