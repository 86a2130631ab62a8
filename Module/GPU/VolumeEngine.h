// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickAtlas.h"
#include "BrickCache.h"
#include "BrickLoader.h"
#include "BrickSource.h"
#include "Components.h"
#include "DirectoryReader.h"
#include "FramePace.h"
#include "GradientTable.h"
#include "ImageLattice.h"
#include "LightSetup.h"
#include "Projection.h"
#include "RayMarcher.h"
#include "ReadAhead.h"
#include "Residency.h"
#include "TransferPlane.h"
#include "TransferTable.h"
#include "ViewGeometry.h"
#include "ViewState.h"

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_set>
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

/// Where the rays of a picture run, as the depth buffer counts depth (0..1), rows from the bottom.
struct RayDepths
{
  std::vector<float> Begin; ///< empty: all at the near plane
  std::vector<float> End; ///< 1: at the far plane; where it isn't behind the begin, there is no ray
};

/// One picture of one volume in one view.
struct FrameRequest
{
  const void* View = nullptr; ///< renderer (and eye): each has its own ray state
  ViewInput Camera;
  GLuint Framebuffer = 0;
  int X = 0; ///< lower left of the viewport in the frame buffer, pixels
  int Y = 0;
  double EndDepth = std::numeric_limits<double>::infinity(); ///< view depth where rays end, too
  bool UseDepth = true; ///< rays end at the frame buffer's depth; else nothing reads it
  std::shared_ptr<const RayDepths> Depths; ///< instead of the frame buffer's depth
  /// No rays outside of these pixels: left, bottom, right, top, the last two exclusive.
  std::array<int, 4> Rectangle{ 0, 0, std::numeric_limits<int>::max(),
    std::numeric_limits<int>::max() };
  /// Of a block, see OpacityInFront(): rays of tiles that it hides aren't cast. Suspected alone:
  /// the picture isn't converged where there are any. Confirmed as well: what both say is hidden.
  /// In blend modes that add up opacity.
  std::shared_ptr<const std::vector<float>> SuspectedInFront;
  std::shared_ptr<const std::vector<float>> ConfirmedInFront;
  /// A stretch of the rays of a frame that is drawn in several; and one that isn't the first. Their
  /// statistics, what they ask for and the time that they take are the frame's together.
  bool IsStretch = false;
  bool Continues = false;
  bool Nearest = false;
  bool Shade = false;
  std::array<float, 4> Material{ 0, 1, 0, 1 };
  std::array<float, 3> LightDiffuse{ 1, 1, 1 };
  std::array<float, 3> LightSpecular{ 1, 1, 1 };
  bool TwoSided = true;
  std::vector<LightInput> Lights; ///< instead of one headlight
  /// What gradients find where clipping planes cut away; none: the voxels that are there.
  std::optional<double> ClippedIntensity;
  double Tolerance = 1.0 / 255; ///< epsilon; 0: SampleDistance rules
  double SampleDistance = 1;    ///< world units
  double ShortestLength = 1e-3; ///< a wall (opacity 1) of this world length lets nothing pass
  /// Pixels between rays may be interpolated: up to this stage (ImageLattice.h); 0: all are cast.
  int LatticeStages = MostLatticeStages;
  bool EmptySpaceSkipping = true;
  bool ReusePicture = true; ///< the last picture again, where it is complete and the same
  bool CountSamples = false;
  /// Debug views, one at a time: the level of the first contribution, how many samples each pixel
  /// took (SampleShade()), the edges of the bricks that were needed, over the picture.
  bool ShowLevel = false;
  bool ShowSamples = false;
  bool ShowFrames = false;
  bool ErrorEstimate = false;
  bool RecordBricks = false; ///< see VolumeEngine::BricksMet()
  /// Keep where each ray's opacity passes this (0...1), in blend modes that add up opacity
  /// (composite, isosurfaces, slices). Not together with CountSamples, ErrorEstimate and debug
  /// views.
  std::optional<double> HitOpacity;
  bool Show = true; ///< put the picture into the frame buffer
  Composition Final;
  Projection Blend; ///< in data values
  /// Of the blend mode Slice: per pixel, rows from the bottom, the view depth at which its ray
  /// meets the slice, NaN if it doesn't.
  std::shared_ptr<const std::vector<double>> SliceDepths;
  bool Converge = true;  ///< return when the picture is converged; else draw what is there
  double TimeBudget = 0; ///< seconds per frame when not converging; <= 0: none
  double RetryAfter = 0; ///< seconds after which what couldn't be read is asked for again; 0: never
  double Timeout = 0;    ///< seconds without progress after which converging gives up; 0: never
  std::function<bool()> Abort; ///< polled between passes
};

