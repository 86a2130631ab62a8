// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// What vtkOutOfCoreVolumeMapper does of a vtkMultiVolume: several inputs, each with a volume that
// has its place and its property, in one picture and one budget.
#include "BudgetShares.h"
#include "DepthPeeling.h"
#include "MapperInternals.h"
#include "vtkAlgorithm.h"
#include "vtkAlgorithmOutput.h"
#include "vtkCommand.h"
#include "vtkDataSet.h"
#include "vtkHardwareSelector.h"
#include "vtkMultiVolume.h"
#include "vtkVolume.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

vtkDataSet* vtkOutOfCoreVolumeMapper::GetInput(int port)
{
  vtkDataSet* input = this->Superclass::GetInput(port);
  if (input && input->GetNumberOfPoints() == 0 && this->GetNumberOfInputConnections(port) > 0)
  {
    vtkAlgorithmOutput* from = this->GetInputConnection(port, 0);
    from->GetProducer()->Update(from->GetIndex());
    input = this->Superclass::GetInput(port);
  }
  return input;
}

namespace
{
// One budget for all: each volume has what it can use, or as much as any other. `mixing`: bytes of
// the GPU's that aren't divided.
void DivideBudgets(const std::vector<teravox::VolumeMixer::Part>& parts, std::uint64_t gpu,
  std::uint64_t host, std::uint64_t mixing)
{
  gpu -= std::min(gpu, mixing);
  std::vector<std::uint64_t> onGPU;
  std::vector<std::uint64_t> onHost;
  for (const teravox::VolumeMixer::Part& part : parts)
  {
    onGPU.push_back(part.Engine->GPUBytesForAll(part.Request, gpu));
    onHost.push_back(part.Engine->HostBytesForAll(host));
  }
  onGPU = teravox::DivideBudget(gpu, onGPU);
  onHost = teravox::DivideBudget(host, onHost);
  for (std::size_t i = 0; i < parts.size(); ++i)
  {
    parts[i].Engine->SetBudgets(onGPU[i], onHost[i]);
  }
}
} // namespace

void vtkOutOfCoreVolumeMapper::vtkInternals::RenderTogether(
  vtkOutOfCoreVolumeMapper* mapper, vtkRenderer* ren, vtkMultiVolume* volumes, double began)
{
  vtkHardwareSelector* selector = ren->GetSelector();
  vtkDualDepthPeelingPass* peeling = selector ? nullptr : teravox::DepthPeeling::PassOf(volumes);
  // A port counts if it has an input and a visible volume.
  std::set<int> ports;
  for (const int port : mapper->Ports)
  {
    const bool isInput = mapper->GetNumberOfInputConnections(port) > 0;
    vtkVolume* volume = isInput ? volumes->GetVolume(port) : nullptr;
    if (volume && volume->GetVisibility() != 0)
    {
      ports.insert(port);
    }
  }
  if (ports.empty())
  {
    return;
  }
  if (!selector)
  {
    mapper->InvokeEvent(vtkCommand::VolumeMapperRenderStartEvent, nullptr);
  }
  // Whichever comes first is drawn by the mapper's own engine.
  const int first = *ports.begin();
  std::set<int> others = ports;
  others.erase(first);
  this->KeepVolumes(others);
  for (const int port : others)
  {
    std::unique_ptr<teravox::MapperVolume>& other = this->Others[port];
    if (!other)
    {
      other = std::make_unique<teravox::MapperVolume>();
    }
  }
  int size[2];
  int origin[2];
  ren->GetTiledSizeAndOrigin(&size[0], &size[1], &origin[0], &origin[1]);

  std::vector<teravox::VolumeMixer::Part> parts;
  std::vector<std::string> names;
  std::vector<ShownTogether> shownParts;
  for (const int port : ports)
  {
    teravox::MapperVolume& own =
      port == first ? static_cast<teravox::MapperVolume&>(*this) : *this->Others.at(port);
    vtkVolume* volume = volumes->GetVolume(port);
    volume->ComputeMatrix();
    const std::optional<teravox::MapperFrame> frame =
      this->Prepare(mapper, own, port, ren, volume, volumes);
    if (!frame)
    {
      return;
    }
    parts.push_back(
      { &own.Engine, frame->Request, frame->Drawn.Source->Info().Layout.Dimensions(0) });
    names.push_back(frame->Drawn.Source->Info().Name);
    shownParts.push_back(
      { &own, own.FunctionVersion, { &own.Engine, frame->Request, frame->Drawn.Source } });
  }
  this->MixBytes = others.empty() ? 0
                                  : teravox::MixedRays::BytesPerRay(ports.size()) *
      static_cast<std::uint64_t>(size[0]) * static_cast<std::uint64_t>(size[1]);
  DivideBudgets(parts, mapper->GetEffectiveGPUMemoryBudget(),
    mapper->GetEffectiveHostMemoryBudget(), this->MixBytes);
  teravox::FrameRequest& request = parts[0].Request;
  if (selector)
  {
    BeginProp(selector, request);
  }
  // Where the colours of all are, in the first one's engine.
  const void* shown = others.empty() ? request.View : ScratchOf(request.View);
  teravox::Status status;
  const auto render = [&](const teravox::FrameRequest& how)
  {
    for (teravox::VolumeMixer::Part& part : parts)
    {
      part.Request.Show = how.Show;
      part.Request.Depths = how.Depths;
      part.Request.IsStretch = how.IsStretch;
      part.Request.Continues = how.Continues;
    }
    return others.empty() ? this->Engine.Render(parts[0].Request)
                          : this->Mixer.Render(parts, shown);
  };
  if (peeling)
  {
    const teravox::StretchPainter painter{ [&](const teravox::FrameRequest& how)
      {
        teravox::FrameRequest stretch = how;
        stretch.View = shown;
        return this->Engine.PrepareStretch(stretch);
      },
      render, [&](bool keep) { return this->Engine.StretchColors(shown, keep); } };
    status = this->Peeling.Draw(painter, request, peeling, mapper, volumes, this->Window);
  }
  else
  {
    status = render(request);
  }
  if (selector)
  {
    selector->EndRenderProp();
  }
  this->TellNeeds(mapper, parts);
  this->LastView = request.View;
  this->LastRenderer = ren;
  this->Shown_.erase(ren);
  if (peeling)
  {
    // As without it: rays end at opaque geometry, and the picture lies where the viewport does.
    for (ShownTogether& one : shownParts)
    {
      one.Part.Request.Depths = request.Depths;
      one.Part.Request.X = origin[0];
      one.Part.Request.Y = origin[1];
    }
  }
  this->Together[ren] = shownParts;
  bool timedOut = false;
  for (std::size_t v = 0; v < parts.size(); ++v)
  {
    this->ReportFailures(mapper, *parts[v].Engine, names[v]);
    timedOut = timedOut || parts[v].Engine->LastFrame().TimedOut;
  }
  if (this->IsDrawn(mapper, ren, status, timedOut))
  {
    this->EndDrawing(mapper, ren, peeling != nullptr, began);
  }
}
