// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "HDF5BrickSource.h"

#include "ChunkCache.h"
#include "HDF5Dataset.h"
#include "HDF5File.h"
#include "PyramidMetadata.h"
#include "PyramidStatistics.h"
#include "SpareBuffers.h"

#include <algorithm>
#include <cstring>
#include <exception>
#include <utility>

namespace teravox
{

namespace
{
// Of the budget, what may wait for the next bricks.
constexpr std::uint64_t SpareShare = 16;
constexpr std::uint64_t LeastForSpare = std::uint64_t{ 16 } << 20;

std::string Text(const Int3& v)
{
  return std::to_string(v[0]) + " x " + std::to_string(v[1]) + " x " + std::to_string(v[2]);
}

/// A box of voxels of one level that becomes a brick.
struct Target
{
  std::byte* Voxels = nullptr;
  std::size_t VoxelBytes = 1;
  std::int64_t StoredSize = 0;
  Int3 Start{ 0, 0, 0 }; // of the brick with its border; may lie outside the level
  Int3 Low{ 0, 0, 0 };   // the part of it that lies inside
  Int3 High{ 0, 0, 0 };

  std::byte* Row(std::int64_t y, std::int64_t z) const
  {
    return this->Voxels +
      static_cast<std::size_t>((z * this->StoredSize + y) * this->StoredSize) * this->VoxelBytes;
  }
};

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

// Copies what a chunk has of the target; a chunk without voxels is the fill value.
void CopyChunk(
  const Chunk& chunk, const Int3& chunkStart, const HDF5Dataset& dataset, const Target& target)
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

Status CopyRead(const Result<ChunkPointer>& read, const BrickKey& key, const Int3& chunk,
  const HDF5Dataset& dataset, const Target& target)
{
  if (!read.Ok())
  {
    return { read.GetStatus().Code(),
      "Can't read " + key.ToString() + ": " + read.GetStatus().Message() + "." };
  }
  Int3 start{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    start[a] = chunk[a] * dataset.ChunkSize()[a];
  }
  CopyChunk(*read.Value(), start, dataset, target);
  return {};
}

// Repeats the outermost voxels inside the level over what lies outside.
void Clamp(const Target& t)
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
} // namespace

class HDF5BrickSource::Internals
{
public:
  explicit Internals(std::uint64_t budget)
    : Cache(0)
  {
    this->SetMemoryBudget(budget);
  }

  void SetMemoryBudget(std::uint64_t bytes)
  {
    // Small budgets need all of their memory for chunks.
    const std::uint64_t spare =
      bytes < LeastForSpare ? 0 : std::min(bytes / SpareShare, SpareBuffers::Largest);
    this->Spare->SetLimit(spare);
    this->Cache.SetBudget(bytes - spare);
  }

  Status Open(const std::string& fileName, const HDF5OpenOptions& options);
  Status OpenLevels(const PyramidMetadata& metadata);
  Status Gather(const BrickKey& key, Brick& brick);
  Status CheckKey(const BrickKey& key, int pageLevels) const;

