// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "PyramidWriter.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace teravox
{

/// Applies the filters of a chunk as HDF5 would, outside the HDF5 library: the inverse of
/// ChunkDecoder. Holds its scratch memory between calls.
/// Thread: one at a time.
class ChunkEncoder
{
public:
  ChunkEncoder(
    PyramidCompression compression, int level, std::size_t chunkBytes, std::size_t elementSize);
  ~ChunkEncoder();
  ChunkEncoder(const ChunkEncoder&) = delete;
  ChunkEncoder& operator=(const ChunkEncoder&) = delete;
  ChunkEncoder(ChunkEncoder&&) = delete;
  ChunkEncoder& operator=(ChunkEncoder&&) = delete;

  /// What to store. It lives until the next call, and as long as `raw`.
  struct Encoded
  {
    const std::byte* Data = nullptr;
    std::size_t Size = 0;
    std::uint32_t FilterMask = 0; ///< incompressible chunks are stored without any filter
  };
  /// Requires: raw.size() == chunkBytes. Throws std::bad_alloc.
  Encoded Encode(const std::vector<std::byte>& raw);

  /// Bytes that one encoder allocates at most.
  static std::size_t ScratchSize(PyramidCompression compression, std::size_t chunkBytes);

private:
  std::size_t Deflate(const std::vector<std::byte>& raw);
  std::size_t CompressLZ4(const std::vector<std::byte>& raw);

  PyramidCompression Compression;
  int Level;
  std::size_t ElementSize;
  std::vector<std::byte> Shuffled;
  std::vector<std::byte> Output;
  struct Tables;
  std::unique_ptr<Tables> Compressor; // libdeflate's
};

} // namespace teravox
