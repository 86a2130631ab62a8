// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "NativeAtlas.h"
#include "NativeScene.h"
#include "PageTable.h"
#include "PassResult.h"
#include "TexelFormat.h"
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
  std::vector<float> Error;           ///< what the colour may be off; empty if nobody asks

  void Resize(int width, int height, bool estimate = false);
  /// All rays at their begin.
  void Clear();
  /// Depth becomes that of a slice where opaque geometry isn't in front of it, else NaN.
  void SetSlice(const std::vector<float>& slice, const IntervalParameters& intervals);
  static constexpr std::uint64_t BytesPerPixel = 36; ///< without Error
};

/// What a scene points to. All of it must stay where it is until the pass has been drawn.
/// `version` tells tables apart; not 0.
void SetTables(NativeScene& scene, const TransferTable& table, std::uint32_t version);
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
  /// a ray is still under way. `scene` comes without the stamps, which are kept here.
  PassResult DrawPass(NativeScene scene, std::uint32_t slots, std::uint32_t pageBlocks,
    std::vector<std::uint32_t>& tiles);

private:
  NativeKernel Kernel;
  std::vector<std::uint8_t> UsedSlots;
  std::vector<std::uint8_t> UsedBlocks;
};

} // namespace teravox
