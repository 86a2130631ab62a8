// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkBlockSplit
 * @brief divides a volume into blocks, one for each rank of a sort-last rendering
 *
 * A k-d tree whose planes lie on faces of bricks: of one level, the grid, and of all finer ones.
 * Blocks cover the volume and don't overlap. The same source, numbers and weights give the same
 * blocks on every rank. Each rank draws its own:
 *
 *     split->SetBrickSource(source);
 *     split->SetNumberOfBlocks(ranks);
 *     split->GetBlockExtent(rank, extent);
 *     mapper->BlockOn();
 *     mapper->SetBlockExtent(extent);
 *
 * and the accumulators (vtkOutOfCoreVolumeMapper::GetColorAccumulator()) are blended in the order
 * of GetFrontToBack(). docs/distributed.md tells more.
 *
 * Thread: used by one thread at a time.
 */
#pragma once

#include "vtkObject.h"
#include "vtkRenderingOutOfCoreModule.h" // for the export macro

#include <memory> // for std::unique_ptr
#include <vector> // for bricks

class vtkBrickSource;
class vtkDoubleArray;
class vtkFloatArray;
class vtkIdList;
class vtkProp3D;
class vtkRenderer;

namespace teravox
{
struct BrickKey;
}

class VTKRENDERINGOUTOFCORE_EXPORT vtkBlockSplit : public vtkObject
{
public:
  static vtkBlockSplit* New();
  vtkTypeMacro(vtkBlockSplit, vtkObject);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * The volume. Default: none, an error when blocks are asked for.
   */
  void SetBrickSource(vtkBrickSource* source);
  vtkBrickSource* GetBrickSource() const;
  ///@}

  ///@{
  /**
   * Number of blocks, at least 1. With fewer bricks in the finest level some are empty.
   * Default: 1.
   */
  vtkSetClampMacro(NumberOfBlocks, int, 1, 1 << 24);
  vtkGetMacro(NumberOfBlocks, int);
  ///@}

  ///@{
  /**
   * The grid is the coarsest level with at least this many bricks per block, or level 0: more
   * balance better, with fewer less of coarser levels is needed by several ranks. Default: 8.
   */
  vtkSetClampMacro(BricksPerBlock, int, 1, 1 << 20);
  vtkGetMacro(BricksPerBlock, int);
  ///@}

  /** The level whose bricks are the grid, and its bricks; -1 and 0 without a source. */
  int GetGridLevel();
  vtkIdType GetNumberOfGridBricks();

  /**
   * What the bricks of the grid cost, x fastest: blocks are made that weigh about the same. Null or
   * all 0: their voxels (the default, and once more where source, NumberOfBlocks or BricksPerBlock
   * change). See vtkOutOfCoreVolumeMapper::AddBrickWeights(). The weights are copied. Returns
   * false, after an error, if their number isn't GetNumberOfGridBricks() or one is negative or not
   * finite.
   */
  bool SetWeights(vtkDoubleArray* weights);

  ///@{
  /**
   * A block, 0 ... NumberOfBlocks - 1: its voxels of level 0, as
   * vtkOutOfCoreVolumeMapper::SetBlockExtent() takes them, (0,-1, 0,-1, 0,-1) if it is empty; its
   * bounds in the volume's space, without the prop's matrix (invalid bounds, 1...-1, if it is
   * empty); what its bricks weigh, in voxels without weights. Outside of that range as an empty
   * block.
   */
  void GetBlockExtent(int block, int extent[6]);
  void GetBlockBounds(int block, double bounds[6]);
  double GetBlockWeight(int block);
  ///@}

  /**
   * The blocks that aren't empty, front to back as the renderer's camera sees them: along no ray
   * does one lie before another that is listed ahead of it. `volume` places them; null: nothing
   * moves them. Returns false, after an error, if a matrix is singular or there is no source.
   */
  bool GetFrontToBack(vtkRenderer* renderer, vtkProp3D* volume, vtkIdList* order);

  /**
   * Divides anew by these weights (SetWeights()) if the block that weighs most by them would weigh
   * at least `worth` times less than it does as blocks are now: what a rank gets anew it has to
   * read. Returns whether blocks have moved; false, after an error, for weights that SetWeights()
   * refuses. The same everywhere for the same weights, so that each rank may call it.
   */
  bool Rebalance(vtkDoubleArray* weights, double worth = 1.25);

  /**
   * What lies in front of a block: of each tile the opacity of all blocks that `order` (see
   * GetFrontToBack()) lists ahead of it. `ofAll`: the tiles of each block, one block after the
   * other, as vtkOutOfCoreVolumeMapper::GetOpacityTiles() gives them; 0 of blocks that have none.
   * Returns false, after an error, if that isn't as many for each block.
   */
  bool GetOpacityInFront(vtkFloatArray* ofAll, vtkIdList* order, int block, vtkFloatArray* inFront);

#ifndef __VTK_WRAP__
  /**
   * Adds what bricks weigh to one weight per brick of the grid. Those that the volume doesn't have,
   * because they are of another one, are left out.
   */
  void AddWeights(const std::vector<teravox::BrickKey>& bricks, vtkDoubleArray* weights);
#endif

protected:
  vtkBlockSplit();
  ~vtkBlockSplit() override;

  int NumberOfBlocks = 1;
  int BricksPerBlock = 8;

private:
  vtkBlockSplit(const vtkBlockSplit&) = delete;
  void operator=(const vtkBlockSplit&) = delete;

  class vtkInternals;
  std::unique_ptr<vtkInternals> Internals;
};
