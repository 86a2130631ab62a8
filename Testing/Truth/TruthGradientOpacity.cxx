// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TruthGradientOpacity.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace teravox
{
namespace
{

double Evaluate(const std::vector<double>& coefficients, double x)
{
  double value = 0;
  for (std::size_t i = coefficients.size(); i > 0; --i)
  {
    value = value * x + coefficients[i - 1];
  }
  return value;
}

std::vector<double> Derivative(const std::vector<double>& coefficients)
{
  std::vector<double> result;
  for (std::size_t i = 1; i < coefficients.size(); ++i)
  {
    result.push_back(static_cast<double>(i) * coefficients[i]);
  }
  return result;
}

} // namespace

std::vector<double> PolynomialRoots(
  const std::vector<double>& coefficients, double lower, double upper)
{
  std::vector<double> roots;
  if (coefficients.size() < 2)
  {
    return roots;
  }
  // Between two roots of the derivative there is at most one.
  std::vector<double> ends = PolynomialRoots(Derivative(coefficients), lower, upper);
  ends.insert(ends.begin(), lower);
  ends.push_back(upper);
  const auto add = [&](double x)
  {
    if (x > lower && x < upper && (roots.empty() || x > roots.back()))
    {
      roots.push_back(x);
    }
  };
  for (std::size_t i = 0; i + 1 < ends.size(); ++i)
  {
    double a = ends[i];
    double b = ends[i + 1];
    const double atA = Evaluate(coefficients, a);
    const double atB = Evaluate(coefficients, b);
    if (atA == 0)
    {
      add(a);
    }
    if (atA * atB < 0)
    {
      for (double middle = 0.5 * (a + b); middle > a && middle < b; middle = 0.5 * (a + b))
      {
        ((Evaluate(coefficients, middle) < 0) == (atA < 0) ? a : b) = middle;
      }
      add(b);
    }
  }
  return roots;
}

TruthGradientOpacity::TruthGradientOpacity(
  Function function, std::vector<double> knots, const Double3& spacing)
  : Opacity(std::move(function))
  , Knots(std::move(knots))
  , Spacing(spacing)
{
}

Double3 TruthGradientOpacity::Scale(const Double3& factor) const
{
  const double mean = (this->Spacing[0] + this->Spacing[1] + this->Spacing[2]) / 3;
  Double3 scale{};
  for (std::size_t axis = 0; axis < 3; ++axis)
  {
    scale[axis] = mean / (2 * this->Spacing[axis] * factor[axis]);
  }
  return scale;
}

double TruthGradientOpacity::Magnitude(const Double3& difference, const Double3& factor) const
{
  const Double3 scale = this->Scale(factor);
  double square = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
  {
    square += std::pow(difference[axis] * scale[axis], 2);
  }
  return std::isnan(square) ? 0 : std::sqrt(square);
}

std::vector<double> TruthGradientOpacity::Bends(
  const std::array<TruthCubic, 3>& differences, const Double3& factor) const
{
  const Double3 scale = this->Scale(factor);
  std::vector<double> square(7, 0.0);
  for (std::size_t axis = 0; axis < 3; ++axis)
  {
    const std::array<double, 4>& c = differences[axis].Coefficients;
    for (std::size_t i = 0; i < 4; ++i)
    {
      for (std::size_t j = 0; j < 4; ++j)
      {
        square[i + j] += c[i] * c[j] * scale[axis] * scale[axis];
      }
    }
  }
  if (!std::isfinite(Evaluate(square, 1)))
  {
    return {};
  }
  // The square root bends sharply where the square is small. Between two places where the square is
  // stationary it passes a knot once.
  std::vector<double> bends = PolynomialRoots(Derivative(square), 0, 1);
  std::vector<double> ends = bends;
  ends.insert(ends.begin(), 0);
  ends.push_back(1);
  for (std::size_t i = 0; i + 1 < ends.size(); ++i)
  {
    const double first = Evaluate(square, ends[i]);
    const double last = Evaluate(square, ends[i + 1]);
    for (const double knot : this->Knots)
    {
      const double wanted = knot * knot;
      if (!((first < wanted) != (last < wanted)))
      {
        continue;
      }
      double a = ends[i];
      double b = ends[i + 1];
      for (double middle = 0.5 * (a + b); middle > a && middle < b; middle = 0.5 * (a + b))
      {
        ((Evaluate(square, middle) < wanted) == (first < wanted) ? a : b) = middle;
      }
      bends.push_back(b);
    }
  }
  std::sort(bends.begin(), bends.end());
  return bends;
}

} // namespace teravox
