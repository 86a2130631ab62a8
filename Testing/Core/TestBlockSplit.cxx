// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BlockSplit.h"
#include "ViewGeometry.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <gtest/gtest.h>
#include <numeric>
#include <random>
#include <string>

namespace teravox
{

namespace
{
struct RandomSplit
{
  PyramidLayout Layout;
  int Blocks = 1;
  int Level = 0;
  std::vector<double> Weights;
  std::string What;
};

RandomSplit MakeRandom(std::mt19937& random)
{
  const auto whole = [&](int low, int high)
  { return std::uniform_int_distribution<int>(low, high)(random); };
  RandomSplit r;
  const Int3 dims{ whole(1, 300), whole(1, 300), whole(1, 300) };
  const Double3 spacing{ 1.0 + whole(0, 3), 1.0 + whole(0, 3), 1.0 + whole(0, 3) };
  r.Layout = PyramidLayout::MakeDefault(dims, spacing, whole(2, 40)).Value();
  r.Blocks = whole(1, 4) < 4 ? whole(1, 17) : whole(18, 300);
  r.Level = whole(0, 3) == 0 ? whole(0, r.Layout.NumberOfLevels() - 1)
                             : BlockSplit::ChooseLevel(r.Layout, r.Blocks, whole(1, 12));
  const Int3& n = r.Layout.Bricks(r.Level);
  const int kind = whole(0, 3);
  if (kind > 0)
  {
    r.Weights.resize(static_cast<std::size_t>(n[0] * n[1] * n[2]));
    for (double& w : r.Weights)
    {
      w = kind == 1 ? whole(0, 100) : kind == 2 ? (whole(0, 20) == 0 ? 1e6 : 0.0) : 0.0;
    }
  }
  r.What = std::to_string(dims[0]) + " x " + std::to_string(dims[1]) + " x " +
    std::to_string(dims[2]) + ", " + std::to_string(r.Blocks) + " blocks of level " +
    std::to_string(r.Level) + ", weights of kind " + std::to_string(kind);
  return r;
}

BlockSplit Split(const RandomSplit& r)
{
  auto split = BlockSplit::Make(r.Layout, r.Blocks, r.Level, r.Weights);
  EXPECT_TRUE(split.Ok()) << r.What << ": " << split.GetStatus().Message();
  return split.Value();
}

bool Overlap(const VoxelBox& a, const VoxelBox& b)
{
  bool met = !a.IsEmpty() && !b.IsEmpty();
  for (std::size_t i = 0; i < 3; ++i)
  {
    met = met && std::max(a.Low[i], b.Low[i]) < std::min(a.High[i], b.High[i]);
  }
  return met;
}

// Where a ray is inside a box; empty if first >= last.
std::array<double, 2> Interval(const VoxelBox& box, const Double3& from, const Double3& along)
{
  double first = 0;
  double last = 1e9;
  for (std::size_t a = 0; a < 3; ++a)
  {
    const double low = (static_cast<double>(box.Low[a]) - from[a]) / along[a];
    const double high = (static_cast<double>(box.High[a]) - from[a]) / along[a];
    first = std::max(first, std::min(low, high));
    last = std::min(last, std::max(low, high));
  }
  return { first, last };
}
} // namespace

TEST(BlockSplit, CoversTheVolumeWithoutOverlap)
{
  std::mt19937 random(20);
  for (int i = 0; i < 400; ++i)
  {
    const RandomSplit r = MakeRandom(random);
    SCOPED_TRACE(r.What);
    const BlockSplit split = Split(r);
    ASSERT_EQ(split.NumberOfBlocks(), r.Blocks);
    const Int3& dims = r.Layout.Dimensions(0);
    const Int3& n = r.Layout.Bricks(r.Level);
    std::int64_t voxels = 0;
    int empty = 0;
    for (int b = 0; b < r.Blocks; ++b)
    {
      const VoxelBox& box = split.Block(b);
      voxels += box.Count();
      empty += box.IsEmpty() ? 1 : 0;
      for (std::size_t a = 0; a < 3 && !box.IsEmpty(); ++a)
      {
        const std::int64_t edge = r.Layout.BrickSize() * r.Layout.Factor(r.Level)[a];
        EXPECT_GE(box.Low[a], 0);
        EXPECT_EQ(box.Low[a] % edge, 0);
        EXPECT_TRUE(box.High[a] % edge == 0 || box.High[a] == dims[a]);
        EXPECT_LE(box.High[a], dims[a]);
      }
      for (int c = 0; c < b; ++c)
      {
        EXPECT_FALSE(Overlap(box, split.Block(c))) << b << " and " << c;
      }
    }
    EXPECT_EQ(voxels, dims[0] * dims[1] * dims[2]);
    EXPECT_EQ(empty, std::max<std::int64_t>(r.Blocks - n[0] * n[1] * n[2], 0));
  }
}

TEST(BlockSplit, WeightsAreThoseOfTheBlocksBricks)
{
  std::mt19937 random(21);
  for (int i = 0; i < 100; ++i)
  {
    const RandomSplit r = MakeRandom(random);
    SCOPED_TRACE(r.What);
    const BlockSplit split = Split(r);
    double sum = 0;
    for (int b = 0; b < r.Blocks; ++b)
    {
      sum += split.Weight(b);
      if (r.Weights.empty())
      {
        EXPECT_EQ(split.Weight(b), static_cast<double>(split.Block(b).Count()));
      }
    }
    const Int3& dims = r.Layout.Dimensions(0);
    const double whole = r.Weights.empty()
      ? static_cast<double>(dims[0] * dims[1] * dims[2])
      : std::accumulate(r.Weights.begin(), r.Weights.end(), 0.0);
    EXPECT_EQ(sum, whole);
    // Once more, the same.
    const BlockSplit again = Split(r);
    for (int b = 0; b < r.Blocks; ++b)
    {
      EXPECT_EQ(split.Block(b), again.Block(b));
    }
  }
}

TEST(BlockSplit, BalancesWhatIsDivisible)
{
  // 16^3 bricks: powers of two divide them exactly, other numbers to a few bricks' layers.
  const PyramidLayout layout =
    PyramidLayout::MakeDefault({ 512, 512, 512 }, { 1, 1, 1 }, 32).Value();
  for (const int blocks : { 1, 2, 3, 4, 5, 7, 8, 12, 16, 27, 64, 100, 512 })
  {
    const BlockSplit split = BlockSplit::Make(layout, blocks, 0).Value();
    double heaviest = 0;
    for (int b = 0; b < blocks; ++b)
    {
      heaviest = std::max(heaviest, split.Weight(b));
    }
    const double mean = 512.0 * 512 * 512 / blocks;
    const bool power = (blocks & (blocks - 1)) == 0;
    EXPECT_LE(heaviest / mean, power ? 1.0 : 1.3) << blocks << " blocks";
  }
  // A volume that weighs something in one octant only: that is what is divided.
  std::vector<double> weights(16 * 16 * 16, 0.0);
  for (std::size_t i = 0; i < weights.size(); ++i)
  {
    weights[i] = i % 16 < 8 && i / 16 % 16 < 8 && i / 256 < 8 ? 1.0 : 0.0;
  }
  const BlockSplit split = BlockSplit::Make(layout, 8, 0, weights).Value();
  for (int b = 0; b < 8; ++b)
  {
    EXPECT_EQ(split.Weight(b), 64.0) << b;
  }
}

TEST(BlockSplit, OrderAgreesWithRays)
{
  std::mt19937 random(22);
  std::uniform_real_distribution<double> share(-0.6, 1.6);
  std::normal_distribution<double> normal;
  int compared = 0;
  for (int i = 0; i < 300; ++i)
  {
    const RandomSplit r = MakeRandom(random);
    SCOPED_TRACE(r.What);
    const BlockSplit split = Split(r);
    BlockView view;
    view.Parallel = i % 3 == 0;
    for (std::size_t a = 0; a < 3; ++a)
    {
      view.Eye[a] = share(random) * static_cast<double>(r.Layout.Dimensions(0)[a]);
      view.Direction[a] = normal(random);
    }
    const std::vector<int> order = split.FrontToBack(view);
    std::vector<int> sorted = order;
    std::sort(sorted.begin(), sorted.end());
    std::vector<int> filled;
    for (int b = 0; b < r.Blocks; ++b)
    {
      if (!split.Block(b).IsEmpty())
      {
        filled.push_back(b);
      }
    }
    ASSERT_EQ(sorted, filled);
    for (int k = 0; k < 50; ++k)
    {
      Double3 from = view.Eye;
      Double3 along = view.Direction;
      for (std::size_t a = 0; a < 3; ++a)
      {
        const double target = share(random) * static_cast<double>(r.Layout.Dimensions(0)[a]);
        if (view.Parallel)
        {
          from[a] = target - 1000 * along[a];
        }
        else
        {
          along[a] = target - from[a];
        }
      }
      double reached = 0;
      for (const int b : order)
      {
        const auto [first, last] = Interval(split.Block(b), from, along);
        if (first < last)
        {
          EXPECT_GE(first, reached * (1 - 1e-12)) << "block " << b << ", ray " << k;
          reached = last;
          ++compared;
        }
      }
    }
  }
  EXPECT_GT(compared, 10000);
}

TEST(BlockSplit, ViewsOfAllProjections)
{
  // A camera at (3, 4, 20) looks along -z at voxels of edge 2; a sheared and shifted one has its
  // eye at the same place.
  ViewInput input;
  input.ViewFromWorld = { 1, 0, 0, -3, 0, 1, 0, -4, 0, 0, 1, -20, 0, 0, 0, 1 };
  input.DatasetFromVoxel = { 2, 0, 0, 1, 0, 2, 0, 1, 0, 0, 2, 1, 0, 0, 0, 1 };
  input.WorldFromDataset = { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 };
  input.ClipFromView = { 1.5, 0, 0.25, 0, 0, 2, -0.5, 0, 0, 0, -1.2, -2.2, 0, 0, -1, 0 };
  const BlockView eye = BlockView::Of(input).Value();
  EXPECT_FALSE(eye.Parallel);
  EXPECT_NEAR(eye.Eye[0], 1, 1e-12);
  EXPECT_NEAR(eye.Eye[1], 1.5, 1e-12);
  EXPECT_NEAR(eye.Eye[2], 9.5, 1e-12);
  // Parallel, sheared: rays run along (0.1, 0, -1) in view space.
  input.ClipFromView = { 0.5, 0, 0.05, 0, 0, 0.5, 0, 0, 0, 0, -0.02, -1, 0, 0, 0, 1 };
  const BlockView along = BlockView::Of(input).Value();
  EXPECT_TRUE(along.Parallel);
  EXPECT_NEAR(along.Direction[0] / along.Direction[2], -0.1, 1e-12);
  EXPECT_LT(along.Direction[2], 0);
  EXPECT_EQ(along.Direction[1], 0);
  input.ClipFromView = {};
  EXPECT_EQ(BlockView::Of(input).GetStatus().Code(), StatusCode::InvalidArgument);
}

// More voxels than 64 bits count.
TEST(BlockSplit, LargestVolume)
{
  constexpr std::int64_t edge = (std::int64_t{ 1 } << 31) - 1;
  const PyramidLayout layout =
    PyramidLayout::MakeDefault({ edge, edge, edge }, { 1, 1, 1 }, 64).Value();
  const BlockSplit split = BlockSplit::Make(layout, 5, BlockSplit::ChooseLevel(layout, 5)).Value();
  const double whole = std::pow(static_cast<double>(edge), 3);
  double sum = 0;
  for (int b = 0; b < 5; ++b)
  {
    sum += split.Weight(b);
    EXPECT_GT(split.Weight(b), 0.15 * whole);
    EXPECT_LT(split.Weight(b), 0.26 * whole);
  }
  EXPECT_NEAR(sum / whole, 1, 1e-12);
}

TEST(BlockSplit, GridIsTheCoarsestWithEnoughBricks)
{
  const PyramidLayout layout =
    PyramidLayout::MakeDefault({ 1024, 1024, 1024 }, { 1, 1, 1 }, 64).Value();
  EXPECT_EQ(BlockSplit::ChooseLevel(layout, 1), 4);
  EXPECT_EQ(BlockSplit::ChooseLevel(layout, 2), 2); // 64 bricks; level 3 has 8
  EXPECT_EQ(BlockSplit::ChooseLevel(layout, 8), 2);
  EXPECT_EQ(BlockSplit::ChooseLevel(layout, 9), 1);
  EXPECT_EQ(BlockSplit::ChooseLevel(layout, 8, 1), 3);
  EXPECT_EQ(BlockSplit::ChooseLevel(layout, 100000), 0);
}

TEST(BlockSplit, WeightsOfCoarserAndFinerBricks)
{
  const PyramidLayout layout = PyramidLayout::MakeDefault({ 64, 64, 48 }, { 1, 1, 1 }, 8).Value();
  std::vector<double> weights(4 * 4 * 3, 0.0); // level 1
  BrickKey coarse;
  coarse.Level = 2; // 2 x 2 x 2 bricks, of which the upper one covers half as much along z
  coarse.Z = 1;
  SpreadWeight(layout, 1, coarse, 8, weights);
  EXPECT_EQ(weights[0 + 4 * (0 + 4 * 2)], 2);
  EXPECT_EQ(weights[1 + 4 * (1 + 4 * 2)], 2);
  EXPECT_EQ(std::accumulate(weights.begin(), weights.end(), 0.0), 8);
  BrickKey fine;
  fine.X = 7;
  fine.Y = 2;
  SpreadWeight(layout, 1, fine, 5, weights);
  EXPECT_EQ(weights[3 + 4 * 1], 5);
  EXPECT_EQ(BricksOfBlock(layout, 1, { { 15, 16, 47 }, { 17, 33, 48 } }),
    (BrickBox{ { 0, 1, 2 }, { 2, 3, 3 } }));
  EXPECT_EQ(BricksOfBlock(layout, 0, {}), (BrickBox{ { 0, 0, 0 }, { 0, 0, 0 } }));
}

TEST(BlockSplit, RefusesWhatMakesNoBlocks)
{
  const PyramidLayout layout = PyramidLayout::MakeDefault({ 64, 64, 64 }, { 1, 1, 1 }, 16).Value();
  EXPECT_FALSE(BlockSplit::Make(layout, 0, 0).Ok());
  EXPECT_FALSE(BlockSplit::Make(layout, 2, 9).Ok());
  EXPECT_FALSE(BlockSplit::Make(layout, 2, -1).Ok());
  EXPECT_FALSE(BlockSplit::Make(layout, 2, 0, std::vector<double>(63, 1.0)).Ok());
  std::vector<double> weights(64, 1.0);
  weights[5] = -1;
  EXPECT_FALSE(BlockSplit::Make(layout, 2, 0, weights).Ok());
  weights[5] = std::nan("");
  EXPECT_FALSE(BlockSplit::Make(layout, 2, 0, weights).Ok());
  weights[5] = 0;
  EXPECT_TRUE(BlockSplit::Make(layout, 2, 0, weights).Ok());
}

} // namespace teravox
