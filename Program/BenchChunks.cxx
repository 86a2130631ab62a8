// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BenchChunks.h"

#include "BenchGrey.h"
#include "HDF5Handle.h"
#include "HDF5Lock.h"
#include "HDF5Types.h"
#include "PyramidWriter.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <fmt/format.h>
#include <hdf5.h>
#include <libdeflate.h>
#include <lz4.h>
#include <memory>
#include <thread>

namespace teravox::program
{
namespace
{

constexpr std::int64_t ChunkEdge = 64;
constexpr const char* PlainDataset = "/voxels";
constexpr std::array<BenchFilter, 10> AllFilters{ BenchFilter::None, BenchFilter::Deflate,
  BenchFilter::ShuffleDeflate, BenchFilter::LZ4, BenchFilter::ScaleOffset, BenchFilter::Szip,
  BenchFilter::LZF, BenchFilter::Blosc, BenchFilter::BitshuffleLZ4, BenchFilter::Zstandard };

struct FreeCompressor
{
  void operator()(libdeflate_compressor* c) const { libdeflate_free_compressor(c); }
};
struct FreeDecompressor
{
  void operator()(libdeflate_decompressor* d) const { libdeflate_free_decompressor(d); }
};

Status Failure(const std::string& fileName)
{
  return { StatusCode::InputOutput, fmt::format("{} can't be written or read again.", fileName) };
}

/// Offset of chunk i in a dataset, x fastest.
std::array<hsize_t, 3> OffsetOf(std::int64_t i, std::int64_t edge)
{
  const std::int64_t n = edge / ChunkEdge;
  return { static_cast<hsize_t>(i / (n * n) * ChunkEdge),
    static_cast<hsize_t>(i / n % n * ChunkEdge), static_cast<hsize_t>(i % n * ChunkEdge) };
}

Status WritePyramid(
  const std::string& fileName, PyramidCompression compression, ScalarType type, std::int64_t edge)
{
  GreyReader reader(type, edge);
  PyramidWriterOptions options;
  options.Compression = compression;
  return PyramidWriter::Write(fileName, reader, options).GetStatus();
}

Status SetFilter(hid_t creation, BenchFilter filter, ScalarType type, std::size_t chunkBytes)
{
  constexpr unsigned pixelsPerBlock = 16;
  if (const auto call = CallOf(filter, SizeOf(type), chunkBytes))
  {
    H5Pset_filter(
      creation, call->Id, H5Z_FLAG_OPTIONAL, call->Parameters.size(), call->Parameters.data());
  }
  else if (filter == BenchFilter::Szip)
  {
    H5Pset_szip(creation, H5_SZIP_NN_OPTION_MASK, pixelsPerBlock);
  }
  else if (filter == BenchFilter::ScaleOffset)
  {
    if (type == ScalarType::Float32 || type == ScalarType::Float64)
    {
      return { StatusCode::InvalidArgument, "The filter scale-offset is for integers." };
    }
    H5Pset_scaleoffset(creation, H5Z_SO_INT, H5Z_SO_INT_MINBITS_DEFAULT);
  }
  else
  {
    H5Pset_deflate(creation, 1);
  }
  return {};
}

/// A chunk through the codec's library, or through the HDF5 library where that has the filter.
bool WriteChunk(hid_t dataset, BenchFilter filter, ScalarType type,
  const std::array<hsize_t, 3>& offset, const BenchBytes& raw)
{
  BenchBytes stored;
  if (filter == BenchFilter::Deflate)
  {
    const std::unique_ptr<libdeflate_compressor, FreeCompressor> compressor(
      libdeflate_alloc_compressor(1));
    stored.resize(2 * raw.size());
    stored.resize(libdeflate_zlib_compress(
      compressor.get(), raw.data(), raw.size(), stored.data(), stored.size()));
  }
  else if (CallOf(filter, SizeOf(type), raw.size()))
  {
    stored = EncodeChunk(filter, raw, SizeOf(type));
  }
  else
  {
    const std::array<hsize_t, 3> size{ ChunkEdge, ChunkEdge, ChunkEdge };
    const HDF5Handle file(H5Dget_space(dataset));
    const HDF5Handle memory(H5Screate_simple(3, size.data(), nullptr));
    H5Sselect_hyperslab(file.Get(), H5S_SELECT_SET, offset.data(), nullptr, size.data(), nullptr);
    return H5Dwrite(dataset, HDF5FileType(type, false), memory.Get(), file.Get(), H5P_DEFAULT,
             raw.data()) >= 0;
  }
  const BenchBytes& written = stored.empty() ? raw : stored;
  return H5Dwrite_chunk(dataset, H5P_DEFAULT, stored.empty() ? 1 : 0, offset.data(), written.size(),
           written.data()) >= 0;
}

/// One dataset with a filter that the program reads but doesn't write.
Status WriteDataset(
  const std::string& fileName, BenchFilter filter, ScalarType type, std::int64_t edge)
{
  const HDF5Lock lock;
  const HDF5Handle file(H5Fcreate(fileName.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));
  const std::array<hsize_t, 3> extent{ static_cast<hsize_t>(edge), static_cast<hsize_t>(edge),
    static_cast<hsize_t>(edge) };
  const std::array<hsize_t, 3> chunk{ ChunkEdge, ChunkEdge, ChunkEdge };
  std::vector<std::byte> raw(ChunkEdge * ChunkEdge * ChunkEdge * SizeOf(type));
  const HDF5Handle creation(H5Pcreate(H5P_DATASET_CREATE));
  H5Pset_chunk(creation.Get(), 3, chunk.data());
  Status status = SetFilter(creation.Get(), filter, type, raw.size());
  if (!status.Ok())
  {
    return status;
  }
  const HDF5Handle space(H5Screate_simple(3, extent.data(), nullptr));
  const HDF5Handle dataset(H5Dcreate2(file.Get(), PlainDataset, HDF5FileType(type, false),
    space.Get(), H5P_DEFAULT, creation.Get(), H5P_DEFAULT));
  if (!dataset.Valid())
  {
    return Failure(fileName);
  }
  GreyReader reader(type, edge);
  const std::int64_t n = edge / ChunkEdge;
  for (std::int64_t i = 0; i < n * n * n; ++i)
  {
    const std::array<hsize_t, 3> offset = OffsetOf(i, edge);
    const Int3 start{ static_cast<std::int64_t>(offset[2]), static_cast<std::int64_t>(offset[1]),
      static_cast<std::int64_t>(offset[0]) };
    reader.ReadBox(start, { ChunkEdge, ChunkEdge, ChunkEdge }, raw.data());
    if (!WriteChunk(dataset.Get(), filter, type, offset, raw))
    {
      return Failure(fileName);
    }
  }
  return {};
}

/// The filters of a dataset, for ChunkDecoder.
std::vector<ChunkFilter> FiltersOf(hid_t dataset)
{
  std::vector<ChunkFilter> filters;
  const HDF5Handle creation(H5Dget_create_plist(dataset));
  for (int i = 0; i < H5Pget_nfilters(creation.Get()); ++i)
  {
    ChunkFilter filter;
    filter.Parameters.resize(32);
    std::size_t n = filter.Parameters.size();
    unsigned flags = 0;
    unsigned config = 0;
    filter.Id = H5Pget_filter2(creation.Get(), static_cast<unsigned>(i), &flags, &n,
      filter.Parameters.data(), 0, nullptr, &config);
    filter.Parameters.resize(std::min(n, filter.Parameters.size()));
    filters.push_back(std::move(filter));
  }
  return filters;
}

template <std::size_t Size>
void Unshuffle(const std::byte* from, std::size_t bytes, std::byte* to)
{
  const std::size_t n = bytes / Size;
  for (std::size_t i = 0; i < n; ++i)
  {
    for (std::size_t b = 0; b < Size; ++b)
    {
      to[i * Size + b] = from[b * n + i];
    }
  }
}

bool Inflate(const std::vector<std::byte>& stored, std::byte* out, std::size_t size)
{
  thread_local const std::unique_ptr<libdeflate_decompressor, FreeDecompressor> decompressor(
    libdeflate_alloc_decompressor());
  return libdeflate_zlib_decompress(decompressor.get(), stored.data(), stored.size(), out, size,
           nullptr) == LIBDEFLATE_SUCCESS;
}

bool DecodeShuffled(
  const std::vector<std::byte>& stored, std::size_t elementSize, std::byte* out, std::size_t size)
{
  thread_local std::vector<std::byte> scratch;
  scratch.resize(size);
  if (elementSize == 1)
  {
    return Inflate(stored, out, size);
  }
  const bool good = Inflate(stored, scratch.data(), size);
  if (elementSize == 2)
  {
    Unshuffle<2>(scratch.data(), size, out);
  }
  else
  {
    Unshuffle<4>(scratch.data(), size, out);
  }
  return good;
}

/// HDF5's LZ4 chunk: total size, block size, then size and data of the one block.
bool DecodeLZ4(const std::vector<std::byte>& stored, std::byte* out, std::size_t size)
{
  constexpr std::size_t header = 16;
  return LZ4_decompress_safe(reinterpret_cast<const char*>(stored.data() + header),
           reinterpret_cast<char*>(out), static_cast<int>(stored.size() - header),
           static_cast<int>(size)) == static_cast<int>(size);
}

} // namespace

const char* ToString(BenchFilter filter)
{
  switch (filter)
  {
    case BenchFilter::Deflate:
      return "deflate";
    case BenchFilter::ShuffleDeflate:
      return "shuffle+deflate";
    case BenchFilter::LZ4:
      return "lz4";
    case BenchFilter::ScaleOffset:
      return "scale-offset";
    case BenchFilter::Szip:
      return "szip";
    case BenchFilter::LZF:
      return "lzf";
    case BenchFilter::Blosc:
      return "blosc";
    case BenchFilter::BitshuffleLZ4:
      return "bitshuffle+lz4";
    case BenchFilter::Zstandard:
      return "zstd";
    case BenchFilter::None:
    default:
      return "none";
  }
}

Result<BenchFilter> ParseBenchFilter(const std::string& name)
{
  std::string names;
  for (const BenchFilter filter : AllFilters)
  {
    if (name == ToString(filter))
    {
      return filter;
    }
    names += (names.empty() ? "" : ", ") + std::string(ToString(filter));
  }
  return Status(
    StatusCode::InvalidArgument, fmt::format("'{}' is no filter; there are {}.", name, names));
}

bool HasPyramid(BenchFilter filter)
{
  return filter == BenchFilter::None || filter == BenchFilter::ShuffleDeflate ||
    filter == BenchFilter::LZ4;
}

std::string DatasetOf(BenchFilter filter)
{
  return HasPyramid(filter) ? "/Pyramid/0" : PlainDataset;
}

Status WriteBenchFile(
  const std::string& fileName, BenchFilter filter, ScalarType type, std::int64_t edge)
{
  switch (filter)
  {
    case BenchFilter::ShuffleDeflate:
      return WritePyramid(fileName, PyramidCompression::Deflate, type, edge);
    case BenchFilter::LZ4:
      return WritePyramid(fileName, PyramidCompression::LZ4, type, edge);
    case BenchFilter::None:
      return WritePyramid(fileName, PyramidCompression::None, type, edge);
    default:
      return WriteDataset(fileName, filter, type, edge);
  }
}

Result<BenchChunks> BenchChunks::Read(
  const std::string& fileName, BenchFilter filter, ScalarType type, std::int64_t edge)
{
  BenchChunks chunks;
  chunks.Filter = filter;
  chunks.ElementSize = SizeOf(type);
  chunks.ChunkBytes = ChunkEdge * ChunkEdge * ChunkEdge * chunks.ElementSize;
  const HDF5Lock lock;
  const HDF5Handle file(H5Fopen(fileName.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT));
  const HDF5Handle dataset(H5Dopen2(file.Get(), DatasetOf(filter).c_str(), H5P_DEFAULT));
  chunks.Decoder =
    ChunkDecoder(FiltersOf(dataset.Get()), chunks.ChunkBytes, chunks.ElementSize, false);
  const std::int64_t n = edge / ChunkEdge;
  for (std::int64_t i = 0; i < n * n * n; ++i)
  {
    const std::array<hsize_t, 3> offset = OffsetOf(i, edge);
    hsize_t size = 0;
    std::uint32_t mask = 0;
    if (H5Dget_chunk_storage_size(dataset.Get(), offset.data(), &size) < 0)
    {
      return Failure(fileName);
    }
    Stored stored;
    stored.Bytes.resize(static_cast<std::size_t>(size));
    if (H5Dread_chunk(dataset.Get(), H5P_DEFAULT, offset.data(), &mask, stored.Bytes.data()) < 0)
    {
      return Failure(fileName);
    }
    stored.Filtered = filter != BenchFilter::None && mask == 0;
    chunks.Chunks.push_back(std::move(stored));
  }
  chunks.Voxels.resize(chunks.Chunks.size() * chunks.ChunkBytes);
  return chunks;
}

bool BenchChunks::DecodeOne(std::size_t i)
{
  const Stored& chunk = this->Chunks[i];
  std::byte* const out = this->Voxels.data() + i * this->ChunkBytes;
  if (!chunk.Filtered)
  {
    std::memcpy(out, chunk.Bytes.data(), this->ChunkBytes);
    return true;
  }
  if (const auto decoded = DecodeByLibrary(this->Filter, chunk.Bytes, out, this->ChunkBytes))
  {
    return *decoded;
  }
  switch (this->Filter)
  {
    case BenchFilter::LZ4:
      return DecodeLZ4(chunk.Bytes, out, this->ChunkBytes);
    case BenchFilter::Deflate:
      return Inflate(chunk.Bytes, out, this->ChunkBytes);
    case BenchFilter::ShuffleDeflate:
      return DecodeShuffled(chunk.Bytes, this->ElementSize, out, this->ChunkBytes);
    default:
      return this->DecodeAsBricksAre(chunk.Bytes, out);
  }
}

bool BenchChunks::DecodeAsBricksAre(const BenchBytes& stored, std::byte* out) const
{
  thread_local BenchBytes raw; // which Decode() may destroy
  thread_local BenchBytes decoded;
  raw = stored;
  if (!this->Decoder.Decode(raw, 0, decoded).Ok())
  {
    return false;
  }
  std::memcpy(out, decoded.data(), this->ChunkBytes);
  return true;
}

bool BenchChunks::Decode(int threads)
{
  std::atomic<std::size_t> next{ 0 };
  std::atomic<bool> good{ true };
  std::vector<std::thread> all;
  for (int t = 0; t < threads; ++t)
  {
    all.emplace_back(
      [this, &next, &good]
      {
        for (std::size_t i = next++; i < this->Chunks.size(); i = next++)
        {
          if (!this->DecodeOne(i))
          {
            good = false;
          }
        }
      });
  }
  for (std::thread& thread : all)
  {
    thread.join();
  }
  return good;
}

std::size_t BenchChunks::StoredBytes() const
{
  std::size_t bytes = 0;
  for (const Stored& chunk : this->Chunks)
  {
    bytes += chunk.Bytes.size();
  }
  return bytes;
}

} // namespace teravox::program
