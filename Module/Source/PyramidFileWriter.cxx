// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PyramidFileWriter.h"

#include "ChunkDecoder.h"
#include "HDF5Lock.h"
#include "HDF5Types.h"
#include "PyramidFormat.h"
#include "PyramidMetadata.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace teravox
{

namespace
{
std::string ArrayName(const std::string& wanted)
{
  std::string name = wanted.empty() || wanted == "." || wanted == ".." ? "scalars" : wanted;
  std::replace(name.begin(), name.end(), '/', '_'); // HDF5 would make a group of it
  return name.substr(0, name.find('\0'));
}

// Requires: HDF5Lock held.
bool PutText(hid_t object, const char* name, const std::string& text)
{
  const HDF5Handle type(H5Tcopy(H5T_C_S1));
  H5Tset_size(type.Get(), std::max<std::size_t>(text.size(), 1));
  H5Tset_strpad(type.Get(), H5T_STR_NULLPAD);
  const bool ascii = std::all_of(
    text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 128; });
  H5Tset_cset(type.Get(), ascii ? H5T_CSET_ASCII : H5T_CSET_UTF8);
  const HDF5Handle space(H5Screate(H5S_SCALAR));
  const HDF5Handle attribute(
    H5Acreate2(object, name, type.Get(), space.Get(), H5P_DEFAULT, H5P_DEFAULT));
  return attribute.Valid() && H5Awrite(attribute.Get(), type.Get(), text.c_str()) >= 0;
}

// Requires: HDF5Lock held.
template <typename T>
bool PutNumbers(
  hid_t object, const char* name, hid_t fileType, hid_t memoryType, const std::vector<T>& values)
{
  const auto n = static_cast<hsize_t>(values.size());
  const HDF5Handle space(H5Screate_simple(1, &n, nullptr));
  const HDF5Handle attribute(
    H5Acreate2(object, name, fileType, space.Get(), H5P_DEFAULT, H5P_DEFAULT));
  return attribute.Valid() && H5Awrite(attribute.Get(), memoryType, values.data()) >= 0;
}

bool PutDoubles(hid_t object, const char* name, const std::vector<double>& values)
{
  return PutNumbers(object, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, values);
}

bool PutIntegers(hid_t object, const char* name, const std::vector<std::int64_t>& values)
{
  return PutNumbers(object, name, H5T_STD_I64LE, H5T_NATIVE_INT64, values);
}

std::vector<std::byte> FillOf(const VoxelReader::Description& d)
{
  std::vector<std::byte> fill(SizeOf(d.Type));
  DispatchScalarType(d.Type,
    [&](auto example)
    {
      const auto value = static_cast<decltype(example)>(d.FillValue);
      std::memcpy(fill.data(), &value, sizeof(value));
    });
  return fill;
}
} // namespace

PyramidFileWriter::PyramidFileWriter(std::string fileName, Description description)
  : Name(std::move(fileName))
  , Temporary(unfinished::PartName(this->Name))
  , Self(std::move(description))
{
}

PyramidFileWriter::~PyramidFileWriter()
{
  if (this->File.Valid())
  {
    this->Output.Discard = true;
    this->Close();
    this->Abandon();
  }
  if (this->Lock >= 0)
  {
    ::close(this->Lock);
  }
}

void PyramidFileWriter::Abandon()
{
  if (this->Self.Options.Resume && this->Log.HasChunks())
  {
    unfinished::Keep(this->Temporary);
    return;
  }
  ::unlink(this->Temporary.c_str());
  ::unlink(unfinished::LogName(this->Temporary).c_str());
}

