// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "RepeatPeriod.h"
#include "RepeatPeriodParts.h"

#include <algorithm>
#include <utility>

namespace teravox
{

namespace
{
/// A page level of the inner source with at most so many ranges is read once and kept.
constexpr std::int64_t KeptRanges = 32768;
/// A box is described by at most so many ranges of the inner source.
constexpr std::int64_t RangesPerBox = 64;
} // namespace

Result<ValueRange> RepeatPeriod::RangeOfVoxels(int level, std::uint32_t time, const VoxelBox& box)
{
  const Level& l = this->Levels[static_cast<std::size_t>(level)];
  std::array<Window, 3> windows;
  for (std::size_t a = 0; a < 3; ++a)
  {
    windows[a] = MakeWindow(l.Axes[a], box.Low[a], box.High[a]);
  }
  ValueRange range = ValueRange::Void();
  const Status status = ForEachRun(windows,
    [&](const VoxelBox& classes, const Int3&)
    {
      const Result<ValueRange> part = this->RangeOfClasses(level, time, classes);
      if (part)
      {
        range.Include(part.Value());
      }
      return part.GetStatus();
    });
  if (!status)
  {
    return status;
  }
  return range;
}

Result<ValueRange> RepeatPeriod::RangeOfClasses(int level, std::uint32_t time, const VoxelBox& box)
{
  const Level& l = this->Levels[static_cast<std::size_t>(level)];
  if (l.Whole)
  {
    const auto whole = this->RequireWhole(level, time);
    if (!whole)
    {
      return whole.GetStatus();
    }
    return whole.Value()->Ranges.Query(box, this->ScanOf(whole.Value()->Voxels, l.Classes()));
  }
  if (l.InnerBacked)
  {
    return this->RangeOfParts(level, time, box);
  }
  // Averages and modes lie within the values that they are made of: those of the nearest level
  // below that knows its own.
  int finer = level - 1;
  while (finer > 0 && !this->Levels[static_cast<std::size_t>(finer)].InnerBacked)
  {
    --finer;
  }
  VoxelBox children;
  for (std::size_t a = 0; a < 3; ++a)
  {
    const std::int64_t ratio =
      this->Outer.Layout.Factor(level)[a] / this->Outer.Layout.Factor(finer)[a];
    const std::int64_t voxels = this->Levels[static_cast<std::size_t>(finer)].Axes[a].Voxels;
    // The cut last voxel lies at the far end of the volume: then the whole axis counts.
    const bool cut = box.High[a] > l.Axes[a].Period;
    children.Low[a] = cut ? 0 : box.Low[a] * ratio;
    children.High[a] = cut ? voxels : std::min(box.High[a] * ratio, voxels);
  }
  return this->RangeOfVoxels(finer, time, children);
}

Result<ValueRange> RepeatPeriod::RangeOfParts(int level, std::uint32_t time, const VoxelBox& box)
{
  ValueRange background = ValueRange::Void();
  background.Include(this->Background);
  ValueRange range = ValueRange::Void();
  const Status status = this->ForEachPart(level, box,
    [&](VoxelBox part, Part kind)
    {
      int source = level;
      if (kind != Part::Inside)
      {
        range.Include(background);
        // A group that reaches over the end lies between its own finest voxels and the background.
        source = 0;
        for (std::size_t a = 0; a < 3; ++a)
        {
          const std::int64_t factor = this->Outer.Layout.Factor(level)[a];
          part.Low[a] *= factor;
          part.High[a] =
            std::min(part.High[a] * factor, this->Inner_->Info().Layout.Dimensions(0)[a]);
        }
      }
      if (kind == Part::Background)
      {
        return Status();
      }
      const Result<ValueRange> inner = this->RangeOfInner(source, time, part);
      if (inner)
      {
        range.Include(inner.Value());
      }
      return inner.GetStatus();
    });
  if (!status)
  {
    return status;
  }
  return range;
}

Result<ValueRange> RepeatPeriod::RangeOfInner(int level, std::uint32_t time, const VoxelBox& box)
{
  const PyramidLayout& layout = this->Inner_->Info().Layout;
  Int3 edge{ layout.BrickSize(), layout.BrickSize(), layout.BrickSize() };
  for (std::uint8_t pageLevel = 0;; ++pageLevel)
  {
    const Int3 pages = layout.Pages(level, pageLevel);
    Int3 first{};
    Int3 count{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      // As Cut(), by arithmetic: the box may be long.
      first[a] = std::min((box.Low[a] + BrickBorder) / edge[a], pages[a] - 1);
      const std::int64_t last =
        CeilDiv(std::max<std::int64_t>(box.High[a] - BrickBorder, 1), edge[a]) - 1;
      count[a] = std::clamp(last, first[a], pages[a] - 1) - first[a] + 1;
    }
    if (count[0] * count[1] * count[2] > RangesPerBox && pages != Int3{ 1, 1, 1 })
    {
      for (std::size_t a = 0; a < 3; ++a)
      {
        edge[a] *= layout.PageEdge()[a];
      }
      continue;
    }
    BrickKey key = KeyOf(InnerVolume, level, time, first);
    key.PageLevel = pageLevel;
    const Result<std::vector<ValueRange>> ranges = this->RequireInnerRanges(key, count);
    if (!ranges)
    {
      return ranges.GetStatus();
    }
    ValueRange range = ValueRange::Void();
    for (const ValueRange& one : ranges.Value())
    {
      range.Include(one);
    }
    return range;
  }
}

Result<std::vector<ValueRange>> RepeatPeriod::RequireInnerRanges(
  const BrickKey& first, const Int3& count)
{
  const Int3 pages = this->Inner_->Info().Layout.Pages(first.Level, first.PageLevel);
  if (pages[0] > KeptRanges || pages[1] > KeptRanges || pages[2] > KeptRanges ||
    pages[0] * pages[1] > KeptRanges || pages[0] * pages[1] * pages[2] > KeptRanges)
  {
    return this->Inner_->ReadRanges(first, count);
  }
  const std::uint64_t bytes =
    static_cast<std::uint64_t>(pages[0] * pages[1] * pages[2]) * sizeof(ValueRange);
  if (bytes > this->Budget / 8)
  {
    return this->Inner_->ReadRanges(first, count);
  }
  BrickKey all = first;
  all.X = all.Y = all.Z = 0;
  const std::lock_guard<std::mutex> lock(this->RangesMutex);
  auto known = this->InnerRanges.find(all);
  if (known == this->InnerRanges.end())
  {
    Result<std::vector<ValueRange>> ranges = this->Inner_->ReadRanges(all, pages);
    if (!ranges)
    {
      return ranges;
    }
    if (this->RangesBytes + bytes > this->Budget / 8)
    {
      this->InnerRanges.clear();
      this->RangesBytes = 0;
    }
    this->RangesBytes += bytes;
    known = this->InnerRanges.emplace(all, std::move(ranges.Value())).first;
  }
  std::vector<ValueRange> ranges;
  for (std::int64_t z = 0; z < count[2]; ++z)
  {
    for (std::int64_t y = 0; y < count[1]; ++y)
    {
      for (std::int64_t x = 0; x < count[0]; ++x)
      {
        const std::int64_t i = ((first.Z + z) * pages[1] + first.Y + y) * pages[0] + first.X + x;
        ranges.push_back(known->second[static_cast<std::size_t>(i)]);
      }
    }
  }
  return ranges;
}

} // namespace teravox
