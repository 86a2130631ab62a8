// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "JoinedBrickSource.h"

#include <utility>

namespace teravox
{

namespace
{
ScalarType TypeOfBoth(ScalarType a, ScalarType b)
{
  const auto isExactInFloat = [](ScalarType type)
  { return type == ScalarType::Float32 || (!IsFloat(type) && SizeOf(type) < 4); };
  return a == b                              ? a
    : isExactInFloat(a) && isExactInFloat(b) ? ScalarType::Float32
                                             : ScalarType::Float64;
}

// Every second value of `to`, from the first or the second on.
template <typename Out>
void Fill(const Brick& from, std::size_t component, Brick& to)
{
  auto* out = reinterpret_cast<Out*>(to.Voxels.data()) + component;
  DispatchScalarType(from.Type,
    [&](auto zero)
    {
      using In = decltype(zero);
      const auto* in = reinterpret_cast<const In*>(from.Voxels.data());
      const std::size_t count = from.Voxels.size() / sizeof(In);
      for (std::size_t i = 0; i < count; ++i)
      {
        out[2 * i] = static_cast<Out>(static_cast<double>(in[i])); // which holds all of them
      }
    });
}
} // namespace

Result<std::shared_ptr<JoinedBrickSource>> JoinedBrickSource::Make(
  std::shared_ptr<BrickSource> first, std::shared_ptr<BrickSource> second)
{
  const VolumeInfo& a = first->Info();
  const VolumeInfo& b = second->Info();
  if (a.Components != 1 || b.Components != 1 || a.Masked || b.Masked)
  {
    return Status(StatusCode::InvalidArgument,
      a.Name + " and " + b.Name + " can't be joined: each must have one component per voxel.");
  }
  if (!(a.Layout == b.Layout))
  {
    return Status(StatusCode::InvalidArgument,
      b.Name + " has other voxels, levels or bricks than " + a.Name + ": both must have the same.");
  }
  return std::shared_ptr<JoinedBrickSource>(
    new JoinedBrickSource(std::move(first), std::move(second)));
}

JoinedBrickSource::JoinedBrickSource(
  std::shared_ptr<BrickSource> first, std::shared_ptr<BrickSource> second)
  : BrickSourcePair(std::move(first), std::move(second))
{
  const VolumeInfo& other = this->Other->Info();
  this->Info_.Type = TypeOfBoth(this->Info_.Type, other.Type);
  this->Info_.Components = 2;
  this->Info_.ComponentRanges = { this->Info_.Range, other.Range };
  if (this->Info_.Range.IsKnown() && other.Range.IsKnown())
  {
    this->Info_.Range.Include(other.Range);
  }
  else
  {
    this->Info_.Range = ValueRange::Unknown();
  }
  this->Info_.Histogram.clear();
  this->Info_.Name += " and " + other.Name;
}

Result<BrickPointer> JoinedBrickSource::ReadBrick(const BrickKey& key)
{
  Result<BrickPointer> first = this->Source->ReadBrick(key);
  if (!first)
  {
    return first;
  }
  Result<BrickPointer> second = this->Other->ReadBrick(key);
  if (!second)
  {
    return second;
  }
  const Brick& a = *first.Value();
  auto joined = std::make_shared<Brick>();
  joined->Type = this->Info_.Type;
  joined->Components = 2;
  joined->StoredSize = a.StoredSize;
  joined->Voxels.resize(2 * SizeOf(joined->Type) * (a.Voxels.size() / SizeOf(a.Type)));
  DispatchScalarType(joined->Type,
    [&](auto zero)
    {
      using T = decltype(zero);
      Fill<T>(a, 0, *joined);
      Fill<T>(*second.Value(), 1, *joined);
    });
  return BrickPointer(std::move(joined));
}

Result<std::vector<ValueRange>> JoinedBrickSource::ReadRanges(
  const BrickKey& first, const Int3& count)
{
  Result<std::vector<ValueRange>> ranges = this->Source->ReadRanges(first, count);
  if (!ranges)
  {
    return ranges;
  }
  const Result<std::vector<ValueRange>> other = this->Other->ReadRanges(first, count);
  if (!other)
  {
    return other.GetStatus();
  }
  for (std::size_t i = 0; i < other.Value().size(); ++i)
  {
    ValueRange& range = ranges.Value()[i];
    const ValueRange& beside = other.Value()[i];
    if (beside.IsVoid())
    {
      range = ValueRange::Void();
    }
    else if (!(beside.IsSingle() && beside.Min == range.Min))
    {
      range.WidenSingle();
    }
  }
  return ranges;
}

} // namespace teravox
