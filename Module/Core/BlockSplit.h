// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickGeometry.h"
#include "PageTable.h"
#include "PyramidLayout.h"
#include "Status.h"
#include "Types.h"

#include <vector>

namespace teravox
{

struct ViewInput;

/// Where a picture is taken from, in corner coordinates of level 0: the eye, or for a parallel
/// projection the direction of the rays.
struct BlockView
{
  bool Parallel = false;
  Double3 Eye{ 0, 0, 0 };
  Double3 Direction{ 0, 0, 1 };

  /// Of any projection, off-axis and sheared ones included.
  /// Errors: InvalidArgument (singular matrices).
  static Result<BlockView> Of(const ViewInput& input);
};

/// Divides a volume into blocks for sort-last rendering: one for each rank, which draws what lies
/// in it. The blocks are the leaves of a k-d tree whose planes lie on faces of the bricks of one
/// level, the *grid*; those are faces of bricks in all finer levels, too, so that rays are cut
/// there anyway and a brick of those belongs to one block. Blocks cover the volume and don't
/// overlap. The same layout, number and weights give the same blocks, on every rank. Thread:
/// immutable.
class BlockSplit
{
public:
  /// As the grid is chosen: the coarsest level with at least `bricksPerBlock` bricks per block, or
  /// level 0. More of them balance better; fewer leave fewer bricks of coarser levels that several
  /// blocks share.
  static constexpr int DefaultBricksPerBlock = 8;
  static int ChooseLevel(
    const PyramidLayout& layout, int blocks, int bricksPerBlock = DefaultBricksPerBlock);

  /// Splits the bricks of `level` into `blocks` blocks of about the same weight. `weights`: what
  /// each brick of that level costs, x fastest, finite and not negative; empty: its voxels of level
  /// 0. Where all of a part weighs nothing, voxels count. With fewer bricks than blocks some are
  /// empty.
  /// Errors: InvalidArgument (no block, no such level, weights of another number or value).
  static Result<BlockSplit> Make(
    const PyramidLayout& layout, int blocks, int level, const std::vector<double>& weights = {});

  int Level() const { return this->Level_; }
  int NumberOfBlocks() const { return static_cast<int>(this->Blocks.size()); }
  /// Voxels of level 0.
  const VoxelBox& Block(int block) const { return this->Blocks[static_cast<std::size_t>(block)]; }
  /// What the weights of a block's bricks add up to.
  double Weight(int block) const { return this->Weights[static_cast<std::size_t>(block)]; }

  /// All blocks that aren't empty, front to back: along no ray of the view does a block lie before
  /// one that is listed ahead of it.
  std::vector<int> FrontToBack(const BlockView& view) const;

private:
  struct Node
  {
    int Axis = 0;
    double Plane = 0; ///< corner coordinate of level 0
    int Below = 0;    ///< a node, or -1 - block
    int Above = 0;
  };
  class Builder;

  int Level_ = 0;
  std::vector<VoxelBox> Blocks;
  std::vector<double> Weights;
  std::vector<Node> Nodes;
  int Root = -1;
};

/// What a brick of any level weighs, spread evenly over the bricks of a grid (`gridLevel`) that it
/// covers: adds to `weights`, one per brick of the grid, x fastest.
void SpreadWeight(const PyramidLayout& layout, int gridLevel, const BrickKey& brick, double weight,
  std::vector<double>& weights);

/// The bricks of a level that have voxels in a block of level-0 voxels.
BrickBox BricksOfBlock(const PyramidLayout& layout, int level, const VoxelBox& block);

} // namespace teravox
