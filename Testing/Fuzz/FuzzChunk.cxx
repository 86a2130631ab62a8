// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Raw chunks through every filter that is decoded here: an error, or exactly a chunk.
#include "ChunkDecoder.h"
#include "FuzzInput.h"

#include <utility>
#include <vector>

// Input: a byte that chooses filters, one for the element's size and the filter mask, one for the
// size of the chunk, 20 bytes of filter parameters, a byte that chooses more filters; the rest is
// the chunk.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  using namespace teravox;
  constexpr std::size_t header = 24;
  if (size < header)
  {
    return 0;
  }
  const std::size_t element = std::size_t{ 1 } << (data[1] & 3);
  const std::size_t bytes = (std::size_t{ data[2] } + 1) * 64 * element;
  std::vector<ChunkFilter> filters;
  const int known[] = { ChunkFilter::ScaleOffset, ChunkFilter::Shuffle, ChunkFilter::Deflate,
    ChunkFilter::LZ4, ChunkFilter::Fletcher32, ChunkFilter::Szip, ChunkFilter::LZF,
    ChunkFilter::Blosc, ChunkFilter::Bitshuffle, ChunkFilter::Zstandard };
  const int chosen = (data[0] & 31) | data[23] << 5;
  for (int bit = 0; bit < 10; ++bit)
  {
    if ((chosen >> bit & 1) != 0)
    {
      ChunkFilter filter;
      filter.Id = known[bit];
      for (std::size_t i = 0; i < 20; ++i)
      {
        filter.Parameters.push_back(data[3 + i]);
      }
      filters.push_back(std::move(filter));
    }
  }
  const ChunkDecoder decoder(filters, bytes, element, (data[1] & 4) != 0);
  std::vector<std::byte> raw(size - header);
  for (std::size_t i = 0; i < raw.size(); ++i)
  {
    raw[i] = static_cast<std::byte>(data[header + i]);
  }
  std::vector<std::byte> out;
  if (decoder.IsComplete() && decoder.Decode(raw, data[1] >> 3, out))
  {
    fuzz::Require(out.size() == bytes, "a decoded chunk has the size of a chunk");
  }
  return 0;
}
