// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Formats/FormatText.h"
#include "HeaderText.h"
#include "RawVolume.h"

#include <algorithm>
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
  std::vector<std::string> Lines; // behind the field that names the voxels
};

Header Split(const std::string& text)
{
  Header header;
  std::istringstream in(text);
  std::string line;
  while (std::getline(in, line))
  {
    const std::size_t equals = line.find('=');
    if (header.Fields.count("ElementDataFile") != 0)
    {
      header.Lines.push_back(headers::Trimmed(line));
    }
    else if (equals != std::string::npos)
    {
      const std::string key = headers::Trimmed(line.substr(0, equals));
      header.Fields[key] = headers::Trimmed(line.substr(equals + 1));
      if (key == "ElementDataFile")
      {
        header.End = in.tellg() < 0 ? text.size() : static_cast<std::size_t>(in.tellg());
        if (header.Fields[key].rfind("LIST", 0) != 0)
        {
          break;
        }
      }
    }
  }
  return header;
}

std::optional<ScalarType> TypeOf(const std::string& name)
{
  static const std::map<std::string, ScalarType> types{ { "MET_UCHAR", ScalarType::UInt8 },
    { "MET_CHAR", ScalarType::Int8 }, { "MET_USHORT", ScalarType::UInt16 },
    { "MET_SHORT", ScalarType::Int16 }, { "MET_UINT", ScalarType::UInt32 },
    { "MET_INT", ScalarType::Int32 }, { "MET_FLOAT", ScalarType::Float32 },
    { "MET_DOUBLE", ScalarType::Float64 } };
  constexpr std::size_t ending = 6;
  const bool array = name.size() > ending && name.substr(name.size() - ending) == "_ARRAY";
  const auto found = types.find(array ? name.substr(0, name.size() - ending) : name);
  return found == types.end() ? std::nullopt : std::optional<ScalarType>(found->second);
}

bool IsTrue(const std::string& text)
{
  return !text.empty() && (text[0] == 'T' || text[0] == 't' || text[0] == '1');
}

Status TakeFiles(const std::string& fileName, const Header& header, RawVolume& raw)
{
  const std::string& data = header.Fields.at("ElementDataFile");
  const std::vector<std::string> words = headers::Words(data);
  if (words.empty())
  {
    return Corrupt(fileName, "names no file with its voxels");
  }
  if (data == "LOCAL" || data == "Local" || data == "local")
  {
    raw.Files = { fileName };
    raw.Offset = raw.Offset == -1 ? -1 : static_cast<std::int64_t>(header.End);
  }
  else if (words[0] == "LIST")
  {
    for (const std::string& line : header.Lines)
    {
      if (!line.empty())
      {
        raw.Files.push_back(headers::Beside(fileName, line));
      }
    }
  }
  else if (words.size() >= 3 && words[0].find('%') != std::string::npos)
  {
    constexpr std::int64_t most = 0x7fffffff;
    const auto first = formats::ParseIndex(words[1], most);
    const auto last = formats::ParseIndex(words[2], most);
    const auto step = words.size() > 3 ? formats::ParseIndex(words[3], most) : 1;
    const auto names =
      first && last && step ? headers::Numbered(words[0], *first, *last, *step) : std::nullopt;
    if (!names)
    {
      return Corrupt(fileName, "has a pattern of files that isn't understood: " + data);
    }
    for (const std::string& name : *names)
    {
      raw.Files.push_back(headers::Beside(fileName, name));
    }
  }
  else
  {
    raw.Files = { headers::Beside(fileName, data) };
  }
  return {};
}
} // namespace

