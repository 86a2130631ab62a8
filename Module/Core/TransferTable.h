// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Types.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace teravox
{

/// Opacity and colour over data values, as the user set them.
struct TransferFunction
{
  std::function<double(double)> Opacity;      ///< per UnitDistance, 0..1
  std::function<void(double, double*)> Color; ///< rgb, 0..1
  std::vector<double> Knots;                  ///< sorted values where one of the two may bend
  double UnitDistance = 1;                    ///< world length to which Opacity refers, > 0
};

/// The transfer function as the marcher samples it: piecewise linear extinction s and emission c s
/// over equidistant nodes, with their running integrals as pairs of floats, so that a difference of
/// two integrals doesn't cancel however unequal the parts of the function are. Layout of a node:
/// see Shaders/Library/Transfer.glsl. Thread: immutable value.
struct TransferTable
{
  double Low = 0;                    ///< data value of node 0
  double High = 1;                   ///< data value of the last node
  int Nodes = 0;                     ///< at least 2
  double NodesPerUnit = 1;           ///< (Nodes - 1) / (High - Low)
  std::vector<std::uint32_t> Texels; ///< 12 words per node; the bits of floats, and packed colours
  std::vector<std::uint32_t> Occupied; ///< per node: intervals before it that aren't zero

  /// Size of both tables on the GPU.
  std::uint64_t SizeInBytes() const { return 4 * (this->Texels.size() + this->Occupied.size()); }

  /// Extinction per world length of an opaque wall (opacity 1).
  double WallExtinction = 0;
};

/// Samples the function over the part of `data` on which it isn't constant. `integers`: values are
/// whole numbers, nodes are put on them. `smallestStep` is the shortest world length that matters:
/// an opaque wall of that length lets nothing pass.
TransferTable BuildTransferTable(
  const TransferFunction& function, const ValueRange& data, bool integers, double smallestStep);

} // namespace teravox
