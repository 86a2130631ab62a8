// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "NGFFFormat.h"

#include "FormatText.h"
#include "JsonDocument.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace teravox
{

namespace
{
using namespace formats;
using nlohmann::json;

constexpr std::size_t MostLevels = 32;

std::string Child(const std::string& group, const std::string& name)
{
  return group == "/" ? "/" + name : group + "/" + name;
}

JsonDocument Parsed(const HDF5File& file, const std::string& group, const std::string& attribute)
{
  const auto text = file.Text(group, attribute);
  return text ? JsonDocument(*text) : JsonDocument();
}

/// A member of an object; null if it isn't there or isn't of that kind.
const json& Member(const json& object, const char* name)
{
  static const json none;
  return object.is_object() && object.contains(name) ? object[name] : none;
}

/// A list; empty if it isn't one.
const json& ListOf(const json& value)
{
  static const json none = json::array();
  return value.is_array() ? value : none;
}

/// An attribute of that name, or the member of that name of the attribute `ome`.
struct Metadata
{
  Metadata(const HDF5File& file, const std::string& group, const char* name, bool isList)
    : Document(Parsed(file, group, name))
  {
    const auto fits = [isList](const json& v) { return isList ? v.is_array() : v.is_object(); };
    this->IsInOme = !fits(this->Document.Root());
    if (this->IsInOme)
    {
      this->Document = Parsed(file, group, "ome");
    }
    this->Name = name;
  }
  const json& Value() const
  {
    const json& root = this->Document.Root();
    return this->IsInOme ? Member(root, this->Name) : root;
  }

  JsonDocument Document;
  bool IsInOme = false;
  const char* Name = nullptr;
};

/// The first of the multiscales of a group; null if there are none.
const json& FirstOf(const Metadata& multiscales)
{
  static const json none;
  const json& all = multiscales.Value();
  return all.is_array() && !all.empty() && Member(all[0], "datasets").is_array() ? all[0] : none;
}

Metadata MultiscalesOf(const HDF5File& file, const std::string& group)
{
  return { file, group, "multiscales", true };
}

std::optional<std::string> ReasonOf(const HDF5File& file, const std::string& group)
{
  return (file.HasAttribute(group, "multiscales") || file.HasAttribute(group, "ome")) &&
      !FirstOf(MultiscalesOf(file, group)).is_null()
    ? std::optional<std::string>("the multiscales of '" + group + "'")
    : std::nullopt;
}

std::optional<std::string> Recognise(const HDF5File& file, const std::string& path)
{
  return RecogniseGroup(
    file, path, [&file](const std::string& group) { return ReasonOf(file, group); });
}

/// A letter per axis, and the unit of those in space.
Status ReadAxes(const HDF5File& file, const json& multiscale, std::size_t rank,
  std::string& letters, std::string& unit)
{
  letters.clear();
  const json& axes = Member(multiscale, "axes");
  for (const json& axis : ListOf(axes))
  {
    const json& name = axis.is_string() ? axis : Member(axis, "name");
    letters +=
      name.is_string() && name.get<std::string>().size() == 1 ? name.get<std::string>() : "?";
    const json& its = Member(axis, "unit");
    if (its.is_string() && letters.find_last_of("xyz") == letters.size() - 1)
    {
      unit = its.get<std::string>();
    }
  }
  constexpr std::size_t most = 5; // before 0.3 there were always five
  if (letters.empty() && rank == most)
  {
    letters = "tczyx";
  }
  const std::set<char> once(letters.begin(), letters.end());
  if (letters.size() != rank || once.size() != rank ||
    letters.find_first_not_of("tczyx") != std::string::npos || once.count('x') == 0 ||
    once.count('y') == 0)
  {
    return Corrupt(file,
      "the axes of its multiscales are '" + letters + "' for datasets with " +
        std::to_string(rank) + " axes");
  }
  return {};
}

/// Scale and translation of some transformations, one number per axis.
struct Transformation
{
  std::vector<double> Scale;
  std::vector<double> Translation;
};

bool Take(const json& list, std::size_t rank, Transformation& t)
{
  t = { std::vector<double>(rank, 1.0), std::vector<double>(rank, 0.0) };
  for (const json& entry : ListOf(list))
  {
    for (const bool scale : { true, false })
    {
      const json& numbers = Member(entry, scale ? "scale" : "translation");
      if (!numbers.is_array())
      {
        continue;
      }
      for (std::size_t a = 0; a < rank; ++a)
      {
        if (numbers.size() != rank || !numbers[a].is_number() ||
          !std::isfinite(numbers[a].get<double>()))
        {
          return false;
        }
        (scale ? t.Scale : t.Translation)[a] = numbers[a].get<double>();
      }
    }
  }
  return true;
}

/// Names, colours and windows of channels.
void ReadChannels(const json& omero, VolumeDescription& d)
{
  const json& channels = Member(omero, "channels");
  for (std::size_t c = 0; c < d.Channels.size(); ++c)
  {
    ChannelDescription& channel = d.Channels[c];
    channel.Name = d.Channels.size() == 1 ? d.ArrayName : "channel " + std::to_string(c);
    if (!channels.is_array() || c >= channels.size())
    {
      continue;
    }
    const json& label = Member(channels[c], "label");
    channel.Name = label.is_string() ? label.get<std::string>() : channel.Name;
    const json& color = Member(channels[c], "color");
    const std::string hex = color.is_string() ? color.get<std::string>() : std::string();
    constexpr std::size_t digits = 6;
    if (hex.size() == digits &&
      hex.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos)
    {
      const auto part = [&hex](std::size_t at)
      { return static_cast<double>(std::stoi(hex.substr(at, 2), nullptr, 16)) / 255.0; };
      channel.Color = Double3{ part(0), part(2), part(4) };
    }
    const json& start = Member(Member(channels[c], "window"), "start");
    const json& end = Member(Member(channels[c], "window"), "end");
    if (start.is_number() && end.is_number() && start.get<double>() < end.get<double>())
    {
      channel.Display = { start.get<double>(), end.get<double>() };
    }
  }
}

/// The view of the datasets: where x, y, z are, and the channel and time of the request.
Status ReadView(const HDF5File& file, const VolumeRequest& request, const std::string& letters,
  const std::vector<std::int64_t>& shape, VolumeDescription& d)
{
  const auto axisOf = [&letters](char letter)
  {
    const std::size_t at = letters.find(letter);
    return at == std::string::npos ? -1 : static_cast<int>(at);
  };
  const auto entries = [&](int axis) -> std::size_t
  {
    constexpr std::int64_t most = 1 << 20;
    return axis < 0 ? 1
                    : static_cast<std::size_t>(
                        std::clamp<std::int64_t>(shape[static_cast<std::size_t>(axis)], 1, most));
  };
  const int channel = axisOf('c');
  const int time = axisOf('t');
  const Status status = CheckRequest(file, request, entries(channel), entries(time));
  if (!status.Ok())
  {
    return status;
  }
  d.View.Automatic = false;
  d.View.Spatial = { axisOf('x'), axisOf('y'), axisOf('z') };
  d.Channels.assign(entries(channel), {});
  d.Times.resize(entries(time));
  for (std::size_t t = 0; t < d.Times.size(); ++t)
  {
    d.Times[t] = static_cast<double>(t);
  }
  if (time >= 0)
  {
    d.View.Index.at(static_cast<std::size_t>(time)) = request.TimePoint;
  }
  if (channel >= 0 && request.Channel == VolumeRequest::AllChannels)
  {
    d.View.Component = channel;
  }
  else if (channel >= 0)
  {
    d.View.Index.at(static_cast<std::size_t>(channel)) = request.Channel;
  }
  return {};
}

/// A level's factor by its scale, or where scales aren't told by its size.
std::optional<Int3> FactorOf(const VolumeDescription& d, const Double3& spacing, bool told,
  const std::vector<std::int64_t>& shape, const std::vector<std::int64_t>& finest)
{
  Double3 ratio{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    const int axis = d.View.Spatial.at(a);
    const auto at = static_cast<std::size_t>(std::max(axis, 0));
    ratio.at(a) = told ? spacing.at(a) / d.Spacing.at(a)
      : axis < 0       ? 1.0
                       : static_cast<double>(FactorBetween(finest[at], shape[at]));
  }
  return WholeFactors(ratio.data());
}

Status ReadLevels(const HDF5File& file, const std::string& group, const json& multiscale,
  const VolumeRequest& request, VolumeDescription& d)
{
  std::vector<std::int64_t> finest;
  Transformation whole; // of all levels
  std::string letters;
  for (const json& entry : Member(multiscale, "datasets"))
  {
    const json& name = Member(entry, "path");
    if (!name.is_string() || d.Levels.size() >= MostLevels)
    {
      return Corrupt(file, "a level of '" + group + "' has no path, or there are too many");
    }
    LevelDescription level;
    level.Paths = { Child(group, name.get<std::string>()) };
    const auto shape = file.DatasetShape(level.Paths.front());
    if (!shape || shape->size() < 2 || (!finest.empty() && shape->size() != finest.size()))
    {
      return Corrupt(file, "'" + level.Paths.front() + "' isn't a dataset as its multiscales say");
    }
    Transformation own;
    if (finest.empty())
    {
      Status status = ReadAxes(file, multiscale, shape->size(), letters, d.Unit);
      if (status.Ok())
      {
        status = ReadView(file, request, letters, *shape, d);
      }
      if (!status.Ok())
      {
        return status;
      }
      if (!Take(Member(multiscale, "coordinateTransformations"), shape->size(), whole))
      {
        return Corrupt(file, "the transformations of '" + group + "' don't fit its axes");
      }
    }
    if (!Take(Member(entry, "coordinateTransformations"), shape->size(), own))
    {
      return Corrupt(
        file, "the transformations of '" + level.Paths.front() + "' don't fit its axes");
    }
    Double3 spacing{ 1, 1, 1 };
    Double3 place{ 0, 0, 0 };
    for (std::size_t a = 0; a < 3; ++a)
    {
      if (d.View.Spatial.at(a) >= 0)
      {
        const auto at = static_cast<std::size_t>(d.View.Spatial.at(a));
        spacing.at(a) = own.Scale[at] * whole.Scale[at];
        place.at(a) = own.Translation[at] * whole.Scale[at] + whole.Translation[at];
      }
    }
    if (finest.empty())
    {
      d.Spacing = spacing;
      d.Origin = place;
      finest = *shape;
      if (!IsSpacing(d.Spacing))
      {
        return Corrupt(file, "the scale of '" + level.Paths.front() + "' can't be");
      }
    }
    const bool told = Member(entry, "coordinateTransformations").is_array();
    const auto factor = FactorOf(d, spacing, told, *shape, finest);
    if (!factor)
    {
      d.Seen.push_back(
        "'" + level.Paths.front() + "' isn't coarser by whole numbers: it is left out.");
      continue;
    }
    level.Factor = *factor;
    for (std::size_t a = 0; a < 3; ++a)
    {
      const double expected =
        d.Origin.at(a) + d.Spacing.at(a) * static_cast<double>(level.Factor.at(a) - 1) / 2;
      constexpr double tolerance = 0.01;
      if (told && std::abs(place.at(a) - expected) > tolerance * spacing.at(a))
      {
        d.Seen.push_back("'" + level.Paths.front() +
          "' is said to lie elsewhere than averages of level 0 do; it is taken as such.");
        break;
      }
    }
    d.Levels.push_back(std::move(level));
  }
  return d.Levels.empty() ? Corrupt(file, "the multiscales of '" + group + "' have no level")
                          : Status();
}

Result<VolumeDescription> Describe(const HDF5File& file, const VolumeRequest& request)
{
  VolumeDescription d;
  std::string reason;
  const auto reasonOf = [&file](const std::string& group) { return ReasonOf(file, group); };
  const std::string group =
    request.Path.empty() ? FindGroup(file, reasonOf, reason).value_or("/") : Absolute(request.Path);
  const Metadata multiscales = MultiscalesOf(file, group);
  const json& multiscale = FirstOf(multiscales);
  const json& name = Member(multiscale, "name");
  d.ArrayName = name.is_string() && !name.get<std::string>().empty()
    ? name.get<std::string>()
    : group.substr(group.rfind('/') + 1);
  d.ArrayName = d.ArrayName.empty() ? "scalars" : d.ArrayName;
  const Status status = ReadLevels(file, group, multiscale, request, d);
  if (!status.Ok())
  {
    return status;
  }
  ReadChannels(Metadata(file, group, "omero", false).Value(), d);
  d.Labels = file.HasAttribute(group, "image-label");
  d.Seen.push_back(Counted(d.Levels.size(), "level") + ", " +
    Counted(d.Channels.size(), "channel") + ", " + Counted(d.Times.size(), "time point") +
    ", voxels of " + Text(d.Spacing) + (d.Unit.empty() ? "" : " " + d.Unit) +
    (d.Labels ? ", labels." : "."));
  return d;
}
} // namespace

const VolumeFormat NGFFFormat{ "OME-NGFF", &Recognise, &Describe };

} // namespace teravox
