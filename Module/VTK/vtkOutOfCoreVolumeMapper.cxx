// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "vtkOutOfCoreVolumeMapper.h"

#include "BlockPictures.h"
#include "MapperInternals.h"
#include "MapperScene.h"
#include "PropertyFunctions.h"
#include "RefinementBoard.h"
#include "SharedBudgets.h"
#include "VolumePick.h"
#include "VolumePlace.h"
#include "VoxelIds.h"
#include "vtkBlockSplit.h"
#include "vtkBrickSource.h"
#include "vtkCallbackCommand.h"
#include "vtkCommand.h"
#include "vtkDataArray.h"
#include "vtkFloatArray.h"
#include "vtkHardwareSelector.h"
#include "vtkImageData.h"
#include "vtkMultiVolume.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkOpenGLRenderWindow.h"
#include "vtkPointData.h"
#include "vtkRenderWindow.h"
#include "vtkRenderer.h"
#include "vtkRendererCollection.h"
#include "vtkTrivialProducer.h"
#include "vtkVolume.h"
#include "vtkVolumeProperty.h"
#include "vtkWeakPointer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <thread>

#if defined(__unix__)
#include <unistd.h>
#endif

using teravox::Drawn;
using teravox::Int3;
using teravox::SharedBudgets;

namespace
{
// Of NVIDIA's and AMD's memory extensions; kibibytes of dedicated memory.
constexpr GLenum DedicatedVideoMemory = 0x9047;
constexpr GLenum TextureFreeMemory = 0x87FC;
constexpr vtkTypeInt64 DefaultMaxMemoryInBytes = vtkTypeInt64{ 128 } << 20;

std::uint64_t MainMemory()
{
#if defined(__unix__)
  const long pages = sysconf(_SC_PHYS_PAGES);
  const long size = sysconf(_SC_PAGE_SIZE);
  if (pages > 0 && size > 0)
  {
    return static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(size);
  }
#endif
  return std::uint64_t{ 4 } << 30;
}

double Now()
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

} // namespace

vtkStandardNewMacro(vtkOutOfCoreVolumeMapper);

vtkOutOfCoreVolumeMapper::vtkOutOfCoreVolumeMapper()
  : Internals(std::make_unique<vtkInternals>())
{
  this->Internals->WindowGoes->SetClientData(this);
  this->Internals->WindowGoes->SetCallback(
    [](vtkObject* window, unsigned long, void* mapper, void*)
    {
      static_cast<vtkOutOfCoreVolumeMapper*>(mapper)->ReleaseGraphicsResources(
        vtkWindow::SafeDownCast(window));
    });
  this->Internals->FrameEnds->SetClientData(this);
  this->Internals->FrameEnds->SetCallback(
    [](vtkObject*, unsigned long, void* mapper, void*)
    {
      auto* self = static_cast<vtkOutOfCoreVolumeMapper*>(mapper);
      self->Internals->FinishFrame(self);
    });
  this->NumberOfLoaderThreads =
    static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1u, 8u));
}

vtkOutOfCoreVolumeMapper::~vtkOutOfCoreVolumeMapper()
{
  if (this->Internals->FrameOf)
  {
    this->Internals->FrameOf->RemoveObserver(this->Internals->FrameTag);
  }
  if (this->Internals->Window)
  {
    this->vtkOutOfCoreVolumeMapper::ReleaseGraphicsResources(this->Internals->Window);
  }
  SharedBudgets::All().Remove(this);
}

