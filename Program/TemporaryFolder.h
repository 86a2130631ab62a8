// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace teravox::program
{

/// A new folder, removed with all that is in it.
class TemporaryFolder
{
public:
  /// In `parent`; empty: where the system keeps temporary files.
  explicit TemporaryFolder(const std::string& parent = {});
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  TemporaryFolder(TemporaryFolder&&) = delete;
  TemporaryFolder& operator=(TemporaryFolder&&) = delete;

  /// Empty if it couldn't be made.
  const std::string& Path() const { return this->Name; }

private:
  std::string Name;
};

} // namespace teravox::program
