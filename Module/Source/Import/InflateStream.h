// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace teravox
{

/// Reads what a file holds as a zlib or gzip stream (of several members, too), forwards; going back
/// starts again. Thread: one.
class InflateStream
{
public:
  /// The stream begins `offset` bytes into the file. Errors: NotFound, InputOutput.
  static Result<std::unique_ptr<InflateStream>> Open(
    const std::string& fileName, std::int64_t offset);
  ~InflateStream();
  InflateStream(const InflateStream&) = delete;
  InflateStream& operator=(const InflateStream&) = delete;
  InflateStream(InflateStream&&) = delete;
  InflateStream& operator=(InflateStream&&) = delete;

  /// `size` bytes of what it decodes to, from `position` on.
  /// Errors: Corrupt (damaged, or it ends before), InputOutput.
  Status Read(std::int64_t position, std::size_t size, void* out);

private:
  struct Decoder;
  InflateStream(std::string fileName, std::int64_t offset);
  Status Start();
  /// To `out`, or away if that is null.
  Status Decode(std::size_t size, std::byte* out);

  std::string Name;
  std::int64_t Offset;
  int File = -1;
  std::int64_t Position = 0;
  std::unique_ptr<Decoder> State;
};

} // namespace teravox
