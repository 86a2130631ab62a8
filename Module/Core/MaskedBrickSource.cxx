// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "MaskedBrickSource.h"

#include <algorithm>
#include <cmath>
#include <cstring>
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

Status CheckMask(const VolumeInfo& of, const VolumeInfo& by)
{
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
  return {};
}

void TakeMask(const Brick& mask, Brick& masked)
{
  masked.Mask.resize(mask.Voxels.size() / SizeOf(mask.Type));
  DispatchScalarType(mask.Type,
    [&](auto zero)
    {
      using T = decltype(zero);
      const auto* values = reinterpret_cast<const T*>(mask.Voxels.data());
      for (std::size_t i = 0; i < masked.Mask.size(); ++i)
      {
        masked.Mask[i] = values[i] > 0 ? 1 : 0; // NaN isn't above
      }
    });
}

// The same values in 16 bits.
template <typename Narrow, typename Wide>
void Widen(ScalarType type, Brick& brick)
{
  const auto* values = reinterpret_cast<const Narrow*>(brick.Voxels.data());
  std::vector<std::byte> wide(brick.Voxels.size() * sizeof(Wide));
  std::copy(values, values + brick.Voxels.size(), reinterpret_cast<Wide*>(wide.data()));
  brick.Voxels = std::move(wide);
  brick.Type = type;
}
} // namespace

Result<std::shared_ptr<MaskedBrickSource>> MaskedBrickSource::Make(
  std::shared_ptr<BrickSource> source, std::shared_ptr<BrickSource> mask)
{
  if (Status status = CheckMask(source->Info(), mask->Info()); !status)
  {
    return status;
  }
  return std::shared_ptr<MaskedBrickSource>(
    new MaskedBrickSource(std::move(source), std::move(mask)));
}

Result<std::shared_ptr<MaskedBrickSource>> MaskedBrickSource::MakeLabels(
  std::shared_ptr<BrickSource> source, std::shared_ptr<BrickSource> mask,
  std::vector<std::int64_t> names)
{
  if (!mask->Info().Labels && mask->Info().Layout.NumberOfLevels() > 1)
  {
    return Status(StatusCode::InvalidArgument,
      "The mask " + mask->Info().Name +
        " isn't one of labels: its coarser levels are averages, which belong to no label. Convert "
        "it as labels.");
  }
  if (names.size() > MostNames)
  {
    return Status(StatusCode::Unsupported,
      std::to_string(names.size()) + " labels have functions; " + std::to_string(MostNames) +
        " can be told apart.");
  }
  Result<std::shared_ptr<MaskedBrickSource>> made = Make(std::move(source), std::move(mask));
  if (made)
  {
    VolumeInfo& info = made.Value()->Info_;
    info.MaskLabels = static_cast<int>(names.size()) + 1;
    const bool isWide = MaskBytesOf(info) > 1;
    info.Type = isWide && info.Type == ScalarType::UInt8 ? ScalarType::UInt16
      : isWide && info.Type == ScalarType::Int8          ? ScalarType::Int16
                                                         : info.Type;
    made.Value()->Names = std::move(names);
  }
  return made;
}

MaskedBrickSource::MaskedBrickSource(
  std::shared_ptr<BrickSource> source, std::shared_ptr<BrickSource> mask)
  : BrickSourcePair(std::move(source), std::move(mask))
{
  this->Info_.Masked = true;
  this->Info_.Histogram.clear(); // it is of all voxels
}

Result<BrickPointer> MaskedBrickSource::ReadBrick(const BrickKey& key)
{
  BrickKey ofMask = key;
  ofMask.Time = 0;
  Result<BrickPointer> mask = this->Other->ReadBrick(ofMask);
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
  masked->MaskBytes = MaskBytesOf(this->Info_);
  if (masked->Type != this->Info_.Type)
  {
    masked->Type == ScalarType::UInt8
      ? Widen<std::uint8_t, std::uint16_t>(this->Info_.Type, *masked)
      : Widen<std::int8_t, std::int16_t>(this->Info_.Type, *masked);
  }
  this->Info_.MaskLabels > 0 ? this->TakeLabels(*mask.Value(), *masked)
                             : TakeMask(*mask.Value(), *masked);
  return BrickPointer(std::move(masked));
}

void MaskedBrickSource::TakeLabels(const Brick& mask, Brick& masked) const
{
  const std::size_t voxels = mask.Voxels.size() / SizeOf(mask.Type);
  masked.Mask.resize(voxels * static_cast<std::size_t>(masked.MaskBytes));
  const auto valueOf = [this](double label)
  {
    // No integer that has a name is as large as that.
    constexpr double large = 9e15;
    const double whole = std::abs(label) < large ? std::floor(label) : 0;
    const auto name = static_cast<std::int64_t>(whole);
    const auto at = std::lower_bound(this->Names.begin(), this->Names.end(), name);
    const bool isNamed = at != this->Names.end() && *at == name;
    return static_cast<std::uint16_t>(isNamed ? 2 + (at - this->Names.begin()) : 1);
  };
  DispatchScalarType(mask.Type,
    [&](auto zero)
    {
      using T = decltype(zero);
      const auto* labels = reinterpret_cast<const T*>(mask.Voxels.data());
      T last = labels[0];
      std::uint16_t value = valueOf(static_cast<double>(last));
      for (std::size_t i = 0; i < voxels; ++i)
      {
        if (!(labels[i] == last))
        {
          last = labels[i];
          value = valueOf(static_cast<double>(last));
        }
        if (masked.MaskBytes == 1)
        {
          masked.Mask[i] = static_cast<std::uint8_t>(value);
        }
        else
        {
          std::memcpy(masked.Mask.data() + 2 * i, &value, sizeof(value));
        }
      }
    });
}

Result<std::vector<ValueRange>> MaskedBrickSource::ReadRanges(
  const BrickKey& first, const Int3& count)
{
  if (this->Info_.MaskLabels > 0)
  {
    Result<std::vector<ValueRange>> read = this->Source->ReadRanges(first, count);
    for (std::size_t i = 0; read && i < read.Value().size(); ++i)
    {
      // What has one value needs no voxels; what has a mask beside it does.
      read.Value()[i].WidenSingle();
    }
    return read;
  }
  BrickKey ofMask = first;
  ofMask.Time = 0;
  Result<std::vector<ValueRange>> mask = this->Other->ReadRanges(ofMask, count);
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
  const bool mayBeNaN = IsFloat(this->Other->Info().Type);
  for (std::size_t i = 0; i < in.size(); ++i)
  {
    ValueRange& range = read.Value()[i];
    if (isOut(in[i]))
    {
      range = ValueRange::Void();
    }
    else if (mayBeNaN || !(in[i].Min > 0))
    {
      range.WidenSingle();
    }
  }
  return read;
}

} // namespace teravox
