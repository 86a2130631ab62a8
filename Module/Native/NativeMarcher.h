// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "GradientTable.h"
#include "ImageLattice.h"
#include "NativeAtlas.h"
#include "NativeScene.h"
#include "PageTable.h"
#include "PassResult.h"
#include "TexelFormat.h"
#include "TransferPlane.h"
#include "TransferTable.h"

#include <cstdint>
#include <vector>

namespace teravox
{

/// State of each ray of a picture, as the native marcher keeps it.
struct NativeView
{
  std::vector<float> Color;           ///< premultiplied colour, transmittance
  std::vector<std::int32_t> Position; ///< brick; level | interval << 8 | status << 16
  std::vector<float> Depth;           ///< opaque depth, 0..1
  std::vector<float> Begin;           ///< where rays begin, 0..1; empty: at the near plane
  std::vector<float> Error;           ///< what the colour may be off; empty if nobody asks
  /// Of a picture that is interpolated between rays (ImageLattice.h): see NativeScene.
  std::vector<std::uint8_t> Lattice;
  std::vector<float> Missed;
  std::vector<float> Reach;
  bool HasLattice = false;    ///< whether the picture is one
  int LatticeStage = 0;       ///< that has to be decided on next; 0: all have been
  bool LatticeChosen = false; ///< whether LatticeStep::Choose was done for it
  /// Of the tiles of NativeMarcher::Refine(): where pixels were chosen to be cast last.
  std::vector<std::uint8_t> LatticeCast;
  LatticeLimits Limits;        ///< of its interpolated pixels
  std::vector<float> FirstHit; ///< depth and level of the hit, NoHit; empty if nobody asks
  std::vector<float> Lengths;  ///< see NativeScene; empty but for averages of several components

  void Resize(
    int width, int height, bool estimate = false, bool firstHit = false, bool lengths = false);
  /// All rays at their begin. `stage`: that a lattice begins with; 0: all pixels are cast. `ray`:
  /// what each holds, see NewRay().
  void Clear(int stage = 0, const LatticeLimits& limits = {},
    const std::array<float, 4>& ray = { 0, 0, 0, 1 });
  /// From now on all rays are cast at once. The picture is the same: pixels that would have been
  /// interpolated are, afterwards.
  void CastAll();
  /// Gives pixels whose rays haven't been cast the colours of those that stand for them: for a
  /// picture that isn't completed.
  void FillDeferred();
  /// Depth becomes that of a slice where opaque geometry isn't in front of it, else NaN.
  void SetSlice(const std::vector<float>& slice, const IntervalParameters& intervals);
  static constexpr std::uint64_t BytesPerPixel = 45; ///< without Error, FirstHit and Lengths
  static constexpr float NoHit = 3.0e38f;

private:
  int Width = 0;
};

/// What a scene points to. All of it must stay where it is until the pass has been drawn.
/// `version` tells tables apart; not 0.
void SetTables(NativeScene& scene, const TransferTable& table, std::uint32_t version);
/// For voxels with several components.
void SetTables(NativeScene& scene, const std::vector<TransferTable>& tables, std::uint32_t version);
/// NativeScene::LabelTables, for what BuildLabelTables() and BuildGradientTable() made.
void SetLabelTables(std::vector<NativeScene::LabelTable>& all,
  const std::vector<TransferTable>& tables, const GradientTable& gradient);
/// Of the opacity of gradients, if there is one.
void SetGradientTable(NativeScene& scene, const GradientTable& table);
/// Of a function over value and gradient, if there is one; `plane` must stay where it is.
void SetPlane(NativeScene& scene, const TransferPlane& plane);
void SetAtlas(
  NativeScene& scene, const NativeAtlas& atlas, const PageTable& table, const TexelFormat& format);
void SetView(NativeScene& scene, NativeView& view, int width, int height);

/// Draws passes on this machine's processors, with all threads that OpenMP gives: what the
/// shaders do, for nodes without a GPU. Needs no OpenGL. The picture depends neither on the number
/// of threads nor on the instruction set. Thread: used by the render thread only.
class NativeMarcher
{
public:
  NativeMarcher();
  /// One pass over tiles (x | y << 16, of TILE_SIZE pixels); afterwards `tiles` are those in which
  /// a ray is still under way. `scene` comes without the stamps, which are kept here. `samples`:
  /// per pixel, those that its ray takes are added there; null: nobody asks. `begins`: per pixel
  /// the depth, 0..1, where its ray begins; empty: at the near plane.
  PassResult DrawPass(NativeScene scene, std::uint32_t slots, std::uint32_t pageBlocks,
    std::vector<std::uint32_t>& tiles, float* samples = nullptr,
    const std::vector<float>& begins = {});

  /// After all rays that were cast have ended: interpolates what may be in the stages to come.
  /// Returns those of the tiles in which rays have to be cast; none if the picture is complete.
  std::vector<std::uint32_t> Refine(
    const NativeScene& scene, NativeView& view, const std::vector<std::uint32_t>& tiles);

private:
  NativeKernel Kernel;
  NativeRefiner Refiner;
  NativeKernel ComponentKernel;
  NativeKernel GradientKernel;
  NativeKernel MaskKernel;
  NativeKernel MaskGradientKernel;
  std::vector<std::uint8_t> UsedSlots;
  std::vector<std::uint8_t> UsedBlocks;
};

} // namespace teravox
