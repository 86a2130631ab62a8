// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "HDF5Dataset.h"

#include "HDF5Lock.h"
#include "HDF5Types.h"
#include "ScratchBytes.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

namespace teravox
{

namespace
{
// Boxes in which unchunked datasets are read.
constexpr std::int64_t VirtualChunkEdge = 64;
// HDF5's own limit of a chunk.
constexpr std::int64_t LargestChunk = std::numeric_limits<std::uint32_t>::max();

const char* FilterName(int id)
{
  switch (id)
  {
    case 1:
      return "deflate";
    case 2:
      return "shuffle";
    case 3:
      return "fletcher32";
    case 4:
      return "szip";
    case 5:
      return "nbit";
    case 6:
      return "scale-offset";
    case 305:
      return "LZO";
    case 307:
      return "bzip2";
    case 32000:
      return "LZF";
    case 32001:
      return "Blosc";
    case 32004:
      return "LZ4";
    case 32008:
      return "bitshuffle";
    case 32013:
      return "ZFP";
    case 32015:
      return "Zstandard";
    case 32026:
      return "Blosc2";
    default:
      return "";
  }
}

std::string FilterAdvice(const ChunkFilter& filter)
{
  std::string text = "its filter " + std::to_string(filter.Id);
  const std::string name = *FilterName(filter.Id) != 0 ? FilterName(filter.Id) : filter.Name;
  text += name.empty() ? "" : " (" + name + ")";
  text += " isn't installed; install an HDF5 filter plugin for it";
  if (filter.Id == 32001)
  {
    text += " (Debian: hdf5-filter-plugin-blosc-serial)";
  }
  else if (filter.Id == 307)
  {
    text += " (Debian: hdf5-filter-plugin)";
  }
  return text + " and set HDF5_PLUGIN_PATH to its folder, or repack the file with h5repack";
}

std::string Text(const Int3& v)
{
  return "(" + std::to_string(v[0]) + ", " + std::to_string(v[1]) + ", " + std::to_string(v[2]) +
    ")";
}

const std::shared_ptr<const Chunk>& UnwrittenChunk()
{
  static const std::shared_ptr<const Chunk> chunk = std::make_shared<Chunk>();
  return chunk;
}
} // namespace

HDF5Dataset::HDF5Dataset(
  std::shared_ptr<HDF5File> file, std::string path, HDF5Handle id, Layout shape)
  : File(std::move(file))
  , Path(std::move(path))
  , Id(std::move(id))
  , Shape(std::move(shape))
{
  const auto chunkBytes = static_cast<std::size_t>(
    this->Shape.ChunkSize[0] * this->Shape.ChunkSize[1] * this->Shape.ChunkSize[2]);
  this->Decoder = ChunkDecoder(this->Shape.Filters, chunkBytes * this->VoxelBytes(),
    SizeOf(this->Shape.Type), this->Shape.BigEndian);
}

HDF5Dataset::~HDF5Dataset()
{
  const HDF5Lock lock;
  this->Id.Reset();
}

std::size_t HDF5Dataset::VoxelBytes() const
{
  return SizeOf(this->Shape.Type) * static_cast<std::size_t>(this->Shape.Components);
}

std::string HDF5Dataset::Name() const
{
  return "dataset '" + this->Path + "' in file '" + this->File->Name() + "'";
}

Result<std::shared_ptr<HDF5Dataset>> HDF5Dataset::Open(
  std::shared_ptr<HDF5File> file, const std::string& path)
{
  const std::string name = "The dataset '" + path + "' in file '" + file->Name() + "'";
  if (!file->Has(path))
  {
    return Status(StatusCode::NotFound, name + " doesn't exist.");
  }
  HDF5Handle id;
  Layout shape;
  Status status;
  {
    const HDF5Lock lock;
    const HDF5Handle access(H5Pcreate(H5P_DATASET_ACCESS));
    H5Pset_chunk_cache(access.Get(), 0, 0, 1.0);
    id = HDF5Handle(H5Dopen2(file->Id(), path.c_str(), access.Get()));
    if (!id.Valid())
    {
      return Status(
        StatusCode::Corrupt, name + " can't be opened as a dataset: " + lock.TakeError() + ".");
    }
    status = Inspect(id.Get(), shape);
    lock.TakeError();
    if (!status.Ok())
    {
      id.Reset();
      return Status(status.Code(), name + " can't be read: " + status.Message() + ".");
    }
  }
  return std::shared_ptr<HDF5Dataset>(
    new HDF5Dataset(std::move(file), path, std::move(id), std::move(shape)));
}

Status HDF5Dataset::Inspect(hid_t id, Layout& shape)
{
  Status status = InspectType(id, shape);
  if (status.Ok())
  {
    status = InspectShape(id, shape);
  }
  return status.Ok() ? InspectStorage(id, shape) : status;
}

Status HDF5Dataset::InspectType(hid_t id, Layout& shape)
{
  const HDF5Handle type(H5Dget_type(id));
  for (const ScalarType candidate : AllScalarTypes)
  {
    for (const bool big : { false, true })
    {
      if (H5Tequal(type.Get(), HDF5FileType(candidate, big)) > 0)
      {
        shape.Type = candidate;
        shape.BigEndian = big;
        return {};
      }
    }
  }
  static constexpr std::array<const char*, 11> kinds = { "integer", "floating-point", "time",
    "string", "bit field", "opaque", "compound", "reference", "enumeration", "variable-length",
    "array" };
  const H5T_class_t kind = H5Tget_class(type.Get());
  const bool known = kind >= 0 && static_cast<std::size_t>(kind) < kinds.size();
  return { StatusCode::Unsupported,
    "its type is " + std::string(known ? kinds.at(static_cast<std::size_t>(kind)) : "unknown") +
      " with " + std::to_string(8 * H5Tget_size(type.Get())) +
      " bits; voxels can be integers of 8, 16 or 32 bits, or floating-point numbers of 32 or 64 "
      "bits" };
}

Status HDF5Dataset::InspectShape(hid_t id, Layout& shape)
{
  const HDF5Handle space(H5Dget_space(id));
  const int rank = H5Sget_simple_extent_ndims(space.Get());
  if (rank < 2 || rank > 4)
  {
    return { StatusCode::Unsupported,
      "it has " + std::to_string(std::max(rank, 0)) +
        " axes; a volume has the axes (z, y, x) or (z, y, x, component)" };
  }
  std::array<hsize_t, 4> extent{ 1, 1, 1, 1 };
  H5Sget_simple_extent_dims(space.Get(), extent.data(), nullptr);
  constexpr hsize_t largest = std::numeric_limits<std::int32_t>::max();
  for (int a = 0; a < rank; ++a)
  {
    const hsize_t n = extent.at(static_cast<std::size_t>(a));
    if (n == 0)
    {
      return { StatusCode::Corrupt, "it has no voxels: one of its dimensions is zero" };
    }
    if (n > largest)
    {
      return { StatusCode::Unsupported,
        "one of its dimensions is " + std::to_string(n) +
          "; at most 2^31 - 1 voxels per axis are "
          "possible" };
    }
  }
  const bool components = rank == 4;
  if (components && extent[3] > 64)
  {
    return { StatusCode::Unsupported,
      "its last axis, the component, has " + std::to_string(extent[3]) + " values" };
  }
  shape.Rank = rank;
  shape.Components = components ? static_cast<int>(extent[3]) : 1;
  const int spatial = components ? 3 : rank;
  for (int a = 0; a < 3; ++a)
  {
    shape.Dimensions.at(static_cast<std::size_t>(a)) = a < spatial
      ? static_cast<std::int64_t>(extent.at(static_cast<std::size_t>(spatial - 1 - a)))
      : 1;
  }
  return {};
}

Status HDF5Dataset::InspectStorage(hid_t id, Layout& shape)
{
  const HDF5Handle creation(H5Dget_create_plist(id));
  shape.Fill.assign(
    SizeOf(shape.Type) * static_cast<std::size_t>(shape.Components), std::byte{ 0 });
  H5D_fill_value_t defined = H5D_FILL_VALUE_UNDEFINED;
  if (H5Pfill_value_defined(creation.Get(), &defined) >= 0 &&
    defined == H5D_FILL_VALUE_USER_DEFINED)
  {
    for (std::size_t c = 0; c < static_cast<std::size_t>(shape.Components); ++c)
    {
      H5Pget_fill_value(
        creation.Get(), HDF5MemoryType(shape.Type), shape.Fill.data() + c * SizeOf(shape.Type));
    }
  }
  bool wholeComponents = true;
  shape.Chunked = H5Pget_layout(creation.Get()) == H5D_CHUNKED;
  for (std::size_t a = 0; a < 3; ++a)
  {
    shape.ChunkSize[a] = std::min(shape.Dimensions[a], VirtualChunkEdge);
  }
  if (!shape.Chunked)
  {
    return {};
  }
  std::array<hsize_t, 4> chunk{ 1, 1, 1, 1 };
  H5Pget_chunk(creation.Get(), shape.Rank, chunk.data());
  const int spatial = shape.Rank == 4 ? 3 : shape.Rank;
  std::int64_t bytes = static_cast<std::int64_t>(shape.Fill.size());
  for (int a = 0; a < 3; ++a)
  {
    const auto i = static_cast<std::size_t>(a);
    shape.ChunkSize.at(i) = a < spatial
      ? static_cast<std::int64_t>(chunk.at(static_cast<std::size_t>(spatial - 1 - a)))
      : 1;
    if (__builtin_mul_overflow(bytes, shape.ChunkSize.at(i), &bytes))
    {
      bytes = std::numeric_limits<std::int64_t>::max();
    }
  }
  if (bytes <= 0 || bytes > LargestChunk)
  {
    return { StatusCode::Corrupt,
      "its chunks are said to have " + std::to_string(bytes) + " bytes" };
  }
  wholeComponents =
    shape.Rank < 4 || static_cast<std::int64_t>(chunk[3]) == std::int64_t{ shape.Components };
  unsigned options = 0;
  shape.EdgeChunksUnfiltered = H5Pget_chunk_opts(creation.Get(), &options) >= 0 &&
    (options & H5D_CHUNK_DONT_FILTER_PARTIAL_CHUNKS) != 0;
  const int filters = H5Pget_nfilters(creation.Get());
  for (int f = 0; f < filters; ++f)
  {
    ChunkFilter filter;
    unsigned flags = 0;
    unsigned config = 0;
    std::array<char, 256> name{};
    std::size_t n = 64;
    filter.Parameters.resize(n);
    filter.Id = H5Pget_filter2(creation.Get(), static_cast<unsigned>(f), &flags, &n,
      filter.Parameters.data(), name.size() - 1, name.data(), &config);
    if (filter.Id < 0)
    {
      return { StatusCode::Corrupt, "its list of filters is damaged" };
    }
    filter.Parameters.resize(std::min<std::size_t>(n, filter.Parameters.size()));
    filter.Name = name.data();
    shape.Filters.push_back(std::move(filter));
  }
  const bool decodable = ChunkDecoder(shape.Filters, 1, 1, false).IsComplete();
  shape.Direct = decodable && wholeComponents;
  if (!shape.Direct)
  {
    for (const ChunkFilter& filter : shape.Filters)
    {
      if (H5Zfilter_avail(filter.Id) <= 0)
      {
        return { StatusCode::Unsupported, FilterAdvice(filter) };
      }
    }
  }
  // A chunk split by components has no single storage size.
  shape.Chunked = wholeComponents;
  return {};
}

Status HDF5Dataset::Failure(StatusCode code, const Int3& index, const std::string& cause) const
{
  return { code, "chunk " + Text(index) + " of " + this->Name() + " " + cause };
}

Result<ChunkPointer> HDF5Dataset::Read(const Int3& index, const ChunkCache::Reserve& reserve) const
{
  std::uint64_t stored = 0;
  if (this->Shape.Chunked)
  {
    std::array<hsize_t, 4> offset{ 0, 0, 0, 0 };
    const int spatial = this->Shape.Rank == 4 ? 3 : this->Shape.Rank;
    for (int a = 0; a < spatial; ++a)
    {
      const auto i = static_cast<std::size_t>(a);
      const std::int64_t start = index.at(i) * this->Shape.ChunkSize.at(i);
      offset.at(static_cast<std::size_t>(spatial - 1 - a)) = static_cast<hsize_t>(start);
    }
    const HDF5Lock lock;
    hsize_t size = 0;
    if (H5Dget_chunk_storage_size(this->Id.Get(), offset.data(), &size) < 0)
    {
      if (lock.TakeUnallocated())
      {
        return UnwrittenChunk();
      }
      return this->Failure(
        StatusCode::Corrupt, index, "can't be found in the index: " + lock.TakeError());
    }
    if (size == 0)
    {
      return UnwrittenChunk();
    }
    stored = size;
  }
  return this->Shape.Direct ? this->ReadDirect(index, stored, reserve)
                            : this->ReadThroughLibrary(index, stored, reserve);
}

Result<ChunkPointer> HDF5Dataset::ReadDirect(
  const Int3& index, std::uint64_t stored, const ChunkCache::Reserve& reserve) const
{
  if (stored > this->Decoder.LargestRawSize())
  {
    return this->Failure(StatusCode::Corrupt, index,
      "doesn't decode: it is stored in " + std::to_string(stored) + " bytes, but has " +
        std::to_string(this->Decoder.ChunkBytes()));
  }
  Status status = reserve(
    stored + this->Decoder.ChunkBytes() + this->Decoder.ScratchSize(), this->Decoder.ChunkBytes());
  if (!status.Ok())
  {
    return this->Failure(status.Code(), index, "doesn't fit: " + status.Message());
  }
  const auto chunk = std::make_shared<Chunk>();
  chunk->Voxels = reserve.TakeRoom();
  // Without filters the voxels are read to where they stay.
  thread_local ScratchBytes kept;
  std::vector<std::byte>& raw = this->Shape.Filters.empty() ? chunk->Voxels : kept.Bytes();
  raw.resize(static_cast<std::size_t>(stored));
  std::uint32_t mask = 0;
  bool partial = false;
  std::array<hsize_t, 4> offset{ 0, 0, 0, 0 };
  const int spatial = this->Shape.Rank == 4 ? 3 : this->Shape.Rank;
  for (int a = 0; a < spatial; ++a)
  {
    const auto i = static_cast<std::size_t>(a);
    const std::int64_t start = index.at(i) * this->Shape.ChunkSize.at(i);
    offset.at(static_cast<std::size_t>(spatial - 1 - a)) = static_cast<hsize_t>(start);
    partial = partial || start + this->Shape.ChunkSize.at(i) > this->Shape.Dimensions.at(i);
  }
  {
    const HDF5Lock lock;
    // The size is asked again: H5Dread_chunk trusts the caller's buffer.
    hsize_t size = 0;
    if (H5Dget_chunk_storage_size(this->Id.Get(), offset.data(), &size) < 0 || size != stored ||
      H5Dread_chunk(this->Id.Get(), H5P_DEFAULT, offset.data(), &mask, raw.data()) < 0)
    {
      return this->Failure(StatusCode::InputOutput, index, "can't be read: " + lock.TakeError());
    }
  }
  this->File->BytesRead += stored;
  if (partial && this->Shape.EdgeChunksUnfiltered)
  {
    mask = ~std::uint32_t{ 0 };
  }
  status = this->Decoder.Decode(raw, mask, chunk->Voxels);
  kept.Trim();
  if (!status.Ok())
  {
    return this->Failure(status.Code(), index, "doesn't decode: " + status.Message());
  }
  return ChunkPointer(chunk);
}

Result<ChunkPointer> HDF5Dataset::ReadThroughLibrary(
  const Int3& index, std::uint64_t stored, const ChunkCache::Reserve& reserve) const
{
  // The library holds the raw chunk and one decoded copy meanwhile.
  const std::size_t bytes = this->Decoder.ChunkBytes();
  const Status status = reserve(stored + (this->Shape.Filters.empty() ? 1 : 2) * bytes, bytes);
  if (!status.Ok())
  {
    return this->Failure(status.Code(), index, "doesn't fit: " + status.Message());
  }
  std::array<hsize_t, 4> start{ 0, 0, 0, 0 };
  std::array<hsize_t, 4> count{ 1, 1, 1, 1 };
  std::array<hsize_t, 4> whole{ 1, 1, 1, 1 };
  const std::array<hsize_t, 4> zero{ 0, 0, 0, 0 };
  const int spatial = this->Shape.Rank == 4 ? 3 : this->Shape.Rank;
  for (int a = 0; a < spatial; ++a)
  {
    const auto i = static_cast<std::size_t>(a);
    const auto to = static_cast<std::size_t>(spatial - 1 - a);
    const std::int64_t from = index.at(i) * this->Shape.ChunkSize.at(i);
    start.at(to) = static_cast<hsize_t>(from);
    whole.at(to) = static_cast<hsize_t>(this->Shape.ChunkSize.at(i));
    count.at(to) = static_cast<hsize_t>(
      std::min(this->Shape.ChunkSize.at(i), this->Shape.Dimensions.at(i) - from));
  }
  if (this->Shape.Rank == 4)
  {
    count[3] = whole[3] = static_cast<hsize_t>(this->Shape.Components);
  }
  const auto chunk = std::make_shared<Chunk>();
  chunk->Voxels.resize(bytes);
  {
    const HDF5Lock lock;
    const HDF5Handle file(H5Dget_space(this->Id.Get()));
    const HDF5Handle memory(H5Screate_simple(this->Shape.Rank, whole.data(), nullptr));
    if (H5Sselect_hyperslab(
          file.Get(), H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr) < 0 ||
      H5Sselect_hyperslab(
        memory.Get(), H5S_SELECT_SET, zero.data(), nullptr, count.data(), nullptr) < 0 ||
      H5Dread(this->Id.Get(), HDF5MemoryType(this->Shape.Type), memory.Get(), file.Get(),
        H5P_DEFAULT, chunk->Voxels.data()) < 0)
    {
      return this->Failure(StatusCode::Corrupt, index, "can't be read: " + lock.TakeError());
    }
  }
  this->File->BytesRead += stored != 0 ? stored : bytes;
  return ChunkPointer(chunk);
}

} // namespace teravox