void vtkOutOfCoreVolumeMapper::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "GPUMemoryBudget: " << this->GPUMemoryBudget << "\n"
     << indent << "HostMemoryBudget: " << this->HostMemoryBudget << "\n"
     << indent << "FrameTimeBudget: " << this->FrameTimeBudget << "\n"
     << indent << "ImageErrorTolerance: " << this->ImageErrorTolerance << "\n"
     << indent << "LevelOfDetailBias: " << this->LevelOfDetailBias << "\n"
     << indent << "MinimumLevel: " << this->MinimumLevel << "\n"
     << indent << "MaximumLevel: " << this->MaximumLevel << "\n"
     << indent << "EmptySpaceSkipping: " << this->EmptySpaceSkipping << "\n"
     << indent << "PictureReuse: " << this->PictureReuse << "\n"
     << indent << "NumberOfLoaderThreads: " << this->NumberOfLoaderThreads << "\n"
     << indent << "BrickSize: " << this->BrickSize << "\n"
     << indent << "MaximumNumberOfSlots: " << this->MaximumNumberOfSlots << "\n"
     << indent << "Marcher: " << this->Marcher << "\n"
     << indent << "ArrivalShuffleSeed: " << this->ArrivalShuffleSeed << "\n"
     << indent << "ConvergeTimeout: " << this->ConvergeTimeout << "\n"
     << indent << "FailureRetryInterval: " << this->FailureRetryInterval << "\n"
     << indent << "CountSamples: " << this->CountSamples << "\n"
     << indent << "DebugView: " << this->DebugView << "\n"
     << indent << "ErrorEstimate: " << this->ErrorEstimate << "\n"
     << indent << "VectorMode: " << this->VectorMode << "\n"
     << indent << "VectorComponent: " << this->VectorComponent << "\n"
     << indent << "Block: " << this->Block << "\n"
     << indent << "BlockExtent:";
  for (const int end : this->BlockExtent)
  {
    os << " " << end;
  }
  os << "\n"
     << indent << "RecordBricks: " << this->RecordBricks << "\n"
     << indent << "WarnOfSampling: " << this->WarnOfSampling << "\n"
     << indent << "PickPosition: " << this->PickPosition[0] << " " << this->PickPosition[1] << " "
     << this->PickPosition[2] << "\n"
     << indent << "PickLevel: " << this->PickLevel << "\n"
     << indent << "PickValue: " << this->PickValue << "\n"
     << indent << "BrickSource: " << this->Internals->Explicit << "\n"
     << indent << "Converged: " << (this->IsConverged() ? "yes" : "no") << "\n";
}

void vtkOutOfCoreVolumeMapper::SetBrickSource(vtkBrickSource* source)
{
  vtkInternals& in = *this->Internals;
  if (in.Explicit == source)
  {
    return;
  }
  in.Explicit = source;
  if (in.UsesStandIn)
  {
    this->SetInputConnection(nullptr);
    in.StandIn = nullptr;
    in.UsesStandIn = false;
  }
  if (source && source->GetBrickSource() && this->GetNumberOfInputConnections(0) == 0)
  {
    // Two points per axis with the bounds of the volume and the ends of its range.
    const teravox::VolumeInfo& info = source->GetBrickSource()->Info();
    vtkNew<vtkImageData> image;
    image->SetDimensions(2, 2, 2);
    double bounds[6];
    this->GetBounds(bounds);
    image->SetOrigin(bounds[0], bounds[2], bounds[4]);
    image->SetSpacing(bounds[1] - bounds[0], bounds[3] - bounds[2], bounds[5] - bounds[4]);
    vtkNew<vtkFloatArray> scalars;
    scalars->SetName(info.ArrayName.c_str());
    scalars->SetNumberOfTuples(8);
    const bool known = info.Range.IsKnown() && !info.Range.IsVoid();
    scalars->FillValue(static_cast<float>(known ? info.Range.Min : 0));
    scalars->SetValue(7, static_cast<float>(known ? info.Range.Max : 1));
    image->GetPointData()->SetScalars(scalars);
    in.StandIn = vtkSmartPointer<vtkTrivialProducer>::New();
    in.StandIn->SetOutput(image);
    this->SetInputConnection(in.StandIn->GetOutputPort());
    in.UsesStandIn = true;
  }
  this->Modified();
}

vtkBrickSource* vtkOutOfCoreVolumeMapper::GetBrickSource()
{
  return this->Internals->Explicit;
}

