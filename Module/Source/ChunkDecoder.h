// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace teravox
{

/// One stage of an HDF5 filter pipeline, in the order in which a writer applies them.
struct ChunkFilter
{
  static constexpr int Deflate = 1;
  static constexpr int Shuffle = 2;
  static constexpr int Fletcher32 = 3;
  static constexpr int Szip = 4;
  static constexpr int ScaleOffset = 6;
  static constexpr int LZF = 32000;
  static constexpr int Blosc = 32001;
  static constexpr int LZ4 = 32004;
  static constexpr int Bitshuffle = 32008;
  static constexpr int Zstandard = 32015;

  int Id = 0;
  std::string Name;
  std::vector<unsigned> Parameters;
};

/// Undoes the filters of a raw HDF5 chunk without the HDF5 library: shuffle, deflate, Fletcher-32,
/// szip, scale-offset of integers, LZF (32000), Blosc 1 (32001), LZ4 (32004), bitshuffle (32008)
/// and Zstandard (32015), and swaps big-endian elements. No size found in the data is trusted.
/// Thread: immutable.
class ChunkDecoder
{
public:
  /// `chunkBytes` is the size of a decoded chunk; `elementSize` that of one component in bytes.
  ChunkDecoder(std::vector<ChunkFilter> filters, std::size_t chunkBytes, std::size_t elementSize,
    bool bigEndian);
  ChunkDecoder() = default;

  /// False if a stage must be left to the HDF5 library.
  bool IsComplete() const;
  std::size_t ChunkBytes() const { return this->ChunkBytes_; }
  const std::vector<ChunkFilter>& Filters() const { return this->Filters_; }
  /// No honest encoder makes more than this of a chunk.
  std::size_t LargestRawSize() const;
  /// Bytes of scratch that Decode() allocates at most, besides `raw` and the result.
  std::size_t ScratchSize() const;

  /// Decodes `raw` (which may be destroyed) into `out`, ChunkBytes() long afterwards. Bit i of
  /// `filterMask` says that filter i wasn't applied to this chunk.
  /// Errors: Corrupt, with a cause that fits behind "... doesn't decode: ".
  Status Decode(
    std::vector<std::byte>& raw, std::uint32_t filterMask, std::vector<std::byte>& out) const;

private:
  std::size_t SizeBefore(std::size_t filter, std::uint32_t filterMask, bool& exact) const;

  std::vector<ChunkFilter> Filters_;
  std::size_t ChunkBytes_ = 0;
  std::size_t ElementSize = 1;
  bool BigEndian = false;
};

} // namespace teravox