Result<RawVolume> ReadMetaImageHeader(const std::string& fileName)
{
  constexpr std::size_t most = std::size_t{ 1 } << 20;
  const auto text = headers::Begin(fileName, most);
  if (!text.Ok())
  {
    return text.GetStatus();
  }
  Header header = Split(text.Value());
  const auto field = [&header](std::initializer_list<const char*> names)
  {
    for (const char* name : names)
    {
      const auto found = header.Fields.find(name);
      if (found != header.Fields.end())
      {
        return found->second;
      }
    }
    return std::string();
  };
  const auto axes = formats::ParseIndex(field({ "NDims" }), 1000);
  if (!axes || header.Fields.count("ElementDataFile") == 0)
  {
    return Corrupt(fileName, "isn't a MetaImage, or its header is damaged");
  }
  if (*axes < 1 || *axes > 3)
  {
    return Unsupported(fileName, "has " + std::to_string(*axes) + " axes; 1 to 3 are read");
  }
  const auto n = static_cast<std::size_t>(*axes);
  const auto numbers = [&](std::initializer_list<const char*> names, std::size_t count,
                         const std::vector<double>& usual)
  {
    const auto found = formats::ParseNumbers(field(names), count);
    return found && found->size() == count ? *found : usual;
  };
  RawVolume raw;
  VoxelReader::Description& volume = raw.Volume;
  const auto type = TypeOf(field({ "ElementType" }));
  if (!type)
  {
    return Unsupported(fileName, "has voxels of the type '" + field({ "ElementType" }) + "'");
  }
  volume.Type = *type;
  volume.ArrayName = "MetaImage"; // as VTK calls it
  const double channels = numbers({ "ElementNumberOfChannels" }, 1, { 1 })[0];
  if (!(channels >= 1.0) || channels > 4.0)
  {
    return Unsupported(
      fileName, "has " + field({ "ElementNumberOfChannels" }) + " channels; 1 to 4 are read");
  }
  volume.Components = static_cast<int>(channels);
  const std::vector<double> size = numbers({ "DimSize" }, n, {});
  if (size.empty())
  {
    return Corrupt(fileName, "doesn't tell its size (DimSize)");
  }
  const std::vector<double> spacing =
    numbers({ "ElementSpacing", "ElementSize" }, n, std::vector<double>(n, 1.0));
  const std::vector<double> position =
    numbers({ "Position", "Offset", "Origin" }, n, std::vector<double>(n, 0.0));
  const std::vector<double> matrix =
    numbers({ "TransformMatrix", "Rotation", "Orientation" }, n * n, {});
  std::array<Double3, 3> steps{ Double3{ 1, 0, 0 }, Double3{ 0, 1, 0 }, Double3{ 0, 0, 1 } };
  for (std::size_t a = 0; a < n; ++a)
  {
    constexpr double longest = 2147483647.0;
    if (!(size[a] >= 1.0) || size[a] > longest)
    {
      return Corrupt(fileName, "has an axis of " + field({ "DimSize" }) + " voxels");
    }
    volume.Dimensions.at(a) = static_cast<std::int64_t>(size[a]);
    volume.Origin.at(a) = position[a];
    for (std::size_t row = 0; row < n; ++row)
    {
      // One axis after another; lengths are in the spacing.
      const double d = matrix.empty() ? steps.at(a).at(row) : matrix[a * n + row];
      steps.at(a).at(row) = d * spacing[a];
    }
  }
  for (std::size_t a = n; a < 3; ++a)
  {
    volume.Dimensions.at(a) = 1;
  }
  Status status = headers::TakeSteps(fileName, steps, volume);
  if (!status.Ok())
  {
    return status;
  }
  raw.Text = !field({ "BinaryData" }).empty() && !IsTrue(field({ "BinaryData" }));
  raw.BigEndian = IsTrue(field({ "BinaryDataByteOrderMSB", "ElementByteOrderMSB" }));
  raw.Compressed = !raw.Text && IsTrue(field({ "CompressedData" }));
  const std::string skip = field({ "HeaderSize" });
  const auto skipped = formats::ParseIndex(skip, std::int64_t{ 1 } << 60);
  if (!skipped && skip != "-1" && !skip.empty())
  {
    return Corrupt(fileName, "has a header of '" + skip + "' bytes");
  }
  raw.Offset = skip == "-1" ? -1 : skipped.value_or(0);
  status = TakeFiles(fileName, header, raw);
  return status.Ok() ? Result<RawVolume>(raw) : Result<RawVolume>(status);
}

} // namespace teravox
