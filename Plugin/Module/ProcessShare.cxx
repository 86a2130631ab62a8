// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ProcessShare.h"

#include "vtkBlockSplit.h"
#include "vtkBrickSource.h"
#include "vtkCommunicator.h"
#include "vtkDoubleArray.h"
#include "vtkFloatArray.h"
#include "vtkIdList.h"
#include "vtkImageData.h"
#include "vtkMath.h"
#include "vtkMatrix3x3.h"
#include "vtkMatrix4x4.h"
#include "vtkMultiProcessController.h"
#include "vtkOutOfCoreVolumeMapper.h"
#include "vtkPVSession.h"
#include "vtkProp3D.h"
#include "vtkRenderer.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace
{
// What a process tells the others.
struct Word
{
  double HasPyramid = 0;
  double CanDivide = 0;
  ProcessFacts Facts;
};
constexpr int WordSize = sizeof(Word) / sizeof(double);
constexpr int Tag = 77001;
// Blocks move where the process that needs most has this much less to do then: what it gets anew
// has to be read.
constexpr double WorthAMove = 1.25;
constexpr double Mebibyte = 1024.0 * 1024.0;

// The server's words, also on its client. Returns whether there is a server and a client.
bool TellClient(vtkPVSession* session, int process, std::vector<Word>& words)
{
  if (!session)
  {
    return false;
  }
  auto count = static_cast<int>(words.size());
  if (auto* client = session->GetController(vtkPVSession::CLIENT))
  {
    if (process == 0 && session->HasProcessRole(vtkPVSession::RENDER_SERVER))
    {
      client->Send(&count, 1, 1, Tag);
      client->Send(reinterpret_cast<double*>(words.data()), count * WordSize, 1, Tag);
    }
    return true;
  }
  if (auto* server = session->GetController(vtkPVSession::RENDER_SERVER_ROOT))
  {
    server->Receive(&count, 1, 1, Tag);
    words.resize(static_cast<std::size_t>(count));
    server->Receive(reinterpret_cast<double*>(words.data()), count * WordSize, 1, Tag);
    return true;
  }
  return false;
}

// Whether axes stay along axes. Sines of right angles are rounded.
template <typename Entry>
bool KeepsAxes(Entry entry)
{
  for (int column = 0; column < 3; ++column)
  {
    double sum = 0;
    double largest = 0;
    for (int row = 0; row < 3; ++row)
    {
      sum += std::abs(entry(row, column));
      largest = std::max(largest, std::abs(entry(row, column)));
    }
    if (!(largest > 0) || sum - largest > 1e-12 * largest)
    {
      return false;
    }
  }
  return true;
}

bool KeepsAxes(vtkImageData* image, vtkProp3D* prop)
{
  vtkMatrix3x3* direction = image->GetDirectionMatrix();
  vtkMatrix4x4* matrix = prop->GetMatrix();
  return KeepsAxes([=](int r, int c) { return direction->GetElement(r, c); }) &&
    KeepsAxes([=](int r, int c) { return matrix->GetElement(r, c); });
}
} // namespace

ProcessShare::ProcessShare() = default;
ProcessShare::~ProcessShare() = default;

vtkBoundingBox ProcessShare::InWorld(const double bounds[6], vtkProp3D* prop)
{
  vtkBoundingBox box;
  if (!vtkMath::AreBoundsInitialized(bounds))
  {
    return box;
  }
  for (int corner = 0; corner < 8; ++corner)
  {
    double p[4] = { bounds[corner & 1], bounds[2 + (corner >> 1 & 1)], bounds[4 + (corner >> 2)],
      1 };
    prop->GetMatrix()->MultiplyPoint(p, p);
    box.AddPoint(p);
  }
  return box;
}
bool ProcessShare::Choose(vtkBrickSource* source, vtkImageData* image, vtkProp3D* prop,
  bool blendable, vtkOutOfCoreVolumeMapper* drawn, const ProcessFacts& facts, vtkPVSession* session)
{
  auto* controller = vtkMultiProcessController::GetGlobalController();
  const int processes = controller ? controller->GetNumberOfProcesses() : 1;
  const int process = processes > 1 ? controller->GetLocalProcessId() : 0;
  Word mine;
  mine.HasPyramid = source ? 1 : 0;
  mine.CanDivide =
    source && blendable && source->IsInPlace(image) && KeepsAxes(image, prop) ? 1 : 0;
  mine.Facts = facts;
  std::vector<Word> all(static_cast<std::size_t>(processes), mine);
  if (processes > 1)
  {
    controller->AllGather(
      reinterpret_cast<double*>(&mine), reinterpret_cast<double*>(all.data()), WordSize);
  }
  this->Alone = !TellClient(session, process, all) && processes == 1;
  this->FactsOfAll.clear();
  for (const Word& word : all)
  {
    this->FactsOfAll.push_back(word.Facts);
  }
  const auto first =
    std::find_if(all.begin(), all.end(), [](const Word& w) { return w.HasPyramid > 0; });
  // The same on all processes, as what follows from it is.
  // What was left out, as others hid it, would be needed from another side: blocks that moved for
  // that would be read again and again.
  const auto together = this->Divided ? this->FactsTogether() : std::nullopt;
  const bool complete = together && together->Converged > 0 && together->LeftOut == 0;
  this->Divided = all.size() > 1 &&
    std::all_of(all.begin(), all.end(), [](const Word& w) { return w.CanDivide > 0; });

  std::vector<double> division{ static_cast<double>(first - all.begin()) };
  division.insert(division.end(), prop->GetMatrix()->GetData(), prop->GetMatrix()->GetData() + 16);
  if (this->Divided && source)
  {
    this->Which = Part::Block;
    this->Split->SetBrickSource(source);
    this->Split->SetNumberOfBlocks(processes);
    const vtkIdType weights = this->Weights->GetNumberOfValues();
    if (weights > 0 && weights == this->Split->GetNumberOfGridBricks())
    {
      this->Split->SetWeights(this->Weights);
    }
    if (complete)
    {
      this->Balance(drawn, controller);
    }
    this->Divide(prop, process, processes, division);
  }
  else
  {
    this->Which = first == all.end() || first - all.begin() == process ? Part::All : Part::Nothing;
  }
  const bool changed = division != this->Division;
  this->Division = std::move(division);
  return changed;
}

