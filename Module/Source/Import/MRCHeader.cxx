// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "HeaderFields.h"
#include "HeaderText.h"
#include "RawVolume.h"

#include <cmath>

namespace teravox
{

namespace
{
using headers::Corrupt;
using headers::Unsupported;

constexpr std::size_t HeaderBytes = 1024;

/// The fields of MRC2014 that count here, by the names that its description has (Cheng et al.,
/// "MRC2014: Extensions to the MRC format header for electron cryo-microscopy and tomography",
/// J. Struct. Biol. 192, 2015). Places in the file are in bytes.
struct Header
{
  explicit Header(const headers::Fields& f)
    : Size(f.Several<std::int32_t, 3>(0))
    , Mode(f.At<std::int32_t>(12))
    , Start(f.Several<std::int32_t, 3>(16))
    , Intervals(f.Several<std::int32_t, 3>(28))
    , Cell(f.Several<float, 3>(40))
    , Angles(f.Several<float, 3>(52))
    , Axes(f.Several<std::int32_t, 3>(64))
    , SpaceGroup(f.At<std::int32_t>(88))
    , Extended(f.At<std::int32_t>(92))
    , Origin(f.Several<float, 3>(196))
    , ImodStamp(f.At<std::int32_t>(152))
    , ImodFlags(f.At<std::int32_t>(156))
  {
    // Older programs leave it out.
    this->Axes = this->Axes == std::array<std::int32_t, 3>{}
      ? std::array<std::int32_t, 3>{ 1, 2, 3 }
      : this->Axes;
  }
  /// Can this be a header of this byte order?
  bool IsPlausible() const
  {
    constexpr std::int32_t largestMode = 1024;
    return *std::min_element(this->Size.begin(), this->Size.end()) > 0 && this->Mode >= 0 &&
      this->Mode <= largestMode && *std::min_element(this->Axes.begin(), this->Axes.end()) >= 1 &&
      *std::max_element(this->Axes.begin(), this->Axes.end()) <= 3;
  }

