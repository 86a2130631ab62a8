// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Types.h"

namespace teravox
{

const char* ToString(ScalarType type)
{
  static constexpr std::array<const char*, 8> names = { "u8", "i8", "u16", "i16", "u32", "i32",
    "f32", "f64" };
  return names.at(static_cast<std::size_t>(type));
}

std::size_t SizeOf(ScalarType type)
{
  return DispatchScalarType(type, [](auto v) { return sizeof(v); });
}

} // namespace teravox
