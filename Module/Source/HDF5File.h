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
  /// Where the path leads through a link to another file that isn't there or isn't a regular one:
  /// that file's name; else empty.
  std::string MissingFile(const std::string& path) const;
  bool IsGroup(const std::string& path) const;
  /// The dimensions of a dataset, slowest first; nothing if it is none.
  std::optional<std::vector<std::int64_t>> DatasetShape(const std::string& path) const;
  /// Its type as "u8", "i16", "f32", ...; empty for others.
  std::string DatasetType(const std::string& path) const;
  /// The values of a dataset of at most `limit` numbers; nothing if it is none.
  std::optional<std::vector<double>> DatasetNumbers(
    const std::string& path, std::size_t limit) const;
  /// The text of a dataset with one string; nothing if it is none.
  std::optional<std::string> DatasetText(const std::string& path) const;
  /// A number that is the same for two paths to one object; 0 if there is none.
  std::uint64_t ObjectAddress(const std::string& path) const;
  /// Names of the links of a group, in increasing order; at most `limit`.
  std::vector<std::string> Children(const std::string& path, std::size_t limit) const;

  /// Attributes; nothing if it doesn't exist, has another kind of type or more than 2^16 values.
  /// Numbers are converted. A text may be one string, or an array of strings of one character.
  bool HasAttribute(const std::string& path, const std::string& attribute) const;
  std::optional<std::string> Text(const std::string& path, const std::string& attribute) const;
  /// An array of strings, or one.
  std::optional<std::vector<std::string>> Texts(
    const std::string& path, const std::string& attribute) const;
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