struct FrameStatistics
{
  bool Converged = false;
  bool TimedOut = false;
  bool Aborted = false;
  std::size_t MissingBricks = 0;
  double Tolerance = 0; ///< by which steps were taken: what was asked for, or more in a hurry
  std::uint64_t Passes = 0;
  std::uint64_t Samples = 0;             ///< cells or samples of the field looked at
  std::uint64_t EvaluatedSamples = 0;    ///< of them those whose colour was computed
  std::uint64_t ContributingSamples = 0; ///< of them those that added something
  std::uint64_t Gradients = 0;           ///< places where gradients were computed
  std::uint64_t Visits = 0;              ///< of rays: bricks, and empty regions left at once
  std::uint64_t Draws = 0;
};

/// Where the opacity of rays passes FrameRequest::HitOpacity.
struct FirstHits
{
  /// Per pixel, rows from the bottom: depth along the ray, that is view depth without
  /// Geometry->DepthOrigin, and the level drawn there; both NativeView::NoHit where it doesn't.
  std::vector<float> DepthAndLevel;
  std::shared_ptr<const ViewGeometry> Geometry;
  std::vector<float> Opaque; ///< depth buffer's depth of opaque geometry; empty: there is none
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

  /// `series`, `step`: what the source is a step of. Then bricks of the steps beside it are read
  /// into the host cache once the picture is complete, and those of the step before are kept there.
  void SetSource(std::shared_ptr<BrickSource> source, std::shared_ptr<BrickSeries> series = nullptr,
    int step = 0);
  /// Waits until nothing more is read ahead; false on time-out.
  bool WaitForReadAhead(double seconds) { return this->Ahead->Wait(seconds); }
  std::uint64_t BricksReadAhead() const { return this->Ahead->BricksRead(); }
  void SetSettings(const EngineSettings& settings);
  /// Of the settings, the budgets alone, in bytes.
  void SetBudgets(std::uint64_t gpu, std::uint64_t host);
  /// What would keep every brick of the source resident, or `most` if that is more: of the GPU's
  /// memory for pictures like that of `request` (GL), and of the host's.
  std::uint64_t GPUBytesForAll(const FrameRequest& request, std::uint64_t most) const;
  std::uint64_t HostBytesForAll(std::uint64_t most) const;
  /// The function in data values; uploaded at the next frame. `version` tells whether it changed.
  void SetTransferFunction(TransferFunction function, std::uint64_t version);
  /// The same for sources whose voxels have several components; see IsOfComponents().
  void SetComponentFunctions(ComponentFunctions functions, std::uint64_t version);

