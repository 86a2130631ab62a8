// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BlockSplit.h"

#include "ViewGeometry.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <tuple>

namespace teravox
{

namespace
{
std::int64_t Product(const Int3& n)
{
  return n[0] * n[1] * n[2];
}

std::size_t IndexOf(const Int3& grid, std::int64_t x, std::int64_t y, std::int64_t z)
{
  return static_cast<std::size_t>(x + grid[0] * (y + grid[1] * z));
}
} // namespace

Result<BlockView> BlockView::Of(const ViewInput& input)
{
  const Matrix4 clipFromVoxel = MultiplyMatrices(input.ClipFromView,
    MultiplyMatrices(
      input.ViewFromWorld, MultiplyMatrices(input.WorldFromDataset, input.DatasetFromVoxel)));
  const Result<Matrix4> voxelFromClip = InvertMatrix(clipFromVoxel);
  if (!voxelFromClip)
  {
    return voxelFromClip.GetStatus();
  }
  // Where the rays come from is infinitely far along the depth of clip space.
  const Matrix4& m = voxelFromClip.Value();
  const Matrix4& p = input.ClipFromView;
  BlockView view;
  view.Parallel = p[12] == 0 && p[13] == 0 && p[14] == 0;
  for (std::size_t a = 0; a < 3; ++a)
  {
    view.Direction[a] = m[4 * a + 2];
    view.Eye[a] = view.Parallel ? 0.0 : m[4 * a + 2] / m[14];
  }
  return view;
}

// Splits boxes of bricks until each is one block.
class BlockSplit::Builder
{
public:
  Builder(const PyramidLayout& layout, int level, const std::vector<double>& weights)
    : Layout(layout)
    , Level(level)
    , Grid(layout.Bricks(level))
    , Weights(weights)
  {
  }

  // Blocks [first, first + count) from these bricks. Returns a node, or -1 - block.
  int Split(BlockSplit& split, const VoxelBox& bricks, int first, int count) const
  {
    if (count == 1 || bricks.Count() <= 1)
    {
      const VoxelBox voxels = this->VoxelsOf(bricks);
      split.Blocks[static_cast<std::size_t>(first)] = voxels;
      split.Weights[static_cast<std::size_t>(first)] = this->WeightOf(bricks, this->Weights);
      return -1 - first;
    }
    const Choice choice = this->Choose(bricks, count);
    VoxelBox below = bricks;
    VoxelBox above = bricks;
    below.High[choice.Axis] = above.Low[choice.Axis] = choice.Plane;
    const auto at = split.Nodes.size();
    split.Nodes.emplace_back();
    Node node;
    node.Axis = static_cast<int>(choice.Axis);
    node.Plane = static_cast<double>(
      choice.Plane * this->Layout.BrickSize() * this->Layout.Factor(this->Level)[choice.Axis]);
    node.Below = this->Split(split, below, first, choice.Below);
    node.Above = this->Split(split, above, first + choice.Below, count - choice.Below);
    split.Nodes[at] = node;
    return static_cast<int>(at);
  }

private:
  struct Choice
  {
    std::size_t Axis = 0;
    std::int64_t Plane = 0;
    int Below = 0; ///< blocks
  };

  VoxelBox VoxelsOf(const VoxelBox& bricks) const
  {
    VoxelBox voxels;
    for (std::size_t a = 0; a < 3; ++a)
    {
      const std::int64_t edge = this->Layout.BrickSize() * this->Layout.Factor(this->Level)[a];
      voxels.Low[a] = bricks.Low[a] * edge;
      voxels.High[a] = std::min(bricks.High[a] * edge, this->Layout.Dimensions(0)[a]);
    }
    return voxels;
  }

