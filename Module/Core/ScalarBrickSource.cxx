// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ScalarBrickSource.h"

#include "BrickTexels.h"
#include "Components.h"

#include <algorithm>
#include <cmath>

namespace teravox
{

namespace
{
bool IsWide(ScalarType type)
{
  return type == ScalarType::UInt32 || type == ScalarType::Int32 || type == ScalarType::Float64;
}

// Rises with each magnitude, so that ends of ranges become ends of ranges.
template <typename Out, typename In>
Out MagnitudeOf(const In* values, int components)
{
  double sum = 0;
  for (int c = 0; c < components; ++c)
  {
    const auto v = static_cast<double>(values[c]);
    sum += v * v;
  }
  return static_cast<Out>(std::sqrt(sum));
}

template <typename Out, typename In>
void FillMagnitudes(const Brick& in, Brick& out)
{
  const auto* from = reinterpret_cast<const In*>(in.Voxels.data());
  auto* to = reinterpret_cast<Out*>(out.Voxels.data());
  const std::size_t count = out.Voxels.size() / sizeof(Out);
  for (std::size_t i = 0; i < count; ++i)
  {
    to[i] = MagnitudeOf<Out>(from + i * static_cast<std::size_t>(in.Components), in.Components);
  }
}
} // namespace

ScalarBrickSource::ScalarBrickSource(std::shared_ptr<BrickSource> source, int component)
  : BrickSourceAdapter(std::move(source))
  , Component(component)
{
  if (component == Magnitude)
  {
    this->Info_.Type = IsWide(this->Info_.Type) ? ScalarType::Float64 : ScalarType::Float32;
    this->Info_.Labels = false;
  }
  this->Info_.Range = component == Magnitude ? this->RangeOf(this->Info_.Range)
                                             : ComponentRange(this->Info_, component);
  this->Info_.Components = 1;
  this->Info_.ComponentRanges.clear();
  this->Info_.Histogram.clear(); // it is of all components
  this->Info_.Name +=
    component == Magnitude ? ", magnitude" : ", component " + std::to_string(component);
}

ValueRange ScalarBrickSource::RangeOf(const ValueRange& all) const
{
  if (this->Component != Magnitude || all.IsVoid())
  {
    return all;
  }
  const auto of = [this](double value)
  {
    const std::array<double, 4> same{ value, value, value, value };
    const int components = this->Source->Info().Components;
    return IsWide(this->Source->Info().Type)
      ? MagnitudeOf<double>(same.data(), components)
      : static_cast<double>(MagnitudeOf<float>(same.data(), components));
  };
  ValueRange range;
  range.Min = all.Min <= 0 && all.Max >= 0 ? 0 : of(std::min(std::abs(all.Min), std::abs(all.Max)));
  range.Max = of(std::max(std::abs(all.Min), std::abs(all.Max)));
  return range;
}

Result<BrickPointer> ScalarBrickSource::ReadBrick(const BrickKey& key)
{
  Result<BrickPointer> read = this->Source->ReadBrick(key);
  if (!read)
  {
    return read;
  }
  const Brick& brick = *read.Value();
  if (this->Component != Magnitude)
  {
    return BrickPointer(TakeComponent(brick, this->Component));
  }
  auto scalar = std::make_shared<Brick>();
  scalar->Type = this->Info_.Type;
  scalar->StoredSize = brick.StoredSize;
  const std::size_t voxel = SizeOf(brick.Type) * static_cast<std::size_t>(brick.Components);
  scalar->Voxels.resize(brick.Voxels.size() / voxel * SizeOf(scalar->Type));
  DispatchScalarType(brick.Type,
    [&](auto zero)
    {
      using T = decltype(zero);
      scalar->Type == ScalarType::Float64 ? FillMagnitudes<double, T>(brick, *scalar)
                                          : FillMagnitudes<float, T>(brick, *scalar);
    });
  return BrickPointer(std::move(scalar));
}

Result<std::vector<ValueRange>> ScalarBrickSource::ReadRanges(
  const BrickKey& first, const Int3& count)
{
  Result<std::vector<ValueRange>> read = this->Source->ReadRanges(first, count);
  if (read)
  {
    for (ValueRange& range : read.Value())
    {
      range = this->RangeOf(range);
    }
  }
  return read;
}

} // namespace teravox
