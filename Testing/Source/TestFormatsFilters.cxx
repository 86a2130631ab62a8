// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ChunkDecoder.h"
#include "TestFormatsSupport.h"

#include <algorithm>
#include <array>
#include <hdf5.h>
#include <sstream>

namespace teravox::testing
{
namespace
{

using Bytes = std::vector<std::byte>;

struct Listed
{
  std::string Name;
  std::size_t VoxelBytes = 0;
  Int3 Size{};
};

std::vector<Listed> ListOf(const FormatFiles& files)
{
  std::vector<Listed> all;
  std::ifstream in(files.File("names.txt"));
  Listed one;
  while (in >> one.Name >> one.VoxelBytes >> one.Size[0] >> one.Size[1] >> one.Size[2])
  {
    all.push_back(one);
  }
  return all;
}

/// The filters of `v`, and a chunk of it as it is stored; by the HDF5 library.
struct StoredChunk
{
  std::vector<ChunkFilter> Filters;
  std::size_t Decoded = 0;
  std::size_t ElementSize = 1;
  Bytes Raw;
  std::uint32_t Mask = 0;
};

StoredChunk ReadStored(const std::string& file)
{
  StoredChunk chunk;
  const hid_t id = H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const hid_t dataset = H5Dopen2(id, "v", H5P_DEFAULT);
  const hid_t creation = H5Dget_create_plist(dataset);
  const hid_t type = H5Dget_type(dataset);
  std::array<hsize_t, 3> size{};
  H5Pget_chunk(creation, 3, size.data());
  chunk.ElementSize = H5Tget_size(type);
  chunk.Decoded = static_cast<std::size_t>(size[0] * size[1] * size[2]) * chunk.ElementSize;
  for (int i = 0; i < H5Pget_nfilters(creation); ++i)
  {
    ChunkFilter filter;
    filter.Parameters.resize(32);
    std::size_t n = filter.Parameters.size();
    unsigned flags = 0;
    unsigned config = 0;
    std::array<char, 64> name{};
    filter.Id = H5Pget_filter2(creation, static_cast<unsigned>(i), &flags, &n,
      filter.Parameters.data(), name.size(), name.data(), &config);
    filter.Parameters.resize(n);
    chunk.Filters.push_back(filter);
  }
  // Neither the first nor the second one, which may be special.
  const std::array<hsize_t, 3> offset{ size[0], 0, 0 };
  hsize_t stored = 0;
  H5Dget_chunk_storage_size(dataset, offset.data(), &stored);
  chunk.Raw.resize(static_cast<std::size_t>(stored));
  EXPECT_GE(H5Dread_chunk(dataset, H5P_DEFAULT, offset.data(), &chunk.Mask, chunk.Raw.data()), 0);
  H5Tclose(type);
  H5Pclose(creation);
  H5Dclose(dataset);
  H5Fclose(id);
  return chunk;
}

TEST(FormatsFilters, EveryFilterAndTypeComesBackBitForBit)
{
  TERAVOX_FORMAT_FILES(files, "filters");
  const std::vector<Listed> all = ListOf(*files);
  ASSERT_GT(all.size(), 60u);
  for (const Listed& one : all)
  {
    SCOPED_TRACE(one.Name);
    const auto source = OpenFormat(files->File(one.Name + ".h5"), FormatOptions(0, 0, "v"));
    ASSERT_TRUE(source);
    EXPECT_EQ(source->Info().Layout.Dimensions(0), one.Size);
    ExpectLevelIs(*source, 0, one.Size, files->Array(one.Name), one.VoxelBytes);
  }
}

TEST(FormatsFilters, NothingIsLeftToTheLibrary)
{
  TERAVOX_FORMAT_FILES(files, "filters");
  for (const Listed& one : ListOf(*files))
  {
    SCOPED_TRACE(one.Name);
    StoredChunk chunk = ReadStored(files->File(one.Name + ".h5"));
    const ChunkDecoder decoder(chunk.Filters, chunk.Decoded, chunk.ElementSize, false);
    EXPECT_TRUE(decoder.IsComplete());
    // Noise is stored without its filter where that wouldn't make it smaller.
    EXPECT_TRUE(chunk.Mask == 0 || one.Name.rfind("noise_", 0) == 0);
    EXPECT_LE(chunk.Raw.size(), decoder.LargestRawSize());
    Bytes out;
    const Status status = decoder.Decode(chunk.Raw, chunk.Mask, out);
    EXPECT_TRUE(status.Ok()) << status.Message();
    EXPECT_EQ(out.size(), chunk.Decoded);
  }
}

/// Decodes into a buffer with a margin behind the largest result, which nothing may touch.
Status DecodeGuarded(const ChunkDecoder& decoder, Bytes raw, Bytes& out)
{
  constexpr std::size_t margin = 4096;
  constexpr std::byte untouched{ 0x5a };
  const std::size_t largest = decoder.LargestRawSize();
  out.assign(largest + margin, untouched);
  const std::byte* const begin = out.data();
  Status status = decoder.Decode(raw, 0, out);
  if (out.data() == begin)
  {
    EXPECT_TRUE(std::all_of(
      begin + largest, begin + largest + margin, [&](std::byte b) { return b == untouched; }));
  }
  return status;
}

TEST(FormatsFilters, DamagedChunksAreCorruptOrOfTheRightSize)
{
  TERAVOX_FORMAT_FILES(files, "filters");
  std::mt19937 random(12);
  for (const char* name :
    { "lzf_u1", "lzf_f4", "szip_nn_u2", "szip_ec_u1", "szip_ec_u4", "blosc_u1", "blosc_i2",
      "blosc_u2", "blosc_u4", "blosc_f4", "blosc_f8", "zstd_u2", "zstd_u4", "bits_lz4_u2",
      "bits_zstd_f4", "bits_lz4_small_u1", "bits_zstd_small_f8", "lzf_fletcher" })
  {
    SCOPED_TRACE(name);
    const StoredChunk chunk = ReadStored(files->File(std::string(name) + ".h5"));
    const ChunkDecoder decoder(chunk.Filters, chunk.Decoded, chunk.ElementSize, false);
    ASSERT_EQ(chunk.Mask, 0u);
    Bytes out;
    ASSERT_TRUE(DecodeGuarded(decoder, chunk.Raw, out).Ok());
    ASSERT_EQ(out.size(), chunk.Decoded);
    const Bytes good = out;
    const std::size_t step = std::max<std::size_t>(1, chunk.Raw.size() / 400);
    for (std::size_t n = 0; n < chunk.Raw.size(); n += step)
    {
      // What a codec pads its last bits with may be missing.
      const Bytes raw(chunk.Raw.begin(), chunk.Raw.begin() + static_cast<std::ptrdiff_t>(n));
      const Status status = DecodeGuarded(decoder, raw, out);
      EXPECT_TRUE(status.Code() == StatusCode::Corrupt || out == good) << n << " bytes";
    }
    int damaged = 0;
    for (int trial = 0; trial < 2000; ++trial)
    {
      Bytes raw = chunk.Raw;
      for (int i = 0; i < 3; ++i)
      {
        const std::size_t within =
          trial % 2 == 0 ? std::min<std::size_t>(24, raw.size()) : raw.size();
        raw[random() % within] = static_cast<std::byte>(trial % 5 == 0 ? 0xff : random());
      }
      const Status status = DecodeGuarded(decoder, raw, out);
      damaged += status.Ok() ? 0 : 1;
      if (status.Ok())
      {
        EXPECT_EQ(out.size(), chunk.Decoded);
      }
      else
      {
        EXPECT_EQ(status.Code(), StatusCode::Corrupt);
        EXPECT_FALSE(status.Message().empty());
      }
    }
    EXPECT_GT(damaged, 100);
  }
}

/// A dataset whose chunks say that they went through a filter that nobody here has.
void WriteWithFilter(const std::string& file, int filter)
{
  const hid_t id = H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const std::array<hsize_t, 3> size{ 8, 8, 8 };
  const hid_t space = H5Screate_simple(3, size.data(), nullptr);
  const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_chunk(creation, 3, size.data());
  EXPECT_GE(H5Pset_filter(creation, filter, H5Z_FLAG_OPTIONAL, 0, nullptr), 0);
  const hid_t dataset =
    H5Dcreate2(id, "v", H5T_STD_U8LE, space, H5P_DEFAULT, creation, H5P_DEFAULT);
  const std::array<hsize_t, 3> offset{ 0, 0, 0 };
  const Bytes chunk(512, std::byte{ 1 });
  EXPECT_GE(H5Dwrite_chunk(dataset, H5P_DEFAULT, 0, offset.data(), chunk.size(), chunk.data()), 0);
  H5Dclose(dataset);
  H5Pclose(creation);
  H5Sclose(space);
  H5Fclose(id);
}

TEST(FormatsFilters, AnUnknownOneIsNamedWithWhatToInstall)
{
  const TemporaryFolder folder;
  const std::string file = folder.File("unknown.h5");
  for (const auto& [filter, name] :
    std::vector<std::pair<int, std::string>>{
      { 32013, "32013 (ZFP)" }, { 32026, "32026 (Blosc2)" }, { 40123, "40123 isn't installed" } })
  {
    SCOPED_TRACE(name);
    WriteWithFilter(file, filter);
    for (const char* text : { name.c_str(), "HDF5 filter plugin", "HDF5_PLUGIN_PATH", "h5repack" })
    {
      ExpectOpenFails(file, FormatOptions(), StatusCode::Unsupported, text);
    }
  }
}

TEST(FormatsFilters, ParametersThatCantBeAreLeftToTheLibrary)
{
  const auto complete = [](int id, std::vector<unsigned> parameters) {
    return ChunkDecoder({ { id, "", std::move(parameters) } }, 4096, 2, false).IsComplete();
  };
  EXPECT_TRUE(complete(ChunkFilter::Szip, { 141, 8, 16, 64 }));
  EXPECT_FALSE(complete(ChunkFilter::Szip, {}));
  EXPECT_FALSE(complete(ChunkFilter::Szip, { 141, 0, 16, 64 }));
  EXPECT_FALSE(complete(ChunkFilter::Szip, { 141, 8, 16, 0 }));
  EXPECT_FALSE(complete(ChunkFilter::Szip, { 141, 8, 16, 1u << 30 }));
  EXPECT_FALSE(complete(ChunkFilter::Szip, { 141, 8, 1u << 31, 64 }));
  EXPECT_TRUE(complete(ChunkFilter::Bitshuffle, {}));
  EXPECT_FALSE(complete(ChunkFilter::Bitshuffle, { 0, 4, 0, 0, 2 }));
  EXPECT_FALSE(complete(ChunkFilter::Bitshuffle, { 0, 4, ~0u, 0, 2 }));
  EXPECT_FALSE(complete(ChunkFilter::Bitshuffle, { 0, 4, 2, 12, 2 }));
  EXPECT_FALSE(complete(ChunkFilter::Bitshuffle, { 0, 4, 2, 0, 1 }));
  EXPECT_FALSE(complete(32026, {}));
  // Not known: an error, whatever the caller does.
  Bytes raw(16);
  Bytes out;
  EXPECT_EQ(ChunkDecoder({ { 32026, "", {} } }, 16, 1, false).Decode(raw, 0, out).Code(),
    StatusCode::Corrupt);
}

} // namespace
} // namespace teravox::testing
