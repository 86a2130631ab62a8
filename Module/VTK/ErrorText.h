// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cctype>
#include <string>

namespace teravox
{

/// The sentence in what VTK's error macro makes of it: "ERROR: In file, line 7\nvtkClass (0x1234):
/// sentence\n\n".
inline std::string ErrorText(const char* message)
{
  std::string text = message ? message : "";
  const std::size_t object = text.find("): ");
  if (object != std::string::npos && text.compare(0, 3, "ERR") == 0)
  {
    text.erase(0, object + 3);
  }
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())) != 0)
  {
    text.pop_back();
  }
  for (char& c : text)
  {
    c = c == '\n' ? ' ' : c;
  }
  return text;
}

} // namespace teravox
