// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "AtlasPlan.h"
#include "BrickFrames.h"
#include "GLObjects.h"
#include "MarchParameters.h"
#include "NativeMarcher.h"
#include "ViewGeometry.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace teravox
{

/// What the picture of a view depends on, beside the data and the opaque depth: where all this is
/// equal, so is the picture, to the bit.
struct PictureKey
{
  MarchParameters Parameters; ///< as a picture begins
  IntervalParameters Intervals;
  std::uint64_t FunctionVersion = 0;
  unsigned Variant = 0;                     ///< ShaderVariant::Key()
  std::vector<PlaneAlongRays> Planes;       ///< that clip
  std::vector<MarchParameters::Vec> Lights; ///< LightTable
  std::shared_ptr<const std::vector<double>> Slice;
  int LatticeStage = 0; ///< see ImageLattice.h

  bool operator==(const PictureKey& o) const;
};

/// State of one view (renderer, eye): colour and position of each ray, its intervals, the copy of
/// the opaque depth, the feedback of its passes and the tiles that are still under way. Thread:
/// used by the render thread only, with the context current.
class ViewState
{
public:
  /// Allocates for a picture of this size and an atlas of this plan; nothing if nothing changed.
  /// Returns false if the driver has no memory. `peels`: for rays that are drawn in stretches.
  /// `lengths`: for averages of several components.
  bool Resize(GPUMemory& memory, int width, int height, const AtlasPlan& plan, bool estimate,
    bool firstHit, bool peels, bool lengths);
  void Release();

  /// Whether it is for the native marcher.
  bool IsNative() const { return this->Native_; }
  bool HasEstimate() const { return this->Estimate_ && !this->CountsSamples; }
  bool HasFirstHit() const { return this->FirstHit_; }
  bool HasPeels() const { return this->Peels_; }
  bool HasLengths() const { return this->Lengths_; }
  static constexpr std::uint64_t FirstHitBytesPerPixel = 8;
  static constexpr std::uint64_t LengthsBytesPerPixel = 16;
  static constexpr std::uint64_t PeelBytesPerPixel = 20; ///< Peel, and where native rays begin
  int Width() const { return this->Width_; }
  int Height() const { return this->Height_; }
  int TilesX() const { return (this->Width_ + 31) / 32; }
  int TilesY() const { return (this->Height_ + 31) / 32; }
  std::uint32_t BlockStampIndex() const;
  std::uint32_t TileStampIndex() const;
  std::size_t FeedbackWords() const;

  NativeView Native; ///< of the native marcher; its colours are copied to Color to be blended
  bool NativeChanged = false; ///< Color doesn't have them yet
  GLTexture Color;
  GLTexture Position;
  GLTexture Intervals;
  GLTexture Depth;
  GLTexture Error;    ///< estimates, if they are asked for
  GLTexture FirstHit; ///< depth and level where the opacity is what is looked for, if it is
  GLTexture Lengths;  ///< of averages of several components: where values count, of each
  GLTexture Peel;     ///< colours of another stretch of the rays, where they are drawn in such
  GLBuffer Feedback;
  GLBuffer TileList;
  GLFramebuffer StateTarget;                    ///< colour, position and error, to clear them
  GLFramebuffer HitTarget;                      ///< first hits, to clear them
  GLFramebuffer LengthsTarget;                  ///< lengths, to clear them
  GLFramebuffer IntervalTarget;                 ///< intervals
  GLFramebuffer EmptyTarget;                    ///< no attachment: the marcher writes images
  std::vector<std::uint32_t> ActiveTiles;       ///< x | y << 16
  std::optional<PictureKey> Complete;           ///< of the picture in Color, if that is complete
  std::shared_ptr<const ViewGeometry> Geometry; ///< of the first hits
  /// What rays gathered of a block, before colours were made of it, and how those are made.
  struct GatheredRays
  {
    MarchParameters Parameters;
    BlendKind Blend = BlendKind::Composite;
    int Components = 1;
    bool Dependent = false;
    std::vector<float> Pixels; ///< GatheredChannels() each
  };
  std::optional<GatheredRays> Gathered;
  bool CountsSamples = false;                     ///< of each pixel, in the place of errors
  std::optional<std::vector<FrameVertex>> Frames; ///< of the picture's bricks, if they are shown

private:
  MemoryShare NativeBytes;
  int Width_ = 0;
  int Height_ = 0;
  std::uint32_t Slots = 0;
  std::uint32_t PageBlocks = 0;
  bool Native_ = false;
  bool Estimate_ = false;
  bool FirstHit_ = false;
  bool Peels_ = false;
  bool Lengths_ = false;
};

} // namespace teravox
