// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BigDataViewerFormat.h"

#include "BigDataViewerXml.h"
#include "FormatText.h"
#include "PyramidMetadata.h"

#include <cmath>
#include <cstdio>
#include <sys/stat.h>

namespace teravox
{

namespace
{
using namespace formats;

std::string TimeName(std::int64_t time)
{
  char name[32];
  std::snprintf(name, sizeof(name), "t%05lld", static_cast<long long>(time));
  return name;
}

std::string SetupName(std::int64_t setup)
{
  char name[32];
  std::snprintf(name, sizeof(name), "s%02lld", static_cast<long long>(setup));
  return name;
}

/// Numbers of the root's children that are named so and have `resolutions` (set-ups).
std::vector<std::int64_t> SetupsOf(const HDF5File& file, const std::vector<std::string>& names)
{
  std::vector<std::int64_t> setups;
  for (const std::int64_t s : IndicesBehind(names, "s"))
  {
    if (file.DatasetShape("/" + SetupName(s) + "/resolutions"))
    {
      setups.push_back(s);
    }
  }
  return setups;
}

std::vector<std::int64_t> TimesOf(const std::vector<std::string>& names)
{
  std::vector<std::string> times;
  for (const std::string& name : names)
  {
    if (name.size() >= 6)
    {
      times.push_back(name);
    }
  }
  return IndicesBehind(times, "t");
}

std::optional<std::string> Recognise(const HDF5File& file, const std::string& path)
{
  if (!path.empty())
  {
    return std::nullopt;
  }
  const std::vector<std::string> names = file.Children("/", MostChildren);
  const std::vector<std::int64_t> times = TimesOf(names);
  const std::vector<std::int64_t> setups = SetupsOf(file, names);
  if (times.empty() || setups.empty())
  {
    return std::nullopt;
  }
  return "the group '/" + TimeName(times.front()) + "' and the dataset '/" +
    SetupName(setups.front()) + "/resolutions'";
}

bool IsSameFile(const std::string& a, const std::string& b)
{
  struct stat first = {};
  struct stat second = {};
  return ::stat(a.c_str(), &first) == 0 && ::stat(b.c_str(), &second) == 0 &&
    first.st_dev == second.st_dev && first.st_ino == second.st_ino;
}

/// The XML file that was opened, or the one beside the HDF5 file that names it.
Result<std::optional<BigDataViewerXml>> FindXml(
  const HDF5File& file, const std::string& companion, std::string& name)
{
  name = companion;
  if (name.empty())
  {
    const std::size_t dot = file.Name().rfind('.');
    const std::size_t slash = file.Name().rfind('/');
    const bool extension =
      dot != std::string::npos && (slash == std::string::npos || dot > slash + 1);
    name = (extension ? file.Name().substr(0, dot) : file.Name()) + ".xml";
    if (!BigDataViewerXml::IsXml(name))
    {
      return std::optional<BigDataViewerXml>();
    }
  }
  Result<BigDataViewerXml> xml = BigDataViewerXml::Read(name);
  if (!xml.Ok())
  {
    return xml.GetStatus();
  }
  if (companion.empty() && !IsSameFile(xml.Value().HDF5File, file.Name()))
  {
    return std::optional<BigDataViewerXml>();
  }
  return std::optional<BigDataViewerXml>(std::move(xml.Value()));
}

Status SetAffine(
  const std::string& xmlName, const BigDataViewerXml::Affine& m, VolumeDescription& d)
{
  for (std::size_t c = 0; c < 3; ++c)
  {
    d.Spacing[c] = std::hypot(m[c], m[4 + c], m[8 + c]);
    for (std::size_t r = 0; r < 3; ++r)
    {
      d.Direction[3 * r + c] = d.Spacing[c] > 0 ? m[4 * r + c] / d.Spacing[c] : 0.0;
    }
    d.Origin[c] = m[4 * c + 3];
  }
  const Status status = PyramidMetadata::CheckGeometry(d.Origin, d.Spacing, d.Direction);
  return status.Ok()
    ? status
    : Status(StatusCode::Corrupt,
        "The transform in the XML file '" + xmlName + "' can't be used: " + status.Message() + ".");
}

Status ReadGeometry(const HDF5File& file, const std::string& companion, std::int64_t time,
  const std::vector<std::int64_t>& setups, std::int64_t setup, VolumeDescription& d)
{
  std::string name;
  auto found = FindXml(file, companion, name);
  if (!found.Ok())
  {
    return found.GetStatus();
  }
  if (!found.Value())
  {
    d.Seen.push_back("No XML file '" + name +
      "' that names this file: the voxels' size isn't known, and taken as 1.");
    return {};
  }
  const BigDataViewerXml& xml = *found.Value();
  for (std::size_t c = 0; c < setups.size(); ++c)
  {
    const auto entry = xml.Setups.find(setups[c]);
    if (entry != xml.Setups.end() && !entry->second.Name.empty())
    {
      d.Channels[c].Name = entry->second.Name;
    }
  }
  const auto entry = xml.Setups.find(setup);
  if (entry != xml.Setups.end())
  {
    d.Unit = entry->second.Unit;
  }
  const auto registration = xml.Registrations.find({ time, setup });
  if (registration != xml.Registrations.end())
  {
    d.Seen.push_back("Geometry from the transforms of time point " + std::to_string(time) +
      ", set-up " + std::to_string(setup) + " in '" + name + "'.");
    return SetAffine(name, registration->second, d);
  }
  if (entry != xml.Setups.end() && entry->second.VoxelSize)
  {
    d.Spacing = *entry->second.VoxelSize;
    d.Seen.push_back("Voxels of " + Text(d.Spacing) + " " + d.Unit + " from '" + name + "'.");
    return {};
  }
  d.Seen.push_back("The XML file '" + name + "' doesn't tell the size of voxels of set-up " +
    std::to_string(setup) + ": it is taken as 1.");
  return {};
}

Status ReadLevels(
  const HDF5File& file, const std::string& time, std::int64_t setup, VolumeDescription& d)
{
  const std::string path = "/" + SetupName(setup) + "/resolutions";
  const auto shape = file.DatasetShape(path);
  const auto numbers = file.DatasetNumbers(path, 3 * 256);
  if (!shape || shape->size() != 2 || (*shape)[1] != 3 || !numbers || numbers->empty() ||
    numbers->size() != static_cast<std::size_t>((*shape)[0]) * 3)
  {
    return Corrupt(file, "'" + path + "' isn't a table of x, y, z for each level");
  }
  const std::size_t levels = numbers->size() / 3;
  for (std::size_t l = 0; l < levels; ++l)
  {
    Double3 relative{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      relative[a] = (*numbers)[3 * l + a] / (*numbers)[a];
    }
    const auto factor = WholeFactors(relative.data());
    if (!factor)
    {
      d.Seen.push_back("Level " + std::to_string(l) + " is coarser by " + Text(relative) +
        ", not by whole numbers: it is left out.");
      continue;
    }
    if (d.Levels.empty())
    {
      d.Levels.emplace_back();
    }
    else if (d.Levels.size() == 1 && d.Levels[0].Factor != Int3{ 1, 1, 1 })
    {
      return Corrupt(file, "level 0 of '" + path + "' isn't the finest");
    }
    if (l > 0)
    {
      d.Levels.emplace_back();
    }
    LevelDescription& level = d.Levels.back();
    level.Factor = *factor;
    level.Paths.push_back("/" + time + "/" + SetupName(setup) + "/" + std::to_string(l) + "/cells");
  }
  if (d.Levels.empty() || d.Levels.size() > 32)
  {
    return Corrupt(file, "'" + path + "' has no possible levels");
  }
  return {};
}

/// Voxels that the format has as unsigned ones but stored as signed.
bool IsUnsigned(
  const HDF5File& file, std::int64_t setup, const std::string& cells, VolumeDescription& d)
{
  const auto type = file.Text("/" + SetupName(setup), "dataType");
  const std::string stored = file.DatasetType(cells);
  if (!type)
  {
    if (stored == "i16")
    {
      d.Seen.push_back(
        "No attribute dataType, and 16-bit voxels: they are unsigned ones, stored as signed.");
    }
    return stored == "i16";
  }
  return !type->empty() && type->front() == 'u' && !stored.empty() && stored.front() == 'i';
}

Result<VolumeDescription> Describe(const HDF5File& file, const VolumeRequest& request)
{
  VolumeDescription d;
  const std::vector<std::string> names = file.Children("/", MostChildren);
  const std::vector<std::int64_t> times = TimesOf(names);
  const std::vector<std::int64_t> setups = SetupsOf(file, names);
  Status status = CheckRequest(file, request, setups.size(), times.size());
  if (!status.Ok())
  {
    return status;
  }
  const std::int64_t time = times[static_cast<std::size_t>(request.TimePoint)];
  d.Times.assign(times.begin(), times.end());
  d.Channels.assign(setups.size(), {});
  for (std::size_t c = 0; c < setups.size(); ++c)
  {
    d.Channels[c].Name = "set-up " + std::to_string(setups[c]);
  }
  const std::vector<std::size_t> chosen = ChannelsOf(request, setups.size());
  const std::int64_t first = setups[chosen.front()];
  status = ReadLevels(file, TimeName(time), first, d);
  for (std::size_t i = 1; i < chosen.size() && status.Ok(); ++i)
  {
    for (LevelDescription& level : d.Levels)
    {
      std::string path = level.Paths.front();
      const std::string from = "/" + SetupName(first) + "/";
      path.replace(path.find(from), from.size(), "/" + SetupName(setups[chosen[i]]) + "/");
      level.Paths.push_back(path);
    }
  }
  if (status.Ok())
  {
    d.Seen.push_back(Counted(d.Levels.size(), "level") + ", " +
      Counted(times.size(), "time point") + ", " + Counted(setups.size(), "set-up") +
      " (as channels).");
    status = ReadGeometry(file, request.Companion, time, setups, first, d);
  }
  if (!status.Ok())
  {
    return status;
  }
  d.View.Automatic = false;
  d.View.Spatial = { 2, 1, 0 };
  d.View.Unsigned = IsUnsigned(file, first, d.Levels.front().Paths.front(), d);
  d.ArrayName = chosen.size() == 1 ? d.Channels[chosen.front()].Name : std::string("channels");
  return d;
}
} // namespace

const VolumeFormat BigDataViewerFormat{ "BigDataViewer", &Recognise, &Describe };

} // namespace teravox
