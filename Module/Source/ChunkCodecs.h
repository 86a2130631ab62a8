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

/// What the codecs' own libraries undo of a chunk, for ChunkDecoder. `limit` is the most bytes that
/// the result may have, or, where `exact` is said, what it has to have; no size found in the data
/// is trusted. `parameters` are those of the HDF5 filter. Thread: any. Errors: Corrupt, with a
/// cause that fits behind "... doesn't decode: ". Throw std::bad_alloc.
namespace codec
{
using Bytes = std::vector<std::byte>;

/// Filter 1, a zlib stream.
Status Inflate(const Bytes& in, std::size_t limit, bool exact, Bytes& out);

/// Filter 32004, LZ4 blocks behind a header.
Status DecodeLZ4(const Bytes& in, std::size_t limit, Bytes& out);

/// Filter 32000, one LZF block.
Status DecodeLZF(const Bytes& in, std::size_t limit, bool exact, Bytes& out);

/// Filter 4, szip: the coding of CCSDS 121.0.
Status DecodeSzip(
  const Bytes& in, const std::vector<unsigned>& parameters, std::size_t limit, Bytes& out);
/// Whether DecodeSzip() takes such parameters.
bool KnowsSzip(const std::vector<unsigned>& parameters);

/// Filter 32001, a container of Blosc 1 with any of its codecs.
Status DecodeBlosc(const Bytes& in, std::size_t limit, Bytes& out);

/// Filter 32015, a frame of Zstandard.
Status DecodeZstandard(const Bytes& in, std::size_t limit, Bytes& out);

/// One block of Zstandard's or LZ4's, alone; false if it doesn't decode to exactly `size` bytes.
bool DecodeZstandardBlock(
  const std::byte* in, std::size_t stored, std::byte* out, std::size_t size);
bool DecodeLZ4Block(const std::byte* in, std::size_t stored, std::byte* out, std::size_t size);

std::uint64_t BigEndianNumber(const std::byte* p, int bytes);
Status Corrupt(const std::string& cause);
} // namespace codec

} // namespace teravox
