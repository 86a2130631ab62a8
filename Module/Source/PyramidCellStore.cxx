// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PyramidCellStore.h"

#include "ChunkEncoder.h"
#include "HDF5Lock.h"
#include "HDF5Types.h"
#include "PyramidFormat.h"
#include "VoxelBoxes.h"

#include <algorithm>
#include <string>
#include <utility>

namespace teravox
{

namespace
{
constexpr std::array<const char*, 2> Names{ "/Range", "/Gradient" };

std::byte* DataOf(PyramidCells& cells, std::size_t dataset)
{
  return dataset == 0 ? cells.Ranges.data() : reinterpret_cast<std::byte*>(cells.Gradients.data());
}

std::size_t CountOf(const Int3& size)
{
  return static_cast<std::size_t>(size[0] * size[1] * size[2]);
}
} // namespace

PyramidCellStore::PyramidCellStore(hid_t file, Description description)
  : File(file)
  , Self(std::move(description))
{
}

Int3 PyramidCellStore::CellsOf(const PyramidLayout& layout, int level, std::int64_t edge)
{
  Int3 cells{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    cells[a] = CeilDiv(layout.Dimensions(level)[a], edge);
  }
  return cells;
}

Int3 PyramidCellStore::ChunkOf(const Int3& cells)
{
  Int3 chunk{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    chunk[a] = std::min(cells[a], PyramidFormat::CellsPerChunk);
  }
  return chunk;
}

std::size_t PyramidCellStore::BytesPerCell(std::size_t dataset) const
{
  return static_cast<std::size_t>(this->Self.Components) *
    (dataset == 0 ? 2 * SizeOf(this->Self.Type) : sizeof(float));
}

// Requires: HDF5Lock held.
Status PyramidCellStore::Open(int level, std::int64_t edge)
{
  if (this->OpenLevel == level && this->OpenEdge == edge)
  {
    return {};
  }
  const std::string group = std::string(PyramidFormat::StatisticsGroup) + "/" +
    std::to_string(level) + "/" + std::to_string(edge);
  this->OpenLevel = -1;
  bool ok = true;
  for (std::size_t d = 0; d < 2; ++d)
  {
    ok = this->Datasets.at(d).Reset() && ok;
    this->Datasets.at(d) =
      HDF5Handle(H5Dopen2(this->File, (group + Names.at(d)).c_str(), H5P_DEFAULT));
    ok = this->Datasets.at(d).Valid() && ok;
  }
  if (!ok)
  {
    return { StatusCode::InputOutput, "the statistics can't be written" };
  }
  this->OpenLevel = level;
  this->OpenEdge = edge;
  return {};
}

Status PyramidCellStore::Load(const Key& key, Chunk& chunk)
{
  const auto [level, edge, z, y, x] = key;
  const Int3 cells = CellsOf(this->Self.Layout, level, edge);
  const Int3 size = ChunkOf(cells);
  const Int3 start{ x * size[0], y * size[1], z * size[2] };
  for (std::size_t d = 0; d < 2; ++d)
  {
    chunk.Voxels.at(d).assign(CountOf(size) * this->BytesPerCell(d), std::byte{ 0 });
  }
  std::vector<std::byte>& ranges = chunk.Voxels[0];
  FillWith(this->Self.Fill, ranges.data(), ranges.size() / this->Self.Fill.size());
  if (this->Stored.count(key) == 0)
  {
    return {};
  }
  const HDF5Lock lock;
  Status status = this->Open(level, edge);
  for (std::size_t d = 0; d < 2 && status.Ok(); ++d)
  {
    const auto values =
      static_cast<hsize_t>(this->Self.Components) * static_cast<hsize_t>(d == 0 ? 2 : 1);
    std::array<hsize_t, 4> from{};
    std::array<hsize_t, 4> count{};
    std::array<hsize_t, 4> stored{};
    const std::array<hsize_t, 4> origin{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      from.at(2 - a) = static_cast<hsize_t>(start.at(a));
      count.at(2 - a) = static_cast<hsize_t>(std::min(size.at(a), cells.at(a) - start.at(a)));
      stored.at(2 - a) = static_cast<hsize_t>(size.at(a));
    }
    count[3] = stored[3] = values;
    const int rank = values > 1 ? 4 : 3;
    const HDF5Handle file(H5Dget_space(this->Datasets.at(d).Get()));
    const HDF5Handle memory(H5Screate_simple(rank, stored.data(), nullptr));
    const hid_t type = HDF5MemoryType(d == 0 ? this->Self.Type : ScalarType::Float32);
    if (H5Sselect_hyperslab(
          file.Get(), H5S_SELECT_SET, from.data(), nullptr, count.data(), nullptr) < 0 ||
      H5Sselect_hyperslab(
        memory.Get(), H5S_SELECT_SET, origin.data(), nullptr, count.data(), nullptr) < 0 ||
      H5Dread(this->Datasets.at(d).Get(), type, memory.Get(), file.Get(), H5P_DEFAULT,
        chunk.Voxels.at(d).data()) < 0)
    {
      status = Status(StatusCode::InputOutput, lock.TakeError());
    }
  }
  return status;
}

Status PyramidCellStore::Store(const Key& key, const Chunk& chunk)
{
  const auto [level, edge, z, y, x] = key;
  const Int3 size = ChunkOf(CellsOf(this->Self.Layout, level, edge));
  const std::array<hsize_t, 4> offset{ static_cast<hsize_t>(z * size[2]),
    static_cast<hsize_t>(y * size[1]), static_cast<hsize_t>(x * size[0]), 0 };
  for (std::size_t d = 0; d < 2; ++d)
  {
    const std::vector<std::byte>& voxels = chunk.Voxels.at(d);
    const std::size_t element = d == 0 ? SizeOf(this->Self.Type) : sizeof(float);
    ChunkEncoder encoder(
      PyramidCompression::Deflate, this->Self.CompressionLevel, voxels.size(), element);
    const ChunkEncoder::Encoded encoded = encoder.Encode(voxels);
    const HDF5Lock lock;
    Status status = this->Open(level, edge);
    if (!status.Ok())
    {
      return status;
    }
    if (H5Dwrite_chunk(this->Datasets.at(d).Get(), H5P_DEFAULT, encoded.FilterMask, offset.data(),
          encoded.Size, encoded.Data) < 0)
    {
      return { StatusCode::InputOutput, lock.TakeError() };
    }
  }
  this->Stored.insert(key);
  return {};
}

Result<PyramidCellStore::Chunk*> PyramidCellStore::Find(const Key& key)
{
  const auto found = this->Chunks.find(key);
  if (found != this->Chunks.end())
  {
    this->Recent.splice(this->Recent.begin(), this->Recent, found->second.Recent);
    return &found->second;
  }
  const Int3 size = ChunkOf(CellsOf(this->Self.Layout, std::get<0>(key), std::get<1>(key)));
  const std::uint64_t bytes = CountOf(size) * (this->BytesPerCell(0) + this->BytesPerCell(1));
  while (!this->Recent.empty() && this->Kept + bytes > this->Budget)
  {
    const auto oldest = this->Chunks.find(this->Recent.back());
    if (oldest->second.Changed)
    {
      Status status = this->Store(oldest->first, oldest->second);
      if (!status.Ok())
      {
        return status;
      }
    }
    this->Kept -= oldest->second.Voxels[0].size() + oldest->second.Voxels[1].size();
    this->Recent.pop_back();
    this->Chunks.erase(oldest);
  }
  Chunk chunk;
  Status status = this->Load(key, chunk);
  if (!status.Ok())
  {
    return status;
  }
  this->Kept += bytes;
  this->Recent.push_front(key);
  chunk.Recent = this->Recent.begin();
  return &this->Chunks.emplace(key, std::move(chunk)).first->second;
}

Status PyramidCellStore::Transfer(int level, std::int64_t edge, PyramidCells& cells, bool write)
{
  const Int3 size = ChunkOf(CellsOf(this->Self.Layout, level, edge));
  Int3 first{};
  Int3 end{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    first[a] = cells.Start[a] / size[a];
    end[a] = CeilDiv(cells.Start[a] + cells.Size[a], size[a]);
  }
  for (std::int64_t z = first[2]; z < end[2]; ++z)
  {
    for (std::int64_t y = first[1]; y < end[1]; ++y)
    {
      for (std::int64_t x = first[0]; x < end[0]; ++x)
      {
        const auto found = this->Find({ level, edge, z, y, x });
        if (!found.Ok())
        {
          return found.GetStatus();
        }
        Chunk& chunk = *found.Value();
        chunk.Changed = chunk.Changed || write;
        const Int3 start{ x * size[0], y * size[1], z * size[2] };
        Int3 inCells{};
        Int3 inChunk{};
        Int3 count{};
        for (std::size_t a = 0; a < 3; ++a)
        {
          const std::int64_t low = std::max(cells.Start[a], start[a]);
          inCells[a] = low - cells.Start[a];
          inChunk[a] = low - start[a];
          count[a] = std::min(cells.Start[a] + cells.Size[a], start[a] + size[a]) - low;
        }
        for (std::size_t d = 0; d < 2; ++d)
        {
          const std::size_t bytes = this->BytesPerCell(d);
          std::byte* const here = chunk.Voxels.at(d).data();
          std::byte* const there = DataOf(cells, d);
          write ? CopyBox(there, cells.Size, inCells, here, size, inChunk, count, bytes)
                : CopyBox(here, size, inChunk, there, cells.Size, inCells, count, bytes);
        }
      }
    }
  }
  return {};
}

Status PyramidCellStore::Write(int level, std::int64_t edge, const PyramidCells& cells)
{
  // They aren't changed then.
  return this->Transfer(level, edge, const_cast<PyramidCells&>(cells), true);
}

Status PyramidCellStore::Read(int level, std::int64_t edge, PyramidCells& cells)
{
  return this->Transfer(level, edge, cells, false);
}

Status PyramidCellStore::Flush()
{
  Status status;
  for (auto& chunk : this->Chunks)
  {
    if (status.Ok() && chunk.second.Changed)
    {
      status = this->Store(chunk.first, chunk.second);
      chunk.second.Changed = false;
    }
  }
  this->Chunks.clear();
  this->Recent.clear();
  this->Kept = 0;
  const HDF5Lock lock;
  this->OpenLevel = -1;
  for (HDF5Handle& dataset : this->Datasets)
  {
    if (!dataset.Reset() && status.Ok())
    {
      status = Status(StatusCode::InputOutput, lock.TakeError());
    }
  }
  return status;
}

} // namespace teravox