Status PyramidFileWriter::Reserve()
{
  // Asked before HDF5, for the reason in the system's words.
  this->Lock = ::open(this->Temporary.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0666);
  if (this->Lock < 0)
  {
    return this->Failure(std::string("the file can't be created: ") + std::strerror(errno));
  }
  // Where the file system has no locks the process's number has to do.
  if (::flock(this->Lock, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
  {
    return this->Failure("it is being written at this moment");
  }
  if (::ftruncate(this->Lock, 0) != 0)
  {
    return this->Failure(std::string("the file can't be created: ") + std::strerror(errno));
  }
  return {};
}

Int3 PyramidFileWriter::ChunkSize(const PyramidLayout& layout, int level)
{
  Int3 size{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    size[a] = std::min<std::int64_t>(layout.BrickSize(), layout.Dimensions(level)[a]);
  }
  return size;
}

std::vector<ChunkFilter> PyramidFileWriter::Filters(
  const PyramidWriterOptions& options, ScalarType type)
{
  switch (options.Compression)
  {
    case PyramidCompression::Deflate:
      return { { ChunkFilter::Shuffle, "", { static_cast<unsigned>(SizeOf(type)) } },
        { ChunkFilter::Deflate, "", {} } };
    case PyramidCompression::LZ4:
      return { { ChunkFilter::LZ4, "", {} } };
    case PyramidCompression::None:
    default:
      return {};
  }
}

std::string PyramidFileWriter::DataGroup() const
{
  return std::string(PyramidFormat::ImageGroup) +
    (this->Self.Volume.CellData ? "/CellData" : "/PointData");
}

Status PyramidFileWriter::Failure(const std::string& what) const
{
  // Where the system has refused a write, that is the cause of all that follows.
  const std::string cause = this->Output.Error == 0 ? what : std::strerror(this->Output.Error);
  return { StatusCode::InputOutput, "Writing '" + this->Name + "' failed: " + cause + "." };
}

Status PyramidFileWriter::Written() const
{
  return this->Output.Error == 0 ? Status() : this->Failure(std::strerror(this->Output.Error));
}

Result<std::unique_ptr<PyramidFileWriter>> PyramidFileWriter::Create(const std::string& fileName,
  const VoxelReader::Description& description, const PyramidWriterOptions& options,
  const PyramidLayout& layout, std::unique_ptr<SavedChunks> saved)
{
  Description self{ description, options, layout, FillOf(description) };
  self.Options.Progress = nullptr;
  self.Volume.ArrayName = ArrayName(description.ArrayName);
  std::unique_ptr<PyramidFileWriter> writer(new PyramidFileWriter(fileName, std::move(self)));
  // The rename at the end would fail; better to know now.
  struct stat info = {};
  if (::stat(fileName.c_str(), &info) == 0 && S_ISDIR(info.st_mode))
  {
    return writer->Failure("it is a folder");
  }
  if (!options.Resume)
  {
    for (const auto& part : unfinished::Find(fileName))
    {
      part->Remove();
    }
  }
  writer->Saved_ = std::move(saved);
  Status status = writer->Reserve();
  if (!status.Ok())
  {
    return status;
  }
  writer->Log.Create(
    unfinished::LogName(writer->Temporary), ConversionLog::Task(description, options));
  status = writer->Build();
  if (!status.Ok())
  {
    if (!writer->File.Valid())
    {
      writer->Abandon();
    }
    return status;
  }
  return writer;
}

Status PyramidFileWriter::Build()
{
  const HDF5Lock lock;
  const HDF5Handle access = HDF5OutputDriver::MakeAccess(this->Output);
  this->File =
    HDF5Handle(H5Fcreate(this->Temporary.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.Get()));
  if (!this->File.Valid())
  {
    return this->Failure("the file can't be created: " + lock.TakeError());
  }
  const HDF5Handle image(
    H5Gcreate2(this->File.Get(), PyramidFormat::ImageGroup, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  const HDF5Handle data(
    H5Gcreate2(this->File.Get(), this->DataGroup().c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  const HDF5Handle pyramid(H5Gcreate2(
    this->File.Get(), PyramidFormat::PyramidGroup, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  const HDF5Handle statistics(H5Gcreate2(
    this->File.Get(), PyramidFormat::StatisticsGroup, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  if (!image.Valid() || !data.Valid() || !pyramid.Valid() || !statistics.Valid())
  {
    return this->Failure(lock.TakeError());
  }
  Status status = this->BuildLevels(data.Get());
  if (status.Ok())
  {
    status = this->BuildStatistics();
    const VoxelReader::Description& volume = this->Self.Volume;
    this->Cells = std::make_unique<PyramidCellStore>(this->File.Get(),
      PyramidCellStore::Description{ this->Self.Layout, volume.Type, volume.Components,
        this->Self.Fill, this->Self.Options.CompressionLevel });
  }
  // Early, because a full disk is best found before hours of work.
  if (status.Ok() && H5Fflush(this->File.Get(), H5F_SCOPE_LOCAL) < 0)
  {
    return this->Failure(lock.TakeError());
  }
  return status.Ok() ? this->Written() : this->Failure(status.Message() + ": " + lock.TakeError());
}

Status PyramidFileWriter::BuildLevels(hid_t data)
{
  const VoxelReader::Description& volume = this->Self.Volume;
  const std::string group = PyramidFormat::PyramidGroup;
  for (int l = 0; l < this->Self.Layout.NumberOfLevels(); ++l)
  {
    HDF5Handle dataset;
    const HDF5Handle parent(H5Gopen2(this->File.Get(), group.c_str(), H5P_DEFAULT));
    Status status =
      this->MakeDataset(l == 0 ? data : parent.Get(), l == 0 ? volume.ArrayName : std::to_string(l),
        this->Self.Layout.Dimensions(l), ChunkSize(this->Self.Layout, l), volume.Components,
        volume.Type, this->Self.Fill.data(), this->Self.Options.Compression, dataset);
    if (!status.Ok())
    {
      return status;
    }
    this->Levels.push_back(std::move(dataset));
  }
  if (H5Lcreate_hard(data, volume.ArrayName.c_str(), this->File.Get(), (group + "/0").c_str(),
        H5P_DEFAULT, H5P_DEFAULT) < 0)
  {
    return { StatusCode::InputOutput, "level 0 can't be linked" };
  }
  return {};
}

Status PyramidFileWriter::BuildStatistics()
{
  const VoxelReader::Description& volume = this->Self.Volume;
  const float none = 0;
  std::array<std::byte, sizeof(float)> flat{};
  std::memcpy(flat.data(), &none, sizeof(none));
  for (int l = 0; l < this->Self.Layout.NumberOfLevels(); ++l)
  {
    const Int3& dimensions = this->Self.Layout.Dimensions(l);
    const std::int64_t longest = *std::max_element(dimensions.begin(), dimensions.end());
    const std::string level = std::string(PyramidFormat::StatisticsGroup) + "/" + std::to_string(l);
    const HDF5Handle levelGroup(
      H5Gcreate2(this->File.Get(), level.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
    for (std::int64_t edge = PyramidFormat::CellEdge;; edge *= PyramidFormat::CellEdge)
    {
      const Int3 cells = PyramidCellStore::CellsOf(this->Self.Layout, l, edge);
      const Int3 chunk = PyramidCellStore::ChunkOf(cells);
      const HDF5Handle group(H5Gcreate2(
        levelGroup.Get(), std::to_string(edge).c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
      HDF5Handle ranges;
      HDF5Handle gradients;
      Status status = this->MakeDataset(group.Get(), "Range", cells, chunk, 2 * volume.Components,
        volume.Type, this->Self.Fill.data(), PyramidCompression::Deflate, ranges);
      if (status.Ok())
      {
        status = this->MakeDataset(group.Get(), "Gradient", cells, chunk, volume.Components,
          ScalarType::Float32, flat.data(), PyramidCompression::Deflate, gradients);
      }
      if (!status.Ok())
      {
        return status;
      }
      if (edge >= longest)
      {
        break;
      }
    }
  }
  return {};
}

Status PyramidFileWriter::MakeDataset(hid_t group, const std::string& name, const Int3& dimensions,
  const Int3& chunk, int components, ScalarType type, const std::byte* fill,
  PyramidCompression compression, HDF5Handle& dataset)
{
  const int rank = components > 1 ? 4 : 3;
  std::array<hsize_t, 4> extent{};
  std::array<hsize_t, 4> chunkExtent{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    extent.at(2 - a) = static_cast<hsize_t>(dimensions.at(a));
    chunkExtent.at(2 - a) = static_cast<hsize_t>(chunk.at(a));
  }
  extent[3] = chunkExtent[3] = static_cast<hsize_t>(components);
  const HDF5Handle creation(H5Pcreate(H5P_DATASET_CREATE));
  H5Pset_chunk(creation.Get(), rank, chunkExtent.data());
  H5Pset_fill_value(creation.Get(), HDF5MemoryType(type), fill);
  H5Pset_obj_track_times(creation.Get(), false); // the same volume gives the same file
  herr_t filtered = 0;
  if (compression == PyramidCompression::Deflate)
  {
    const auto level = std::clamp(this->Self.Options.CompressionLevel, 1, 9);
    filtered = H5Pset_shuffle(creation.Get());
    filtered |= H5Pset_deflate(creation.Get(), static_cast<unsigned>(level));
  }
  else if (compression == PyramidCompression::LZ4)
  {
    // Optional, so that the library needn't have the filter: the chunks come compressed.
    const unsigned blockSize = 1u << 30;
    filtered = H5Pset_filter(creation.Get(), ChunkFilter::LZ4, H5Z_FLAG_OPTIONAL, 1, &blockSize);
  }
  const HDF5Handle space(H5Screate_simple(rank, extent.data(), nullptr));
  if (filtered >= 0)
  {
    dataset = HDF5Handle(H5Dcreate2(group, name.c_str(), HDF5FileType(type, false), space.Get(),
      H5P_DEFAULT, creation.Get(), H5P_DEFAULT));
  }
  return dataset.Valid()
    ? Status()
    : Status(StatusCode::InputOutput, "the dataset '" + name + "' can't be created");
}

Status PyramidFileWriter::WriteChunk(
  int level, const Int3& index, const ChunkEncoder::Encoded& chunk, std::uint32_t checksum)
{
  const Int3 size = ChunkSize(this->Self.Layout, level);
  std::array<hsize_t, 4> offset{ 0, 0, 0, 0 };
  for (std::size_t a = 0; a < 3; ++a)
  {
    const std::int64_t start = index.at(a) * size.at(a);
    offset.at(2 - a) = static_cast<hsize_t>(start);
  }
  const HDF5Lock lock;
  this->Output.RawSize = 0;
  if (H5Dwrite_chunk(this->Levels[static_cast<std::size_t>(level)].Get(), H5P_DEFAULT,
        chunk.FilterMask, offset.data(), chunk.Size, chunk.Data) < 0)
  {
    return this->Failure(lock.TakeError());
  }
  Status status = this->Written();
  if (status.Ok() && this->Output.RawSize == chunk.Size)
  {
    this->Log.Add(
      { level, index, this->Output.RawAddress, chunk.Size, chunk.FilterMask, checksum, 0 });
  }
  return status;
}

void PyramidFileWriter::SkipChunk(int level, const Int3& index)
{
  this->Log.Add({ level, index, 0, 0, 0, 0, 0 });
}

Status PyramidFileWriter::WriteCells(int level, std::int64_t edge, const PyramidCells& cells)
{
  const Status status = this->Cells->Write(level, edge, cells);
  return status.Ok() ? this->Written() : this->Failure(status.Message());
}

Status PyramidFileWriter::ReadCells(int level, std::int64_t edge, PyramidCells& cells)
{
  const Status status = this->Cells->Read(level, edge, cells);
  return status.Ok() ? this->Written() : this->Failure(status.Message());
}

Status PyramidFileWriter::WriteAttributes(
  const ValueRange& range, const std::vector<std::uint64_t>& histogram)
{
  const VoxelReader::Description& v = this->Self.Volume;
  PyramidMetadata metadata;
  metadata.Labels = this->Self.Options.Downsampling == PyramidDownsampling::Mode;
  metadata.ArrayName = v.ArrayName;
  metadata.Spacing = v.Spacing;
  std::vector<std::int64_t> extent;
  Double3 start{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    const std::int64_t points = v.Dimensions[a] + (v.CellData ? 1 : 0);
    // From zero: vtkHDFReader takes the extent for an index into the dataset.
    extent.push_back(0);
    extent.push_back(points - 1);
    start[a] = v.CellData ? 0.5 : 0.0;
  }
  for (int l = 0; l < this->Self.Layout.NumberOfLevels(); ++l)
  {
    metadata.Factors.push_back(this->Self.Layout.Factor(l));
  }
  const Double3 offset = PyramidMetadata::Offset(v.Direction, v.Spacing, start);
  std::vector<double> origin;
  for (std::size_t a = 0; a < 3; ++a)
  {
    origin.push_back(v.Origin[a] - offset[a]);
  }

  const HDF5Lock lock;
  const hid_t file = this->File.Get();
  const HDF5Handle image(H5Gopen2(file, PyramidFormat::ImageGroup, H5P_DEFAULT));
  const HDF5Handle data(H5Gopen2(file, this->DataGroup().c_str(), H5P_DEFAULT));
  const HDF5Handle pyramid(H5Gopen2(file, PyramidFormat::PyramidGroup, H5P_DEFAULT));
  const HDF5Handle statistics(H5Gopen2(file, PyramidFormat::StatisticsGroup, H5P_DEFAULT));
  bool ok = PutIntegers(image.Get(), "Version", { 1, 0 }) &&
    PutText(image.Get(), "Type", "ImageData") && PutIntegers(image.Get(), "WholeExtent", extent) &&
    PutDoubles(image.Get(), "Origin", origin) &&
    PutDoubles(image.Get(), "Spacing", { v.Spacing.begin(), v.Spacing.end() }) &&
    PutDoubles(image.Get(), "Direction", { v.Direction.begin(), v.Direction.end() }) &&
    PutText(data.Get(), "Scalars", v.ArrayName) &&
    PutText(pyramid.Get(), PyramidFormat::MultiscalesName, metadata.MultiscalesText()) &&
    PutText(pyramid.Get(), "Downsampling", metadata.Labels ? "mode" : "average") &&
    PutIntegers(pyramid.Get(), "ExtentStart", { v.ExtentStart.begin(), v.ExtentStart.end() }) &&
    PutDoubles(statistics.Get(), "Range", { range.Min, range.Max });
  if (ok && !histogram.empty())
  {
    ok = PutNumbers(statistics.Get(), "Histogram", H5T_STD_U64LE, H5T_NATIVE_UINT64, histogram);
  }
  ok = ok && PutIntegers(pyramid.Get(), "Version", { PyramidFormat::Version });
  return ok ? Status() : this->Failure(lock.TakeError());
}

Status PyramidFileWriter::Close()
{
  const HDF5Lock lock;
  this->Cells.reset();
  bool ok = true;
  for (HDF5Handle& level : this->Levels)
  {
    ok = level.Reset() && ok;
  }
  ok = this->File.Reset() && ok;
  return ok ? this->Written() : this->Failure(lock.TakeError());
}

Status PyramidFileWriter::Publish(std::uint64_t& size)
{
  const auto systemFailure = [this](const char* what)
  { return this->Failure(std::string(what) + ": " + std::strerror(errno)); };
  const int fd = ::open(this->Temporary.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0)
  {
    return systemFailure("the file can't be opened again");
  }
  struct stat info = {};
  const bool synced = ::fsync(fd) == 0 && ::fstat(fd, &info) == 0;
  Status sync = synced ? Status() : systemFailure("it can't be brought to the disk");
  ::close(fd);
  if (!sync.Ok())
  {
    return sync;
  }
  size = static_cast<std::uint64_t>(info.st_size);
  if (std::rename(this->Temporary.c_str(), this->Name.c_str()) != 0)
  {
    return systemFailure("it can't be given its name");
  }
  const std::size_t slash = this->Name.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : this->Name.substr(0, slash + 1);
  const int folderFd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folderFd >= 0)
  {
    ::fsync(folderFd); // not all file systems can; the file itself is complete
    ::close(folderFd);
  }
  return {};
}

Result<std::uint64_t> PyramidFileWriter::Finish(
  const ValueRange& range, const std::vector<std::uint64_t>& histogram)
{
  Status status = this->WriteAttributes(range, histogram);
  if (status.Ok())
  {
    Status flushed = this->Cells->Flush();
    status = flushed.Ok() ? flushed : this->Failure(flushed.Message());
  }
  if (status.Ok())
  {
    {
      const HDF5Lock lock;
      if (H5Fflush(this->File.Get(), H5F_SCOPE_LOCAL) < 0)
      {
        return this->Failure(lock.TakeError());
      }
    }
    status = this->Close();
    std::uint64_t size = 0;
    if (status.Ok())
    {
      status = this->Publish(size);
    }
    if (status.Ok())
    {
      ::unlink(unfinished::LogName(this->Temporary).c_str());
      if (this->Saved_)
      {
        this->Saved_->Remove();
      }
      return size;
    }
    this->Abandon();
  }
  return status;
}

} // namespace teravox
