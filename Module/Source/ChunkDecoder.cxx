// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ChunkDecoder.h"

#include "ScratchBytes.h"

#include <algorithm>
#include <cstring>
#include <libdeflate.h>
#include <limits>
#include <lz4.h>
#include <memory>
#include <new>

namespace teravox
{

namespace
{
using Bytes = std::vector<std::byte>;

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

struct DecompressorDeleter
{
  void operator()(libdeflate_decompressor* d) const { libdeflate_free_decompressor(d); }
};

Status Inflate(const Bytes& in, std::size_t limit, bool exact, Bytes& out)
{
  thread_local const std::unique_ptr<libdeflate_decompressor, DecompressorDeleter> decompressor(
    libdeflate_alloc_decompressor());
  if (!decompressor)
  {
    throw std::bad_alloc();
  }
  // With the size known there is one attempt; else the buffer grows up to the limit.
  std::size_t size = exact ? limit : std::min(limit, in.size() * 4 + 64);
  while (true)
  {
    out.resize(size);
    std::size_t actual = 0;
    const libdeflate_result result = libdeflate_zlib_decompress(
      decompressor.get(), in.data(), in.size(), out.data(), out.size(), &actual);
    if (result == LIBDEFLATE_SUCCESS)
    {
      out.resize(actual);
      return {};
    }
    if (result != LIBDEFLATE_INSUFFICIENT_SPACE)
    {
      return Corrupt("its deflate stream is damaged");
    }
    if (size >= limit)
    {
      return Corrupt("its deflate stream holds more than the " + std::to_string(limit) +
        " bytes that a chunk can have");
    }
    size = std::min(limit, size * 2);
  }
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
    return Corrupt("its LZ4 header promises " + std::to_string(total) + " bytes, but a chunk has " +
      std::to_string(limit));
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
    if (stored > in.size() - from || stored > LZ4_MAX_INPUT_SIZE)
    {
      return Corrupt("its LZ4 data are cut off");
    }
    if (stored == block)
    {
      std::memcpy(out.data() + to, in.data() + from, block);
    }
    else
    {
      const int n = LZ4_decompress_safe(reinterpret_cast<const char*>(in.data() + from),
        reinterpret_cast<char*>(out.data() + to), static_cast<int>(stored),
        static_cast<int>(block));
      if (n < 0 || static_cast<std::size_t>(n) != block)
      {
        return Corrupt("its LZ4 data are damaged");
      }
    }
    from += stored;
    to += block;
  }
  return {};
}

// With the size known, whole elements are written at once.
template <std::size_t ElementSize>
void Interleave(const std::byte* in, std::size_t n, std::byte* out)
{
  for (std::size_t i = 0; i < n; ++i)
  {
    for (std::size_t b = 0; b < ElementSize; ++b)
    {
      out[i * ElementSize + b] = in[b * n + i];
    }
  }
}

void Unshuffle(const Bytes& in, std::size_t elementSize, Bytes& out)
{
  out.resize(in.size());
  const std::size_t n = in.size() / elementSize;
  switch (elementSize)
  {
    case 2:
      Interleave<2>(in.data(), n, out.data());
      break;
    case 4:
      Interleave<4>(in.data(), n, out.data());
      break;
    case 8:
      Interleave<8>(in.data(), n, out.data());
      break;
    default:
      for (std::size_t b = 0; b < elementSize; ++b)
      {
        const std::byte* from = in.data() + b * n;
        std::byte* to = out.data() + b;
        for (std::size_t i = 0; i < n; ++i)
        {
          to[i * elementSize] = from[i];
        }
      }
  }
  const std::size_t done = n * elementSize;
  std::copy(in.begin() + static_cast<std::ptrdiff_t>(done), in.end(),
    out.begin() + static_cast<std::ptrdiff_t>(done));
}

// The checksum of HDF5's filter 3: Fletcher's sums over big-endian 16-bit words.
std::uint32_t Fletcher32(const std::byte* data, std::size_t size)
{
  std::uint32_t sum1 = 0;
  std::uint32_t sum2 = 0;
  const auto fold = [&]
  {
    sum1 = (sum1 & 0xffffu) + (sum1 >> 16);
    sum2 = (sum2 & 0xffffu) + (sum2 >> 16);
  };
  std::size_t words = size / 2;
  while (words > 0)
  {
    // 360 words are the most that can't overflow sum2.
    const std::size_t n = std::min<std::size_t>(words, 360);
    for (std::size_t i = 0; i < n; ++i, data += 2)
    {
      sum1 += static_cast<std::uint32_t>(BigEndianNumber(data, 2));
      sum2 += sum1;
    }
    words -= n;
    fold();
  }
  if (size % 2 != 0)
  {
    sum1 += std::to_integer<std::uint32_t>(*data) << 8;
    sum2 += sum1;
    fold();
  }
  fold();
  return sum2 << 16 | sum1;
}

Status CheckFletcher32(Bytes& data)
{
  if (data.size() < 4)
  {
    return Corrupt("its checksum is cut off");
  }
  const std::size_t size = data.size() - 4;
  std::uint32_t stored = 0;
  for (std::size_t i = 0; i < 4; ++i)
  {
    stored |= std::to_integer<std::uint32_t>(data[size + i]) << (8 * i);
  }
  const std::uint32_t sum = Fletcher32(data.data(), size);
  // Libraries before 1.6.3 stored the bytes of each half in the other order.
  const std::uint32_t old = (sum & 0x00ff00ffu) << 8 | (sum & 0xff00ff00u) >> 8;
  if (stored != sum && stored != old)
  {
    return Corrupt("its checksum is wrong");
  }
  data.resize(size);
  return {};
}

void SwapBytes(Bytes& data, std::size_t elementSize)
{
  for (std::size_t i = 0; i + elementSize <= data.size(); i += elementSize)
  {
    std::reverse(data.begin() + static_cast<std::ptrdiff_t>(i),
      data.begin() + static_cast<std::ptrdiff_t>(i + elementSize));
  }
}

bool IsApplied(std::size_t filter, std::uint32_t mask)
{
  return filter >= 32 || (mask >> filter & 1u) == 0;
}
} // namespace

