// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ProgressBar.h"

#include "ByteCount.h"

#include <algorithm>
#include <cstdio>
#include <fmt/format.h>
#include <unistd.h>

namespace teravox::program
{

ProgressBar::ProgressBar()
  : Start(Clock::now())
  , Terminal(isatty(STDERR_FILENO) != 0)
{
}

ProgressBar::~ProgressBar()
{
  this->Clear();
}

double ProgressBar::Seconds() const
{
  return std::chrono::duration<double>(Clock::now() - this->Start).count();
}

std::string ProgressBar::Line(std::uint64_t doneBytes, std::uint64_t totalBytes, double seconds)
{
  constexpr int width = 30;
  const double fraction = totalBytes == 0
    ? 1.0
    : std::min(1.0, static_cast<double>(doneBytes) / static_cast<double>(totalBytes));
  const int full = static_cast<int>(fraction * width);
  std::string line =
    fmt::format("[{}{}] {:3.0f} %", std::string(static_cast<std::size_t>(full), '#'),
      std::string(static_cast<std::size_t>(width - full), '.'), 100.0 * fraction);
  if (doneBytes > 0 && seconds > 0.0)
  {
    const double rate = static_cast<double>(doneBytes) / seconds;
    const double left = static_cast<double>(totalBytes - std::min(doneBytes, totalBytes)) / rate;
    line += fmt::format("  {}/s  {} left", FormatByteCount(rate), FormatDuration(left));
  }
  return line;
}

void ProgressBar::Update(std::uint64_t doneBytes, std::uint64_t totalBytes)
{
  const Clock::time_point now = Clock::now();
  if (!this->Terminal || (this->Visible && now - this->Drawn < std::chrono::milliseconds(100)))
  {
    return;
  }
  this->Drawn = now;
  this->Visible = true;
  fmt::print(stderr, "\r{}\x1b[K", Line(doneBytes, totalBytes, this->Seconds()));
  std::fflush(stderr);
}

void ProgressBar::Clear()
{
  if (this->Visible)
  {
    fmt::print(stderr, "\r\x1b[K");
    std::fflush(stderr);
    this->Visible = false;
  }
}

} // namespace teravox::program
