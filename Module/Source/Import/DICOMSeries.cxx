// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "DICOMSeries.h"

#include "DICOMHeader.h"
#include "HeaderText.h"
#include "SliceVoxelReader.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>

namespace teravox
{

namespace
{
struct SeriesSlice
{
  std::string File;
  DICOMHeader Header;
  double Depth = 0; // along the normal
};

bool IsWhole(double value)
{
  return value == std::floor(value) && std::abs(value) < 2147483648.0;
}

/// The least and the largest value that a slice can have.
std::array<double, 2> Bounds(const DICOMHeader& h)
{
  const double count = std::ldexp(1.0, h.BitsStored);
  const double low = h.Signed ? -count / 2 : 0.0;
  const double a = low * h.Slope + h.Intercept;
  const double b = (low + count - 1) * h.Slope + h.Intercept;
  return { std::min(a, b), std::max(a, b) };
}

ScalarType StoredType(const DICOMHeader& h)
{
  return h.BitsAllocated == 8 ? (h.Signed ? ScalarType::Int8 : ScalarType::UInt8)
    : h.BitsAllocated == 16   ? (h.Signed ? ScalarType::Int16 : ScalarType::UInt16)
                              : (h.Signed ? ScalarType::Int32 : ScalarType::UInt32);
}

/// As stored, if nothing is rescaled; else the smallest type of integers that holds all values.
ScalarType TypeOf(const std::vector<SeriesSlice>& slices)
{
  double low = 0;
  double high = 0;
  bool whole = true;
  bool rescaled = false;
  for (const SeriesSlice& s : slices)
  {
    const std::array<double, 2> bounds = Bounds(s.Header);
    low = std::min(low, bounds[0]);
    high = std::max(high, bounds[1]);
    whole = whole && IsWhole(s.Header.Slope) && IsWhole(s.Header.Intercept);
    rescaled = rescaled || s.Header.Slope != 1 || s.Header.Intercept != 0;
  }
  if (!rescaled)
  {
    return StoredType(slices.front().Header);
  }
  if (!whole || low < -2147483648.0 || high > 2147483647.0)
  {
    return ScalarType::Float32;
  }
  return low >= 0 && high <= 255     ? ScalarType::UInt8
    : low >= -32768 && high <= 32767 ? ScalarType::Int16
    : low >= 0 && high <= 65535      ? ScalarType::UInt16
                                     : ScalarType::Int32;
}

class Reader : public SliceVoxelReader
{
public:
  Reader(Description volume, std::vector<SeriesSlice> slices)
    : SliceVoxelReader(std::move(volume))
    , Slices(std::move(slices))
  {
  }

protected:
  Status ReadSlice(std::int64_t z, std::byte* out) override
  {
    const SeriesSlice& slice = this->Slices.at(static_cast<std::size_t>(z));
    const DICOMHeader& h = slice.Header;
    const auto count = static_cast<std::size_t>(h.Rows * h.Columns * h.Samples);
    const std::size_t bytes = count * static_cast<std::size_t>(h.BitsAllocated / 8);
    this->Stored.resize(bytes);
    std::ifstream in(slice.File, std::ios::binary);
    in.seekg(h.PixelOffset);
    in.read(reinterpret_cast<char*>(this->Stored.data()), static_cast<std::streamsize>(bytes));
    if (!in)
    {
      return { StatusCode::InputOutput,
        "'" + slice.File + "' can't be read, or has become shorter." };
    }
    const bool plain = h.Slope == 1 && h.Intercept == 0 && StoredType(h) == this->Volume.Type &&
      h.BitsStored == h.BitsAllocated;
    if (plain)
    {
      std::memcpy(out, this->Stored.data(), bytes);
      return {};
    }
    DispatchScalarType(this->Volume.Type,
      [&](auto to)
      {
        DispatchScalarType(StoredType(h),
          [&](auto from)
          { Rescale<decltype(from), decltype(to)>(h, this->Stored.data(), count, out); });
      });
    return {};
  }

private:
  template <typename From, typename To>
  static void Rescale(
    const DICOMHeader& h, const std::byte* stored, std::size_t count, std::byte* out)
  {
    for (std::size_t i = 0; i < count; ++i)
    {
      std::uint64_t bits = 0; // bits beyond those stored may hold anything
      std::memcpy(&bits, stored + i * sizeof(From), sizeof(From));
      bits <<= 64 - h.BitsStored;
      const double value = h.Signed
        ? static_cast<double>(static_cast<std::int64_t>(bits) >> (64 - h.BitsStored))
        : static_cast<double>(bits >> (64 - h.BitsStored));
      const To result = static_cast<To>(value * h.Slope + h.Intercept);
      std::memcpy(out + i * sizeof(To), &result, sizeof(To));
    }
  }

