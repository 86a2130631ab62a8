// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "HDF5Handle.h"

#include <cstdint>
#include <hdf5.h>
#include <string>
#include <sys/stat.h>

namespace teravox
{

/// Notices that a file becomes shorter while it is open. The HDF5 library takes what lies beyond
/// the end of a file for zeros, which would be voxels. Thread: only while an HDF5Lock is held.
class FileLength
{
public:
  FileLength() = default;
  /// Of the file of an object, as long as it is now. Requires: the object stays open.
  explicit FileLength(hid_t object)
  {
    const HDF5Handle file(H5Iget_file_id(object));
    void* descriptor = nullptr;
    if (file.Valid() && H5Fget_vfd_handle(file.Get(), H5P_DEFAULT, &descriptor) >= 0 &&
      descriptor != nullptr)
    {
      this->Descriptor = *static_cast<int*>(descriptor);
      this->Bytes = this->Now();
    }
  }

  /// Empty, or how much shorter the file is.
  std::string Shrunk() const
  {
    const std::int64_t now = this->Now();
    return now >= this->Bytes
      ? std::string()
      : "the file has become shorter while it was open, " + std::to_string(now) + " of " +
        std::to_string(this->Bytes) + " bytes; it was truncated, or is being written anew";
  }

private:
  std::int64_t Now() const
  {
    struct stat info = {};
    return this->Descriptor >= 0 && ::fstat(this->Descriptor, &info) == 0
      ? static_cast<std::int64_t>(info.st_size)
      : this->Bytes;
  }

  int Descriptor = -1;
  std::int64_t Bytes = 0;
};

} // namespace teravox
