// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "NativeAtlas.h"

#include <cstring>
#include <string>

namespace teravox
{

LazyMemory LazyMemory::Make(std::uint64_t bytes)
{
  LazyMemory memory;
  memory.Block.reset(static_cast<std::uint8_t*>(std::calloc(static_cast<std::size_t>(bytes), 1)));
  return memory;
}

Result<std::unique_ptr<NativeAtlas>> NativeAtlas::Make(const AtlasPlan& plan)
{
  std::unique_ptr<NativeAtlas> atlas(new NativeAtlas);
  atlas->Components = plan.Components;
  atlas->Voxels_ = LazyMemory::Make(plan.AtlasBytes + 2 * Margin);
  atlas->Cells_ = LazyMemory::Make(plan.CellBytes);
  atlas->Occupancy_ = LazyMemory::Make(plan.OccupancyBytes);
  atlas->VersionOffset = plan.OccupancyBytes - std::uint64_t{ plan.Slots } * sizeof(std::uint32_t);
  bool complete = atlas->Voxels_.Data() != nullptr && atlas->Cells_.Data() != nullptr &&
    atlas->Occupancy_.Data() != nullptr;
  if (plan.SlotTableBytes != 0)
  {
    atlas->Slots = LazyMemory::Make(plan.SlotTableBytes);
    complete = complete && atlas->Slots.Data() != nullptr;
  }
  if (!complete)
  {
    return Status(StatusCode::ResourceExhausted,
      "The system can't allocate " + std::to_string(plan.TotalBytes()) +
        " bytes for the brick atlas; choose a smaller GPU memory budget.");
  }
  return atlas;
}

void NativeAtlas::Write(std::uint32_t slot, const std::uint8_t* texels, std::size_t texelBytes,
  const std::uint8_t* cells, std::size_t cellBytes, std::uint32_t component)
{
  const std::size_t place = std::size_t{ slot } * this->Components + component;
  std::memcpy(this->Voxels_.Data() + Margin + place * texelBytes, texels, texelBytes);
  std::memcpy(this->Cells_.Data() + place * cellBytes, cells, cellBytes);
  this->OccupancyVersion()[slot] = 0;
}

void NativeAtlas::WriteEntry(
  std::uint32_t slot, float offsetHigh, float offsetLow, float scale, std::uint32_t component)
{
  const std::size_t place = std::size_t{ slot } * this->Components + component;
  float* entry = reinterpret_cast<float*>(this->Slots.Data()) + place * 4;
  entry[0] = offsetHigh;
  entry[1] = offsetLow;
  entry[2] = scale;
}

} // namespace teravox
