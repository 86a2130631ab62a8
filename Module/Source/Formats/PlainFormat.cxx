// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PlainFormat.h"

#include "FormatText.h"
#include "JsonDocument.h"

#include <algorithm>
#include <cctype>
#include <set>
#include <utility>

namespace teravox
{

namespace
{
using namespace formats;
using nlohmann::json;

std::optional<std::string> Recognise(const HDF5File& file, const std::string& path)
{
  // What isn't there has its error in Describe().
  return path.empty() || file.IsGroup(Absolute(path)) ? std::nullopt
                                                      : std::optional<std::string>("it was named");
}

/// One letter per axis: t, c, z, y, x. Empty if the file doesn't say.
std::string AxesByTags(const HDF5File& file, const std::string& path)
{
  const auto text = file.Text(path, "axistags");
  std::string axes;
  if (!text)
  {
    return axes;
  }
  const JsonDocument document(*text);
  const json& tags = document.Root();
  if (!tags.is_object() || !tags.contains("axes") || !tags["axes"].is_array())
  {
    return axes;
  }
  for (const json& tag : tags["axes"])
  {
    if (!tag.is_object() || !tag.contains("key") || !tag["key"].is_string() || axes.size() > 8)
    {
      return {};
    }
    axes += tag["key"].get<std::string>();
  }
  return axes;
}

std::string AxesByLabels(const HDF5File& file, const std::string& path)
{
  const auto labels = file.Texts(path, "DIMENSION_LABELS");
  std::string axes;
  for (const std::string& label : labels.value_or(std::vector<std::string>()))
  {
    if (label.size() != 1)
    {
      return {};
    }
    axes += static_cast<char>(std::tolower(static_cast<unsigned char>(label[0])));
  }
  return axes;
}

/// Each of the letters once at most, and one that is an axis in space at least.
bool AreAxes(const std::string& axes, std::size_t rank)
{
  return axes.size() == rank && axes.find_first_not_of("tczyx") == std::string::npos &&
    std::set<char>(axes.begin(), axes.end()).size() == rank &&
    axes.find_first_of("xyz") != std::string::npos;
}

std::string AxesByRank(const std::vector<std::int64_t>& shape)
{
  switch (shape.size())
  {
    case 2:
      return "yx";
    case 3:
      return "zyx";
    case 4:
      return shape.back() <= 4 ? "zyxc" : "tzyx";
    default:
      return shape.back() <= 4 ? "tzyxc" : "tczyx";
  }
}
} // namespace

Result<VolumeDescription> DescribeDataset(
  const HDF5File& file, const std::string& path, const VolumeRequest& request)
{
  VolumeDescription d;
  LevelDescription level;
  level.Paths = { path };
  d.ArrayName = path.substr(path.rfind('/') + 1);
  const auto shape = file.DatasetShape(path);
  if (!shape || shape->size() < 2 || shape->size() > 5)
  {
    // Opening it says what is wrong.
    d.Levels.push_back(std::move(level));
    return d;
  }
  std::string axes = AxesByTags(file, path);
  std::string why = "by its axistags";
  if (!AreAxes(axes, shape->size()))
  {
    axes = AxesByLabels(file, path);
    why = "by the labels of its dimensions";
  }
  if (!AreAxes(axes, shape->size()))
  {
    axes = AxesByRank(*shape);
    why = "by their number";
  }
  d.View.Automatic = false;
  const auto axisOf = [&](char letter)
  {
    const std::size_t at = axes.find(letter);
    return at == std::string::npos ? -1 : static_cast<int>(at);
  };
  d.View.Spatial = { axisOf('x'), axisOf('y'), axisOf('z') };
  const int channel = axisOf('c');
  const int time = axisOf('t');
  const auto entries = [&](int axis)
  { return axis < 0 ? std::int64_t{ 1 } : (*shape)[static_cast<std::size_t>(axis)]; };
  // A fastest axis of few entries are colours or vectors, one voxel; others are apart in the file.
  const bool inVoxel = channel == static_cast<int>(shape->size()) - 1 && entries(channel) <= 4;
  const auto channels =
    static_cast<std::size_t>(inVoxel ? 1 : std::clamp<std::int64_t>(entries(channel), 1, 1 << 20));
  const auto times = static_cast<std::size_t>(std::clamp<std::int64_t>(entries(time), 1, 1 << 24));
  const Status status = CheckRequest(file, request, channels, times);
  if (!status.Ok())
  {
    return status;
  }
  d.Channels.assign(channels, {});
  for (std::size_t c = 0; c < channels; ++c)
  {
    d.Channels[c].Name = channels == 1 ? d.ArrayName : "channel " + std::to_string(c);
  }
  d.Times.resize(times);
  for (std::size_t t = 0; t < times; ++t)
  {
    d.Times[t] = static_cast<double>(t);
  }
  if (time >= 0)
  {
    d.View.Index.at(static_cast<std::size_t>(time)) = request.TimePoint;
  }
  if (inVoxel || request.Channel == VolumeRequest::AllChannels)
  {
    d.View.Component = channel;
  }
  else if (channel >= 0)
  {
    d.View.Index.at(static_cast<std::size_t>(channel)) = request.Channel;
  }
  const auto spacing = file.Numbers(path, "element_size_um");
  if (spacing && spacing->size() == 3 && IsSpacing({ (*spacing)[2], (*spacing)[1], (*spacing)[0] }))
  {
    d.Spacing = { (*spacing)[2], (*spacing)[1], (*spacing)[0] };
    d.Unit = "um";
  }
  d.Seen.push_back(
    "The axes of '" + path + "' are taken as " + axes + " " + why + "; one level, no pyramid.");
  d.Levels.push_back(std::move(level));
  return d;
}

std::vector<std::string> ListVolumes(const HDF5File& file, std::size_t limit)
{
  // Breadth first, each group once however many links lead to it.
  constexpr std::size_t mostGroups = 256;
  std::vector<std::string> found;
  std::vector<std::string> groups{ "/" };
  std::set<std::uint64_t> seen{ file.ObjectAddress("/") };
  for (std::size_t g = 0; g < groups.size() && found.size() < limit; ++g)
  {
    for (const std::string& name : file.Children(groups[g], 1024))
    {
      const std::string path = (groups[g] == "/" ? "" : groups[g]) + "/" + name;
      if (const auto shape = file.DatasetShape(path))
      {
        const auto long3 =
          std::count_if(shape->begin(), shape->end(), [](auto n) { return n > 1; });
        if (shape->size() <= 5 && long3 >= 3)
        {
          found.push_back(path);
        }
      }
      else if (groups.size() < mostGroups && file.IsGroup(path) &&
        seen.insert(file.ObjectAddress(path)).second)
      {
        groups.push_back(path);
      }
      if (found.size() >= limit)
      {
        break;
      }
    }
  }
  return found;
}

namespace
{
Result<VolumeDescription> Describe(const HDF5File& file, const VolumeRequest& request)
{
  return DescribeDataset(file, Absolute(request.Path), request);
}
} // namespace

const VolumeFormat PlainFormat{ "dataset", &Recognise, &Describe };

} // namespace teravox
