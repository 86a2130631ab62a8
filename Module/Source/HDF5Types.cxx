// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "HDF5Types.h"

namespace teravox
{

hid_t HDF5FileType(ScalarType type, bool bigEndian)
{
  switch (type)
  {
    case ScalarType::UInt8:
      return bigEndian ? H5T_STD_U8BE : H5T_STD_U8LE;
    case ScalarType::Int8:
      return bigEndian ? H5T_STD_I8BE : H5T_STD_I8LE;
    case ScalarType::UInt16:
      return bigEndian ? H5T_STD_U16BE : H5T_STD_U16LE;
    case ScalarType::Int16:
      return bigEndian ? H5T_STD_I16BE : H5T_STD_I16LE;
    case ScalarType::UInt32:
      return bigEndian ? H5T_STD_U32BE : H5T_STD_U32LE;
    case ScalarType::Int32:
      return bigEndian ? H5T_STD_I32BE : H5T_STD_I32LE;
    case ScalarType::Float32:
      return bigEndian ? H5T_IEEE_F32BE : H5T_IEEE_F32LE;
    case ScalarType::Float64:
    default:
      return bigEndian ? H5T_IEEE_F64BE : H5T_IEEE_F64LE;
  }
}

hid_t HDF5MemoryType(ScalarType type)
{
  static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "decoded voxels are little-endian");
  return HDF5FileType(type, false);
}

} // namespace teravox
