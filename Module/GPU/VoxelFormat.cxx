// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "VoxelFormat.h"

namespace teravox
{

VoxelFormat VoxelFormat::Choose(ScalarType type)
{
  VoxelFormat format;
  static_cast<TexelFormat&>(format) = TexelFormat::Choose(type);
  switch (format.BytesPerTexel)
  {
    case 1:
      format.InternalFormat = GL_R8;
      format.DataType = GL_UNSIGNED_BYTE;
      format.CellFormat = GL_RG8;
      format.NormalizedScale = 255;
      break;
    case 2:
      format.InternalFormat = GL_R16;
      format.DataType = GL_UNSIGNED_SHORT;
      format.CellFormat = GL_RG16;
      format.NormalizedScale = 65535;
      break;
    default:
      format.InternalFormat = GL_R32F;
      format.DataType = GL_FLOAT;
      format.CellFormat = GL_RG32F;
      break;
  }
  return format;
}

} // namespace teravox
