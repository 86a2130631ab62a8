// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"
#include "GLApi.h"
#include "TexelFormat.h"

#include <cstdint>
#include <vector>

namespace teravox
{

/// How voxels of a scalar type lie in the atlas: data value = Scale * texel + Offset, or for wide
/// types (u32, i32, f64) relative to the brick, with offset and scale per slot. Thread: immutable
/// value.
struct VoxelFormat : TexelFormat
{
  GLenum InternalFormat = GL_R16;
  GLenum DataType = GL_UNSIGNED_SHORT; ///< of the uploaded texels
  GLenum CellFormat = GL_RG16;         ///< of two texel values, least and largest
  double Scale = 1;
  double Offset = 0;
  /// The factor of a texel as it is stored, which OpenGL reads as a number up to 1.
  double NativeScale() const { return this->DataType == GL_FLOAT ? this->Scale : 1; }

  /// TexelFormat::Choose() in OpenGL's words.
  static VoxelFormat Choose(ScalarType type);
};

/// Texels of one brick, and what the slot table holds for it.
struct ConvertedBrick
{
  std::vector<std::uint8_t> Bytes; ///< 8- or 16-bit texels or floats, by the format
  std::vector<std::uint8_t> Cells; ///< least and largest texel of each cell, x fastest
  float OffsetHigh = 0;
  float OffsetLow = 0;
  float Scale = 1;
};

/// Conversion before GL sees the data (drivers convert ten times slower).
/// Cells are of CellEdge^3 voxels inside the border; their ranges include the voxels that linear
/// interpolation reaches from them, and leave NaN out.
ConvertedBrick ConvertBrick(const Brick& brick, const VoxelFormat& format);

} // namespace teravox
