// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "TruthGradientOpacity.h"
#include "TruthMath.h"
#include "TruthTransfer.h"

#include <array>
#include <vector>

namespace teravox
{

/// VTK's 2-D transfer function: opacity and colour from an image over the value v and the
/// gradient's magnitude m (see TruthGradientOpacity), bilinear between its nodes and constant
/// beyond them. Of W x H nodes, that of a place is
///
///   x = (W - 1) (v - low) / (high - low)        y = (H - 1) m / last
///
/// with the range of the data as low and high, and a quarter of its width as last. VTK takes the
/// opacity for that of a step, however long; here it is that of the unit distance. Thread:
/// immutable.
class TruthImage
{
public:
  using Node = std::array<double, 4>; ///< red, green, blue, opacity
  /// `nodes`: row after row. `spacing`: of the volume.
  TruthImage(int columns, std::vector<Node> nodes, double low, double high, double last,
    double unitDistance, const Double3& spacing);

  Node At(double value, double magnitude) const;
  /// The largest opacity of each value, and no colour; its knots are the columns.
  const TruthTransfer& Envelope() const { return this->Envelope_; }
  /// Magnitudes, and where along a piece they pass a row.
  const TruthGradientOpacity& Rows() const { return this->Rows_; }

private:
  const Node& Of(int column, int row) const;

  int Columns;
  int NumberOfRows;
  std::vector<Node> Nodes;
  double Low;
  double High;
  double Last;
  TruthTransfer Envelope_;
  TruthGradientOpacity Rows_;
};

} // namespace teravox
