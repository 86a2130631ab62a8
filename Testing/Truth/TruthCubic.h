// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

namespace teravox
{

/// c0 + c1 s + c2 s^2 + c3 s^3 for s in [0, 1]: a trilinear field along a straight line inside a
/// cell.
struct TruthCubic
{
  std::array<double, 4> Coefficients{};

  double operator()(double s) const
  {
    const std::array<double, 4>& c = this->Coefficients;
    return c[0] + s * (c[1] + s * (c[2] + s * c[3]));
  }
  double Derivative(double s) const
  {
    const std::array<double, 4>& c = this->Coefficients;
    return c[1] + s * (2 * c[2] + s * 3 * c[3]);
  }
  bool IsConstant() const
  {
    const std::array<double, 4>& c = this->Coefficients;
    return c[1] == 0 && c[2] == 0 && c[3] == 0;
  }

  /// `corners`: the voxels of the cell, x fastest. `start` and `end`: where the line begins and
  /// ends inside the cell, in 0..1 along each axis.
  static TruthCubic FromCell(const std::array<double, 8>& corners,
    const std::array<double, 3>& start, const std::array<double, 3>& end);

  /// The cubic with these values at 0, 1/3, 2/3 and 1.
  static TruthCubic FromSamples(const std::array<double, 4>& samples);

  /// Cuts [0, 1] into at most three pieces where the polynomial is monotone: returns the number of
  /// pieces, and their ends in cuts[0] = 0 < ... < cuts[n] = 1.
  int MonotonePieces(std::array<double, 4>& cuts) const;

  /// Where the polynomial has a value. Requires: monotone on [lower, upper], and the value lies
  /// between those at the two ends.
  double Solve(double value, double lower, double upper) const;
};

} // namespace teravox
