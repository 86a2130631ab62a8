// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TruthCubic.h"

#include <cmath>
#include <utility>

namespace teravox
{

TruthCubic TruthCubic::FromCell(const std::array<double, 8>& corners,
  const std::array<double, 3>& start, const std::array<double, 3>& end)
{
  // Trilinear form as a polynomial in x, y, z; each of them is linear in s.
  const std::array<double, 8>& v = corners;
  const double x = v[1] - v[0];
  const double y = v[2] - v[0];
  const double z = v[4] - v[0];
  const double xy = (v[3] - v[2]) - x;
  const double xz = (v[5] - v[4]) - x;
  const double yz = (v[6] - v[4]) - y;
  const double xyz = (v[7] - v[6]) - (v[5] - v[4]) - xy;

  const double a0 = start[0];
  const double b0 = start[1];
  const double c0 = start[2];
  const double a1 = end[0] - start[0];
  const double b1 = end[1] - start[1];
  const double c1 = end[2] - start[2];

  TruthCubic result;
  std::array<double, 4>& c = result.Coefficients;
  c[0] = v[0] + x * a0 + y * b0 + z * c0 + xy * a0 * b0 + xz * a0 * c0 + yz * b0 * c0 +
    xyz * a0 * b0 * c0;
  c[1] = x * a1 + y * b1 + z * c1 + xy * (a0 * b1 + a1 * b0) + xz * (a0 * c1 + a1 * c0) +
    yz * (b0 * c1 + b1 * c0) + xyz * (a1 * b0 * c0 + a0 * b1 * c0 + a0 * b0 * c1);
  c[2] =
    xy * a1 * b1 + xz * a1 * c1 + yz * b1 * c1 + xyz * (a1 * b1 * c0 + a1 * b0 * c1 + a0 * b1 * c1);
  c[3] = xyz * a1 * b1 * c1;
  return result;
}

TruthCubic TruthCubic::FromSamples(const std::array<double, 4>& samples)
{
  const std::array<double, 4>& f = samples;
  TruthCubic result;
  result.Coefficients = { f[0], (-11 * f[0] + 18 * f[1] - 9 * f[2] + 2 * f[3]) / 2,
    (18 * f[0] - 45 * f[1] + 36 * f[2] - 9 * f[3]) / 2,
    (-9 * f[0] + 27 * f[1] - 27 * f[2] + 9 * f[3]) / 2 };
  return result;
}

int TruthCubic::MonotonePieces(std::array<double, 4>& cuts) const
{
  // Derivative: a s^2 + 2 b s + c. A double root of it is an inflection: monotone.
  const double a = 3 * this->Coefficients[3];
  const double b = this->Coefficients[2];
  const double c = this->Coefficients[1];
  int pieces = 0;
  cuts[0] = 0;
  const double discriminant = b * b - a * c;
  if (discriminant > 0)
  {
    const double q = -(b + std::copysign(std::sqrt(discriminant), b));
    double first = q != 0 ? c / q : 0;
    double second = a != 0 ? q / a : 0;
    if (first > second)
    {
      std::swap(first, second);
    }
    for (const double root : { first, second })
    {
      if (root > cuts[static_cast<std::size_t>(pieces)] && root < 1)
      {
        cuts[static_cast<std::size_t>(++pieces)] = root;
      }
    }
  }
  cuts[static_cast<std::size_t>(++pieces)] = 1;
  return pieces;
}

double TruthCubic::Solve(double value, double lower, double upper) const
{
  const bool rising = (*this)(upper) > (*this)(lower);
  double s = 0.5 * (lower + upper);
  for (int i = 0; i < 200; ++i)
  {
    const double error = (*this)(s)-value;
    if (error == 0)
    {
      return s;
    }
    ((error > 0) == rising ? upper : lower) = s;
    double next = s - error / this->Derivative(s);
    // Newton from inside the bracket; each third step, and where Newton leaves it, bisection.
    if (!(next > lower && next < upper) || i % 3 == 2)
    {
      next = 0.5 * (lower + upper);
    }
    if (next == s || next <= lower || next >= upper)
    {
      return next;
    }
    s = next;
  }
  return s;
}

} // namespace teravox
