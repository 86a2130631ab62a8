// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "ArrayBrickSource.h"
#include "NativePicture.h"

#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <utility>
#include <vector>

namespace teravox::test
{

/// A volume and the data values of its field's 0 and 1.
struct Volume
{
  std::shared_ptr<BrickSource> Source;
  double Low = 0;
  double High = 1;

  /// Opacity over shares of the range from Low to High.
  TransferFunction Function(std::vector<double> shares, std::vector<double> opacities) const
  {
    for (double& share : shares)
    {
      share = this->Low + share * (this->High - this->Low);
    }
    return MakeFunction(std::move(shares), std::move(opacities));
  }
  /// Opacity and colour over the range from Low to High, and gradients up to a quarter of it.
  TransferFunction Plane(
    int columns, int rows, const std::function<std::array<float, 4>(double, double)>& node) const
  {
    return MakePlane(
      columns, rows, { this->Low, this->High }, 0.25 * (this->High - this->Low), node);
  }
};

/// A node of such a function: fog of the upper half of the values where gradients are small, two
/// islands, a wall where they are large, and nothing in between.
inline std::array<float, 4> Islands(double value, double gradient)
{
  const auto island = [&](double v, double g, double wide, double tall)
  { return std::max(0.0, 1 - std::hypot((value - v) / wide, (gradient - g) / tall)); };
  const double fog = value > 0.6 && gradient < 0.15 ? 0.03 : 0;
  const double wall = value > 0.75 && value < 0.85 && gradient > 0.5 ? 1 : 0;
  const double opacity =
    std::max({ fog, wall, 0.4 * island(0.45, 0.2, 0.1, 0.25), 0.3 * island(0.62, 0.6, 0.15, 0.3) });
  return { static_cast<float>(value), static_cast<float>(gradient), static_cast<float>(1 - value),
    static_cast<float>(opacity) };
}

/// A field over voxel indices: about 0...1, or without a value (NaN), or infinite.
using VoxelField = std::function<double(const Int3&)>;

/// The field as voxels of any type: integers over their whole range (32-bit ones and doubles over
/// one that floats don't resolve without the brick's offset).
inline Volume MakeVolume(ScalarType type, const Int3& dimensions, int brickSize,
  const VoxelField& field, const Double3& spacing = { 1, 1, 1 })
{
  Volume volume;
  ArrayDescription array;
  DispatchScalarType(type,
    [&](auto zero)
    {
      using T = decltype(zero);
      using Limits = std::numeric_limits<T>;
      volume.Low = Limits::is_integer ? static_cast<double>(Limits::lowest()) : -1;
      volume.High = Limits::is_integer ? static_cast<double>(Limits::max()) : 2;
      if (sizeof(T) == 4 && Limits::is_integer)
      {
        volume.Low = 1e9;
        volume.High = 1e9 + 5000;
      }
      if (sizeof(T) == 8)
      {
        volume.Low = 1e8;
        volume.High = 1e8 + 3;
      }
      const auto voxels = std::make_shared<std::vector<T>>();
      Int3 at{};
      for (at[2] = 0; at[2] < dimensions[2]; ++at[2])
      {
        for (at[1] = 0; at[1] < dimensions[1]; ++at[1])
        {
          for (at[0] = 0; at[0] < dimensions[0]; ++at[0])
          {
            const double v = volume.Low + field(at) * (volume.High - volume.Low);
            voxels->push_back(Limits::is_integer
                ? static_cast<T>(std::floor(std::clamp(v, volume.Low, volume.High)))
                : static_cast<T>(v));
          }
        }
      }
      array.Data = voxels->data();
      array.Owner = voxels;
      array.Range = ValueRange::Void();
      for (const T v : *voxels)
      {
        if (std::isfinite(static_cast<double>(v)))
        {
          array.Range.Include(static_cast<double>(v));
        }
      }
    });
  array.Type = type;
  array.Dimensions = dimensions;
  array.BrickSize = brickSize;
  array.Spacing = spacing;
  array.Origin = { 0.5 * spacing[0], 0.5 * spacing[1], 0.5 * spacing[2] };
  volume.Source = ArrayBrickSource::Make(array).Value();
  return volume;
}

/// Waves, a wall, a block of one value, emptiness and a little noise: something for each way in
/// which a brick can be drawn.
inline VoxelField Landscape(const Int3& dimensions, unsigned seed, bool holes = false)
{
  return [=](const Int3& at)
  {
    Double3 p{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      p[a] = (static_cast<double>(at[a]) + 0.5) / static_cast<double>(dimensions[a]);
    }
    const auto place = static_cast<std::uint64_t>(at[0] + 1000 * (at[1] + 1000 * at[2]));
    std::uint64_t hash = (place + seed * std::uint64_t{ 7919 }) * 0x9E3779B97F4A7C15u;
    hash = (hash ^ hash >> 29) * 0xBF58476D1CE4E5B9u;
    const double noise = static_cast<double>(hash >> 40) / static_cast<double>(1 << 24);
    if (holes && (noise < 0.02 || (p[0] > 0.7 && p[1] < 0.2)))
    {
      return std::numeric_limits<double>::quiet_NaN();
    }
    if (p[0] < 0.25 && p[2] < 0.5)
    {
      return 0.0;
    }
    if (p[1] > 0.6 && p[2] > 0.55)
    {
      return 0.7;
    }
    if (p[0] > 0.8)
    {
      return noise;
    }
    return 0.5 + 0.3 * std::sin(9 * p[0] + seed) * std::cos(7 * p[1]) * std::sin(11 * p[2] + 1) +
      0.04 * noise;
  };
}

/// From outside, turned so that no ray runs along an axis. `distance` in diagonals of the volume.
inline ViewInput Outside(
  const VolumeInfo& info, int width, int height, double distance = 1.2, double angle = 40)
{
  Double3 middle{};
  double diagonal = 0;
  for (std::size_t a = 0; a < 3; ++a)
  {
    const double size = static_cast<double>(info.Layout.Dimensions(0)[a]) * info.Spacing[a];
    middle[a] = size / 2;
    diagonal += size * size;
  }
  diagonal = std::sqrt(diagonal);
  const Double3 eye{ middle[0] + 0.55 * distance * diagonal, middle[1] + 0.39 * distance * diagonal,
    middle[2] - 0.74 * distance * diagonal };
  const double aspect = static_cast<double>(width) / height;
  return MakeCamera(info, width, height, LookAt(eye, middle, { 0.1, 1, 0.2 }),
    Perspective(angle, aspect, 0.01 * diagonal, 10 * diagonal));
}

} // namespace teravox::test
