// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <hdf5.h>
#include <mutex>
#include <string>

namespace teravox
{

/// Serialises Teravox's calls of the HDF5 library and keeps its error stack quiet meanwhile. The
/// library has one lock of its own; waiting here keeps decoding threads out of it.
/// Thread: not recursive; never hold one while waiting for another thread.
class HDF5Lock
{
public:
  HDF5Lock();
  ~HDF5Lock();
  HDF5Lock(const HDF5Lock&) = delete;
  HDF5Lock& operator=(const HDF5Lock&) = delete;
  HDF5Lock(HDF5Lock&&) = delete;
  HDF5Lock& operator=(HDF5Lock&&) = delete;

  /// The innermost cause on HDF5's error stack, for instance "unable to open file (... No such file
  /// or directory ...)"; clears the stack.
  std::string TakeError() const;
  /// True if the innermost error is HDF5's way to say that a chunk isn't stored (1.10 has no
  /// other); then clears the stack.
  bool TakeUnallocated() const;

  /// How often, in this thread, a call under a lock has failed because a file couldn't be read: the
  /// library says of an object that it doesn't exist, too, when the disk has failed.
  static std::uint64_t ReadFailures();
  /// What the last one was; empty if there was none.
  static const char* LastReadFailure();

private:
  static std::mutex& Mutex();
  std::unique_lock<std::mutex> Guard;
  H5E_auto2_t Function = nullptr;
  void* Data = nullptr;
};

} // namespace teravox
