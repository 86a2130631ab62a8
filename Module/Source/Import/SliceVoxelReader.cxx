// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "SliceVoxelReader.h"

#include <algorithm>
#include <cstring>

namespace teravox
{

std::size_t SliceVoxelReader::VoxelBytes() const
{
  return SizeOf(this->Volume.Type) * static_cast<std::size_t>(this->Volume.Components);
}

std::size_t SliceVoxelReader::SliceBytes() const
{
  return this->VoxelBytes() * static_cast<std::size_t>(this->Volume.Dimensions[0]) *
    static_cast<std::size_t>(this->Volume.Dimensions[1]);
}

Result<const std::byte*> SliceVoxelReader::Find(std::int64_t z)
{
  const auto found = std::find_if(
    this->Slices.begin(), this->Slices.end(), [z](const KeptSlice& slice) { return slice.Z == z; });
  if (found != this->Slices.end())
  {
    this->Slices.splice(this->Slices.begin(), this->Slices, found);
    return static_cast<const std::byte*>(this->Slices.front().Voxels.data());
  }
  const std::size_t bytes = this->SliceBytes();
  if (!this->Slices.empty() && (this->Slices.size() + 1) * bytes > this->CacheLimit)
  {
    this->Slices.splice(this->Slices.begin(), this->Slices, std::prev(this->Slices.end()));
  }
  else
  {
    this->Slices.emplace_front();
  }
  KeptSlice& slice = this->Slices.front();
  slice.Z = -1;
  slice.Voxels.resize(bytes);
  Status status = this->ReadSlice(z, slice.Voxels.data());
  if (!status.Ok())
  {
    return status;
  }
  ++this->Count;
  slice.Z = z;
  return static_cast<const std::byte*>(slice.Voxels.data());
}

Status SliceVoxelReader::ReadBox(const Int3& start, const Int3& size, void* out)
{
  const std::size_t row = static_cast<std::size_t>(size[0]) * this->VoxelBytes();
  auto* to = static_cast<std::byte*>(out);
  for (std::int64_t z = start[2]; z < start[2] + size[2]; ++z)
  {
    const auto slice = this->Find(z);
    if (!slice.Ok())
    {
      return slice.GetStatus();
    }
    for (std::int64_t y = start[1]; y < start[1] + size[1]; ++y, to += row)
    {
      const auto voxel = static_cast<std::size_t>(y * this->Volume.Dimensions[0] + start[0]);
      std::memcpy(to, slice.Value() + voxel * this->VoxelBytes(), row);
    }
  }
  return {};
}

} // namespace teravox
