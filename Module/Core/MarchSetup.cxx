// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "MarchSetup.h"

#include "ImageLattice.h"
#include "SharedLayout.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace teravox
{

namespace
{
// A piece may err by its share of the opacity that it adds to the picture, which sums up to at most
// that share, and by a little more: pieces that add next to nothing needn't be cut. Termination
// takes its part whole.
constexpr double PieceShare = 2.0 / 3;
constexpr double SmallestShare = 1.0 / 16;
constexpr double TerminationShare = 1.0 / 4;
// What interpolating a pixel between rays may be estimated to cost of it. Half of a step is
// estimated as 0.4 (KernelLattice.h), and the rays around it have errors of their own. What may
// hide between rays costs no more than all of it.
constexpr double LatticeShare = 0.7;
constexpr double FineTolerance = 1.0 / 255;
constexpr double FarthestRay = 2;
// More of it than that isn't known well enough to be estimated.
constexpr double LargestLooseness = 8;
} // namespace

LatticeLimits LatticeLimitsOf(double tolerance, double looseness)
{
  const double coarseness = std::max(tolerance / FineTolerance, 1.0);
  const double all = tolerance * std::min(looseness, LargestLooseness);
  return { all * LatticeShare, all, std::min(std::sqrt(std::sqrt(coarseness)), FarthestRay) };
}

LatticeLimits GuessedLattice()
{
  constexpr double any = std::numeric_limits<double>::infinity();
  return { any, any, any };
}

MarchParameters::Vec StepParameters(double sampleDistance, double tolerance, double looseness)
{
  return { static_cast<float>(sampleDistance),
    static_cast<float>(tolerance * looseness * PieceShare),
    tolerance > 0 ? static_cast<float>(tolerance * TerminationShare) : 1.0e-6f,
    static_cast<float>(tolerance * looseness * SmallestShare) };
}

MarchParameters::Vec TransferParameters(const TransferTable& table)
{
  const auto low = static_cast<float>(table.Low);
  return { low, static_cast<float>(table.Low - static_cast<double>(low)),
    static_cast<float>(table.NodesPerUnit), static_cast<float>(table.Nodes) };
}

int FirstLatticeStage(const MarchParameters& p, const IntervalParameters& intervals,
  const LatticeLimits& limits, int most)
{
  // The edges of a block are edges of its picture.
  if (p.Switches[3] != 0 || intervals.HasBlock)
  {
    return 0;
  }
  const double x = 0.5 * (intervals.Rectangle[0] + intervals.Rectangle[2]);
  const double y = 0.5 * (intervals.Rectangle[1] + intervals.Rectangle[3]);
  // Where the ray in the middle of the picture is nearest to the middle of the box.
  double along = 0;
  double squared = 0;
  for (std::size_t a = 0; a < 3; ++a)
  {
    const double origin = p.RayOrigin[0][a] + x * p.RayOrigin[1][a] + y * p.RayOrigin[2][a];
    const double direction =
      p.RayDirection[0][a] + x * p.RayDirection[1][a] + y * p.RayDirection[2][a];
    const double middle = 0.5 * (double{ intervals.BoxLow[a] } + intervals.BoxHigh[a]);
    along += (middle - origin) * direction;
    squared += direction * direction;
  }
  const double depth = std::max(along / squared, double{ intervals.Near });
  std::size_t level = p.Levels[1];
  while (level < p.Levels[2] && depth >= p.LevelStart[level + 1][0])
  {
    ++level;
  }
  const auto voxelsPerPixel = [&](std::size_t axis)
  {
    double sum = 0;
    for (std::size_t a = 0; a < 3; ++a)
    {
      const double step =
        (p.RayOrigin[axis][a] + depth * p.RayDirection[axis][a]) / p.LevelFactor[level][a];
      sum += step * step;
    }
    return std::sqrt(sum);
  };
  const double across = voxelsPerPixel(1);
  const double up = voxelsPerPixel(2);
  for (int stage = most; stage > 0; --stage)
  {
    const int between = LatticeEdge(stage) / 2;
    const double half = between;
    const double apart = stage % 2 == 0 ? std::hypot(across, up) : std::max(across, up);
    if (half * apart <= limits.Distance)
    {
      return stage;
    }
  }
  return 0;
}

std::vector<std::uint32_t> TilesOf(const std::array<int, 4>& rectangle)
{
  constexpr int edge = static_cast<int>(shared::TILE_SIZE);
  std::vector<std::uint32_t> tiles;
  for (int y = rectangle[1] / edge; y * edge < rectangle[3]; ++y)
  {
    for (int x = rectangle[0] / edge; x * edge < rectangle[2]; ++x)
    {
      tiles.push_back(static_cast<std::uint32_t>(x) | static_cast<std::uint32_t>(y) << 16);
    }
  }
  return tiles;
}

} // namespace teravox
