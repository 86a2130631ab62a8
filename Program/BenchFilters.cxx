// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BenchFilters.h"

#include "ChunkDecoder.h"

#include <algorithm>
#include <blosc.h>
#include <lz4.h>
#include <lzf.h>
#include <memory>
#include <zstd.h>

namespace teravox::program
{
namespace
{

constexpr int ZstandardLevel = 3;
constexpr int BloscLevel = 5;
constexpr std::size_t BitshuffleBlock = 8192; // bytes, as its library chooses

struct FreeContext
{
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};

void PutBigEndian(BenchBytes& out, std::uint64_t value, int bytes)
{
  for (int i = bytes; i-- > 0;)
  {
    out.push_back(static_cast<std::byte>(value >> (8 * i) & 0xff));
  }
}

/// All first bits of the elements, then all second ones; a multiple of eight elements.
BenchBytes Transposed(const std::byte* in, std::size_t bytes, std::size_t elementSize)
{
  BenchBytes out(bytes, std::byte{ 0 });
  const std::size_t elements = bytes / elementSize;
  for (std::size_t i = 0; i < bytes; ++i)
  {
    const std::size_t element = i / elementSize;
    const auto value = std::to_integer<unsigned>(in[i]);
    for (std::size_t bit = 0; bit < 8; ++bit)
    {
      const std::size_t row = i % elementSize * 8 + bit;
      out[row * (elements / 8) + element / 8] |=
        static_cast<std::byte>((value >> bit & 1U) << (element % 8));
    }
  }
  return out;
}

BenchBytes EncodeBitshuffle(const BenchBytes& raw, std::size_t elementSize)
{
  BenchBytes out;
  PutBigEndian(out, raw.size(), 8);
  PutBigEndian(out, BitshuffleBlock, 4);
  for (std::size_t at = 0; at < raw.size(); at += BitshuffleBlock)
  {
    const std::size_t size = std::min(BitshuffleBlock, raw.size() - at);
    const BenchBytes bits = Transposed(raw.data() + at, size, elementSize);
    BenchBytes packed(static_cast<std::size_t>(LZ4_compressBound(static_cast<int>(size))));
    const int n = LZ4_compress_default(reinterpret_cast<const char*>(bits.data()),
      reinterpret_cast<char*>(packed.data()), static_cast<int>(size),
      static_cast<int>(packed.size()));
    PutBigEndian(out, static_cast<std::uint64_t>(n), 4);
    out.insert(out.end(), packed.begin(), packed.begin() + n);
  }
  return out;
}

} // namespace

std::optional<BenchFilterCall> CallOf(
  BenchFilter filter, std::size_t elementSize, std::size_t chunkBytes)
{
  const auto element = static_cast<unsigned>(elementSize);
  const auto chunk = static_cast<unsigned>(chunkBytes);
  switch (filter)
  {
    case BenchFilter::LZF:
      return BenchFilterCall{ ChunkFilter::LZF, { 4, LZF_VERSION, chunk } };
    case BenchFilter::Blosc:
      return BenchFilterCall{ ChunkFilter::Blosc,
        { 2, 2, element, chunk, BloscLevel, BLOSC_SHUFFLE, BLOSC_LZ4 } };
    case BenchFilter::BitshuffleLZ4:
      return BenchFilterCall{ ChunkFilter::Bitshuffle, { 0, 4, element, 0, 2 } };
    case BenchFilter::Zstandard:
      return BenchFilterCall{ ChunkFilter::Zstandard, { ZstandardLevel } };
    default:
      return std::nullopt;
  }
}

BenchBytes EncodeChunk(BenchFilter filter, const BenchBytes& raw, std::size_t elementSize)
{
  if (filter == BenchFilter::BitshuffleLZ4)
  {
    return EncodeBitshuffle(raw, elementSize);
  }
  BenchBytes out(std::max(ZSTD_compressBound(raw.size()), raw.size() + BLOSC_MAX_OVERHEAD));
  std::size_t size = 0;
  if (filter == BenchFilter::LZF)
  {
    size = lzf_compress(raw.data(), static_cast<unsigned>(raw.size()), out.data(),
      static_cast<unsigned>(raw.size() - 1));
  }
  else if (filter == BenchFilter::Blosc)
  {
    const int n = blosc_compress_ctx(BloscLevel, BLOSC_SHUFFLE, elementSize, raw.size(), raw.data(),
      out.data(), out.size(), BLOSC_LZ4_COMPNAME, 0, 1);
    size = static_cast<std::size_t>(std::max(n, 0));
  }
  else
  {
    const std::size_t n =
      ZSTD_compress(out.data(), out.size(), raw.data(), raw.size(), ZstandardLevel);
    size = ZSTD_isError(n) != 0 ? 0 : n;
  }
  out.resize(size < raw.size() ? size : 0);
  return out;
}

std::optional<bool> DecodeByLibrary(
  BenchFilter filter, const BenchBytes& stored, std::byte* out, std::size_t size)
{
  thread_local const std::unique_ptr<ZSTD_DCtx, FreeContext> context(ZSTD_createDCtx());
  switch (filter)
  {
    case BenchFilter::LZF:
      return lzf_decompress(stored.data(), static_cast<unsigned>(stored.size()), out,
               static_cast<unsigned>(size)) == size;
    case BenchFilter::Blosc:
      return blosc_decompress_ctx(stored.data(), out, size, 1) == static_cast<int>(size);
    case BenchFilter::Zstandard:
      return ZSTD_decompressDCtx(context.get(), out, size, stored.data(), stored.size()) == size;
    default:
      return std::nullopt;
  }
}

} // namespace teravox::program