ChunkDecoder::ChunkDecoder(
  std::vector<ChunkFilter> filters, std::size_t chunkBytes, std::size_t elementSize, bool bigEndian)
  : Filters_(std::move(filters))
  , ChunkBytes_(chunkBytes)
  , ElementSize(elementSize)
  , BigEndian(bigEndian)
{
}

bool ChunkDecoder::IsComplete() const
{
  return std::all_of(this->Filters_.begin(), this->Filters_.end(),
    [](const ChunkFilter& f)
    {
      return f.Id == ChunkFilter::Deflate || f.Id == ChunkFilter::Shuffle ||
        f.Id == ChunkFilter::Fletcher32 || f.Id == ChunkFilter::LZ4;
    });
}

std::size_t ChunkDecoder::LargestRawSize() const
{
  // Deflate and LZ4 grow incompressible data by less than 1 %, plus headers, at each stage.
  return this->Filters_.empty()
    ? this->ChunkBytes_
    : this->ChunkBytes_ + (this->ChunkBytes_ / 64 + 1024) * this->Filters_.size();
}

std::size_t ChunkDecoder::ScratchSize() const
{
  return this->Filters_.size() > 1 ? this->LargestRawSize() : 0;
}

std::size_t ChunkDecoder::SizeBefore(
  std::size_t filter, std::uint32_t filterMask, bool& exact) const
{
  std::size_t size = this->ChunkBytes_;
  for (std::size_t i = 0; i < filter; ++i)
  {
    if (!IsApplied(i, filterMask))
    {
      continue;
    }
    const int id = this->Filters_[i].Id;
    if (id == ChunkFilter::Fletcher32)
    {
      size += 4;
    }
    else if (id != ChunkFilter::Shuffle)
    {
      exact = false;
      return this->LargestRawSize();
    }
  }
  exact = true;
  return size;
}

Status ChunkDecoder::Decode(Bytes& raw, std::uint32_t filterMask, Bytes& out) const
{
  if (raw.size() > this->LargestRawSize())
  {
    return Corrupt("it is stored in " + std::to_string(raw.size()) + " bytes, but decodes to " +
      std::to_string(this->ChunkBytes_));
  }
  thread_local ScratchBytes kept;
  Bytes& scratch = kept.Bytes();
  Bytes* current = &raw;
  for (std::size_t i = this->Filters_.size(); i-- > 0;)
  {
    if (!IsApplied(i, filterMask))
    {
      continue;
    }
    const ChunkFilter& filter = this->Filters_[i];
    Bytes& next = current == &out ? scratch : out;
    bool exact = true;
    const std::size_t size = this->SizeBefore(i, filterMask, exact);
    Status status;
    switch (filter.Id)
    {
      case ChunkFilter::Deflate:
        status = Inflate(*current, size, exact, next);
        break;
      case ChunkFilter::LZ4:
        status = DecodeLZ4(*current, size, next);
        break;
      case ChunkFilter::Shuffle:
      {
        const std::size_t element =
          filter.Parameters.empty() ? this->ElementSize : filter.Parameters[0];
        if (element <= 1 || element > current->size())
        {
          continue;
        }
        Unshuffle(*current, element, next);
        break;
      }
      case ChunkFilter::Fletcher32:
        status = CheckFletcher32(*current);
        if (!status.Ok())
        {
          return status;
        }
        continue;
      default:
        return Corrupt("its filter " + std::to_string(filter.Id) + " isn't known");
    }
    if (!status.Ok())
    {
      return status;
    }
    current = &next;
  }
  if (current->size() != this->ChunkBytes_)
  {
    return Corrupt("it has " + std::to_string(current->size()) + " bytes instead of " +
      std::to_string(this->ChunkBytes_));
  }
  if (this->BigEndian && this->ElementSize > 1)
  {
    SwapBytes(*current, this->ElementSize);
  }
  if (current != &out)
  {
    out.swap(*current);
  }
  kept.Trim();
  return {};
}

} // namespace teravox
