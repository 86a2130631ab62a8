// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <unistd.h>

namespace teravox::fuzz
{

/// A file of this process with the given content, always the same one, gone when it ends; in memory
/// where /dev/shm is.
inline std::string FileOf(const std::uint8_t* data, std::size_t size, const std::string& extension)
{
  static const struct File
  {
    explicit File(const std::string& extension)
      : Name((std::filesystem::exists("/dev/shm") ? "/dev/shm"
                                                  : std::filesystem::temp_directory_path()) /
          ("teravox-fuzz-" + std::to_string(::getpid()) + extension))
    {
    }
    ~File()
    {
      std::error_code ignored;
      std::filesystem::remove(this->Name, ignored);
    }
    File(const File&) = delete;
    File& operator=(const File&) = delete;
    File(File&&) = delete;
    File& operator=(File&&) = delete;
    std::filesystem::path Name;
  } file(extension);
  std::ofstream(file.Name, std::ios::binary)
    .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  return file.Name.string();
}

/// Ends the program as a crash does, so that the input is kept.
inline void Require(bool holds, const char* what)
{
  if (!holds)
  {
    std::fprintf(stderr, "violated: %s\n", what);
    std::abort();
  }
}

} // namespace teravox::fuzz
