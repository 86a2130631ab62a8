// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TransferPlane.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>

namespace teravox
{
namespace
{
using Node = std::array<float, 4>;

TransferImage RandomImage(int columns, int rows, unsigned seed, double low, double high)
{
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(0, 1);
  TransferImage image;
  image.Columns = columns;
  image.Rows = rows;
  image.Values = { low, high };
  image.LastGradient = 0.25 * (high - low);
  for (int i = 0; i < columns * rows; ++i)
  {
    // Most of it empty, some of it walls.
    const float opacity = unit(random) * 2 - 1.6f;
    image.Nodes.push_back({ unit(random), unit(random), unit(random),
      opacity > 0.38f ? 1.0f : std::max(opacity, 0.0f) });
  }
  return image;
}

// Bilinear, in double.
double OpacityAt(const TransferImage& image, double x, double y)
{
  const int i = std::clamp(static_cast<int>(x), 0, std::max(image.Columns - 2, 0));
  const int j = std::clamp(static_cast<int>(y), 0, std::max(image.Rows - 2, 0));
  const auto at = [&](int a, int b)
  {
    const auto index = static_cast<std::size_t>(
      std::min(b, image.Rows - 1) * image.Columns + std::min(a, image.Columns - 1));
    return static_cast<double>(image.Nodes[index][3]);
  };
  const double u = x - i;
  const double v = y - j;
  return (1 - v) * ((1 - u) * at(i, j) + u * at(i + 1, j)) +
    v * ((1 - u) * at(i, j + 1) + u * at(i + 1, j + 1));
}

TEST(TransferPlane, WithoutAnImageThereIsNone)
{
  EXPECT_TRUE(BuildTransferPlane({}, 1).IsNone());
  EXPECT_EQ(BuildTransferPlane({}, 1).SizeInBytes(), 0u);
}

TEST(TransferPlane, NumbersThatAreNoneAndBeyondOneAreCut)
{
  TransferImage image;
  image.Columns = 2;
  image.Rows = 1;
  image.Values = { 0, 1 };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  image.Nodes = { { nan, -1, 2, nan }, { 0.5f, 0.25f, 0, 7 } };
  const TransferFunction function = MakeImageFunction(image, 1);
  const TransferPlane plane = BuildTransferPlane(function, 100);
  // One row goes on for all magnitudes.
  ASSERT_EQ(plane.Columns, 2);
  ASSERT_EQ(plane.Rows, 2);
  for (const std::size_t row : { 0, 2 })
  {
    EXPECT_EQ(plane.Nodes[row], (Node{ 0, 0, 1, 0 }));
    EXPECT_EQ(plane.Nodes[row + 1], (Node{ 0.5f, 0.25f, 0, 1 }));
  }
}

// What values are skipped by is nowhere less than what is drawn of them, and 0 only where that is.
TEST(TransferPlane, TableOfValuesBoundsAllMagnitudes)
{
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  struct Case
  {
    int Columns;
    int Rows;
    double Low;
    double High;
    bool Integers;
  };
  for (const Case& c : { Case{ 5, 4, 0, 255, true }, { 1, 7, -3, 5, false },
         { 300, 2, 0, 3, false }, { 37, 61, 0, 65535, true }, { 700, 9, 1e6, 1e6 + 3000, true } })
  {
    const TransferImage image = RandomImage(c.Columns, c.Rows, 5, c.Low, c.High);
    const TransferFunction function = MakeImageFunction(image, 0.7);
    const TransferTable table =
      BuildTransferTable(function, ValueRange{ c.Low, c.High }, c.Integers, 1e-3);
    int empty = 0;
    for (int i = 0; i < 20000; ++i)
    {
      const double x = unit(random) * (table.Nodes - 1);
      const auto node = std::min(static_cast<std::size_t>(x), table.Integrals.size() - 2);
      const float least = std::min(table.Integrals[node][2], std::abs(table.Integrals[node][3]));
      const double value = table.Low + x / table.NodesPerUnit;
      const double column = (value - c.Low) / (c.High - c.Low) * (c.Columns - 1);
      const double opacity = OpacityAt(image, column, unit(random) * (c.Rows - 1));
      const double extinction =
        std::min(-std::log1p(-std::min(opacity, 1 - 1e-17)) / 0.7, table.WallExtinction);
      ASSERT_GE(least * (1 + 1e-6) + 1e-9, extinction) << c.Columns << ", " << value;
      if (table.Occupied[node + 1] > node + 1)
      {
        ASSERT_LT(opacity, 1e-12) << c.Columns << ", " << value;
        ++empty;
      }
    }
    EXPECT_TRUE(empty > 0 || c.Columns < 300) << c.Columns;
  }
}

// Each block tells the largest of what lies in it: compared with all nodes one by one.
TEST(TransferPlane, BoundsAreThoseOfTheirBlocks)
{
  for (const auto& [columns, rows] : { std::pair{ 2, 2 }, { 3, 9 }, { 33, 17 }, { 40, 2 } })
  {
    const TransferImage image = RandomImage(columns, rows, 7, 0, 1);
    const TransferPlane plane = BuildTransferPlane(MakeImageFunction(image, 2), 30);
    const auto node = [&](int x, int y) -> const Node&
    { return plane.Nodes[static_cast<std::size_t>(x + y * columns)]; };
    const auto s = [&](int x, int y)
    { return std::min(-std::log1p(-static_cast<double>(node(x, y)[3])) / 2, 30.0); };
    ASSERT_LE(std::max(columns, rows) - 1, 1 << (plane.Levels - 1));
    std::size_t count = 0;
    for (int l = 0; l < plane.Levels; ++l)
    {
      ASSERT_EQ(static_cast<std::size_t>(plane.First[static_cast<std::size_t>(l)]), count);
      count += static_cast<std::size_t>(plane.Width(l)) * static_cast<std::size_t>(plane.Height(l));
      for (int j = 0; j < plane.Height(l); ++j)
      {
        for (int i = 0; i < plane.Width(l); ++i)
        {
          const int right = std::min((i + 2) << l, columns - 1);
          const int up = std::min((j + 2) << l, rows - 1);
          double expected[4] = { 0, 0, 0, 0 };
          const auto raise = [&](int k, double to) { expected[k] = std::max(expected[k], to); };
          for (int y = j << l; y <= up; ++y)
          {
            for (int x = i << l; x <= right; ++x)
            {
              raise(0, s(x, y));
              if (x < right)
              {
                raise(1, std::abs(s(x + 1, y) - s(x, y)));
              }
              if (y < up)
              {
                raise(2, std::abs(s(x, y + 1) - s(x, y)));
              }
              for (std::size_t c = 0; c < 3; ++c)
              {
                raise(3, x < right ? std::abs(node(x + 1, y)[c] - node(x, y)[c]) : 0.0);
                raise(3, y < up ? std::abs(node(x, y + 1)[c] - node(x, y)[c]) : 0.0);
              }
            }
          }
          const Node& block = plane.Bounds[static_cast<std::size_t>(
            plane.First[static_cast<std::size_t>(l)] + i + j * plane.Width(l))];
          for (std::size_t k = 0; k < 4; ++k)
          {
            ASSERT_NEAR(block[k], expected[k], 1e-5)
              << columns << ", " << l << ", " << i << ", " << j << ", " << k;
          }
        }
      }
    }
    EXPECT_EQ(plane.Bounds.size(), count);
  }
}

TEST(TransferPlane, LargeImagesAreSampled)
{
  TransferImage image;
  image.Columns = 2 * MostPlaneNodes - 1;
  image.Rows = 3;
  image.Values = { 0, 1 };
  for (int i = 0; i < image.Columns * image.Rows; ++i)
  {
    const int x = i % image.Columns;
    image.Nodes.push_back({ static_cast<float>(x) / 4096, 0, 0, x % 2 == 0 ? 0.25f : 0.75f });
  }
  const TransferPlane plane = BuildTransferPlane(MakeImageFunction(image, 1), 100);
  ASSERT_EQ(plane.Columns, MostPlaneNodes);
  ASSERT_EQ(plane.Rows, 3);
  // Every second node.
  for (int x = 0; x < plane.Columns; ++x)
  {
    EXPECT_EQ(plane.Nodes[static_cast<std::size_t>(x)],
      (Node{ static_cast<float>(x) / 2048, 0, 0, 0.25f }));
  }
}

TEST(TransferPlane, ParametersLeadFromNodesToColumnsAndRows)
{
  const TransferImage image = RandomImage(11, 6, 9, 100, 300);
  const Matrix4 matrix{ 0, -1, 0, 5, 2, 0, 0, 6, 0, 0, 3, 7, 0, 0, 0, 1 };
  TransferFunction function = MakeImageFunction(image, 4);
  for (const int exponent : { 0, 30 })
  {
    // The table is over values of the source that is drawn.
    const double scale = std::ldexp(1, -exponent);
    TransferTable table;
    table.Low = 120 * scale;
    table.NodesPerUnit = 20 / scale;
    table.LargestExtinction = 12;
    MarchParameters p;
    SetPlaneParameters(p, BuildTransferPlane(function, 12), function, table, matrix, exponent);
    // A node is 1/20, ten columns are 200; five rows are 50.
    EXPECT_FLOAT_EQ(p.Plane[0][0], 0.05f / 20);
    EXPECT_FLOAT_EQ(p.Plane[0][1], 1);
    EXPECT_EQ(p.Plane[0][2], 10);
    EXPECT_EQ(p.Plane[0][3], 5); // levels: 16 intervals hold ten
    EXPECT_EQ(p.Plane[1][0], 0.25f);
    EXPECT_EQ(p.Plane[1][1], 12);
    // Voxels 2, 1 and 3 apart, in the mean 2.
    EXPECT_FLOAT_EQ(p.Gradient[0], static_cast<float>(std::ldexp(0.1 * 0.5, exponent)));
    EXPECT_FLOAT_EQ(p.Gradient[1], static_cast<float>(std::ldexp(0.1, exponent)));
    EXPECT_FLOAT_EQ(p.Gradient[2], static_cast<float>(std::ldexp(0.1 / 3, exponent)));
    EXPECT_EQ(p.Gradient[3], 5);
  }
}

} // namespace
} // namespace teravox
