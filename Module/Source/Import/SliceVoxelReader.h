// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "VoxelReader.h"

#include <cstddef>
#include <cstdint>
#include <list>
#include <vector>

namespace teravox
{

/// A volume that can be had slice by slice only: boxes are cut out of slices, and those read last
/// are kept, because the boxes beside each other want the same ones. Thread: as VoxelReader.
class SliceVoxelReader : public VoxelReader
{
public:
  Description Describe() const override { return this->Volume; }
  Status ReadBox(const Int3& start, const Int3& size, void* out) override;
  bool ReadsSlabs() const override { return true; }

  /// Bytes of slices that may be kept; one is, whatever its size.
  void SetCacheLimit(std::uint64_t bytes) { this->CacheLimit = bytes; }
  std::uint64_t SlicesRead() const { return this->Count; }
  std::size_t SliceBytes() const;
  /// Bytes of memory that ReadSlice() takes beside the slice.
  virtual std::uint64_t DecoderBytes() const { return 0; }

protected:
  explicit SliceVoxelReader(Description volume)
    : Volume(std::move(volume))
  {
  }
  /// The whole slice, x fastest, y from 0 on.
  virtual Status ReadSlice(std::int64_t z, std::byte* out) = 0;
  std::size_t VoxelBytes() const;

  Description Volume;

private:
  struct KeptSlice
  {
    std::int64_t Z = -1;
    std::vector<std::byte> Voxels;
  };
  Result<const std::byte*> Find(std::int64_t z);

  std::list<KeptSlice> Slices; // the one used last first
  std::uint64_t CacheLimit = std::uint64_t{ 64 } << 20;
  std::uint64_t Count = 0;
};

} // namespace teravox
