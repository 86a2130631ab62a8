// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "TruthMath.h"

#include <functional>
#include <vector>

namespace teravox
{

/// Opacity and colour as functions of the value, in double.
/// Thread: immutable; the functions are called from several threads at once.
///
/// Extinction per world length is sigma = -ln(1 - alpha) / unitDistance. Where alpha >= 1 on a
/// stretch of a ray, the ray ends there with the colour of that place (opaque wall). Single points
/// with alpha = 1 are integrable singularities, no walls.
class TruthTransfer
{
public:
  using Alpha = std::function<double(double)>;
  using Color = std::function<Double3(double)>;

  /// `knots`: all values where alpha or colour, or a derivative of them, jump; between two knots
  /// both are taken as smooth, and the set alpha >= 1 begins and ends at knots. Order and
  /// duplicates don't matter. An interval between knots where alpha is exactly 0 at 64 places
  /// counts as empty.
  TruthTransfer(Alpha alpha, Color color, std::vector<double> knots, double unitDistance);

  /// (value, alpha) and (value, colour) nodes, linear between them and constant outside; two nodes
  /// at one value make a jump, where the function has the value of the later node.
  struct AlphaNode
  {
    double Value;
    double Alpha;
  };
  struct ColorNode
  {
    double Value;
    Double3 Color;
  };
  static TruthTransfer PiecewiseLinear(
    std::vector<AlphaNode> alpha, std::vector<ColorNode> color, double unitDistance);

  double GetAlpha(double value) const { return this->Alpha_(value); }
  Double3 GetColor(double value) const { return this->Color_(value); }
  double UnitDistance() const { return this->UnitDistance_; }
  /// sigma(alpha); finite also for alpha = 1, see the class comment.
  double Extinction(double alpha) const;

  const std::vector<double>& Knots() const { return this->Knots_; }
  /// Interval i lies between Knots()[i-1] and Knots()[i]; there are Knots().size() + 1 of them.
  std::size_t IntervalOf(double value) const;
  bool IsIntervalEmpty(std::size_t interval) const { return this->Empty[interval]; }
  /// True where alpha is 0 for all values in [min, max].
  bool IsRangeEmpty(double min, double max) const;

private:
  Alpha Alpha_;
  Color Color_;
  std::vector<double> Knots_;
  std::vector<bool> Empty;
  std::vector<bool> KnotEmpty;
  double UnitDistance_ = 1;
};

} // namespace teravox
