// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "TruthIntegrator.h"
#include "Types.h"

#include <functional>
#include <vector>

namespace teravox::test
{

/// The field along the ray of a pixel, sampled densely in double precision: the truth of blend
/// modes other than composite. The scene has to outlive it.
class RayOfTruth
{
public:
  /// `dx`, `dy`: from the middle of the pixel.
  RayOfTruth(const TruthScene& scene, int x, int y, double dx, double dy);
  Double3 VoxelAt(double depth) const;
  /// NaN where there is no value, as where a mask leaves out the place.
  double Field(int level, double depth) const;
  /// How many places per voxel tell where a mask ends as well as `perVoxel` tell what a field is.
  int Fine(int perVoxel) const;
  /// Calls with level, depth and the distance of places, about `perVoxel` a voxel of level 0.
  void Sample(int perVoxel, const std::function<void(int, double, double)>& at) const;

  const TruthScene& Scene;
  TruthRay Ray;
  std::vector<TruthLevelSpan> Spans;
};

/// What the transfer function makes of a value; nothing of NaN.
TruthColor Premultiplied(const TruthScene& scene, double value);

/// The largest (sign 1) or least (-1) value, NaN if there is none; and the first place that has it.
struct TruthExtreme
{
  double Value;
  int Level = 0;
  double Depth = 0;
};
TruthExtreme PlaceOfExtreme(const RayOfTruth& ray, double sign);
double ExtremeAlong(const RayOfTruth& ray, double sign);

/// The integral over length of opacity times value, values from 0 to 1 over `data`, where values
/// lie in `range` (null: all), and the length of that.
struct TruthSum
{
  double Sum = 0;
  double Length = 0;
};
TruthSum SumAlong(const RayOfTruth& ray, const ValueRange& data, const double* range);

/// An opaque gray, clamped; or nothing.
TruthColor GrayOf(bool seen, double value);

/// How far a pixel lies beyond the envelope of the truth over nine rays within +-1/32 pixel, and
/// how far it is from that of the middle one: the largest channel of each. `at`: the truth at a
/// place from the middle of the pixel.
struct PixelExcess
{
  double Beyond = 0;
  double Plain = 0;
  TruthColor Middle{};
};
PixelExcess ExcessOfPixel(const float* pixel, const std::function<TruthColor(double, double)>& at);

} // namespace teravox::test