  ChunkCache Cache;
  /// Memory of bricks that were let go; the next ones are made in it.
  const std::shared_ptr<SpareBuffers> Spare = std::make_shared<SpareBuffers>();
  VolumeInfo Volume;
  std::shared_ptr<HDF5File> File;
  std::vector<std::shared_ptr<HDF5Dataset>> Levels;
  std::unique_ptr<PyramidStatistics> Statistics;
};

Status HDF5BrickSource::Internals::OpenLevels(const PyramidMetadata& metadata)
{
  for (const std::string& path : metadata.LevelPaths)
  {
    Result<std::shared_ptr<HDF5Dataset>> dataset = HDF5Dataset::Open(this->File, path);
    if (!dataset.Ok())
    {
      return dataset.GetStatus();
    }
    this->Levels.push_back(std::move(dataset.Value()));
    const HDF5Dataset& level = *this->Levels.back();
    const HDF5Dataset& finest = *this->Levels.front();
    if (level.Type() != finest.Type() || level.Components() != finest.Components())
    {
      return { StatusCode::Corrupt,
        "The " + level.Name() + " has another type or number of components than level 0." };
    }
    if (level.Components() > 4)
    {
      return { StatusCode::Unsupported,
        "The " + level.Name() + " has " + std::to_string(level.Components()) +
          " components; at most 4 are possible." };
    }
  }
  return {};
}

Status HDF5BrickSource::Internals::Open(const std::string& fileName, const HDF5OpenOptions& options)
{
  Result<std::shared_ptr<HDF5File>> file = HDF5File::Open(fileName);
  if (!file.Ok())
  {
    return file.GetStatus();
  }
  this->File = std::move(file.Value());
  PyramidMetadata metadata;
  if (options.DatasetPath.empty())
  {
    Result<PyramidMetadata> read = PyramidMetadata::Read(*this->File);
    if (!read.Ok())
    {
      return read.GetStatus();
    }
    metadata = std::move(read.Value());
  }
  else
  {
    const std::string& path = options.DatasetPath;
    metadata.LevelPaths = { path.front() == '/' ? path : "/" + path };
    metadata.Factors = { Int3{ 1, 1, 1 } };
    metadata.ArrayName = path.substr(path.rfind('/') + 1);
  }
  Status status = this->OpenLevels(metadata);
  if (!status.Ok())
  {
    return status;
  }
  const HDF5Dataset& finest = *this->Levels.front();
  Result<PyramidLayout> layout =
    PyramidLayout::Make(finest.Dimensions(), options.BrickSize, metadata.Factors);
  if (!layout.Ok())
  {
    return { layout.GetStatus().Code(),
      "The " + finest.Name() + " can't be used: " + layout.GetStatus().Message() };
  }
  for (int l = 1; l < layout.Value().NumberOfLevels(); ++l)
  {
    const HDF5Dataset& level = *this->Levels[static_cast<std::size_t>(l)];
    if (level.Dimensions() != layout.Value().Dimensions(l))
    {
      return { StatusCode::Corrupt,
        "The " + level.Name() + " has " + Text(level.Dimensions()) + " voxels, but level " +
          std::to_string(l) + " of this pyramid must have " + Text(layout.Value().Dimensions(l)) +
          "." };
    }
  }
  VolumeInfo& info = this->Volume;
  info.Layout = std::move(layout.Value());
  info.Type = finest.Type();
  info.Components = finest.Components();
  info.Labels = metadata.Labels;
  info.CellData = metadata.CellData;
  info.Range = metadata.Range;
  info.Histogram = std::move(metadata.Histogram);
  info.Origin = metadata.Origin;
  info.Spacing = metadata.Spacing;
  info.Direction = metadata.Direction;
  info.ExtentStart = metadata.ExtentStart;
  info.ArrayName = metadata.ArrayName;
  info.Name = finest.Name();
  if (!metadata.StatisticsPath.empty())
  {
    this->Statistics = std::make_unique<PyramidStatistics>(this->File, metadata.StatisticsPath,
      this->Cache, static_cast<std::uint32_t>(this->Levels.size()));
  }
  return {};
}

Status HDF5BrickSource::Internals::CheckKey(const BrickKey& key, int pageLevels) const
{
  const PyramidLayout& layout = this->Volume.Layout;
  if (key.Time != 0 || key.Component != 0 || key.Level >= layout.NumberOfLevels() ||
    key.PageLevel >= pageLevels)
  {
    return { StatusCode::InvalidArgument,
      "There is no " + key.ToString() + " in the " + this->Volume.Name + "." };
  }
  return {};
}

Status HDF5BrickSource::Internals::Gather(const BrickKey& key, Brick& brick)
{
  const PyramidLayout& layout = this->Volume.Layout;
  const HDF5Dataset& dataset = *this->Levels[key.Level];
  const Int3& dimensions = layout.Dimensions(key.Level);
  const Int3 index{ key.X, key.Y, key.Z };
  Target target;
  target.VoxelBytes = dataset.VoxelBytes();
  target.StoredSize = layout.StoredSize();
  Int3 first{};
  Int3 last{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    if (index[a] >= layout.Bricks(key.Level)[a])
    {
      return { StatusCode::InvalidArgument,
        "There is no " + key.ToString() + " in the " + this->Volume.Name + "." };
    }
    target.Start[a] = index[a] * layout.BrickSize() - BrickBorder;
    target.Low[a] = std::max<std::int64_t>(0, target.Start[a]);
    target.High[a] = std::min(dimensions[a], target.Start[a] + target.StoredSize);
    first[a] = target.Low[a] / dataset.ChunkSize()[a];
    last[a] = CeilDiv(target.High[a], dataset.ChunkSize()[a]);
  }
  const auto edge = static_cast<std::size_t>(target.StoredSize);
  const std::size_t bytes = edge * edge * edge * target.VoxelBytes;
  brick.Voxels = this->Spare->Take(bytes);
  brick.Voxels.resize(bytes);
  target.Voxels = brick.Voxels.data();
  // Chunks that other threads are decoding come last: meanwhile there is enough to do.
  std::vector<Int3> busy;
  Int3 chunk{};
  for (chunk[2] = first[2]; chunk[2] < last[2]; ++chunk[2])
  {
    for (chunk[1] = first[1]; chunk[1] < last[1]; ++chunk[1])
    {
      for (chunk[0] = first[0]; chunk[0] < last[0]; ++chunk[0])
      {
        const auto read = this->Cache.TryGet({ key.Level, chunk },
          [&](const ChunkCache::Reserve& reserve) { return dataset.Read(chunk, reserve); });
        if (!read)
        {
          busy.push_back(chunk);
          continue;
        }
        const Status status = CopyRead(*read, key, chunk, dataset, target);
        if (!status.Ok())
        {
          return status;
        }
      }
    }
  }
  for (const Int3& other : busy)
  {
    const Status status =
      CopyRead(this->Cache.Get({ key.Level, other },
                 [&](const ChunkCache::Reserve& reserve) { return dataset.Read(other, reserve); }),
        key, other, dataset, target);
    if (!status.Ok())
    {
      return status;
    }
  }
  Clamp(target);
  return {};
}

HDF5BrickSource::HDF5BrickSource(std::unique_ptr<Internals> internals)
  : Self(std::move(internals))
{
}

HDF5BrickSource::~HDF5BrickSource() = default;

Result<std::shared_ptr<HDF5BrickSource>> HDF5BrickSource::Open(
  const std::string& fileName, const HDF5OpenOptions& options)
{
  try
  {
    auto internals = std::make_unique<Internals>(options.MemoryBudget);
    const Status status = internals->Open(fileName, options);
    if (!status.Ok())
    {
      return status;
    }
    return std::shared_ptr<HDF5BrickSource>(new HDF5BrickSource(std::move(internals)));
  }
  catch (const std::exception& e)
  {
    return Status(StatusCode::ResourceExhausted,
      "Opening the file '" + fileName + "' failed: " + e.what() + ".");
  }
}

const VolumeInfo& HDF5BrickSource::Info() const
{
  return this->Self->Volume;
}

Result<BrickPointer> HDF5BrickSource::ReadBrick(const BrickKey& key)
{
  try
  {
    Status status = this->Self->CheckKey(key, 1);
    const std::shared_ptr<SpareBuffers> spare = this->Self->Spare;
    const std::shared_ptr<Brick> brick(new Brick,
      [spare](Brick* old)
      {
        spare->Give(std::move(old->Voxels));
        delete old;
      });
    if (status.Ok())
    {
      brick->Type = this->Self->Volume.Type;
      brick->Components = this->Self->Volume.Components;
      brick->StoredSize = this->Self->Volume.Layout.StoredSize();
      status = this->Self->Gather(key, *brick);
    }
    return status.Ok() ? Result<BrickPointer>(BrickPointer(brick)) : Result<BrickPointer>(status);
  }
  catch (const std::exception& e)
  {
    return Status(StatusCode::ResourceExhausted,
      "Can't read " + key.ToString() + " of the " + this->Self->Volume.Name + ": " + e.what() +
        ".");
  }
}

Result<std::vector<ValueRange>> HDF5BrickSource::ReadRanges(
  const BrickKey& first, const Int3& count)
{
  // 2^31 voxels are at most 8^10 bricks of 2 voxels along an axis.
  constexpr int pageLevels = 16;
  try
  {
    const Status status = this->Self->CheckKey(first, pageLevels);
    std::int64_t total = 0;
    if (!status.Ok())
    {
      return status;
    }
    if (count[0] < 0 || count[1] < 0 || count[2] < 0 ||
      __builtin_mul_overflow(count[0], count[1], &total) ||
      __builtin_mul_overflow(total, count[2], &total))
    {
      return Status(StatusCode::InvalidArgument, "The number of regions isn't possible.");
    }
    const PyramidLayout& layout = this->Self->Volume.Layout;
    const Int3 start{ first.X, first.Y, first.Z };
    std::int64_t regionSize = layout.BrickSize();
    for (int k = 0; k < first.PageLevel; ++k)
    {
      regionSize *= PageBlockEdge;
    }
    if (this->Self->Statistics)
    {
      return this->Self->Statistics->Read(
        first.Level, layout.Dimensions(first.Level), start, count, regionSize, BrickBorder);
    }
    std::vector<ValueRange> ranges(static_cast<std::size_t>(total), ValueRange::Void());
    for (std::int64_t i = 0; i < total; ++i)
    {
      const Int3 region{ start[0] + i % count[0], start[1] + i / count[0] % count[1],
        start[2] + i / (count[0] * count[1]) };
      const Int3 pages = layout.Pages(first.Level, first.PageLevel);
      if (region[0] < pages[0] && region[1] < pages[1] && region[2] < pages[2])
      {
        ranges[static_cast<std::size_t>(i)] = ValueRange::Unknown();
      }
    }
    return ranges;
  }
  catch (const std::exception& e)
  {
    return Status(StatusCode::ResourceExhausted,
      "Can't read value ranges of the " + this->Self->Volume.Name + ": " + e.what() + ".");
  }
}

std::uint64_t HDF5BrickSource::BytesRead() const
{
  return this->Self->File->BytesRead;
}

std::uint64_t HDF5BrickSource::MemoryUsed() const
{
  return this->Self->Cache.MemoryUsed() + this->Self->Spare->MemoryUsed();
}

void HDF5BrickSource::SetMemoryBudget(std::uint64_t bytes)
{
  this->Self->SetMemoryBudget(bytes);
}

} // namespace teravox
