// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Types.h"

#include <cstdint>
#include <optional>
#include <string>

namespace teravox
{

/// How linear filtering of a driver was found to behave, per texture format.
struct FilterProbe
{
  bool R8 = false; ///< exact, and the same at every place of the texture
  bool R16 = false;
  bool R32F = false;

  /// "r8,r16,r32f", what of it is exact; "none".
  std::string ToString() const;
  /// The inverse; none for another text.
  static std::optional<FilterProbe> FromString(const std::string& text);
};

/// What the texels of an atlas are: the one place where that is decided, for who draws and for who
/// only plans. Thread: immutable value.
struct TexelFormat
{
  std::uint32_t BytesPerTexel = 2; ///< of one component: 1 and 2 integers, 4 floats
  bool DriverFilter = false;       ///< else eight fetches per sample and own weights
  bool Relative = false;           ///< to the brick's range: needs the slot table

  /// The cheapest format whose filtering is exact: 8-bit data go into 16-bit texels where the
  /// driver filters those exactly and 8-bit ones not.
  static TexelFormat Choose(ScalarType type, const FilterProbe& probe);
};

} // namespace teravox
