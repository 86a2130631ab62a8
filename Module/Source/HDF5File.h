// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "HDF5Handle.h"
#include "Status.h"

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace teravox
{

/// An HDF5 file opened for reading, without file locks, and its attributes.
/// Thread: any; functions take the HDF5Lock themselves, so the caller must not hold it.
class HDF5File
{
public:
  /// Errors: NotFound; InputOutput (no permission); Corrupt (not HDF5, truncated).
  static Result<std::shared_ptr<HDF5File>> Open(const std::string& fileName);

  HDF5File(HDF5Handle id, std::string name);
  ~HDF5File();
  HDF5File(const HDF5File&) = delete;
  HDF5File& operator=(const HDF5File&) = delete;
  HDF5File(HDF5File&&) = delete;
  HDF5File& operator=(HDF5File&&) = delete;

  const std::string& Name() const { return this->Name_; }
  hid_t Id() const { return this->Handle.Get(); }

  /// True if every part of the absolute path exists and the last one resolves to an object.
  bool Has(const std::string& path) const;
  /// Names of the links of a group, in increasing order; at most `limit`.
  std::vector<std::string> Children(const std::string& path, std::size_t limit) const;

  /// Attributes; nothing if it doesn't exist or has another kind of type. Numbers are converted.
  std::optional<std::string> Text(const std::string& path, const std::string& attribute) const;
  std::optional<std::vector<double>> Numbers(
    const std::string& path, const std::string& attribute) const;
  std::optional<std::vector<std::int64_t>> Integers(
    const std::string& path, const std::string& attribute) const;

  /// Stored bytes that datasets of this file have read.
  std::atomic<std::uint64_t> BytesRead{ 0 };

private:
  HDF5Handle Handle;
  std::string Name_;
};

} // namespace teravox
