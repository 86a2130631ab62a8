// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// What vtkOutOfCoreVolumeMapper tells of its last frame, and of all of them.
#include "MapperInternals.h"

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetBytesRead()
{
  return this->Internals->Total(&teravox::VolumeEngine::BytesRead);
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetBytesUploaded()
{
  return this->Internals->Total(&teravox::VolumeEngine::BytesUploaded);
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetPageTableBytesUploaded()
{
  return this->Internals->Total(&teravox::VolumeEngine::PageTableBytesUploaded);
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfBricksLoaded()
{
  return this->Internals->Total(&teravox::VolumeEngine::BricksLoaded);
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfFailedBricks()
{
  return this->Internals->Total(&teravox::VolumeEngine::FailedBricks);
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfFailedPageBlocks()
{
  return this->Internals->Total(&teravox::VolumeEngine::FailedPageBlocks);
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfEvictions()
{
  return this->Internals->Total(&teravox::VolumeEngine::Evictions);
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfPageBlockEvictions()
{
  return this->Internals->Total(&teravox::VolumeEngine::PageBlockEvictions);
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfSlots()
{
  vtkTypeUInt64 slots = 0;
  this->Internals->ForEachVolume([&](teravox::MapperVolume& v) { slots += v.Engine.Plan().Slots; });
  return slots;
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfSlotsInUse()
{
  return this->Internals->Total(&teravox::VolumeEngine::SlotsInUse);
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetGPUMemoryUsed()
{
  std::uint64_t used = this->Internals->MixBytes;
  this->Internals->ForEachVolume([&](teravox::MapperVolume& v) { used += v.Engine.Memory().Used; });
  return used;
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetPeakGPUMemoryUsed()
{
  std::uint64_t peak = this->Internals->MixBytes;
  this->Internals->ForEachVolume([&](teravox::MapperVolume& v) { peak += v.Engine.Memory().Peak; });
  return peak;
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetHostMemoryUsed()
{
  return this->Internals->Total(&teravox::VolumeEngine::HostMemoryUsed);
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetPeakHostMemoryUsed()
{
  return this->Internals->Total(&teravox::VolumeEngine::PeakHostMemoryUsed);
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetAddressingMemoryUsed()
{
  return this->Internals->Total(&teravox::VolumeEngine::AddressingBytes);
}

bool vtkOutOfCoreVolumeMapper::IsMarcherNative()
{
  return this->Internals->Engine.Plan().Native;
}

int vtkOutOfCoreVolumeMapper::GetMaximumTextureSize()
{
  const teravox::VolumeEngine& engine = this->Internals->Engine;
  return engine.Plan().Slots != 0 ? static_cast<int>(engine.PlannedFor().MaximumTextureSize) : 0;
}

double vtkOutOfCoreVolumeMapper::GetTimeToFirstPicture()
{
  return this->Internals->FirstPicture;
}

double vtkOutOfCoreVolumeMapper::GetTimeToConverged()
{
  return this->Internals->ConvergedAfter;
}

double vtkOutOfCoreVolumeMapper::GetFrameErrorTolerance()
{
  return this->Internals->Engine.LastFrame().Tolerance;
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfSamples()
{
  return this->Internals->FrameTotal(&teravox::FrameStatistics::Samples);
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfEvaluatedSamples()
{
  return this->Internals->FrameTotal(&teravox::FrameStatistics::EvaluatedSamples);
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfGradients()
{
  return this->Internals->FrameTotal(&teravox::FrameStatistics::Gradients);
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfVisits()
{
  return this->Internals->FrameTotal(&teravox::FrameStatistics::Visits);
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfContributingSamples()
{
  return this->Internals->FrameTotal(&teravox::FrameStatistics::ContributingSamples);
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfPasses()
{
  return this->Internals->FrameTotal(&teravox::FrameStatistics::Passes);
}

vtkTypeUInt64 vtkOutOfCoreVolumeMapper::GetNumberOfOperations()
{
  return this->Internals->Total(&teravox::VolumeEngine::Operations);
}
