// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ArrayBrickSource.h"

#include "BrickGeometry.h"
#include "Downsampling.h"
#include "Guarded.h"
#include "ParallelFor.h"
#include "ScanVoxels.h"

#include <cstring>
#include <utility>

namespace teravox
{

/// One level: where its voxels are, and the cells once somebody asks for ranges.
/// Ready and CellsReady are set last, under the build lock, and read without it.
struct ArrayBrickSource::Level
{
  Int3 Dimensions{ 0, 0, 0 };
  const std::byte* Data = nullptr;
  std::int64_t RowStride = 0; // in scalars
  std::int64_t SliceStride = 0;
  std::vector<std::byte> Own; // empty for level 0
  CellRanges Cells;
  std::atomic<bool> Ready{ false };
  std::atomic<bool> CellsReady{ false };

  template <typename T>
  BoxView<const T> View(int components) const
  {
    return { reinterpret_cast<const T*>(this->Data), this->Dimensions, components, this->RowStride,
      this->SliceStride };
  }
};

namespace
{
Status CheckArray(const ArrayDescription& array)
{
  const auto refuse = [&](const std::string& why)
  { return Status(StatusCode::InvalidArgument, array.Name + " can't be drawn: " + why); };
  if (array.Data == nullptr)
  {
    return refuse("it has no data.");
  }
  if (array.Components < 1 || array.Components > 4)
  {
    return refuse(
      "it has " + std::to_string(array.Components) + " components; 1 to 4 are possible.");
  }
  for (const double edge : array.Spacing)
  {
    if (!(edge > 0) || !std::isfinite(edge))
    {
      return refuse("its spacing must be positive and finite on each axis.");
    }
  }
  const std::int64_t row = array.Dimensions[0] * array.Components;
  const std::int64_t rowStride = array.RowStride == 0 ? row : array.RowStride;
  if (rowStride < row ||
    (array.SliceStride != 0 && array.SliceStride / rowStride < array.Dimensions[1]))
  {
    return refuse("its strides make rows or slices overlap.");
  }
  return {};
}
} // namespace

Result<std::shared_ptr<ArrayBrickSource>> ArrayBrickSource::Make(const ArrayDescription& array)
{
  // First, because the other checks multiply the dimensions.
  Result<PyramidLayout> layout =
    PyramidLayout::MakeDefault(array.Dimensions, array.Spacing, array.BrickSize);
  if (!layout)
  {
    return Status(
      layout.GetStatus().Code(), array.Name + " can't be drawn: " + layout.GetStatus().Message());
  }
  const Status status = CheckArray(array);
  if (!status)
  {
    return status;
  }
  std::shared_ptr<ArrayBrickSource> source(new ArrayBrickSource(array));
  source->Info_.Layout = std::move(layout.Value());
  for (int l = 0; l < source->Info_.Layout.NumberOfLevels(); ++l)
  {
    source->Levels.push_back(std::make_unique<Level>());
    Level& level = *source->Levels.back();
    level.Dimensions = source->Info_.Layout.Dimensions(l);
    level.RowStride = level.Dimensions[0] * array.Components;
    level.SliceStride = level.RowStride * level.Dimensions[1];
  }
  Level& finest = *source->Levels.front();
  finest.Data = static_cast<const std::byte*>(array.Data);
  finest.RowStride = array.RowStride != 0 ? array.RowStride : finest.RowStride;
  finest.SliceStride =
    array.SliceStride != 0 ? array.SliceStride : finest.RowStride * finest.Dimensions[1];
  finest.Ready = true;
  return source;
}

ArrayBrickSource::ArrayBrickSource(const ArrayDescription& array)
  : Owner(array.Owner)
{
  this->Info_.Type = array.Type;
  this->Info_.Components = array.Components;
  this->Info_.Labels = array.Labels;
  this->Info_.CellData = array.CellData;
  this->Info_.Range = array.Range;
  this->Info_.Origin = array.Origin;
  this->Info_.Spacing = array.Spacing;
  this->Info_.Direction = array.Direction;
  this->Info_.ExtentStart = array.ExtentStart;
  this->Info_.ArrayName = array.ArrayName;
  this->Info_.Name = array.Name;
}

ArrayBrickSource::~ArrayBrickSource() = default;

Result<BrickPointer> ArrayBrickSource::ReadBrick(const BrickKey& key)
{
  return Guarded(key, this->Info_,
    [&]() -> Result<BrickPointer>
    {
      const Status status = CheckKey(key, this->Info_);
      if (!status)
      {
        return status;
      }
      const Level& level = this->RequireLevel(key.Level);
      std::shared_ptr<Brick> brick = MakeEmptyBrick(this->Info_);
      const VoxelBox stored = StoredBox(this->Info_.Layout, key);
      const VoxelBox inside = Clamp(stored, level.Dimensions);
      const std::int64_t scalar = static_cast<std::int64_t>(SizeOf(this->Info_.Type));
      const std::int64_t voxel = scalar * this->Info_.Components;
      const std::int64_t edge = brick->StoredSize;
      const std::size_t rowBytes = static_cast<std::size_t>(inside.Size()[0] * voxel);
      for (std::int64_t z = inside.Low[2]; z < inside.High[2]; ++z)
      {
        for (std::int64_t y = inside.Low[1]; y < inside.High[1]; ++y)
        {
          const std::int64_t to =
            ((z - stored.Low[2]) * edge + y - stored.Low[1]) * edge + inside.Low[0] - stored.Low[0];
          const std::int64_t from =
            (y * level.RowStride + z * level.SliceStride) * scalar + inside.Low[0] * voxel;
          std::memcpy(brick->Voxels.data() + to * voxel, level.Data + from, rowBytes);
        }
      }
      RepeatOutermostVoxels(*brick, stored, inside);
      return BrickPointer(std::move(brick));
    });
}

Result<std::vector<ValueRange>> ArrayBrickSource::ReadRanges(
  const BrickKey& first, const Int3& count)
{
  return Guarded(first, this->Info_,
    [&]() -> Result<std::vector<ValueRange>>
    {
      return RangesOfRegions(first, count, this->Info_,
        [&](const BrickKey& region) -> Result<ValueRange>
        {
          const CellRanges& cells = this->RequireCells(region.Level);
          return cells.Query(SupportBox(this->Info_.Layout, region), this->ScanOf(region.Level));
        });
    });
}

Result<ValueRange> ArrayBrickSource::ComputeRange()
{
  return Guarded(BrickKey{}, this->Info_,
    [&]() -> Result<ValueRange>
    {
      const VoxelBox all{ { 0, 0, 0 }, this->Info_.Layout.Dimensions(0) };
      return this->RequireCells(0).Query(all, this->ScanOf(0));
    });
}

std::uint64_t ArrayBrickSource::MemoryUsed() const
{
  return this->Memory.load();
}

const ArrayBrickSource::Level& ArrayBrickSource::RequireLevel(int level)
{
  Level& wanted = *this->Levels[static_cast<std::size_t>(level)];
  if (wanted.Ready.load(std::memory_order_acquire))
  {
    return wanted;
  }
  const std::lock_guard<std::mutex> lock(this->BuildMutex);
  for (int l = 1; l <= level; ++l)
  {
    Level& next = *this->Levels[static_cast<std::size_t>(l)];
    if (next.Ready.load(std::memory_order_relaxed))
    {
      continue;
    }
    Int3 group{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      group[a] = this->Info_.Layout.Factor(l)[a] / this->Info_.Layout.Factor(l - 1)[a];
    }
    DispatchScalarType(this->Info_.Type,
      [&](auto tag) {
        this->BuildLevel<decltype(tag)>(
          *this->Levels[static_cast<std::size_t>(l) - 1], group, next);
      });
    this->Memory += next.Own.size();
    next.Ready.store(true, std::memory_order_release);
  }
  return wanted;
}

template <typename T>
void ArrayBrickSource::BuildLevel(const Level& finer, const Int3& group, Level& level) const
{
  const int components = this->Info_.Components;
  std::vector<std::byte> voxels(
    static_cast<std::size_t>(level.SliceStride * level.Dimensions[2]) * sizeof(T));
  const BoxView<const T> in = finer.View<T>(components);
  const BoxView<T> out =
    BoxView<T>::Dense(reinterpret_cast<T*>(voxels.data()), level.Dimensions, components);
  ParallelFor(level.Dimensions[2],
    [&](std::int64_t z)
    {
      BoxView<const T> slab = in;
      slab.Data = in.Row(0, z * group[2]);
      slab.Dimensions[2] = downsampling::GroupCount(z, group[2], in.Dimensions[2]);
      BoxView<T> slice = out;
      slice.Data = out.Row(0, z);
      slice.Dimensions[2] = 1;
      DownsampleBox(
        slab, group, this->Info_.Labels ? Downsampling::Mode : Downsampling::Average, slice);
    });
  level.Own = std::move(voxels);
  level.Data = level.Own.data();
}

CellRanges::ScanFunction ArrayBrickSource::ScanOf(int level) const
{
  const Level& of = *this->Levels[static_cast<std::size_t>(level)];
  return DispatchScalarType(this->Info_.Type,
    [&](auto tag) -> CellRanges::ScanFunction
    {
      return [view = of.View<decltype(tag)>(this->Info_.Components)](const VoxelBox& box)
      { return ScanVoxels(view, box); };
    });
}

const CellRanges& ArrayBrickSource::RequireCells(int level)
{
  this->RequireLevel(level);
  Level& wanted = *this->Levels[static_cast<std::size_t>(level)];
  if (!wanted.CellsReady.load(std::memory_order_acquire))
  {
    const std::lock_guard<std::mutex> lock(this->BuildMutex);
    if (!wanted.CellsReady.load(std::memory_order_relaxed))
    {
      wanted.Cells = CellRanges(wanted.Dimensions, this->ScanOf(level));
      this->Memory += wanted.Cells.MemoryUsed();
      wanted.CellsReady.store(true, std::memory_order_release);
    }
  }
  return wanted.Cells;
}

} // namespace teravox
