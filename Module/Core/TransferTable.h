// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Types.h"

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace teravox
{

struct TransferImage;

/// Opacity and colour over data values, as the user set them.
struct TransferFunction
{
  std::function<double(double)> Opacity;      ///< per UnitDistance, 0..1
  std::function<void(double, double*)> Color; ///< rgb, 0..1
  std::vector<double> Knots;                  ///< sorted values where one of the two may bend
  double UnitDistance = 1;                    ///< world length to which Opacity refers, > 0
  /// Beyond the first and the last knot, what is there goes on; else the function may jump there.
  bool IsConstantBeyond = true;
  /// A wall (opacity 1) begins at its node, however steep the way up to it: what else shines in
  /// front of it matters. Else a wall of several nodes may begin up to one interval early.
  bool SharpWalls = false;
  /// What the table holds in the place of the extinction, of a value and its opacity; at least 0.
  /// Null: the extinction.
  std::function<double(double value, double opacity)> Response;
  /// Factor of the extinction, 0..1, over the gradient's magnitude in data values per mean distance
  /// of neighbouring voxels of level 0 (central differences over one voxel of the level drawn).
  /// Null: none. Not in BuildTransferTable(), see GradientTable.h.
  std::function<double(double)> GradientOpacity;
  double LastGradient = 1; ///< > 0; GradientOpacity is constant from here on
  /// Instead of Opacity and Color: both over value and gradient (TransferPlane.h). Opacity is an
  /// upper bound of it then, by which values are skipped. Null: none. Not in BuildTransferTable().
  std::shared_ptr<const TransferImage> Image;
  /// Sorted values that decide over which values the table's nodes lie and how close, instead of
  /// Knots. Empty: Knots.
  std::vector<double> DomainKnots;
  int FewestIntervals = 4096; ///< of the table, unless integers need fewer
  /// Where the field is constant in voxels nothing evens out what a table is off at a kink: each
  /// voxel has all of it.
  static constexpr int FewestIntervalsOfNearest = 32768;
  /// Of a volume with a label mask: what is drawn of the voxels of each label that bricks tell
  /// apart (VolumeInfo::MaskLabels); this function is that of all others. Not in
  /// BuildTransferTable(), see LabelTables.h.
  std::vector<TransferFunction> Labels;
};

/// The transfer function as the marcher samples it: extinction s and colour, linear between
/// equidistant nodes, but for intervals with a jump, of which each side has the value of its node;
/// and the running integral of s as a pair of floats, so that a difference of
/// two integrals doesn't cancel however unequal the parts of the function are. Read by
/// Shaders/Library/Transfer.glsl. Thread: immutable value.
struct TransferTable
{
  double Low = 0;          ///< data value of node 0
  double High = 1;         ///< data value of the last node
  int Nodes = 0;           ///< at least 2
  double NodesPerUnit = 1; ///< (Nodes - 1) / (High - Low)
  /// Per node: integral of s over nodes up to here (high, low), s here, s at the next node: with a
  /// minus sign if there is a jump in between.
  std::vector<std::array<float, 4>> Integrals;
  /// Per node: red, green, blue, each 0..65535 here (low half) and at the next node (high half);
  /// where in between the function jumps, as a float 0..1, or NoJump.
  std::vector<std::array<std::uint32_t, 4>> Colors;
  static constexpr float NoJump = 2;
  /// Per interval, the two beyond the ends included (0 lies before the first node, Nodes behind the
  /// last): the first one from here on that isn't zero, Nodes + 1 if there is none; at most 65535.
  /// One element more, so that a pair can be read anywhere.
  std::vector<std::uint16_t> Occupied;

  /// Least and largest s over ranges of nodes, for the native marcher: element
  /// [level * Blocks + i] is over the 2^level blocks of ExtremesBlock nodes from block i on, the
  /// last node of the last block included (sparse tables: Bender, Farach-Colton 2000).
  static constexpr int ExtremesBlock = 16;
  int Blocks = 0;
  std::vector<std::array<float, 2>> Extremes;

  /// Per node: how far the colour moves from the first node to here, the largest channel of each
  /// interval added up; for the native marcher.
  std::vector<float> Variation;

  /// Size of the tables on the GPU, or of those of the native marcher.
  std::uint64_t SizeInBytes() const
  {
    return 16 * this->Integrals.size() + 16 * this->Colors.size() + 2 * this->Occupied.size() +
      8 * this->Extremes.size() + 4 * this->Variation.size();
  }

  double LargestExtinction = 0; ///< of all nodes
  /// Extinction per world length of an opaque wall (opacity 1).
  double WallExtinction = 0;
};

/// Samples the function over the part of `data` on which it isn't constant. `integers`: values are
/// whole numbers, nodes are put on them. `smallestStep` is the shortest world length that matters:
/// an opaque wall of that length lets nothing pass.
TransferTable BuildTransferTable(
  const TransferFunction& function, const ValueRange& data, bool integers, double smallestStep);

} // namespace teravox
