// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "HDF5Handle.h"

#include <cstdint>
#include <hdf5.h>
#include <memory>

namespace teravox
{

/// What became of the writes of a file that was created with HDF5OutputDriver.
struct HDF5OutputState
{
  int Error = 0;                ///< errno of the first write that failed; 0: none
  bool Discard = false;         ///< drop all writes from now on
  std::uint64_t RawAddress = 0; ///< in the file, of the last write of voxels
  std::uint64_t RawSize = 0;    ///< its bytes
};

/// An HDF5 file driver for one new file. After a write that fails (disk full) it drops all others
/// and reports success: HDF5 itself can't close a file that it can't write, and crashes at exit.
/// Thread: only while an HDF5Lock is held.
class HDF5OutputDriver
{
public:
  /// A file access property list for H5Fcreate; invalid if the library is out of memory. `state`
  /// must outlive the file.
  static HDF5Handle MakeAccess(HDF5OutputState& state);
};

} // namespace teravox
