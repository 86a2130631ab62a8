// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace teravox::program
{

/// One line on the terminal: bar, percentage, rate, time left. Writes nothing if standard error
/// isn't a terminal. Thread: one.
class ProgressBar
{
public:
  ProgressBar();
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  ProgressBar(ProgressBar&&) = delete;
  ProgressBar& operator=(ProgressBar&&) = delete;

  /// Redraws at most ten times a second.
  void Update(std::uint64_t doneBytes, std::uint64_t totalBytes);
  /// Removes the line.
  void Clear();
  double Seconds() const;

  /// The text of the line; for tests.
  static std::string Line(std::uint64_t doneBytes, std::uint64_t totalBytes, double seconds);

private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point Start;
  Clock::time_point Drawn;
  bool Terminal;
  bool Visible = false;
};

} // namespace teravox::program
