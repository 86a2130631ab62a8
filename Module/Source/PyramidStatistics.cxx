// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PyramidStatistics.h"

#include "PyramidFormat.h"
#include "RangeUnion.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace teravox
{

namespace
{
struct Box
{
  Int3 Low{ 0, 0, 0 };
  Int3 High{ 0, 0, 0 }; // exclusive
};

Box Intersection(const Box& a, const Box& b)
{
  Box r;
  for (std::size_t i = 0; i < 3; ++i)
  {
    r.Low[i] = std::max(a.Low[i], b.Low[i]);
    r.High[i] = std::min(a.High[i], b.High[i]);
  }
  return r;
}

bool IsEmpty(const Box& b)
{
  return b.Low[0] >= b.High[0] || b.Low[1] >= b.High[1] || b.Low[2] >= b.High[2];
}

template <typename T>
T Load(const std::byte* p)
{
  T v{};
  std::memcpy(&v, p, sizeof(T));
  return v;
}

// The union of all components' ranges in one cell.
template <typename T>
ValueRange CellRange(const std::byte* cell, int pairs)
{
  ValueRange r = ValueRange::Void();
  for (int c = 0; c < pairs; ++c)
  {
    const T low = Load<T>(cell + (2 * static_cast<std::size_t>(c)) * sizeof(T));
    const T high = Load<T>(cell + (2 * static_cast<std::size_t>(c) + 1) * sizeof(T));
    // Void cells have low > high, unwritten ones of a NaN fill value NaN: neither widens.
    if (low <= high)
    {
      r.Include(ValueRange{ static_cast<double>(low), static_cast<double>(high) });
    }
  }
  return r;
}

// The range over `cells` of one chunk of statistics; cells are counted from the chunk's start.
template <typename T>
ValueRange BoxRange(const Chunk& chunk, const Int3& chunkSize, int pairs, const Box& cells)
{
  RangeUnion r;
  const std::size_t cellBytes = 2 * static_cast<std::size_t>(pairs) * sizeof(T);
  for (std::int64_t z = cells.Low[2]; z < cells.High[2]; ++z)
  {
    for (std::int64_t y = cells.Low[1]; y < cells.High[1]; ++y)
    {
      const std::int64_t row = (z * chunkSize[1] + y) * chunkSize[0];
      for (std::int64_t x = cells.Low[0]; x < cells.High[0]; ++x)
      {
        r.Include(
          CellRange<T>(chunk.Voxels.data() + static_cast<std::size_t>(row + x) * cellBytes, pairs));
      }
    }
  }
  return r.Get();
}

// Calls f(x, y, z) for all integer points of a box, x fastest, until it returns an error.
template <typename F>
Status ForEach(const Box& box, const F& f)
{
  for (std::int64_t z = box.Low[2]; z < box.High[2]; ++z)
  {
    for (std::int64_t y = box.Low[1]; y < box.High[1]; ++y)
    {
      for (std::int64_t x = box.Low[0]; x < box.High[0]; ++x)
      {
        Status status = f(Int3{ x, y, z });
        if (!status.Ok())
        {
          return status;
        }
      }
    }
  }
  return {};
}
} // namespace

PyramidStatistics::PyramidStatistics(
  std::shared_ptr<HDF5File> file, std::string path, ChunkCache& cache, std::uint32_t firstDataset)
  : File(std::move(file))
  , Path(std::move(path))
  , Cache(cache)
  , Next(firstDataset)
{
}

Result<PyramidStatistics::Table> PyramidStatistics::Open(
  int level, std::int64_t edge, const Int3& dimensions)
{
  const std::lock_guard<std::mutex> lock(this->Mutex);
  const auto key = std::make_pair(level, edge);
  const auto found = this->Tables.find(key);
  if (found != this->Tables.end())
  {
    return found->second;
  }
  const std::string path =
    this->Path + "/" + std::to_string(level) + "/" + std::to_string(edge) + "/Range";
  Result<std::shared_ptr<HDF5Dataset>> dataset = HDF5Dataset::Open(this->File, path);
  if (!dataset.Ok())
  {
    return dataset.GetStatus();
  }
  for (std::size_t a = 0; a < 3; ++a)
  {
    if (dataset.Value()->Dimensions()[a] != CeilDiv(dimensions[a], edge) ||
      dataset.Value()->Components() % 2 != 0)
    {
      return Status(StatusCode::Corrupt,
        "The " + dataset.Value()->Name() + " doesn't have the shape that its level asks for.");
    }
  }
  const Table table{ dataset.Value(), this->Next++ };
  this->Tables.emplace(key, table);
  return table;
}

Result<std::vector<ValueRange>> PyramidStatistics::Read(int level, const Int3& dimensions,
  const Int3& firstRegion, const Int3& count, std::int64_t regionSize, std::int64_t border)
{
  const std::int64_t longest = std::max({ dimensions[0], dimensions[1], dimensions[2] });
  std::int64_t edge = PyramidFormat::CellEdge;
  while (edge * PyramidFormat::CellEdge * 4 <= regionSize && edge < longest)
  {
    edge *= PyramidFormat::CellEdge;
  }
  Result<Table> opened = this->Open(level, edge, dimensions);
  if (!opened.Ok())
  {
    return opened.GetStatus();
  }
  const Table table = opened.Value();
  const Int3 chunkSize = table.Dataset->ChunkSize();
  const int pairs = table.Dataset->Components() / 2;
  const ScalarType type = table.Dataset->Type();

  const auto cellsOf = [&](const Int3& region)
  {
    Box cells;
    for (std::size_t a = 0; a < 3; ++a)
    {
      if (region[a] < 0 || region[a] >= CeilDiv(dimensions[a], regionSize))
      {
        return Box{};
      }
      const std::int64_t start = region[a] * regionSize;
      cells.Low[a] = std::max<std::int64_t>(0, start - border) / edge;
      cells.High[a] = CeilDiv(std::min(dimensions[a], start + regionSize + border), edge);
    }
    return cells;
  };
  const auto chunksOf = [&](const Box& cells)
  {
    Box chunks;
    for (std::size_t a = 0; a < 3; ++a)
    {
      chunks.Low[a] = cells.Low[a] / chunkSize[a];
      chunks.High[a] = CeilDiv(cells.High[a], chunkSize[a]);
    }
    return chunks;
  };

  const auto regionCount = static_cast<std::size_t>(count[0] * count[1] * count[2]);
  std::vector<RangeUnion> parts(regionCount);
  const Box regions{ firstRegion,
    { firstRegion[0] + count[0], firstRegion[1] + count[1], firstRegion[2] + count[2] } };
  // All regions that a chunk takes part in are served while it is at hand: the chunks of a box of
  // regions are walked once, though neighbouring regions share cells.
  Box chunks{ { std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::max(),
                std::numeric_limits<std::int64_t>::max() },
    { 0, 0, 0 } };
  Status status = ForEach(regions,
    [&](const Int3& region) -> Status
    {
      const Box cells = cellsOf(region);
      if (!IsEmpty(cells))
      {
        const Box own = chunksOf(cells);
        for (std::size_t a = 0; a < 3; ++a)
        {
          chunks.Low[a] = std::min(chunks.Low[a], own.Low[a]);
          chunks.High[a] = std::max(chunks.High[a], own.High[a]);
        }
      }
      return {};
    });
  if (IsEmpty(chunks))
  {
    return std::vector<ValueRange>(regionCount, ValueRange::Void());
  }
  status = ForEach(chunks,
    [&](const Int3& index) -> Status
    {
      Result<ChunkPointer> chunk = this->Cache.Get({ table.Number, index },
        [&](const ChunkCache::Reserve& reserve) { return table.Dataset->Read(index, reserve); });
      if (!chunk.Ok())
      {
        return chunk.GetStatus();
      }
      Box covered;
      Box candidates;
      for (std::size_t a = 0; a < 3; ++a)
      {
        covered.Low[a] = index[a] * chunkSize[a];
        covered.High[a] = covered.Low[a] + chunkSize[a];
        const std::int64_t low = covered.Low[a] * edge - border;
        const std::int64_t high = covered.High[a] * edge + border;
        candidates.Low[a] = std::max<std::int64_t>(0, low - edge) / regionSize;
        candidates.High[a] = (high + edge) / regionSize + 1;
      }
      return ForEach(Intersection(candidates, regions),
        [&](const Int3& region) -> Status
        {
          Box cells = Intersection(cellsOf(region), covered);
          if (IsEmpty(cells))
          {
            return {};
          }
          for (std::size_t a = 0; a < 3; ++a)
          {
            cells.Low[a] -= covered.Low[a];
            cells.High[a] -= covered.Low[a];
          }
          const Chunk& content = *chunk.Value();
          const ValueRange range = DispatchScalarType(type,
            [&](auto v)
            {
              using T = decltype(v);
              return content.Voxels.empty() ? CellRange<T>(table.Dataset->Fill().data(), pairs)
                                            : BoxRange<T>(content, chunkSize, pairs, cells);
            });
          const std::int64_t i =
            ((region[2] - firstRegion[2]) * count[1] + region[1] - firstRegion[1]) * count[0] +
            region[0] - firstRegion[0];
          parts[static_cast<std::size_t>(i)].Include(range);
          return {};
        });
    });
  if (!status.Ok())
  {
    return Status(status.Code(),
      "Can't read value ranges of level " + std::to_string(level) + ": " + status.Message() + ".");
  }
  std::vector<ValueRange> ranges;
  ranges.reserve(regionCount);
  for (const RangeUnion& part : parts)
  {
    ranges.push_back(part.Get());
  }
  return ranges;
}

} // namespace teravox
