// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "GLApi.h"
#include "TexelFormat.h"

namespace teravox
{

/// A texel format in OpenGL's words, which reads 8- and 16-bit texels as numbers up to 1. Thread:
/// immutable value.
struct VoxelFormat : TexelFormat
{
  GLenum InternalFormat = GL_R16;
  GLenum DataType = GL_UNSIGNED_SHORT; ///< of the uploaded texels
  GLenum CellFormat = GL_RG16;         ///< of two texel values, least and largest
  double NormalizedScale = 1;          ///< TexelFormat::Scale of texels that OpenGL has read

  static VoxelFormat Choose(ScalarType type);
};

} // namespace teravox
