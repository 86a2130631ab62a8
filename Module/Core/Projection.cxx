// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Projection.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace teravox
{

namespace
{
// What a position in nodes may be off by rounding, as a share of the largest numbers on the way to
// it: a few units in the last place of a float.
constexpr double RoundingShare = 3e-7;

float ToFloat(double v)
{
  return static_cast<float>(std::clamp(v, -3.0e38, 3.0e38));
}
} // namespace

TransferFunction ProjectedFunction(
  TransferFunction function, BlendKind kind, const ValueRange& data)
{
  switch (kind)
  {
    case BlendKind::Composite:
      return function;
    case BlendKind::Average:
    case BlendKind::Additive:
    {
      const bool known =
        data.IsKnown() && !data.IsVoid() && std::isfinite(data.Min) && std::isfinite(data.Max);
      double low = known ? data.Min : 0;
      double high = known ? data.Max : 1;
      if (!known && !function.Knots.empty())
      {
        low = function.Knots.front();
        high = function.Knots.back();
      }
      // Values go on changing beyond the function's points.
      function.IsConstantBeyond = function.IsConstantBeyond && !known;
      const double perValue = high > low ? 1 / (high - low) : 0;
      function.Response = [low, perValue](double value, double opacity)
      { return opacity * std::clamp((value - low) * perValue, 0.0, 1.0); };
      return function;
    }
    default:
      function.Response = [](double, double opacity) { return opacity; };
      return function;
  }
}

std::array<float, 4> NewRay(BlendKind kind, int components)
{
  constexpr float nothing = MarchParameters::NothingMet;
  return components > 1 && kind != BlendKind::Composite
    ? std::array<float, 4>{ nothing, nothing, nothing, nothing }
    : std::array<float, 4>{ 0, 0, 0, 1 };
}

void SetProjection(MarchParameters& parameters, const Projection& projection,
  const TransferFunction& function, const TransferTable& table, double unitDistance, bool relative)
{
  const auto nodeOf = [&](double value) { return (value - table.Low) * table.NodesPerUnit; };
  // Ranges of what is stored relative to bricks are rounded to floats outwards, and what the bricks
  // differ by from the table is exact.
  double largest =
    static_cast<double>(table.Nodes) + (relative ? 0.0 : std::abs(table.Low) * table.NodesPerUnit);
  for (const double value : projection.IsoValues)
  {
    largest = std::max(largest, std::abs(nodeOf(value)));
  }
  const double rounding = RoundingShare * largest;
  parameters.Projection = { 0, ToFloat(rounding), 0, 0 };
  switch (projection.Kind)
  {
    case BlendKind::Maximum:
    case BlendKind::Minimum:
    {
      // All values beyond the table look like its last node.
      const bool most = projection.Kind == BlendKind::Maximum;
      parameters.Projection[0] = most ? 1.0f : -1.0f;
      parameters.Projection[2] = most ? static_cast<float>(table.Nodes - 1) : 0.0f;
      break;
    }
    case BlendKind::Average:
      // Voxels with just the value of an end count.
      parameters.Projection[2] = ToFloat(nodeOf(projection.RangeLow) - rounding);
      parameters.Projection[3] = ToFloat(nodeOf(projection.RangeHigh) + rounding);
      break;
    case BlendKind::Additive:
      parameters.Projection[3] = ToFloat(1 / unitDistance);
      break;
    case BlendKind::Isosurface:
    {
      std::vector<double> values = projection.IsoValues;
      std::sort(values.begin(), values.end());
      std::size_t count = 0;
      for (const double value : values)
      {
        const double opacity = std::clamp(function.Opacity(value), 0.0, 1.0);
        if (!(opacity > 0) || count == MaximumIsoValues)
        {
          continue; // invisible surfaces needn't be looked for
        }
        std::array<double, 3> color{};
        function.Color(value, color.data());
        // Voxels with just this value lie behind the surface, whatever rounding does.
        parameters.IsoValues[count / 4][count % 4] = ToFloat(nodeOf(value) - rounding);
        for (std::size_t c = 0; c < 3; ++c)
        {
          parameters.IsoColors[count][c] = static_cast<float>(std::clamp(color[c], 0.0, 1.0));
        }
        parameters.IsoColors[count][3] = static_cast<float>(opacity);
        ++count;
      }
      parameters.Projection[0] = static_cast<float>(count);
      break;
    }
    default:
      break;
  }
}

} // namespace teravox
