// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Formats/FormatText.h"
#include "HeaderText.h"
#include "RawVolume.h"

#include <cstdlib>
#include <map>
#include <optional>

namespace teravox
{

namespace
{
using headers::Corrupt;
using headers::Unsupported;

std::optional<ScalarType> TypeOf(const std::string& name)
{
  static const std::map<std::string, ScalarType> types{ { "unsigned_char", ScalarType::UInt8 },
    { "char", ScalarType::Int8 }, { "signed_char", ScalarType::Int8 },
    { "unsigned_short", ScalarType::UInt16 }, { "short", ScalarType::Int16 },
    { "unsigned_int", ScalarType::UInt32 }, { "int", ScalarType::Int32 },
    { "float", ScalarType::Float32 }, { "double", ScalarType::Float64 } };
  const auto found = types.find(headers::Lower(name));
  return found == types.end() ? std::nullopt : std::optional<ScalarType>(found->second);
}

/// "%20" is a blank.
std::string Decoded(const std::string& text)
{
  std::string name;
  for (std::size_t i = 0; i < text.size(); ++i)
  {
    const std::string digits = text.substr(i, 3);
    const bool coded = digits.size() == 3 &&
      digits.find_first_not_of("0123456789abcdefABCDEF", 1) == std::string::npos;
    if (text[i] == '%' && coded)
    {
      name += static_cast<char>(std::strtol(digits.c_str() + 1, nullptr, 16));
      i += 2;
    }
    else
    {
      name += text[i];
    }
  }
  return name;
}

/// The lines of the header one after another, and where the next one begins.
struct Lines
{
  explicit Lines(const std::string& text)
    : Text(text)
  {
  }
  bool Next(std::string& line)
  {
    const std::size_t end = this->Text.find('\n', this->At);
    if (end == std::string::npos)
    {
      return false;
    }
    line = headers::Trimmed(this->Text.substr(this->At, end - this->At));
    this->At = end + 1;
    return true;
  }
  const std::string& Text;
  std::size_t At = 0;
};

Status TakeNumbers(
  const std::string& fileName, const std::vector<std::string>& words, Double3& numbers)
{
  for (std::size_t a = 0; a < 3; ++a)
  {
    const auto number = words.size() == 4 ? formats::ParseNumbers(words[a + 1], 1) : std::nullopt;
    if (!number || number->size() != 1)
    {
      return Corrupt(fileName, "has a header whose " + words[0] + " aren't three numbers");
    }
    numbers.at(a) = (*number)[0];
  }
  return {};
}

/// Behind POINT_DATA: the first array, if it is one of scalars.
Status TakeScalars(const std::string& fileName, Lines& lines, RawVolume& raw)
{
  std::string line;
  do
  {
    if (!lines.Next(line))
    {
      return Unsupported(fileName, "has no scalars");
    }
  } while (line.empty());
  const std::vector<std::string> words = headers::Words(line);
  if (words.size() < 3 || headers::Lower(words[0]) != "scalars")
  {
    return Unsupported(fileName, "begins with other arrays than scalars");
  }
  const auto type = TypeOf(words[2]);
  const auto components = words.size() > 3 ? formats::ParseIndex(words[3], 4) : 1;
  if (!type || !components || *components < 1)
  {
    return Unsupported(fileName, "has scalars of the kind '" + line + "'");
  }
  raw.Volume.Type = *type;
  raw.Volume.Components = static_cast<int>(*components);
  raw.Volume.ArrayName = Decoded(words[1]);
  if (!lines.Next(line) || headers::Lower(line).rfind("lookup_table", 0) != 0)
  {
    return Unsupported(fileName, "has scalars without LOOKUP_TABLE");
  }
  raw.Offset = static_cast<std::int64_t>(lines.At);
  return {};
}
} // namespace

Result<RawVolume> ReadLegacyVTKHeader(const std::string& fileName)
{
  constexpr std::size_t most = std::size_t{ 1 } << 16;
  const auto text = headers::Begin(fileName, most);
  if (!text.Ok())
  {
    return text.GetStatus();
  }
  Lines lines(text.Value());
  std::string version;
  std::string title;
  std::string encoding;
  std::string line;
  if (!lines.Next(version) || headers::Lower(version).rfind("# vtk datafile", 0) != 0 ||
    !lines.Next(title) || !lines.Next(encoding))
  {
    return Corrupt(fileName, "isn't a legacy VTK file, or its header is damaged");
  }
  encoding = headers::Lower(encoding);
  if (encoding != "ascii" && encoding != "binary")
  {
    return Corrupt(fileName, "is neither ASCII nor BINARY");
  }
  RawVolume raw;
  raw.Files = { fileName };
  raw.Text = encoding == "ascii";
  raw.BigEndian = !raw.Text;
  Double3 dimensions{ 0, 0, 0 };
  Double3 spacing{ 1, 1, 1 };
  bool points = false;
  while (lines.Next(line))
  {
    const std::vector<std::string> words = headers::Words(line);
    const std::string key = words.empty() ? std::string() : headers::Lower(words[0]);
    Status status;
    if (key == "dataset")
    {
      points = words.size() == 2 && headers::Lower(words[1]) == "structured_points";
      status = points ? Status() : Unsupported(fileName, "holds no structured points");
    }
    else if (key == "dimensions")
    {
      status = TakeNumbers(fileName, words, dimensions);
    }
    else if (key == "spacing" || key == "aspect_ratio")
    {
      status = TakeNumbers(fileName, words, spacing);
    }
    else if (key == "origin")
    {
      status = TakeNumbers(fileName, words, raw.Volume.Origin);
    }
    else if (key == "point_data")
    {
      status = points ? TakeScalars(fileName, lines, raw)
                      : Unsupported(fileName, "holds no structured points");
      for (std::size_t a = 0; a < 3 && status.Ok(); ++a)
      {
        constexpr double longest = 2147483647.0;
        const double size = dimensions.at(a);
        status = size >= 1.0 && size <= longest
          ? Status()
          : Corrupt(fileName, "has an axis without points, or with too many");
        raw.Volume.Dimensions.at(a) = status.Ok() ? static_cast<std::int64_t>(size) : 1;
      }
      if (status.Ok())
      {
        status = headers::TakeSteps(fileName,
          { Double3{ spacing[0], 0, 0 }, Double3{ 0, spacing[1], 0 }, Double3{ 0, 0, spacing[2] } },
          raw.Volume);
      }
      return status.Ok() ? Result<RawVolume>(raw) : Result<RawVolume>(status);
    }
    else if (!key.empty())
    {
      status = Unsupported(fileName, "has '" + words[0] + "' before its points");
    }
    if (!status.Ok())
    {
      return status;
    }
  }
  return Unsupported(fileName, "has no data at its points");
}

} // namespace teravox
