// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TruthVolume.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

namespace teravox
{

TruthLevel TruthLevel::FromArray(
  ScalarType type, const void* data, const Int3& dimensions, const Int3& factor)
{
  TruthLevel level;
  level.Dimensions = dimensions;
  level.Factor = factor;
  level.Data = data;
  level.Type = type;
  return level;
}

TruthLevel TruthLevel::FromFunction(
  std::function<double(std::int64_t, std::int64_t, std::int64_t)> function, const Int3& dimensions,
  const Int3& factor)
{
  TruthLevel level;
  level.Dimensions = dimensions;
  level.Factor = factor;
  level.Function = std::move(function);
  return level;
}

double TruthLevel::Voxel(std::int64_t i, std::int64_t j, std::int64_t k) const
{
  if (!this->Data)
  {
    return this->Function(i, j, k);
  }
  const std::int64_t index = i + this->Dimensions[0] * (j + this->Dimensions[1] * k);
  return DispatchScalarType(this->Type,
    [&](auto zero)
    { return static_cast<double>(static_cast<const decltype(zero)*>(this->Data)[index]); });
}

TruthVolume::TruthVolume(std::vector<TruthLevel> levels, const Matrix4& worldFromVoxel,
  TruthInterpolation interpolation, bool cellData)
  : Levels(std::move(levels))
  , WorldFromVoxel_(worldFromVoxel)
  , VoxelFromWorld_(Invert(worldFromVoxel))
  , Interpolation_(interpolation)
{
  assert(!this->Levels.empty());
  assert((this->Levels[0].Factor == Int3{ 1, 1, 1 }));
  for (std::size_t axis = 0; axis < 3; ++axis)
  {
    const double margin = cellData ? 0.0 : 0.5;
    this->BoundsMin_[axis] = margin;
    this->BoundsMax_[axis] = static_cast<double>(this->Levels[0].Dimensions[axis]) - margin;
  }
}

Matrix4 TruthVolume::WorldFromVoxel(const Double3& centerOfFirstVoxel, const Double3& spacing,
  const Matrix3& direction, const Matrix4& worldFromDataset)
{
  Matrix4 datasetFromVoxel = IdentityMatrix();
  for (std::size_t row = 0; row < 3; ++row)
  {
    double shift = 0;
    for (std::size_t column = 0; column < 3; ++column)
    {
      const double entry = direction[3 * row + column] * spacing[column];
      datasetFromVoxel[4 * row + column] = entry;
      shift += 0.5 * entry;
    }
    datasetFromVoxel[4 * row + 3] = centerOfFirstVoxel[row] - shift;
  }
  return Multiply(worldFromDataset, datasetFromVoxel);
}

double TruthVolume::VoxelEdge(int level, std::size_t axis) const
{
  const Matrix4& m = this->WorldFromVoxel_;
  return static_cast<double>(this->Level(level).Factor[axis]) *
    Length({ m[axis], m[4 + axis], m[8 + axis] });
}

double TruthVolume::ClampedVoxel(int level, std::int64_t i, std::int64_t j, std::int64_t k) const
{
  const TruthLevel& l = this->Level(level);
  return l.Voxel(std::clamp<std::int64_t>(i, 0, l.Dimensions[0] - 1),
    std::clamp<std::int64_t>(j, 0, l.Dimensions[1] - 1),
    std::clamp<std::int64_t>(k, 0, l.Dimensions[2] - 1));
}

double TruthVolume::FieldAbove(int level, const Double3& pVoxel, double reference) const
{
  const TruthLevel& l = this->Level(level);
  const double shift = this->Interpolation_ == TruthInterpolation::Linear ? 0.5 : 0.0;
  Int3 base{};
  Double3 fraction{};
  for (std::size_t axis = 0; axis < 3; ++axis)
  {
    const double q = pVoxel[axis] / static_cast<double>(l.Factor[axis]) - shift;
    const double lower = std::floor(q);
    base[axis] = static_cast<std::int64_t>(lower);
    fraction[axis] = q - lower;
  }
  if (this->Interpolation_ == TruthInterpolation::Nearest)
  {
    return this->ClampedVoxel(level, base[0], base[1], base[2]) - reference;
  }
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner)
  {
    double weight = 1;
    Int3 index = base;
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      const bool upper = (corner >> axis & 1) != 0;
      weight *= upper ? fraction[axis] : 1 - fraction[axis];
      index[axis] += upper ? 1 : 0;
    }
    if (weight != 0) // a NaN with weight 0 is no part of the support
    {
      sum += weight * (this->ClampedVoxel(level, index[0], index[1], index[2]) - reference);
    }
  }
  return sum;
}

Double3 TruthVolume::CentralDifference(int level, const Double3& pVoxel, const Double3& step) const
{
  Double3 difference{};
  // Rounding errors of a field that is flat have a direction, but mean none.
  const Double3 voxel = { pVoxel[0] / static_cast<double>(this->Level(level).Factor[0]),
    pVoxel[1] / static_cast<double>(this->Level(level).Factor[1]),
    pVoxel[2] / static_cast<double>(this->Level(level).Factor[2]) };
  const double there = this->ClampedVoxel(level, static_cast<std::int64_t>(std::floor(voxel[0])),
    static_cast<std::int64_t>(std::floor(voxel[1])),
    static_cast<std::int64_t>(std::floor(voxel[2])));
  const double reference = std::isfinite(there) ? there : 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
  {
    const double h = step[axis] * static_cast<double>(this->Level(level).Factor[axis]);
    Double3 front = pVoxel;
    Double3 back = pVoxel;
    front[axis] += h;
    back[axis] -= h;
    difference[axis] =
      this->FieldAbove(level, front, reference) - this->FieldAbove(level, back, reference);
  }
  return difference;
}

} // namespace teravox
