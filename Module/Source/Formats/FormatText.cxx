// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "FormatText.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <set>

namespace teravox::formats
{

Status Corrupt(const HDF5File& file, const std::string& what)
{
  return { StatusCode::Corrupt, "The file '" + file.Name() + "' is damaged: " + what + "." };
}

std::string Counted(std::size_t n, const std::string& what)
{
  return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
}

std::string Text(const Int3& v)
{
  return std::to_string(v[0]) + " x " + std::to_string(v[1]) + " x " + std::to_string(v[2]);
}

std::string Text(const Double3& v)
{
  std::string text;
  for (const double n : v)
  {
    char buffer[32];
    std::snprintf(buffer, sizeof(buffer), "%.6g", n);
    text += (text.empty() ? "" : " x ") + std::string(buffer);
  }
  return text;
}

std::optional<std::vector<double>> ParseNumbers(const std::string& text, std::size_t limit)
{
  std::vector<double> numbers;
  const char* p = text.c_str();
  while (true)
  {
    while (*p == ' ' || *p == ',' || *p == '\t' || *p == '\n' || *p == '\r')
    {
      ++p;
    }
    if (*p == '\0')
    {
      break;
    }
    char* end = nullptr;
    const double number = std::strtod(p, &end);
    if (end == p || numbers.size() == limit)
    {
      return std::nullopt;
    }
    numbers.push_back(number);
    p = end;
  }
  // An embedded zero hides what is behind it.
  if (p != text.c_str() + text.size())
  {
    return std::nullopt;
  }
  return numbers;
}

std::optional<std::int64_t> ParseIndex(const std::string& text, std::int64_t most)
{
  if (text.empty() || text.size() > 18 ||
    !std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; }))
  {
    return std::nullopt;
  }
  const std::int64_t value = std::stoll(text);
  return value <= most ? std::optional<std::int64_t>(value) : std::nullopt;
}

std::optional<std::int64_t> IndexBehind(const std::string& name, const std::string& prefix)
{
  return name.compare(0, prefix.size(), prefix) == 0
    ? ParseIndex(name.substr(prefix.size()), INT32_MAX)
    : std::nullopt;
}

std::vector<std::int64_t> IndicesBehind(
  const std::vector<std::string>& names, const std::string& prefix)
{
  std::vector<std::int64_t> indices;
  for (const std::string& name : names)
  {
    if (const auto index = IndexBehind(name, prefix))
    {
      indices.push_back(*index);
    }
  }
  std::sort(indices.begin(), indices.end());
  indices.erase(std::unique(indices.begin(), indices.end()), indices.end());
  return indices;
}

Status CheckRequest(
  const HDF5File& file, const VolumeRequest& request, std::size_t channels, std::size_t timePoints)
{
  if (request.TimePoint < 0 || static_cast<std::size_t>(request.TimePoint) >= timePoints)
  {
    return { StatusCode::InvalidArgument,
      "The file '" + file.Name() + "' has " + Counted(timePoints, "time point") +
        ", counted from 0; there is no time point " + std::to_string(request.TimePoint) + "." };
  }
  if (request.Channel == VolumeRequest::AllChannels)
  {
    return channels <= 4 ? Status()
                         : Status(StatusCode::Unsupported,
                             "The file '" + file.Name() + "' has " + Counted(channels, "channel") +
                               "; at most 4 can be components of one volume.");
  }
  if (request.Channel < 0 || static_cast<std::size_t>(request.Channel) >= channels)
  {
    return { StatusCode::InvalidArgument,
      "The file '" + file.Name() + "' has " + Counted(channels, "channel") +
        ", counted from 0; there is no channel " + std::to_string(request.Channel) + "." };
  }
  return {};
}

std::vector<std::size_t> ChannelsOf(const VolumeRequest& request, std::size_t channels)
{
  std::vector<std::size_t> chosen;
  for (std::size_t c = 0; c < channels; ++c)
  {
    if (request.Channel == VolumeRequest::AllChannels ||
      c == static_cast<std::size_t>(request.Channel))
    {
      chosen.push_back(c);
    }
  }
  return chosen;
}

std::int64_t FactorBetween(std::int64_t fine, std::int64_t coarse)
{
  if (fine < 1 || coarse < 1 || coarse > fine)
  {
    return 0;
  }
  const auto fits = [&](std::int64_t f)
  { return std::max<std::int64_t>(fine / f, 1) == coarse || CeilDiv(fine, f) == coarse; };
  for (std::int64_t f = 1; f <= fine; f *= 2)
  {
    if (fits(f))
    {
      return f;
    }
  }
  // Between the quotients' neighbours if at all.
  for (std::int64_t f = std::max<std::int64_t>(fine / (coarse + 1), 1); f <= fine / coarse + 1; ++f)
  {
    if (fits(f))
    {
      return f;
    }
  }
  return 0;
}

std::optional<std::string> FindGroup(const HDF5File& file,
  const std::function<std::optional<std::string>(const std::string& group)>& reasonOf,
  std::string& reason)
{
  constexpr std::size_t mostGroups = 256;
  std::vector<std::string> groups{ "/" };
  std::set<std::uint64_t> seen{ file.ObjectAddress("/") };
  for (std::size_t g = 0; g < groups.size(); ++g)
  {
    if (const auto why = reasonOf(groups[g]))
    {
      reason = *why;
      return groups[g];
    }
    for (const std::string& name : file.Children(groups[g], mostGroups))
    {
      const std::string path = (groups[g] == "/" ? "" : groups[g]) + "/" + name;
      if (groups.size() < mostGroups && file.IsGroup(path) &&
        seen.insert(file.ObjectAddress(path)).second)
      {
        groups.push_back(path);
      }
    }
  }
  return std::nullopt;
}

std::optional<std::string> RecogniseGroup(const HDF5File& file, const std::string& path,
  const std::function<std::optional<std::string>(const std::string& group)>& reasonOf)
{
  if (!path.empty())
  {
    return reasonOf(Absolute(path));
  }
  std::string reason;
  return FindGroup(file, reasonOf, reason) ? std::optional<std::string>(reason) : std::nullopt;
}

std::string Absolute(const std::string& path)
{
  return path.empty() || path.front() != '/' ? "/" + path : path;
}

std::optional<Int3> WholeFactors(const double* xyz)
{
  Int3 factors{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    const double f = xyz[a];
    if (!(f >= 1) || !(f <= 2147483648.0) || std::abs(f - std::round(f)) > 1e-6 * f)
    {
      return std::nullopt;
    }
    factors[a] = std::llround(f);
  }
  return factors;
}

bool IsSpacing(const Double3& spacing)
{
  return std::all_of(
    spacing.begin(), spacing.end(), [](double s) { return std::isfinite(s) && s > 0; });
}

} // namespace teravox::formats
