// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TemporaryFolder.h"

#include <cstdlib>
#include <filesystem>
#include <system_error>

namespace teravox::program
{

TemporaryFolder::TemporaryFolder(const std::string& parent)
{
  std::error_code error;
  std::filesystem::path in = parent;
  if (parent.empty())
  {
    in = std::filesystem::temp_directory_path(error);
    in = error ? "/tmp" : in;
  }
  std::string pattern = (in / "teravox-bench-XXXXXX").string();
  this->Name = mkdtemp(pattern.data()) != nullptr ? pattern : std::string();
}

TemporaryFolder::~TemporaryFolder()
{
  if (!this->Name.empty())
  {
    std::error_code error;
    std::filesystem::remove_all(this->Name, error);
  }
}

} // namespace teravox::program