  std::vector<SeriesSlice> Slices;
  std::vector<std::byte> Stored;
};

Double3 NormalOf(const DICOMHeader& h)
{
  const std::array<double, 6>& o = h.Orientation;
  return { o[1] * o[5] - o[2] * o[4], o[2] * o[3] - o[0] * o[5], o[0] * o[4] - o[1] * o[3] };
}

Result<std::vector<SeriesSlice>> SlicesOf(const DICOMSeries::Request& request)
{
  std::vector<SeriesSlice> slices;
  std::map<std::string, std::size_t> series;
  for (const std::string& file : request.Files)
  {
    if (!DICOMSeries::IsDICOM(file))
    {
      continue;
    }
    auto header = DICOMHeader::Read(file);
    if (!header.Ok())
    {
      return header.GetStatus();
    }
    ++series[header.Value().Series];
    if (request.Series.empty() || header.Value().Series == request.Series)
    {
      slices.push_back({ file, header.Value(), 0 });
    }
  }
  if (series.empty())
  {
    return Status(StatusCode::NotFound, "There are no DICOM files.");
  }
  if (slices.empty() || (request.Series.empty() && series.size() > 1))
  {
    constexpr std::size_t shown = 5;
    std::string names;
    for (const auto& [uid, count] : series)
    {
      names += names.empty() ? "" : ", ";
      names += uid + " (" + std::to_string(count) + " slices)";
      if (std::count(names.begin(), names.end(), '(') == static_cast<std::ptrdiff_t>(shown))
      {
        break;
      }
    }
    return Status(StatusCode::InvalidArgument,
      "Beside '" + request.Files.front() + "' lie " + std::to_string(series.size()) +
        " series; choose one by its UID: " + names + ".");
  }
  return slices;
}

Status Sort(std::vector<SeriesSlice>& slices, double& spacing)
{
  const DICOMHeader& first = slices.front().Header;
  const Double3 normal = NormalOf(first);
  for (SeriesSlice& s : slices)
  {
    const DICOMHeader& h = s.Header;
    if (h.Rows != first.Rows || h.Columns != first.Columns || h.Samples != first.Samples ||
      h.BitsAllocated != first.BitsAllocated || h.Signed != first.Signed ||
      h.PixelSpacing != first.PixelSpacing)
    {
      return headers::Corrupt(
        s.File, "has another size or type than '" + slices.front().File + "' of the same series");
    }
    for (std::size_t i = 0; i < 6; ++i)
    {
      constexpr double tolerance = 1e-3;
      if (std::abs(h.Orientation.at(i) - first.Orientation.at(i)) > tolerance)
      {
        return headers::Unsupported(s.File, "lies in another plane than the rest of its series");
      }
    }
    s.Depth = normal[0] * h.Position[0] + normal[1] * h.Position[1] + normal[2] * h.Position[2];
  }
  std::sort(slices.begin(), slices.end(),
    [](const SeriesSlice& a, const SeriesSlice& b)
    { return a.Depth != b.Depth ? a.Depth < b.Depth : a.File < b.File; });
  spacing = first.SliceSpacing;
  if (slices.size() > 1)
  {
    spacing = (slices.back().Depth - slices.front().Depth) / static_cast<double>(slices.size() - 1);
  }
  for (std::size_t i = 0; i + 1 < slices.size(); ++i)
  {
    constexpr double tolerance = 0.01; // of the spacing: positions are rounded decimals
    const double step = slices[i + 1].Depth - slices[i].Depth;
    if (!(step > 0.0) || std::abs(step - spacing) > tolerance * spacing)
    {
      return { StatusCode::Unsupported,
        "From '" + slices[i].File + "' to '" + slices[i + 1].File + "' it is " +
          std::to_string(step) + " mm, but " + std::to_string(spacing) +
          " mm on average: slices are missing, doubled, or not evenly spaced." };
    }
  }
  return {};
}
} // namespace

bool DICOMSeries::IsDICOM(const std::string& fileName)
{
  constexpr std::size_t preamble = 132;
  const auto begin = headers::Begin(fileName, preamble);
  return begin.Ok() && begin.Value().size() == preamble &&
    begin.Value().compare(preamble - 4, 4, "DICM") == 0;
}

Result<std::shared_ptr<VoxelReader>> DICOMSeries::Open(const Request& request)
{
  auto slices = SlicesOf(request);
  if (!slices.Ok())
  {
    return slices.GetStatus();
  }
  double spacing = 1;
  Status status = Sort(slices.Value(), spacing);
  if (!status.Ok())
  {
    return status;
  }
  const DICOMHeader& h = slices.Value().front().Header;
  VoxelReader::Description volume;
  volume.Dimensions = { h.Columns, h.Rows, static_cast<std::int64_t>(slices.Value().size()) };
  volume.Type = TypeOf(slices.Value());
  volume.Components = h.Samples;
  volume.Origin = h.Position;
  volume.ArrayName = "DICOMImage";
  const Double3 normal = NormalOf(h);
  std::array<Double3, 3> steps{};
  for (std::size_t row = 0; row < 3; ++row)
  {
    steps[0].at(row) = h.Orientation.at(row) * h.PixelSpacing[1];
    steps[1].at(row) = h.Orientation.at(3 + row) * h.PixelSpacing[0];
    steps[2].at(row) = normal.at(row) * spacing;
  }
  if (slices.Value().size() > 1)
  {
    // From first to last, which a tilted gantry doesn't put on top of each other.
    const Double3& last = slices.Value().back().Header.Position;
    for (std::size_t row = 0; row < 3; ++row)
    {
      steps[2].at(row) =
        (last.at(row) - h.Position.at(row)) / static_cast<double>(slices.Value().size() - 1);
    }
  }
  status = headers::TakeSteps(slices.Value().front().File, steps, volume);
  if (!status.Ok())
  {
    return status;
  }
  const auto reader = std::make_shared<Reader>(volume, slices.Value());
  reader->SetCacheLimit(request.CacheBytes);
  return std::shared_ptr<VoxelReader>(reader);
}

} // namespace teravox
