// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ChunkCodecs.h"

#include "ByteShuffle.h"
#include "ScratchBytes.h"

#include <algorithm>
#include <blosc.h>
#include <cerrno>
#include <climits>
#include <cstring>
#include <libaec.h>
#include <libdeflate.h>
#include <lz4.h>
#include <lzf.h>
#include <memory>
#include <new>
#include <zstd.h>

namespace teravox::codec
{

namespace
{
struct DecompressorDeleter
{
  void operator()(libdeflate_decompressor* d) const { libdeflate_free_decompressor(d); }
};

struct ContextDeleter
{
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};

ZSTD_DCtx* ZstandardContext()
{
  thread_local const std::unique_ptr<ZSTD_DCtx, ContextDeleter> context(ZSTD_createDCtx());
  if (!context)
  {
    throw std::bad_alloc();
  }
  return context.get();
}

Status TooLarge(const char* name, std::uint64_t size, std::size_t limit)
{
  return Corrupt(std::string("its ") + name + " header promises " + std::to_string(size) +
    " bytes, but a chunk has " + std::to_string(limit));
}

enum class Attempt
{
  Done,
  NeedsSpace,
  Damaged
};

/// Decodes with `attempt(out, actual)` into a buffer that grows up to the limit; once, if the size
/// is known.
template <typename Decode>
Status DecodeGrowing(const char* name, std::size_t stored, std::size_t limit, bool exact,
  Bytes& out, const Decode& attempt)
{
  std::size_t size = exact ? limit : std::min(limit, stored * 4 + 64);
  while (true)
  {
    out.resize(size);
    std::size_t actual = 0;
    const Attempt result = attempt(out, actual);
    if (result == Attempt::Done)
    {
      out.resize(actual);
      return {};
    }
    if (result == Attempt::Damaged)
    {
      return Corrupt(std::string("its ") + name + " stream is damaged");
    }
    if (size >= limit)
    {
      return Corrupt(std::string("its ") + name + " stream holds more than the " +
        std::to_string(limit) + " bytes that a chunk can have");
    }
    size = std::min(limit, size * 2);
  }
}
} // namespace

Status Corrupt(const std::string& cause)
{
  return { StatusCode::Corrupt, cause };
}

std::uint64_t BigEndianNumber(const std::byte* p, int bytes)
{
  std::uint64_t v = 0;
  for (int i = 0; i < bytes; ++i)
  {
    v = v << 8 | std::to_integer<std::uint64_t>(p[i]);
  }
  return v;
}

Status Inflate(const Bytes& in, std::size_t limit, bool exact, Bytes& out)
{
  thread_local const std::unique_ptr<libdeflate_decompressor, DecompressorDeleter> decompressor(
    libdeflate_alloc_decompressor());
  if (!decompressor)
  {
    throw std::bad_alloc();
  }
  return DecodeGrowing("deflate", in.size(), limit, exact, out,
    [&](Bytes& to, std::size_t& actual)
    {
      const libdeflate_result result = libdeflate_zlib_decompress(
        decompressor.get(), in.data(), in.size(), to.data(), to.size(), &actual);
      return result == LIBDEFLATE_SUCCESS         ? Attempt::Done
        : result == LIBDEFLATE_INSUFFICIENT_SPACE ? Attempt::NeedsSpace
                                                  : Attempt::Damaged;
    });
}

bool DecodeLZ4Block(const std::byte* in, std::size_t stored, std::byte* out, std::size_t size)
{
  if (stored > LZ4_MAX_INPUT_SIZE || size > LZ4_MAX_INPUT_SIZE)
  {
    return false;
  }
  const int n = LZ4_decompress_safe(reinterpret_cast<const char*>(in), reinterpret_cast<char*>(out),
    static_cast<int>(stored), static_cast<int>(size));
  return n >= 0 && static_cast<std::size_t>(n) == size;
}

Status DecodeLZ4(const Bytes& in, std::size_t limit, Bytes& out)
{
  constexpr std::size_t header = 12;
  if (in.size() < header)
  {
    return Corrupt("its LZ4 header is cut off");
  }
  const std::uint64_t total = BigEndianNumber(in.data(), 8);
  const std::uint64_t blockSize = std::min(BigEndianNumber(in.data() + 8, 4), total);
  if (total > limit)
  {
    return TooLarge("LZ4", total, limit);
  }
  if (total > 0 && (blockSize == 0 || blockSize > LZ4_MAX_INPUT_SIZE))
  {
    return Corrupt("its LZ4 block size is " + std::to_string(blockSize));
  }
  out.resize(static_cast<std::size_t>(total));
  std::size_t from = header;
  std::size_t to = 0;
  while (to < out.size())
  {
    const std::size_t block = std::min(static_cast<std::size_t>(blockSize), out.size() - to);
    if (in.size() - from < 4)
    {
      return Corrupt("its LZ4 data are cut off");
    }
    const auto stored = static_cast<std::size_t>(BigEndianNumber(in.data() + from, 4));
    from += 4;
    if (stored > in.size() - from)
    {
      return Corrupt("its LZ4 data are cut off");
    }
    if (stored == block)
    {
      std::memcpy(out.data() + to, in.data() + from, block);
    }
    else if (!DecodeLZ4Block(in.data() + from, stored, out.data() + to, block))
    {
      return Corrupt("its LZ4 data are damaged");
    }
    from += stored;
    to += block;
  }
  return {};
}

Status DecodeLZF(const Bytes& in, std::size_t limit, bool exact, Bytes& out)
{
  if (in.empty() || in.size() > UINT_MAX || limit > UINT_MAX)
  {
    return Corrupt("its LZF data have " + std::to_string(in.size()) + " bytes");
  }
  return DecodeGrowing("LZF", in.size(), limit, exact, out,
    [&](Bytes& to, std::size_t& actual)
    {
      errno = 0;
      actual = lzf_decompress(
        in.data(), static_cast<unsigned>(in.size()), to.data(), static_cast<unsigned>(to.size()));
      return actual > 0 ? Attempt::Done : errno == E2BIG ? Attempt::NeedsSpace : Attempt::Damaged;
    });
}

bool KnowsSzip(const std::vector<unsigned>& parameters)
{
  // Options, pixels per block, bits per pixel, pixels per scan line.
  constexpr unsigned mostBlocks = 128;
  return parameters.size() >= 4 && parameters[1] >= 2 && parameters[1] <= 32 &&
    parameters[1] % 2 == 0 &&
    (parameters[2] == 8 || parameters[2] == 16 || parameters[2] == 32 || parameters[2] == 64) &&
    parameters[3] >= parameters[1] && parameters[3] <= mostBlocks * parameters[1];
}

// The szip of HDF5 codes samples of at most two bytes: wider pixels are shuffled and coded byte by
// byte. Each scan line is filled up to whole blocks. libaec's own interface for szip doesn't tell
// whether the data ended early.
Status DecodeSzip(
  const Bytes& in, const std::vector<unsigned>& parameters, std::size_t limit, Bytes& out)
{
  constexpr std::size_t header = 4;
  constexpr unsigned highestByteFirst = 16;
  constexpr unsigned differences = 32;
  if (in.size() <= header)
  {
    return Corrupt("its szip data are cut off");
  }
  std::uint64_t total = 0;
  for (std::size_t i = 0; i < header; ++i)
  {
    total |= std::to_integer<std::uint64_t>(in[i]) << (8 * i);
  }
  if (total > limit)
  {
    return TooLarge("szip", total, limit);
  }
  const std::size_t pixelBytes = parameters[2] / 8;
  if (total == 0 || total % pixelBytes != 0)
  {
    return Corrupt("its szip header promises parts of values");
  }
  const std::size_t sampleBytes = pixelBytes > 2 ? 1 : pixelBytes;
  const std::size_t block = parameters[1];
  const std::size_t blocks = (parameters[3] + block - 1) / block;
  const std::size_t line = parameters[3] * sampleBytes;
  const std::size_t padded = blocks * block * sampleBytes;
  const auto wanted = static_cast<std::size_t>(total);
  const std::size_t lines = (wanted + line - 1) / line;
  const std::size_t needed = (lines - 1) * padded + wanted - (lines - 1) * line;
  out.resize(wanted);
  thread_local ScratchBytes kept;
  const bool shuffled = pixelBytes > sampleBytes;
  const bool direct = padded == line && !shuffled;
  Bytes& to = direct ? out : kept.Bytes();
  to.resize(direct ? wanted : lines * padded);

  aec_stream stream{};
  stream.next_in = reinterpret_cast<const unsigned char*>(in.data() + header);
  stream.avail_in = in.size() - header;
  stream.next_out = reinterpret_cast<unsigned char*>(to.data());
  stream.avail_out = to.size();
  stream.bits_per_sample = static_cast<unsigned>(8 * sampleBytes);
  stream.block_size = static_cast<unsigned>(block);
  stream.rsi = static_cast<unsigned>(blocks);
  stream.flags = ((parameters[0] & highestByteFirst) != 0 ? AEC_DATA_MSB : 0U) |
    ((parameters[0] & differences) != 0 ? AEC_DATA_PREPROCESS : 0U);
  if (aec_buffer_decode(&stream) != AEC_OK || stream.total_out < needed)
  {
    return Corrupt("its szip data are damaged");
  }
  if (padded != line)
  {
    for (std::size_t i = 0; i < lines; ++i)
    {
      const std::size_t n = std::min(line, wanted - i * line);
      std::byte* const at = shuffled ? to.data() : out.data();
      std::memmove(at + i * line, to.data() + i * padded, n);
    }
  }
  if (shuffled)
  {
    Unshuffle(to.data(), wanted / pixelBytes, pixelBytes, out.data());
  }
  kept.Trim();
  return {};
}

Status DecodeBlosc(const Bytes& in, std::size_t limit, Bytes& out)
{
  std::size_t total = 0;
  if (in.size() < BLOSC_MIN_HEADER_LENGTH ||
    blosc_cbuffer_validate(in.data(), in.size(), &total) != 0)
  {
    return Corrupt("its Blosc header is damaged");
  }
  if (total > limit)
  {
    return TooLarge("Blosc", total, limit);
  }
  out.resize(total);
  const int n = blosc_decompress_ctx(in.data(), out.data(), out.size(), 1);
  if (n < 0 || static_cast<std::size_t>(n) != total)
  {
    const char* library = blosc_cbuffer_complib(in.data());
    return Corrupt(std::string("its Blosc data are damaged, or coded by a codec that the Blosc "
                               "library here lacks (") +
      (library != nullptr ? library : "unknown") + ")");
  }
  return {};
}

bool DecodeZstandardBlock(const std::byte* in, std::size_t stored, std::byte* out, std::size_t size)
{
  // Into memory of a known size: neither a window nor what a frame says of it is needed.
  return ZSTD_decompressDCtx(ZstandardContext(), out, size, in, stored) == size;
}

Status DecodeZstandard(const Bytes& in, std::size_t limit, Bytes& out)
{
  const unsigned long long total = ZSTD_getFrameContentSize(in.data(), in.size());
  if (total == ZSTD_CONTENTSIZE_ERROR)
  {
    return Corrupt("its Zstandard header is damaged");
  }
  if (total != ZSTD_CONTENTSIZE_UNKNOWN && total > limit)
  {
    return TooLarge("Zstandard", total, limit);
  }
  out.resize(total == ZSTD_CONTENTSIZE_UNKNOWN ? limit : static_cast<std::size_t>(total));
  const std::size_t n =
    ZSTD_decompressDCtx(ZstandardContext(), out.data(), out.size(), in.data(), in.size());
  if (ZSTD_isError(n) != 0)
  {
    return Corrupt(std::string("its Zstandard data are damaged: ") + ZSTD_getErrorName(n));
  }
  out.resize(n);
  return {};
}

} // namespace teravox::codec
