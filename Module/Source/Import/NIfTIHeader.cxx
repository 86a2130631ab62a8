// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "HeaderFields.h"
#include "HeaderText.h"
#include "RawVolume.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>

namespace teravox
{

namespace
{
using headers::Corrupt;
using headers::Fields;
using headers::Unsupported;

/// The fields of both versions, the same names as in nifti1.h.
struct Header
{
  std::array<std::int64_t, 8> Dim{};
  std::array<double, 8> PixDim{};
  std::int64_t DataType = 0;
  std::int64_t VoxOffset = 0;
  std::int64_t QFormCode = 0;
  std::int64_t SFormCode = 0;
  Double3 Quatern{};
  Double3 QOffset{};
  std::array<double, 12> SRow{};
};

template <typename Integer, typename Real, typename Code>
Header Take(const Fields& f, const std::array<std::size_t, 9>& at)
{
  Header h;
  for (std::size_t i = 0; i < 8; ++i)
  {
    h.Dim.at(i) = f.At<Integer>(at[0] + i * sizeof(Integer));
    h.PixDim.at(i) = f.At<Real>(at[1] + i * sizeof(Real));
  }
  h.DataType = f.At<std::int16_t>(at[2]);
  h.QFormCode = f.At<Code>(at[4]);
  h.SFormCode = f.At<Code>(at[5]);
  for (std::size_t i = 0; i < 3; ++i)
  {
    h.Quatern.at(i) = f.At<Real>(at[6] + i * sizeof(Real));
    h.QOffset.at(i) = f.At<Real>(at[7] + i * sizeof(Real));
  }
  for (std::size_t i = 0; i < 12; ++i)
  {
    h.SRow.at(i) = f.At<Real>(at[8] + i * sizeof(Real));
  }
  return h;
}

struct Type
{
  ScalarType Scalar;
  int Components;
};

std::optional<Type> TypeOf(std::int64_t code)
{
  static const std::map<std::int64_t, Type> types{ { 2, { ScalarType::UInt8, 1 } },
    { 4, { ScalarType::Int16, 1 } }, { 8, { ScalarType::Int32, 1 } },
    { 16, { ScalarType::Float32, 1 } }, { 64, { ScalarType::Float64, 1 } },
    { 128, { ScalarType::UInt8, 3 } }, { 256, { ScalarType::Int8, 1 } },
    { 512, { ScalarType::UInt16, 1 } }, { 768, { ScalarType::UInt32, 1 } },
    { 2304, { ScalarType::UInt8, 4 } } };
  const auto found = types.find(code);
  return found == types.end() ? std::nullopt : std::optional<Type>(found->second);
}

/// Steps of the axes and the place of the first voxel.
std::array<Double3, 3> Place(const Header& h, Double3& origin)
{
  std::array<Double3, 3> steps{};
  if (h.SFormCode > 0)
  {
    for (std::size_t row = 0; row < 3; ++row)
    {
      for (std::size_t a = 0; a < 3; ++a)
      {
        steps.at(a).at(row) = h.SRow.at(4 * row + a);
      }
      origin.at(row) = h.SRow.at(4 * row + 3);
    }
    return steps;
  }
  for (std::size_t a = 0; a < 3; ++a)
  {
    const double spacing = std::abs(h.PixDim.at(a + 1));
    steps.at(a).at(a) = spacing > 0.0 && std::isfinite(spacing) ? spacing : 1.0;
  }
  if (h.QFormCode > 0)
  {
    const double b = h.Quatern[0];
    const double c = h.Quatern[1];
    const double d = h.Quatern[2];
    const double a = std::sqrt(std::max(0.0, 1.0 - (b * b + c * c + d * d)));
    const double third = h.PixDim[0] < 0.0 ? -1.0 : 1.0;
    const std::array<double, 9> r{ a * a + b * b - c * c - d * d, 2 * (b * c - a * d),
      2 * (b * d + a * c), 2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b),
      2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - b * b - c * c };
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      const double spacing = steps.at(axis).at(axis) * (axis == 2 ? third : 1.0);
      for (std::size_t row = 0; row < 3; ++row)
      {
        steps.at(axis).at(row) = r.at(3 * row + axis) * spacing;
      }
    }
    origin = h.QOffset;
  }
  return steps;
}

