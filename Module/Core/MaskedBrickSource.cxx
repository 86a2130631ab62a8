// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "MaskedBrickSource.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace teravox
{

namespace
{
std::string SizeOfLevel0(const VolumeInfo& info)
{
  const Int3& n = info.Layout.Dimensions(0);
  return std::to_string(n[0]) + " x " + std::to_string(n[1]) + " x " + std::to_string(n[2]);
}
} // namespace

Result<std::shared_ptr<MaskedBrickSource>> MaskedBrickSource::Make(
  std::shared_ptr<BrickSource> source, std::shared_ptr<BrickSource> mask)
{
  const VolumeInfo& of = source->Info();
  const VolumeInfo& by = mask->Info();
  if (by.Components != 1)
  {
    return Status(StatusCode::InvalidArgument,
      "The mask " + by.Name + " has " + std::to_string(by.Components) +
        " components per voxel; it must have one.");
  }
  if (by.Layout.Dimensions(0) != of.Layout.Dimensions(0))
  {
    return Status(StatusCode::InvalidArgument,
      "The mask " + by.Name + " has " + SizeOfLevel0(by) + " voxels, but " + of.Name + " has " +
        SizeOfLevel0(of) + ": a mask needs a value for each voxel.");
  }
  if (!(by.Layout == of.Layout))
  {
    return Status(StatusCode::InvalidArgument,
      "The mask " + by.Name + " has other levels or bricks than " + of.Name +
        ": a pyramid as a mask must be made like that of the volume.");
  }
  return std::shared_ptr<MaskedBrickSource>(
    new MaskedBrickSource(std::move(source), std::move(mask)));
}

MaskedBrickSource::MaskedBrickSource(
  std::shared_ptr<BrickSource> source, std::shared_ptr<BrickSource> mask)
  : BrickSourceAdapter(std::move(source))
  , Mask(std::move(mask))
{
  this->Info_.Masked = true;
  this->Info_.Histogram.clear(); // it is of all voxels
}

Result<BrickPointer> MaskedBrickSource::ReadBrick(const BrickKey& key)
{
  BrickKey ofMask = key;
  ofMask.Time = 0;
  Result<BrickPointer> mask = this->Mask->ReadBrick(ofMask);
  if (!mask)
  {
    return mask;
  }
  Result<BrickPointer> read = this->Source->ReadBrick(key);
  if (!read)
  {
    return read;
  }
  auto masked = std::make_shared<Brick>(*read.Value());
  const Brick& in = *mask.Value();
  masked->Mask.resize(in.Voxels.size() / SizeOf(in.Type));
  DispatchScalarType(in.Type,
    [&](auto zero)
    {
      using T = decltype(zero);
      const auto* values = reinterpret_cast<const T*>(in.Voxels.data());
      for (std::size_t i = 0; i < masked->Mask.size(); ++i)
      {
        masked->Mask[i] = values[i] > 0 ? 1 : 0; // NaN isn't above
      }
    });
  return BrickPointer(std::move(masked));
}

Result<std::vector<ValueRange>> MaskedBrickSource::ReadRanges(
  const BrickKey& first, const Int3& count)
{
  BrickKey ofMask = first;
  ofMask.Time = 0;
  Result<std::vector<ValueRange>> mask = this->Mask->ReadRanges(ofMask, count);
  if (!mask)
  {
    return mask;
  }
  const std::vector<ValueRange>& in = mask.Value();
  const auto isOut = [](const ValueRange& range) { return range.IsVoid() || range.Max <= 0; };
  bool any = false;
  for (const ValueRange& range : in)
  {
    any = any || !isOut(range);
  }
  if (!any)
  {
    return std::vector<ValueRange>(in.size(), ValueRange::Void());
  }
  Result<std::vector<ValueRange>> read = this->Source->ReadRanges(first, count);
  if (!read)
  {
    return read;
  }
  const bool mayBeNaN = IsFloat(this->Mask->Info().Type);
  for (std::size_t i = 0; i < in.size(); ++i)
  {
    ValueRange& range = read.Value()[i];
    if (isOut(in[i]))
    {
      range = ValueRange::Void();
    }
    else if (range.IsSingle() && (mayBeNaN || !(in[i].Min > 0)))
    {
      range.Max = std::nextafter(range.Max, std::numeric_limits<double>::infinity());
    }
  }
  return read;
}

std::uint64_t MaskedBrickSource::BytesRead() const
{
  return this->Source->BytesRead() + this->Mask->BytesRead();
}

std::uint64_t MaskedBrickSource::MemoryUsed() const
{
  return this->Source->MemoryUsed() + this->Mask->MemoryUsed();
}

void MaskedBrickSource::SetMemoryBudget(std::uint64_t bytes)
{
  const std::uint64_t ofSource = std::min(bytes, this->Source->LeastMemory());
  const std::uint64_t ofMask = std::min(bytes - ofSource, this->Mask->LeastMemory());
  const std::uint64_t rest = bytes - ofSource - ofMask;
  this->Source->SetMemoryBudget(ofSource + (rest - rest / 2));
  this->Mask->SetMemoryBudget(ofMask + rest / 2);
}

std::uint64_t MaskedBrickSource::LeastMemory() const
{
  return this->Source->LeastMemory() + this->Mask->LeastMemory();
}

} // namespace teravox
