// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TruthTransfer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

namespace teravox
{
namespace
{

bool IsEmpty(const TruthTransfer::Alpha& alpha, double lower, double upper)
{
  // Offsets of a badly approximable number, so that no period of the function can hide.
  for (int i = 0; i < 64; ++i)
  {
    const double place = std::fmod((i + 0.5) * 0.61803398874989485, 1.0);
    double value = lower + place * (upper - lower);
    if (!std::isfinite(lower) && !std::isfinite(upper))
    {
      value = std::ldexp(place - 0.5, i - 20);
    }
    else if (!std::isfinite(lower))
    {
      value = upper - std::ldexp(std::max(1.0, std::fabs(upper)) * place, i - 40);
    }
    else if (!std::isfinite(upper))
    {
      value = lower + std::ldexp(std::max(1.0, std::fabs(lower)) * place, i - 40);
    }
    if (alpha(value) != 0)
    {
      return false;
    }
  }
  return true;
}

/// Index of the first node behind `value`.
template <typename Node>
std::size_t UpperNode(const std::vector<Node>& nodes, double value)
{
  return static_cast<std::size_t>(std::upper_bound(nodes.begin(), nodes.end(), value,
                                    [](double v, const Node& node) { return v < node.Value; }) -
    nodes.begin());
}

} // namespace

TruthTransfer::TruthTransfer(
  Alpha alpha, Color color, std::vector<double> knots, double unitDistance)
  : Alpha_(std::move(alpha))
  , Color_(std::move(color))
  , Knots_(std::move(knots))
  , UnitDistance_(unitDistance)
{
  assert(unitDistance > 0);
  std::sort(this->Knots_.begin(), this->Knots_.end());
  this->Knots_.erase(std::unique(this->Knots_.begin(), this->Knots_.end()), this->Knots_.end());
  const double infinity = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i <= this->Knots_.size(); ++i)
  {
    const double lower = i == 0 ? -infinity : this->Knots_[i - 1];
    const double upper = i == this->Knots_.size() ? infinity : this->Knots_[i];
    this->Empty.push_back(IsEmpty(this->Alpha_, lower, upper));
  }
  for (const double knot : this->Knots_)
  {
    this->KnotEmpty.push_back(this->Alpha_(knot) == 0);
  }
}

TruthTransfer TruthTransfer::PiecewiseLinear(
  std::vector<AlphaNode> alpha, std::vector<ColorNode> color, double unitDistance)
{
  assert(!alpha.empty() && !color.empty());
  std::vector<double> knots;
  knots.reserve(alpha.size() + color.size());
  for (const AlphaNode& node : alpha)
  {
    knots.push_back(node.Value);
  }
  for (const ColorNode& node : color)
  {
    knots.push_back(node.Value);
  }
  Alpha alphaFunction = [alpha = std::move(alpha)](double value)
  {
    const std::size_t i = UpperNode(alpha, value);
    if (i == 0 || i == alpha.size())
    {
      return i == 0 ? alpha.front().Alpha : alpha.back().Alpha;
    }
    const double place = (value - alpha[i - 1].Value) / (alpha[i].Value - alpha[i - 1].Value);
    // In this form, two equal nodes give exactly their value: 1 must stay a wall.
    return alpha[i - 1].Alpha + place * (alpha[i].Alpha - alpha[i - 1].Alpha);
  };
  Color colorFunction = [color = std::move(color)](double value)
  {
    const std::size_t i = UpperNode(color, value);
    if (i == 0 || i == color.size())
    {
      return i == 0 ? color.front().Color : color.back().Color;
    }
    const double place = (value - color[i - 1].Value) / (color[i].Value - color[i - 1].Value);
    return color[i - 1].Color + place * (color[i].Color - color[i - 1].Color);
  };
  return TruthTransfer(
    std::move(alphaFunction), std::move(colorFunction), std::move(knots), unitDistance);
}

double TruthTransfer::Extinction(double alpha) const
{
  if (!(alpha > 0))
  {
    return 0;
  }
  // The largest double below 1: what a rounded opacity next to a singular point can mean at most.
  const double below1 = 1 - std::numeric_limits<double>::epsilon() / 2;
  return -std::log1p(-std::min(alpha, below1)) / this->UnitDistance_;
}

std::size_t TruthTransfer::IntervalOf(double value) const
{
  return static_cast<std::size_t>(
    std::upper_bound(this->Knots_.begin(), this->Knots_.end(), value) - this->Knots_.begin());
}

bool TruthTransfer::IsRangeEmpty(double min, double max) const
{
  const std::size_t first = this->IntervalOf(min);
  const std::size_t last = this->IntervalOf(max);
  for (std::size_t i = first; i <= last; ++i)
  {
    if (!this->Empty[i] || (i < last && !this->KnotEmpty[i]))
    {
      return false;
    }
  }
  // A minimum that lies exactly on a knot belongs to the interval above it, but has the knot's
  // alpha.
  return first == 0 || this->Knots_[first - 1] != min || this->KnotEmpty[first - 1];
}

} // namespace teravox
