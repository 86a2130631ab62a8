// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "MarchSetup.h"

#include "SharedLayout.h"

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
} // namespace

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
