// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "RepeatPeriod.h"

#include "Downsampling.h"
#include "RepeatPeriodParts.h"
#include "ScanVoxels.h"

#include <algorithm>
#include <cstring>
#include <numeric>

namespace teravox
{

namespace
{
constexpr std::int64_t CubeEdge = 32;
constexpr std::uint32_t CubeVolume = 1;

RepeatPeriod::Target Offset(
  const RepeatPeriod::Target& target, const Int3& by, std::int64_t voxelBytes)
{
  return { target.Data + by[0] * voxelBytes + by[1] * target.RowBytes + by[2] * target.SliceBytes,
    target.RowBytes, target.SliceBytes };
}

Int3 Minus(const Int3& a, const Int3& b)
{
  return { a[0] - b[0], a[1] - b[1], a[2] - b[2] };
}

RepeatPeriod::Target DenseTarget(
  std::vector<std::byte>& bytes, const Int3& dims, std::int64_t voxelBytes)
{
  bytes.resize(static_cast<std::size_t>(dims[0] * dims[1] * dims[2] * voxelBytes));
  return { bytes.data(), dims[0] * voxelBytes, dims[0] * dims[1] * voxelBytes };
}

/// Copies `size` voxels out of a dense box of `dims` voxels from `first` on.
void CopyBox(const std::byte* from, const Int3& dims, const Int3& first, const Int3& size,
  std::int64_t voxelBytes, const RepeatPeriod::Target& target)
{
  for (std::int64_t z = 0; z < size[2]; ++z)
  {
    for (std::int64_t y = 0; y < size[1]; ++y)
    {
      const std::int64_t voxel = ((first[2] + z) * dims[1] + first[1] + y) * dims[0] + first[0];
      std::memcpy(target.Data + y * target.RowBytes + z * target.SliceBytes,
        from + voxel * voxelBytes, static_cast<std::size_t>(size[0] * voxelBytes));
    }
  }
}

} // namespace

std::int64_t RepeatPeriod::Axis::ClassOf(std::int64_t voxel) const
{
  return this->Classes > this->Period && voxel == this->Voxels - 1 ? this->Period
    : voxel < this->Period                                         ? voxel
                                                                   : voxel % this->Period;
}

std::int64_t RepeatPeriod::Axis::VoxelOf(std::int64_t classIndex) const
{
  return classIndex == this->Period ? this->Voxels - 1 : classIndex;
}

RepeatPeriod::RepeatPeriod(std::shared_ptr<BrickSource> inner, const VolumeInfo& outer,
  const Int3& pitch, const Int3& repetitions, double background, std::int64_t wholeLevelLimit,
  std::uint64_t budget)
  : Inner_(std::move(inner))
  , Outer(outer)
  , Background(background)
  , Cache(0)
  , Budget(0)
{
  this->SetMemoryBudget(budget);
  const VolumeInfo& in = this->Inner_->Info();
  const PyramidLayout& layout = outer.Layout;
  this->BackgroundVoxel.resize(static_cast<std::size_t>(this->VoxelBytes()));
  DispatchScalarType(outer.Type,
    [&](auto tag)
    {
      const auto value = static_cast<decltype(tag)>(background);
      for (std::size_t i = 0; i < this->BackgroundVoxel.size(); i += sizeof(value))
      {
        std::memcpy(this->BackgroundVoxel.data() + i, &value, sizeof(value));
      }
    });
  bool sameFactors = true;
  for (int l = 0; l < layout.NumberOfLevels(); ++l)
  {
    Level level;
    sameFactors =
      sameFactors && l < in.Layout.NumberOfLevels() && in.Layout.Factor(l) == layout.Factor(l);
    level.InnerBacked = sameFactors;
    for (std::size_t a = 0; a < 3; ++a)
    {
      Axis& axis = level.Axes[a];
      const std::int64_t factor = layout.Factor(l)[a];
      const std::int64_t size = in.Layout.Dimensions(0)[a];
      const std::int64_t total = layout.Dimensions(0)[a];
      axis.Voxels = layout.Dimensions(l)[a];
      axis.Period = pitch[a] / std::gcd(pitch[a], factor);
      const bool cut = total % factor != 0;
      axis.Classes = axis.Voxels <= axis.Period ? axis.Voxels : axis.Period + (cut ? 1 : 0);
      axis.Group = l == 0 ? 1 : factor / layout.Factor(l - 1)[a];
      // A single copy without padding ends where the inner volume ends, last groups included.
      const bool alone = repetitions[a] == 1 && pitch[a] == size;
      level.InnerBacked = level.InnerBacked && (pitch[a] % factor == 0 || alone);
      axis.Touch = CeilDiv(size, factor);
      axis.Full = alone ? axis.Touch : size / factor;
    }
    const Int3 classes = level.Classes();
    level.Whole = l > 0 && classes[0] <= wholeLevelLimit && classes[1] <= wholeLevelLimit &&
      classes[2] <= wholeLevelLimit && classes[0] * classes[1] <= wholeLevelLimit &&
      classes[0] * classes[1] * classes[2] <= wholeLevelLimit;
    this->Levels.push_back(level);
  }
}

std::int64_t RepeatPeriod::VoxelBytes() const
{
  return static_cast<std::int64_t>(SizeOf(this->Outer.Type)) * this->Outer.Components;
}

std::uint64_t RepeatPeriod::MemoryUsed() const
{
  std::uint64_t bytes = this->Cache.GetCounters().BytesUsed;
  {
    const std::lock_guard<std::mutex> lock(this->WholeMutex);
    bytes += this->WholeBytes;
  }
  const std::lock_guard<std::mutex> lock(this->RangesMutex);
  return bytes + this->RangesBytes;
}

void RepeatPeriod::SetMemoryBudget(std::uint64_t bytes)
{
  this->Budget = bytes;
  this->Cache.SetBudget(bytes / 8 * 5);
}

RepeatPeriod::Window RepeatPeriod::MakeWindow(const Axis& axis, std::int64_t low, std::int64_t high)
{
  Window window;
  window.Whole = high - low >= axis.Period;
  if (window.Whole)
  {
    // The cut last voxel is a class of its own, and counts only where it is meant.
    window.Length = high == axis.Voxels ? axis.Classes : axis.Period;
    window.Runs.emplace_back(0, window.Length);
    return window;
  }
  window.Length = high - low;
  // Without arithmetic per voxel: a region may be as long as the volume.
  const bool cut = axis.Classes > axis.Period;
  for (std::int64_t i = low; i < high;)
  {
    const std::int64_t c = axis.ClassOf(i);
    std::int64_t count = c == axis.Period ? 1 : std::min(high - i, axis.Period - c);
    if (cut && c < axis.Period)
    {
      count = std::min(count, axis.Voxels - 1 - i);
    }
    if (!window.Runs.empty() && window.Runs.back().second == c)
    {
      window.Runs.back().second = c + count;
    }
    else
    {
      window.Runs.emplace_back(c, c + count);
    }
    i += count;
  }
  return window;
}

Status RepeatPeriod::ReadVoxels(
  int level, std::uint32_t time, const VoxelBox& box, const Target& target)
{
  const Level& l = this->Levels[static_cast<std::size_t>(level)];
  const std::int64_t voxelBytes = this->VoxelBytes();
  std::array<Window, 3> windows;
  for (std::size_t a = 0; a < 3; ++a)
  {
    windows[a] = MakeWindow(l.Axes[a], box.Low[a], box.High[a]);
  }
  std::vector<std::byte> bytes;
  const Int3 dims{ windows[0].Length, windows[1].Length, windows[2].Length };
  const Target window = DenseTarget(bytes, dims, voxelBytes);
  Status status = ForEachRun(windows,
    [&](const VoxelBox& classes, const Int3& offset)
    { return this->ReadClasses(level, time, classes, Offset(window, offset, voxelBytes)); });
  if (!status)
  {
    return status;
  }
  std::array<std::vector<std::int64_t>, 3> places;
  for (std::size_t a = 0; a < 3; ++a)
  {
    for (std::int64_t i = box.Low[a]; i < box.High[a]; ++i)
    {
      places[a].push_back(windows[a].Whole ? l.Axes[a].ClassOf(i) : i - box.Low[a]);
    }
  }
  const std::vector<std::int64_t>& columns = places[0];
  for (std::size_t z = 0; z < places[2].size(); ++z)
  {
    for (std::size_t y = 0; y < places[1].size(); ++y)
    {
      const std::byte* const row =
        window.Data + places[1][y] * window.RowBytes + places[2][z] * window.SliceBytes;
      std::byte* to = target.Data + static_cast<std::int64_t>(y) * target.RowBytes +
        static_cast<std::int64_t>(z) * target.SliceBytes;
      if (!windows[0].Whole)
      {
        std::memcpy(to, row + columns.front() * voxelBytes,
          columns.size() * static_cast<std::size_t>(voxelBytes));
        continue;
      }
      for (const std::int64_t x : columns)
      {
        std::memcpy(to, row + x * voxelBytes, static_cast<std::size_t>(voxelBytes));
        to += voxelBytes;
      }
    }
  }
  return {};
}

Status RepeatPeriod::ReadClasses(
  int level, std::uint32_t time, const VoxelBox& box, const Target& target)
{
  const Level& l = this->Levels[static_cast<std::size_t>(level)];
  if (l.Whole)
  {
    const auto whole = this->RequireWhole(level, time);
    if (whole)
    {
      CopyBox(
        whole.Value()->Voxels.data(), l.Classes(), box.Low, box.Size(), this->VoxelBytes(), target);
    }
    return whole.GetStatus();
  }
  return this->ReadScattered(level, time, box, target);
}

Status RepeatPeriod::ReadScattered(
  int level, std::uint32_t time, const VoxelBox& box, const Target& target)
{
  const Level& l = this->Levels[static_cast<std::size_t>(level)];
  if (!l.InnerBacked)
  {
    return this->ReadMade(level, time, box, target);
  }
  return this->ForEachPart(level, box,
    [&](const VoxelBox& part, Part kind)
    {
      const Target to = Offset(target, Minus(part.Low, box.Low), this->VoxelBytes());
      switch (kind)
      {
        case Part::Inside:
          return this->ReadInner(level, time, part, to);
        case Part::Across:
          return this->ReadMade(level, time, part, to);
        case Part::Background:
        default:
          this->FillBackground(part, to);
          return Status();
      }
    });
}

void RepeatPeriod::FillBackground(const VoxelBox& box, const Target& target) const
{
  const Int3 size = box.Size();
  const std::size_t bytes = this->BackgroundVoxel.size();
  for (std::int64_t z = 0; z < size[2]; ++z)
  {
    for (std::int64_t y = 0; y < size[1]; ++y)
    {
      std::byte* to = target.Data + y * target.RowBytes + z * target.SliceBytes;
      for (std::int64_t x = 0; x < size[0]; ++x, to += bytes)
      {
        std::memcpy(to, this->BackgroundVoxel.data(), bytes);
      }
    }
  }
}

Status RepeatPeriod::ReadInner(
  int level, std::uint32_t time, const VoxelBox& box, const Target& target)
{
  const PyramidLayout& layout = this->Inner_->Info().Layout;
  std::array<std::vector<Segment>, 3> cuts;
  for (std::size_t a = 0; a < 3; ++a)
  {
    cuts[a] = Cut(box.Low[a], box.High[a], layout.BrickSize(), layout.Bricks(level)[a]);
  }
  return ForEachTriple({ cuts[0].size(), cuts[1].size(), cuts[2].size() },
    [&](const std::array<std::size_t, 3>& i)
    {
      Int3 index{};
      VoxelBox part;
      for (std::size_t a = 0; a < 3; ++a)
      {
        index[a] = cuts[a][i[a]].Index;
        part.Low[a] = cuts[a][i[a]].Low;
        part.High[a] = cuts[a][i[a]].High;
      }
      const BrickKey key = KeyOf(InnerVolume, level, time, index);
      const Result<BrickPointer> brick = this->RequireInnerBrick(key);
      if (brick)
      {
        const std::int64_t edge = layout.StoredSize();
        CopyBox(brick.Value()->Voxels.data(), { edge, edge, edge },
          Minus(part.Low, StoredBox(layout, key).Low), part.Size(), this->VoxelBytes(),
          Offset(target, Minus(part.Low, box.Low), this->VoxelBytes()));
      }
      return brick.GetStatus();
    });
}

Status RepeatPeriod::ReadMade(
  int level, std::uint32_t time, const VoxelBox& box, const Target& target)
{
  std::array<std::vector<Segment>, 3> cuts;
  for (std::size_t a = 0; a < 3; ++a)
  {
    for (std::int64_t low = box.Low[a]; low < box.High[a]; low = cuts[a].back().High)
    {
      const std::int64_t index = low / CubeEdge;
      cuts[a].push_back({ index, low, std::min(box.High[a], (index + 1) * CubeEdge) });
    }
  }
  return ForEachTriple({ cuts[0].size(), cuts[1].size(), cuts[2].size() },
    [&](const std::array<std::size_t, 3>& i)
    {
      Int3 index{};
      Int3 first{};
      VoxelBox part;
      for (std::size_t a = 0; a < 3; ++a)
      {
        index[a] = cuts[a][i[a]].Index;
        part.Low[a] = cuts[a][i[a]].Low;
        part.High[a] = cuts[a][i[a]].High;
        first[a] = part.Low[a] - index[a] * CubeEdge;
      }
      const Result<BrickPointer> cube = this->RequireCube(KeyOf(CubeVolume, level, time, index));
      if (cube)
      {
        CopyBox(cube.Value()->Voxels.data(), { CubeEdge, CubeEdge, CubeEdge }, first, part.Size(),
          this->VoxelBytes(), Offset(target, Minus(part.Low, box.Low), this->VoxelBytes()));
      }
      return cube.GetStatus();
    });
}

void RepeatPeriod::Keep(const BrickKey& key, const BrickPointer& brick)
{
  const CacheItem item{ brick, nullptr };
  if (this->Cache.Reserve(item.Bytes()))
  {
    this->Cache.Commit(key, item, item.Bytes());
  }
}

Result<BrickPointer> RepeatPeriod::RequireInnerBrick(const BrickKey& key)
{
  if (const auto item = this->Cache.Find(key))
  {
    return item->Brick;
  }
  Result<BrickPointer> brick = this->Inner_->ReadBrick(key);
  if (brick)
  {
    this->Keep(key, brick.Value());
  }
  return brick;
}

Result<BrickPointer> RepeatPeriod::RequireCube(const BrickKey& key)
{
  if (const auto item = this->Cache.Find(key))
  {
    return item->Brick;
  }
  // One at a time: cubes of coarse levels need the same cubes of finer ones.
  const std::lock_guard<std::recursive_mutex> lock(this->MakeMutex);
  if (this->Cache.Contains(key))
  {
    if (const auto item = this->Cache.Find(key))
    {
      return item->Brick;
    }
  }
  auto cube = std::make_shared<Brick>();
  cube->Type = this->Outer.Type;
  cube->Components = this->Outer.Components;
  cube->StoredSize = static_cast<int>(CubeEdge);
  const Target target =
    DenseTarget(cube->Voxels, { CubeEdge, CubeEdge, CubeEdge }, this->VoxelBytes());
  const Int3 index{ key.X, key.Y, key.Z };
  VoxelBox box;
  for (std::size_t a = 0; a < 3; ++a)
  {
    box.Low[a] = index[a] * CubeEdge;
    box.High[a] = box.Low[a] + CubeEdge;
  }
  const Level& level = this->Levels[key.Level];
  const Status status = this->MakeClasses(key.Level, key.Time, Clamp(box, level.Classes()), target);
  if (!status)
  {
    return status;
  }
  this->Keep(key, cube);
  return BrickPointer(std::move(cube));
}

/// Makes classes from the level before. The cut last voxel lies elsewhere in the volume than its
/// neighbour among the classes: each axis has up to two runs.
Status RepeatPeriod::MakeClasses(
  int level, std::uint32_t time, const VoxelBox& classes, const Target& target)
{
  const Level& l = this->Levels[static_cast<std::size_t>(level)];
  const Level& finer = this->Levels[static_cast<std::size_t>(level) - 1];
  std::array<std::vector<Segment>, 3> runs;
  for (std::size_t a = 0; a < 3; ++a)
  {
    const std::int64_t end = std::min(classes.High[a], l.Axes[a].Period);
    if (classes.Low[a] < end)
    {
      runs[a].push_back({ 0, classes.Low[a], end });
    }
    if (classes.High[a] > l.Axes[a].Period)
    {
      runs[a].push_back({ 1, l.Axes[a].Period, l.Axes[a].Period + 1 });
    }
  }
  const std::int64_t voxelBytes = this->VoxelBytes();
  return ForEachTriple({ runs[0].size(), runs[1].size(), runs[2].size() },
    [&](const std::array<std::size_t, 3>& i)
    {
      VoxelBox children;
      Int3 first{};
      Int3 size{};
      Int3 group{};
      for (std::size_t a = 0; a < 3; ++a)
      {
        const Segment& run = runs[a][i[a]];
        group[a] = l.Axes[a].Group;
        first[a] = run.Low;
        size[a] = run.High - run.Low;
        children.Low[a] = l.Axes[a].VoxelOf(run.Low) * group[a];
        children.High[a] = std::min(children.Low[a] + size[a] * group[a], finer.Axes[a].Voxels);
      }
      std::vector<std::byte> in;
      Status status =
        this->ReadVoxels(level - 1, time, children, DenseTarget(in, children.Size(), voxelBytes));
      if (status)
      {
        std::vector<std::byte> out;
        DenseTarget(out, size, voxelBytes);
        DownsampleDense(this->Outer.Type, in.data(), children.Size(), this->Outer.Components, group,
          this->Outer.Labels ? Downsampling::Mode : Downsampling::Average, out.data());
        CopyBox(out.data(), size, { 0, 0, 0 }, size, voxelBytes,
          Offset(target, Minus(first, classes.Low), voxelBytes));
      }
      return status;
    });
}

Result<std::shared_ptr<const RepeatPeriod::WholeLevel>> RepeatPeriod::RequireWhole(
  int level, std::uint32_t time)
{
  const auto find = [&]() -> std::shared_ptr<const WholeLevel>
  {
    const std::lock_guard<std::mutex> lock(this->WholeMutex);
    const auto found = this->WholeLevels.find({ level, time });
    return found == this->WholeLevels.end() ? nullptr : found->second;
  };
  std::shared_ptr<const WholeLevel> known = find();
  if (known)
  {
    return known;
  }
  const std::lock_guard<std::recursive_mutex> lock(this->MakeMutex);
  known = find();
  if (known)
  {
    return known;
  }
  const Int3 dims = this->Levels[static_cast<std::size_t>(level)].Classes();
  auto whole = std::make_shared<WholeLevel>();
  const Target target = DenseTarget(whole->Voxels, dims, this->VoxelBytes());
  const Status status = this->ReadScattered(level, time, { { 0, 0, 0 }, dims }, target);
  if (!status)
  {
    return status;
  }
  whole->Ranges = CellRanges(dims, this->ScanOf(whole->Voxels, dims));
  const std::lock_guard<std::mutex> wholeLock(this->WholeMutex);
  const std::uint64_t bytes = whole->Voxels.size() + whole->Ranges.MemoryUsed();
  if (this->WholeBytes + bytes > this->Budget / 4)
  {
    this->WholeLevels.clear();
    this->WholeBytes = 0;
  }
  this->WholeBytes += bytes;
  this->WholeLevels[{ level, time }] = whole;
  return std::shared_ptr<const WholeLevel>(std::move(whole));
}

CellRanges::ScanFunction RepeatPeriod::ScanOf(
  const std::vector<std::byte>& voxels, const Int3& dims) const
{
  return DispatchScalarType(this->Outer.Type,
    [&](auto tag) -> CellRanges::ScanFunction
    {
      using T = decltype(tag);
      const auto view = BoxView<const T>::Dense(
        reinterpret_cast<const T*>(voxels.data()), dims, this->Outer.Components);
      return [view](const VoxelBox& box) { return ScanVoxels(view, box); };
    });
}

} // namespace teravox
