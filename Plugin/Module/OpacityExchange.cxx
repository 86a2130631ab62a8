// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "OpacityExchange.h"

#include "ProcessShare.h"
#include "vtkCallbackCommand.h"
#include "vtkCamera.h"
#include "vtkCommand.h"
#include "vtkFloatArray.h"
#include "vtkMatrix4x4.h"
#include "vtkMultiProcessController.h"
#include "vtkNew.h"
#include "vtkOutOfCoreVolumeMapper.h"
#include "vtkPVRenderView.h"
#include "vtkProp3D.h"
#include "vtkRenderWindow.h"
#include "vtkRenderer.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace
{
// Whether a mapper draws between two points of time.
class DrawWatch
{
public:
  explicit DrawWatch(vtkOutOfCoreVolumeMapper* mapper)
    : Mapper(mapper)
  {
    this->Command->SetClientData(&this->Drawn);
    this->Command->SetCallback(
      [](vtkObject*, unsigned long, void* drawn, void*) { *static_cast<bool*>(drawn) = true; });
    this->Tag = mapper->AddObserver(vtkCommand::VolumeMapperRenderEndEvent, this->Command);
  }
  ~DrawWatch() { this->Mapper->RemoveObserver(this->Tag); }
  DrawWatch(const DrawWatch&) = delete;
  DrawWatch& operator=(const DrawWatch&) = delete;

  bool HasDrawn() const { return this->Drawn; }

private:
  vtkOutOfCoreVolumeMapper* Mapper;
  vtkNew<vtkCallbackCommand> Command;
  unsigned long Tag = 0;
  bool Drawn = false;
};

// The first process's camera for all of them: the others learn of it with the frame only.
// Collective.
void ShareCamera(vtkMultiProcessController* controller, vtkCamera* camera)
{
  constexpr vtkIdType count = 16;
  std::array<double, count> words{};
  camera->GetPosition(words.data());
  camera->GetFocalPoint(words.data() + 3);
  camera->GetViewUp(words.data() + 6);
  camera->GetClippingRange(words.data() + 9);
  camera->GetWindowCenter(words.data() + 11);
  words[13] = camera->GetViewAngle();
  words[14] = camera->GetParallelScale();
  words[15] = camera->GetParallelProjection();
  controller->Broadcast(words.data(), count, 0);
  if (controller->GetLocalProcessId() != 0)
  {
    camera->SetPosition(words.data());
    camera->SetFocalPoint(words.data() + 3);
    camera->SetViewUp(words.data() + 6);
    camera->SetClippingRange(words.data() + 9);
    camera->SetWindowCenter(words[11], words[12]);
    camera->SetViewAngle(words[13]);
    camera->SetParallelScale(words[14]);
    camera->SetParallelProjection(words[15] != 0);
  }
}

// Whether views are the same but for rounding: processes compute their cameras each in its own way.
template <typename View>
bool IsSameView(const View& a, const View& b)
{
  for (std::size_t first = 0; first < 32; first += 16)
  {
    double largest = 0;
    double difference = 0;
    for (std::size_t i = first; i < first + 16; ++i)
    {
      largest = std::max(largest, std::abs(a[i]));
      difference = std::max(difference, std::abs(a[i] - b[i]));
    }
    if (!(difference <= 1e-10 * largest))
    {
      return false;
    }
  }
  return a[32] == b[32] && a[33] == b[33];
}

// The tiles of all processes, one after the other, 0 of those that have none or another number.
// Collective.
void GatherTiles(vtkMultiProcessController* controller, vtkFloatArray* mine, vtkFloatArray* ofAll)
{
  const int processes = controller->GetNumberOfProcesses();
  const vtkIdType own = mine->GetNumberOfValues();
  std::vector<vtkIdType> counts(static_cast<std::size_t>(processes));
  controller->AllGather(&own, counts.data(), 1);
  const vtkIdType tiles = *std::max_element(counts.begin(), counts.end());
  if (own != tiles)
  {
    mine->SetNumberOfValues(tiles);
    mine->FillValue(0);
  }
  ofAll->SetNumberOfComponents(1);
  ofAll->SetNumberOfTuples(tiles * processes);
  if (tiles > 0)
  {
    controller->AllGather(mine->GetPointer(0), ofAll->GetPointer(0), tiles);
  }
}
} // namespace

