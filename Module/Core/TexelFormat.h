// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Types.h"

#include <cstdint>

namespace teravox
{

/// What the texels of an atlas are: the one place where that is decided, for who draws and for who
/// only plans. Thread: immutable value.
struct TexelFormat
{
  std::uint32_t BytesPerTexel = 2; ///< of one component: 1 and 2 integers, 4 floats
  bool Relative = false;           ///< to the brick's range: needs the slot table

  /// The smallest format that holds the values exactly.
  static TexelFormat Choose(ScalarType type);
};

} // namespace teravox
