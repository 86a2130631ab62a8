// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "N5Format.h"

#include "FormatText.h"
#include "JsonDocument.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace teravox
{

namespace
{
using namespace formats;
using nlohmann::json;

std::string Child(const std::string& group, const std::string& name)
{
  return group == "/" ? "/" + name : group + "/" + name;
}

/// Numbers of an attribute, of HDF5 or as JSON text; lists of lists one after the other.
std::optional<std::vector<double>> Numbers(
  const HDF5File& file, const std::string& path, const std::string& attribute)
{
  if (auto numbers = file.Numbers(path, attribute))
  {
    return numbers;
  }
  const auto text = file.Text(path, attribute);
  const JsonDocument document = text ? JsonDocument(*text) : JsonDocument();
  const json& value = document.Root();
  std::vector<double> numbers;
  const auto take = [&](const json& entry)
  {
    if (entry.is_number() && numbers.size() < 4096)
    {
      numbers.push_back(entry.get<double>());
    }
  };
  if (!value.is_array())
  {
    return std::nullopt;
  }
  for (const json& entry : value)
  {
    take(entry);
    if (entry.is_array())
    {
      std::for_each(entry.begin(), entry.end(), take);
    }
  }
  return numbers;
}

std::optional<Double3> Three(
  const HDF5File& file, const std::string& path, const std::string& attribute)
{
  const auto numbers = Numbers(file, path, attribute);
  return numbers && numbers->size() == 3
    ? std::optional<Double3>(Double3{ (*numbers)[0], (*numbers)[1], (*numbers)[2] })
    : std::nullopt;
}

/// An attribute that is true: a number or HDF5's enumeration, or the text.
bool IsTrue(const HDF5File& file, const std::string& path, const std::string& attribute)
{
  const auto number = file.Integers(path, attribute);
  return (number && number->size() == 1 && (*number)[0] != 0) ||
    file.Text(path, attribute).value_or("") == "true";
}

/// Levels s0, s1, ... of a group without gap.
std::size_t LevelsOf(const HDF5File& file, const std::string& group)
{
  std::size_t levels = 0;
  while (levels < 32 && file.DatasetShape(Child(group, "s" + std::to_string(levels))))
  {
    ++levels;
  }
  return levels;
}

/// Why a group is a pyramid; nothing if it is none.
std::optional<std::string> ReasonOf(const HDF5File& file, const std::string& group)
{
  if (file.HasAttribute(group, "painteraData"))
  {
    return "the attribute painteraData of '" + group + "'";
  }
  if (LevelsOf(file, group) == 0)
  {
    return std::nullopt;
  }
  if (IsTrue(file, group, "multiScale"))
  {
    return "the attribute multiScale of '" + group + "'";
  }
  const std::vector<std::string> names = file.Children(group, 256);
  const bool all = std::all_of(names.begin(), names.end(),
    [](const std::string& name) { return IndexBehind(name, "s").has_value(); });
  return all ? std::optional<std::string>(
                 "'" + group + "' has the children s0 ... s" + std::to_string(names.size() - 1))
             : std::nullopt;
}

std::optional<std::string> Recognise(const HDF5File& file, const std::string& path)
{
  return RecogniseGroup(
    file, path, [&file](const std::string& group) { return ReasonOf(file, group); });
}

struct Place
{
  std::string Group; ///< with the levels
  std::string Above; ///< with what is said for all of them
};

/// /setupS/timepointT: others of the same kind are channels and time points.
Status FindViews(
  const HDF5File& file, const VolumeRequest& request, Place& place, VolumeDescription& d)
{
  const std::size_t at = place.Group.rfind('/');
  const std::string time = place.Group.substr(at + 1);
  const std::string setup = place.Group.substr(0, at);
  if (!IndexBehind(time, "timepoint") || setup.empty() ||
    !IndexBehind(setup.substr(setup.rfind('/') + 1), "setup") || !request.Path.empty())
  {
    return CheckRequest(file, request, 1, 1);
  }
  const std::string root = setup.substr(0, setup.rfind('/'));
  const auto setups =
    IndicesBehind(file.Children(root.empty() ? "/" : root, MostChildren), "setup");
  const auto times = IndicesBehind(file.Children(setup, MostChildren), "timepoint");
  Status status = CheckRequest(file, request, setups.size(), times.size());
  if (!status.Ok())
  {
    return status;
  }
  if (request.Channel == VolumeRequest::AllChannels && setups.size() > 1)
  {
    return { StatusCode::Unsupported,
      "The set-ups of the file '" + file.Name() + "' can only be read one at a time." };
  }
  const std::int64_t s = setups[static_cast<std::size_t>(std::max(request.Channel, 0))];
  place.Above = root + "/setup" + std::to_string(s);
  place.Group =
    place.Above + "/timepoint" + std::to_string(times[static_cast<std::size_t>(request.TimePoint)]);
  d.Times.assign(times.begin(), times.end());
  d.Channels.assign(setups.size(), {});
  for (std::size_t c = 0; c < setups.size(); ++c)
  {
    d.Channels[c].Name = "set-up " + std::to_string(setups[c]);
  }
  d.Seen.push_back(Counted(setups.size(), "set-up") + " (as channels), " +
    Counted(times.size(), "time point") + ".");
  return {};
}

/// What the group of a label or raw dataset of Paintera is.
Status ReadPaintera(const HDF5File& file, Place& place, VolumeDescription& d)
{
  if (!file.HasAttribute(place.Group, "painteraData"))
  {
    return {};
  }
  const auto text = file.Text(place.Group, "painteraData");
  const JsonDocument document = text ? JsonDocument(*text) : JsonDocument();
  const json& data = document.Root();
  const std::string type = data.is_object() && data.contains("type") && data["type"].is_string()
    ? data["type"].get<std::string>()
    : std::string();
  d.Labels = type == "label";
  d.Seen.push_back("Paintera says that it is of the type '" + type + "'.");
  place.Above = place.Group;
  place.Group = Child(place.Group, "data");
  if (IsTrue(file, place.Group, "isLabelMultiset") ||
    IsTrue(file, Child(place.Group, "s0"), "isLabelMultiset"))
  {
    return { StatusCode::Unsupported,
      "The group '" + place.Group + "' of file '" + file.Name() +
        "' holds label multisets, which aren't defined for HDF5." };
  }
  return {};
}

std::optional<Double3> FirstOf(
  const HDF5File& file, const Place& place, const std::string& attribute)
{
  for (const std::string& path : { place.Group, Child(place.Group, "s0"), place.Above })
  {
    if (const auto found = Three(file, path, attribute))
    {
      return found;
    }
  }
  return std::nullopt;
}

Status ReadLevels(const HDF5File& file, const Place& place, VolumeDescription& d)
{
  const std::size_t levels = LevelsOf(file, place.Group);
  if (levels == 0)
  {
    return Corrupt(file, "'" + place.Group + "' has no level s0");
  }
  std::vector<double> table;
  for (const std::string& path : { place.Group, place.Above })
  {
    const auto numbers = Numbers(file, path, "downsamplingFactors");
    if (numbers && numbers->size() >= 3 * levels)
    {
      table = *numbers;
    }
  }
  Int3 before{};
  for (std::size_t l = 0; l < levels; ++l)
  {
    LevelDescription level;
    level.Paths = { Child(place.Group, "s" + std::to_string(l)) };
    const auto shape = file.DatasetShape(level.Paths.front());
    if (!shape || shape->size() < 3)
    {
      return Corrupt(file, "'" + level.Paths.front() + "' isn't a dataset with three axes");
    }
    const std::size_t n = shape->size();
    const Int3 size{ (*shape)[n - 1], (*shape)[n - 2], (*shape)[n - 3] };
    const auto own = Three(file, level.Paths.front(), "downsamplingFactors");
    std::optional<Int3> factor;
    if (own || table.size() >= 3 * levels)
    {
      factor = WholeFactors(own ? own->data() : table.data() + 3 * l);
    }
    else
    {
      factor = Int3{ 1, 1, 1 };
      for (std::size_t a = 0; a < 3 && l > 0; ++a)
      {
        const std::int64_t f = FactorBetween(before[a], size[a]);
        if (f == 0 || __builtin_mul_overflow(d.Levels.back().Factor[a], f, &(*factor)[a]))
        {
          return Corrupt(file,
            "'" + level.Paths.front() + "' has " + Text(size) + " voxels, and the level before " +
              Text(before));
        }
      }
    }
    if (!factor)
    {
      d.Seen.push_back(
        "'" + level.Paths.front() + "' isn't coarser by whole numbers: it is left out.");
      continue;
    }
    if (l == 0 && *factor != Int3{ 1, 1, 1 })
    {
      return Corrupt(file, "'" + level.Paths.front() + "' isn't the finest level");
    }
    level.Factor = *factor;
    before = size;
    d.Levels.push_back(std::move(level));
  }
  return d.Levels.empty() ? Corrupt(file, "'" + place.Group + "' has no possible level") : Status();
}

Result<VolumeDescription> Describe(const HDF5File& file, const VolumeRequest& request)
{
  VolumeDescription d;
  std::string reason;
  const auto reasonOf = [&file](const std::string& group) { return ReasonOf(file, group); };
  const auto found = request.Path.empty() ? FindGroup(file, reasonOf, reason)
                                          : std::optional<std::string>(Absolute(request.Path));
  Place place{ found.value_or("/"), found.value_or("/") };
  Status status = FindViews(file, request, place, d);
  if (status.Ok())
  {
    status = ReadPaintera(file, place, d);
  }
  if (status.Ok())
  {
    status = ReadLevels(file, place, d);
  }
  if (!status.Ok())
  {
    return status;
  }
  const auto resolution = FirstOf(file, place, "resolution");
  const auto offset = FirstOf(file, place, "offset");
  d.Spacing = resolution.value_or(Double3{ 1, 1, 1 });
  d.Origin = offset.value_or(Double3{ 0, 0, 0 });
  if (!IsSpacing(d.Spacing) ||
    !std::all_of(d.Origin.begin(), d.Origin.end(), [](double o) { return std::isfinite(o); }))
  {
    return Corrupt(file, "the resolution or the offset of '" + place.Group + "' can't be");
  }
  d.Unit = file.Text(place.Group, "unit").value_or("");
  d.Seen.push_back(Counted(d.Levels.size(), "level") +
    (resolution ? ", voxels of " + Text(d.Spacing) + " " + d.Unit + "."
                : std::string(", no attribute resolution: the voxels' edges are taken as 1.")));
  const std::string name = place.Above.substr(place.Above.rfind('/') + 1);
  d.ArrayName = name.empty() ? "scalars" : name;
  if (d.Channels.size() == 1)
  {
    d.Channels.front().Name = d.ArrayName;
  }
  const auto shape = file.DatasetShape(d.Levels.front().Paths.front());
  d.View.Automatic = shape->size() != 3;
  d.View.Spatial = { 2, 1, 0 };
  return d;
}
} // namespace

const VolumeFormat N5Format{ "N5", &Recognise, &Describe };

} // namespace teravox
