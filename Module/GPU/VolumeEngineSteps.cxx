// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Sources and time steps of VolumeEngine. Each step has a volume number of its own in loader and
// host cache; page table, residency and atlas know the present step only, as volume 0.
#include "EndOrLeave.h"
#include "VolumeEngine.h"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <utility>

namespace teravox
{

void VolumeEngine::ForgetStep(const StepVolume& step)
{
  if (this->Loader)
  {
    this->Loader->SetSource(step.Volume, nullptr);
  }
  else if (this->Cache)
  {
    this->Cache->EraseVolume(step.Volume);
  }
  if (this->Cache && step.Reserved != 0)
  {
    this->Cache->Release(step.Reserved);
  }
}

// Ends what reads ahead for them first.
void VolumeEngine::ForgetOtherSteps()
{
  if (this->OtherSteps.empty())
  {
    return;
  }
  this->EndReadAhead();
  for (const auto& other : this->OtherSteps)
  {
    this->ForgetStep(*other);
  }
  this->OtherSteps.clear();
}

// The step that was shown: its bricks stay, and what its source keeps counts in the cache.
void VolumeEngine::KeepStep(const std::shared_ptr<StepVolume>& step)
{
  const std::uint64_t least = this->Cache
    ? std::max(step->Source->LeastMemory(), this->Cache->Budget() / 6) // as ReadAhead
    : 0;
  if (!this->Cache || !this->Cache->Reserve(least, this->Held.BrickBytes + this->Held.BlockBytes))
  {
    this->ForgetStep(*step);
    return;
  }
  step->Reserved = least;
  step->Source->SetMemoryBudget(least);
  if (this->Loader)
  {
    this->Loader->SetSource(step->Volume, nullptr, true);
  }
  this->OtherSteps.push_back(step);
}

void VolumeEngine::SetSource(
  std::shared_ptr<BrickSource> source, std::shared_ptr<BrickSeries> series, int step)
{
  if (source == this->Given)
  {
    return;
  }
  this->EndReadAhead();
  std::shared_ptr<StepVolume> next;
  if (series && series == this->Series)
  {
    this->Direction = this->Current && step < this->Current->Step ? -1 : 1;
    const auto known = std::find_if(this->OtherSteps.begin(), this->OtherSteps.end(),
      [&](const auto& other) { return other->Step == step; });
    if (known != this->OtherSteps.end())
    {
      if ((*known)->Given == source)
      {
        next = *known;
        this->Cache->Release(std::exchange(next->Reserved, 0));
      }
      else
      {
        this->ForgetStep(**known);
      }
      this->OtherSteps.erase(known);
    }
    if (this->Current)
    {
      this->KeepStep(this->Current);
    }
  }
  else
  {
    this->ForgetOtherSteps();
    if (this->Current)
    {
      this->ForgetStep(*this->Current);
    }
    this->Direction = 1;
  }
  if (!next)
  {
    next = std::make_shared<StepVolume>();
    next->Volume = this->NextVolume++;
    next->Step = step;
    next->Open(source);
  }
  this->Series = std::move(series);
  this->Current = next;
  this->Given = std::move(source);
  this->Exponent = next->Exponent;
  this->Source_ = next->Source;
  this->TableVersion = 0;
  this->Plan_ = {}; // a new page table with the next frame
  this->Unanswered = {};
  this->ForgetPictures();
  if (this->Loader)
  {
    this->Loader->SetSource(next->Volume, this->Source_, true);
  }
}

std::vector<LoadResult> VolumeEngine::TakeFinished()
{
  std::vector<LoadResult> finished = this->Loader->TakeFinished();
  for (LoadResult& result : finished)
  {
    result.Key.Volume = 0;
  }
  return finished;
}

std::shared_ptr<StepVolume> VolumeEngine::StepOf(int step)
{
  const auto known = std::find_if(this->OtherSteps.begin(), this->OtherSteps.end(),
    [step](const auto& other) { return other->Step == step; });
  if (known != this->OtherSteps.end())
  {
    return *known;
  }
  auto made = std::make_shared<StepVolume>();
  made->Volume = this->NextVolume++;
  made->Step = step;
  this->OtherSteps.insert(this->OtherSteps.begin(), made);
  return made;
}

// Where the opacity isn't 0, at all values between which it is monotone.
VisibleValues VolumeEngine::FindVisible(const FrameRequest& request) const
{
  if (request.Blend.Kind != BlendKind::Composite || this->Source_->Info().Components > 1 ||
    this->Drawn.Knots.empty())
  {
    return {};
  }
  std::vector<std::pair<double, bool>> samples;
  for (const double knot : this->Drawn.Knots)
  {
    samples.emplace_back(knot, this->Drawn.Opacity(knot) > 0);
  }
  if (!this->Drawn.IsConstantBeyond)
  {
    return {};
  }
  return VisibleValues(std::move(samples));
}

void VolumeEngine::StartReadAhead(const FrameRequest& request, const ViewOrder& order)
{
  if (!this->Series || this->Series->NumberOfSteps() < 2)
  {
    return;
  }
  // Reads of a disk that stalls hold up no picture: the next one tries again.
  if (!this->Ahead->EndWithin(request.Converge ? PatienceAtTheEnd : ShortWait))
  {
    return;
  }
  // Steps that aren't neighbours any more make room.
  const auto isFar = [this](const std::shared_ptr<StepVolume>& other)
  { return std::abs(other->Step - this->Current->Step) > 1; };
  for (const auto& other : this->OtherSteps)
  {
    if (isFar(other))
    {
      this->ForgetStep(*other);
    }
  }
  this->OtherSteps.erase(std::remove_if(this->OtherSteps.begin(), this->OtherSteps.end(), isFar),
    this->OtherSteps.end());
  const VolumeInfo& info = this->Source_->Info();
  ReadAhead::Plan plan;
  for (const int beside : { this->Direction, -this->Direction })
  {
    const int step = this->Current->Step + beside;
    if (step >= 0 && step < this->Series->NumberOfSteps())
    {
      plan.Steps.push_back(this->StepOf(step));
    }
  }
  plan.Cache = this->Cache;
  plan.Series = this->Series;
  plan.Present = this->Current->Volume;
  plan.Layout = info.Layout;
  plan.Type = info.Type;
  plan.Components = info.Components;
  plan.BrickBytes = this->Held.BrickBytes;
  plan.BlockBytes = this->Held.BlockBytes;
  plan.Order = order;
  plan.Levels = this->Residency_->ResidentLevels();
  plan.Visible = this->FindVisible(request);
  plan.SkipEmpty = request.EmptySpaceSkipping;
  plan.Headroom = 2 * std::max(this->Held.BrickBytes, this->Held.BlockBytes);
  this->Ahead->Start(std::move(plan));
}

} // namespace teravox
