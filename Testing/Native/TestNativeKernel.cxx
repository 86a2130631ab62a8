// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Single functions of the kernel against double precision, for each instruction set; both must
// agree to the bit.
#include "KernelFunctions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace teravox
{

namespace
{
using test::KernelFunctions;
using Lane8 = KernelFunctions::Lane8;

struct Set
{
  std::string Name;
  KernelFunctions Functions;
};

std::vector<Set> AllSets()
{
  std::vector<Set> sets{ { "baseline", test::BaselineKernelFunctions() } };
#if TERAVOX_HAS_AVX2_KERNEL
  if (__builtin_cpu_supports("avx2") != 0)
  {
    sets.push_back({ "AVX2", test::AVX2KernelFunctions() });
  }
#endif
  return sets;
}

double Uniform(std::mt19937& random, double low, double high)
{
  return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
}

void Fill(std::mt19937& random, Lane8& lanes, double low, double high)
{
  for (float& lane : lanes)
  {
    lane = static_cast<float>(Uniform(random, low, high));
  }
}

// The largest relative error of a function of one number over numbers that lie close together, and
// whether all instruction sets agree.
double LargestError(const std::vector<float>& numbers,
  const std::function<void(const KernelFunctions&, const Lane8&, Lane8&)>& approximate,
  const std::function<double(double)>& exact)
{
  double largest = 0;
  const std::vector<Set> sets = AllSets();
  for (std::size_t i = 0; i < numbers.size(); i += 8)
  {
    Lane8 x{};
    for (std::size_t l = 0; l < 8; ++l)
    {
      x[l] = numbers[std::min(i + l, numbers.size() - 1)];
    }
    Lane8 first{};
    approximate(sets[0].Functions, x, first);
    for (const Set& set : sets)
    {
      Lane8 y{};
      approximate(set.Functions, x, y);
      EXPECT_EQ(std::memcmp(y, first, sizeof(y)), 0) << set.Name << " at " << x[0];
    }
    for (std::size_t l = 0; l < 8; ++l)
    {
      const double truth = exact(static_cast<double>(x[l]));
      const double error = std::abs(static_cast<double>(first[l]) - truth);
      largest = std::max(largest, truth == 0 ? error : error / std::abs(truth));
    }
  }
  return largest;
}

std::vector<float> Numbers(double low, double high, int count)
{
  std::vector<float> numbers;
  for (int i = 0; i <= count; ++i)
  {
    numbers.push_back(static_cast<float>(low + (high - low) * i / count));
  }
  return numbers;
}
} // namespace

TEST(NativeKernel, ExpOfMinus)
{
  const auto approximate = [](const KernelFunctions& f, const Lane8& x, Lane8& y)
  { f.ExpOfMinus(x, y); };
  const auto exact = [](double x) { return std::exp(-x); };
  EXPECT_LE(LargestError(Numbers(0, 87, 400000), approximate, exact), 3e-7);
  EXPECT_LE(LargestError(Numbers(0, 0.01, 20000), approximate, exact), 3e-7);
  for (const Set& set : AllSets())
  {
    const KernelFunctions& f = set.Functions;
    // Beyond 87, infinity included, it is the same tiny number; nothing lets all pass.
    const Lane8 x{ 0, 87, 88, 1000, 1e30f, std::numeric_limits<float>::infinity(), 1, 2 };
    Lane8 y{};
    f.ExpOfMinus(x, y);
    EXPECT_EQ(y[0], 1.0f) << set.Name;
    for (int l = 1; l < 6; ++l)
    {
      EXPECT_EQ(y[l], y[1]) << set.Name;
    }
    EXPECT_GT(y[1], 0.0f) << set.Name;
    EXPECT_LT(y[1], 2e-38f) << set.Name;
    // One lane or eight.
    for (int l = 0; l < 8; ++l)
    {
      EXPECT_EQ(f.ExpOfMinusOne(x[l]), y[l]) << set.Name;
    }
  }
}

TEST(NativeKernel, PowerOf)
{
  for (const float power : { 0.0f, 0.5f, 1.0f, 5.0f, 20.0f, 128.0f })
  {
    const auto approximate = [&](const KernelFunctions& f, const Lane8& x, Lane8& y)
    { f.PowerOf(x, power, y); };
    const auto exact = [&](double x) { return std::pow(x, static_cast<double>(power)); };
    // Down to highlights of a millionth: an error of the logarithm counts as often as it is large.
    const double least = power > 0 ? std::pow(1e-6, 1 / static_cast<double>(power)) : 1e-30;
    EXPECT_LE(LargestError(Numbers(least, 1, 200000), approximate, exact), 3e-6) << power;
  }
  for (const Set& set : AllSets())
  {
    const Lane8 x{ 0, 1, 1e-40f, -0.0f, 1e-20f, 0.5f, 1, 0 };
    Lane8 y{};
    set.Functions.PowerOf(x, 30, y);
    EXPECT_EQ(y[0], 0.0f) << set.Name;
    EXPECT_EQ(y[1], 1.0f) << set.Name;
    EXPECT_EQ(y[2], 0.0f) << set.Name;
    EXPECT_EQ(y[3], 0.0f) << set.Name;
    EXPECT_LT(y[4], 2e-38f) << set.Name;
  }
}

TEST(NativeKernel, OpacityOf)
{
  const auto approximate = [](const KernelFunctions& f, const Lane8& x, Lane8& y)
  { f.OpacityOf(x, y); };
  const auto exact = [](double x) { return -std::expm1(-x); };
  // Thin pieces lose nothing by cancellation; the two branches meet at 0.03.
  EXPECT_LE(LargestError(Numbers(0, 0.0299, 100000), approximate, exact), 3e-7);
  EXPECT_LE(LargestError(Numbers(1e-30, 1e-20, 1000), approximate, exact), 3e-7);
  EXPECT_LE(LargestError(Numbers(0.03, 0.2, 100000), approximate, exact), 5e-6);
  EXPECT_LE(LargestError(Numbers(0.2, 100, 200000), approximate, exact), 1e-6);
  for (const Set& set : AllSets())
  {
    const Lane8 x{ 0, 0.0299999f, 0.03f, 20, 100, std::numeric_limits<float>::infinity(), 0, 0 };
    Lane8 y{};
    set.Functions.OpacityOf(x, y);
    EXPECT_EQ(y[0], 0.0f) << set.Name;
    EXPECT_NEAR(y[1], y[2], 2e-7f) << set.Name;
    EXPECT_EQ(y[4], 1.0f) << set.Name;
    EXPECT_EQ(y[5], 1.0f) << set.Name;
  }
}

// Where the light of a piece of linear extinction comes from, by the midpoint rule.
double Centroid(double front, double back, double depth)
{
  constexpr int steps = 4000;
  const double share = front / (front + back);
  double light = 0;
  double moment = 0;
  for (int i = 0; i < steps; ++i)
  {
    const double u = (i + 0.5) / steps;
    const double s = 2 * (share + (1 - 2 * share) * u);
    const double before = depth * (2 * share * u + (1 - 2 * share) * u * u);
    light += s * std::exp(-before);
    moment += u * s * std::exp(-before);
  }
  return moment / light;
}

TEST(NativeKernel, CentroidOfALinearExtinction)
{
  for (const Set& set : AllSets())
  {
    for (int i = 0; i <= 20; ++i)
    {
      const float front = static_cast<float>(i) / 20;
      const Lane8 fronts{ front, front, front, front, front, front, front, front };
      const float back = 1 - front;
      const Lane8 backs{ back, back, back, back, back, back, back, back };
      const Lane8 depths{ 1e-6f, 0.1f, 0.3f, 1, 2, 4, 8, 12 };
      const double bounds[8]{ 1e-5, 2e-4, 4e-4, 1.6e-3, 2.1e-3, 3.6e-3, 0.028, 0.028 };
      Lane8 r{};
      set.Functions.CentroidOf(fronts, backs, depths, r);
      for (int l = 0; l < 8; ++l)
      {
        EXPECT_NEAR(static_cast<double>(r[l]),
          Centroid(
            static_cast<double>(front), static_cast<double>(back), static_cast<double>(depths[l])),
          bounds[l])
          << set.Name << ", front " << front << ", depth " << depths[l];
      }
    }
    // Nothing, and more than any number.
    const float infinity = std::numeric_limits<float>::infinity();
    const Lane8 fronts{ 0, 0, 1, 1e-30f, 1e30f, 0, 1, 0 };
    const Lane8 backs{ 0, 1, 0, 1e-30f, 1e30f, 1e-38f, 1, 0 };
    const Lane8 depths{ 0, infinity, infinity, 0, 1e30f, 0, infinity, 1 };
    Lane8 r{};
    set.Functions.CentroidOf(fronts, backs, depths, r);
    for (int l = 0; l < 8; ++l)
    {
      EXPECT_TRUE(r[l] >= 0 && r[l] <= 1) << set.Name << ", lane " << l << ": " << r[l];
    }
  }
}

TEST(NativeKernel, OneKinkOfAColourIsKnown)
{
  std::mt19937 random(1);
  for (int round = 0; round < 2000; ++round)
  {
    Lane8 values[2];
    Lane8 slopes[2];
    Lane8 dx;
    Lane8 kink;
    Fill(random, values[0], 0, 1);
    Fill(random, slopes[0], -0.1, 0.1);
    Fill(random, slopes[1], -0.1, 0.1);
    Fill(random, dx, 1, 10);
    Fill(random, kink, 0.1, 0.9); // where, as a share of the piece
    for (int l = 0; l < 8; ++l)
    {
      values[1][l] = values[0][l] + dx[l] * (kink[l] * slopes[0][l] + (1 - kink[l]) * slopes[1][l]);
    }
    for (const Set& set : AllSets())
    {
      Lane8 mean{};
      Lane8 error{};
      set.Functions.KinkOf(values, slopes, dx, mean, error);
      for (int l = 0; l < 8; ++l)
      {
        // The area of the triangle above the line between the ends.
        const float bend = dx[l] * (slopes[0][l] - slopes[1][l]);
        const float area = 0.5f * kink[l] * (1 - kink[l]) * bend;
        const float most = std::abs(bend) * std::max(kink[l], 1 - kink[l]);
        // The slightest ones aren't worth a division.
        const bool slight = most < 2e-3f && mean[l] == 0.0f;
        EXPECT_NEAR(mean[l], slight ? 0.0f : area, 1e-5) << set.Name;
        EXPECT_LE(error[l], 0.25f * most + 1e-6f) << set.Name;
        EXPECT_GE(error[l], 0.05f * most - 1e-6f) << set.Name;
      }
    }
  }
  // Equal slopes at the ends and another in between: two kinks. No mean, and the full error.
  const Lane8 values[2]{ { 0, 0, 0, 0, 0, 0, 0, 0 }, { 1, 1, 1, 1, 1, 1, 1, 1 } };
  const Lane8 slopes[2]{};
  const Lane8 dx{ 2, 2, 2, 2, 2, 2, 2, 2 };
  for (const Set& set : AllSets())
  {
    Lane8 mean{};
    Lane8 error{};
    set.Functions.KinkOf(values, slopes, dx, mean, error);
    EXPECT_EQ(mean[3], 0.0f) << set.Name;
    EXPECT_EQ(error[3], 0.25f) << set.Name;
  }
}

TEST(NativeKernel, TransposeThereAndBack)
{
  for (const Set& set : AllSets())
  {
    Lane8 columns[4];
    for (int c = 0; c < 4; ++c)
    {
      for (int l = 0; l < 8; ++l)
      {
        columns[c][l] = static_cast<float>(10 * l + c);
      }
    }
    float rows[8][4];
    Lane8 again[4];
    set.Functions.Transpose(columns, rows, again);
    for (int c = 0; c < 4; ++c)
    {
      for (int l = 0; l < 8; ++l)
      {
        EXPECT_EQ(rows[l][c], columns[c][l]) << set.Name;
        EXPECT_EQ(again[c][l], columns[c][l]) << set.Name;
      }
    }
  }
}

namespace
{
// Trilinear interpolation, directly.
double Interpolate(const std::array<double, 8>& corners, double x, double y, double z)
{
  double sum = 0;
  for (std::size_t i = 0; i < 8; ++i)
  {
    sum += corners[i] * ((i & 1) != 0 ? x : 1 - x) * ((i & 2) != 0 ? y : 1 - y) *
      ((i & 4) != 0 ? z : 1 - z);
  }
  return sum;
}

double Along(const Lane8 (&c)[4], int lane, double u)
{
  return static_cast<double>(c[0][lane]) +
    u *
    (static_cast<double>(c[1][lane]) +
      u * (static_cast<double>(c[2][lane]) + u * static_cast<double>(c[3][lane])));
}

// Segments inside of a cell: from w to w + d.
void RandomSegments(std::mt19937& random, Lane8 (&w)[3], Lane8 (&d)[3])
{
  for (int a = 0; a < 3; ++a)
  {
    for (int l = 0; l < 8; ++l)
    {
      const double begin = Uniform(random, 0, 1);
      w[a][l] = static_cast<float>(begin);
      d[a][l] = static_cast<float>(Uniform(random, 0, 1) - begin);
    }
  }
}
} // namespace

TEST(NativeKernel, CubicAlongIsTheTrilinearField)
{
  for (const Set& set : AllSets())
  {
    std::mt19937 random(1);
    for (int round = 0; round < 2000; ++round)
    {
      Lane8 corners[8];
      Lane8 w[3];
      Lane8 d[3];
      Lane8 cubic[4];
      for (Lane8& corner : corners)
      {
        Fill(random, corner, 0, 255);
      }
      RandomSegments(random, w, d);
      set.Functions.CubicAlong(corners, w, d, cubic);
      for (int l = 0; l < 8; ++l)
      {
        std::array<double, 8> k{};
        for (std::size_t i = 0; i < 8; ++i)
        {
          k[i] = static_cast<double>(corners[i][l]);
        }
        for (const double u : { 0.0, 0.25, 0.5, 0.9, 1.0 })
        {
          const auto at = [&](int a)
          { return static_cast<double>(w[a][l]) + u * static_cast<double>(d[a][l]); };
          // Sixteen roundings of numbers up to a thousand.
          ASSERT_NEAR(Along(cubic, l, u), Interpolate(k, at(0), at(1), at(2)), 1e-3) << set.Name;
        }
      }
    }
  }
}

namespace
{
template <typename T>
void ExpectGradients(const Set& set, unsigned seed)
{
  constexpr int edge = 9;
  std::mt19937 random(seed);
  // As in an atlas: some bytes before and behind are readable, and hold something else.
  constexpr std::size_t margin = 64;
  std::vector<std::uint8_t> memory(2 * margin + edge * edge * edge * sizeof(T), 0xa5);
  std::vector<T> texels;
  for (int i = 0; i < edge * edge * edge; ++i)
  {
    texels.push_back(static_cast<T>(Uniform(random, 0, 250)));
  }
  std::memcpy(memory.data() + margin, texels.data(), texels.size() * sizeof(T));
  const auto texel = [&](int x, int y, int z)
  { return static_cast<double>(texels[static_cast<std::size_t>(x + edge * (y + edge * z))]); };
  for (int round = 0; round < 500; ++round)
  {
    std::array<std::array<int, 3>, 8> cells{};
    std::int32_t voxels[8];
    for (std::size_t l = 0; l < 8; ++l)
    {
      for (int& c : cells[l])
      {
        c = 1 + static_cast<int>(random() % (edge - 3)); // central differences stay in the brick
      }
      voxels[l] = cells[l][0] + edge * (cells[l][1] + edge * cells[l][2]);
    }
    Lane8 w[3];
    Lane8 d[3];
    RandomSegments(random, w, d);
    Lane8 corners[8];
    Lane8 cubics[3][4];
    set.Functions.LoadGradient(
      sizeof(T), memory.data() + margin, edge, voxels, w, d, corners, cubics);
    for (int l = 0; l < 8; ++l)
    {
      const auto& cell = cells[static_cast<std::size_t>(l)];
      for (int axis = 0; axis < 3; ++axis)
      {
        std::array<double, 8> k{};
        for (int i = 0; i < 8; ++i)
        {
          const int x = cell[0] + (i & 1);
          const int y = cell[1] + (i >> 1 & 1);
          const int z = cell[2] + (i >> 2);
          ASSERT_EQ(static_cast<double>(corners[i][l]), texel(x, y, z)) << set.Name;
          const int dx = axis == 0 ? 1 : 0;
          const int dy = axis == 1 ? 1 : 0;
          const int dz = axis == 2 ? 1 : 0;
          k[static_cast<std::size_t>(i)] =
            texel(x + dx, y + dy, z + dz) - texel(x - dx, y - dy, z - dz);
        }
        for (const double u : { 0.0, 0.4, 1.0 })
        {
          const auto at = [&](int a)
          { return static_cast<double>(w[a][l]) + u * static_cast<double>(d[a][l]); };
          ASSERT_NEAR(Along(cubics[axis], l, u), Interpolate(k, at(0), at(1), at(2)), 2e-3)
            << set.Name << ", axis " << axis;
        }
      }
    }
  }
}
} // namespace

TEST(NativeKernel, LoadGradientIsTheCentralDifference)
{
  for (const Set& set : AllSets())
  {
    ExpectGradients<std::uint8_t>(set, 1);
    ExpectGradients<std::uint16_t>(set, 2);
    ExpectGradients<float>(set, 3);
  }
}

// All places where the slope changes its sign.
TEST(NativeKernel, TurningPoints)
{
  for (const Set& set : AllSets())
  {
    std::mt19937 random(7);
    int turned = 0;
    int twice = 0;
    for (int round = 0; round < 20000; ++round)
    {
      Lane8 c[4];
      for (Lane8& coefficient : c)
      {
        Fill(random, coefficient, -1, 1);
      }
      Lane8 u{};
      Lane8 behind{};
      set.Functions.TurningPoints(c, u, behind);
      for (int l = 0; l < 8; ++l)
      {
        const auto slope = [&](double at)
        {
          return static_cast<double>(c[1][l]) +
            at * (2 * static_cast<double>(c[2][l]) + 3 * at * static_cast<double>(c[3][l]));
        };
        ASSERT_TRUE(u[l] > 0 && u[l] <= behind[l] && behind[l] <= 1)
          << set.Name << ": " << u[l] << ", " << behind[l];
        // As exact as floats can tell the slope from 0.
        const auto expectZero = [&](double at, double low, double high)
        {
          const double before = slope(low);
          for (int i = 0; i < 50; ++i)
          {
            const double middle = 0.5 * (low + high);
            ((slope(middle) > 0) == (before > 0) ? low : high) = middle;
          }
          const double bend =
            std::abs(2 * static_cast<double>(c[2][l]) + 6 * low * static_cast<double>(c[3][l]));
          EXPECT_NEAR(at, low, 1e-6 + 2e-6 / std::max(bend, 1e-6)) << set.Name;
        };
        if ((slope(0) > 0) == (slope(1) > 0))
        {
          const double steepest =
            -static_cast<double>(c[2][l]) / (3 * static_cast<double>(c[3][l]));
          const bool inside = steepest > 0 && steepest < 1 &&
            (slope(std::clamp(steepest, 0.0, 1.0)) > 0) != (slope(0) > 0);
          // Rounding decides where the extreme is next to 0.
          if (std::abs(slope(steepest)) > 1e-5)
          {
            twice += inside ? 1 : 0;
            if (inside)
            {
              expectZero(u[l], 0, steepest);
              expectZero(behind[l], steepest, 1);
            }
            else
            {
              ASSERT_EQ(u[l], 1) << set.Name;
            }
          }
          continue;
        }
        ++turned;
        expectZero(u[l], 0, 1);
        ASSERT_EQ(behind[l], 1) << set.Name;
      }
    }
    EXPECT_GT(turned, 50000);
    EXPECT_GT(twice, 500);
  }
}

} // namespace teravox
