// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BenchFilters.h"
#include "ChunkDecoder.h"
#include "Status.h"
#include "Types.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace teravox::program
{

const char* ToString(BenchFilter filter);
/// Errors: InvalidArgument, with the names there are.
Result<BenchFilter> ParseBenchFilter(const std::string& name);

/// Writes a GreyReader's cube: a pyramid where the program itself writes such chunks, else one
/// dataset. Chunks have 64 voxels per axis. Requires: `edge` is a multiple of 64. Errors:
/// InvalidArgument for scale-offset of floats.
Status WriteBenchFile(
  const std::string& fileName, BenchFilter filter, ScalarType type, std::int64_t edge);
/// Whether such a file is a pyramid, and the dataset with its finest voxels.
bool HasPyramid(BenchFilter filter);
std::string DatasetOf(BenchFilter filter);

/// The chunks of a dataset as they are stored, in main memory, and room for what they decode to.
class BenchChunks
{
public:
  static Result<BenchChunks> Read(
    const std::string& fileName, BenchFilter filter, ScalarType type, std::int64_t edge);

  /// Decodes each chunk once by calling the codec's library, each to its own place; szip,
  /// scale-offset and bitshuffle, of which there is none that is called like that, as bricks are,
  /// by ChunkDecoder. False: a chunk is damaged. Threads of its own: OpenMP's would go on waiting
  /// busily while bricks are loaded.
  bool Decode(int threads);

  std::size_t StoredBytes() const;
  std::size_t DecodedBytes() const { return this->Voxels.size(); }

private:
  struct Stored
  {
    std::vector<std::byte> Bytes;
    bool Filtered = true; ///< else as it is: it doesn't compress
  };
  bool DecodeOne(std::size_t i);
  bool DecodeAsBricksAre(const BenchBytes& stored, std::byte* out) const;

  BenchFilter Filter = BenchFilter::None;
  ChunkDecoder Decoder;
  std::size_t ElementSize = 1;
  std::size_t ChunkBytes = 0;
  std::vector<Stored> Chunks;
  std::vector<std::byte> Voxels;
};

} // namespace teravox::program