  /// GL. Draws one frame. Errors leave the frame buffer untouched.
  Status Render(const FrameRequest& request);
  /// GL. Makes what Render() needs for a stretch, without drawing. Returns a texture (RGBA32F, one
  /// texel per pixel) that is the caller's until StretchColors() keeps something.
  Result<GLuint> PrepareStretch(const FrameRequest& request);
  /// GL. The texture with the colours of the last frame of a view that was a stretch (premultiplied
  /// colour, transmittance): the next one of that view overwrites it, except where `keep`.
  GLuint StretchColors(const void* view, bool keep);
  /// GL. The accumulators of the last frame of a view: premultiplied rgb and opacity, rows from the
  /// bottom, 4 floats per pixel. Empty if there are none.
  std::vector<float> ReadColors(const void* view, int& width, int& height);
  /// What the rays of the last frame of a view have gathered of a block (ViewInput::Block), in
  /// blend modes where that can be joined: see JoinRays(). Empty in others.
  std::vector<float> ReadGathered(const void* view, int& width, int& height) const;
  /// GL. Makes colours, as ReadColors() gives them, of what the rays of all blocks have gathered
  /// together; with the functions of the view's last frame. Empty if there is none such, or it is
  /// of another size.
  std::vector<float> ResolveGathered(const void* view, const std::vector<float>& gathered);
  /// GL. Per pixel of the last frame of a view, rows from the bottom: what its colour and opacity
  /// may be off, 0..1. Certain for rays that ended early or are still under way and for bricks that
  /// were missing or can't be read, an estimate for steps. 1 where nothing is known (fixed steps).
  /// Empty if that frame had no estimate.
  std::vector<float> ReadErrors(const void* view, int& width, int& height);
  /// GL. Of the last frame of a view; nothing if that had no HitOpacity.
  std::optional<FirstHits> ReadFirstHits(const void* view);
  /// GL. The first hit of the ray of one pixel (from the lower left) of the picture that `request`
  /// was drawn for; it ends where that one's rays ended at opaque geometry. Converges; leaves
  /// pictures and statistics of frames as they are.
  Result<FirstHits> DrawOneRay(const FrameRequest& request, int x, int y, double opacity);
  /// GL. The opacity of that ray up to a view depth; else as DrawOneRay().
  Result<double> OpacityOfRay(const FrameRequest& request, int x, int y, double endDepth);
  /// GL. Of all rays of a picture; else as DrawOneRay().
  Result<FirstHits> DrawHits(const FrameRequest& request, double opacity);
  /// GL. Puts pixels (RGBA, rows from the bottom) of a picture into the frame buffer of its
  /// request, those with an alpha of 0 excepted. The frame buffer has 8 bits and one sample.
  void PutPixels(
    const FrameRequest& request, const std::vector<std::array<std::uint8_t, 4>>& pixels);
  /// GL. The opaque depths that ended the rays of the last frame of a view, 0..1, rows from the
  /// bottom. Empty if there is none.
  std::vector<float> ReadDepth(const void* view) const;
  /// GL. Puts colours that were made elsewhere (as ReadColors() gives them) into the frame buffer
  /// of a request, through its view, whose own colours they replace. Not if that isn't to be shown.
  Status ShowColors(const FrameRequest& request, const std::vector<float>& colors);
  /// GL. Frees everything that lives in the context.
  void ReleaseGraphics();
  /// Forgets it: that context doesn't exist any more.
  void AbandonGraphics();
  /// GL. Frees the states of all views but these.
  void KeepViews(const std::set<const void*>& views);
  /// Whether anything lives in a context.
  bool HasGraphics() const { return this->Marcher != nullptr || !this->Views.empty(); }
  /// Bricks that couldn't be read are asked for again.
  void RetryFailed();

