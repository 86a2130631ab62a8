// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// What of VolumeEngine a disk may hold up, and what is done so that it doesn't: the ranges of the
// page directory come when they come, reads that don't end are left to themselves, and what
// couldn't be read is asked for again after a while.
#include "EndOrLeave.h"
#include "VolumeEngine.h"

#include <chrono>
#include <utility>

namespace teravox
{

namespace
{
double Now()
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
} // namespace

// For a page table that is new.
void VolumeEngine::BeginDirectory()
{
  EndOrLeave(std::move(this->Directory), ShortWait);
  this->DirectoryAwaited = false;
  this->Directory = std::make_unique<DirectoryReader>(this->Source_, this->Current->Directory);
}

// Gives the page table what has been read, once all has. Without it nothing is known to be empty up
// there; bricks are asked for, and drawn, all the same.
bool VolumeEngine::TakeDirectory(double seconds)
{
  if (!this->Directory)
  {
    return true;
  }
  if (!this->Directory->Wait(seconds))
  {
    return false;
  }
  const DirectoryReader::Levels levels = this->Directory->Take();
  for (std::size_t l = 0; l < levels.size(); ++l)
  {
    if (!levels[l].empty())
    {
      this->Table->SetDirectoryRanges(static_cast<int>(l), levels[l]);
    }
  }
  this->Directory.reset();
  return true;
}

// Interactive frames wait a moment, once: usually it comes at once, and saves asking for what is
// empty. Returns false if this frame is to end here.
bool VolumeEngine::AwaitDirectory(const FrameRequest& request)
{
  if (!request.Converge)
  {
    this->TakeDirectory(std::exchange(this->DirectoryAwaited, true) ? 0 : ShortWait);
    return true;
  }
  const double began = Now();
  while (!this->TakeDirectory(ShortWait))
  {
    this->Frame.Aborted = request.Abort && request.Abort();
    this->Frame.TimedOut = request.Timeout > 0 && Now() - began > request.Timeout;
    if (this->Frame.Aborted || this->Frame.TimedOut)
    {
      return false;
    }
  }
  return true;
}

// One that doesn't end keeps the steps that it reads to itself.
void VolumeEngine::EndReadAhead()
{
  if (!this->Ahead->EndWithin(PatienceAtTheEnd))
  {
    this->OtherSteps.clear();
    EndOrLeave(std::exchange(this->Ahead, std::make_unique<ReadAhead>()), 0);
  }
}

void VolumeEngine::RetryInTime(const FrameRequest& request)
{
  if (request.RetryAfter > 0 && this->AnyFailed() && !request.Final.PropColor &&
    Now() - this->FailedAt >= request.RetryAfter)
  {
    this->RetryFailed();
    this->ForgetPictures();
  }
}

} // namespace teravox
