// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Files of images that become a pyramid: headers, then corners of slices. Voxels without a header,
// of any size that may be claimed; names that stand for several files; indices of pieces.
#include "FuzzInput.h"
#include "Import/FileList.h"
#include "Import/ImageVolume.h"
#include "Import/PieceIndex.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>
#include <zlib.h>

namespace
{
using namespace teravox;

constexpr std::array<const char*, 17> Extensions{ ".mha", ".mhd", ".nrrd", ".nhdr", ".nii",
  ".nii.gz", ".hdr", ".vtk", ".tif", ".dcm", ".png", ".jpg", ".mrc", ".pgm", ".bmp", ".tga",
  ".slc" };
constexpr std::size_t Raw =
  Extensions.size();                     // numbers that users give for voxels without a header
constexpr std::size_t Pattern = Raw + 1; // a name with * and %d
constexpr std::size_t Pieces = Pattern + 1;
constexpr std::uint64_t Memory = std::uint64_t{ 64 } << 20;
constexpr std::int64_t MostVoxels = std::int64_t{ 1 } << 20; // that are read of one file

void ReadSome(const Result<ImageVolume>& volume)
{
  fuzz::Require(volume.Ok() || !volume.GetStatus().Message().empty(), "an error has a message");
  if (!volume.Ok())
  {
    return;
  }
  VoxelReader& reader = *volume.Value().Reader;
  const VoxelReader::Description d = reader.Describe();
  bool good = d.Components >= 1 && d.Components <= 4;
  std::int64_t voxels = 1;
  for (std::size_t a = 0; a < 3; ++a)
  {
    good = good && d.Dimensions.at(a) >= 1 && d.Dimensions.at(a) <= 0x7fffffff &&
      d.Spacing.at(a) > 0 && std::isfinite(d.Spacing.at(a)) && std::isfinite(d.Origin.at(a));
  }
  fuzz::Require(good, "a volume that was opened has a size and a place");
  fuzz::Require(volume.Value().ReaderBytes <= Memory / 2, "the budget holds");
  // The corners of the first and the last slice, and those of a hundred in between.
  const Int3 size{ std::min<std::int64_t>(d.Dimensions[0], 64),
    std::min<std::int64_t>(d.Dimensions[1], 64), 1 };
  const std::int64_t step = std::max<std::int64_t>(1, d.Dimensions[2] / 100);
  std::vector<std::byte> box(static_cast<std::size_t>(size[0] * size[1]) * SizeOf(d.Type) *
    static_cast<std::size_t>(d.Components));
  for (std::int64_t z = 0; z < d.Dimensions[2] && voxels < MostVoxels; z += step)
  {
    const Status first = reader.ReadBox({ 0, 0, z }, size, box.data());
    const Status last = reader.ReadBox(
      { d.Dimensions[0] - size[0], d.Dimensions[1] - size[1], d.Dimensions[2] - 1 - z }, size,
      box.data());
    if (!first.Ok() || !last.Ok())
    {
      const Status& failed = first.Ok() ? last : first;
      fuzz::Require(!failed.Message().empty(), "an error has a message");
      return;
    }
    voxels += d.Dimensions[0] * std::min<std::int64_t>(d.Dimensions[1], MostVoxels);
  }
}

/// The pieces that an index has for the whole, which must be all of it, once.
void ReadIndex(const std::string& name)
{
  const auto index = PieceIndex::Read(name);
  fuzz::Require(index.Ok() || !index.GetStatus().Message().empty(), "an error has a message");
  for (const bool cells : { false, true })
  {
    if (!index.Ok())
    {
      return;
    }
    const PieceIndex::Extent whole = index.Value().IndicesOf(index.Value().Whole, cells);
    const auto parts = index.Value().PartsOf(name, whole, cells);
    const auto count = [](const PieceIndex::Extent& box)
    {
      double n = 1;
      for (std::size_t i = 0; i < 6; i += 2)
      {
        n *= static_cast<double>(box.at(i + 1)) - box.at(i) + 1;
      }
      return n;
    };
    double sum = 0;
    for (std::size_t i = 0; parts.Ok() && i < parts.Value().size(); ++i)
    {
      for (const PieceIndex::Extent& box : parts.Value()[i].Boxes)
      {
        sum += count(box);
      }
    }
    fuzz::Require(!parts.Ok() || std::abs(sum - count(whole)) <= 1e-9 * sum, "parts are the whole");
  }
}

/// A PNG file with the right checksums: behind wrong ones nothing is looked at.
std::vector<std::uint8_t> WithChecksums(const std::uint8_t* data, std::size_t size)
{
  std::vector<std::uint8_t> file(data, data + size);
  const auto big = [&file](std::size_t at)
  {
    return std::uint32_t{ file[at] } << 24 | std::uint32_t{ file[at + 1] } << 16 |
      std::uint32_t{ file[at + 2] } << 8 | file[at + 3];
  };
  constexpr std::size_t signature = 8;
  constexpr std::size_t others = 12; // of a chunk: length, name, checksum
  for (std::size_t at = signature; at + others <= file.size();)
  {
    const std::size_t length = big(at);
    if (length > file.size() - at - others)
    {
      break;
    }
    const auto sum =
      static_cast<std::uint32_t>(::crc32(0, file.data() + at + 4, static_cast<uInt>(length + 4)));
    for (std::size_t i = 0; i < 4; ++i)
    {
      file[at + 8 + length + i] = static_cast<std::uint8_t>(sum >> (24 - 8 * i));
    }
    at += others + length;
  }
  return file;
}

/// Numbers as they come: eight bytes each of the sizes, of the bytes before, and a byte of flags.
RawVolume RawOf(const std::uint8_t*& data, std::size_t& size)
{
  RawVolume volume;
  std::array<std::uint8_t, 48> head{};
  const std::size_t taken = std::min(size, head.size());
  std::copy_n(data, taken, head.begin());
  data += taken;
  size -= taken;
  const auto number = [&head](std::size_t i)
  {
    std::int64_t value = 0;
    std::memcpy(&value, head.data() + 8 * i, sizeof(value));
    return value;
  };
  volume.Volume.Dimensions = { number(0), number(1), number(2) };
  volume.Offset = number(3);
  volume.Before = std::max<std::int64_t>(0, number(4));
  volume.Volume.Components = 1 + (head[41] & 3);
  volume.Volume.Type = static_cast<ScalarType>(head[42] % 8);
  volume.BigEndian = (head[40] & 1) != 0;
  volume.Compressed = (head[40] & 2) != 0;
  volume.Text = (head[40] & 4) != 0;
  return volume;
}
} // namespace

