// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "RawVolume.h"

#include "HeaderText.h"
#include "InflateStream.h"
#include "SliceVoxelReader.h"
#include "TextNumbers.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace teravox
{

namespace
{
void SwapBytes(std::byte* data, std::size_t bytes, std::size_t elementSize)
{
  for (std::size_t i = 0; elementSize > 1 && i + elementSize <= bytes; i += elementSize)
  {
    std::reverse(data + i, data + i + elementSize);
  }
}

/// Bytes of a value in the file.
std::size_t StoredBytes(const RawVolume& raw)
{
  return raw.Half ? sizeof(std::uint16_t) : SizeOf(raw.Volume.Type);
}

float FromHalf(std::uint16_t half)
{
  const unsigned exponent = (half >> 10) & 31U;
  const unsigned fraction = half & 1023U;
  if (exponent == 0)
  {
    const float value = static_cast<float>(fraction) * 0x1p-24F;
    return (half & 0x8000U) != 0 ? -value : value;
  }
  const unsigned bits =
    (half & 0x8000U) << 16 | (exponent == 31 ? 255U : exponent + 127 - 15) << 23 | fraction << 13;
  float value = 0;
  std::memcpy(&value, &bits, sizeof(value));
  return value;
}

/// Where as many values of the file are put first, so that ToMemory() makes voxels of them in
/// place: at the end.
std::byte* StoredAt(const RawVolume& raw, std::size_t count, void* out)
{
  return static_cast<std::byte*>(out) + count * (SizeOf(raw.Volume.Type) - StoredBytes(raw));
}

void ToMemory(const RawVolume& raw, std::size_t count, void* out)
{
  const std::size_t bytes = StoredBytes(raw);
  std::byte* stored = StoredAt(raw, count, out);
  if (raw.BigEndian)
  {
    SwapBytes(stored, count * bytes, bytes);
  }
  for (std::size_t i = 0; raw.Half && i < count; ++i)
  {
    // What is written ends before what is read next, or there.
    std::uint16_t half = 0;
    std::memcpy(&half, stored + i * bytes, bytes);
    const float value = FromHalf(half);
    std::memcpy(static_cast<std::byte*>(out) + i * sizeof(value), &value, sizeof(value));
  }
}

class FileReader : public VoxelReader
{
public:
  explicit FileReader(RawVolume volume)
    : Raw(std::move(volume))
  {
  }
  FileReader(const FileReader&) = delete;
  FileReader& operator=(const FileReader&) = delete;
  FileReader(FileReader&&) = delete;
  FileReader& operator=(FileReader&&) = delete;
  ~FileReader() override { this->Close(); }

  Status Open()
  {
    for (std::size_t i = 0; i < this->Raw.Files.size(); ++i)
    {
      Status status = this->OpenFile(i);
      if (!status.Ok())
      {
        return status;
      }
    }
    return {};
  }

  Description Describe() const override { return this->Raw.Volume; }

  bool ReadsSlabs() const override { return true; }

  Status ReadBox(const Int3& start, const Int3& size, void* out) override
  {
    const Int3& all = this->Raw.Volume.Dimensions;
    const auto voxel = static_cast<std::int64_t>(this->VoxelBytes());
    const std::int64_t slices = this->SlicesPerFile();
    // Rows that follow one another in the file are one piece.
    const bool wholeRows = size[0] == all[0];
    const std::int64_t rows = wholeRows ? size[1] : 1;
    const auto bytes = static_cast<std::size_t>(size[0] * rows * voxel);
    const auto count =
      static_cast<std::size_t>(size[0] * size[1] * size[2] * this->Raw.Volume.Components);
    std::byte* to = StoredAt(this->Raw, count, out);
    for (std::int64_t z = start[2]; z < start[2] + size[2]; ++z)
    {
      for (std::int64_t y = start[1]; y < start[1] + size[1]; y += rows, to += bytes)
      {
        const std::int64_t first = ((z % slices * all[1] + y) * all[0] + start[0]) * voxel;
        Status status = this->ReadFile(static_cast<std::size_t>(z / slices), first, bytes, to);
        if (!status.Ok())
        {
          return status;
        }
      }
    }
    ToMemory(this->Raw, count, out);
    return {};
  }

private:
  // In the file.
  std::size_t VoxelBytes() const
  {
    return StoredBytes(this->Raw) * static_cast<std::size_t>(this->Raw.Volume.Components);
  }
  std::int64_t SlicesPerFile() const
  {
    return this->Raw.Volume.Dimensions[2] / static_cast<std::int64_t>(this->Raw.Files.size());
  }

  void Close()
  {
    if (this->File >= 0)
    {
      ::close(this->File);
    }
    this->File = -1;
  }

  // One at a time: a stack may have more files than a process may open.
  Status OpenFile(std::size_t i)
  {
    const std::string& name = this->Raw.Files[i];
    this->Close();
    const auto file = headers::OpenRegular(name);
    if (!file.Ok())
    {
      return file.GetStatus();
    }
    this->File = file.Value();
    struct stat info = {};
    if (::fstat(this->File, &info) != 0)
    {
      return { StatusCode::InputOutput,
        "'" + name + "' can't be read: " + std::strerror(errno) + "." };
    }
    const Int3& all = this->Raw.Volume.Dimensions;
    const std::int64_t wanted =
      all[0] * all[1] * this->SlicesPerFile() * static_cast<std::int64_t>(this->VoxelBytes());
    this->Start = this->Raw.Offset >= 0 ? this->Raw.Offset : info.st_size - wanted;
    if (this->Start < 0 || info.st_size - this->Start < wanted)
    {
      return { StatusCode::Corrupt,
        "'" + name + "' is too short: it has " + std::to_string(info.st_size) +
          " bytes, but its voxels take " + std::to_string(wanted) +
          (this->Raw.Offset > 0 ? " behind " + std::to_string(this->Raw.Offset) : "") + "." };
    }
    this->Current = i;
    return {};
  }

  Status ReadFile(std::size_t i, std::int64_t first, std::size_t size, std::byte* to)
  {
    Status opened = this->Current == i && this->File >= 0 ? Status() : this->OpenFile(i);
    if (!opened.Ok())
    {
      return opened;
    }
    while (size > 0)
    {
      const ssize_t n = ::pread(this->File, to, size, this->Start + first);
      if (n < 0 && errno == EINTR)
      {
        continue;
      }
      if (n <= 0)
      {
        return { StatusCode::InputOutput,
          "'" + this->Raw.Files[i] +
            "' can't be read: " + (n < 0 ? std::strerror(errno) : "it has become shorter") + "." };
      }
      to += n;
      first += n;
      size -= static_cast<std::size_t>(n);
    }
    return {};
  }

  RawVolume Raw;
  int File = -1;
  std::size_t Current = 0;
  std::int64_t Start = 0;
};

class StreamReader : public SliceVoxelReader
{
public:
  StreamReader(const RawVolume& volume, std::unique_ptr<InflateStream> stream)
    : SliceVoxelReader(volume.Volume)
    , Raw(volume)
    , Stream(std::move(stream))
  {
  }

protected:
  Status ReadSlice(std::int64_t z, std::byte* out) override
  {
    const std::size_t count = this->SliceBytes() / SizeOf(this->Volume.Type);
    const std::size_t bytes = count * StoredBytes(this->Raw);
    Status status = this->Stream->Read(this->Raw.Before + z * static_cast<std::int64_t>(bytes),
      bytes, StoredAt(this->Raw, count, out));
    if (status.Ok())
    {
      ToMemory(this->Raw, count, out);
    }
    return status;
  }

private:
  RawVolume Raw;
  std::unique_ptr<InflateStream> Stream;
};

class TextReader : public SliceVoxelReader
{
public:
  TextReader(const RawVolume& volume, std::unique_ptr<TextNumbers> numbers)
    : SliceVoxelReader(volume.Volume)
    , Numbers(std::move(numbers))
    , Begins{ volume.Offset }
  {
  }

protected:
  Status ReadSlice(std::int64_t z, std::byte* out) override
  {
    const auto slice = static_cast<std::size_t>(z);
    const std::size_t count = this->SliceBytes() / SizeOf(this->Volume.Type);
    const std::size_t from = std::min(slice, this->Begins.size() - 1);
    this->Numbers->GoTo(this->Begins[from]);
    for (std::size_t now = from; now <= slice; ++now)
    {
      Status status = this->Numbers->Read(this->Volume.Type, count, now == slice ? out : nullptr);
      if (!status.Ok())
      {
        return status;
      }
      if (now + 1 == this->Begins.size())
      {
        this->Begins.push_back(this->Numbers->Position());
      }
    }
    return {};
  }

private:
  std::unique_ptr<TextNumbers> Numbers;
  std::vector<std::int64_t> Begins; // in the file, of the slices met so far and the next
};

Status Check(const RawVolume& volume)
{
  const VoxelReader::Description& d = volume.Volume;
  std::int64_t bytes = static_cast<std::int64_t>(SizeOf(d.Type)) * d.Components;
  bool good = !volume.Files.empty() && d.Components >= 1 && volume.Offset >= -1;
  for (std::size_t a = 0; a < 3 && good; ++a)
  {
    constexpr std::int64_t most = 0x7fffffff;
    good = d.Dimensions.at(a) >= 1 && d.Dimensions.at(a) <= most &&
      !__builtin_mul_overflow(bytes, d.Dimensions.at(a), &bytes);
  }
  std::int64_t end = 0; // of a compressed stream
  good = good && volume.Before >= 0 && !__builtin_add_overflow(bytes, volume.Before, &end);
  const std::string name = volume.Files.empty() ? "The volume" : "'" + volume.Files.front() + "'";
  if (!good)
  {
    return { StatusCode::InvalidArgument, name + " is said to have a size that can't be." };
  }
  if (d.Dimensions[2] % static_cast<std::int64_t>(volume.Files.size()) != 0)
  {
    return { StatusCode::InvalidArgument,
      name + " and the others are " + std::to_string(volume.Files.size()) + " files for " +
        std::to_string(d.Dimensions[2]) + " slices." };
  }
  if (volume.Text && (volume.Files.size() > 1 || volume.Offset < 0))
  {
    return { StatusCode::Unsupported,
      name + " has text in several files, or at the end of one; text in one file is read." };
  }
  if (volume.Compressed && volume.Files.size() > 1)
  {
    return { StatusCode::Unsupported,
      name + " and the others are compressed; only one compressed file is read." };
  }
  return {};
}
} // namespace

Result<std::shared_ptr<VoxelReader>> RawVolume::Open(
  const RawVolume& volume, std::uint64_t cacheBytes)
{
  Status status = Check(volume);
  if (!status.Ok())
  {
    return status;
  }
  if (volume.Compressed)
  {
    auto stream =
      InflateStream::Open(volume.Files.front(), std::max<std::int64_t>(0, volume.Offset));
    if (!stream.Ok())
    {
      return stream.GetStatus();
    }
    const auto reader = std::make_shared<StreamReader>(volume, std::move(stream.Value()));
    reader->SetCacheLimit(cacheBytes);
    return std::shared_ptr<VoxelReader>(reader);
  }
  if (volume.Text)
  {
    auto numbers = TextNumbers::Open(volume.Files.front());
    if (!numbers.Ok())
    {
      return numbers.GetStatus();
    }
    const auto reader = std::make_shared<TextReader>(volume, std::move(numbers.Value()));
    reader->SetCacheLimit(cacheBytes);
    return std::shared_ptr<VoxelReader>(reader);
  }
  const auto reader = std::make_shared<FileReader>(volume);
  status = reader->Open();
  return status.Ok() ? Result<std::shared_ptr<VoxelReader>>(reader)
                     : Result<std::shared_ptr<VoxelReader>>(status);
}

} // namespace teravox
