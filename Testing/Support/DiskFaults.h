// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

namespace teravox::test
{

/// A disk that fails on demand. DiskFaults.cxx defines the C library's functions for files; linked
/// into a program (or loaded before it, as the library teravox_disk_faults) they stand before the
/// C library's own for all libraries of the process, HDF5 included.
struct DiskRule
{
  enum Operation : int
  {
    Read = 1,  ///< read, pread
    Write = 2, ///< write, pwrite
    Open = 4,  ///< open for reading
    Sync = 8,  ///< fsync
    Lock = 16, ///< flock
    OpenToWrite = 32
  };
  enum class Fault : int
  {
    Error, ///< fails with Errno
    Short, ///< half of the bytes, at least one
    Stall  ///< lasts until EndDiskFaults(), or Milliseconds if that isn't 0; then succeeds
  };

  std::string File; ///< part of the name of the files that are meant
  int Operations = Read;
  Fault Kind = Fault::Error;
  int Errno = 0;
  int Milliseconds = 0;
  std::int64_t Skip = 0;   ///< operations that succeed first
  std::int64_t Count = -1; ///< operations that fail then; below 0: all
};

/// One rule at a time. The library takes its rule from the environment variable
/// TERAVOX_DISK_FAULT: "<part of file name>:<operations>:<errno>:<skip>:<count>", errors only.
/// Thread: any.
void BeginDiskFaults(const DiskRule& rule);
/// Nothing fails any more, stalled operations go on.
void EndDiskFaults();
/// Operations that the rule was meant for since BeginDiskFaults(), failed ones included.
std::int64_t DiskOperationsMet();
/// Operations that stall at this moment.
int DiskOperationsStalled();

} // namespace teravox::test