// Input: a byte that chooses what the rest is taken for, and the content of the file.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  if (size == 0)
  {
    return 0;
  }
  const std::size_t kind = data[0] % (Pieces + 1);
  ++data;
  --size;
  if (kind == Pattern)
  {
    const std::string text(reinterpret_cast<const char*>(data), std::min<std::size_t>(size, 200));
    const std::string base = fuzz::FileOf(data, 0, ".raw");
    const std::string pattern = base.substr(0, base.rfind('/') + 1) + text;
    if (IsPattern(pattern))
    {
      FilesLike(pattern);
    }
    return 0;
  }
  if (kind == Pieces)
  {
    ReadIndex(fuzz::FileOf(data, size, ".pvti"));
    return 0;
  }
  ImageVolume::Request request;
  request.Memory = Memory;
  if (kind == Raw)
  {
    RawVolume volume = RawOf(data, size);
    request.Name = fuzz::FileOf(data, size, ".raw");
    volume.Files = { request.Name };
    ReadSome(ImageVolume::Open(volume, request.Name, Memory));
    return 0;
  }
  const bool png = Extensions.at(kind) == std::string(".png");
  const auto file = png ? WithChecksums(data, size) : std::vector<std::uint8_t>(data, data + size);
  request.Name = fuzz::FileOf(file.data(), file.size(), Extensions.at(kind));
  ReadSome(ImageVolume::Open(request));
  return 0;
}
