// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ScaledBrickSource.h"

#include <algorithm>
#include <cmath>

namespace teravox
{

namespace
{
// Outside of these powers of two values are scaled: squares stay far inside the floats, and usual
// volumes are taken as they are.
constexpr int LeastExponent = -20;
constexpr int LargestExponent = 40;

ValueRange Scale(const ValueRange& range, int exponent)
{
  ValueRange scaled = range;
  scaled.Min = std::ldexp(range.Min, -exponent);
  scaled.Max = std::ldexp(range.Max, -exponent);
  return scaled;
}

template <typename T>
void Scale(const std::byte* in, std::byte* out, std::size_t count, int exponent)
{
  const T* from = reinterpret_cast<const T*>(in);
  T* to = reinterpret_cast<T*>(out);
  for (std::size_t i = 0; i < count; ++i)
  {
    to[i] = static_cast<T>(std::ldexp(from[i], -exponent));
  }
}
} // namespace

int ScaleExponent(const VolumeInfo& info)
{
  if (!IsFloat(info.Type) || info.Range.IsVoid())
  {
    return 0;
  }
  double magnitude = 0;
  for (const double end : { info.Range.Min, info.Range.Max })
  {
    magnitude = std::isfinite(end) ? std::max(magnitude, std::abs(end)) : magnitude;
  }
  if (magnitude == 0)
  {
    return 0;
  }
  const int exponent = std::ilogb(magnitude);
  return exponent < LeastExponent || exponent > LargestExponent ? exponent : 0;
}

ScaledBrickSource::ScaledBrickSource(std::shared_ptr<BrickSource> source, int exponent)
  : BrickSourceAdapter(std::move(source))
  , Exponent(exponent)
{
  this->Info_.Range = Scale(this->Info_.Range, exponent);
  for (ValueRange& range : this->Info_.ComponentRanges)
  {
    range = Scale(range, exponent);
  }
}

Result<BrickPointer> ScaledBrickSource::ReadBrick(const BrickKey& key)
{
  Result<BrickPointer> read = this->Source->ReadBrick(key);
  if (!read)
  {
    return read;
  }
  const Brick& brick = *read.Value();
  auto scaled = std::make_shared<Brick>();
  scaled->Type = brick.Type;
  scaled->Components = brick.Components;
  scaled->StoredSize = brick.StoredSize;
  scaled->Mask = brick.Mask;
  scaled->MaskBytes = brick.MaskBytes;
  scaled->Voxels.resize(brick.Voxels.size());
  const std::size_t count = brick.Voxels.size() / SizeOf(brick.Type);
  (brick.Type == ScalarType::Float32 ? Scale<float> : Scale<double>)(brick.Voxels.data(),
    scaled->Voxels.data(), count, this->Exponent);
  return BrickPointer(std::move(scaled));
}

Result<std::vector<ValueRange>> ScaledBrickSource::ReadRanges(
  const BrickKey& first, const Int3& count)
{
  Result<std::vector<ValueRange>> read = this->Source->ReadRanges(first, count);
  if (read)
  {
    for (ValueRange& range : read.Value())
    {
      range = Scale(range, this->Exponent);
    }
  }
  return read;
}

TransferFunction ScaleTransferFunction(TransferFunction function, int exponent)
{
  if (exponent == 0)
  {
    return function;
  }
  TransferFunction scaled = function;
  scaled.Opacity = [opacity = std::move(function.Opacity), exponent](double value)
  { return opacity(std::ldexp(value, exponent)); };
  scaled.Color = [color = std::move(function.Color), exponent](double value, double* rgb)
  { color(std::ldexp(value, exponent), rgb); };
  for (double& knot : scaled.Knots)
  {
    knot = std::ldexp(knot, -exponent);
  }
  for (TransferFunction& label : scaled.Labels)
  {
    label = ScaleTransferFunction(std::move(label), exponent);
  }
  return scaled;
}

} // namespace teravox
