// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "RayOfTruth.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace teravox::test
{

namespace
{
constexpr double None = std::numeric_limits<double>::quiet_NaN();
}

RayOfTruth::RayOfTruth(const TruthScene& scene, int x, int y, double dx, double dy)
  : Scene(scene)
  , Ray(scene.Camera.Ray(x, y, dx, dy))
  , Spans(LevelSpans(scene, x, y, dx, dy))
{
}

Double3 RayOfTruth::VoxelAt(double depth) const
{
  const Double3 world = this->Ray.At(this->Ray.LengthAtDepth(depth));
  const auto& m = this->Scene.Volume.VoxelFromWorld();
  Double3 p{};
  for (std::size_t i = 0; i < 3; ++i)
  {
    p[i] = m[4 * i] * world[0] + m[4 * i + 1] * world[1] + m[4 * i + 2] * world[2] + m[4 * i + 3];
  }
  return p;
}

double RayOfTruth::Field(int level, double depth) const
{
  const Double3 p = this->VoxelAt(depth);
  const bool isOut = this->Scene.Mask && !(this->Scene.Mask->Field(level, p) > 0);
  return isOut ? None : this->Scene.Volume.Field(level, p);
}

int RayOfTruth::Fine(int perVoxel) const
{
  return this->Scene.Mask ? std::max(perVoxel, 100) : perVoxel;
}

void RayOfTruth::Sample(int perVoxel, const std::function<void(int, double, double)>& at) const
{
  for (const TruthLevelSpan& span : this->Spans)
  {
    const double length = (span.DepthEnd - span.DepthBegin) / this->Ray.DepthPerLength;
    const double edge = this->Scene.Volume.VoxelEdge(0, 0);
    const int count = std::max(4, static_cast<int>(std::ceil(length / edge * perVoxel)));
    const double step = (span.DepthEnd - span.DepthBegin) / count;
    for (int i = 0; i < count; ++i)
    {
      at(span.Level, span.DepthBegin + (i + 0.5) * step, step);
    }
  }
}

TruthColor Premultiplied(const TruthScene& scene, double value)
{
  if (std::isnan(value))
  {
    return {};
  }
  const double a = scene.Transfer.GetAlpha(value);
  const Double3 c = scene.Transfer.GetColor(value);
  return { a * c[0], a * c[1], a * c[2], a };
}

// Of many places, the best ones made better by golden section.
TruthExtreme PlaceOfExtreme(const RayOfTruth& ray, double sign)
{
  double best = -std::numeric_limits<double>::infinity();
  TruthExtreme found{ None };
  const bool nearest = ray.Scene.Volume.Interpolation() == TruthInterpolation::Nearest;
  ray.Sample(ray.Fine(8),
    [&](int level, double depth, double step)
    {
      const auto take = [&](double at)
      {
        const double value = sign * ray.Field(level, at);
        if (value > best) // NaN isn't
        {
          best = value;
          found = { sign * value, level, at };
        }
      };
      const double here = sign * ray.Field(level, depth);
      if (std::isnan(here))
      {
        return;
      }
      if (here > best - 0.02 * std::abs(best) && !nearest && !ray.Scene.Mask)
      {
        double a = depth - 0.5 * step;
        double b = depth + 0.5 * step;
        take(a);
        take(depth);
        take(b);
        for (int i = 0; i < 20; ++i)
        {
          const double u = a + 0.382 * (b - a);
          const double v = a + 0.618 * (b - a);
          (sign * ray.Field(level, u) > sign * ray.Field(level, v) ? b : a) =
            sign * ray.Field(level, u) > sign * ray.Field(level, v) ? v : u;
        }
        take(0.5 * (a + b));
      }
      take(depth);
    });
  return found;
}

double ExtremeAlong(const RayOfTruth& ray, double sign)
{
  return PlaceOfExtreme(ray, sign).Value;
}

TruthSum SumAlong(const RayOfTruth& ray, const ValueRange& data, const double* range)
{
  TruthSum sum;
  ray.Sample(ray.Fine(24),
    [&](int level, double depth, double step)
    {
      const double value = ray.Field(level, depth);
      if (std::isnan(value) || (range && (value < range[0] || value > range[1])))
      {
        return;
      }
      const double l = step / ray.Ray.DepthPerLength;
      sum.Sum +=
        l * ray.Scene.Transfer.GetAlpha(value) * (value - data.Min) / (data.Max - data.Min);
      sum.Length += l;
    });
  return sum;
}

TruthColor GrayOf(bool seen, double value)
{
  const double g = std::clamp(value, 0.0, 1.0);
  return seen ? TruthColor{ g, g, g, 1 } : TruthColor{};
}

PixelExcess ExcessOfPixel(const float* pixel, const std::function<TruthColor(double, double)>& at)
{
  PixelExcess excess;
  excess.Middle = at(0, 0);
  TruthColor low = excess.Middle;
  TruthColor high = excess.Middle;
  for (std::size_t c = 0; c < 4; ++c)
  {
    excess.Plain =
      std::max(excess.Plain, std::abs(static_cast<double>(pixel[c]) - excess.Middle[c]));
  }
  excess.Beyond = excess.Plain;
  if (!(excess.Plain <= 0.5 / 255))
  {
    for (int k = 0; k < 9; ++k)
    {
      const TruthColor beside = at((k % 3 - 1) / 32.0, (k / 3 - 1) / 32.0);
      for (std::size_t c = 0; c < 4; ++c)
      {
        low[c] = std::min(low[c], beside[c]);
        high[c] = std::max(high[c], beside[c]);
      }
    }
    excess.Beyond = 0;
    for (std::size_t c = 0; c < 4; ++c)
    {
      const auto value = static_cast<double>(pixel[c]);
      excess.Beyond = std::max({ excess.Beyond, low[c] - value, value - high[c] });
    }
  }
  return excess;
}

} // namespace teravox::test
