// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Bitshuffle.h"

#include "ByteShuffle.h"
#include "ChunkCodecs.h"
#include "ScratchBytes.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <type_traits>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace teravox
{

namespace
{
constexpr std::size_t GroupSize = 8; // elements whose bits share a byte

/// Of eight bytes of eight bits: bit j of byte i becomes bit i of byte j.
inline std::uint64_t TransposeBits(std::uint64_t x)
{
  std::uint64_t t = (x ^ x >> 7) & 0x00aa00aa00aa00aaULL;
  x ^= t ^ t << 7;
  t = (x ^ x >> 14) & 0x0000cccc0000ccccULL;
  x ^= t ^ t << 14;
  t = (x ^ x >> 28) & 0x00000000f0f0f0f0ULL;
  return x ^ t ^ t << 28;
}

#ifdef __SSE2__
/// Two at once.
inline __m128i TransposeBits(__m128i x)
{
  const auto step = [&x](auto shift, std::int64_t mask)
  {
    constexpr int n = decltype(shift)::value;
    const __m128i t = _mm_and_si128(_mm_xor_si128(x, _mm_srli_epi64(x, n)), _mm_set1_epi64x(mask));
    x = _mm_xor_si128(x, _mm_xor_si128(t, _mm_slli_epi64(t, n)));
  };
  step(std::integral_constant<int, 7>(), 0x00aa00aa00aa00aaLL);
  step(std::integral_constant<int, 14>(), 0x0000cccc0000ccccLL);
  step(std::integral_constant<int, 28>(), 0x00000000f0f0f0f0LL);
  return x;
}

/// Eight bytes of each of eight rows, to eight groups of eight bytes.
inline void UntransposeEight(const std::byte* from, std::size_t row, std::byte* to)
{
  const auto load = [&](std::size_t k)
  { return _mm_loadl_epi64(reinterpret_cast<const __m128i*>(from + k * row)); };
  const __m128i a0 = _mm_unpacklo_epi8(load(0), load(1));
  const __m128i a1 = _mm_unpacklo_epi8(load(2), load(3));
  const __m128i a2 = _mm_unpacklo_epi8(load(4), load(5));
  const __m128i a3 = _mm_unpacklo_epi8(load(6), load(7));
  const __m128i b0 = _mm_unpacklo_epi16(a0, a1);
  const __m128i b1 = _mm_unpackhi_epi16(a0, a1);
  const __m128i b2 = _mm_unpacklo_epi16(a2, a3);
  const __m128i b3 = _mm_unpackhi_epi16(a2, a3);
  auto* out = reinterpret_cast<__m128i*>(to);
  _mm_storeu_si128(out, TransposeBits(_mm_unpacklo_epi32(b0, b2)));
  _mm_storeu_si128(out + 1, TransposeBits(_mm_unpackhi_epi32(b0, b2)));
  _mm_storeu_si128(out + 2, TransposeBits(_mm_unpacklo_epi32(b1, b3)));
  _mm_storeu_si128(out + 3, TransposeBits(_mm_unpackhi_epi32(b1, b3)));
}
#endif

/// Of `n` elements, a multiple of eight: row 8 b + k has bit k of byte b of all elements, the
/// lowest bit of its bytes first. `planes` is room for n * elementSize bytes.
void Untranspose(
  const std::byte* in, std::size_t n, std::size_t elementSize, std::byte* planes, std::byte* out)
{
  const std::size_t row = n / GroupSize;
  std::byte* to = elementSize == 1 ? out : planes;
  for (std::size_t b = 0; b < elementSize; ++b)
  {
    const std::byte* const from = in + b * n;
    std::size_t g = 0;
#ifdef __SSE2__
    for (; g + 8 <= row; g += 8, to += 64)
    {
      UntransposeEight(from + g, row, to);
    }
#endif
    for (; g < row; ++g)
    {
      std::uint64_t bits = 0;
      for (std::size_t k = 0; k < 8; ++k)
      {
        bits |= std::to_integer<std::uint64_t>(from[k * row + g]) << (8 * k);
      }
      bits = TransposeBits(bits);
      std::memcpy(to, &bits, sizeof(bits));
      to += sizeof(bits);
    }
  }
  if (elementSize > 1)
  {
    Unshuffle(planes, n, elementSize, out);
  }
}

/// What the filter takes where no block size is given: blocks of 8 KiB.
std::size_t UsualBlockSize(std::size_t elementSize)
{
  constexpr std::size_t target = 8192;
  constexpr std::size_t least = 128;
  return std::max(target / elementSize / GroupSize * GroupSize, least);
}
} // namespace

Bitshuffle::Bitshuffle(const std::vector<unsigned>& parameters, std::size_t elementSize)
  : ElementSize(parameters.size() > 2 ? parameters[2] : elementSize)
  , Coding(parameters.size() > 4 ? parameters[4] : None)
{
  this->BlockSize = parameters.size() > 3 ? parameters[3] : 0;
  if (this->BlockSize == 0 && this->ElementSize > 0)
  {
    this->BlockSize = UsualBlockSize(this->ElementSize);
  }
}

bool Bitshuffle::IsKnown() const
{
  constexpr std::size_t largestElement = 256;
  return this->ElementSize > 0 && this->ElementSize <= largestElement &&
    this->BlockSize % GroupSize == 0 &&
    (this->Coding == None || this->Coding == LZ4 || this->Coding == Zstandard);
}

std::size_t Bitshuffle::LargestGrowth(std::size_t bytes) const
{
  if (this->KeepsSize() || !this->IsKnown())
  {
    return 0;
  }
  // Of each block its size, and what LZ4 or Zstandard add to data that don't get smaller.
  const std::size_t block = this->BlockSize * this->ElementSize;
  return (bytes / block + 2) * (4 + 64) + bytes / 64;
}

Status Bitshuffle::Decode(
  const std::vector<std::byte>& in, std::size_t limit, std::vector<std::byte>& out) const
{
  constexpr std::size_t header = 12;
  const bool coded = this->Coding != None;
  const Status cutOff = codec::Corrupt("its bitshuffle data are cut off");
  if (coded && in.size() < header)
  {
    return cutOff;
  }
  const std::uint64_t total = coded ? codec::BigEndianNumber(in.data(), 8) : in.size();
  const std::uint64_t blockBytes = coded ? codec::BigEndianNumber(in.data() + 8, 4)
                                         : std::uint64_t{ this->BlockSize } * this->ElementSize;
  if (total > limit)
  {
    return codec::Corrupt("its bitshuffle data are of " + std::to_string(total) +
      " bytes, but a chunk has " + std::to_string(limit));
  }
  if (total % this->ElementSize != 0 || blockBytes == 0 ||
    blockBytes % (GroupSize * this->ElementSize) != 0)
  {
    return codec::Corrupt("its bitshuffle blocks are of " + std::to_string(blockBytes) +
      " bytes in " + std::to_string(total) + ", its elements of " +
      std::to_string(this->ElementSize));
  }
  out.resize(static_cast<std::size_t>(total));
  const std::size_t group = GroupSize * this->ElementSize;
  const auto largest = static_cast<std::size_t>(std::min(blockBytes, total));
  thread_local ScratchBytes kept;
  std::vector<std::byte>& scratch = kept.Bytes();
  scratch.resize(2 * largest);
  std::size_t from = coded ? header : 0;
  std::size_t to = 0;
  while (out.size() - to >= group)
  {
    const std::size_t block = std::min(largest, (out.size() - to) / group * group);
    const std::byte* bits = in.data() + from;
    std::size_t stored = block;
    if (coded)
    {
      if (in.size() - from < 4)
      {
        return cutOff;
      }
      stored = static_cast<std::size_t>(codec::BigEndianNumber(bits, 4));
      from += 4;
      if (stored > in.size() - from)
      {
        return cutOff;
      }
      const bool good = this->Coding == LZ4
        ? codec::DecodeLZ4Block(in.data() + from, stored, scratch.data(), block)
        : codec::DecodeZstandardBlock(in.data() + from, stored, scratch.data(), block);
      if (!good)
      {
        return codec::Corrupt("its bitshuffle data are damaged");
      }
      bits = scratch.data();
    }
    Untranspose(bits, block / this->ElementSize, this->ElementSize, scratch.data() + largest,
      out.data() + to);
    from += stored;
    to += block;
  }
  // What makes no group of eight elements is stored as it is.
  if (in.size() - from < out.size() - to)
  {
    return cutOff;
  }
  std::copy_n(in.begin() + static_cast<std::ptrdiff_t>(from), out.size() - to,
    out.begin() + static_cast<std::ptrdiff_t>(to));
  kept.Trim();
  return {};
}

} // namespace teravox