  std::array<std::int32_t, 3> Size;      // NX, NY, NZ: columns, rows, sections
  std::int32_t Mode;                     // MODE
  std::array<std::int32_t, 3> Start;     // NXSTART, ...: of columns, rows, sections
  std::array<std::int32_t, 3> Intervals; // MX, MY, MZ: along x, y, z
  std::array<float, 3> Cell;             // CELLA: along x, y, z
  std::array<float, 3> Angles;           // CELLB, degrees: alpha, beta, gamma
  std::array<std::int32_t, 3> Axes;      // MAPC, MAPR, MAPS
  std::int32_t SpaceGroup;               // ISPG
  std::int32_t Extended;                 // NSYMBT
  std::array<float, 3> Origin;           // ORIGIN
  std::int32_t ImodStamp;                // imodStamp and imodFlags of IMOD
  std::int32_t ImodFlags;
};

bool HasMapWord(const std::string& bytes)
{
  return bytes.compare(208, 4, "MAP ") == 0;
}

/// MACHST: 0x11 for big-endian numbers, 0x44 for little-endian ones.
bool IsBigEndian(const std::string& bytes)
{
  return bytes[212] == '\x11';
}

bool HasStamp(const std::string& bytes)
{
  return bytes[212] == '\x11' || bytes[212] == '\x44';
}

/// Of the byte order that the file claims, else of the other one.
Result<Header> Parse(const std::string& fileName, const std::string& bytes, bool& bigEndian)
{
  if (bytes.size() < HeaderBytes)
  {
    return Corrupt(fileName, "isn't an MRC file: it has fewer than 1024 bytes");
  }
  const bool claimed = IsBigEndian(bytes);
  for (const bool order : { claimed, !claimed })
  {
    const Header header(headers::Fields(bytes, order));
    if (header.IsPlausible())
    {
      bigEndian = order;
      return header;
    }
  }
  return Corrupt(fileName, "isn't an MRC file, or its header is damaged");
}

Status TakeMode(const std::string& fileName, const Header& h, RawVolume& raw)
{
  constexpr std::int32_t imod = 1146047817; // "IMOD"
  const bool isUnsigned = h.ImodStamp == imod && (h.ImodFlags & 1) == 0;
  const std::string mode = "has voxels of MRC's mode " + std::to_string(h.Mode);
  switch (h.Mode)
  {
    case 0:
      raw.Volume.Type = isUnsigned ? ScalarType::UInt8 : ScalarType::Int8;
      return {};
    case 1:
      raw.Volume.Type = ScalarType::Int16;
      return {};
    case 2:
      raw.Volume.Type = ScalarType::Float32;
      return {};
    case 6:
      raw.Volume.Type = ScalarType::UInt16;
      return {};
    case 12:
      raw.Volume.Type = ScalarType::Float32;
      raw.Half = true;
      return {};
    case 16:
      raw.Volume.Components = 3;
      return {};
    case 3:
    case 4:
      return Unsupported(fileName, mode + ", complex numbers (a transform); transform it back");
    case 101:
      return Unsupported(fileName, mode + ", 4 bits each; unpack it, by newstack -mode 0 of IMOD");
    default:
      return Unsupported(fileName, mode + "; 0, 1, 2, 6, 12 and 16 are read");
  }
}

/// The edges of the cell, as wide as a voxel: a along x, b in the plane of x and y. What isn't
/// told is a cube of one Angstrom.
std::array<Double3, 3> VoxelEdges(const Header& h)
{
  Double3 length{ 1, 1, 1 };
  Double3 cosine{ 0, 0, 0 };
  for (std::size_t a = 0; a < 3; ++a)
  {
    const double edge = static_cast<double>(h.Cell.at(a)) / h.Intervals.at(a);
    length.at(a) = h.Intervals.at(a) > 0 && edge > 0.0 && std::isfinite(edge) ? edge : 1.0;
    constexpr double degree = 3.14159265358979323846 / 180.0;
    const auto angle = static_cast<double>(h.Angles.at(a));
    cosine.at(a) = angle == 0.0 || angle == 90.0 ? 0.0 : std::cos(angle * degree);
  }
  const double sine = std::sqrt(1.0 - cosine[2] * cosine[2]);
  const double across = (cosine[0] - cosine[1] * cosine[2]) / sine;
  return { Double3{ length[0], 0, 0 }, Double3{ length[1] * cosine[2], length[1] * sine, 0 },
    Double3{ length[2] * cosine[1], length[2] * across,
      length[2] * std::sqrt(1.0 - cosine[1] * cosine[1] - across * across) } };
}

Status TakePlace(
  const std::string& fileName, const Header& h, bool hasOrigin, VoxelReader::Description& volume)
{
  if (h.Axes[0] == h.Axes[1] || h.Axes[0] == h.Axes[2] || h.Axes[1] == h.Axes[2])
  {
    return Corrupt(fileName,
      "has columns, rows and sections along axes " + std::to_string(h.Axes[0]) + ", " +
        std::to_string(h.Axes[1]) + " and " + std::to_string(h.Axes[2]) + ", which can't be");
  }
  const std::array<Double3, 3> edges = VoxelEdges(h);
  if (!std::isfinite(edges[1][1]) || !std::isfinite(edges[2][1]) || !std::isfinite(edges[2][2]))
  {
    return Corrupt(fileName,
      "has a cell with the angles " + std::to_string(h.Angles[0]) + ", " +
        std::to_string(h.Angles[1]) + " and " + std::to_string(h.Angles[2]) + ", which can't be");
  }
  std::array<Double3, 3> steps{};
  const bool given = hasOrigin && h.Origin != std::array<float, 3>{};
  for (std::size_t i = 0; i < 3; ++i)
  {
    steps.at(i) = edges.at(static_cast<std::size_t>(h.Axes.at(i) - 1));
    for (std::size_t row = 0; row < 3; ++row)
    {
      volume.Origin.at(row) += given ? 0.0 : h.Start.at(i) * steps.at(i).at(row);
    }
  }
  if (given)
  {
    std::copy(h.Origin.begin(), h.Origin.end(), volume.Origin.begin());
  }
  return headers::TakeSteps(fileName, steps, volume);
}
} // namespace

bool IsMRC(const std::string& fileName)
{
  const auto begin = headers::Begin(fileName, HeaderBytes);
  return begin.Ok() && begin.Value().size() == HeaderBytes && HasMapWord(begin.Value()) &&
    HasStamp(begin.Value());
}

Result<RawVolume> ReadMRCHeader(const std::string& fileName, int timePoint)
{
  const auto bytes = headers::DecodedBegin(fileName, HeaderBytes, HeaderBytes);
  if (!bytes.Ok())
  {
    return bytes.GetStatus();
  }
  RawVolume raw;
  const auto parsed = Parse(fileName, bytes.Value(), raw.BigEndian);
  if (!parsed.Ok())
  {
    return parsed.GetStatus();
  }
  const Header& h = parsed.Value();
  Status status = TakeMode(fileName, h, raw);
  if (status.Ok() && h.Extended < 0)
  {
    status =
      Corrupt(fileName, "has an extended header of " + std::to_string(h.Extended) + " bytes");
  }
  if (status.Ok())
  {
    status = TakePlace(fileName, h, HasMapWord(bytes.Value()), raw.Volume);
  }
  if (!status.Ok())
  {
    return status;
  }
  raw.Volume.Dimensions = { h.Size[0], h.Size[1], h.Size[2] };
  // Stacks of volumes have their space group and 400; MZ sections are one.
  std::int64_t times = 1;
  if (h.SpaceGroup > 400 && h.Intervals[2] > 0 && h.Size[2] % h.Intervals[2] == 0)
  {
    times = h.Size[2] / h.Intervals[2];
    raw.Volume.Dimensions[2] = h.Intervals[2];
  }
  std::int64_t before =
    raw.Half ? 2 : static_cast<std::int64_t>(SizeOf(raw.Volume.Type)) * raw.Volume.Components;
  if (timePoint < 0 || timePoint >= times)
  {
    return headers::NoTimePoint(fileName, times, timePoint);
  }
  bool good = true;
  for (const std::int64_t size : raw.Volume.Dimensions)
  {
    good = good && !__builtin_mul_overflow(before, size, &before);
  }
  good = good && !__builtin_mul_overflow(before, timePoint, &before) &&
    !__builtin_add_overflow(before, static_cast<std::int64_t>(HeaderBytes) + h.Extended, &before);
  if (!good)
  {
    return Corrupt(fileName, "is said to have more voxels than a file can have");
  }
  return headers::VoxelsIn(fileName, before, raw);
}

} // namespace teravox
