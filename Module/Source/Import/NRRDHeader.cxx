// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Formats/FormatText.h"
#include "HeaderText.h"
#include "RawVolume.h"

#include <algorithm>
#include <functional>
#include <sstream>

namespace teravox
{

namespace
{
using headers::Corrupt;
using headers::Unsupported;

struct Header
{
  std::map<std::string, std::string> Fields;
  std::size_t End = 0;            // where the voxels begin, if they are in the same file
  std::vector<std::string> Lines; // behind "data file: LIST"
};

Header Split(const std::string& text)
{
  Header header;
  std::istringstream in(text);
  std::string line;
  bool list = false;
  while (std::getline(in, line))
  {
    line = headers::Trimmed(line);
    if (list)
    {
      header.Lines.push_back(line);
      continue;
    }
    if (line.empty())
    {
      break;
    }
    const std::size_t colon = line.find(": ");
    if (line[0] == '#' || colon == std::string::npos)
    {
      continue;
    }
    const std::string key = headers::Lower(headers::Trimmed(line.substr(0, colon)));
    header.Fields[key == "datafile" ? "data file" : key] = headers::Trimmed(line.substr(colon + 2));
    list =
      (key == "data file" || key == "datafile") && header.Fields["data file"].rfind("LIST", 0) == 0;
  }
  header.End = in.tellg() < 0 ? text.size() : static_cast<std::size_t>(in.tellg());
  return header;
}

std::optional<ScalarType> TypeOf(const std::string& name)
{
  static const std::map<std::string, ScalarType> types{ { "signed char", ScalarType::Int8 },
    { "int8", ScalarType::Int8 }, { "int8_t", ScalarType::Int8 }, { "uchar", ScalarType::UInt8 },
    { "unsigned char", ScalarType::UInt8 }, { "uint8", ScalarType::UInt8 },
    { "uint8_t", ScalarType::UInt8 }, { "short", ScalarType::Int16 },
    { "short int", ScalarType::Int16 }, { "signed short", ScalarType::Int16 },
    { "signed short int", ScalarType::Int16 }, { "int16", ScalarType::Int16 },
    { "int16_t", ScalarType::Int16 }, { "ushort", ScalarType::UInt16 },
    { "unsigned short", ScalarType::UInt16 }, { "unsigned short int", ScalarType::UInt16 },
    { "uint16", ScalarType::UInt16 }, { "uint16_t", ScalarType::UInt16 },
    { "int", ScalarType::Int32 }, { "signed int", ScalarType::Int32 },
    { "int32", ScalarType::Int32 }, { "int32_t", ScalarType::Int32 },
    { "uint", ScalarType::UInt32 }, { "unsigned int", ScalarType::UInt32 },
    { "uint32", ScalarType::UInt32 }, { "uint32_t", ScalarType::UInt32 },
    { "float", ScalarType::Float32 }, { "double", ScalarType::Float64 } };
  const auto found = types.find(headers::Lower(name));
  return found == types.end() ? std::nullopt : std::optional<ScalarType>(found->second);
}

/// "(a,b,c)" or "none" for each axis; nothing if anything else is there.
std::optional<std::vector<std::optional<Double3>>> Vectors(const std::string& text)
{
  std::vector<std::optional<Double3>> all;
  std::size_t at = 0;
  while ((at = text.find_first_not_of(" \t", at)) != std::string::npos)
  {
    if (text.compare(at, 4, "none") == 0)
    {
      all.emplace_back();
      at += 4;
      continue;
    }
    const std::size_t close = text.find(')', at);
    if (text[at] != '(' || close == std::string::npos)
    {
      return std::nullopt;
    }
    const auto numbers = formats::ParseNumbers(text.substr(at + 1, close - at - 1), 3);
    if (!numbers || numbers->empty())
    {
      return std::nullopt;
    }
    Double3 vector{ 0, 0, 0 };
    std::copy(numbers->begin(), numbers->end(), vector.begin());
    all.emplace_back(vector);
    at = close + 1;
  }
  return all;
}

Status TakeFiles(const std::string& fileName, const Header& header, RawVolume& raw)
{
  const auto found = header.Fields.find("data file");
  if (found == header.Fields.end())
  {
    raw.Files = { fileName };
    raw.Offset = raw.Offset == -1 ? -1 : raw.Offset + static_cast<std::int64_t>(header.End);
    return {};
  }
  const std::vector<std::string> words = headers::Words(found->second);
  if (!words.empty() && words[0] == "LIST")
  {
    for (const std::string& line : header.Lines)
    {
      if (!line.empty())
      {
        raw.Files.push_back(headers::Beside(fileName, line));
      }
    }
    return {};
  }
  if (words.size() >= 4 && words[0].find('%') != std::string::npos)
  {
    constexpr std::int64_t most = 0x7fffffff;
    const auto first = formats::ParseIndex(words[1], most);
    const auto last = formats::ParseIndex(words[2], most);
    const auto step = formats::ParseIndex(words[3], most);
    const auto names =
      first && last && step ? headers::Numbered(words[0], *first, *last, *step) : std::nullopt;
    if (!names)
    {
      return Corrupt(fileName, "has a pattern of files that isn't understood: " + found->second);
    }
    for (const std::string& name : *names)
    {
      raw.Files.push_back(headers::Beside(fileName, name));
    }
    return {};
  }
  raw.Files = { headers::Beside(fileName, found->second) };
  return {};
}

/// Axes of the file to those of the volume: the first one may be components.
Status TakeAxes(const std::string& fileName, const Header& header,
  const std::function<std::string(const char*)>& field, RawVolume& raw)
{
  VoxelReader::Description& volume = raw.Volume;
  const auto sizes = formats::ParseNumbers(field("sizes"), 16);
  const auto axes = formats::ParseIndex(field("dimension"), 16);
  if (!sizes || !axes || sizes->size() != static_cast<std::size_t>(*axes) || sizes->empty())
  {
    return Corrupt(fileName, "doesn't tell its size (dimension, sizes)");
  }
  std::vector<std::optional<Double3>> directions;
  if (header.Fields.count("space directions") != 0)
  {
    const auto vectors = Vectors(field("space directions"));
    if (!vectors || vectors->size() != sizes->size())
    {
      return Corrupt(fileName, "has space directions that don't fit its axes");
    }
    directions = *vectors;
  }
  const std::vector<std::string> kinds = headers::Words(headers::Lower(field("kinds")));
  const bool spatialKind = kinds.empty() || kinds[0] == "domain" || kinds[0] == "space";
  const bool components = sizes->size() > 1 && (*sizes)[0] >= 1 && (*sizes)[0] <= 4 &&
    (directions.empty() ? !spatialKind || sizes->size() == 4 : !directions[0].has_value());
  const std::size_t first = components ? 1 : 0;
  if (sizes->size() - first > 3)
  {
    return Unsupported(fileName,
      "has " + std::to_string(sizes->size()) +
        " axes; 3, and before them one of up to four components, are read");
  }
  volume.Components = components ? static_cast<int>((*sizes)[0]) : 1;
  const auto spacings = formats::ParseNumbers(field("spacings"), 16);
  std::array<Double3, 3> steps{ Double3{ 1, 0, 0 }, Double3{ 0, 1, 0 }, Double3{ 0, 0, 1 } };
  for (std::size_t a = 0; a < 3; ++a)
  {
    const std::size_t axis = a + first;
    const double size = axis < sizes->size() ? (*sizes)[axis] : 1;
    constexpr double longest = 2147483647.0;
    if (!(size >= 1.0) || size > longest)
    {
      return Corrupt(fileName, "has an axis without voxels, or with too many");
    }
    volume.Dimensions.at(a) = static_cast<std::int64_t>(size);
    if (axis < directions.size())
    {
      if (!directions[axis])
      {
        return Unsupported(
          fileName, "has an axis without a direction in space that isn't the first");
      }
      steps.at(a) = *directions[axis];
    }
    else if (spacings && axis < spacings->size() && (*spacings)[axis] > 0.0)
    {
      steps.at(a).at(a) = (*spacings)[axis];
    }
  }
  const auto origin = Vectors(field("space origin"));
  if (origin && origin->size() == 1 && (*origin)[0])
  {
    volume.Origin = *(*origin)[0];
  }
  return headers::TakeSteps(fileName, steps, volume);
}
} // namespace

Result<RawVolume> ReadNRRDHeader(const std::string& fileName)
{
  constexpr std::size_t most = std::size_t{ 4 } << 20;
  const auto text = headers::Begin(fileName, most);
  if (!text.Ok())
  {
    return text.GetStatus();
  }
  if (text.Value().compare(0, 4, "NRRD") != 0)
  {
    return Corrupt(fileName, "isn't an NRRD file");
  }
  const Header header = Split(text.Value());
  const auto field = [&header](const char* name)
  {
    const auto found = header.Fields.find(name);
    return found == header.Fields.end() ? std::string() : found->second;
  };
  RawVolume raw;
  const auto type = TypeOf(field("type"));
  if (!type)
  {
    return Unsupported(fileName, "has voxels of the type '" + field("type") + "'");
  }
  raw.Volume.Type = *type;
  const std::string encoding = headers::Lower(field("encoding"));
  raw.Compressed = encoding == "gzip" || encoding == "gz";
  raw.Text = encoding == "text" || encoding == "txt" || encoding == "ascii";
  if (encoding != "raw" && !raw.Compressed && !raw.Text)
  {
    return Unsupported(
      fileName, "has the encoding '" + encoding + "'; raw, gzip and text are read");
  }
  raw.BigEndian = headers::Lower(field("endian")) == "big";
  const std::string skip = field("byte skip").empty() ? field("byteskip") : field("byte skip");
  const auto skipped = formats::ParseIndex(skip, std::int64_t{ 1 } << 60);
  const std::string lines = field("line skip").empty() ? field("lineskip") : field("line skip");
  if ((!skipped && skip != "-1" && !skip.empty()) || (!lines.empty() && lines != "0"))
  {
    return Unsupported(fileName, "skips lines, or bytes in a way that isn't understood");
  }
  if (raw.Compressed)
  {
    raw.Before = skipped.value_or(0); // of what it decodes to
  }
  else
  {
    raw.Offset = skip == "-1" ? -1 : skipped.value_or(0);
  }
  Status status = TakeAxes(fileName, header, field, raw);
  if (status.Ok())
  {
    status = TakeFiles(fileName, header, raw);
  }
  return status.Ok() ? Result<RawVolume>(raw) : Result<RawVolume>(status);
}

} // namespace teravox
