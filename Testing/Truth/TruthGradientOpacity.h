// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "TruthCubic.h"
#include "TruthMath.h"

#include <array>
#include <functional>
#include <vector>

namespace teravox
{

/// VTK's gradient opacity: extinction is multiplied by a function of the gradient's magnitude.
///
/// The magnitude is that of VTK 9.1's GPU mapper: with d_a = F(p + e_a) - F(p - e_a) over one voxel
/// of the level along axis a of the image, s_a the distance of those voxels and s the mean of the
/// image's three spacings,
///
///   m = | (d_a / (2 s_a)) | s        data units per mean spacing of level 0
///
/// VTK multiplies the opacity of a step of length l, 1 - exp(-sigma l), with g(m); as l goes to 0
/// the extinction becomes sigma g(m). Where a voxel of a difference is NaN, m = 0. An opaque wall
/// stays one where g > 0 and is gone where g = 0.
/// Thread: immutable; functions are called from several threads at once.
class TruthGradientOpacity
{
public:
  using Function = std::function<double(double)>;

  /// `knots`: all magnitudes where the function or a derivative of it jumps; where it becomes 0,
  /// too. `spacing`: of the image.
  TruthGradientOpacity(Function function, std::vector<double> knots, const Double3& spacing);

  /// `difference`: d_a; `factor`: voxels of level 0 per voxel of the level drawn.
  double Magnitude(const Double3& difference, const Double3& factor) const;
  double operator()(double magnitude) const { return this->Opacity(magnitude); }

  /// Where along a piece of a ray, in (0, 1), the opacity may bend, ascending: the differences are
  /// cubics there, the square of the magnitude a polynomial of the sixth degree.
  std::vector<double> Bends(
    const std::array<TruthCubic, 3>& differences, const Double3& factor) const;

private:
  Double3 Scale(const Double3& factor) const;

  Function Opacity;
  std::vector<double> Knots;
  Double3 Spacing;
};

/// All places strictly between two at which a polynomial (constant term first) changes its sign,
/// ascending; also where it comes to 0 without doing so, as far as rounding shows it.
std::vector<double> PolynomialRoots(
  const std::vector<double>& coefficients, double lower, double upper);

} // namespace teravox
