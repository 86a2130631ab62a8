// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Types.h"

#include <optional>
#include <vtkType.h>

namespace teravox
{

/// VTK's number of a scalar type.
inline int ToVTK(ScalarType type)
{
  switch (type)
  {
    case ScalarType::UInt8:
      return VTK_UNSIGNED_CHAR;
    case ScalarType::Int8:
      return VTK_SIGNED_CHAR;
    case ScalarType::UInt16:
      return VTK_UNSIGNED_SHORT;
    case ScalarType::Int16:
      return VTK_SHORT;
    case ScalarType::UInt32:
      return VTK_UNSIGNED_INT;
    case ScalarType::Int32:
      return VTK_INT;
    case ScalarType::Float32:
      return VTK_FLOAT;
    case ScalarType::Float64:
    default:
      return VTK_DOUBLE;
  }
}

/// The scalar type behind VTK's number, or nothing for types that volumes can't have (64-bit
/// integers, bits, strings).
inline std::optional<ScalarType> FromVTK(int type)
{
  switch (type)
  {
    case VTK_UNSIGNED_CHAR:
      return ScalarType::UInt8;
    case VTK_CHAR:
      // Plain char has the sign that the platform gives it.
      return static_cast<char>(-1) < 0 ? ScalarType::Int8 : ScalarType::UInt8;
    case VTK_SIGNED_CHAR:
      return ScalarType::Int8;
    case VTK_UNSIGNED_SHORT:
      return ScalarType::UInt16;
    case VTK_SHORT:
      return ScalarType::Int16;
    case VTK_UNSIGNED_INT:
      return ScalarType::UInt32;
    case VTK_INT:
      return ScalarType::Int32;
    case VTK_FLOAT:
      return ScalarType::Float32;
    case VTK_DOUBLE:
      return ScalarType::Float64;
    default:
      return std::nullopt;
  }
}

} // namespace teravox
