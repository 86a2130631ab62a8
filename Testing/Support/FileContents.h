// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fstream>
#include <iterator>
#include <string>

namespace teravox::testing
{

/// All bytes of a file; none if it can't be read.
inline std::string ContentsOf(const std::string& file)
{
  std::ifstream in(file, std::ios::binary);
  return { std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>() };
}

} // namespace teravox::testing
