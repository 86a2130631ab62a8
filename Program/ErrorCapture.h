// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>

namespace teravox::program
{

/// Catches what VTK would print as long as it lives, so that a failure is one sentence instead of a
/// report. Warnings are passed on as one line each. Thread: internally synchronized.
class ErrorCapture
{
public:
  ErrorCapture();
  ~ErrorCapture();
  ErrorCapture(const ErrorCapture&) = delete;
  ErrorCapture& operator=(const ErrorCapture&) = delete;
  ErrorCapture(ErrorCapture&&) = delete;
  ErrorCapture& operator=(ErrorCapture&&) = delete;

  bool HasError() const;
  /// The first error since the beginning or since Clear(); empty if there was none.
  std::string First() const;
  void Clear();

private:
  class Window;
  std::unique_ptr<Window> Self;
};

} // namespace teravox::program
