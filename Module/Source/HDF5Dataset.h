// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "ChunkCache.h"
#include "ChunkDecoder.h"
#include "HDF5File.h"
#include "Status.h"
#include "Types.h"

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace teravox
{

/// One dataset of shape (y,x), (z,y,x) or (z,y,x,component), read chunk by chunk. Chunks whose
/// filters ChunkDecoder knows are read raw and decoded outside the library's lock; others, and
/// datasets that aren't chunked (in boxes of 64 voxels), go through H5Dread.
/// Thread: any; functions take the HDF5Lock themselves.
class HDF5Dataset
{
public:
  /// Errors: NotFound; Corrupt (no voxels); Unsupported (shape, type, a filter that isn't
  /// installed).
  static Result<std::shared_ptr<HDF5Dataset>> Open(
    std::shared_ptr<HDF5File> file, const std::string& path);

  ~HDF5Dataset();
  HDF5Dataset(const HDF5Dataset&) = delete;
  HDF5Dataset& operator=(const HDF5Dataset&) = delete;
  HDF5Dataset(HDF5Dataset&&) = delete;
  HDF5Dataset& operator=(HDF5Dataset&&) = delete;

  const Int3& Dimensions() const { return this->Shape.Dimensions; }
  const Int3& ChunkSize() const { return this->Shape.ChunkSize; }
  int Components() const { return this->Shape.Components; }
  ScalarType Type() const { return this->Shape.Type; }
  std::size_t VoxelBytes() const;
  /// One voxel of the fill value, all components.
  const std::vector<std::byte>& Fill() const { return this->Shape.Fill; }
  /// "dataset '/Pyramid/1' in file 'a.h5'".
  std::string Name() const;

  /// Reads one chunk; one that isn't stored has empty Voxels and reads nothing.
  /// Requires: index * ChunkSize() inside Dimensions().
  Result<ChunkPointer> Read(const Int3& index, const ChunkCache::Reserve& reserve) const;

private:
  struct Layout
  {
    int Rank = 0;
    Int3 Dimensions{ 0, 0, 0 };
    Int3 ChunkSize{ 0, 0, 0 };
    int Components = 1;
    ScalarType Type = ScalarType::UInt8;
    bool BigEndian = false;
    bool Chunked = false;              // storage size per chunk can be asked
    bool Direct = false;               // raw chunks can be read and decoded here
    bool EdgeChunksUnfiltered = false; // H5D_CHUNK_DONT_FILTER_PARTIAL_CHUNKS
    std::vector<std::byte> Fill;
    std::vector<ChunkFilter> Filters;
  };

  HDF5Dataset(std::shared_ptr<HDF5File> file, std::string path, HDF5Handle id, Layout shape);
  static Status Inspect(hid_t id, Layout& shape);
  static Status InspectShape(hid_t id, Layout& shape);
  static Status InspectType(hid_t id, Layout& shape);
  static Status InspectStorage(hid_t id, Layout& shape);
  Status Failure(StatusCode code, const Int3& index, const std::string& cause) const;
  Result<ChunkPointer> ReadDirect(
    const Int3& index, std::uint64_t stored, const ChunkCache::Reserve& reserve) const;
  Result<ChunkPointer> ReadThroughLibrary(
    const Int3& index, std::uint64_t stored, const ChunkCache::Reserve& reserve) const;

  std::shared_ptr<HDF5File> File;
  std::string Path;
  HDF5Handle Id;
  Layout Shape;
  ChunkDecoder Decoder;
};

} // namespace teravox
