// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Types.h"

#include <cstdint>

namespace teravox
{

/// What the texels of an atlas are: the one place where that is decided, for who draws and for who
/// only plans. Data value = Scale * texel + Offset, or for wide types (u32, i32, f32, f64) relative
/// to the brick, with offset and scale per slot. Thread: immutable value.
struct TexelFormat
{
  std::uint32_t BytesPerTexel = 2; ///< of one component: 1 and 2 integers, 4 floats
  bool Relative = false;           ///< to a value of the brick: needs the slot table
  double Scale = 1;                ///< of a texel as it is stored
  double Offset = 0;               ///< -2^7 and -2^15 for signed types: texels are unsigned

  bool IsFloat() const { return this->BytesPerTexel == 4; }

  /// The smallest format that holds the values exactly.
  static TexelFormat Choose(ScalarType type);
};

} // namespace teravox
