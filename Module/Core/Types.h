// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

namespace teravox
{

/// Three 64-bit numbers in the order x, y, z (x fastest in memory).
using Int3 = std::array<std::int64_t, 3>;
using Double3 = std::array<double, 3>;

/// The scalar types of voxels.
enum class ScalarType : std::uint8_t
{
  UInt8,
  Int8,
  UInt16,
  Int16,
  UInt32,
  Int32,
  Float32,
  Float64
};

inline constexpr std::array<ScalarType, 8> AllScalarTypes = { ScalarType::UInt8, ScalarType::Int8,
  ScalarType::UInt16, ScalarType::Int16, ScalarType::UInt32, ScalarType::Int32, ScalarType::Float32,
  ScalarType::Float64 };

/// "u8", "i8", ..., "f64".
const char* ToString(ScalarType type);

/// Size of one component in bytes.
std::size_t SizeOf(ScalarType type);

inline bool IsFloat(ScalarType type)
{
  return type == ScalarType::Float32 || type == ScalarType::Float64;
}

/// Calls `f(T{})` with the C++ type that belongs to `type`.
template <typename F>
decltype(auto) DispatchScalarType(ScalarType type, F&& f)
{
  switch (type)
  {
    case ScalarType::UInt8:
      return std::forward<F>(f)(std::uint8_t{});
    case ScalarType::Int8:
      return std::forward<F>(f)(std::int8_t{});
    case ScalarType::UInt16:
      return std::forward<F>(f)(std::uint16_t{});
    case ScalarType::Int16:
      return std::forward<F>(f)(std::int16_t{});
    case ScalarType::UInt32:
      return std::forward<F>(f)(std::uint32_t{});
    case ScalarType::Int32:
      return std::forward<F>(f)(std::int32_t{});
    case ScalarType::Float32:
      return std::forward<F>(f)(float{});
    case ScalarType::Float64:
    default:
      return std::forward<F>(f)(double{});
  }
}

/// A closed interval of voxel values. Three kinds matter to the renderer: *unknown* (never
/// skipped), *void* (no value at all, for instance all NaN: contributes nothing) and *single* (one
/// value everywhere).
struct ValueRange
{
  double Min = -std::numeric_limits<double>::infinity();
  double Max = std::numeric_limits<double>::infinity();

  static ValueRange Unknown() { return {}; }
  static ValueRange Void()
  {
    return { std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity() };
  }
  bool IsVoid() const { return this->Min > this->Max; }
  bool IsSingle() const { return this->Min == this->Max; }
  bool IsKnown() const { return std::isfinite(this->Min) && std::isfinite(this->Max); }

  /// Widens the interval by a value; NaN is left out.
  void Include(double value)
  {
    this->Min = value < this->Min ? value : this->Min;
    this->Max = value > this->Max ? value : this->Max;
  }
  void Include(const ValueRange& other)
  {
    this->Min = other.Min < this->Min ? other.Min : this->Min;
    this->Max = other.Max > this->Max ? other.Max : this->Max;
  }
  /// Makes two values of one, so that nothing is said to have it everywhere.
  void WidenSingle()
  {
    if (this->IsSingle())
    {
      this->Max = std::nextafter(this->Max, std::numeric_limits<double>::infinity());
    }
  }
  bool Contains(const ValueRange& other) const
  {
    return other.IsVoid() || (this->Min <= other.Min && other.Max <= this->Max);
  }
  bool operator==(const ValueRange& o) const { return this->Min == o.Min && this->Max == o.Max; }
};

/// ceil(a / b) for a >= 0, b > 0.
constexpr std::int64_t CeilDiv(std::int64_t a, std::int64_t b)
{
  return a / b + (a % b != 0 ? 1 : 0);
}

} // namespace teravox
