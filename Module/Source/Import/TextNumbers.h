// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"
#include "Types.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace teravox
{

/// Numbers written as text, separated by blanks, ends of lines or commas, from a position in a file
/// on; a piece of the file is in memory at a time. Thread: one.
class TextNumbers
{
public:
  /// Errors: NotFound, InputOutput.
  static Result<std::unique_ptr<TextNumbers>> Open(const std::string& fileName);
  ~TextNumbers();
  TextNumbers(const TextNumbers&) = delete;
  TextNumbers& operator=(const TextNumbers&) = delete;
  TextNumbers(TextNumbers&&) = delete;
  TextNumbers& operator=(TextNumbers&&) = delete;

  /// In bytes from the beginning of the file: behind the last number read.
  std::int64_t Position() const { return this->Begin + static_cast<std::int64_t>(this->At); }
  void GoTo(std::int64_t position);

  /// The next `count` numbers, as elements of the type; none are kept if `out` is null.
  /// Errors: Corrupt (something else, a number that the type doesn't hold, or the file ends),
  /// InputOutput.
  Status Read(ScalarType type, std::size_t count, std::byte* out);

private:
  explicit TextNumbers(std::string fileName);
  Status Fill();
  /// The next word; empty at the end of the file.
  Status NextWord(std::string& word);

  std::string Name;
  int File = -1;
  std::vector<char> Buffer;
  std::int64_t Begin = 0; // of the buffer in the file
  std::size_t At = 0;
};

} // namespace teravox
