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
constexpr double MostIntervals = 65535; // their indices are 16-bit numbers
constexpr double IntervalsPerKnot = 16;
constexpr double LeastDomain = 1e-30;
constexpr double LeastJump = 1.0 / 1024; // of opacity or colour

const std::vector<double>& DomainKnotsOf(const TransferFunction& function)
{
  return function.DomainKnots.empty() ? function.Knots : function.DomainKnots;
}

// The interval outside which the function is constant, cut to the data.
void ChooseDomain(
  const TransferFunction& function, const ValueRange& data, double& low, double& high)
{
  const bool known = data.IsKnown() && !data.IsVoid();
  const std::vector<double>& knots = DomainKnotsOf(function);
  low = knots.empty() ? 0 : knots.front();
  high = knots.empty() ? 1 : knots.back();
  if (known)
  {
    low = std::clamp(low, data.Min, data.Max);
    high = std::clamp(high, data.Min, data.Max);
  }
  if (!function.IsConstantBeyond && high >= low)
  {
    // A little more than up to the knots, so that the outermost nodes have what lies beyond; over
    // all the data if that is known, whose whole numbers nodes shall stay on.
    const double beyond = std::max((high - low) * 1e-6, std::abs(high) * 1e-12);
    low = known ? data.Min : low - beyond;
    high = known ? data.Max : high + beyond;
  }
  if (!(high > low))
  {
    // Constant over the data: any interval does.
    high = low + std::max(1.0, std::abs(low) * 1e-6);
  }
  // Nodes per unit of value are a float.
  high = std::max(high, low + LeastDomain);
}

int ChooseIntervals(const TransferFunction& function, bool integers, double low, double high)
{
  const double range = high - low;
  double closest = range;
  const std::vector<double>& knots = DomainKnotsOf(function);
  for (std::size_t i = 1; i < knots.size(); ++i)
  {
    const double a = std::clamp(knots[i - 1], low, high);
    const double b = std::clamp(knots[i], low, high);
    // Closer than this is a jump, which no table resolves.
    if (b - a > range / MostIntervals)
    {
      closest = std::min(closest, b - a);
    }
  }
  const double wanted = std::clamp(IntervalsPerKnot * range / closest,
    static_cast<double>(function.FewestIntervals), MostIntervals);
  const bool whole = integers && low == std::floor(low) && high == std::floor(high);
  if (whole && range <= MostIntervals)
  {
    return static_cast<int>(range * std::max(1.0, std::floor(wanted / range)));
  }
  return static_cast<int>(std::exp2(std::floor(std::log2(wanted))));
}

// Where in its interval the function jumps, by index of the interval; of several jumps the last.
std::vector<float> FindJumps(const TransferFunction& function, const TransferTable& table)
{
  std::vector<float> jumps(static_cast<std::size_t>(table.Nodes), TransferTable::NoJump);
  const double beside = 1e-3 / table.NodesPerUnit;
  for (const double knot : function.Knots)
  {
    if (knot <= table.Low || knot >= table.High)
    {
      continue;
    }
    double change = std::abs(function.Opacity(knot + beside) - function.Opacity(knot - beside));
    std::array<double, 3> before{};
    std::array<double, 3> behind{};
    function.Color(knot - beside, before.data());
    function.Color(knot + beside, behind.data());
    for (std::size_t c = 0; c < 3; ++c)
    {
      change = std::max(change, std::abs(behind[c] - before[c]));
    }
    // No slope that the table resolves changes as much in so short a distance.
    if (change > LeastJump)
    {
      const double position = (knot - table.Low) * table.NodesPerUnit;
      // A node has the value of the function, which is that of one side.
      const double whole = std::round(position);
      const bool isNode = std::abs(position - whole) < 1e-6;
      const bool asBefore =
        isNode && std::abs(function.Opacity(knot) - function.Opacity(knot - beside)) <= LeastJump;
      const double interval = isNode ? whole - (asBefore ? 0 : 1) : std::floor(position);
      jumps[static_cast<std::size_t>(std::clamp(interval, 0.0, table.Nodes - 2.0))] =
        static_cast<float>(std::clamp(position - interval, 0.0, 1.0));
    }
  }
  return jumps;
}

// A function that is a wall at one node only: the extinction -ln(1 - opacity) beside it has no
// bound but a mean, which is 1 per unit distance above that of the other node where the opacity is
// linear. As a line up to the wall it would be a thousand times as much: as a jump close to the
// wall's node it is right, and the node itself stays a wall. At an end of the table that is so
// where no data lie beyond. Beside a wall that goes on, the line begins the wall up to an interval
// early, which shows only where something else shines in front of it (SharpWalls).
void JumpToWalls(const TransferFunction& function, const TransferTable& table,
  const ValueRange& data, const std::vector<double>& s, std::vector<float>& jumps)
{
  const bool known = data.IsKnown() && !data.IsVoid();
  const auto isWall = [&](std::size_t i) { return s[i] >= table.WallExtinction; };
  // `beside`: the end of the interval that is no wall.
  const auto jump = [&](std::size_t interval, std::size_t beside)
  {
    if (jumps[interval] == TransferTable::NoJump)
    {
      const double share =
        std::min(1.0, 1.0 / (function.UnitDistance * (table.WallExtinction - s[beside])));
      jumps[interval] = static_cast<float>(beside == interval ? 1.0 - share : share);
    }
  };
  const std::size_t last = s.size() - 1;
  for (std::size_t i = 0; i <= last; ++i)
  {
    const bool continuesBefore = i == 0 ? !(known && data.Min >= table.Low) : isWall(i - 1);
    const bool continuesBehind = i == last ? !(known && data.Max <= table.High) : isWall(i + 1);
    const bool alone = !continuesBefore && !continuesBehind;
    if (!isWall(i) || !(alone || function.SharpWalls))
    {
      continue;
    }
    if (i > 0 && !isWall(i - 1))
    {
      jump(i - 1, i - 1);
    }
    if (i < last && !isWall(i + 1))
    {
      jump(i, i + 1);
    }
  }
}
} // namespace