  const FrameStatistics& LastFrame() const { return this->Frame; }
  /// The bricks of the drawn levels, and of ancestors drawn instead, that rays of the last frame
  /// with RecordBricks needed; unordered. Complete where that frame has converged.
  const std::unordered_set<BrickKey, BrickKeyHash>& BricksMet() const { return this->Met; }
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
  static constexpr std::uint32_t MostSteps =
    16384; ///< llvmpipe ends a shader after 65 535 iterations
  Status Draw(const FrameRequest& request);
  Status Prepare(const FrameRequest& request);
  Result<ViewState*> PrepareView(const FrameRequest& request);
  Status PrepareAtlas(const FrameRequest& request);
  AtlasRequest AtlasWanted(const FrameRequest& request) const;
  void PinCoarsest(const std::optional<VoxelBox>& block);
  void RecordBricks(const Feedback& feedback);
  Status PrepareLoader();
  void ForgetStep(const StepVolume& step);
  void ForgetOtherSteps();
  void KeepStep(const std::shared_ptr<StepVolume>& step);
  std::shared_ptr<StepVolume> StepOf(int step);
  std::vector<LoadResult> TakeFinished();
  VisibleValues FindVisible(const FrameRequest& request) const;
  /// What an interactive frame waits at most for what usually comes at once, in seconds.
  static constexpr double ShortWait = 0.05;
  void StartReadAhead(const FrameRequest& request, const ViewOrder& order);
  void FillParameters(const FrameRequest& request, MarchParameters& parameters) const;
  Status RunPasses(const FrameRequest& request, ViewState& view, MarchParameters& parameters,
    const ViewOrder& order);
  bool Carry(FramePlan plan);
  void BeginDirectory();
  bool TakeDirectory(double seconds);
  bool AwaitDirectory(const FrameRequest& request);
  void EndReadAhead();
  void RetryInTime(const FrameRequest& request);
  Status Show(const FrameRequest& request, ViewState& view);
  static bool Gathers(const FrameRequest& request);
  ShaderVariant VariantOf(const FrameRequest& request, const VoxelFormat& format) const;
  bool IsStillThere(const FrameRequest& request, ViewState& view, const PictureKey& key,
    const std::vector<std::uint8_t>& hidden);
  void ForgetPictures();
  void KeepCounters();
  bool AnyFailed() const { return this->FailedBricks() + this->FailedPageBlocks() > 0; }
  bool HasComponents() const { return this->Source_->Info().Components > 1; }
  /// See ViewState::Lengths.
  bool HasLengths(const FrameRequest& request) const
  {
    return this->HasComponents() && request.Blend.Kind == BlendKind::Average;
  }
  bool HasLabels() const { return this->Source_->Info().MaskLabels > 0; }
  /// Of one component; of a label mask what holds for all labels.
  const TransferTable& MainTable() const
  {
    return this->Tables_.empty() ? this->Transfer : this->Tables_.front();
  }
  bool IsNativeWanted() const;
  float LargestExtinction() const;
  Status PrepareTables(const FrameRequest& request);
  double OpaqueDepth(const FrameRequest& request, int x, int y) const;
  FrameRequest RayOf(const FrameRequest& request, int x, int y) const;
  Result<FirstHits> DrawAside(
    FrameRequest request, std::optional<double> opacity, std::vector<float>* colors = nullptr);
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
  ComponentFunctions Components_;     ///< instead of Function for several components
  std::vector<TransferTable> Tables_; ///< instead of Transfer, likewise, or for a label mask
  std::uint64_t FunctionVersion = 0;
  std::uint64_t TableVersion = 0;
  BlendKind TableBlend = BlendKind::Composite; ///< mode that Transfer was made for
  TransferFunction Drawn;                      ///< what Transfer was made of
  TransferTable Transfer;
  GradientTable Gradient; ///< of Drawn or Components_; of other blend modes none
  TransferPlane Plane;    ///< likewise, and not with a mask
  FrameStatistics Frame;
  std::unordered_set<BrickKey, BrickKeyHash> Met;
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
  char Aside = 0;             ///< its address is the view of DrawOneRay() and DrawHits()
  FramePace Pace;
  std::shared_ptr<BrickSeries> Series;
  std::shared_ptr<StepVolume> Current; ///< whose Source is Source_
  /// Other steps of the series, the one that was shown longest ago first.
  std::vector<std::shared_ptr<StepVolume>> OtherSteps;
  std::uint32_t NextVolume = 0;
  int Direction = 1;                                                ///< of the last change of step
  std::unique_ptr<ReadAhead> Ahead = std::make_unique<ReadAhead>(); ///< never null
  std::unique_ptr<DirectoryReader> Directory; ///< while the page table waits for it
  bool DirectoryAwaited = false;              ///< a frame has waited for it
  double FailedAt = 0;                        ///< when a brick or page block last failed
};

} // namespace teravox
