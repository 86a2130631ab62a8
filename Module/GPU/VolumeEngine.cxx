// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "VolumeEngine.h"

#include "BlockPictures.h"
#include "BlockSplit.h"
#include "EndOrLeave.h"
#include "GLStateGuard.h"
#include "MarchSetup.h"
#include "SharedLayout.h"
#include "WaitScope.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <limits>
#include <thread>
#include <unordered_set>

namespace teravox
{

namespace
{
constexpr std::uint32_t FewestSteps = 1024;
constexpr double LongPass = 0.4; // seconds; drivers' watchdogs bite at about 2
constexpr double ShortPass = 0.1;

// Of a picture, beside what each has.
std::uint64_t MoreBytes(int width, int height, bool firstHit, bool peels, bool lengths)
{
  return ((firstHit ? ViewState::FirstHitBytesPerPixel : 0) +
           (peels ? ViewState::PeelBytesPerPixel : 0) +
           (lengths ? ViewState::LengthsBytesPerPixel : 0)) *
    static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
}

// Whether rays begin at the near plane.
bool RunFromBegin(const FrameRequest& request)
{
  return !request.Depths || request.Depths->Begin.empty();
}

// Per pixel whether blocks in front leave no more of its ray than `share`; empty: nowhere.
std::vector<std::uint8_t> FindHidden(const FrameRequest& request, float share)
{
  if (!request.SuspectedInFront || !request.Camera.Block || !AddsUpOpacity(request.Blend.Kind))
  {
    return {};
  }
  return HiddenPixels(*request.SuspectedInFront,
    request.ConfirmedInFront ? *request.ConfirmedInFront : std::vector<float>(), share,
    request.Camera.Width, request.Camera.Height);
}

double Now()
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
} // namespace

VolumeEngine::VolumeEngine() = default;
VolumeEngine::~VolumeEngine()
{
  EndOrLeave(std::move(this->Ahead));
  EndOrLeave(std::move(this->Directory));
  EndOrLeave(std::move(this->Loader));
}

// Functions that carry out time steps: VolumeEngineSteps.cxx; what a disk may hold up:
// VolumeEngineStalls.cxx.
void VolumeEngine::SetSettings(const EngineSettings& settings)
{
  const bool loader = settings.LoaderThreads != this->Settings.LoaderThreads ||
    settings.ShuffleSeed != this->Settings.ShuffleSeed;
  this->Settings = settings;
  if (loader)
  {
    EndOrLeave(std::move(this->Loader));
  }
}

void VolumeEngine::SetBudgets(std::uint64_t gpu, std::uint64_t host)
{
  this->Settings.GPUMemoryBudget = gpu;
  this->Settings.HostMemoryBudget = host;
}

std::uint64_t VolumeEngine::GPUBytesForAll(const FrameRequest& request, std::uint64_t most) const
{
  FrameRequest picture = request; // with all that it may be drawn for
  picture.IsStretch = true;
  picture.HitOpacity = 1.0f;
  AtlasRequest all = this->AtlasWanted(picture);
  all.BudgetBytes = most;
  const Result<AtlasPlan> plan = PlanAtlas(this->Source_->Info().Layout, all);
  // Functions may be edited.
  constexpr std::uint64_t spare = 4 * TableBytesReserved;
  return plan ? std::min(plan.Value().TotalBytes() + all.ReservedBytes + spare, most) : most;
}

std::uint64_t VolumeEngine::HostBytesForAll(std::uint64_t most) const
{
  const VolumeInfo& info = this->Source_->Info();
  const auto bricks = static_cast<double>(info.Layout.TotalBricks());
  const auto brick = static_cast<double>(BrickLoader::ChargeOf({}, info));
  // See PrepareLoader().
  const double bytes =
    (bricks + 3) * brick / 3 * 4 + static_cast<double>(this->Source_->LeastMemory());
  return bytes < static_cast<double>(most) ? static_cast<std::uint64_t>(bytes) : most;
}

Status VolumeEngine::PrepareLoader()
{
  const VolumeInfo& info = this->Source_->Info();
  BrickKey block;
  block.PageLevel = 1;
  this->Held.BrickBytes = BrickLoader::ChargeOf({}, info);
  this->Held.BlockBytes = BrickLoader::ChargeOf(block, info);
  const std::uint64_t largest = std::max(this->Held.BrickBytes, this->Held.BlockBytes);
  // One that waits for a place, and one that is being read.
  const std::uint64_t leastCache = 2 * largest;
  const std::uint64_t leastSource = this->Source_->LeastMemory();
  const std::uint64_t budget = this->Settings.HostMemoryBudget;
  if (budget < leastCache + leastSource)
  {
    return Status(StatusCode::ResourceExhausted,
      "The host memory budget of " + std::to_string(budget) +
        " bytes is too small; the least that works here is " +
        std::to_string(leastCache + leastSource) + " bytes.");
  }
  // A quarter for what the source keeps (chunks, levels), the rest for bricks in cache and on the
  // way.
  const std::uint64_t forSource = std::min(std::max(leastSource, budget / 4), budget - leastCache);
  const std::uint64_t forCache = budget - forSource;
  this->Held.Bytes = forCache - largest;
  this->Source_->SetMemoryBudget(forSource);
  if (!this->Cache)
  {
    this->Cache = std::make_shared<BrickCache>(forCache);
  }
  if (forCache < this->Cache->Budget())
  {
    this->ForgetOtherSteps(); // what is set aside for them was meant for more
  }
  this->Cache->SetBudget(forCache);
  if (!this->Loader)
  {
    this->Loader = std::make_unique<BrickLoader>(
      this->Cache, this->Settings.LoaderThreads, this->Settings.ShuffleSeed);
    this->Loader->SetSource(this->Current->Volume, this->Source_, true);
  }
  return {};
}

std::uint64_t VolumeEngine::FixedBytes(const ViewState* except, int width, int height) const
{
  // 16: the least that the table of slots takes, where the plan needs none.
  std::uint64_t tables = sizeof(MarchParameters) + 16;
  tables += this->HasComponents() || this->HasLabels() ? 0 : this->Transfer.SizeInBytes();
  tables += this->Gradient.SizeInBytes() + this->Plane.SizeInBytes();
  for (const TransferTable& table : this->Tables_)
  {
    tables += table.SizeInBytes();
  }
  std::uint64_t bytes = PictureBytes(width, height) + std::max(tables, TableBytesReserved);
  for (const auto& view : this->Views)
  {
    if (view.second.get() != except)
    {
      bytes += PictureBytes(view.second->Width(), view.second->Height());
      // The plan has room for the feedback of one.
      bytes += view.second->IsNative() ? 0 : view.second->FeedbackWords() * 4;
      bytes += MoreBytes(view.second->Width(), view.second->Height(), view.second->HasFirstHit(),
        view.second->HasPeels(), view.second->HasLengths());
    }
  }
  return bytes;
}

bool VolumeEngine::IsNativeWanted() const
{
  return this->Settings.Marcher == MarcherKind::Automatic
    ? IsSoftwareRenderer()
    : this->Settings.Marcher == MarcherKind::Native;
}

AtlasRequest VolumeEngine::AtlasWanted(const FrameRequest& request) const
{
  const VolumeInfo& info = this->Source_->Info();
  const auto view = this->Views.find(request.View);
  AtlasRequest wanted = AtlasRequest::For(VoxelFormat::Choose(info.Type), AtlasComponents(info),
    request.Camera.Width, request.Camera.Height);
  wanted.BudgetBytes = this->Settings.GPUMemoryBudget;
  wanted.ReservedBytes = this->FixedBytes(view == this->Views.end() ? nullptr : view->second.get(),
    request.Camera.Width, request.Camera.Height);
  wanted.ReservedBytes += MoreBytes(request.Camera.Width, request.Camera.Height,
    request.HitOpacity.has_value(), request.IsStretch, this->HasLengths(request));
  wanted.ReservedBytes += request.ShowFrames ? RayMarcher::FrameBytes : 0;
  wanted.MaximumSlots = this->Settings.MaximumSlots;
  GLint largest = 0;
  glGetIntegerv(GL_MAX_3D_TEXTURE_SIZE, &largest);
  wanted.MaximumTextureSize = largest;
  wanted.Native = this->IsNativeWanted();
  return wanted;
}

Status VolumeEngine::PrepareAtlas(const FrameRequest& request)
{
  const VolumeInfo& info = this->Source_->Info();
  const AtlasRequest wanted = this->AtlasWanted(request);
  const bool fits = this->Atlas && this->Plan_.Slots != 0 &&
    wanted.BudgetBytes == this->PlannedFor_.BudgetBytes &&
    wanted.MaximumSlots == this->PlannedFor_.MaximumSlots &&
    wanted.Native == this->PlannedFor_.Native &&
    this->Plan_.TotalBytes() + wanted.ReservedBytes <= wanted.BudgetBytes;
  if (fits)
  {
    return {};
  }
  Result<AtlasPlan> plan = PlanAtlas(info.Layout, wanted);
  if (!plan)
  {
    return plan.GetStatus();
  }
  this->KeepCounters();
  this->ForgetPictures();
  this->Atlas.reset();
  this->Residency_.reset();
  this->Plan_ = {};
  this->PlannedFor_ = wanted;
  const auto make = [&]
  {
    return BrickAtlas::Make(
      this->Memory_, plan.Value(), VoxelFormat::Choose(info.Type), info.Layout.StoredSize());
  };
  Result<std::unique_ptr<BrickAtlas>> atlas = make();
  // A budget is a limit, not a promise of the driver: some bound the size of one texture.
  for (std::uint64_t budget = wanted.BudgetBytes / 2; !atlas; budget /= 2)
  {
    AtlasRequest smaller = wanted;
    smaller.BudgetBytes = budget;
    plan = PlanAtlas(info.Layout, smaller);
    if (!plan)
    {
      return atlas.GetStatus();
    }
    atlas = make();
  }
  this->Plan_ = plan.Value();
  this->Atlas = std::move(atlas.Value());
  this->Table = std::make_unique<PageTable>(info.Layout, this->Plan_.PageBlocks);
  this->Residency_ = std::make_unique<Residency>(*this->Table, this->Plan_.Slots);
  this->BeginDirectory();
  return {};
}

void VolumeEngine::ForgetPictures()
{
  for (const auto& view : this->Views)
  {
    view.second->Complete.reset();
  }
}

void VolumeEngine::KeepCounters()
{
  if (this->Atlas)
  {
    this->BytesUploadedBefore += this->Atlas->BytesUploaded();
    this->TableBytesBefore += this->Atlas->PageTableBytesUploaded();
    this->EvictionsBefore += this->Residency_->NumberOfEvictions();
    this->BlockEvictionsBefore += this->Residency_->NumberOfBlockEvictions();
  }
}

void VolumeEngine::PinCoarsest(const std::optional<VoxelBox>& block)
{
  const PyramidLayout& layout = this->Source_->Info().Layout;
  const int level = layout.NumberOfLevels() - 1;
  const VoxelBox whole{ { 0, 0, 0 }, layout.Dimensions(0) };
  const BrickBox box = BricksOfBlock(layout, level, block.value_or(whole));
  const VoxelBox bricks{ box.Low, box.High };
  std::vector<BrickKey> pinned;
  if (bricks.Count() <= this->Plan_.Slots / 4 + 1)
  {
    for (std::int64_t z = bricks.Low[2]; z < bricks.High[2]; ++z)
    {
      for (std::int64_t y = bricks.Low[1]; y < bricks.High[1]; ++y)
      {
        for (std::int64_t x = bricks.Low[0]; x < bricks.High[0]; ++x)
        {
          BrickKey& key = pinned.emplace_back();
          key.Level = static_cast<std::uint8_t>(level);
          key.X = static_cast<std::uint32_t>(x);
          key.Y = static_cast<std::uint32_t>(y);
          key.Z = static_cast<std::uint32_t>(z);
        }
      }
    }
  }
  this->Residency_->SetPinned(std::move(pinned));
}

// Not what was missed: where page blocks are missing, that may be empty.
void VolumeEngine::RecordBricks(const Feedback& feedback)
{
  for (const std::uint32_t slot : feedback.UsedSlots)
  {
    this->Met.insert(this->Residency_->BrickInSlot(slot));
  }
}

Status VolumeEngine::Prepare(const FrameRequest& request)
{
  if (!this->Source_)
  {
    return Status(StatusCode::InvalidArgument, "There is no brick source to draw.");
  }
  if (!this->Marcher)
  {
    Result<std::unique_ptr<RayMarcher>> marcher = RayMarcher::Make(this->Memory_);
    if (!marcher)
    {
      return marcher.GetStatus();
    }
    this->Marcher = std::move(marcher.Value());
    this->TableVersion = 0;
  }
  const VolumeInfo& info = this->Source_->Info();
  if (this->HasLabels() && info.Components > 1)
  {
    return Status(StatusCode::Unsupported,
      info.Name + " has a label mask, and such volumes can be drawn of one component only.");
  }
  if (this->HasLabels() && request.Blend.Kind != BlendKind::Composite)
  {
    return Status(StatusCode::Unsupported,
      info.Name + " has a label mask, and such volumes can be drawn by composite blending only.");
  }
  Status status = this->PrepareTables(request);
  if (status)
  {
    status = this->PrepareLoader();
  }
  if (status)
  {
    status = this->PrepareAtlas(request);
  }
  if (status)
  {
    this->Residency_->SetHostLimit(this->Held);
  }
  return status;
}

bool VolumeEngine::Carry(FramePlan plan)
{
  for (FramePlan::Upload& upload : plan.Uploads)
  {
    this->Atlas->Upload(upload.Slot, *upload.Data);
    upload.Data.reset(); // counts against the host budget as long as it is held
    ++this->BricksUploaded;
  }
  const std::vector<PageTable::Change> changes = this->Table->TakeChanges();
  this->Atlas->Apply(*this->Table, changes);
  this->Operations_ += plan.Uploads.size() + plan.Requests.size();
  for (const PageTable::Change& change : changes)
  {
    this->Operations_ += change.Count;
  }
  this->Failures.insert(this->Failures.end(), plan.Failures.begin(), plan.Failures.end());
  this->FailedAt = plan.Failures.empty() ? this->FailedAt : Now();
  const bool changed = !plan.Uploads.empty() || !changes.empty();
  for (LoadRequest& wish : plan.Requests)
  {
    wish.Key.Volume = this->Current->Volume;
  }
  this->Loader->Request(std::move(plan.Requests));
  return changed;
}

// Whether rays of a block gather what can be joined with what those of other blocks do.
bool VolumeEngine::Gathers(const FrameRequest& request)
{
  return request.Camera.Block && !AddsUpOpacity(request.Blend.Kind);
}

bool VolumeEngine::IsStillThere(const FrameRequest& request, ViewState& view, const PictureKey& key,
  const std::vector<std::uint8_t>& hidden)
{
  const bool same = request.ReusePicture && RunFromBegin(request) && view.Complete &&
    *view.Complete == key && (view.Frames || !request.ShowFrames);
  const bool hasDepth = request.UseDepth || request.Depths;
  if (!hasDepth && hidden.empty())
  {
    return same;
  }
  // Only where all else is the same is it worth while to wait for the depth itself.
  const std::vector<float> before = same ? RayMarcher::ReadDepth(view) : std::vector<float>();
  if (request.Depths)
  {
    RayMarcher::SetDepth(view, request.Depths->End);
  }
  else if (request.UseDepth)
  {
    this->Marcher->CopyDepth(view, request.Framebuffer, request.X, request.Y);
  }
  if (!hidden.empty())
  {
    RayMarcher::HidePixels(view, hidden, hasDepth);
  }
  return same && RayMarcher::ReadDepth(view) == before;
}

Status VolumeEngine::RunPasses(
  const FrameRequest& request, ViewState& view, MarchParameters& parameters, const ViewOrder& order)
{
  ShaderVariant variant = VariantOf(request, this->Atlas->Format());

  // An interactive frame goes on with the wishes of the one before: without them all that has come
  // since would be thrown away before the first pass.
  Feedback feedback = std::exchange(this->Unanswered, {});
  const std::vector<Feedback::Miss> askedBefore =
    request.Continues ? feedback.Missed : std::vector<Feedback::Miss>();
  bool waiting = false;
  bool unfinished = true;
  bool drawn = false;
  bool fallback = false;
  double lastPass = 0;
  const std::uint64_t evictions = this->Evictions();
  bool evicting = false;
  if (!this->AwaitDirectory(request))
  {
    return {};
  }
  double lastProgress = Now();
  while (true)
  {
    const bool changed = this->Carry(this->Residency_->Step(feedback, this->TakeFinished(), order));
    this->Frame.MissingBricks = this->Residency_->NumberOfMissing();
    if (changed)
    {
      lastProgress = Now();
    }
    if (request.Abort && request.Abort())
    {
      this->Frame.Aborted = true;
      return {};
    }
    if (request.Timeout > 0 && Now() - lastProgress > request.Timeout)
    {
      this->Frame.TimedOut = true;
      return {};
    }
    if (drawn && waiting && !unfinished && !changed)
    {
      // Nothing new for the rays: wait for bricks instead of drawing the same again, and for a
      // little more than one where they come fast.
      this->Loader->WaitFinished(0.05);
      const double until = Now() + std::min(0.02, lastPass);
      for (double left = until - Now(); this->Loader->Pending() > 0 && left > 0;
           left = until - Now())
      {
        const WaitScope waitingForBricks;
        std::this_thread::sleep_for(std::chrono::duration<double>(std::min(0.001, left)));
      }
      continue;
    }
    if (!evicting && this->Evictions() != evictions)
    {
      // The bricks don't stay until the lattice is finer: those that are there serve all rays.
      evicting = true;
      this->Marcher->CastAll(view);
    }
    variant.Substitute = !variant.Interactive && this->Table->NumberOfFailed() > 0;
    const double start = Now();
    Result<PassResult> pass =
      this->Marcher->DrawPass(view, *this->Atlas, *this->Table, parameters, variant);
    if (!pass)
    {
      return pass.GetStatus();
    }
    drawn = true;
    ++this->Frame.Passes;
    lastPass = Now() - start;
    std::uint32_t& limit = parameters.Limits[0];
    limit = lastPass > LongPass ? std::max(limit / 2, FewestSteps)
      : lastPass < ShortPass    ? std::min(limit * 2, MostSteps)
                                : limit;
    waiting = pass.Value().Waiting;
    unfinished = pass.Value().Unfinished;
    this->Frame.Samples += pass.Value().Samples;
    this->Frame.EvaluatedSamples += pass.Value().Evaluated;
    this->Frame.ContributingSamples += pass.Value().Contributing;
    this->Frame.Gradients += pass.Value().Gradients;
    this->Frame.Visits += pass.Value().Visits;
    fallback = fallback || pass.Value().Fallback;
    feedback = std::move(pass.Value().Report);
    if (request.RecordBricks || request.ShowFrames)
    {
      this->RecordBricks(feedback);
    }
    lastProgress = waiting ? lastProgress : Now();
    if (!request.Converge)
    {
      this->Frame.Converged = !unfinished && !fallback && this->Pace.Looseness() == 1 &&
        this->Residency_->NumberOfFailedBlocks() == 0;
    }
    if (!waiting && !unfinished)
    {
      break;
    }
  }
  if (request.Converge)
  {
    this->Frame.Converged = !this->AnyFailed();
  }
  // For the next frame: what was missed is asked for now, with what other stretches missed.
  if (!request.Converge)
  {
    std::unordered_set<BrickKey, BrickKeyHash> missed;
    for (const Feedback::Miss& miss : feedback.Missed)
    {
      missed.insert(miss.Key);
    }
    std::copy_if(askedBefore.begin(), askedBefore.end(), std::back_inserter(feedback.Missed),
      [&missed](const Feedback::Miss& miss) { return missed.count(miss.Key) == 0; });
    this->Unanswered.Missed = feedback.Missed;
  }
  this->Frame.MissingBricks = feedback.Missed.size();
  this->Carry(this->Residency_->Step(feedback, this->TakeFinished(), order));
  return {};
}

namespace
{
int FirstStageOf(const FrameRequest& request, const ShaderVariant& variant,
  const MarchParameters& parameters, const IntervalParameters& intervals,
  const LatticeLimits& limits, const ViewState& view)
{
  // Fields with steps are pictures with steps; levels and hits aren't in between.
  // The rays of several components note nothing for their neighbours, nor do they know of gradients
  // between them; masks end without a warning.
  const bool smooth = RunFromBegin(request) && variant.Components == 1 &&
    !variant.GradientOpacity && !variant.Plane && !variant.Masked && !variant.ClippedGradient &&
    !request.Nearest && !request.ShowLevel && !request.ShowSamples && !request.HitOpacity &&
    request.Tolerance > 0 && request.Blend.Kind == BlendKind::Composite;
  return smooth && view.IsNative()
    ? FirstLatticeStage(parameters, intervals, limits, request.LatticeStages)
    : 0;
}
} // namespace

namespace
{
// Of a frame and of one stretch more.
FrameStatistics Together(const FrameStatistics& before, FrameStatistics stretch)
{
  stretch.Converged = stretch.Converged && before.Converged;
  stretch.TimedOut = stretch.TimedOut || before.TimedOut;
  stretch.Aborted = stretch.Aborted || before.Aborted;
  stretch.Tolerance = std::max(stretch.Tolerance, before.Tolerance);
  stretch.Passes += before.Passes;
  stretch.Samples += before.Samples;
  stretch.EvaluatedSamples += before.EvaluatedSamples;
  stretch.ContributingSamples += before.ContributingSamples;
  stretch.Gradients += before.Gradients;
  stretch.Visits += before.Visits;
  return stretch;
}
} // namespace

Status VolumeEngine::Render(const FrameRequest& request)
{
  const FrameStatistics before = this->Frame;
  const Status status = this->Draw(request);
  if (request.Final.PropColor)
  {
    this->Frame = before; // what tells which prop a pixel belongs to is no frame
  }
  else if (request.Continues)
  {
    this->Frame = Together(before, this->Frame);
  }
  return status;
}

Result<ViewState*> VolumeEngine::PrepareView(const FrameRequest& request)
{
  if (Status status = this->Prepare(request); !status)
  {
    return status;
  }
  std::unique_ptr<ViewState>& view = this->Views[request.View];
  if (!view)
  {
    view = std::make_unique<ViewState>();
  }
  if (!view->Resize(this->Memory_, request.Camera.Width, request.Camera.Height, this->Plan_,
        request.ErrorEstimate || request.ShowSamples, request.HitOpacity.has_value(),
        request.IsStretch, this->HasLengths(request)))
  {
    view->Release();
    return Status(StatusCode::ResourceExhausted,
      "The driver can't allocate the ray state of a picture of " +
        std::to_string(request.Camera.Width) + " x " + std::to_string(request.Camera.Height) +
        " pixels.");
  }
  view->CountsSamples = request.ShowSamples;
  return view.get();
}

Result<GLuint> VolumeEngine::PrepareStretch(const FrameRequest& request)
{
  const GLStateGuard guard;
  Result<ViewState*> view = this->PrepareView(request);
  if (!view)
  {
    return view.GetStatus();
  }
  return view.Value()->Peel.Id();
}

GLuint VolumeEngine::StretchColors(const void* view, bool keep)
{
  const auto found = this->Views.find(view);
  if (found == this->Views.end() || !found->second->HasPeels())
  {
    return 0;
  }
  ViewState& state = *found->second;
  const GLStateGuard guard;
  RayMarcher::UpdateColor(state);
  if (keep)
  {
    glCopyImageSubData(state.Color.Id(), GL_TEXTURE_2D, 0, 0, 0, 0, state.Peel.Id(), GL_TEXTURE_2D,
      0, 0, 0, 0, state.Width(), state.Height(), 1);
    return state.Peel.Id();
  }
  return state.Color.Id();
}

Status VolumeEngine::Draw(const FrameRequest& request)
{
  const std::uint64_t draws = this->Frame.Draws + 1;
  this->Frame = {};
  this->Frame.Draws = draws;
  this->Operations_ = 0;
  const GLStateGuard guard;
  this->RetryInTime(request);
  Result<ViewState*> prepared = this->PrepareView(request);
  if (!prepared)
  {
    return prepared.GetStatus();
  }
  ViewState* const view = prepared.Value();
  Result<ViewGeometry> geometry = ViewGeometry::Make(this->Source_->Info().Layout, request.Camera);
  if (!geometry)
  {
    return geometry.GetStatus();
  }
  if (!request.Continues)
  {
    this->Pace.Begin();
  }
  if (request.Converge)
  {
    this->Pace.Tighten();
  }
  MarchParameters& parameters = geometry.Value().Parameters;
  this->FillParameters(request, parameters);
  this->Frame.Tolerance = request.Tolerance * this->Pace.Looseness();
  this->EstimateStep = parameters.Step;
  this->EstimateKnown =
    (request.Tolerance > 0 || request.Nearest) && request.Blend.Kind == BlendKind::Composite;
  std::vector<MarchParameters::Vec> lights;
  if (request.Shade && !request.Lights.empty())
  {
    lights = MakeLightTable(request.Lights, request.Camera.ViewFromWorld, geometry.Value().Rays,
      request.Camera.Width, request.Camera.Height);
    parameters.Normal = geometry.Value().ViewNormal;
  }
  const std::vector<std::uint8_t> hidden = FindHidden(request, parameters.Step[2]);
  const bool isCertain = hidden.empty() || request.ConfirmedInFront;
  geometry.Value().Intervals.HasDepth = request.UseDepth || request.Depths || !hidden.empty();
  geometry.Value().Intervals.Far = std::min(geometry.Value().Intervals.Far,
    static_cast<float>(request.EndDepth - geometry.Value().DepthOrigin));
  std::array<int, 4>& rectangle = geometry.Value().Intervals.Rectangle;
  for (std::size_t a = 0; a < 2; ++a)
  {
    rectangle[a] = std::max(rectangle[a], request.Rectangle[a]);
    rectangle[2 + a] = std::min(rectangle[2 + a], request.Rectangle[2 + a]);
  }
  view->Geometry = request.HitOpacity ? std::make_shared<ViewGeometry>(geometry.Value()) : nullptr;
  // Nobody knows how wrong a guess is; by more than 1 no picture is.
  const bool mayGuess = this->Pace.MayGuess() || request.Tolerance >= 1;
  const LatticeLimits limits = mayGuess && !request.ErrorEstimate
    ? GuessedLattice()
    : LatticeLimitsOf(request.Tolerance, this->Pace.Looseness());
  const ShaderVariant variant = this->VariantOf(request, this->Atlas->Format());
  if (variant.ClippedGradient)
  {
    SetClipped(parameters, std::ldexp(*request.ClippedIntensity, -this->Exponent),
      this->Source_->Info().Range, geometry.Value().VoxelPlanes);
  }
  const RayMarcher::LatticeOptions lattice{
    FirstStageOf(request, variant, parameters, geometry.Value().Intervals, limits, *view), limits
  };
  const PictureKey key{ parameters, geometry.Value().Intervals, this->FunctionVersion,
    variant.Key(), geometry.Value().Planes, lights, request.SliceDepths, lattice.Stage };
  if (this->IsStillThere(request, *view, key, hidden))
  {
    this->Frame.Converged = isCertain;
    return this->Show(request, *view);
  }
  view->Complete.reset();
  view->Frames.reset();
  view->Gathered.reset();
  this->Ahead->Cancel();
  if (request.Converge)
  {
    this->Ahead->EndWithin(PatienceAtTheEnd);
  }
  if (request.RecordBricks || request.ShowFrames)
  {
    this->Met.clear();
  }
  if (request.Converge)
  {
    this->Residency_->SetPinned({});
  }
  else
  {
    this->PinCoarsest(request.Camera.Block);
  }
  this->Marcher->SetLights(std::move(lights));
  const double start = Now();
  std::vector<float> slice;
  if (request.Blend.Kind == BlendKind::Slice)
  {
    slice.assign(static_cast<std::size_t>(view->Width()) * static_cast<std::size_t>(view->Height()),
      std::numeric_limits<float>::quiet_NaN());
    for (std::size_t i = 0; request.SliceDepths && i < slice.size(); ++i)
    {
      slice[i] = static_cast<float>((*request.SliceDepths)[i] - geometry.Value().DepthOrigin);
    }
  }
  Status status = this->Marcher->Begin(*view, parameters, geometry.Value().Intervals,
    geometry.Value().Planes, slice, request.Depths ? request.Depths->Begin : std::vector<float>(),
    lattice, NewRay(request.Blend.Kind, this->Source_->Info().Components));
  if (status)
  {
    status = this->RunPasses(request, *view, parameters, geometry.Value().Order);
  }
  view->Native.FillDeferred();
  if (status && this->Frame.Converged)
  {
    if (RunFromBegin(request))
    {
      view->Complete = key;
    }
    this->StartReadAhead(request, geometry.Value().Order);
  }
  if (!request.Converge && request.TimeBudget > 0)
  {
    this->Pace.Spend(Now() - start, request.TimeBudget);
  }
  // Complete as far as rays were cast; whether that is all is for others to say.
  this->Frame.Converged = this->Frame.Converged && isCertain;
  if (status && Gathers(request))
  {
    view->Gathered = { parameters, variant.Blend, variant.Components, variant.Dependent,
      RayMarcher::ReadGathered(*view, GatheredChannels(variant.Blend, variant.Components)) };
  }
  if (status && request.Blend.Kind != BlendKind::Composite)
  {
    status = this->Marcher->Resolve(*view, parameters, variant);
  }
  if (status && request.ShowSamples)
  {
    RayMarcher::ShowSamples(*view);
  }
  if (request.ShowFrames)
  {
    view->Frames = BrickFrames(
      this->Source_->Info().Layout, request.Camera, { this->Met.begin(), this->Met.end() });
  }
  if (status)
  {
    status = this->Show(request, *view);
  }
  return status;
}

void VolumeEngine::ReleaseGraphics()
{
  this->KeepCounters();
  this->Views.clear();
  this->Atlas.reset();
  this->Residency_.reset();
  EndOrLeave(std::move(this->Directory));
  this->Table.reset();
  this->Marcher.reset();
  this->Plan_ = {};
}

void VolumeEngine::AbandonGraphics()
{
  const LostContext lost;
  this->ReleaseGraphics();
}

void VolumeEngine::KeepViews(const std::set<const void*>& views)
{
  for (auto at = this->Views.begin(); at != this->Views.end();)
  {
    at = views.count(at->first) != 0 ? std::next(at) : this->Views.erase(at);
  }
}

void VolumeEngine::RetryFailed()
{
  if (this->Residency_)
  {
    this->Residency_->RetryFailed();
  }
}

std::vector<LoadResult> VolumeEngine::TakeFailures()
{
  return std::exchange(this->Failures, {});
}

std::uint64_t VolumeEngine::BytesUploaded() const
{
  return this->BytesUploadedBefore + (this->Atlas ? this->Atlas->BytesUploaded() : 0);
}

std::uint64_t VolumeEngine::PageTableBytesUploaded() const
{
  return this->TableBytesBefore + (this->Atlas ? this->Atlas->PageTableBytesUploaded() : 0);
}

std::uint64_t VolumeEngine::BytesRead() const
{
  return this->Source_ ? this->Source_->BytesRead() : 0;
}

std::size_t VolumeEngine::FailedBricks() const
{
  return this->Table ? this->Table->NumberOfFailed() : 0;
}

std::size_t VolumeEngine::FailedPageBlocks() const
{
  return this->Residency_ ? this->Residency_->NumberOfFailedBlocks() : 0;
}

std::uint64_t VolumeEngine::HostMemoryUsed() const
{
  const std::uint64_t cache = this->Cache
    ? this->Cache->GetCounters().BytesUsed + this->Cache->GetCounters().BytesReserved
    : 0;
  return cache + (this->Source_ ? this->Source_->MemoryUsed() : 0);
}

std::uint64_t VolumeEngine::PeakHostMemoryUsed() const
{
  return (this->Cache ? this->Cache->GetCounters().PeakBytes : 0) +
    (this->Source_ ? this->Source_->MemoryUsed() : 0);
}

std::uint64_t VolumeEngine::AddressingBytes() const
{
  return this->Atlas ? this->Plan_.AddressingBytes() : 0;
}

std::string VolumeEngine::CheckInvariants() const
{
  return this->Residency_ ? this->Residency_->CheckInvariants() : std::string();
}

} // namespace teravox
