// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace teravox::test
{

/// How the program ended. ExitCode is -n if signal n ended it.
struct Outcome
{
  int ExitCode = -1;
  std::string Output;
  std::string Error;
  std::uint64_t PeakBytes = 0; ///< of memory that was resident
};

struct RunOptions
{
  std::optional<std::string> Display;   ///< DISPLAY; nothing: as it is
  std::optional<std::string> GLVersion; ///< MESA_GL_VERSION_OVERRIDE
  std::uint64_t AddressSpaceLimit = 0;  ///< in bytes; 0: none
  std::string TemporaryFolder;          ///< TMPDIR; empty: as it is
  std::uint64_t FileSizeLimit = 0;      ///< of files that it writes, in bytes; 0: none
  /// Sends these signals, one after another, as soon as a file (or folder) exists whose name begins
  /// with this one.
  std::string InterruptWhenExists;
  std::vector<int> Signals;
  int DelayMilliseconds = 0; ///< before the signals
};

/// Runs the program `teravox` with these arguments and waits for its end.
Outcome RunProgram(const std::vector<std::string>& arguments, const RunOptions& options = {});

} // namespace teravox::test
