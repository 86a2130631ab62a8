// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "HeaderText.h"

#include "Formats/FormatText.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fcntl.h>
#include <sstream>
#include <sys/stat.h>
#include <unistd.h>

namespace teravox::headers
{

Result<int> OpenRegular(const std::string& fileName)
{
  // Opening a pipe waits for its writer otherwise.
  const int file = ::open(fileName.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  struct stat info = {};
  if (file < 0 || ::fstat(file, &info) != 0)
  {
    const int error = errno;
    if (file >= 0)
    {
      ::close(file);
    }
    return Status(error == ENOENT ? StatusCode::NotFound : StatusCode::InputOutput,
      "'" + fileName + "' can't be opened: " + std::strerror(error) + ".");
  }
  if (!S_ISREG(info.st_mode))
  {
    ::close(file);
    return Unsupported(fileName, "is no regular file");
  }
  return file;
}

Result<std::string> Begin(const std::string& fileName, std::size_t most)
{
  const auto file = OpenRegular(fileName);
  if (!file.Ok())
  {
    return file.GetStatus();
  }
  struct stat info = {};
  std::string text(::fstat(file.Value(), &info) == 0
      ? std::min(most, static_cast<std::size_t>(std::max<off_t>(0, info.st_size)))
      : most,
    '\0');
  std::size_t had = 0;
  ssize_t n = 1;
  while (had < text.size() && n != 0)
  {
    n = ::read(file.Value(), text.data() + had, text.size() - had);
    if (n < 0 && errno != EINTR)
    {
      const Status failed(
        StatusCode::InputOutput, "'" + fileName + "' can't be read: " + std::strerror(errno) + ".");
      ::close(file.Value());
      return failed;
    }
    had += static_cast<std::size_t>(std::max<ssize_t>(0, n));
  }
  ::close(file.Value());
  text.resize(had);
  return text;
}

Status Corrupt(const std::string& fileName, const std::string& what)
{
  return { StatusCode::Corrupt, "'" + fileName + "' " + what + "." };
}

Status Unsupported(const std::string& fileName, const std::string& what)
{
  return { StatusCode::Unsupported, "'" + fileName + "' " + what + "." };
}

std::string Trimmed(const std::string& text)
{
  constexpr const char* blanks = " \t\r\n";
  const std::size_t first = text.find_first_not_of(blanks);
  return first == std::string::npos ? std::string()
                                    : text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

std::string Lower(std::string text)
{
  std::transform(text.begin(), text.end(), text.begin(),
    [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::vector<std::string> Words(const std::string& text)
{
  std::istringstream in(text);
  std::vector<std::string> words;
  std::string word;
  while (in >> word)
  {
    words.push_back(word);
  }
  return words;
}

std::string Beside(const std::string& header, const std::string& name)
{
  const std::size_t slash = header.rfind('/');
  return name.rfind('/', 0) == 0 || slash == std::string::npos ? name
                                                               : header.substr(0, slash + 1) + name;
}

std::optional<std::vector<std::string>> Numbered(
  const std::string& pattern, std::int64_t first, std::int64_t last, std::int64_t step)
{
  constexpr std::int64_t most = 1 << 20;
  const std::size_t percent = pattern.find('%');
  const std::size_t end = pattern.find('d', percent == std::string::npos ? 0 : percent);
  if (percent == std::string::npos || end == std::string::npos ||
    pattern.find('%', percent + 1) != std::string::npos || step == 0 || (last - first) / step < 0 ||
    (last - first) / step >= most)
  {
    return std::nullopt;
  }
  const std::string digits = pattern.substr(percent + 1, end - percent - 1);
  const bool zeros = !digits.empty() && digits.front() == '0';
  if (digits.find_first_not_of("0123456789") != std::string::npos || digits.size() > 2)
  {
    return std::nullopt;
  }
  const std::size_t width = digits.empty() ? 0 : static_cast<std::size_t>(std::stoi(digits));
  std::vector<std::string> names;
  for (std::int64_t i = 0; i <= (last - first) / step; ++i)
  {
    std::string number = std::to_string(first + i * step);
    number.insert(0, width > number.size() ? width - number.size() : 0, zeros ? '0' : ' ');
    names.push_back(pattern.substr(0, percent) + number + pattern.substr(end + 1));
  }
  return names;
}

Status TakeSteps(const std::string& fileName, const std::array<Double3, 3>& steps,
  VoxelReader::Description& volume)
{
  for (std::size_t a = 0; a < 3; ++a)
  {
    if (!std::isfinite(volume.Origin.at(a)))
    {
      return Corrupt(fileName, "has a first voxel without a place");
    }
    const Double3& step = steps.at(a);
    const double length = std::sqrt(step[0] * step[0] + step[1] * step[1] + step[2] * step[2]);
    if (!(length > 0.0) || !std::isfinite(length))
    {
      return Corrupt(fileName, "has voxels without an extent along axis " + std::to_string(a));
    }
    volume.Spacing.at(a) = length;
    for (std::size_t row = 0; row < 3; ++row)
    {
      volume.Direction.at(3 * row + a) = step.at(row) / length;
    }
  }
  const std::array<double, 9>& d = volume.Direction;
  const double determinant = d[0] * (d[4] * d[8] - d[5] * d[7]) -
    d[1] * (d[3] * d[8] - d[5] * d[6]) + d[2] * (d[3] * d[7] - d[4] * d[6]);
  return std::abs(determinant) > 1e-6 ? Status()
                                      : Corrupt(fileName, "has axes that lie in one plane");
}

} // namespace teravox::headers