double* vtkOutOfCoreVolumeMapper::GetBounds()
{
  vtkInternals& in = *this->Internals;
  std::string error;
  vtkImageData* image = nullptr;
  vtkDataArray* scalars = nullptr;
  int cellFlag = 0;
  if (!in.Explicit)
  {
    if (this->GetNumberOfInputConnections(0) == 0)
    {
      vtkMath::UninitializeBounds(this->Bounds);
      return this->Bounds;
    }
    this->Update();
    image = vtkImageData::SafeDownCast(this->GetInputDataObject(0, 0));
    scalars = image ? vtkAbstractMapper::GetScalars(image, this->ScalarMode, this->ArrayAccessMode,
                        this->ArrayId, this->ArrayName, cellFlag)
                    : nullptr;
    vtkBrickSource* holder = scalars ? vtkBrickSource::Get(scalars) : nullptr;
    if (!holder || !holder->GetBrickSource())
    {
      return this->Superclass::GetBounds();
    }
  }
  const Drawn drawn = teravox::FindDrawn(
    in.Explicit, image, scalars, cellFlag, [](std::string&) { return nullptr; }, error);
  if (!drawn.Source)
  {
    vtkMath::UninitializeBounds(this->Bounds);
    return this->Bounds;
  }
  const Int3& n = drawn.Source->Info().Layout.Dimensions(0);
  const double inset = drawn.CellData ? 0.0 : 0.5;
  teravox::BoundsOf(drawn.DatasetFromVoxel, { inset, inset, inset },
    { static_cast<double>(n[0]) - inset, static_cast<double>(n[1]) - inset,
      static_cast<double>(n[2]) - inset },
    this->Bounds);
  return this->Bounds;
}

int vtkOutOfCoreVolumeMapper::IsRenderSupported(vtkRenderWindow* window, vtkVolumeProperty*)
{
  auto* gl = vtkOpenGLRenderWindow::SafeDownCast(window);
  if (!gl)
  {
    return 0;
  }
  gl->MakeCurrent();
  GLint major = 0;
  GLint minor = 0;
  glGetIntegerv(GL_MAJOR_VERSION, &major);
  glGetIntegerv(GL_MINOR_VERSION, &minor);
  return major > teravox::MinimumGLMajor ||
    (major == teravox::MinimumGLMajor && minor >= teravox::MinimumGLMinor);
}

void vtkOutOfCoreVolumeMapper::GetReductionRatio(double ratio[3])
{
  ratio[0] = ratio[1] = ratio[2] = 1;
}

