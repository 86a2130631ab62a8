// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickGeometry.h"
#include "RecordingSource.h"
#include "Scene.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>
#include <vtkFloatArray.h>
#include <vtkNew.h>

class vtkBlockSplit;
class vtkDoubleArray;

namespace teravox::test
{

/// Blends float pictures (premultiplied RGBA) of blocks; the first one lies in front.
std::vector<float> BlendFrontToBack(const std::vector<const std::vector<float>*>& pictures);

/// Ranks of a sort-last rendering in one process: each has a window, a mapper, a page table, an
/// atlas, caches and a record of its reads of its own, and draws a block of the same volume.
class Ranks
{
public:
  /// Makes the source that a rank reads from, of its number; all of the same volume.
  using SourceOfRank = std::function<std::shared_ptr<BrickSource>(int rank)>;

  Ranks(int count, int width, int height, const SourceOfRank& source,
    const std::function<void(Stage&)>& set);
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;
  Ranks(Ranks&&) = delete;
  Ranks& operator=(Ranks&&) = delete;
  ~Ranks();

  int Count() const { return static_cast<int>(this->Stages.size()); }
  Stage& At(int rank) { return *this->Stages[static_cast<std::size_t>(rank)]; }
  const RecordingSource& ReadsOf(int rank) const
  {
    return *this->Sources[static_cast<std::size_t>(rank)];
  }
  VoxelBox BlockOf(int rank);

  /// Gives each rank its block, draws all, and blends what they have drawn.
  std::vector<float> Draw();
  /// The same, but what the ranks suspect to be hidden by others, by the pictures that they drew
  /// last, is drawn only if those of this view don't confirm it. `seen`: the picture without it.
  std::vector<float> DrawKnowingOthers(std::vector<float>* seen = nullptr);
  /// BytesRead() when that had been drawn.
  std::uint64_t BytesReadForSeen() const { return this->SeenBytes; }
  /// Whether all ranks have converged.
  bool AreConverged();
  /// Least opacities of the tiles of what each rank has drawn, one rank after the other.
  void GatherTiles(vtkFloatArray* ofAll);
  /// Of those what lies in front of a rank's block.
  void InFrontOf(int rank, vtkFloatArray* ofAll, vtkFloatArray* inFront);

  /// Divides anew by what the rays of all ranks needed in the last frame (RecordBricksOn()).
  void Rebalance();
  /// The same where it is worth it; returns whether blocks have moved.
  bool RebalanceIfWorthIt();

  /// Of bricks, since the ranks were made.
  std::uint64_t BytesRead() const;
  /// The most that a rank weighs over the mean.
  double MostOverMean();

  vtkNew<vtkBlockSplit> Split;

private:
  void AddWeights(vtkDoubleArray* weights);

  vtkNew<vtkFloatArray> LastTiles; ///< empty: nothing was drawn yet
  std::uint64_t SeenBytes = 0;
  std::vector<std::shared_ptr<RecordingSource>> Sources;
  std::vector<std::unique_ptr<Stage>> Stages;
};

} // namespace teravox::test
