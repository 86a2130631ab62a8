// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ChunkDecoder.h"

#include "Bitshuffle.h"
#include "ByteShuffle.h"
#include "ChunkCodecs.h"
#include "ScratchBytes.h"

#include <algorithm>
#include <cstring>

namespace teravox
{

namespace
{
using Bytes = std::vector<std::byte>;

using codec::BigEndianNumber;
using codec::Corrupt;

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

// Parameters of the scale-offset filter, as H5Zscaleoffset.c of the library has them.
struct ScaleOffset
{
  static constexpr std::size_t Count = 8; // without the fill value
  static constexpr unsigned IntegerClass = 0;

  static bool IsOfIntegers(const ChunkFilter& filter)
  {
    const std::vector<unsigned>& p = filter.Parameters;
    const std::size_t size = p.size() < Count ? 0 : p[4];
    return (size == 1 || size == 2 || size == 4 || size == 8) && p[3] == IntegerClass &&
      (p[7] != 1 || p.size() >= Count + (size + 3) / 4);
  }
};

// A chunk is its number of bits, the size of its least value, that value (little-endian), and the
// differences from it, each of that many bits, the highest first. All bits set is the fill value.
Status DecodeScaleOffset(
  const Bytes& in, const std::vector<unsigned>& parameters, std::size_t bytes, Bytes& out)
{
  constexpr std::size_t header = 21;
  const std::size_t element = parameters[4];
  const bool bigEndian = parameters[6] == 1;
  const bool fillDefined = parameters[7] == 1;
  if (bytes % element != 0 || bytes / element != parameters[2])
  {
    return Corrupt("its scale-offset filter is for " + std::to_string(parameters[2]) +
      " values of " + std::to_string(element) + " bytes");
  }
  if (in.size() < header)
  {
    return Corrupt("its scale-offset header is cut off");
  }
  const auto littleEndian = [&](std::size_t at, std::size_t n)
  {
    std::uint64_t v = 0;
    for (std::size_t i = 0; i < n; ++i)
    {
      v |= std::to_integer<std::uint64_t>(in[at + i]) << (8 * i);
    }
    return v;
  };
  const std::uint64_t bits = littleEndian(0, 4);
  const std::uint64_t least = littleEndian(5, std::to_integer<std::size_t>(in[4]) == 4 ? 4 : 8);
  const std::size_t count = bytes / element;
  if (bits > 8 * element || (bits > 0 && (in.size() - header) * 8 / bits < count))
  {
    return Corrupt("its scale-offset data are cut off");
  }
  out.resize(bytes);
  if (bits == 8 * element)
  {
    // As they are, in the order of the machine that wrote them: little-endian, as all of today's.
    std::memcpy(out.data(), in.data() + header, bytes);
    for (std::size_t i = 0; i < count && bigEndian; ++i)
    {
      std::reverse(out.begin() + static_cast<std::ptrdiff_t>(i * element),
        out.begin() + static_cast<std::ptrdiff_t>((i + 1) * element));
    }
    return {};
  }
  const std::uint64_t all = (std::uint64_t{ 1 } << bits) - 1;
  std::uint64_t fill = 0;
  if (fillDefined)
  {
    fill = parameters[8] | (element == 8 ? std::uint64_t{ parameters[9] } << 32 : 0);
  }
  const std::byte* next = in.data() + header;
  unsigned have = 0; // bits of `window` not yet taken
  std::uint64_t window = 0;
  for (std::size_t i = 0; i < count; ++i)
  {
    std::uint64_t value = 0;
    auto wanted = static_cast<unsigned>(bits);
    while (wanted > 0)
    {
      if (have == 0)
      {
        window = std::to_integer<std::uint64_t>(*next++);
        have = 8;
      }
      const unsigned take = std::min(wanted, have);
      have -= take;
      wanted -= take;
      value = value << take | (window >> have & ((std::uint64_t{ 1 } << take) - 1));
    }
    value = fillDefined && value == all ? fill : value + least;
    for (std::size_t b = 0; b < element; ++b)
    {
      out[i * element + (bigEndian ? element - 1 - b : b)] =
        static_cast<std::byte>(value >> (8 * b) & 0xffu);
    }
  }
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
    [this](const ChunkFilter& f)
    {
      switch (f.Id)
      {
        case ChunkFilter::Deflate:
        case ChunkFilter::Shuffle:
        case ChunkFilter::Fletcher32:
        case ChunkFilter::LZF:
        case ChunkFilter::Blosc:
        case ChunkFilter::LZ4:
        case ChunkFilter::Zstandard:
          return true;
        case ChunkFilter::Szip:
          return codec::KnowsSzip(f.Parameters);
        case ChunkFilter::ScaleOffset:
          return ScaleOffset::IsOfIntegers(f);
        case ChunkFilter::Bitshuffle:
          return Bitshuffle(f.Parameters, this->ElementSize).IsKnown();
        default:
          return false;
      }
    });
}

std::size_t ChunkDecoder::LargestRawSize() const
{
  // Codecs grow incompressible data by less than 1 %, plus headers, at each stage.
  std::size_t size = this->ChunkBytes_;
  for (const ChunkFilter& filter : this->Filters_)
  {
    size += this->ChunkBytes_ / 64 + 1024;
    if (filter.Id == ChunkFilter::Bitshuffle)
    {
      size += Bitshuffle(filter.Parameters, this->ElementSize).LargestGrowth(this->ChunkBytes_);
    }
  }
  return size;
}

std::size_t ChunkDecoder::ScratchSize() const
{
  std::size_t size = this->Filters_.size() > 1 ? this->LargestRawSize() : 0;
  for (const ChunkFilter& filter : this->Filters_)
  {
    // Two blocks, which may be the whole chunk; szip's lines are padded to less than twice their
    // length.
    const bool needsBlocks = filter.Id == ChunkFilter::Bitshuffle ||
      filter.Id == ChunkFilter::Blosc || filter.Id == ChunkFilter::Szip;
    size += needsBlocks ? 2 * this->LargestRawSize() : 0;
  }
  return size;
}

std::size_t ChunkDecoder::SizeBefore(
  std::size_t filter, std::uint32_t filterMask, bool& exact) const
{
  std::size_t size = this->ChunkBytes_;
  for (std::size_t i = 0; i < filter; ++i)
  {
    const ChunkFilter& before = this->Filters_[i];
    if (!IsApplied(i, filterMask) || before.Id == ChunkFilter::Shuffle ||
      (before.Id == ChunkFilter::Bitshuffle &&
        Bitshuffle(before.Parameters, this->ElementSize).KeepsSize()))
    {
      continue;
    }
    if (before.Id != ChunkFilter::Fletcher32)
    {
      exact = false;
      return this->LargestRawSize();
    }
    size += 4;
  }
  exact = true;
  return size;
}

Status ChunkDecoder::Decode(Bytes& raw, std::uint32_t filterMask, Bytes& out) const
{
  if (!this->IsComplete())
  {
    return Corrupt("it has a filter that isn't known here");
  }
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
        status = codec::Inflate(*current, size, exact, next);
        break;
      case ChunkFilter::Szip:
        status = codec::DecodeSzip(*current, filter.Parameters, size, next);
        break;
      case ChunkFilter::LZF:
        status = codec::DecodeLZF(*current, size, exact, next);
        break;
      case ChunkFilter::Blosc:
        status = codec::DecodeBlosc(*current, size, next);
        break;
      case ChunkFilter::LZ4:
        status = codec::DecodeLZ4(*current, size, next);
        break;
      case ChunkFilter::Bitshuffle:
        status = Bitshuffle(filter.Parameters, this->ElementSize).Decode(*current, size, next);
        break;
      case ChunkFilter::Zstandard:
        status = codec::DecodeZstandard(*current, size, next);
        break;
      case ChunkFilter::ScaleOffset:
        status = !exact ? Corrupt("its scale-offset filter comes after one that changes its size")
                        : DecodeScaleOffset(*current, filter.Parameters, size, next);
        break;
      case ChunkFilter::Shuffle:
      {
        const std::size_t element =
          filter.Parameters.empty() ? this->ElementSize : filter.Parameters[0];
        if (element <= 1 || element > current->size())
        {
          continue;
        }
        const std::size_t n = current->size() / element;
        next.resize(current->size());
        Unshuffle(current->data(), n, element, next.data());
        std::copy(current->begin() + static_cast<std::ptrdiff_t>(n * element), current->end(),
          next.begin() + static_cast<std::ptrdiff_t>(n * element));
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
