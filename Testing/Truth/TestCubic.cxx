// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TruthCubic.h"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

namespace teravox
{
namespace
{

TEST(TruthCubic, EqualsTrilinearAlongALine)
{
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int trial = 0; trial < 1000; ++trial)
  {
    std::array<double, 8> corners{};
    std::array<double, 3> start{};
    std::array<double, 3> end{};
    for (double& corner : corners)
    {
      corner = uniform(random);
    }
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      start[axis] = uniform(random);
      end[axis] = uniform(random);
    }
    const TruthCubic cubic = TruthCubic::FromCell(corners, start, end);
    const double s = uniform(random);
    double expected = 0;
    for (std::size_t corner = 0; corner < 8; ++corner)
    {
      double weight = 1;
      for (std::size_t axis = 0; axis < 3; ++axis)
      {
        const double p = start[axis] + s * (end[axis] - start[axis]);
        weight *= (corner >> axis & 1) != 0 ? p : 1 - p;
      }
      expected += weight * corners[corner];
    }
    EXPECT_NEAR(cubic(s), expected, 4e-15);
  }
}

TEST(TruthCubic, FromSamples)
{
  const TruthCubic cubic{ { 0.3, -2, 5, -1.5 } };
  const TruthCubic fit =
    TruthCubic::FromSamples({ cubic(0), cubic(1 / 3.0), cubic(2 / 3.0), cubic(1) });
  for (std::size_t i = 0; i < 4; ++i)
  {
    EXPECT_NEAR(fit.Coefficients[i], cubic.Coefficients[i], 1e-13);
  }
}

TEST(TruthCubic, PiecesAreMonotone)
{
  std::mt19937 random(8);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int threePieces = 0;
  for (int trial = 0; trial < 2000; ++trial)
  {
    TruthCubic cubic;
    for (double& c : cubic.Coefficients)
    {
      c = uniform(random);
    }
    cubic.Coefficients[2] *= 3; // stationary points inside (0, 1) become frequent
    if (trial % 3 == 0)
    {
      cubic.Coefficients[3] = 0;
    }
    std::array<double, 4> cuts{};
    const int pieces = cubic.MonotonePieces(cuts);
    threePieces += pieces == 3 ? 1 : 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(pieces); ++i)
    {
      const double first = cubic(cuts[i]);
      const double last = cubic(cuts[i + 1]);
      double previous = first;
      for (int step = 1; step <= 50; ++step)
      {
        const double value = cubic(cuts[i] + (cuts[i + 1] - cuts[i]) * step / 50);
        EXPECT_GE((value - previous) * (last >= first ? 1 : -1), -1e-14);
        previous = value;
      }
    }
  }
  EXPECT_GT(threePieces, 10);
}

TEST(TruthCubic, SolvesAlsoAtStationaryPoints)
{
  // (s - 0.3)^2: a double root; 4 (s - 0.5)^3: a triple one.
  const TruthCubic parabola{ { 0.09, -0.6, 1, 0 } };
  std::array<double, 4> cuts{};
  ASSERT_EQ(parabola.MonotonePieces(cuts), 2);
  EXPECT_NEAR(cuts[1], 0.3, 1e-15);
  EXPECT_NEAR(parabola.Solve(1e-8, 0, cuts[1]), 0.3 - 1e-4, 1e-11);
  EXPECT_NEAR(parabola.Solve(1e-8, cuts[1], 1), 0.3 + 1e-4, 1e-11);
  const TruthCubic cubic{ { -0.5, 3, -6, 4 } };
  ASSERT_EQ(cubic.MonotonePieces(cuts), 1);
  EXPECT_NEAR(cubic.Solve(0.032, 0, 1), 0.7, 1e-14);
  EXPECT_NEAR(cubic.Solve(0, 0, 1), 0.5, 1e-5);
}

} // namespace
} // namespace teravox