std::optional<ProcessFacts> ProcessShare::FactsTogether() const
{
  if (this->Alone)
  {
    return std::nullopt;
  }
  ProcessFacts together;
  together.Converged = 1;
  for (const ProcessFacts& one : this->FactsOfAll)
  {
    together.InputVoxels += one.InputVoxels;
    together.DrawsPyramid = std::max(together.DrawsPyramid, one.DrawsPyramid);
    together.Converged = std::min(together.Converged, one.Converged);
    together.MissingBricks += one.MissingBricks;
    together.FailedBricks += one.FailedBricks;
    together.BricksLoaded += one.BricksLoaded;
    together.Read += one.Read;
    together.Needed += one.Needed;
    together.LeftOut = std::max(together.LeftOut, one.LeftOut);
    together.GPUMemory = std::max(together.GPUMemory, one.GPUMemory);
    together.HostMemory = std::max(together.HostMemory, one.HostMemory);
  }
  return together;
}

double ProcessShare::NeedOf(vtkOutOfCoreVolumeMapper* drawn) const
{
  if (this->Which != Part::Block)
  {
    return 0;
  }
  vtkNew<vtkDoubleArray> weights;
  drawn->AddBrickWeights(this->Split, weights);
  const double* first = weights->GetPointer(0);
  return std::accumulate(first, first + weights->GetNumberOfValues(), 0.0) / Mebibyte;
}

bool ProcessShare::OpacityInFront(
  vtkRenderer* renderer, vtkProp3D* prop, vtkFloatArray* ofAll, vtkFloatArray* inFront)
{
  vtkNew<vtkIdList> order;
  return this->Which == Part::Block && this->Split->GetFrontToBack(renderer, prop, order) &&
    this->Split->GetOpacityInFront(
      ofAll, order, vtkMultiProcessController::GetGlobalController()->GetLocalProcessId(), inFront);
}

void ProcessShare::Balance(vtkOutOfCoreVolumeMapper* drawn, vtkMultiProcessController* controller)
{
  vtkNew<vtkDoubleArray> mine;
  drawn->AddBrickWeights(this->Split, mine);
  const vtkIdType bricks = mine->GetNumberOfValues();
  vtkNew<vtkDoubleArray> sum;
  sum->SetNumberOfValues(bricks);
  // Summed up once: the same bits, and so the same blocks, everywhere.
  controller->Reduce(mine->GetPointer(0), sum->GetPointer(0), bricks, vtkCommunicator::SUM_OP, 0);
  controller->Broadcast(sum->GetPointer(0), bricks, 0);
  double most = 0;
  for (const ProcessFacts& one : this->FactsOfAll)
  {
    most = std::max(most, one.Needed);
  }
  vtkNew<vtkBlockSplit> moved;
  moved->SetBrickSource(this->Split->GetBrickSource());
  moved->SetNumberOfBlocks(this->Split->GetNumberOfBlocks());
  moved->SetWeights(sum);
  double mostThen = 0;
  for (int block = 0; block < moved->GetNumberOfBlocks(); ++block)
  {
    mostThen = std::max(mostThen, moved->GetBlockWeight(block) / Mebibyte);
  }
  if (mostThen * WorthAMove < most)
  {
    this->Weights->DeepCopy(sum);
    this->Split->SetWeights(sum);
  }
}

void ProcessShare::Divide(vtkProp3D* prop, int process, int processes, std::vector<double>& boxes)
{
  this->Split->GetBlockExtent(process, this->BlockExtent);
  vtkBoundingBox whole;
  for (int block = 0; block < processes; ++block)
  {
    double bounds[6];
    this->Split->GetBlockBounds(block, bounds);
    if (vtkMath::AreBoundsInitialized(bounds))
    {
      const vtkBoundingBox box = InWorld(bounds, prop);
      box.GetBounds(bounds);
      whole.AddBox(box);
    }
    boxes.insert(boxes.end(), bounds, bounds + 6);
    if (block == process)
    {
      std::copy_n(bounds, 6, this->BlockBounds);
    }
  }
  if (!vtkMath::AreBoundsInitialized(this->BlockBounds))
  {
    for (int i = 0; i < 6; ++i)
    {
      this->BlockBounds[i] = whole.GetMinPoint()[i / 2];
    }
  }
}
