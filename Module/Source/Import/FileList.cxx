// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "FileList.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <system_error>

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
        const std::string digits = first < end ? text.substr(first, end - first) : std::string();
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

/// Whether `name` from `n` on is what `pattern` from `p` on means.
bool Matches(const std::string& pattern, std::size_t p, const std::string& name, std::size_t n)
{
  for (; p < pattern.size(); ++p, ++n)
  {
    const bool star = pattern[p] == '*';
    const std::size_t end =
      pattern[p] == '%' ? pattern.find_first_not_of("0123456789", p + 1) : std::string::npos;
    if (star || (end != std::string::npos && pattern[end] == 'd'))
    {
      const std::size_t digits = star ? 0 : end - p - 1;
      constexpr std::size_t most = 2;
      const std::size_t least = star ? 0
        : digits > 0 && digits <= most
        ? std::max<std::size_t>(
            1, static_cast<std::size_t>(std::stoi(pattern.substr(p + 1, digits))))
        : 1;
      for (std::size_t length = 0; n + length <= name.size(); ++length)
      {
        if (length >= least && Matches(pattern, star ? p + 1 : end + 1, name, n + length))
        {
          return true;
        }
        if (n + length < name.size() && !star && !IsDigit(name[n + length]))
        {
          return false;
        }
      }
      return false;
    }
    if (n >= name.size() || pattern[p] != name[n])
    {
      return false;
    }
  }
  return n == name.size();
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
    if (name[0] != '.' && entry->is_regular_file(unknown) && Matches(pattern, 0, name, 0))
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