  double WeightOf(const VoxelBox& bricks, const std::vector<double>& weights) const
  {
    if (weights.empty())
    {
      // Of the largest volumes more than 64 bits hold.
      const Int3 n = this->VoxelsOf(bricks).Size();
      return static_cast<double>(n[0]) * static_cast<double>(n[1]) * static_cast<double>(n[2]);
    }
    double sum = 0;
    for (std::int64_t z = bricks.Low[2]; z < bricks.High[2]; ++z)
    {
      for (std::int64_t y = bricks.Low[1]; y < bricks.High[1]; ++y)
      {
        for (std::int64_t x = bricks.Low[0]; x < bricks.High[0]; ++x)
        {
          sum += weights[IndexOf(this->Grid, x, y, z)];
        }
      }
    }
    return sum;
  }

  // The plane and numbers of blocks on either side with the least weight of the heavier blocks;
  // among equals the one that divides the blocks evenly and cuts the longest edge.
  Choice Choose(const VoxelBox& bricks, int count) const
  {
    static const std::vector<double> voxels;
    const bool weighed = this->WeightOf(bricks, this->Weights) > 0;
    const std::vector<double>& weights = weighed ? this->Weights : voxels;
    const double whole = this->WeightOf(bricks, weights);
    const Int3 extent = this->VoxelsOf(bricks).Size();
    const std::int64_t longest = std::max({ extent[0], extent[1], extent[2] });
    Choice best;
    std::tuple<double, int> least{ std::numeric_limits<double>::infinity(), 0 };
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      const double flat =
        static_cast<double>(longest) / static_cast<double>(std::max<std::int64_t>(extent[axis], 1));
      VoxelBox slab = bricks;
      double below = 0;
      for (std::int64_t plane = bricks.Low[axis] + 1; plane < bricks.High[axis]; ++plane)
      {
        slab.Low[axis] = plane - 1;
        slab.High[axis] = plane;
        below += this->WeightOf(slab, weights);
        VoxelBox before = bricks;
        before.High[axis] = plane;
        const int blocks = BlocksBelow(before.Count(), bricks.Count(), count, below / whole);
        const double load =
          std::max(below / blocks, std::max(whole - below, 0.0) / (count - blocks));
        // Long thin blocks have more faces: worth some balance.
        const std::tuple<double, int> cost{ load / whole * (1 + 0.02 * (flat - 1)),
          std::abs(2 * blocks - count) };
        if (cost < least)
        {
          least = cost;
          best = { axis, plane, blocks };
        }
      }
    }
    return best;
  }

  // How many of `count` blocks the part below a plane gets: by its share of the weight, at least a
  // quarter, and no more blocks than bricks on either side, or no less where there are too few.
  static int BlocksBelow(
    std::int64_t bricksBelow, std::int64_t bricks, std::int64_t count, double share)
  {
    const auto wanted =
      static_cast<std::int64_t>(std::floor(share * static_cast<double>(count) + 0.5));
    const std::int64_t rest = count - (bricks - bricksBelow);
    const std::int64_t low = std::max<std::int64_t>(std::min(bricksBelow, rest), 1);
    const std::int64_t high = std::min(std::max(bricksBelow, rest), count - 1);
    const std::int64_t quarter = std::clamp(count / 4, low, high);
    const std::int64_t most = std::clamp(count - count / 4, low, high);
    return static_cast<int>(std::clamp(wanted, quarter, most));
  }

  const PyramidLayout& Layout;
  int Level;
  Int3 Grid;
  const std::vector<double>& Weights;
};

int BlockSplit::ChooseLevel(const PyramidLayout& layout, int blocks, int bricksPerBlock)
{
  const double wanted = static_cast<double>(std::max(blocks, 1)) * std::max(bricksPerBlock, 1);
  int level = layout.NumberOfLevels() - 1;
  const auto bricksOf = [&](int l)
  {
    const Int3& n = layout.Bricks(l);
    return static_cast<double>(n[0]) * static_cast<double>(n[1]) * static_cast<double>(n[2]);
  };
  while (level > 0 && bricksOf(level) < wanted)
  {
    --level;
  }
  return blocks <= 1 ? layout.NumberOfLevels() - 1 : level;
}

