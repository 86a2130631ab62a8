// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Formula.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace teravox
{

namespace
{
constexpr double Pi = 3.14159265358979323846;
/// Sines and cosines of the C library aren't monotone to the last bit; bounds are widened by this.
constexpr double TrigonometricError = 1e-12;

double Unit(double v)
{
  return std::clamp(v, 0.0, 1.0);
}

/// Smallest and largest |v| in [low, high].
template <typename T>
std::pair<T, T> AbsoluteRange(T low, T high)
{
  const T a = low < 0 ? -low : low;
  const T b = high < 0 ? -high : high;
  return { low <= 0 && high >= 0 ? T{} : std::min(a, b), std::max(a, b) };
}

class ConstantFormula : public Formula
{
public:
  explicit ConstantFormula(double value)
    : Everywhere(value)
  {
  }
  double Value(const Int3&, const Int3&) const override { return this->Everywhere; }
  ValueRange Bound(const Int3&, const Int3&, const Int3&) const override
  {
    return { this->Everywhere, this->Everywhere };
  }

private:
  const double Everywhere;
};

/// Not limited to 1: the centre of a partial last group lies beyond the volume, and what is linear
/// must stay linear.
class RampFormula : public Formula
{
public:
  RampFormula(const Int3& dimensions, int axis)
    : Axis(static_cast<std::size_t>(std::clamp(axis, 0, 2)))
    , Scale(0.5 / static_cast<double>(dimensions[this->Axis]))
  {
  }
  double Value(const Int3& place, const Int3&) const override { return this->At(place); }
  ValueRange Bound(const Int3& low, const Int3& high, const Int3&) const override
  {
    return { this->At(low), this->At(high) };
  }

private:
  double At(const Int3& place) const
  {
    return static_cast<double>(place[this->Axis] + 1) * this->Scale;
  }
  const std::size_t Axis;
  const double Scale;
};

/// With R = radius * count, shell i has its middle at R = i + Middle. The value falls linearly from
/// 1 to 0 across each face; rounding is monotone all the way, so that bounds at ends are bounds.
class ShellsFormula : public Formula
{
public:
  ShellsFormula(const Int3& dimensions, int count)
    : Dimensions(dimensions)
    , Smallest(static_cast<double>(std::min({ dimensions[0], dimensions[1], dimensions[2] })))
    , Count(std::max(count, 1))
  {
  }

  double Value(const Int3& place, const Int3& factor) const override
  {
    Double3 offset{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      offset[a] = static_cast<double>(place[a] + 1 - this->Dimensions[a]);
    }
    return this->Profile(this->MiddleDistance(this->Radius(offset)), factor);
  }

  ValueRange Bound(const Int3& low, const Int3& high, const Int3& factor) const override
  {
    Double3 nearest{};
    Double3 farthest{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      const auto [least, most] =
        AbsoluteRange(low[a] + 1 - this->Dimensions[a], high[a] + 1 - this->Dimensions[a]);
      nearest[a] = static_cast<double>(least);
      farthest[a] = static_cast<double>(most);
    }
    const double inner = this->Radius(nearest);
    const double outer = this->Radius(farthest);
    const double atInner = this->MiddleDistance(inner);
    const double atOuter = this->MiddleDistance(outer);
    double least = std::min(atInner, atOuter);
    double most = std::max(atInner, atOuter);
    for (int i = 0; i < this->Count; ++i)
    {
      // The middle of a shell, and the middle between it and the one before.
      least = inner <= i + Middle && i + Middle <= outer ? 0.0 : least;
      most = i > 0 && inner <= i + Middle - 0.5 && i + Middle - 0.5 <= outer
        ? std::max(most, 0.5 + 1e-9)
        : most;
    }
    return { this->Profile(most, factor), this->Profile(least, factor) };
  }

private:
  static constexpr double Middle = 0.85;
  static constexpr double HalfThickness = 0.15;

  double Radius(const Double3& offset) const
  {
    const double square = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
    return std::sqrt(square) / this->Smallest * this->Count;
  }
  /// Distance to the middle of the nearest shell.
  double MiddleDistance(double radius) const
  {
    const double shell = std::clamp(std::floor(radius), 0.0, this->Count - 1.0);
    const double distance = std::abs(radius - (shell + Middle));
    return shell > 0 ? std::min(distance, std::abs(radius - (shell - 1 + Middle))) : distance;
  }
  double Profile(double distance, const Int3& factor) const
  {
    // Half the width of the soft face: 5 % of a period, at least one voxel.
    const double voxel = 2.0 * static_cast<double>(std::max({ factor[0], factor[1], factor[2] })) *
      this->Count / this->Smallest;
    return Unit(0.5 + (HalfThickness - distance) / (2 * std::max(0.05, voxel)));
  }

  const Int3 Dimensions;
  const double Smallest;
  const int Count;
};

/// Marschner, Lobb: An evaluation of reconstruction filters for volume rendering, 1994, equation 8.
class MarschnerLobbFormula : public Formula
{
public:
  explicit MarschnerLobbFormula(const Int3& dimensions)
    : Dimensions(dimensions)
  {
  }

  double Value(const Int3& place, const Int3&) const override
  {
    const double radius = std::hypot(this->At(place, 0), this->At(place, 1));
    return Combine(std::sin(Pi / 2 * this->At(place, 2)), std::cos(Phase(radius)));
  }

  ValueRange Bound(const Int3& low, const Int3& high, const Int3&) const override
  {
    const auto [xLeast, xMost] = AbsoluteRange(this->At(low, 0), this->At(high, 0));
    const auto [yLeast, yMost] = AbsoluteRange(this->At(low, 1), this->At(high, 1));
    // The phase falls with the radius.
    const double first = Phase(std::hypot(xMost, yMost)) - TrigonometricError;
    const double last = Phase(std::hypot(xLeast, yLeast)) + TrigonometricError;
    const double atFirst = std::cos(first);
    const double atLast = std::cos(last);
    const auto reaches = [&](double phase)
    { return std::floor((last - phase) / (2 * Pi)) > std::floor((first - phase) / (2 * Pi)); };
    const double cosMost = reaches(0) ? 1.0 : std::max(atFirst, atLast);
    const double cosLeast = reaches(Pi) ? -1.0 : std::min(atFirst, atLast);
    const double sinLeast = std::sin(Pi / 2 * this->At(low, 2));
    const double sinMost = std::sin(Pi / 2 * this->At(high, 2));
    return { Combine(sinMost, cosLeast) - 10 * TrigonometricError,
      Combine(sinLeast, cosMost) + 10 * TrigonometricError };
  }

private:
  static constexpr double Alpha = 0.25;
  static constexpr double Frequency = 6;

  double At(const Int3& place, std::size_t axis) const
  {
    const std::int64_t n = this->Dimensions[axis];
    return std::clamp(static_cast<double>(place[axis] + 1 - n) / static_cast<double>(n), -1.0, 1.0);
  }
  static double Phase(double radius) { return 2 * Pi * Frequency * std::cos(Pi / 2 * radius); }
  static double Combine(double sine, double cosine)
  {
    return (1 - sine + Alpha * (1 + cosine)) / (2 * (1 + Alpha));
  }

  const Int3 Dimensions;
};

/// Menger's sponge, S = { p : at each depth at most one coordinate has the base-3 digit 1 }.
///
/// Digits are taken from integers: with n = t + 1 out of M = 2 N, the remainder of n 3^k modulo M
/// is the place inside the cell of depth k, exactly. There each axis tells how deep the place lies
/// in the middle third, the median of the three how deep in the hole (negative: how far from it),
/// both in voxels; the deepest hole of all depths decides. Depths whose holes are narrower than
/// NarrowestHole voxels are left solid; faces are soft across HalfWidth voxels to both sides.
/// Bounds: per axis and depth the exact range of a triangle wave over an interval of integers; the
/// median is monotone in each axis.
class SpongeFormula : public Formula
{
public:
  explicit SpongeFormula(const Int3& dimensions)
    : Dimensions(dimensions)
    , Smallest(static_cast<double>(std::min({ dimensions[0], dimensions[1], dimensions[2] })))
  {
  }

  double Value(const Int3& place, const Int3& factor) const override
  {
    const int depths = this->Depths(factor);
    double hole = -this->Smallest;
    double edge = this->Smallest;
    std::int64_t power = 1;
    for (int k = 0; k < depths; ++k, edge /= 3, power *= 3)
    {
      const double x = this->Inside(0, this->Wave(0, place[0], power), edge);
      const double y = this->Inside(1, this->Wave(1, place[1], power), edge);
      const double z = this->Inside(2, this->Wave(2, place[2], power), edge);
      hole = std::max(hole, std::clamp(x, std::min(y, z), std::max(y, z)));
    }
    return Solid(hole, factor);
  }

  ValueRange Bound(const Int3& low, const Int3& high, const Int3& factor) const override
  {
    const int depths = this->Depths(factor);
    double least = -this->Smallest;
    double most = -this->Smallest;
    double edge = this->Smallest;
    std::int64_t power = 1;
    for (int k = 0; k < depths; ++k, edge /= 3, power *= 3)
    {
      Double3 from{};
      Double3 to{};
      for (std::size_t a = 0; a < 3; ++a)
      {
        const auto [nearest, farthest] = this->WaveRange(a, low[a], high[a], power);
        from[a] = this->Inside(a, farthest, edge);
        to[a] = this->Inside(a, nearest, edge);
      }
      const auto median = [](const Double3& v)
      { return std::clamp(v[0], std::min(v[1], v[2]), std::max(v[1], v[2])); };
      least = std::max(least, median(from));
      most = std::max(most, median(to));
    }
    return { Solid(most, factor), Solid(least, factor) };
  }

  void Fill(const Grid& places, const Int3& factor, double* values) const override
  {
    // What an axis contributes doesn't depend on the others: tables of depth by place.
    const std::size_t depths = static_cast<std::size_t>(this->Depths(factor));
    std::array<std::vector<double>, 3> inside;
    for (std::size_t a = 0; a < 3; ++a)
    {
      double edge = this->Smallest;
      std::int64_t power = 1;
      for (std::size_t k = 0; k < depths; ++k, edge /= 3, power *= 3)
      {
        for (const std::int64_t place : places[a])
        {
          inside[a].push_back(this->Inside(a, this->Wave(a, place, power), edge));
        }
      }
    }
    const std::size_t width = places[0].size();
    for (std::size_t z = 0; z < places[2].size(); ++z)
    {
      for (std::size_t y = 0; y < places[1].size(); ++y, values += width)
      {
        std::fill(values, values + width, -this->Smallest);
        for (std::size_t k = 0; k < depths; ++k)
        {
          const auto [low, high] =
            std::minmax(inside[1][k * places[1].size() + y], inside[2][k * places[2].size() + z]);
          const double* const row = inside[0].data() + k * width;
          for (std::size_t x = 0; x < width; ++x)
          {
            values[x] = std::max(values[x], std::min(std::max(row[x], low), high));
          }
        }
        for (std::size_t x = 0; x < width; ++x)
        {
          values[x] = Solid(values[x], factor);
        }
      }
    }
  }

private:
  static constexpr double NarrowestHole = 6;
  static constexpr double HalfWidth = 1.5;

  static double Edge(const Int3& factor)
  {
    return static_cast<double>(std::max({ factor[0], factor[1], factor[2] }));
  }
  int Depths(const Int3& factor) const
  {
    int depths = 0;
    double hole = this->Smallest / 3;
    while (hole >= NarrowestHole * Edge(factor))
    {
      hole /= 3;
      ++depths;
    }
    return depths;
  }
  /// The numerator n, inside the volume also for the last partial group.
  std::int64_t Numerator(std::size_t axis, std::int64_t place) const
  {
    return std::clamp<std::int64_t>(place + 1, 0, 2 * this->Dimensions[axis]);
  }
  /// |2 r - M| for the remainder r: 0 in the middle of a cell, M at its faces.
  std::int64_t Wave(std::size_t axis, std::int64_t place, std::int64_t power) const
  {
    const std::int64_t m = 2 * this->Dimensions[axis];
    return std::abs(2 * (this->Numerator(axis, place) * power % m) - m);
  }
  /// Least and largest wave over an interval of places.
  std::pair<std::int64_t, std::int64_t> WaveRange(
    std::size_t axis, std::int64_t low, std::int64_t high, std::int64_t power) const
  {
    const std::int64_t m = 2 * this->Dimensions[axis];
    const std::int64_t first = this->Numerator(axis, low) * power;
    const std::int64_t length = this->Numerator(axis, high) * power - first;
    if (length >= m)
    {
      return { 0, m };
    }
    const std::int64_t from = first % m;
    const std::int64_t to = from + length;
    const std::int64_t atFrom = this->Wave(axis, low, power);
    const std::int64_t atTo = this->Wave(axis, high, power);
    const bool middle = (from <= m / 2 && m / 2 <= to) || to >= m + m / 2;
    const bool face = from == 0 || to >= m;
    return { middle ? 0 : std::min(atFrom, atTo), face ? m : std::max(atFrom, atTo) };
  }
  /// How deep in the middle third, in voxels.
  double Inside(std::size_t axis, std::int64_t wave, double edge) const
  {
    return (1.0 / 6 -
             static_cast<double>(wave) / (4.0 * static_cast<double>(this->Dimensions[axis]))) *
      edge;
  }
  static double Solid(double hole, const Int3& factor)
  {
    return Unit(0.5 - hole / (2 * HalfWidth * Edge(factor)));
  }

  const Int3 Dimensions;
  const double Smallest;
};
} // namespace

void Formula::Fill(const Grid& places, const Int3& factor, double* values) const
{
  for (const std::int64_t z : places[2])
  {
    for (const std::int64_t y : places[1])
    {
      for (const std::int64_t x : places[0])
      {
        *values++ = this->Value({ x, y, z }, factor);
      }
    }
  }
}

const char* ToString(FormulaKind kind)
{
  static constexpr std::array<const char*, AllFormulaKinds.size()> names = { "constant", "ramp",
    "shells", "marschner-lobb", "sponge" };
  return names.at(static_cast<std::size_t>(kind));
}

Result<FormulaKind> FormulaKindFromName(const std::string& name)
{
  std::string names;
  for (const FormulaKind kind : AllFormulaKinds)
  {
    if (name == ToString(kind))
    {
      return kind;
    }
    names += (names.empty() ? "" : ", ") + std::string(ToString(kind));
  }
  return Status(
    StatusCode::InvalidArgument, "There is no formula \"" + name + "\"; there are " + names + ".");
}

std::shared_ptr<const Formula> MakeConstant(double value)
{
  return std::make_shared<ConstantFormula>(value);
}

std::shared_ptr<const Formula> MakeRamp(const Int3& dimensions, int axis)
{
  return std::make_shared<RampFormula>(dimensions, axis);
}

std::shared_ptr<const Formula> MakeShells(const Int3& dimensions, int count)
{
  return std::make_shared<ShellsFormula>(dimensions, count);
}

std::shared_ptr<const Formula> MakeFormula(FormulaKind kind, const Int3& dimensions)
{
  switch (kind)
  {
    case FormulaKind::Constant:
      return MakeConstant(0.5);
    case FormulaKind::Ramp:
      return MakeRamp(dimensions, 0);
    case FormulaKind::Shells:
      return MakeShells(dimensions, 4);
    case FormulaKind::MarschnerLobb:
      return std::make_shared<MarschnerLobbFormula>(dimensions);
    case FormulaKind::Sponge:
    default:
      return std::make_shared<SpongeFormula>(dimensions);
  }
}

} // namespace teravox
