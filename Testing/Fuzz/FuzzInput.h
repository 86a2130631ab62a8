// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <unistd.h>

namespace teravox::fuzz
{

/// A file of this process with the given content, always the same one of an extension, gone when it
/// ends; in memory where /dev/shm is.
inline std::string FileOf(const std::uint8_t* data, std::size_t size, const std::string& extension)
{
  static struct Files
  {
    Files() = default;
    ~Files()
    {
      for (const std::filesystem::path& name : this->Names)
      {
        std::error_code ignored;
        std::filesystem::remove(name, ignored);
      }
    }
    Files(const Files&) = delete;
    Files& operator=(const Files&) = delete;
    Files(Files&&) = delete;
    Files& operator=(Files&&) = delete;
    std::set<std::filesystem::path> Names;
  } files;
  const std::filesystem::path name =
    (std::filesystem::exists("/dev/shm") ? "/dev/shm" : std::filesystem::temp_directory_path()) /
    ("teravox-fuzz-" + std::to_string(::getpid()) + extension);
  files.Names.insert(name);
  std::ofstream(name, std::ios::binary)
    .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  return name.string();
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
