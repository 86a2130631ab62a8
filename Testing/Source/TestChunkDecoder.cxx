// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ChunkDecoder.h"
#include "ChunkEncoder.h"

#include <gtest/gtest.h>
#include <random>

namespace teravox::testing
{

namespace
{
using Bytes = std::vector<std::byte>;

Bytes Compressible(std::size_t size)
{
  Bytes data(size);
  std::mt19937 random(3);
  for (std::size_t i = 0; i < size; ++i)
  {
    data[i] = static_cast<std::byte>(i / 64 + random() % 3);
  }
  return data;
}

Bytes Noise(std::size_t size)
{
  Bytes data(size);
  std::mt19937 random(4);
  for (std::byte& b : data)
  {
    b = static_cast<std::byte>(random());
  }
  return data;
}

std::vector<ChunkFilter> Filters(PyramidCompression compression, unsigned elementSize)
{
  switch (compression)
  {
    case PyramidCompression::Deflate:
      return { { ChunkFilter::Shuffle, "", { elementSize } }, { ChunkFilter::Deflate, "", { 6 } } };
    case PyramidCompression::LZ4:
      return { { ChunkFilter::LZ4, "", { 0 } } };
    case PyramidCompression::None:
    default:
      return {};
  }
}

constexpr std::array<PyramidCompression, 3> Compressions = { PyramidCompression::None,
  PyramidCompression::Deflate, PyramidCompression::LZ4 };
} // namespace

TEST(ChunkDecoder, UndoesTheEncoder)
{
  for (const PyramidCompression compression : Compressions)
  {
    for (const std::size_t element : { 1u, 2u, 4u, 8u })
    {
      for (const std::size_t size : { 8u, 64u, 4096u, 200000u })
      {
        for (const int level : { 1, 5, 12 })
        {
          ChunkEncoder encoder(compression, level, size, element);
          const ChunkDecoder decoder(
            Filters(compression, static_cast<unsigned>(element)), size, element, false);
          for (const Bytes& data : { Compressible(size), Noise(size), Bytes(size) })
          {
            const ChunkEncoder::Encoded encoded = encoder.Encode(data);
            EXPECT_LE(encoded.Size, size);
            Bytes raw(encoded.Data, encoded.Data + encoded.Size);
            Bytes out;
            const Status status = decoder.Decode(raw, encoded.FilterMask, out);
            ASSERT_TRUE(status.Ok()) << status.Message();
            EXPECT_TRUE(out == data);
          }
        }
      }
    }
  }
}

TEST(ChunkDecoder, DamagedDataAreCorruptOrOfTheRightSize)
{
  constexpr std::size_t size = 4096;
  std::mt19937 random(8);
  for (const PyramidCompression compression :
    { PyramidCompression::Deflate, PyramidCompression::LZ4 })
  {
    ChunkEncoder encoder(compression, 1, size, 2);
    const ChunkDecoder decoder(Filters(compression, 2), size, 2, false);
    const ChunkEncoder::Encoded encoded = encoder.Encode(Compressible(size));
    ASSERT_EQ(encoded.FilterMask, 0u);
    const Bytes good(encoded.Data, encoded.Data + encoded.Size);
    Bytes out;
    for (std::size_t n = 0; n < good.size(); ++n)
    {
      Bytes raw(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(n));
      const Status status = decoder.Decode(raw, 0, out);
      EXPECT_EQ(status.Code(), StatusCode::Corrupt) << n << " bytes";
    }
    for (int trial = 0; trial < 5000; ++trial)
    {
      Bytes raw = good;
      for (int i = 0; i < 3; ++i)
      {
        raw[random() % (trial % 2 == 0 ? 20 : raw.size())] = static_cast<std::byte>(random());
      }
      if (decoder.Decode(raw, 0, out).Ok())
      {
        EXPECT_EQ(out.size(), size);
      }
    }
  }
}

TEST(ChunkDecoder, NeverDecodesMoreThanAChunk)
{
  // One megabyte of zeros shrinks to a few KiB: a bomb for a chunk of 4096 bytes.
  ChunkEncoder encoder(PyramidCompression::Deflate, 9, 1 << 20, 1);
  const ChunkEncoder::Encoded bomb = encoder.Encode(Bytes(1 << 20));
  Bytes out;
  for (const bool twice : { false, true })
  {
    std::vector<ChunkFilter> filters{ { ChunkFilter::Deflate, "", {} } };
    if (twice)
    {
      filters.insert(filters.begin(), { ChunkFilter::LZ4, "", {} });
    }
    const ChunkDecoder decoder(filters, 4096, 1, false);
    Bytes raw(bomb.Data, bomb.Data + bomb.Size);
    EXPECT_EQ(decoder.Decode(raw, 0, out).Code(), StatusCode::Corrupt);
    EXPECT_LE(out.capacity(), 16384u);
  }
  // An LZ4 header that promises 2^63 bytes.
  const ChunkDecoder decoder({ { ChunkFilter::LZ4, "", {} } }, 4096, 1, false);
  Bytes raw(64, std::byte{ 0x7f });
  EXPECT_EQ(decoder.Decode(raw, 0, out).Code(), StatusCode::Corrupt);
  Bytes large(100000);
  EXPECT_EQ(decoder.Decode(large, 0, out).Code(), StatusCode::Corrupt);
}

TEST(ChunkDecoder, SwapsBigEndianElements)
{
  const ChunkDecoder decoder({}, 8, 4, true);
  Bytes raw(8);
  for (std::size_t i = 0; i < 8; ++i)
  {
    raw[i] = static_cast<std::byte>(i);
  }
  Bytes out;
  ASSERT_TRUE(decoder.Decode(raw, 0, out).Ok());
  const int expected[] = { 3, 2, 1, 0, 7, 6, 5, 4 };
  for (std::size_t i = 0; i < 8; ++i)
  {
    EXPECT_EQ(std::to_integer<int>(out[i]), expected[i]);
  }
}

TEST(ChunkDecoder, ChecksFletcher32)
{
  const ChunkDecoder decoder({ { ChunkFilter::Fletcher32, "", {} } }, 4, 1, false);
  // Words 0x0102, 0x0304: sums 0x0406 and 0x0508.
  const int stored[] = { 1, 2, 3, 4, 0x06, 0x04, 0x08, 0x05 };
  Bytes raw(8);
  for (std::size_t i = 0; i < 8; ++i)
  {
    raw[i] = static_cast<std::byte>(stored[i]);
  }
  Bytes copy = raw;
  Bytes out;
  EXPECT_TRUE(decoder.Decode(copy, 0, out).Ok());
  EXPECT_EQ(out.size(), 4u);
  raw[1] = std::byte{ 9 };
  EXPECT_EQ(decoder.Decode(raw, 0, out).Code(), StatusCode::Corrupt);
}

TEST(ChunkDecoder, LeavesOtherFiltersToTheLibrary)
{
  EXPECT_FALSE(ChunkDecoder({ { 6, "scaleoffset", {} } }, 8, 1, false).IsComplete());
  EXPECT_TRUE(ChunkDecoder({}, 8, 1, false).IsComplete());
}

} // namespace teravox::testing
