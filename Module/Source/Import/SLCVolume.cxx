// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "SLCVolume.h"

#include "HeaderText.h"
#include "Picture.h"
#include "SliceVoxelReader.h"
#include "TextNumbers.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>
#include <vector>

namespace teravox
{

namespace
{
using headers::Corrupt;
using headers::Unsupported;

constexpr double Magic = 11111;

/// Bytes of the file that one slice takes.
struct Stretch
{
  std::int64_t Begin = 0;
  std::int64_t Size = 0;
};

class OpenFile
{
public:
  OpenFile(std::string name, int descriptor)
    : Name(std::move(name))
    , Descriptor(descriptor)
  {
    struct stat info = {};
    this->Length = ::fstat(descriptor, &info) == 0 ? static_cast<std::int64_t>(info.st_size) : 0;
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  OpenFile(OpenFile&&) = delete;
  OpenFile& operator=(OpenFile&&) = delete;
  ~OpenFile() { ::close(this->Descriptor); }

  /// Errors: InputOutput; Corrupt if the file ends before.
  Status Read(const Stretch& from, std::uint8_t* out) const
  {
    std::int64_t done = 0;
    while (done < from.Size)
    {
      const ssize_t taken = ::pread(this->Descriptor, out + done,
        static_cast<std::size_t>(from.Size - done), from.Begin + done);
      if (taken < 0 && errno == EINTR)
      {
        continue;
      }
      if (taken < 0)
      {
        return { StatusCode::InputOutput,
          "'" + this->Name + "' can't be read: " + std::strerror(errno) + "." };
      }
      if (taken == 0)
      {
        return Corrupt(this->Name, "is cut off");
      }
      done += taken;
    }
    return {};
  }

  const std::string Name;
  std::int64_t Length = 0;

private:
  int Descriptor;
};

/// Behind a number there are blanks and an X: returns where what follows begins.
Result<std::int64_t> BehindX(const OpenFile& file, std::int64_t at)
{
  constexpr std::int64_t most = 16;
  std::array<std::uint8_t, most> bytes{};
  const std::int64_t size = std::clamp<std::int64_t>(file.Length - at, 0, most);
  const Status status = file.Read({ at, size }, bytes.data());
  if (!status.Ok())
  {
    return status;
  }
  auto* const end = bytes.begin() + size;
  auto* const found =
    std::find_if(bytes.begin(), end, [](std::uint8_t c) { return c != ' ' && c != '\n'; });
  if (found == end || *found != 'X')
  {
    return Corrupt(file.Name, "has no X in front of a slice");
  }
  return at + (found - bytes.begin()) + 1;
}

/// Runs as VolVis writes them: a count, with the highest bit for so many bytes as they are, without
/// it for one byte so many times; 0 ends them. Returns false unless they fill the slice.
bool Decode(const std::vector<std::uint8_t>& in, std::uint8_t* out, std::size_t size)
{
  std::size_t at = 0;
  std::size_t done = 0;
  while (at < in.size() && (in[at] & 127U) != 0)
  {
    const std::size_t count = in[at] & 127U;
    const bool same = (in[at] & 128U) == 0;
    const std::size_t taken = same ? 1 : count;
    ++at;
    if (count > size - done || taken > in.size() - at)
    {
      return false;
    }
    for (std::size_t i = 0; i < count; ++i)
    {
      out[done + i] = in[at + (same ? 0 : i)];
    }
    at += taken;
    done += count;
  }
  return done == size;
}

class Reader : public SliceVoxelReader
{
public:
  Reader(Description volume, std::unique_ptr<OpenFile> file, bool runs, std::vector<Stretch> slices)
    : SliceVoxelReader(std::move(volume))
    , File(std::move(file))
    , Runs(runs)
    , Stretches(std::move(slices))
  {
  }
  std::uint64_t DecoderBytes() const override
  {
    std::int64_t most = 0;
    for (const Stretch& one : this->Stretches)
    {
      most = std::max(most, one.Size);
    }
    return this->Runs ? static_cast<std::uint64_t>(most) : 0;
  }

protected:
  Status ReadSlice(std::int64_t z, std::byte* out) override
  {
    const Stretch& from = this->Stretches.at(static_cast<std::size_t>(z));
    auto* const bytes = reinterpret_cast<std::uint8_t*>(out);
    if (!this->Runs)
    {
      return this->File->Read(from, bytes);
    }
    std::vector<std::uint8_t> coded(static_cast<std::size_t>(from.Size));
    Status status = this->File->Read(from, coded.data());
    if (!status.Ok())
    {
      return status;
    }
    return Decode(coded, bytes, this->SliceBytes())
      ? Status()
      : Corrupt(this->File->Name, "has a slice whose runs aren't those of a slice");
  }

private:
  std::unique_ptr<OpenFile> File;
  bool Runs;
  std::vector<Stretch> Stretches;
};

/// Where each slice lies, the first one at `at`.
Result<std::vector<Stretch>> FindSlices(const OpenFile& file, TextNumbers& numbers, std::int64_t at,
  std::int64_t slices, std::int64_t slice, bool runs)
{
  std::vector<Stretch> found;
  for (std::int64_t z = 0; z < slices; ++z)
  {
    Stretch one{ at, slice };
    if (runs)
    {
      double size = 0;
      numbers.GoTo(at);
      const Status status =
        numbers.Read(ScalarType::Float64, 1, reinterpret_cast<std::byte*>(&size));
      const auto begin =
        status.Ok() ? BehindX(file, numbers.Position()) : Result<std::int64_t>(status);
      if (!begin.Ok())
      {
        return begin.GetStatus();
      }
      if (!(size >= 1 && size <= static_cast<double>(file.Length)))
      {
        return Corrupt(file.Name, "is cut off");
      }
      one = { begin.Value(), static_cast<std::int64_t>(size) };
    }
    if (one.Size > file.Length - one.Begin)
    {
      return Corrupt(file.Name, "is cut off");
    }
    found.push_back(one);
    at = one.Begin + one.Size;
  }
  return found;
}
} // namespace

Result<std::shared_ptr<VoxelReader>> OpenSLC(const std::string& fileName, std::uint64_t cacheBytes)
{
  const auto descriptor = headers::OpenRegular(fileName);
  if (!descriptor.Ok())
  {
    return descriptor.GetStatus();
  }
  auto file = std::make_unique<OpenFile>(fileName, descriptor.Value());
  auto numbers = TextNumbers::Open(fileName);
  if (!numbers.Ok())
  {
    return numbers.GetStatus();
  }
  // Magic; size; bits; spacing; unit, origin and changes of the data; compression; a picture's
  // size.
  std::array<double, 14> head{};
  const Status status = numbers.Value()->Read(
    ScalarType::Float64, head.size(), reinterpret_cast<std::byte*>(head.data()));
  if (!status.Ok())
  {
    return status;
  }
  constexpr double most = 0x7fffffff;
  const auto isCount = [](double v, double least)
  { return v >= least && v <= most && v == std::floor(v); };
  if (head[0] != Magic || !isCount(head[1], 1) || !isCount(head[2], 1) || !isCount(head[3], 1) ||
    !isCount(head[12], 0) || !isCount(head[13], 0))
  {
    return Corrupt(fileName, "isn't a volume of VolVis, or its header is damaged");
  }
  if (head[4] != 8 || (head[11] != 0 && head[11] != 1))
  {
    return Unsupported(
      fileName, "has voxels of other than 8 bits, or another compression than runs");
  }
  Picture slice;
  slice.Width = static_cast<std::uint32_t>(head[1]);
  slice.Height = static_cast<std::uint32_t>(head[2]);
  auto volume = DescribeStack(fileName, slice, static_cast<std::int64_t>(head[3]));
  const auto icon = BehindX(*file, numbers.Value()->Position());
  if (!volume.Ok() || !icon.Ok())
  {
    return volume.Ok() ? icon.GetStatus() : volume.GetStatus();
  }
  for (std::size_t a = 0; a < 3; ++a)
  {
    if (!(head.at(5 + a) > 0 && std::isfinite(head.at(5 + a))))
    {
      return Corrupt(fileName, "has a spacing that isn't above 0");
    }
    volume.Value().Spacing.at(a) = head.at(5 + a);
  }
  const double pictures = 3 * head[12] * head[13];
  if (pictures > static_cast<double>(file->Length))
  {
    return Corrupt(fileName, "is cut off");
  }
  auto slices = FindSlices(*file, *numbers.Value(),
    icon.Value() + static_cast<std::int64_t>(pictures), static_cast<std::int64_t>(head[3]),
    static_cast<std::int64_t>(head[1]) * static_cast<std::int64_t>(head[2]), head[11] == 1);
  if (!slices.Ok())
  {
    return slices.GetStatus();
  }
  const auto reader = std::make_shared<Reader>(
    volume.Value(), std::move(file), head[11] == 1, std::move(slices.Value()));
  reader->SetCacheLimit(cacheBytes);
  return std::shared_ptr<VoxelReader>(reader);
}

} // namespace teravox
