// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "RepeatBrickSource.h"

#include "BrickGeometry.h"
#include "Guarded.h"
#include "RepeatPeriod.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace teravox
{

namespace
{
Status Refuse(const std::string& name, const std::string& why)
{
  return Status(StatusCode::InvalidArgument, name + " can't be repeated: " + why);
}

bool Fits(double value, ScalarType type)
{
  return DispatchScalarType(type,
    [&](auto tag)
    {
      using T = decltype(tag);
      // The conversion of what lies outside is undefined, so it is asked first.
      return value >= static_cast<double>(std::numeric_limits<T>::lowest()) &&
        value <= static_cast<double>(std::numeric_limits<T>::max()) &&
        static_cast<double>(static_cast<T>(value)) == value;
    });
}

/// Histogram and range of all copies and the background between them.
void CountBackground(VolumeInfo& info, double background, double copies, double innerVoxels)
{
  const double total = static_cast<double>(info.Layout.Dimensions(0)[0]) *
    static_cast<double>(info.Layout.Dimensions(0)[1]) *
    static_cast<double>(info.Layout.Dimensions(0)[2]);
  const double padding = total - copies * innerVoxels;
  for (double& count : info.Histogram)
  {
    count *= copies;
  }
  if (!(padding > 0))
  {
    return;
  }
  ValueRange single = ValueRange::Void();
  single.Include(background);
  if (!info.Histogram.empty() && info.Range.IsKnown() && info.Range.Contains(single))
  {
    const double bins = static_cast<double>(info.Histogram.size());
    const double width = info.Range.Max - info.Range.Min;
    const double bin = width > 0 ? std::floor((background - info.Range.Min) / width * bins) : 0;
    info.Histogram[static_cast<std::size_t>(std::clamp(bin, 0.0, bins - 1))] += padding;
  }
  else
  {
    // The bins would be others.
    info.Histogram.clear();
  }
  info.Range.Include(single);
}
} // namespace

Int3 RepeatBrickSource::AlignedPitch(const Int3& dimensions, std::int64_t multiple)
{
  Int3 pitch{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    pitch[a] = CeilDiv(dimensions[a], multiple) * multiple;
  }
  return pitch;
}

Result<std::shared_ptr<RepeatBrickSource>> RepeatBrickSource::Make(const RepeatDescription& repeat)
{
  if (!repeat.Inner)
  {
    return Refuse("A volume", "there is no source.");
  }
  VolumeInfo info = repeat.Inner->Info();
  const std::string inner = info.Name.empty() ? "An unnamed volume" : info.Name;
  const Int3 size = info.Layout.Dimensions(0);
  Int3 pitch = repeat.Pitch;
  Int3 total{};
  double copies = 1;
  for (std::size_t a = 0; a < 3; ++a)
  {
    pitch[a] = pitch[a] == 0 ? size[a] : pitch[a];
    if (pitch[a] < size[a])
    {
      return Refuse(inner,
        "the pitch of " + std::to_string(pitch[a]) + " voxels is less than its " +
          std::to_string(size[a]) + " voxels.");
    }
    if (repeat.Repetitions[a] < 1 ||
      __builtin_mul_overflow(pitch[a], repeat.Repetitions[a], &total[a]))
    {
      return Refuse(inner,
        std::to_string(repeat.Repetitions[a]) + " repetitions of " + std::to_string(pitch[a]) +
          " voxels can't be.");
    }
    copies *= static_cast<double>(repeat.Repetitions[a]);
  }
  if (!Fits(repeat.Background, info.Type))
  {
    return Refuse(inner,
      "its voxels are " + std::string(ToString(info.Type)) +
        " and can't have the background value " + std::to_string(repeat.Background) + ".");
  }
  Result<PyramidLayout> layout = PyramidLayout::MakeDefault(
    total, info.Spacing, repeat.BrickSize == 0 ? info.Layout.BrickSize() : repeat.BrickSize);
  if (!layout)
  {
    return Refuse(inner, layout.GetStatus().Message());
  }
  info.Layout = std::move(layout.Value());
  info.Name = !repeat.Name.empty() ? repeat.Name
                                   : inner + ", repeated " + std::to_string(repeat.Repetitions[0]) +
      " x " + std::to_string(repeat.Repetitions[1]) + " x " + std::to_string(repeat.Repetitions[2]);
  CountBackground(info, repeat.Background, copies,
    static_cast<double>(size[0]) * static_cast<double>(size[1]) * static_cast<double>(size[2]));
  auto period = std::make_unique<RepeatPeriod>(repeat.Inner, info, pitch, repeat.Repetitions,
    repeat.Background, repeat.WholeLevelLimit, repeat.MemoryBudget);
  return std::shared_ptr<RepeatBrickSource>(
    new RepeatBrickSource(std::move(info), std::move(period)));
}

RepeatBrickSource::RepeatBrickSource(VolumeInfo info, std::unique_ptr<RepeatPeriod> period)
  : Info_(std::move(info))
  , Period(std::move(period))
{
}

RepeatBrickSource::~RepeatBrickSource() = default;

Result<BrickPointer> RepeatBrickSource::ReadBrick(const BrickKey& key)
{
  return Guarded(key, this->Info_,
    [&]() -> Result<BrickPointer>
    {
      Status status = CheckKey(key, this->Info_);
      if (!status)
      {
        return status;
      }
      const VoxelBox stored = StoredBox(this->Info_.Layout, key);
      const VoxelBox inside = Clamp(stored, this->Info_.Layout.Dimensions(key.Level));
      std::shared_ptr<Brick> brick = MakeEmptyBrick(this->Info_);
      const std::int64_t voxel =
        static_cast<std::int64_t>(SizeOf(this->Info_.Type)) * this->Info_.Components;
      const std::int64_t edge = brick->StoredSize;
      std::int64_t first = 0;
      for (std::size_t a = 3; a-- > 0;)
      {
        first = first * edge + inside.Low[a] - stored.Low[a];
      }
      status = this->Period->ReadVoxels(key.Level, key.Time, inside,
        { brick->Voxels.data() + first * voxel, edge * voxel, edge * edge * voxel });
      if (!status)
      {
        return status;
      }
      RepeatOutermostVoxels(*brick, stored, inside);
      return BrickPointer(std::move(brick));
    });
}

Result<std::vector<ValueRange>> RepeatBrickSource::ReadRanges(
  const BrickKey& first, const Int3& count)
{
  return Guarded(first, this->Info_,
    [&]() -> Result<std::vector<ValueRange>>
    {
      return RangesOfRegions(first, count, this->Info_,
        [&](const BrickKey& region)
        {
          return this->Period->RangeOfVoxels(
            region.Level, region.Time, SupportBox(this->Info_.Layout, region));
        });
    });
}

std::uint64_t RepeatBrickSource::BytesRead() const
{
  return this->Period->Inner()->BytesRead();
}

std::uint64_t RepeatBrickSource::MemoryUsed() const
{
  return this->Period->MemoryUsed() + this->Period->Inner()->MemoryUsed();
}

void RepeatBrickSource::SetMemoryBudget(std::uint64_t bytes)
{
  const std::uint64_t inner = std::min(bytes, std::max(bytes / 2, this->LeastMemory()));
  this->Period->SetMemoryBudget(bytes - inner);
  this->Period->Inner()->SetMemoryBudget(inner);
}

std::uint64_t RepeatBrickSource::LeastMemory() const
{
  return this->Period->Inner()->LeastMemory();
}

} // namespace teravox
