// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "ChunkCache.h"
#include "ChunkDecoder.h"
#include "FileLength.h"
#include "HDF5File.h"
#include "HDF5View.h"
#include "Status.h"
#include "Types.h"

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace teravox
{

/// One volume in a dataset, read chunk by chunk. Chunks whose filters ChunkDecoder knows are read
/// raw and decoded outside the library's lock; others, and datasets that aren't chunked (in boxes
/// of 64 voxels), go through H5Dread. Integers of 64 bits become ones of 32; a chunk in which one
/// doesn't fit is an error. Axes in any order, and chunks that reach over other axes, are sorted
/// after decoding.
/// Thread: any; functions take the HDF5Lock themselves.
class HDF5Dataset
{
public:
  /// Errors: NotFound; Corrupt (no voxels); Unsupported (shape, type, a filter that isn't
  /// installed); InvalidArgument (a view that the dataset doesn't have).
  static Result<std::shared_ptr<HDF5Dataset>> Open(
    std::shared_ptr<HDF5File> file, const std::string& path, const HDF5View& view = {});

  ~HDF5Dataset();
  HDF5Dataset(const HDF5Dataset&) = delete;
  HDF5Dataset& operator=(const HDF5Dataset&) = delete;
  HDF5Dataset(HDF5Dataset&&) = delete;
  HDF5Dataset& operator=(HDF5Dataset&&) = delete;

  const Int3& Dimensions() const { return this->Shape.Dimensions; }
  const Int3& ChunkSize() const { return this->Shape.ChunkSize; }
  /// False: ChunkSize() is that of the boxes in which it is read (HDF5View::Box).
  bool HasChunks() const { return this->Shape.Chunked; }
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

  /// True if nothing is stored in the chunks [first, last), so that they hold the fill value. False
  /// if something is, or if it isn't known; looks at `lookups` chunks at most and takes them off.
  bool IsUnwritten(const Int3& first, const Int3& last, std::int64_t& lookups) const;

private:
  using Extent = std::array<hsize_t, HDF5View::MaximumRank>;
  struct Layout
  {
    HDF5View View;
    int Rank = 0;
    Extent Size{};  // of the dataset
    Extent Block{}; // its chunks, or the boxes in which it is read
    Int3 Dimensions{ 0, 0, 0 };
    Int3 ChunkSize{ 0, 0, 0 };
    int Components = 1;
    ScalarType Type = ScalarType::UInt8;
    ScalarType Stored = ScalarType::UInt8; // differs from Type where bits are taken as unsigned
    bool Wide = false; // 64-bit integers in the file, of which Type has the low half
    bool BigEndian = false;
    bool Chunked = false;              // storage size per chunk can be asked
    bool Direct = false;               // raw chunks can be read and decoded here
    bool EdgeChunksUnfiltered = false; // H5D_CHUNK_DONT_FILTER_PARTIAL_CHUNKS
    bool Sorted = true;                // a block has the voxels as a Chunk has them
    std::vector<std::byte> Fill;
    std::vector<ChunkFilter> Filters;

    std::uint64_t BlockElements() const;
    std::size_t StoredBytes() const; // of an element
  };

  HDF5Dataset(std::shared_ptr<HDF5File> file, std::string path, HDF5Handle id, Layout shape);
  static Status Inspect(hid_t id, Layout& shape);
  static Status InspectShape(hid_t id, Layout& shape);
  static Status InspectView(Layout& shape);
  static Status InspectType(hid_t id, Layout& shape);
  static Status InspectStorage(hid_t id, Layout& shape);
  static Status InspectFilters(hid_t creation, Layout& shape);
  Status Failure(StatusCode code, const Int3& index, const std::string& cause) const;
  /// The first element of a block in the dataset.
  Extent Offset(const Int3& index) const;
  /// Takes the volume's voxels out of a block whose first element is the dataset's `offset`.
  void Sort(
    const std::vector<std::byte>& block, const Extent& offset, std::vector<std::byte>& out) const;
  bool IsSorted() const;
  /// From a decoded block to the voxels of a chunk, where it isn't one already.
  Status Arrange(const Int3& index, std::vector<std::byte>& block, const Extent& offset,
    std::vector<std::byte>& out) const;
  std::size_t ChunkBytes() const;
  Result<ChunkPointer> ReadDirect(
    const Int3& index, std::uint64_t stored, const ChunkCache::Reserve& reserve) const;
  Result<ChunkPointer> ReadThroughLibrary(
    const Int3& index, std::uint64_t stored, const ChunkCache::Reserve& reserve) const;

  std::shared_ptr<HDF5File> File;
  std::string Path;
  HDF5Handle Id;
  Layout Shape;
  ChunkDecoder Decoder;
  FileLength Length;
};

} // namespace teravox
