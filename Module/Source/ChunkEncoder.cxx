// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ChunkEncoder.h"

#include <algorithm>
#include <libdeflate.h>
#include <lz4.h>
#include <lz4hc.h>
#include <new>

namespace teravox
{

namespace
{
constexpr std::size_t LZ4Header = 16; // total size, block size, size of the one block

void PutBigEndian(std::byte* to, std::uint64_t value, int bytes)
{
  for (int i = 0; i < bytes; ++i)
  {
    to[i] = static_cast<std::byte>(value >> (8 * (bytes - 1 - i)) & 0xffu);
  }
}

void Shuffle(const std::vector<std::byte>& in, std::size_t elementSize, std::vector<std::byte>& out)
{
  out.resize(in.size());
  const std::size_t n = in.size() / elementSize;
  for (std::size_t b = 0; b < elementSize; ++b)
  {
    const std::byte* from = in.data() + b;
    std::byte* to = out.data() + b * n;
    for (std::size_t i = 0; i < n; ++i)
    {
      to[i] = from[i * elementSize];
    }
  }
}
} // namespace

struct ChunkEncoder::Tables
{
  explicit Tables(int level)
    : Compressor(libdeflate_alloc_compressor(level))
  {
    if (this->Compressor == nullptr)
    {
      throw std::bad_alloc();
    }
  }
  ~Tables() { libdeflate_free_compressor(this->Compressor); }
  Tables(const Tables&) = delete;
  Tables& operator=(const Tables&) = delete;
  Tables(Tables&&) = delete;
  Tables& operator=(Tables&&) = delete;

  libdeflate_compressor* Compressor;
};

ChunkEncoder::ChunkEncoder(
  PyramidCompression compression, int level, std::size_t chunkBytes, std::size_t elementSize)
  : Compression(compression)
  , Level(std::clamp(level, 1, 12))
  , ElementSize(elementSize)
{
  if (compression == PyramidCompression::Deflate)
  {
    this->Compressor = std::make_unique<Tables>(this->Level);
  }
  // Output that isn't smaller than the chunk isn't wanted.
  this->Output.resize(compression == PyramidCompression::None ? 0 : chunkBytes);
}

ChunkEncoder::~ChunkEncoder() = default;

std::size_t ChunkEncoder::ScratchSize(PyramidCompression compression, std::size_t chunkBytes)
{
  // libdeflate's tables take less than 10 MB at the highest levels, less than 1 MB at the lowest.
  constexpr std::size_t tables = 1 << 20;
  switch (compression)
  {
    case PyramidCompression::Deflate:
      return 2 * chunkBytes + tables;
    case PyramidCompression::LZ4:
      return chunkBytes + tables;
    case PyramidCompression::None:
    default:
      return 0;
  }
}

ChunkEncoder::Encoded ChunkEncoder::Encode(const std::vector<std::byte>& raw)
{
  std::size_t size = 0;
  if (this->Compression == PyramidCompression::Deflate)
  {
    size = this->Deflate(raw);
  }
  else if (this->Compression == PyramidCompression::LZ4)
  {
    size = this->CompressLZ4(raw);
  }
  if (size == 0)
  {
    const std::uint32_t none = this->Compression == PyramidCompression::None ? 0u
      : this->Compression == PyramidCompression::LZ4                         ? 1u
                                                                             : 3u;
    return { raw.data(), raw.size(), none };
  }
  return { this->Output.data(), size, 0 };
}

std::size_t ChunkEncoder::Deflate(const std::vector<std::byte>& raw)
{
  const std::vector<std::byte>* in = &raw;
  if (this->ElementSize > 1)
  {
    Shuffle(raw, this->ElementSize, this->Shuffled);
    in = &this->Shuffled;
  }
  return libdeflate_zlib_compress(
    this->Compressor->Compressor, in->data(), in->size(), this->Output.data(), this->Output.size());
}

std::size_t ChunkEncoder::CompressLZ4(const std::vector<std::byte>& raw)
{
  if (raw.size() <= LZ4Header || raw.size() > LZ4_MAX_INPUT_SIZE)
  {
    return 0;
  }
  // At least one byte is gained: a block as long as its input would mean "not compressed".
  const int room = static_cast<int>(raw.size() - LZ4Header);
  const char* from = reinterpret_cast<const char*>(raw.data());
  char* to = reinterpret_cast<char*>(this->Output.data() + LZ4Header);
  const int n = this->Level <= 1
    ? LZ4_compress_default(from, to, static_cast<int>(raw.size()), room)
    : LZ4_compress_HC(from, to, static_cast<int>(raw.size()), room, this->Level);
  if (n <= 0)
  {
    return 0;
  }
  PutBigEndian(this->Output.data(), raw.size(), 8);
  PutBigEndian(this->Output.data() + 8, raw.size(), 4);
  PutBigEndian(this->Output.data() + 12, static_cast<std::uint64_t>(n), 4);
  return LZ4Header + static_cast<std::size_t>(n);
}

} // namespace teravox
