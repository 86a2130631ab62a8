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
#include <vtkNew.h>

class vtkBlockSplit;

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
  /// Divides anew by what the rays of all ranks needed in the last frame (RecordBricksOn()).
  void Rebalance();

  /// Of bricks, since the ranks were made.
  std::uint64_t BytesRead() const;
  /// The most that a rank weighs over the mean.
  double MostOverMean();

  vtkNew<vtkBlockSplit> Split;

private:
  std::vector<std::shared_ptr<RecordingSource>> Sources;
  std::vector<std::unique_ptr<Stage>> Stages;
};

} // namespace teravox::test