void vtkOutOfCoreVolumeMapper::ReleaseGraphicsResources(vtkWindow* window)
{
  vtkInternals& in = *this->Internals;
  if (!window || window != in.Window)
  {
    return;
  }
  in.Window->MakeCurrent();
  const bool isThere =
    in.Window->GetContextCreationTime() == in.ContextTime && in.Window->IsCurrent();
  in.ForEachVolume(
    [isThere](teravox::MapperVolume& v)
    {
      if (isThere)
      {
        v.Engine.ReleaseGraphics();
      }
      else
      {
        v.Engine.AbandonGraphics();
      }
    });
  in.Mixer.Clear();
  in.Window->RemoveObserver(in.WindowTag);
  in.Window = nullptr;
  SharedBudgets::All().Remove(this);
  in.LastView = nullptr;
  in.LastRenderer = nullptr;
  in.Shown_.clear();
  in.Together.clear();
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetEffectiveGPUMemoryBudget()
{
  if (this->GPUMemoryBudget != 0)
  {
    return this->GPUMemoryBudget;
  }
  // VTK's own default of 128 MiB says nothing about the machine; what a user set does.
  if (this->MaxMemoryInBytes > 0 && this->MaxMemoryInBytes != DefaultMaxMemoryInBytes)
  {
    return static_cast<vtkTypeUInt64>(
      static_cast<double>(this->MaxMemoryInBytes) * static_cast<double>(this->MaxMemoryFraction));
  }
  constexpr vtkTypeUInt64 unknown = vtkTypeUInt64{ 1 } << 30;
  const auto shared = [this](vtkTypeUInt64 bytes) {
    return vtkTypeUInt64{ SharedBudgets::All().ShareOf(this, bytes, &SharedBudgets::Needs::GPU) };
  };
  if (!this->Internals->Window)
  {
    return shared(unknown);
  }
  this->Internals->Window->MakeCurrent();
  if (teravox::IsSoftwareRenderer())
  {
    return shared(MainMemory() / 4);
  }
  GLint kibibytes[4] = { 0, 0, 0, 0 };
  while (glGetError() != GL_NO_ERROR)
  {
  }
  glGetIntegerv(DedicatedVideoMemory, kibibytes);
  if (glGetError() != GL_NO_ERROR || kibibytes[0] <= 0)
  {
    glGetIntegerv(TextureFreeMemory, kibibytes);
    if (glGetError() != GL_NO_ERROR)
    {
      kibibytes[0] = 0;
    }
  }
  return shared(
    kibibytes[0] > 0 ? static_cast<vtkTypeUInt64>(kibibytes[0]) * 1024 / 4 * 3 : unknown);
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetEffectiveHostMemoryBudget()
{
  return this->HostMemoryBudget != 0
    ? this->HostMemoryBudget
    : SharedBudgets::All().ShareOf(this, MainMemory() / 4, &SharedBudgets::Needs::Host);
}

namespace
{
// A pass of hardware selection that asks for the numbers of points or cells, in two parts.
struct IdPass
{
  teravox::VoxelIdKind Kind;
  int Shift;
};

std::optional<IdPass> IdPassOf(vtkHardwareSelector* selector)
{
  switch (selector ? selector->GetCurrentPass() : vtkHardwareSelector::ACTOR_PASS)
  {
    case vtkHardwareSelector::POINT_ID_LOW24:
      return IdPass{ teravox::VoxelIdKind::Points, 0 };
    case vtkHardwareSelector::POINT_ID_HIGH24:
      return IdPass{ teravox::VoxelIdKind::Points, 24 };
    case vtkHardwareSelector::CELL_ID_LOW24:
      return IdPass{ teravox::VoxelIdKind::Cells, 0 };
    case vtkHardwareSelector::CELL_ID_HIGH24:
      return IdPass{ teravox::VoxelIdKind::Cells, 24 };
    default:
      return std::nullopt;
  }
}
} // namespace

void vtkOutOfCoreVolumeMapper::vtkInternals::Fail(
  vtkOutOfCoreVolumeMapper* mapper, const std::string& message)
{
  if (this->LastError != message)
  {
    this->LastError = message;
    vtkErrorWithObjectMacro(mapper, << message);
  }
}

void vtkOutOfCoreVolumeMapper::vtkInternals::WarnOnce(
  vtkOutOfCoreVolumeMapper* mapper, const std::string& key, const std::string& message)
{
  if (this->Warned.insert(key).second)
  {
    vtkWarningWithObjectMacro(mapper, << message);
  }
}

void vtkOutOfCoreVolumeMapper::vtkInternals::ReportFailures(
  vtkOutOfCoreVolumeMapper* mapper, teravox::VolumeEngine& engine, const std::string& name)
{
  for (const teravox::LoadResult& failure : engine.TakeFailures())
  {
    const std::string text =
      name + ", " + failure.Key.ToString() + ": " + failure.Outcome.Message();
    if (this->ReportedFailures.empty())
    {
      vtkErrorWithObjectMacro(
        mapper, << "A brick can't be read and is drawn from a coarser level. " << text);
    }
    if (this->ReportedFailures.insert(text).second)
    {
      mapper->InvokeEvent(BrickFailedEvent, const_cast<char*>(text.c_str()));
    }
  }
}

void vtkOutOfCoreVolumeMapper::vtkInternals::KeepRenderers(
  vtkRenderWindow* window, vtkRenderer* drawing)
{
  std::set<const void*> views;
  const auto keep = [&views](vtkRenderer* ren, bool stereo)
  {
    for (const bool rightEye : { false, true })
    {
      if (stereo || !rightEye)
      {
        views.insert({ ViewOf(ren, rightEye), ScratchOf(ViewOf(ren, rightEye)) });
      }
    }
  };
  keep(drawing, true);
  vtkCollectionSimpleIterator it = nullptr;
  window->GetRenderers()->InitTraversal(it);
  while (vtkRenderer* ren = window->GetRenderers()->GetNextRenderer(it))
  {
    keep(ren, window->GetStereoRender() != 0);
  }
  this->ForEachVolume([&](teravox::MapperVolume& v) { v.Engine.KeepViews(views); });
  this->Mixer.KeepViews(views);
  for (auto at = this->Shown_.begin(); at != this->Shown_.end();)
  {
    at = views.count(at->first) != 0 ? std::next(at) : this->Shown_.erase(at);
  }
  for (auto at = this->Together.begin(); at != this->Together.end();)
  {
    at = views.count(at->first) != 0 ? std::next(at) : this->Together.erase(at);
  }
}

// Of volumes beside the first, those of these ports.
void vtkOutOfCoreVolumeMapper::vtkInternals::KeepVolumes(const std::set<int>& ports)
{
  for (auto at = this->Others.begin(); at != this->Others.end();)
  {
    if (ports.count(at->first) != 0)
    {
      ++at;
      continue;
    }
    if (this->Window)
    {
      this->Window->MakeCurrent();
      at->second->Engine.ReleaseGraphics();
    }
    at = this->Others.erase(at);
    this->Together.clear();
  }
  if (this->Others.empty())
  {
    this->Mixer.Clear();
    this->MixBytes = 0;
  }
}

// Makes the window's context the one that is drawn in.
void vtkOutOfCoreVolumeMapper::vtkInternals::Adopt(
  vtkOutOfCoreVolumeMapper* mapper, vtkOpenGLRenderWindow* window, vtkRenderer* drawing)
{
  window->MakeCurrent();
  if (this->Window &&
    (this->Window != window || this->ContextTime != window->GetContextCreationTime()))
  {
    mapper->ReleaseGraphicsResources(this->Window);
    window->MakeCurrent();
  }
  if (!this->Window)
  {
    this->Window = window;
    SharedBudgets::All().Add(mapper);
    this->WindowTag = window->AddObserver(vtkCommand::DeleteEvent, this->WindowGoes);
    this->ContextTime = window->GetContextCreationTime();
  }
  this->KeepRenderers(window, drawing);
}

void vtkOutOfCoreVolumeMapper::Render(vtkRenderer* ren, vtkVolume* vol)
{
  vtkInternals& in = *this->Internals;
  auto* window = vtkOpenGLRenderWindow::SafeDownCast(ren->GetRenderWindow());
  if (!window)
  {
    vtkErrorMacro("The renderer has no OpenGL render window.");
    return;
  }
  vtkHardwareSelector* selector = ren->GetSelector();
  const std::optional<IdPass> ids = IdPassOf(selector);
  if (selector && !ids && selector->GetCurrentPass() != vtkHardwareSelector::ACTOR_PASS)
  {
    return; // it asks for what volumes don't have
  }
  const double began = Now();
  if (auto* volumes = vtkMultiVolume::SafeDownCast(vol))
  {
    if (!ids)
    {
      in.RenderTogether(this, ren, volumes, began);
    }
    return;
  }
  in.KeepVolumes({});
  if (!selector)
  {
    this->InvokeEvent(vtkCommand::VolumeMapperRenderStartEvent, nullptr);
  }
  std::optional<teravox::MapperFrame> frame = in.Prepare(this, in, 0, ren, vol, vol);
  if (!frame)
  {
    return;
  }
  teravox::FrameRequest& request = frame->Request;
  const teravox::Drawn& drawn = frame->Drawn;
  if (ids)
  {
    const teravox::Int3& voxels = drawn.Source->Info().Layout.Dimensions(0);
    const std::int64_t count = teravox::NumberOfIds(voxels, drawn.CellData, ids->Kind);
    if (count >= std::int64_t{ 1 } << 48)
    {
      in.WarnOnce(this, "VoxelIds",
        "Hardware selection has 48 bits for the numbers of points and cells; this volume has more "
        "voxels, and is selected as a whole.");
      return;
    }
    selector->BeginRenderProp();
    ids->Kind == teravox::VoxelIdKind::Points ? selector->UpdateMaximumPointId(count)
                                              : selector->UpdateMaximumCellId(count);
    const auto hits =
      in.Engine.DrawHits(request, static_cast<double>(teravox::Composition().PropOpacity));
    if (hits)
    {
      in.Engine.PutPixels(
        request, teravox::EncodeIds(hits.Value(), request, voxels, ids->Kind, ids->Shift));
    }
    selector->EndRenderProp();
    if (!hits)
    {
      in.Fail(this, hits.GetStatus().Message());
    }
    return;
  }
  if (selector)
  {
    vtkInternals::BeginProp(selector, request);
  }
  vtkDualDepthPeelingPass* peeling = selector ? nullptr : teravox::DepthPeeling::PassOf(vol);
  if (this->Block && !selector && !peeling)
  {
    in.ChooseHidden(request, drawn.Source);
    if (request.Show && !teravox::AddsUpOpacity(request.Blend.Kind))
    {
      in.WarnOnce(this, "Block",
        "A block is drawn as if there was nothing else in this blend mode: pictures of "
        "blocks can't be blended. See GetGatheredImage().");
    }
  }
  const teravox::Status status = peeling
    ? in.Peeling.Draw(
        teravox::StretchPainter::Of(in.Engine, request.View), request, peeling, this, vol, window)
    : in.Engine.Render(request);
  if (peeling)
  {
    // Its targets begin at their lower left corner, wherever the viewport lies.
    int size[2];
    ren->GetTiledSizeAndOrigin(&size[0], &size[1], &request.X, &request.Y);
  }
  if (selector)
  {
    selector->EndRenderProp();
  }
  in.TellNeeds(this, { { &in.Engine, request, drawn.Source->Info().Layout.Dimensions(0) } });
  in.LastView = request.View;
  in.LastRenderer = ren;
  in.Together.erase(ren);
  in.Shown_[ren] = { request, in.FunctionVersion, drawn.Source, frame->Components,
    teravox::AreDependent(vol->GetProperty(), frame->Components) };
  in.ReportFailures(this, in.Engine, drawn.Source->Info().Name);
  if (in.IsDrawn(this, ren, status, in.Engine.LastFrame().TimedOut))
  {
    in.EndDrawing(this, ren, peeling != nullptr, began);
  }
}

// What the other mappers leave to this one depends on it.
void vtkOutOfCoreVolumeMapper::vtkInternals::TellNeeds(
  vtkOutOfCoreVolumeMapper* mapper, const std::vector<teravox::VolumeMixer::Part>& parts)
{
  constexpr std::uint64_t most = std::uint64_t{ 1 } << 50;
  SharedBudgets::Needs needs{ this->MixBytes, 0 };
  for (const teravox::VolumeMixer::Part& part : parts)
  {
    needs.GPU += part.Engine->GPUBytesForAll(part.Request, most);
    needs.Host += part.Engine->HostBytesForAll(most);
  }
  if (mapper->GPUMemoryBudget != 0)
  {
    needs.GPU = std::min<std::uint64_t>(needs.GPU, mapper->GPUMemoryBudget);
  }
  if (mapper->HostMemoryBudget != 0)
  {
    needs.Host = std::min<std::uint64_t>(needs.Host, mapper->HostMemoryBudget);
  }
  SharedBudgets::All().SetNeeds(mapper, needs);
}

// A picture in the colour that tells which prop it is.
void vtkOutOfCoreVolumeMapper::vtkInternals::BeginProp(
  vtkHardwareSelector* selector, teravox::FrameRequest& request)
{
  std::array<float, 3> color{};
  selector->BeginRenderProp();
  selector->GetPropColorValue(color.data());
  request.Final.PropColor = color;
  request.Show = true;
}

// What became of a frame, or of a part of it; whether there is more to say of it.
bool vtkOutOfCoreVolumeMapper::vtkInternals::IsDrawn(
  vtkOutOfCoreVolumeMapper* mapper, vtkRenderer* ren, const teravox::Status& status, bool timedOut)
{
  if (!status)
  {
    this->Fail(mapper, status.Message());
    return false;
  }
  this->LastError.clear();
  if (timedOut && !ren->GetSelector())
  {
    vtkWarningWithObjectMacro(mapper,
      << "The picture isn't complete: for " << mapper->ConvergeTimeout << " s no brick has come.");
  }
  return !ren->GetSelector();
}

void vtkOutOfCoreVolumeMapper::vtkInternals::EndDrawing(
  vtkOutOfCoreVolumeMapper* mapper, vtkRenderer* ren, bool isPeeling, double began)
{
  mapper->TimeToDraw = Now() - began;
  if (!isPeeling)
  {
    this->FinishFrame(mapper);
  }
  else if (this->Peeling.IsFirst() && this->FrameOf != ren)
  {
    if (this->FrameOf)
    {
      this->FrameOf->RemoveObserver(this->FrameTag);
    }
    this->FrameOf = ren;
    this->FrameTag = ren->AddObserver(vtkCommand::EndEvent, this->FrameEnds);
  }
  mapper->InvokeEvent(vtkCommand::VolumeMapperRenderEndEvent, nullptr);
}

// Tells who waits for it how complete the picture is.
void vtkOutOfCoreVolumeMapper::vtkInternals::FinishFrame(vtkOutOfCoreVolumeMapper* mapper)
{
  if (this->FrameOf)
  {
    this->FrameOf->RemoveObserver(this->FrameTag);
    this->FrameOf = nullptr;
  }
  const bool converged = this->IsConverged();
  if (this->FirstPicture == 0)
  {
    this->FirstPicture = Now() - this->SourceTime;
  }
  if (converged)
  {
    this->ReportedFailures.clear();
    if (this->ConvergedAfter == 0)
    {
      this->ConvergedAfter = Now() - this->SourceTime;
    }
    if (!this->WasConverged)
    {
      this->WasConverged = true;
      mapper->InvokeEvent(ConvergedEvent, nullptr);
    }
  }
  else
  {
    this->WasConverged = false;
  }
  const bool failed = this->Total(&teravox::VolumeEngine::FailedBricks) +
      this->Total(&teravox::VolumeEngine::FailedPageBlocks) >
    0;
  teravox::RefinementBoard::Post(this->Window,
    { converged, failed, this->FrameTotal(&teravox::FrameStatistics::MissingBricks),
      this->Total(&teravox::VolumeEngine::BricksLoaded) });
}

bool vtkOutOfCoreVolumeMapper::IsConverged()
{
  return this->Internals->IsConverged();
}

vtkIdType vtkOutOfCoreVolumeMapper::GetNumberOfMissingBricks()
{
  return static_cast<vtkIdType>(
    this->Internals->FrameTotal(&teravox::FrameStatistics::MissingBricks));
}

bool vtkOutOfCoreVolumeMapper::Converge(vtkRenderWindow* window, double timeout)
{
  const double until = Now() + timeout;
  do
  {
    window->Render();
  } while (!this->IsConverged() && this->GetNumberOfFailedBricks() == 0 &&
    this->GetNumberOfFailedPageBlocks() == 0 && Now() < until);
  return this->IsConverged();
}

bool vtkOutOfCoreVolumeMapper::WaitForReadAhead(double timeout)
{
  return this->Internals->Engine.WaitForReadAhead(timeout);
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfBricksReadAhead()
{
  return this->Internals->Total(&teravox::VolumeEngine::BricksReadAhead);
}

void vtkOutOfCoreVolumeMapper::RetryFailedBricks()
{
  this->Internals->ForEachVolume([](teravox::MapperVolume& v) { v.Engine.RetryFailed(); });
  this->Internals->ReportedFailures.clear();
  this->Modified();
}

vtkIdType vtkOutOfCoreVolumeMapper::AddBrickWeights(vtkBlockSplit* split, vtkDoubleArray* weights)
{
  const auto& met = this->Internals->Engine.BricksMet();
  split->AddWeights({ met.begin(), met.end() }, weights);
  return static_cast<vtkIdType>(met.size());
}

std::string vtkOutOfCoreVolumeMapper::CheckInvariants()
{
  std::string all;
  this->Internals->ForEachVolume(
    [&](teravox::MapperVolume& v) { all += v.Engine.CheckInvariants(); });
  return all;
}
