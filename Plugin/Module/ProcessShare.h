// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "vtkBoundingBox.h"
#include "vtkNew.h"

#include <optional>
#include <vector>

class vtkBlockSplit;
class vtkBrickSource;
class vtkDoubleArray;
class vtkFloatArray;
class vtkImageData;
class vtkMultiProcessController;
class vtkOutOfCoreVolumeMapper;
class vtkPVSession;
class vtkProp3D;
class vtkRenderer;

/// What a process tells of its last frame and of what it has done: counts, MiB, and 1 or 0.
struct ProcessFacts
{
  double InputVoxels = 0;
  double DrawsPyramid = 0;
  double Converged = 0;
  double MissingBricks = 0;
  double FailedBricks = 0;
  double BricksLoaded = 0;
  double Read = 0;
  double GPUMemory = 0;
  double HostMemory = 0;
  double Needed = 0;  ///< MiB of bricks that rays of the last frame needed, while blocks are drawn
  double LeftOut = 0; ///< 1: the last frame is without what others hide
};

/// What of a volume this process draws, where ParaView runs on several that hold pieces of its
/// image. Thread: used by one thread.
class ProcessShare
{
public:
  enum class Part
  {
    All,    ///< of what it has: the pyramid, or its piece of an ordinary image
    Block,  ///< a block of the pyramid, as all processes do
    Nothing ///< another process draws the pyramid
  };

  ProcessShare();
  ~ProcessShare();
  ProcessShare(const ProcessShare&) = delete;
  ProcessShare& operator=(const ProcessShare&) = delete;

  /// Chooses the part, by what all processes say; collective over them and the client of `session`,
  /// which gets their facts.
  /// `source`: of the pyramid that `image` of this process shows a piece of; null: there is none.
  /// `prop` moves the volume. `blendable`: whether a picture can be blended of those of blocks; the
  /// same everywhere. Blocks are divided where it can, where all processes have the image where
  /// the source says, and where neither direction matrix nor prop turn the volume other than by
  /// right angles: ParaView sorts processes by bounds along the world's axes.
  /// Where blocks were drawn completely, nothing left out, they are divided by what rays needed, if
  /// that takes so much off the process that needed most that it is worth to read bricks anew.
  /// `drawn`: what has drawn, of this process. `facts`: likewise. Returns whether something has
  /// changed, the same on all processes of the server.
  bool Choose(vtkBrickSource* source, vtkImageData* image, vtkProp3D* prop, bool blendable,
    vtkOutOfCoreVolumeMapper* drawn, const ProcessFacts& facts, vtkPVSession* session);

  /// MiB of bricks that the rays of a mapper's last frame needed; 0 where it draws no block.
  double NeedOf(vtkOutOfCoreVolumeMapper* drawn) const;

  Part GetPart() const { return this->Which; }
  /// Of a block: its voxels for vtkOutOfCoreVolumeMapper::SetBlockExtent(), perhaps none; its
  /// bounds in the world, a point of the volume where it has no voxels.
  const int* Extent() const { return this->BlockExtent; }
  const double* Bounds() const { return this->BlockBounds; }
  /// What lies in front of this process's block, by the tiles of all processes, one after the other
  /// (vtkBlockSplit::GetOpacityInFront()). Returns false where no block is drawn or there is no
  /// order.
  bool OpacityInFront(
    vtkRenderer* renderer, vtkProp3D* prop, vtkFloatArray* ofAll, vtkFloatArray* inFront);
  /// The axis-aligned box in the world of bounds that `prop` moves; not valid where those aren't.
  static vtkBoundingBox InWorld(const double bounds[6], vtkProp3D* prop);

  /// Whether all processes draw blocks; on a client, those of its server.
  bool IsDivided() const { return this->Divided; }

  ///@{
  /// What the processes told when Choose() was called: each of them, and all together (sums, the
  /// most memory of one, converged if all are). Nothing where this process is alone.
  const std::vector<ProcessFacts>& Facts() const { return this->FactsOfAll; }
  std::optional<ProcessFacts> FactsTogether() const;
  ///@}

private:
  void Balance(vtkOutOfCoreVolumeMapper* drawn, vtkMultiProcessController* controller);
  void Divide(vtkProp3D* prop, int process, int processes, std::vector<double>& boxes);

  vtkNew<vtkBlockSplit> Split;
  vtkNew<vtkDoubleArray> Weights; ///< of Split, kept where the source changes; empty: voxels
  Part Which = Part::All;
  int BlockExtent[6] = { 0, -1, 0, -1, 0, -1 };
  double BlockBounds[6] = { 1, -1, 1, -1, 1, -1 };
  bool Divided = false;
  bool Alone = true;
  std::vector<ProcessFacts> FactsOfAll;
  std::vector<double> Division; ///< what all processes know of it, to see when it changes
};
