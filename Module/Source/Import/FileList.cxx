// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "FileList.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <system_error>
#include <utility>

namespace teravox
{

namespace
{
namespace fs = std::filesystem;

bool IsDigit(char c)
{
  return std::isdigit(static_cast<unsigned char>(c)) != 0;
}

/// Numbers in names count as such.
bool NaturallyLess(const std::string& a, const std::string& b)
{
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < a.size() && j < b.size())
  {
    if (IsDigit(a[i]) && IsDigit(b[j]))
    {
      const auto run = [](const std::string& text, std::size_t& at)
      {
        const std::size_t first = text.find_first_not_of('0', at);
        std::size_t end = at;
        while (end < text.size() && IsDigit(text[end]))
        {
          ++end;
        }
        std::string digits = first < end ? text.substr(first, end - first) : std::string();
        at = end;
        return digits;
      };
      const std::string m = run(a, i);
      const std::string n = run(b, j);
      if (m != n)
      {
        return m.size() != n.size() ? m.size() < n.size() : m < n;
      }
    }
    else if (a[i] != b[j])
    {
      return a[i] < b[j];
    }
    else
    {
      ++i;
      ++j;
    }
  }
  return a.size() - i != b.size() - j ? a.size() - i < b.size() - j : a < b;
}

/// Whether `name` is what `pattern` means: part by part of the pattern all places up to which the
/// parts before may reach, so that the time is bounded by parts times the square of the name.
bool Matches(const std::string& pattern, const std::string& name)
{
  std::vector<bool> reached(name.size() + 1, false);
  reached[0] = true;
  for (std::size_t p = 0; p < pattern.size();)
  {
    const bool star = pattern[p] == '*';
    const std::size_t end =
      pattern[p] == '%' ? pattern.find_first_not_of("0123456789", p + 1) : std::string::npos;
    const bool number = end != std::string::npos && pattern[end] == 'd';
    std::size_t least = star ? 0 : 1;
    constexpr std::size_t most = 2;
    if (number && end - p - 1 > 0 && end - p - 1 <= most)
    {
      least = std::max<std::size_t>(
        1, static_cast<std::size_t>(std::stoi(pattern.substr(p + 1, end - p - 1))));
    }
    std::vector<bool> next(name.size() + 1, false);
    for (std::size_t n = 0; n <= name.size(); ++n)
    {
      if (!reached[n])
      {
        continue;
      }
      if (!star && !number)
      {
        if (n < name.size() && pattern[p] == name[n])
        {
          next[n + 1] = true;
        }
        continue;
      }
      for (std::size_t to = n; to <= name.size() && (star || to == n || IsDigit(name[to - 1]));
           ++to)
      {
        if (to - n >= least)
        {
          next[to] = true;
        }
      }
      if (star)
      {
        break; // what lies behind was reached from here
      }
    }
    reached = std::move(next);
    p = number ? end + 1 : p + 1;
  }
  return reached[name.size()];
}

std::vector<std::string> Listed(const fs::path& folder, const std::string& pattern)
{
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(folder.empty() ? fs::path(".") : folder, error), end;
       !error && entry != end; entry.increment(error))
  {
    const std::string name = entry->path().filename().string();
    std::error_code unknown;
    if (name[0] != '.' && entry->is_regular_file(unknown) && Matches(pattern, name))
    {
      names.push_back(name);
    }
  }
  std::sort(names.begin(), names.end(), NaturallyLess);
  for (std::string& name : names)
  {
    name = (folder / name).string();
  }
  return names;
}
} // namespace

bool IsPattern(const std::string& name)
{
  std::error_code error;
  const std::string last = fs::path(name).filename().string();
  return (last.find('*') != std::string::npos || last.find('%') != std::string::npos) &&
    !fs::exists(name, error);
}

std::vector<std::string> FilesLike(const std::string& pattern)
{
  const fs::path path(pattern);
  return Listed(path.parent_path(), path.filename().string());
}

std::vector<std::string> FilesIn(const std::string& folder)
{
  return Listed(folder, "*");
}

} // namespace teravox
