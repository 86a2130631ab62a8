// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "VoxelFormat.h"

#include <cmath>
#include <cstring>
#include <type_traits>

namespace teravox
{

VoxelFormat VoxelFormat::Choose(ScalarType type, const FilterProbe& probe)
{
  VoxelFormat format;
  switch (type)
  {
    case ScalarType::UInt8:
    case ScalarType::Int8:
      format.Scale = 255;
      format.Offset = type == ScalarType::Int8 ? -128 : 0;
      format.DriverFilter = probe.R8 || probe.R16;
      if (probe.R8 || !probe.R16)
      {
        format.InternalFormat = GL_R8;
        format.DataType = GL_UNSIGNED_BYTE;
        format.BytesPerTexel = 1;
      }
      break;
    case ScalarType::UInt16:
    case ScalarType::Int16:
      format.Scale = 65535;
      format.Offset = type == ScalarType::Int16 ? -32768 : 0;
      format.DriverFilter = probe.R16;
      break;
    case ScalarType::UInt32:
    case ScalarType::Int32:
    case ScalarType::Float32:
    case ScalarType::Float64:
    default:
      format.InternalFormat = GL_R32F;
      format.DataType = GL_FLOAT;
      format.BytesPerTexel = 4;
      format.DriverFilter = probe.R32F;
      format.Relative = type != ScalarType::Float32;
      break;
  }
  return format;
}

namespace
{
template <typename T>
void ConvertIntegers(const Brick& brick, const VoxelFormat& format, ConvertedBrick& out)
{
  using Unsigned = std::make_unsigned_t<T>;
  // Flipping the sign bit adds half the range: the order of values is that of unsigned numbers.
  constexpr Unsigned flip = std::is_signed_v<T>
    ? static_cast<Unsigned>(Unsigned{ 1 } << (sizeof(T) * 8 - 1))
    : Unsigned{ 0 };
  const std::size_t count = brick.Voxels.size() / sizeof(T);
  const auto* in = reinterpret_cast<const Unsigned*>(brick.Voxels.data());
  if (format.BytesPerTexel == sizeof(T))
  {
    auto* texels = reinterpret_cast<Unsigned*>(out.Bytes.data());
    for (std::size_t i = 0; i < count; ++i)
    {
      texels[i] = static_cast<Unsigned>(in[i] ^ flip);
    }
    return;
  }
  // 8 bits in 16: x * 257 / 65535 = x / 255.
  auto* texels = reinterpret_cast<std::uint16_t*>(out.Bytes.data());
  for (std::size_t i = 0; i < count; ++i)
  {
    texels[i] = static_cast<std::uint16_t>(static_cast<Unsigned>(in[i] ^ flip) * 257u);
  }
}

template <typename T>
void ConvertRelative(const Brick& brick, ConvertedBrick& out)
{
  const std::size_t count = brick.Voxels.size() / sizeof(T);
  const auto* in = reinterpret_cast<const T*>(brick.Voxels.data());
  ValueRange range = ValueRange::Void();
  for (std::size_t i = 0; i < count; ++i)
  {
    if (std::isfinite(static_cast<double>(in[i])))
    {
      range.Include(static_cast<double>(in[i]));
    }
  }
  const double low = range.IsVoid() ? 0 : range.Min;
  // Scale first rounded to what the shader multiplies with, so that the ends map to 0 and about 1.
  out.Scale = range.IsVoid() ? 1 : static_cast<float>(range.Max - range.Min);
  out.Scale = out.Scale > 0 ? out.Scale : 1;
  out.OffsetHigh = static_cast<float>(low);
  out.OffsetLow = static_cast<float>(low - static_cast<double>(out.OffsetHigh));
  auto* texels = reinterpret_cast<float*>(out.Bytes.data());
  const double inverse = 1.0 / static_cast<double>(out.Scale);
  for (std::size_t i = 0; i < count; ++i)
  {
    texels[i] = static_cast<float>((static_cast<double>(in[i]) - low) * inverse);
  }
}
} // namespace

ConvertedBrick ConvertBrick(const Brick& brick, const VoxelFormat& format)
{
  ConvertedBrick out;
  const std::size_t count = brick.Voxels.size() / SizeOf(brick.Type);
  out.Bytes.resize(count * format.BytesPerTexel);
  DispatchScalarType(brick.Type,
    [&](auto zero)
    {
      using T = decltype(zero);
      if constexpr (std::is_integral_v<T> && sizeof(T) <= 2)
      {
        ConvertIntegers<T>(brick, format, out);
      }
      else if constexpr (std::is_same_v<T, float>)
      {
        std::memcpy(out.Bytes.data(), brick.Voxels.data(), out.Bytes.size());
      }
      else
      {
        ConvertRelative<T>(brick, out);
      }
    });
  return out;
}

} // namespace teravox