bool EndsWith(const std::string& text, const std::string& end)
{
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/// Header and voxels, which may be two files, and either compressed.
struct Names
{
  std::string Header;
  std::string Voxels;
};

Names NamesOf(const std::string& fileName)
{
  for (const char* end : { ".hdr", ".img", ".hdr.gz", ".img.gz" })
  {
    if (EndsWith(headers::Lower(fileName), end))
    {
      const std::string stem = fileName.substr(0, fileName.size() - std::strlen(end));
      const auto existing = [&](const std::string& ending)
      {
        std::error_code error;
        return std::filesystem::exists(stem + ending, error) ? stem + ending
                                                             : stem + ending + ".gz";
      };
      return { existing(".hdr"), existing(".img") };
    }
  }
  return { fileName, fileName };
}

Result<Header> Parse(const std::string& name, bool& swapped)
{
  constexpr std::int32_t first = 348;
  constexpr std::int32_t second = 540;
  auto bytes = headers::DecodedBegin(name, first, second + 4);
  if (!bytes.Ok())
  {
    return bytes.GetStatus();
  }
  if (bytes.Value().compare(0, 2, "#?") == 0)
  {
    return Unsupported(name, "is a Radiance picture, not the header of a volume; write it as TIFF");
  }
  const std::size_t had = bytes.Value().size();
  bytes.Value().resize(std::max<std::size_t>(had, second + 4));
  for (const bool swap : { false, true })
  {
    const Fields f(bytes.Value(), swap);
    const auto size = f.At<std::int32_t>(0);
    swapped = swap;
    if (size == first && had >= static_cast<std::size_t>(first))
    {
      Header h =
        Take<std::int16_t, float, std::int16_t>(f, { 40, 76, 70, 0, 252, 254, 256, 268, 280 });
      const auto offset = f.At<float>(108);
      if (!std::isfinite(offset))
      {
        return Corrupt(name, "has voxels that begin nowhere");
      }
      h.VoxOffset = static_cast<std::int64_t>(std::clamp(offset, 0.0F, 1e9F));
      return h;
    }
    if (size == second && had >= static_cast<std::size_t>(second))
    {
      Header h =
        Take<std::int64_t, double, std::int32_t>(f, { 16, 104, 12, 0, 344, 348, 352, 376, 400 });
      h.VoxOffset = f.At<std::int64_t>(168);
      return h;
    }
  }
  return Corrupt(name, "isn't a NIfTI file, or its header is damaged");
}
} // namespace

Result<RawVolume> ReadNIfTIHeader(const std::string& fileName, int timePoint)
{
  const Names names = NamesOf(fileName);
  RawVolume raw;
  const auto parsed = Parse(names.Header, raw.BigEndian);
  if (!parsed.Ok())
  {
    return parsed.GetStatus();
  }
  const Header& h = parsed.Value();
  const auto type = TypeOf(h.DataType);
  if (!type)
  {
    return Unsupported(fileName, "has voxels of NIfTI's type " + std::to_string(h.DataType));
  }
  VoxelReader::Description& volume = raw.Volume;
  volume.Type = type->Scalar;
  volume.Components = type->Components;
  if (h.Dim[0] < 1 || h.Dim[0] > 7)
  {
    return Corrupt(fileName, "has " + std::to_string(h.Dim[0]) + " axes");
  }
  std::int64_t times = 1;
  std::int64_t bytes = static_cast<std::int64_t>(SizeOf(volume.Type)) * volume.Components;
  for (std::size_t i = 1; i <= 7; ++i)
  {
    const std::int64_t size = static_cast<std::int64_t>(i) <= h.Dim[0] ? h.Dim.at(i) : 1;
    constexpr std::int64_t longest = 0x7fffffff;
    if (size < 1 || size > longest || (i <= 3 && __builtin_mul_overflow(bytes, size, &bytes)))
    {
      return Corrupt(fileName, "has an axis of " + std::to_string(size) + " voxels");
    }
    if (i <= 3)
    {
      volume.Dimensions.at(i - 1) = size;
    }
    else if (i == 4)
    {
      times = size;
    }
    else if (size > 1)
    {
      return Unsupported(fileName, "has more axes than three of space and one of time");
    }
  }
  std::int64_t before = 0;
  if (timePoint < 0 || timePoint >= times || __builtin_mul_overflow(bytes, timePoint, &before) ||
    h.VoxOffset < 0 || __builtin_add_overflow(before, h.VoxOffset, &before))
  {
    return headers::NoTimePoint(fileName, times, timePoint);
  }
  const Status status = headers::TakeSteps(fileName, Place(h, volume.Origin), volume);
  if (!status.Ok())
  {
    return status;
  }
  volume.ArrayName = "NIFTI";
  return headers::VoxelsIn(names.Voxels, before, raw);
}

} // namespace teravox
