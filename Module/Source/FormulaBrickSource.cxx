// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "FormulaBrickSource.h"

#include "BrickGeometry.h"
#include "Guarded.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace teravox
{

namespace
{
/// The whole range of an integer type, 0 to 1 for floats.
ValueRange DefaultOutput(ScalarType type)
{
  return DispatchScalarType(type,
    [](auto tag) -> ValueRange
    {
      using T = decltype(tag);
      if constexpr (std::is_floating_point_v<T>)
      {
        return { 0, 1 };
      }
      else
      {
        return { static_cast<double>(std::numeric_limits<T>::lowest()),
          static_cast<double>(std::numeric_limits<T>::max()) };
      }
    });
}

ValueRange LimitsOf(ScalarType type)
{
  return DispatchScalarType(type,
    [](auto tag) -> ValueRange
    {
      using T = decltype(tag);
      return { static_cast<double>(std::numeric_limits<T>::lowest()),
        static_cast<double>(std::numeric_limits<T>::max()) };
    });
}

/// The voxel of a field value: monotone, so that it maps bounds to bounds. NaN stays, or becomes 0.
template <typename T>
T Quantise(double value, const ValueRange& output)
{
  const double scaled = output.Min + value * (output.Max - output.Min);
  if constexpr (std::is_floating_point_v<T>)
  {
    return static_cast<T>(scaled);
  }
  else
  {
    if (!(scaled == scaled))
    {
      return T{ 0 };
    }
    const double least = static_cast<double>(std::numeric_limits<T>::lowest());
    const double most = static_cast<double>(std::numeric_limits<T>::max());
    return static_cast<T>(std::clamp(std::floor(scaled + 0.5), least, most));
  }
}

ValueRange QuantiseRange(ScalarType type, const ValueRange& range, const ValueRange& output)
{
  if (!range.IsKnown())
  {
    return range.IsVoid() && IsFloat(type) ? range : ValueRange::Unknown();
  }
  return DispatchScalarType(type,
    [&](auto tag) -> ValueRange
    {
      using T = decltype(tag);
      return { static_cast<double>(Quantise<T>(range.Min, output)),
        static_cast<double>(Quantise<T>(range.Max, output)) };
    });
}

std::int64_t Place(std::int64_t voxel, std::int64_t factor)
{
  return factor * (2 * voxel + 1) - 1;
}
} // namespace

Result<std::shared_ptr<FormulaBrickSource>> FormulaBrickSource::Make(
  const FormulaDescription& formula)
{
  const auto refuse = [&](const std::string& why)
  {
    return Status(
      StatusCode::InvalidArgument, "The formula volume " + formula.Name + " can't be made: " + why);
  };
  if (!formula.Field)
  {
    return refuse("it has no formula.");
  }
  const ValueRange& output = formula.Output;
  if (!(output == ValueRange::Unknown()) &&
    (!output.IsKnown() || output.IsVoid() || !LimitsOf(formula.Type).Contains(output)))
  {
    return refuse(
      "its output range doesn't fit the type " + std::string(ToString(formula.Type)) + ".");
  }
  for (const double edge : formula.Spacing)
  {
    if (!(edge > 0) || !std::isfinite(edge))
    {
      return refuse("its spacing must be positive and finite on each axis.");
    }
  }
  Result<PyramidLayout> layout =
    PyramidLayout::MakeDefault(formula.Dimensions, formula.Spacing, formula.BrickSize);
  if (!layout)
  {
    return refuse(layout.GetStatus().Message());
  }
  return std::shared_ptr<FormulaBrickSource>(
    new FormulaBrickSource(formula, std::move(layout.Value())));
}

FormulaBrickSource::FormulaBrickSource(const FormulaDescription& formula, PyramidLayout layout)
  : Field(formula.Field)
  , Output(formula.Output == ValueRange::Unknown() ? DefaultOutput(formula.Type) : formula.Output)
{
  this->Info_.Layout = std::move(layout);
  this->Info_.Type = formula.Type;
  this->Info_.CellData = formula.CellData;
  this->Info_.Origin = formula.Origin;
  this->Info_.Spacing = formula.Spacing;
  this->Info_.Direction = formula.Direction;
  this->Info_.ArrayName = formula.ArrayName;
  this->Info_.Name = formula.Name;
  this->Info_.Range = this->RangeOfBox(0, { { 0, 0, 0 }, formula.Dimensions });
}

ValueRange FormulaBrickSource::RangeOfBox(int level, const VoxelBox& box) const
{
  const Int3& factor = this->Info_.Layout.Factor(level);
  Int3 low{};
  Int3 high{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    low[a] = Place(box.Low[a], factor[a]);
    high[a] = Place(box.High[a] - 1, factor[a]);
  }
  return QuantiseRange(this->Info_.Type, this->Field->Bound(low, high, factor), this->Output);
}

Result<BrickPointer> FormulaBrickSource::ReadBrick(const BrickKey& key)
{
  return Guarded(key, this->Info_,
    [&]() -> Result<BrickPointer>
    {
      const Status status = CheckKey(key, this->Info_);
      if (!status)
      {
        return status;
      }
      const VoxelBox stored = StoredBox(this->Info_.Layout, key);
      const VoxelBox inside = Clamp(stored, this->Info_.Layout.Dimensions(key.Level));
      std::shared_ptr<Brick> brick = MakeEmptyBrick(this->Info_);
      const ValueRange range = this->RangeOfBox(key.Level, inside);
      DispatchScalarType(this->Info_.Type,
        [&](auto tag)
        {
          using T = decltype(tag);
          T* const voxels = reinterpret_cast<T*>(brick->Voxels.data());
          if (range.IsSingle() && range.IsKnown())
          {
            std::fill_n(voxels, brick->Voxels.size() / sizeof(T), static_cast<T>(range.Min));
            return;
          }
          this->Evaluate(key.Level, stored, inside, voxels);
          RepeatOutermostVoxels(*brick, stored, inside);
        });
      return BrickPointer(std::move(brick));
    });
}

template <typename T>
void FormulaBrickSource::Evaluate(
  int level, const VoxelBox& stored, const VoxelBox& inside, T* voxels) const
{
  const Int3& factor = this->Info_.Layout.Factor(level);
  const Int3 size = inside.Size();
  Formula::Grid places;
  for (std::size_t a = 0; a < 2; ++a)
  {
    for (std::int64_t i = inside.Low[a]; i < inside.High[a]; ++i)
    {
      places[a].push_back(Place(i, factor[a]));
    }
  }
  // Slice by slice, so that the doubles stay in the processor's cache.
  std::vector<double> values(static_cast<std::size_t>(size[0] * size[1]));
  const std::int64_t edge = stored.High[0] - stored.Low[0];
  for (std::int64_t z = inside.Low[2]; z < inside.High[2]; ++z)
  {
    places[2].assign(1, Place(z, factor[2]));
    this->Field->Fill(places, factor, values.data());
    for (std::int64_t y = 0; y < size[1]; ++y)
    {
      T* const row = voxels +
        ((z - stored.Low[2]) * edge + y + inside.Low[1] - stored.Low[1]) * edge + inside.Low[0] -
        stored.Low[0];
      for (std::int64_t x = 0; x < size[0]; ++x)
      {
        row[x] = Quantise<T>(values[static_cast<std::size_t>(y * size[0] + x)], this->Output);
      }
    }
  }
}

Result<std::vector<ValueRange>> FormulaBrickSource::ReadRanges(
  const BrickKey& first, const Int3& count)
{
  return Guarded(first, this->Info_,
    [&]() -> Result<std::vector<ValueRange>>
    {
      return RangesOfRegions(first, count, this->Info_,
        [&](const BrickKey& region) -> Result<ValueRange>
        { return this->RangeOfBox(region.Level, SupportBox(this->Info_.Layout, region)); });
    });
}

} // namespace teravox
