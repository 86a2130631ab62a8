// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickAtlas.h"
#include "BrickCache.h"
#include "BrickLoader.h"
#include "BrickSource.h"
#include "LightSetup.h"
#include "Projection.h"
#include "RayMarcher.h"
#include "Residency.h"
#include "TransferTable.h"
#include "ViewGeometry.h"
#include "ViewState.h"

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace teravox
{

/// Budgets and switches of an engine; a change of one that matters rebuilds what depends on it.
/// What draws. Automatic: native code where OpenGL is drawn by this machine's processors itself,
/// which takes several times as long for it, else the GPU.
enum class MarcherKind
{
  Automatic,
  GPU,
  Native
};

struct EngineSettings
{
  std::uint64_t GPUMemoryBudget = 0; ///< bytes, hard
  std::uint64_t HostMemoryBudget = 0;
  int LoaderThreads = 2;
  std::uint32_t MaximumSlots = ~std::uint32_t{ 0 }; ///< for tests of small atlases
  MarcherKind Marcher = MarcherKind::Automatic;
  std::optional<std::uint64_t> ShuffleSeed; ///< for tests of arrival orders
};

/// One picture of one volume in one view.
struct FrameRequest
{
  const void* View = nullptr; ///< renderer (and eye): each has its own ray state
  ViewInput Camera;
  GLuint Framebuffer = 0;
  int X = 0; ///< lower left of the viewport in the frame buffer, pixels
  int Y = 0;
  bool UseDepth = true; ///< rays end at the frame buffer's depth; else nothing reads it
  bool Nearest = false;
  bool Shade = false;
  std::array<float, 4> Material{ 0, 1, 0, 1 };
  std::array<float, 3> LightDiffuse{ 1, 1, 1 };
  std::array<float, 3> LightSpecular{ 1, 1, 1 };
  bool TwoSided = true;
  std::vector<LightInput> Lights; ///< instead of one headlight
  double Tolerance = 1.0 / 255;   ///< epsilon; 0: SampleDistance rules
  double SampleDistance = 1;      ///< world units
  double ShortestLength = 1e-3;   ///< a wall (opacity 1) of this world length lets nothing pass
  bool EmptySpaceSkipping = true;
  bool ReusePicture = true; ///< the last picture again, where it is complete and the same
  bool CountSamples = false;
  bool ShowLevel = false;
  bool ErrorEstimate = false;
  Projection Blend; ///< in data values
  /// Of the blend mode Slice: per pixel, rows from the bottom, the view depth at which its ray
  /// meets the slice, NaN if it doesn't.
  std::shared_ptr<const std::vector<double>> SliceDepths;
  bool Converge = true;  ///< return when the picture is converged; else draw what is there
  double TimeBudget = 0; ///< seconds per frame when not converging; <= 0: none
  double Timeout = 0;    ///< seconds without progress after which converging gives up; 0: never
  std::function<bool()> Abort; ///< polled between passes
};

struct FrameStatistics
{
  bool Converged = false;
  bool TimedOut = false;
  bool Aborted = false;
  std::size_t MissingBricks = 0;
  std::uint64_t Passes = 0;
  std::uint64_t Samples = 0;             ///< cells or samples of the field looked at
  std::uint64_t EvaluatedSamples = 0;    ///< of them those whose colour was computed
  std::uint64_t ContributingSamples = 0; ///< of them those that added something
  std::uint64_t Gradients = 0;           ///< places where gradients were computed
  std::uint64_t Visits = 0;              ///< of rays: bricks, and empty regions left at once
  std::uint64_t Draws = 0;
};

/// The renderer of one volume in one GL context, between plain values and GL: source, loader, host
/// cache, page table, residency, atlas, marcher, and the ray states of its views.
/// Thread: used by the render thread only; functions marked GL need the context current.
class VolumeEngine
{
public:
  VolumeEngine();
  VolumeEngine(const VolumeEngine&) = delete;
  VolumeEngine& operator=(const VolumeEngine&) = delete;
  VolumeEngine(VolumeEngine&&) = delete;
  VolumeEngine& operator=(VolumeEngine&&) = delete;
  ~VolumeEngine();

  void SetSource(std::shared_ptr<BrickSource> source);
  void SetSettings(const EngineSettings& settings);
  /// The function in data values; uploaded at the next frame. `version` tells whether it changed.
  void SetTransferFunction(TransferFunction function, std::uint64_t version);

  /// GL. Draws one frame. Errors leave the frame buffer untouched.
  Status Render(const FrameRequest& request);
  /// GL. The accumulators of the last frame of a view: premultiplied rgb and opacity, rows from the
  /// bottom, 4 floats per pixel. Empty if there are none.
  std::vector<float> ReadColors(const void* view, int& width, int& height);
  /// GL. Per pixel of the last frame of a view, rows from the bottom: what its colour and opacity
  /// may be off, 0..1. Certain for rays that ended early or are still under way and for bricks that
  /// were missing or can't be read, an estimate for steps. 1 where nothing is known (fixed steps).
  /// Empty if that frame had no estimate.
  std::vector<float> ReadErrors(const void* view, int& width, int& height);
  /// GL. Frees everything that lives in the context.
  void ReleaseGraphics();
  /// Bricks that couldn't be read are asked for again.
  void RetryFailed();

  const FrameStatistics& LastFrame() const { return this->Frame; }
  /// Failures since the last call.
  std::vector<LoadResult> TakeFailures();
  std::uint64_t BricksLoaded() const { return this->BricksUploaded; }
  std::uint64_t BytesUploaded() const;
  std::uint64_t PageTableBytesUploaded() const;
  std::uint64_t BytesRead() const;
  std::size_t FailedBricks() const;
  /// Page blocks whose ranges couldn't be read: their bricks are drawn, but none is known to be
  /// empty.
  std::size_t FailedPageBlocks() const;
  const GPUMemory& Memory() const { return this->Memory_; }
  std::uint64_t HostMemoryUsed() const;
  /// Most that cache and reads took at once, and what the source holds now.
  std::uint64_t PeakHostMemoryUsed() const;
  std::uint64_t AddressingBytes() const;
  const AtlasPlan& Plan() const { return this->Plan_; }
  /// What that plan was made for; all zero before the first frame.
  const AtlasRequest& PlannedFor() const { return this->PlannedFor_; }
  std::uint32_t SlotsInUse() const { return this->Residency_ ? this->Residency_->SlotsInUse() : 0; }
  std::uint64_t Evictions() const
  {
    return this->EvictionsBefore + (this->Residency_ ? this->Residency_->NumberOfEvictions() : 0);
  }
  std::uint64_t PageBlockEvictions() const
  {
    return this->BlockEvictionsBefore +
      (this->Residency_ ? this->Residency_->NumberOfBlockEvictions() : 0);
  }
  /// An empty text, or which invariant of page table and residency is broken.
  std::string CheckInvariants() const;
  /// Operations of the CPU side of the last frame: page-table entries written, wishes handled.
  std::uint64_t Operations() const { return this->Operations_; }

private:
  Status Prepare(const FrameRequest& request);
  Status PrepareAtlas(const FrameRequest& request);
  void PinCoarsest();
  Status PrepareLoader();
  void FillParameters(const FrameRequest& request, MarchParameters& parameters) const;
  Status RunPasses(const FrameRequest& request, ViewState& view, MarchParameters& parameters,
    const ViewOrder& order);
  bool Carry(FramePlan plan);
  static ShaderVariant VariantOf(const FrameRequest& request, const VoxelFormat& format);
  bool IsStillThere(const FrameRequest& request, ViewState& view, const PictureKey& key);
  void ForgetPictures();
  void KeepCounters();
  bool AnyFailed() const { return this->FailedBricks() + this->FailedPageBlocks() > 0; }
  std::uint64_t FixedBytes(const ViewState* except, int width, int height) const;

  GPUMemory Memory_; // outlives everything that reports to it
  std::shared_ptr<BrickSource> Given;
  std::shared_ptr<BrickSource> Source_; ///< what is drawn: Given, or scaled by 2^-Exponent
  int Exponent = 0;
  EngineSettings Settings;
  std::shared_ptr<BrickCache> Cache;
  std::unique_ptr<BrickLoader> Loader;
  HostLimit Held; ///< share of the host budget for what waits for a place on the GPU
  AtlasPlan Plan_;
  AtlasRequest PlannedFor_;
  std::unique_ptr<PageTable> Table;
  std::unique_ptr<Residency> Residency_;
  std::unique_ptr<RayMarcher> Marcher;
  std::unique_ptr<BrickAtlas> Atlas;
  std::map<const void*, std::unique_ptr<ViewState>> Views;
  TransferFunction Function;
  std::uint64_t FunctionVersion = 0;
  std::uint64_t TableVersion = 0;
  BlendKind TableBlend = BlendKind::Composite; ///< mode that Transfer was made for
  TransferFunction Drawn;                      ///< what Transfer was made of
  TransferTable Transfer;
  FrameStatistics Frame;
  Feedback Unanswered; ///< what the last interactive frame missed
  std::vector<LoadResult> Failures;
  std::uint64_t BricksUploaded = 0;
  std::uint64_t BytesUploadedBefore = 0;
  std::uint64_t TableBytesBefore = 0;
  std::uint64_t EvictionsBefore = 0;
  std::uint64_t BlockEvictionsBefore = 0;
  std::uint64_t Operations_ = 0;
  /// The shares of the tolerance (MarchParameters::Step) of the last frame with an estimate.
  MarchParameters::Vec EstimateStep{};
  bool EstimateKnown = false; ///< it had steps that know their error
  double Looseness = 1;       ///< factor of the tolerance while frames must be fast
};

} // namespace teravox
