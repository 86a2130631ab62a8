// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TexelFormat.h"

namespace teravox
{

TexelFormat TexelFormat::Choose(ScalarType type)
{
  switch (type)
  {
    case ScalarType::UInt8:
      return { 1, false, 1, 0 };
    case ScalarType::Int8:
      return { 1, false, 1, -128 };
    case ScalarType::UInt16:
      return { 2, false, 1, 0 };
    case ScalarType::Int16:
      return { 2, false, 1, -32768 };
    case ScalarType::UInt32:
    case ScalarType::Int32:
    case ScalarType::Float32:
    case ScalarType::Float64:
    default:
      return { 4, true, 1, 0 };
  }
}

} // namespace teravox
