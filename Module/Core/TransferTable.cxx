// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TransferTable.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace teravox
{

namespace
{
constexpr double FewestIntervals = 4096;
constexpr double MostIntervals = 65536;
constexpr double IntervalsPerKnot = 16;

// The interval outside which the function is constant, cut to the data.
void ChooseDomain(
  const TransferFunction& function, const ValueRange& data, double& low, double& high)
{
  const bool known = data.IsKnown() && !data.IsVoid();
  low = function.Knots.empty() ? 0 : function.Knots.front();
  high = function.Knots.empty() ? 1 : function.Knots.back();
  if (known)
  {
    low = std::clamp(low, data.Min, data.Max);
    high = std::clamp(high, data.Min, data.Max);
  }
  if (!(high > low))
  {
    // Constant over the data: any interval does.
    high = low + std::max(1.0, std::abs(low) * 1e-6);
  }
}

int ChooseIntervals(const TransferFunction& function, bool integers, double low, double high)
{
  const double range = high - low;
  double closest = range;
  for (std::size_t i = 1; i < function.Knots.size(); ++i)
  {
    const double a = std::clamp(function.Knots[i - 1], low, high);
    const double b = std::clamp(function.Knots[i], low, high);
    // Closer than this is a jump, which no table resolves.
    if (b - a > range / MostIntervals)
    {
      closest = std::min(closest, b - a);
    }
  }
  const double wanted =
    std::clamp(IntervalsPerKnot * range / closest, FewestIntervals, MostIntervals);
  const bool whole = integers && low == std::floor(low) && high == std::floor(high);
  if (whole && range <= MostIntervals)
  {
    return static_cast<int>(range * std::max(1.0, std::floor(wanted / range)));
  }
  return static_cast<int>(std::exp2(std::ceil(std::log2(wanted))));
}
} // namespace

namespace
{
using Color3 = std::array<double, 3>;

std::uint32_t Bits(float value)
{
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof(bits));
  return bits;
}

void PutPair(double value, std::uint32_t& high, std::uint32_t& low)
{
  const auto first = static_cast<float>(value);
  high = Bits(first);
  low = Bits(static_cast<float>(value - static_cast<double>(first)));
}

std::uint32_t Unorm16(double value)
{
  return static_cast<std::uint32_t>(std::lround(std::clamp(value, 0.0, 1.0) * 65535));
}
} // namespace

TransferTable BuildTransferTable(
  const TransferFunction& function, const ValueRange& data, bool integers, double smallestStep)
{
  TransferTable table;
  ChooseDomain(function, data, table.Low, table.High);
  const int intervals = ChooseIntervals(function, integers, table.Low, table.High);
  table.Nodes = intervals + 1;
  table.NodesPerUnit = intervals / (table.High - table.Low);
  // exp(-40) is far below what a float accumulator resolves.
  table.WallExtinction = 40.0 / smallestStep;

  const auto nodes = static_cast<std::size_t>(table.Nodes);
  std::vector<double> s(nodes);
  std::vector<Color3> color(nodes);
  for (std::size_t i = 0; i < nodes; ++i)
  {
    const double value = i + 1 == nodes
      ? table.High
      : table.Low + static_cast<double>(i) / intervals * (table.High - table.Low);
    const double opacity = std::clamp(function.Opacity(value), 0.0, 1.0);
    function.Color(value, color[i].data());
    for (double& c : color[i])
    {
      c = std::clamp(c, 0.0, 1.0);
    }
    s[i] = opacity >= 1
      ? table.WallExtinction
      : std::min(-std::log1p(-opacity) / function.UnitDistance, table.WallExtinction);
    s[i] = static_cast<double>(static_cast<float>(s[i])); // as the table stores it
  }

  table.Texels.assign(nodes * 12, 0);
  table.Occupied.assign(nodes, 0);
  double integral = 0;
  Color3 emission{};
  std::uint32_t occupied = 0;
  for (std::size_t i = 0; i < nodes; ++i)
  {
    const std::size_t next = std::min(i + 1, nodes - 1);
    std::uint32_t* texel = &table.Texels[i * 12];
    PutPair(integral, texel[0], texel[1]);
    texel[2] = Bits(static_cast<float>(s[i]));
    texel[3] = Bits(static_cast<float>(s[next]));
    const double step = 0.5 * (s[i] + s[next]);
    std::array<std::uint32_t, 3> mean{};
    for (std::size_t c = 0; c < 3; ++c)
    {
      PutPair(emission[c], texel[4 + c], texel[8 + c]);
      // Colour of the interval: as its emission demands, so that integrals agree at the next node.
      const double added =
        (s[i] * (2 * color[i][c] + color[next][c]) + s[next] * (color[i][c] + 2 * color[next][c])) /
        6;
      mean[c] = Unorm16(step > 0 ? added / step : color[i][c]);
      emission[c] += i < next ? added : 0;
    }
    texel[7] = mean[0] | mean[1] << 16;
    texel[11] = mean[2];
    table.Occupied[i] = occupied;
    integral += i < next ? step : 0;
    occupied += s[i] > 0 || s[next] > 0 ? 1 : 0;
  }
  return table;
}

} // namespace teravox