TransferTable BuildTransferTable(
  const TransferFunction& function, const ValueRange& data, bool integers, double smallestStep)
{
  TransferTable table;
  ChooseDomain(function, data, table.Low, table.High);
  // The marcher has it as a pair of floats.
  const auto leading = static_cast<float>(table.Low);
  table.Low = static_cast<double>(leading) +
    static_cast<double>(static_cast<float>(table.Low - static_cast<double>(leading)));
  const int intervals = ChooseIntervals(function, integers, table.Low, table.High);
  table.Nodes = intervals + 1;
  table.NodesPerUnit = intervals / (table.High - table.Low);
  // exp(-40) is far below what a float accumulator resolves. As the table stores it.
  table.WallExtinction = static_cast<double>(static_cast<float>(40.0 / smallestStep));

  const auto nodes = static_cast<std::size_t>(table.Nodes);
  std::vector<double> s(nodes);
  table.Colors.resize(nodes);
  for (std::size_t i = 0; i < nodes; ++i)
  {
    const double value = i + 1 == nodes
      ? table.High
      : table.Low + static_cast<double>(i) / intervals * (table.High - table.Low);
    const double opacity = std::clamp(function.Opacity(value), 0.0, 1.0);
    std::array<double, 3> color{};
    function.Color(value, color.data());
    for (std::size_t c = 0; c < 3; ++c)
    {
      table.Colors[i][c] =
        static_cast<std::uint32_t>(std::lround(std::clamp(color[c], 0.0, 1.0) * 65535));
    }
    s[i] = function.Response ? function.Response(value, opacity)
      : opacity >= 1
      ? table.WallExtinction
      : std::min(-std::log1p(-opacity) / function.UnitDistance, table.WallExtinction);
    s[i] = static_cast<double>(static_cast<float>(s[i])); // as the table stores it
    table.LargestExtinction = std::max(table.LargestExtinction, s[i]);
  }

  std::vector<float> jumps = FindJumps(function, table);
  if (!function.Response)
  {
    JumpToWalls(function, table, data, s, jumps);
  }
  table.Integrals.resize(nodes);
  table.Variation.resize(nodes);
  double integral = 0;
  double variation = 0;
  for (std::size_t i = 0; i < nodes; ++i)
  {
    const std::size_t next = std::min(i + 1, nodes - 1);
    const auto high = static_cast<float>(integral);
    const auto low = static_cast<float>(integral - static_cast<double>(high));
    const bool jump = jumps[i] != TransferTable::NoJump;
    table.Integrals[i] = { high, low, static_cast<float>(s[i]),
      static_cast<float>(jump ? -s[next] : s[next]) };
    table.Variation[i] = static_cast<float>(variation);
    double change = 0;
    for (std::size_t c = 0; c < 3; ++c)
    {
      const std::uint32_t here = table.Colors[i][c];
      const std::uint32_t there = table.Colors[next][c] & 0xffffu;
      table.Colors[i][c] = here | there << 16;
      change = std::max(change, std::abs(static_cast<double>(there) - here) / 65535);
    }
    std::memcpy(&table.Colors[i][3], &jumps[i], sizeof(float));
    variation += change;
    const double share = jump ? static_cast<double>(jumps[i]) : 0.5;
    integral += i < next ? share * s[i] + (1 - share) * s[next] : 0;
  }
  // A block ends with the first node of the next: between nodes s is linear.
  table.Blocks = (table.Nodes + TransferTable::ExtremesBlock - 1) / TransferTable::ExtremesBlock;
  const auto blocks = static_cast<std::size_t>(table.Blocks);
  for (std::size_t b = 0; b < blocks; ++b)
  {
    std::array<float, 2> extremes{ static_cast<float>(s[b * TransferTable::ExtremesBlock]),
      static_cast<float>(s[b * TransferTable::ExtremesBlock]) };
    for (std::size_t i = b * TransferTable::ExtremesBlock;
         i <= std::min((b + 1) * TransferTable::ExtremesBlock, nodes - 1); ++i)
    {
      extremes[0] = std::min(extremes[0], static_cast<float>(s[i]));
      extremes[1] = std::max(extremes[1], static_cast<float>(s[i]));
    }
    table.Extremes.push_back(extremes);
  }
  for (std::size_t half = 1; 2 * half <= blocks; half *= 2)
  {
    const std::size_t before = table.Extremes.size() - blocks;
    for (std::size_t b = 0; b < blocks; ++b)
    {
      const std::array<float, 2>& a = table.Extremes[before + b];
      const std::array<float, 2>& z = table.Extremes[before + std::min(b + half, blocks - 1)];
      table.Extremes.push_back({ std::min(a[0], z[0]), std::max(a[1], z[1]) });
    }
  }

  table.Occupied.resize(
    nodes + 2, static_cast<std::uint16_t>(std::min<std::size_t>(nodes + 1, 65535)));
  std::size_t occupied = nodes + 1;
  for (std::size_t i = nodes + 1; i-- > 0;)
  {
    const double before = s[i > 0 ? i - 1 : 0];
    const double after = s[std::min(i, nodes - 1)];
    occupied = before > 0 || after > 0 ? i : occupied;
    table.Occupied[i] = static_cast<std::uint16_t>(std::min<std::size_t>(occupied, 65535));
  }
  return table;
}

} // namespace teravox