OpacityExchange::View OpacityExchange::ViewOf(vtkPVRenderView* view)
{
  vtkRenderer* renderer = view->GetRenderer();
  vtkCamera* camera = renderer->GetActiveCamera();
  View now{};
  std::copy_n(camera->GetModelViewTransformMatrix()->GetData(), 16, now.begin());
  std::copy_n(
    camera->GetProjectionTransformMatrix(renderer->GetTiledAspectRatio(), -1, 1)->GetData(), 16,
    now.begin() + 16);
  const int* size = view->GetRenderWindow()->GetSize();
  now[32] = size[0];
  now[33] = size[1];
  return now;
}

void OpacityExchange::Before(vtkPVRenderView* view, ProcessShare& share, vtkProp3D* prop,
  vtkOutOfCoreVolumeMapper* mapper, bool willing)
{
  auto* controller = vtkMultiProcessController::GetGlobalController();
  const int processes = controller ? controller->GetNumberOfProcesses() : 1;
  // Each of these is the same on all processes that come here.
  if (processes == 1 || !view || !share.IsDivided() || !view->GetUseDistributedRenderingForRender())
  {
    mapper->SuspectHidden(nullptr);
    this->Confirmed.reset();
    return;
  }
  ShareCamera(controller, view->GetRenderer()->GetActiveCamera());
  const View before = ViewOf(view);
  const vtkMTimeType changed = std::max(mapper->GetMTime(), prop->GetRedrawMTime());
  const bool asBefore =
    this->Confirmed == before && this->Changed == changed && mapper->IsConverged();
  const std::array<int, 2> mine{ willing ? 1 : 0, asBefore ? 1 : 0 };
  std::vector<std::array<int, 2>> all(static_cast<std::size_t>(processes));
  controller->AllGather(mine.data(), all.front().data(), 2);
  const auto say = [&](std::size_t what)
  { return std::all_of(all.begin(), all.end(), [=](const auto& one) { return one[what] == 1; }); };
  if (say(0) && say(1))
  {
    return; // what was confirmed still is, or the mapper sees that it isn't
  }
  mapper->SuspectHidden(nullptr);
  this->Confirmed.reset();
  this->Changed = changed;
  this->Proven = false;
  if (!say(0))
  {
    return;
  }

  // By the last pictures.
  vtkNew<vtkFloatArray> tiles;
  vtkNew<vtkFloatArray> ofAll;
  vtkNew<vtkFloatArray> inFront;
  const int* extent = share.Extent();
  const bool draws = extent[0] <= extent[1];
  if (!draws || !mapper->GetOpacityTiles(tiles))
  {
    tiles->Initialize();
  }
  GatherTiles(controller, tiles, ofAll);
  if (ofAll->GetNumberOfValues() == 0)
  {
    return; // the first picture, on all processes
  }
  const bool suspects = draws && share.OpacityInFront(view->GetRenderer(), prop, ofAll, inFront);
  if (suspects)
  {
    mapper->SuspectHidden(inFront);
  }
  bool complete = false;
  {
    const DrawWatch watch(mapper);
    view->GetRenderWindow()->Render();
    complete = draws && watch.HasDrawn() && mapper->GetNumberOfMissingBricks() == 0 &&
      mapper->GetNumberOfFailedBricks() == 0;
  }

  // By those of this view.
  const View now = ViewOf(view);
  tiles->Initialize();
  if (!complete || !mapper->GetOpacityTiles(tiles))
  {
    tiles->Initialize();
  }
  GatherTiles(controller, tiles, ofAll);
  std::vector<View> views(static_cast<std::size_t>(processes));
  controller->AllGather(now.data(), views.front().data(), static_cast<vtkIdType>(now.size()));
  const vtkIdType count = ofAll->GetNumberOfValues() / processes;
  for (int process = 0; process < processes; ++process)
  {
    if (!IsSameView(views[static_cast<std::size_t>(process)], now))
    {
      std::fill_n(ofAll->GetPointer(0) + process * count, count, 0.0f);
    }
  }
  if (suspects && complete && count > 0 &&
    share.OpacityInFront(view->GetRenderer(), prop, ofAll, inFront) &&
    mapper->ConfirmHidden(inFront))
  {
    this->Confirmed = now;
    // As much in front as ends a ray: only that leaves anything out.
    const float least = static_cast<float>(1 - 0.25 * mapper->GetImageErrorTolerance());
    const float* first = inFront->GetPointer(0);
    this->Proven = std::any_of(
      first, first + inFront->GetNumberOfValues(), [=](float one) { return one >= least; });
    return;
  }
  mapper->SuspectHidden(nullptr);
  this->Confirmed = now;
}
