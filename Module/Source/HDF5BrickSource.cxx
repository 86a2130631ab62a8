// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "HDF5BrickSource.h"

#include "AMRBoxes.h"
#include "BrickTarget.h"
#include "ChunkCache.h"
#include "HDF5Dataset.h"
#include "HDF5File.h"
#include "HDF5Levels.h"
#include "HDF5Lock.h"
#include "PreviewLevels.h"
#include "PyramidStatistics.h"
#include "ScratchBytes.h"
#include "SpareBuffers.h"

#include <algorithm>
#include <cstring>
#include <exception>
#include <utility>

namespace teravox
{

namespace
{
// Chunks that one call of ReadRanges() asks after: about a microsecond each.
constexpr std::int64_t MostLookups = 1 << 15;

// Of the budget, what may wait for the next bricks.
constexpr std::uint64_t SpareShare = 16;
constexpr std::uint64_t LeastForSpare = std::uint64_t{ 16 } << 20;

Status CantRead(const BrickKey& key, const Status& cause)
{
  return { cause.Code(), "Can't read " + key.ToString() + ": " + cause.Message() + "." };
}

Status CopyRead(const Result<ChunkPointer>& read, const BrickKey& key, const Int3& chunk,
  const HDF5Dataset& dataset, const BrickTarget& target)
{
  if (!read.Ok())
  {
    return CantRead(key, read.GetStatus());
  }
  Int3 start{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    start[a] = chunk[a] * dataset.ChunkSize()[a];
  }
  PutChunk(*read.Value(), start, dataset, target);
  return {};
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
  Status Gather(const BrickKey& key, Brick& brick);
  Status GatherPart(const BrickKey& key, std::size_t part, std::byte* voxels);
  Status GatherPreview(const BrickKey& key, std::size_t part, std::byte* voxels);
  Status GatherBoxes(const BrickKey& key, std::size_t part, std::byte* voxels);
  BrickTarget TargetOf(const BrickKey& key, std::byte* voxels) const;
  Status CheckKey(const BrickKey& key, int pageLevels) const;
  std::vector<ValueRange> RangesOfUnwritten(
    const BrickKey& first, const Int3& count, std::int64_t regionSize, std::int64_t total) const;

  ChunkCache Cache;
  /// Memory of bricks that were let go; the next ones are made in it.
  const std::shared_ptr<SpareBuffers> Spare = std::make_shared<SpareBuffers>();
  VolumeInfo Volume;
  VolumeDescription Description;
  int Channel = 0;
  std::shared_ptr<HDF5File> File;
  HDF5Levels Levels;
  std::unique_ptr<PyramidStatistics> Statistics;
};

Status HDF5BrickSource::Internals::Open(const std::string& fileName, const HDF5OpenOptions& options)
{
  VolumeRequest request;
  request.Path = options.DatasetPath;
  request.Channel = options.Channel;
  request.TimePoint = options.TimePoint;
  Result<OpenedVolume> opened = OpenVolumeFile(fileName, request);
  if (!opened.Ok())
  {
    return opened.GetStatus();
  }
  this->File = std::move(opened.Value().File);
  this->Description = std::move(opened.Value().Description);
  VolumeDescription& d = this->Description;
  const Status status = this->Levels.Open(this->File, d, options.BrickSize, options.PreviewsFrom);
  if (!status.Ok())
  {
    return status;
  }
  const HDF5Dataset& finest = this->Levels.At(0, 0);
  VolumeInfo& info = this->Volume;
  info.Layout = this->Levels.Layout();
  info.Type = finest.Type();
  info.Components = finest.Components() * static_cast<int>(this->Levels.Parts());
  info.Labels = d.Labels;
  info.CellData = d.CellData;
  info.Range = d.Range;
  info.Histogram = d.Histogram;
  info.Origin = d.Origin;
  info.Spacing = d.Spacing;
  info.Direction = d.Direction;
  info.ExtentStart = d.ExtentStart;
  info.ArrayName = d.ArrayName;
  info.Name = finest.Name();
  this->Channel = options.Channel;
  if (!d.StatisticsPath.empty())
  {
    this->Statistics = std::make_unique<PyramidStatistics>(this->File, d.StatisticsPath,
      this->Cache, static_cast<std::uint32_t>(this->Levels.Count() * this->Levels.Parts()));
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
  const Int3 index{ key.X, key.Y, key.Z };
  for (std::size_t a = 0; a < 3; ++a)
  {
    if (index[a] >= layout.Bricks(key.Level)[a])
    {
      return { StatusCode::InvalidArgument,
        "There is no " + key.ToString() + " in the " + this->Volume.Name + "." };
    }
  }
  const auto edge = static_cast<std::size_t>(layout.StoredSize());
  const std::size_t voxels = edge * edge * edge;
  const std::size_t partBytes = this->Levels.At(key.Level, 0).VoxelBytes();
  const std::size_t parts = this->Levels.Parts();
  const std::size_t bytes = voxels * partBytes * parts;
  brick.Voxels = this->Spare->Take(bytes);
  brick.Voxels.resize(bytes);
  const auto gather = this->Description.Levels[key.Level].Preview ? &Internals::GatherPreview
    : this->Description.Boxes                                     ? &Internals::GatherBoxes
                                                                  : &Internals::GatherPart;
  if (parts == 1)
  {
    return (this->*gather)(key, 0, brick.Voxels.data());
  }
  thread_local ScratchBytes kept;
  std::vector<std::byte>& part = kept.Bytes();
  part.resize(voxels * partBytes);
  for (std::size_t p = 0; p < parts; ++p)
  {
    const Status status = (this->*gather)(key, p, part.data());
    if (!status.Ok())
    {
      return status;
    }
    for (std::size_t v = 0; v < voxels; ++v)
    {
      std::memcpy(
        brick.Voxels.data() + (v * parts + p) * partBytes, part.data() + v * partBytes, partBytes);
    }
  }
  kept.Trim();
  return {};
}

BrickTarget HDF5BrickSource::Internals::TargetOf(const BrickKey& key, std::byte* voxels) const
{
  const PyramidLayout& layout = this->Volume.Layout;
  const Int3& dimensions = this->Levels.StoredSize(key.Level);
  const Int3 index{ key.X, key.Y, key.Z };
  BrickTarget target;
  target.VoxelBytes = this->Levels.At(key.Level, 0).VoxelBytes();
  target.StoredSize = layout.StoredSize();
  target.Voxels = voxels;
  for (std::size_t a = 0; a < 3; ++a)
  {
    target.Start[a] = index[a] * layout.BrickSize() - BrickBorder;
    // A brick may lie beyond the voxels that are there, which then are repeated into it.
    target.Low[a] = std::clamp<std::int64_t>(target.Start[a], 0, dimensions[a] - 1);
    target.High[a] =
      std::max(target.Low[a] + 1, std::min(dimensions[a], target.Start[a] + target.StoredSize));
  }
  return target;
}

Status HDF5BrickSource::Internals::GatherPart(
  const BrickKey& key, std::size_t part, std::byte* voxels)
{
  const HDF5Dataset& dataset = this->Levels.At(key.Level, part);
  const std::uint32_t number = this->Levels.NumberOf(key.Level, part);
  const BrickTarget target = this->TargetOf(key, voxels);
  Int3 first{};
  Int3 last{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    first[a] = target.Low[a] / dataset.ChunkSize()[a];
    last[a] = CeilDiv(target.High[a], dataset.ChunkSize()[a]);
  }
  // Chunks that other threads are decoding come last: meanwhile there is enough to do.
  std::vector<Int3> busy;
  Int3 chunk{};
  for (chunk[2] = first[2]; chunk[2] < last[2]; ++chunk[2])
  {
    for (chunk[1] = first[1]; chunk[1] < last[1]; ++chunk[1])
    {
      for (chunk[0] = first[0]; chunk[0] < last[0]; ++chunk[0])
      {
        const auto read = this->Cache.TryGet({ number, chunk },
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
      CopyRead(this->Cache.Get({ number, other },
                 [&](const ChunkCache::Reserve& reserve) { return dataset.Read(other, reserve); }),
        key, other, dataset, target);
    if (!status.Ok())
    {
      return status;
    }
  }
  RepeatOutside(target);
  return {};
}

Status HDF5BrickSource::Internals::GatherPreview(
  const BrickKey& key, std::size_t part, std::byte* voxels)
{
  const BrickTarget target = this->TargetOf(key, voxels);
  const HDF5Dataset& dataset = this->Levels.At(key.Level, part);
  const auto number = this->Levels.NumberOf(key.Level, part);
  previews::Request request;
  request.Dataset = &dataset;
  request.Dimensions = this->Levels.StoredSize(0);
  request.Factor = this->Description.Levels[key.Level].Factor;
  request.Start = target.Start;
  request.Stored = target.StoredSize;
  request.Labels = this->Volume.Labels;
  const Status status = previews::GatherBrick(
    request,
    [&](const Int3& chunk)
    {
      return this->Cache.Get({ number, chunk },
        [&](const ChunkCache::Reserve& reserve) { return dataset.Read(chunk, reserve); });
    },
    voxels);
  return status.Ok() ? status : CantRead(key, status);
}

Status HDF5BrickSource::Internals::GatherBoxes(
  const BrickKey& key, std::size_t part, std::byte* voxels)
{
  const auto last = static_cast<int>(this->Levels.Count()) - 1;
  std::vector<const HDF5Dataset*> arrays;
  for (std::size_t level = this->Levels.Count(); level-- > 0;)
  {
    arrays.push_back(&this->Levels.At(level, part));
  }
  const BrickTarget target = this->TargetOf(key, voxels);
  AMRBoxes::Region region;
  region.Low = target.Low;
  region.High = target.High;
  region.RowBytes = static_cast<std::ptrdiff_t>(target.VoxelBytes) * target.StoredSize;
  region.SliceBytes = region.RowBytes * target.StoredSize;
  region.Voxels = target.Row(target.Low[1] - target.Start[1], target.Low[2] - target.Start[2]) +
    static_cast<std::size_t>(target.Low[0] - target.Start[0]) * target.VoxelBytes;
  const Status status = this->Description.Boxes->Fill(last - key.Level, region, arrays,
    [&](int level, const Int3& chunk)
    {
      return this->Cache.Get(
        { this->Levels.NumberOf(static_cast<std::size_t>(last - level), part), chunk },
        [&](const ChunkCache::Reserve& reserve)
        { return arrays[static_cast<std::size_t>(level)]->Read(chunk, reserve); });
    });
  if (!status.Ok())
  {
    return CantRead(key, status);
  }
  RepeatOutside(target);
  return {};
}

std::vector<ValueRange> HDF5BrickSource::Internals::RangesOfUnwritten(
  const BrickKey& first, const Int3& count, std::int64_t regionSize, std::int64_t total) const
{
  const PyramidLayout& layout = this->Volume.Layout;
  std::vector<const HDF5Dataset*> parts;
  for (std::size_t p = 0; p < this->Levels.Parts(); ++p)
  {
    parts.push_back(&this->Levels.At(first.Level, p));
  }
  // Previews are made of level 0, in whose voxels their regions are looked up.
  const LevelDescription& level = this->Description.Levels[first.Level];
  const Int3& size = this->Levels.StoredSize(level.Preview ? 0 : first.Level);
  const Int3 scale = level.Preview ? level.Factor : Int3{ 1, 1, 1 };
  ValueRange fill = ValueRange::Void();
  for (const HDF5Dataset* part : parts)
  {
    DispatchScalarType(part->Type(),
      [&](auto example)
      {
        for (std::size_t at = 0; at < part->Fill().size(); at += sizeof(example))
        {
          std::memcpy(&example, part->Fill().data() + at, sizeof(example));
          fill.Include(static_cast<double>(example));
        }
      });
  }
  std::vector<ValueRange> ranges(static_cast<std::size_t>(total), ValueRange::Void());
  const Int3 pages = layout.Pages(first.Level, first.PageLevel);
  std::int64_t lookups = MostLookups;
  for (std::int64_t i = 0; i < total; ++i)
  {
    const Int3 region{ first.X + i % count[0], first.Y + i / count[0] % count[1],
      first.Z + i / (count[0] * count[1]) };
    if (region[0] >= pages[0] || region[1] >= pages[1] || region[2] >= pages[2])
    {
      continue;
    }
    bool unwritten = !this->Description.Boxes;
    for (std::size_t p = 0; p < parts.size() && unwritten; ++p)
    {
      Int3 from{};
      Int3 to{};
      for (std::size_t a = 0; a < 3; ++a)
      {
        const std::int64_t edge = parts[p]->ChunkSize()[a];
        const std::int64_t start = region[a] * regionSize;
        const std::int64_t low =
          std::clamp<std::int64_t>((start - BrickBorder) * scale[a], 0, size[a] - 1);
        const std::int64_t high =
          std::clamp<std::int64_t>((start + regionSize + BrickBorder) * scale[a], low + 1, size[a]);
        from[a] = low / edge;
        to[a] = CeilDiv(high, edge);
      }
      unwritten = parts[p]->IsUnwritten(from, to, lookups);
    }
    ranges[static_cast<std::size_t>(i)] = unwritten ? fill : ValueRange::Unknown();
  }
  return ranges;
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
    const std::uint64_t failures = HDF5Lock::ReadFailures();
    const Status status = internals->Open(fileName, options);
    if (HDF5Lock::ReadFailures() != failures)
    {
      // Whatever was seen, there may be more to see.
      return Status(StatusCode::InputOutput,
        "The file '" + fileName + "' can't be read: " + HDF5Lock::LastReadFailure() + ".");
    }
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

const VolumeDescription& HDF5BrickSource::Description() const
{
  return this->Self->Description;
}

const ChannelDescription* HDF5BrickSource::Channel() const
{
  const std::vector<ChannelDescription>& channels = this->Self->Description.Channels;
  const auto index = static_cast<std::size_t>(this->Self->Channel);
  return this->Self->Channel >= 0 && index < channels.size() ? &channels[index] : nullptr;
}

const Int3& HDF5BrickSource::StoredSize(int level) const
{
  return this->Self->Levels.StoredSize(static_cast<std::size_t>(level));
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
    return this->Self->RangesOfUnwritten(first, count, regionSize, total);
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