Result<BlockSplit> BlockSplit::Make(
  const PyramidLayout& layout, int blocks, int level, const std::vector<double>& weights)
{
  if (blocks < 1)
  {
    return Status(StatusCode::InvalidArgument,
      "A volume can't be divided into " + std::to_string(blocks) + " blocks.");
  }
  if (level < 0 || level >= layout.NumberOfLevels())
  {
    return Status(StatusCode::InvalidArgument,
      "There is no level " + std::to_string(level) + " whose bricks could be divided into blocks.");
  }
  const Int3& grid = layout.Bricks(level);
  if (!weights.empty() && weights.size() != static_cast<std::size_t>(Product(grid)))
  {
    return Status(StatusCode::InvalidArgument,
      "Level " + std::to_string(level) + " has " + std::to_string(Product(grid)) +
        " bricks, but there are " + std::to_string(weights.size()) + " weights.");
  }
  if (!std::all_of(
        weights.begin(), weights.end(), [](double w) { return std::isfinite(w) && w >= 0; }))
  {
    return Status(
      StatusCode::InvalidArgument, "The weights of bricks must be finite and not negative.");
  }
  BlockSplit split;
  split.Level_ = level;
  split.Blocks.resize(static_cast<std::size_t>(blocks));
  split.Weights.resize(static_cast<std::size_t>(blocks), 0.0);
  const Builder builder(layout, level, weights);
  split.Root = builder.Split(split, { { 0, 0, 0 }, grid }, 0, blocks);
  return split;
}

std::vector<int> BlockSplit::FrontToBack(const BlockView& view) const
{
  std::vector<int> order;
  std::vector<int> left{ this->Root };
  while (!left.empty())
  {
    const int at = left.back();
    left.pop_back();
    if (at < 0)
    {
      order.push_back(-1 - at);
      continue;
    }
    const Node& node = this->Nodes[static_cast<std::size_t>(at)];
    const auto axis = static_cast<std::size_t>(node.Axis);
    const bool belowFirst = view.Parallel ? view.Direction[axis] >= 0 : view.Eye[axis] < node.Plane;
    left.push_back(belowFirst ? node.Above : node.Below);
    left.push_back(belowFirst ? node.Below : node.Above);
  }
  return order;
}

BrickBox BricksOfBlock(const PyramidLayout& layout, int level, const VoxelBox& block)
{
  BrickBox bricks{ { 0, 0, 0 }, { 0, 0, 0 } };
  if (block.IsEmpty())
  {
    return bricks;
  }
  for (std::size_t a = 0; a < 3; ++a)
  {
    const std::int64_t edge = layout.BrickSize() * layout.Factor(level)[a];
    bricks.Low[a] = std::max<std::int64_t>(block.Low[a], 0) / edge;
    bricks.High[a] =
      std::min(CeilDiv(std::max<std::int64_t>(block.High[a], 0), edge), layout.Bricks(level)[a]);
  }
  return bricks;
}

void SpreadWeight(const PyramidLayout& layout, int gridLevel, const BrickKey& brick, double weight,
  std::vector<double>& weights)
{
  VoxelBox voxels;
  const Int3 index{ brick.X, brick.Y, brick.Z };
  for (std::size_t a = 0; a < 3; ++a)
  {
    const std::int64_t edge = layout.BrickSize() * layout.Factor(brick.Level)[a];
    voxels.Low[a] = index[a] * edge;
    voxels.High[a] = std::min(voxels.Low[a] + edge, layout.Dimensions(0)[a]);
  }
  const BrickBox covered = BricksOfBlock(layout, gridLevel, voxels);
  const Int3& grid = layout.Bricks(gridLevel);
  const double each = weight /
    static_cast<double>((covered.High[0] - covered.Low[0]) * (covered.High[1] - covered.Low[1]) *
      (covered.High[2] - covered.Low[2]));
  for (std::int64_t z = covered.Low[2]; z < covered.High[2]; ++z)
  {
    for (std::int64_t y = covered.Low[1]; y < covered.High[1]; ++y)
    {
      for (std::int64_t x = covered.Low[0]; x < covered.High[0]; ++x)
      {
        weights[IndexOf(grid, x, y, z)] += each;
      }
    }
  }
}

} // namespace teravox
