// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Types.h"

#include <cstddef>
#include <optional>
#include <vector>

namespace teravox::program
{

/// How `bench load` stores voxels.
enum class BenchFilter
{
  None,
  Deflate,
  ShuffleDeflate,
  LZ4,
  ScaleOffset,
  Szip,
  LZF,
  Blosc,
  BitshuffleLZ4,
  Zstandard
};

using BenchBytes = std::vector<std::byte>;

/// The number of the filter of one dataset that the program doesn't write itself, and its
/// parameters as h5py and the filters' plugins choose them; nothing for filters of the HDF5 library
/// (deflate, scale-offset, szip).
struct BenchFilterCall
{
  int Id = 0;
  std::vector<unsigned> Parameters;
};
std::optional<BenchFilterCall> CallOf(
  BenchFilter filter, std::size_t elementSize, std::size_t chunkBytes);

/// A chunk as such a filter stores it; empty where that isn't smaller. Requires: CallOf() has one.
BenchBytes EncodeChunk(BenchFilter filter, const BenchBytes& raw, std::size_t elementSize);

/// Lets LZF's, Blosc's or Zstandard's own library decode a chunk; false if it is damaged; nothing
/// for other filters.
std::optional<bool> DecodeByLibrary(
  BenchFilter filter, const BenchBytes& stored, std::byte* out, std::size_t size);

} // namespace teravox::program
