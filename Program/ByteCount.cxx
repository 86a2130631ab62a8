// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ByteCount.h"

#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <fmt/format.h>

namespace teravox::program
{

std::optional<std::uint64_t> ParseByteCount(const std::string& text)
{
  if (text.empty() || std::isdigit(static_cast<unsigned char>(text[0])) == 0)
  {
    return std::nullopt;
  }
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  std::string unit(end);
  for (char& c : unit)
  {
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  for (const char* suffix : { "ib", "b" })
  {
    const std::string s = suffix;
    if (unit.size() >= s.size() && unit.compare(unit.size() - s.size(), s.size(), s) == 0)
    {
      unit.resize(unit.size() - s.size());
      break;
    }
  }
  const std::string units = "kmgt";
  double factor = 1.0;
  if (!unit.empty())
  {
    const std::size_t power = units.find(unit);
    if (power == std::string::npos)
    {
      return std::nullopt;
    }
    factor = std::pow(1024.0, static_cast<double>(power + 1));
  }
  const double bytes = std::floor(number * factor);
  if (!(bytes >= 0.0 && bytes < 9.2e18))
  {
    return std::nullopt;
  }
  return static_cast<std::uint64_t>(bytes);
}

std::string FormatByteCount(double bytes)
{
  constexpr std::array<const char*, 5> units{ "B", "KiB", "MiB", "GiB", "TiB" };
  std::size_t unit = 0;
  while (std::abs(bytes) >= 1024.0 && unit + 1 < units.size())
  {
    bytes /= 1024.0;
    ++unit;
  }
  return unit == 0 ? fmt::format("{:.0f} B", bytes)
                   : fmt::format("{:.{}f} {}", bytes, bytes < 100.0 ? 1 : 0, units.at(unit));
}

std::string FormatDuration(double seconds)
{
  if (!(seconds >= 0.0 && seconds < 1e9))
  {
    return "?";
  }
  if (seconds < 9.95)
  {
    return fmt::format("{:.1f} s", seconds);
  }
  const auto whole = static_cast<long long>(std::llround(seconds));
  if (whole < 60)
  {
    return fmt::format("{} s", whole);
  }
  if (whole < 3600)
  {
    return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  }
  return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

} // namespace teravox::program
