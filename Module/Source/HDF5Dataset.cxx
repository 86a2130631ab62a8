// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "HDF5Dataset.h"

#include "HDF5Lock.h"
#include "HDF5Types.h"
#include "ScratchBytes.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>

namespace teravox
{

namespace
{
// Boxes in which unchunked datasets are read.
constexpr std::int64_t VirtualChunkEdge = 64;
// HDF5's own limit of a chunk.
constexpr std::uint64_t LargestChunk = std::numeric_limits<std::uint32_t>::max();

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

ScalarType UnsignedOf(ScalarType type)
{
  return type == ScalarType::Int8 ? ScalarType::UInt8
    : type == ScalarType::Int16   ? ScalarType::UInt16
    : type == ScalarType::Int32   ? ScalarType::UInt32
                                  : type;
}

hid_t WideType(ScalarType type)
{
  return type == ScalarType::Int32 ? H5T_STD_I64LE : H5T_STD_U64LE;
}

/// 64-bit integers to 32-bit ones, in place; the first one that doesn't fit, if any.
std::optional<std::string> Narrow(ScalarType type, std::vector<std::byte>& values)
{
  const std::size_t n = values.size() / 8;
  for (std::size_t i = 0; i < n; ++i)
  {
    std::uint64_t wide = 0;
    std::memcpy(&wide, values.data() + 8 * i, 8);
    const auto low = static_cast<std::uint32_t>(wide);
    const bool fits = type == ScalarType::Int32
      ? static_cast<std::uint64_t>(std::int64_t{ static_cast<std::int32_t>(low) }) == wide
      : low == wide;
    if (!fits)
    {
      return type == ScalarType::Int32 ? std::to_string(static_cast<std::int64_t>(wide))
                                       : std::to_string(wide);
    }
    std::memcpy(values.data() + 4 * i, &low, 4);
  }
  values.resize(4 * n);
  return std::nullopt;
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
  this->Decoder = ChunkDecoder(this->Shape.Filters,
    static_cast<std::size_t>(this->Shape.BlockElements()) * this->Shape.StoredBytes(),
    this->Shape.StoredBytes(), this->Shape.BigEndian);
  this->Shape.Sorted = this->IsSorted();
  const HDF5Lock lock;
  this->Length = FileLength(this->Id.Get());
}

HDF5Dataset::~HDF5Dataset()
{
  const HDF5Lock lock;
  this->Id.Reset();
}

std::size_t HDF5Dataset::ChunkBytes() const
{
  const Int3& size = this->Shape.ChunkSize;
  return static_cast<std::size_t>(size[0] * size[1] * size[2]) * this->VoxelBytes();
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
  std::shared_ptr<HDF5File> file, const std::string& path, const HDF5View& view)
{
  const std::string name = "The dataset '" + path + "' in file '" + file->Name() + "'";
  if (!file->Has(path))
  {
    const std::string missing = file->MissingFile(path);
    return Status(StatusCode::NotFound,
      name +
        (missing.empty() ? " doesn't exist."
                         : " lies in another file, '" + missing + "', which isn't there."));
  }
  HDF5Handle id;
  Layout shape;
  shape.View = view;
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
  HDF5Handle type(H5Dget_type(id));
  if (H5Tget_class(type.Get()) == H5T_ENUM)
  {
    type = HDF5Handle(H5Tget_super(type.Get()));
  }
  for (const ScalarType candidate : AllScalarTypes)
  {
    for (const bool big : { false, true })
    {
      if (H5Tequal(type.Get(), HDF5FileType(candidate, big)) > 0)
      {
        shape.Type = shape.View.Unsigned ? UnsignedOf(candidate) : candidate;
        shape.Stored = candidate;
        shape.BigEndian = big;
        return {};
      }
    }
  }
  for (const bool isSigned : { false, true })
  {
    for (const bool big : { false, true })
    {
      const hid_t wide =
        isSigned ? (big ? H5T_STD_I64BE : H5T_STD_I64LE) : (big ? H5T_STD_U64BE : H5T_STD_U64LE);
      if (H5Tequal(type.Get(), wide) > 0)
      {
        shape.Type = isSigned && !shape.View.Unsigned ? ScalarType::Int32 : ScalarType::UInt32;
        shape.Stored = shape.Type;
        shape.BigEndian = big;
        shape.Wide = true;
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
      " bits; voxels can be integers of 8 to 64 bits, or floating-point numbers of 32 or 64 bits" };
}

Status HDF5Dataset::InspectShape(hid_t id, Layout& shape)
{
  const HDF5Handle space(H5Dget_space(id));
  const int rank = H5Sget_simple_extent_ndims(space.Get());
  const int most = shape.View.Automatic ? 4 : static_cast<int>(HDF5View::MaximumRank);
  if (rank < (shape.View.Automatic ? 2 : 1) || rank > most)
  {
    return { StatusCode::Unsupported,
      "it has " + std::to_string(std::max(rank, 0)) +
        " axes; a volume has the axes (z, y, x) or (z, y, x, component)" };
  }
  shape.Rank = rank;
  shape.Size.fill(1);
  H5Sget_simple_extent_dims(space.Get(), shape.Size.data(), nullptr);
  constexpr hsize_t largest = std::numeric_limits<std::int32_t>::max();
  for (std::size_t a = 0; a < static_cast<std::size_t>(rank); ++a)
  {
    const hsize_t n = shape.Size[a];
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
  return InspectView(shape);
}

Status HDF5Dataset::InspectView(Layout& shape)
{
  HDF5View& view = shape.View;
  if (view.Automatic)
  {
    const int spatial = std::min(shape.Rank, 3);
    for (int a = 0; a < spatial; ++a)
    {
      view.Spatial.at(static_cast<std::size_t>(a)) = spatial - 1 - a;
    }
    view.Component = shape.Rank == 4 ? 3 : -1;
  }
  std::array<bool, HDF5View::MaximumRank> used{};
  for (const int axis : { view.Spatial[0], view.Spatial[1], view.Spatial[2], view.Component })
  {
    if (axis < -1 || axis >= shape.Rank || (axis >= 0 && used.at(static_cast<std::size_t>(axis))))
    {
      return { StatusCode::InvalidArgument,
        "it has " + std::to_string(shape.Rank) + " axes, not those of the volume" };
    }
    if (axis >= 0)
    {
      used.at(static_cast<std::size_t>(axis)) = true;
    }
  }
  for (std::size_t a = 0; a < static_cast<std::size_t>(shape.Rank); ++a)
  {
    if (!used.at(a) &&
      (view.Index.at(a) < 0 || static_cast<hsize_t>(view.Index.at(a)) >= shape.Size.at(a)))
    {
      return { StatusCode::InvalidArgument,
        "along axis " + std::to_string(a) + " it has " + std::to_string(shape.Size.at(a)) +
          " entries, there is no entry " + std::to_string(view.Index.at(a)) };
    }
  }
  for (std::size_t a = 0; a < 3; ++a)
  {
    shape.Dimensions.at(a) = view.Spatial.at(a) < 0
      ? 1
      : static_cast<std::int64_t>(shape.Size.at(static_cast<std::size_t>(view.Spatial.at(a))));
  }
  const hsize_t components =
    view.Component < 0 ? 1 : shape.Size.at(static_cast<std::size_t>(view.Component));
  if (components > 64)
  {
    return { StatusCode::Unsupported,
      std::string("its ") + (view.Component == shape.Rank - 1 ? "last axis" : "axis") +
        ", the component, has " + std::to_string(components) + " values" };
  }
  shape.Components = static_cast<int>(components);
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
    std::vector<std::byte> wide(8);
    if (shape.Wide &&
      (H5Pget_fill_value(creation.Get(), WideType(shape.Type), wide.data()) < 0 ||
        Narrow(shape.Type, wide)))
    {
      return { StatusCode::Unsupported, "its fill value doesn't fit into 32 bits" };
    }
    for (std::size_t c = 0; c < static_cast<std::size_t>(shape.Components); ++c)
    {
      if (shape.Wide)
      {
        std::copy(
          wide.begin(), wide.end(), shape.Fill.begin() + static_cast<std::ptrdiff_t>(4 * c));
        continue;
      }
      H5Pget_fill_value(
        creation.Get(), HDF5MemoryType(shape.Stored), shape.Fill.data() + c * SizeOf(shape.Type));
    }
  }
  shape.Chunked = H5Pget_layout(creation.Get()) == H5D_CHUNKED;
  shape.Block.fill(1);
  if (shape.View.Component >= 0)
  {
    shape.Block.at(static_cast<std::size_t>(shape.View.Component)) = shape.Components;
  }
  for (std::size_t a = 0; a < 3; ++a)
  {
    const std::int64_t box = shape.View.Box[a];
    shape.ChunkSize[a] = std::min(shape.Dimensions[a], box > 0 ? box : VirtualChunkEdge);
    if (shape.View.Spatial[a] >= 0)
    {
      shape.Block.at(static_cast<std::size_t>(shape.View.Spatial[a])) = shape.ChunkSize[a];
    }
  }
  if (!shape.Chunked)
  {
    return {};
  }
  shape.Block.fill(1);
  if (H5Pget_chunk(creation.Get(), shape.Rank, shape.Block.data()) != shape.Rank)
  {
    return { StatusCode::Corrupt, "the shape of its chunks is damaged" };
  }
  const std::uint64_t elements = shape.BlockElements();
  std::uint64_t bytes = 0;
  if (__builtin_mul_overflow(elements, std::uint64_t{ shape.StoredBytes() }, &bytes))
  {
    bytes = std::numeric_limits<std::uint64_t>::max();
  }
  if (bytes == 0 || bytes > LargestChunk)
  {
    return { StatusCode::Corrupt,
      "its chunks are said to have " + std::to_string(bytes) + " bytes" };
  }
  for (std::size_t a = 0; a < 3; ++a)
  {
    const int axis = shape.View.Spatial[a];
    shape.ChunkSize[a] =
      axis < 0 ? 1 : static_cast<std::int64_t>(shape.Block.at(static_cast<std::size_t>(axis)));
  }
  return InspectFilters(creation.Get(), shape);
}

Status HDF5Dataset::InspectFilters(hid_t creation, Layout& shape)
{
  unsigned options = 0;
  shape.EdgeChunksUnfiltered = H5Pget_chunk_opts(creation, &options) >= 0 &&
    (options & H5D_CHUNK_DONT_FILTER_PARTIAL_CHUNKS) != 0;
  const int filters = H5Pget_nfilters(creation);
  for (int f = 0; f < filters; ++f)
  {
    ChunkFilter filter;
    unsigned flags = 0;
    unsigned config = 0;
    std::array<char, 256> name{};
    std::size_t n = 64;
    filter.Parameters.resize(n);
    filter.Id = H5Pget_filter2(creation, static_cast<unsigned>(f), &flags, &n,
      filter.Parameters.data(), name.size() - 1, name.data(), &config);
    if (filter.Id < 0)
    {
      return { StatusCode::Corrupt, "its list of filters is damaged" };
    }
    filter.Parameters.resize(std::min<std::size_t>(n, filter.Parameters.size()));
    filter.Name = name.data();
    shape.Filters.push_back(std::move(filter));
  }
  const int component = shape.View.Component;
  const bool wholeComponents = component < 0 ||
    shape.Block.at(static_cast<std::size_t>(component)) == static_cast<hsize_t>(shape.Components);
  bool wholeChunks = true;
  // Of chunks without filters the library tells the size that the layout says, but H5Dread_chunk()
  // reads as much as the chunk index does: in a damaged file more than there is room for.
  shape.Direct = wholeComponents && !shape.Filters.empty() &&
    ChunkDecoder(shape.Filters, 1, 1, false).IsComplete();
  if (!shape.Direct)
  {
    for (const ChunkFilter& filter : shape.Filters)
    {
      if (H5Zfilter_avail(filter.Id) <= 0)
      {
        return { StatusCode::Unsupported, FilterAdvice(filter) };
      }
    }
    // What the library decodes comes without other axes.
    for (std::size_t a = 0; a < static_cast<std::size_t>(shape.Rank); ++a)
    {
      const int axis = static_cast<int>(a);
      const bool spatial = std::find(shape.View.Spatial.begin(), shape.View.Spatial.end(), axis) !=
        shape.View.Spatial.end();
      if (!spatial)
      {
        const hsize_t size = axis == component ? static_cast<hsize_t>(shape.Components) : 1;
        wholeChunks = wholeChunks && shape.Block.at(a) == size;
        shape.Block.at(a) = size;
      }
    }
  }
  // A chunk split by components has no single storage size, and parts of one have none at all.
  shape.Chunked = wholeComponents && wholeChunks;
  return {};
}

std::size_t HDF5Dataset::Layout::StoredBytes() const
{
  return this->Wide ? 8 : SizeOf(this->Type);
}

std::uint64_t HDF5Dataset::Layout::BlockElements() const
{
  std::uint64_t elements = 1;
  for (std::size_t a = 0; a < static_cast<std::size_t>(this->Rank); ++a)
  {
    if (__builtin_mul_overflow(elements, std::uint64_t{ this->Block.at(a) }, &elements))
    {
      return std::numeric_limits<std::uint64_t>::max();
    }
  }
  return elements;
}

Status HDF5Dataset::Failure(StatusCode code, const Int3& index, const std::string& cause) const
{
  return { code, "chunk " + Text(index) + " of " + this->Name() + " " + cause };
}

HDF5Dataset::Extent HDF5Dataset::Offset(const Int3& index) const
{
  Extent offset{};
  for (std::size_t a = 0; a < static_cast<std::size_t>(this->Shape.Rank); ++a)
  {
    const auto at = static_cast<hsize_t>(this->Shape.View.Index.at(a));
    offset.at(a) = at / this->Shape.Block.at(a) * this->Shape.Block.at(a);
  }
  if (this->Shape.View.Component >= 0)
  {
    offset.at(static_cast<std::size_t>(this->Shape.View.Component)) = 0;
  }
  for (std::size_t a = 0; a < 3; ++a)
  {
    if (this->Shape.View.Spatial[a] >= 0)
    {
      offset.at(static_cast<std::size_t>(this->Shape.View.Spatial[a])) =
        static_cast<hsize_t>(index[a]) * static_cast<hsize_t>(this->Shape.ChunkSize[a]);
    }
  }
  return offset;
}

void HDF5Dataset::Sort(
  const std::vector<std::byte>& block, const Extent& offset, std::vector<std::byte>& out) const
{
  const std::size_t element = SizeOf(this->Shape.Type);
  Extent stride{};
  std::size_t step = element;
  std::size_t first = 0;
  for (auto a = static_cast<std::size_t>(this->Shape.Rank); a-- > 0;)
  {
    stride.at(a) = step;
    const int axis = static_cast<int>(a);
    const auto& spatial = this->Shape.View.Spatial;
    if (axis != this->Shape.View.Component &&
      std::find(spatial.begin(), spatial.end(), axis) == spatial.end())
    {
      first += (static_cast<hsize_t>(this->Shape.View.Index.at(a)) - offset.at(a)) * step;
    }
    step *= this->Shape.Block.at(a);
  }
  const auto strideOf = [&](int axis)
  { return axis < 0 ? 0 : static_cast<std::size_t>(stride.at(static_cast<std::size_t>(axis))); };
  const Int3& size = this->Shape.ChunkSize;
  const std::size_t dx = strideOf(this->Shape.View.Spatial[0]);
  const std::size_t dc = strideOf(this->Shape.View.Component);
  const auto components = static_cast<std::size_t>(this->Shape.Components);
  out.resize(static_cast<std::size_t>(size[0] * size[1] * size[2]) * this->VoxelBytes());
  std::byte* to = out.data();
  for (std::size_t z = 0; z < static_cast<std::size_t>(size[2]); ++z)
  {
    for (std::size_t y = 0; y < static_cast<std::size_t>(size[1]); ++y)
    {
      const std::byte* row = block.data() + first + z * strideOf(this->Shape.View.Spatial[2]) +
        y * strideOf(this->Shape.View.Spatial[1]);
      for (std::size_t x = 0; x < static_cast<std::size_t>(size[0]); ++x)
      {
        for (std::size_t c = 0; c < components; ++c, to += element)
        {
          std::memcpy(to, row + x * dx + c * dc, element);
        }
      }
    }
  }
}

Status HDF5Dataset::Arrange(const Int3& index, std::vector<std::byte>& block, const Extent& offset,
  std::vector<std::byte>& out) const
{
  if (this->Shape.Wide)
  {
    if (const auto value = Narrow(this->Shape.Type, block))
    {
      return this->Failure(StatusCode::Unsupported, index,
        "holds the 64-bit integer " + *value + ", and voxels have 32 bits");
    }
  }
  if (this->Shape.Sorted)
  {
    out.assign(block.begin(), block.end());
  }
  else
  {
    this->Sort(block, offset, out);
  }
  return {};
}

bool HDF5Dataset::IsSorted() const
{
  // The axes of a chunk, fastest first, those that have one entry left out.
  std::size_t expected = 0;
  const std::array<int, 4> order{ this->Shape.View.Component, this->Shape.View.Spatial[0],
    this->Shape.View.Spatial[1], this->Shape.View.Spatial[2] };
  for (auto a = static_cast<std::size_t>(this->Shape.Rank); a-- > 0;)
  {
    if (this->Shape.Block.at(a) == 1)
    {
      continue;
    }
    while (expected < order.size() && order.at(expected) != static_cast<int>(a))
    {
      // One that is passed over must have nothing to say.
      const int passed = order.at(expected);
      if (passed >= 0 && this->Shape.Block.at(static_cast<std::size_t>(passed)) != 1)
      {
        return false;
      }
      ++expected;
    }
    if (expected == order.size())
    {
      return false;
    }
    ++expected;
  }
  return true;
}

bool HDF5Dataset::IsUnwritten(const Int3& first, const Int3& last, std::int64_t& lookups) const
{
  if (!this->Shape.Chunked)
  {
    return false;
  }
  const HDF5Lock lock;
  Int3 index{};
  for (index[2] = first[2]; index[2] < last[2]; ++index[2])
  {
    for (index[1] = first[1]; index[1] < last[1]; ++index[1])
    {
      for (index[0] = first[0]; index[0] < last[0]; ++index[0])
      {
        const Extent offset = this->Offset(index);
        hsize_t size = 0;
        if (--lookups < 0)
        {
          return false;
        }
        if (H5Dget_chunk_storage_size(this->Id.Get(), offset.data(), &size) < 0)
        {
          size = lock.TakeUnallocated() ? 0 : 1;
          lock.TakeError();
        }
        if (size != 0)
        {
          return false;
        }
      }
    }
  }
  return true;
}

Result<ChunkPointer> HDF5Dataset::Read(const Int3& index, const ChunkCache::Reserve& reserve) const
{
  std::uint64_t stored = 0;
  if (this->Shape.Chunked)
  {
    const Extent offset = this->Offset(index);
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
  const std::size_t kept = this->ChunkBytes();
  const bool ready = this->Shape.Sorted && !this->Shape.Wide;
  Status status = reserve(
    stored + this->Decoder.ChunkBytes() + this->Decoder.ScratchSize() + (ready ? 0 : kept), kept);
  if (!status.Ok())
  {
    return this->Failure(status.Code(), index, "doesn't fit: " + status.Message());
  }
  const auto chunk = std::make_shared<Chunk>();
  chunk->Voxels = reserve.TakeRoom();
  thread_local ScratchBytes keptRaw;
  thread_local ScratchBytes keptBlock;
  std::vector<std::byte>& block = ready ? chunk->Voxels : keptBlock.Bytes();
  std::vector<std::byte>& raw = keptRaw.Bytes();
  raw.resize(static_cast<std::size_t>(stored));
  std::uint32_t mask = 0;
  bool partial = false;
  const Extent offset = this->Offset(index);
  for (std::size_t a = 0; a < static_cast<std::size_t>(this->Shape.Rank); ++a)
  {
    partial = partial || offset.at(a) + this->Shape.Block.at(a) > this->Shape.Size.at(a);
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
    if (const std::string shrunk = this->Length.Shrunk(); !shrunk.empty())
    {
      return this->Failure(StatusCode::InputOutput, index, "can't be read: " + shrunk);
    }
  }
  this->File->BytesRead += stored;
  if (partial && this->Shape.EdgeChunksUnfiltered)
  {
    mask = ~std::uint32_t{ 0 };
  }
  status = this->Decoder.Decode(raw, mask, block);
  keptRaw.Trim();
  if (!status.Ok())
  {
    return this->Failure(status.Code(), index, "doesn't decode: " + status.Message());
  }
  if (!ready)
  {
    status = this->Arrange(index, block, offset, chunk->Voxels);
    keptBlock.Trim();
    if (!status.Ok())
    {
      return status;
    }
  }
  return ChunkPointer(chunk);
}

Result<ChunkPointer> HDF5Dataset::ReadThroughLibrary(
  const Int3& index, std::uint64_t stored, const ChunkCache::Reserve& reserve) const
{
  // The library holds the raw chunk and one decoded copy meanwhile.
  const std::size_t bytes = this->Decoder.ChunkBytes();
  const std::size_t kept = this->ChunkBytes();
  const bool ready = this->Shape.Sorted && !this->Shape.Wide;
  Status status =
    reserve(stored + (this->Shape.Filters.empty() ? 1 : 2) * bytes + (ready ? 0 : kept), kept);
  if (!status.Ok())
  {
    return this->Failure(status.Code(), index, "doesn't fit: " + status.Message());
  }
  const Extent start = this->Offset(index);
  const Extent zero{};
  Extent count{};
  for (std::size_t a = 0; a < static_cast<std::size_t>(this->Shape.Rank); ++a)
  {
    count.at(a) = std::min(this->Shape.Block.at(a), this->Shape.Size.at(a) - start.at(a));
  }
  const auto chunk = std::make_shared<Chunk>();
  chunk->Voxels = reserve.TakeRoom();
  thread_local ScratchBytes keptBlock;
  std::vector<std::byte>& block = ready ? chunk->Voxels : keptBlock.Bytes();
  block.resize(bytes);
  if (!std::equal(count.begin(), count.begin() + this->Shape.Rank, this->Shape.Block.begin()))
  {
    std::fill(block.begin(), block.end(), std::byte{ 0 }); // what lies outside of the dataset
  }
  {
    const HDF5Lock lock;
    const HDF5Handle file(H5Dget_space(this->Id.Get()));
    const HDF5Handle memory(H5Screate_simple(this->Shape.Rank, this->Shape.Block.data(), nullptr));
    if (H5Sselect_hyperslab(
          file.Get(), H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr) < 0 ||
      H5Sselect_hyperslab(
        memory.Get(), H5S_SELECT_SET, zero.data(), nullptr, count.data(), nullptr) < 0 ||
      H5Dread(this->Id.Get(),
        this->Shape.Wide ? WideType(this->Shape.Type) : HDF5MemoryType(this->Shape.Stored),
        memory.Get(), file.Get(), H5P_DEFAULT, block.data()) < 0)
    {
      return this->Failure(StatusCode::Corrupt, index, "can't be read: " + lock.TakeError());
    }
    if (const std::string shrunk = this->Length.Shrunk(); !shrunk.empty())
    {
      return this->Failure(StatusCode::InputOutput, index, "can't be read: " + shrunk);
    }
  }
  this->File->BytesRead += stored != 0 ? stored : bytes;
  if (!ready)
  {
    status = this->Arrange(index, block, start, chunk->Voxels);
    keptBlock.Trim();
    if (!status.Ok())
    {
      return status;
    }
  }
  return ChunkPointer(chunk);
}

} // namespace teravox
