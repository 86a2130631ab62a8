// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ImarisFormat.h"

#include "FormatText.h"

#include <algorithm>
#include <cmath>

namespace teravox
{

namespace
{
using namespace formats;

const std::string DataSet = "/DataSet";
const std::string Level = "ResolutionLevel ";
const std::string Time = "TimePoint ";
const std::string Channel = "Channel ";

std::optional<std::string> Recognise(const HDF5File& file, const std::string& path)
{
  if (!path.empty() || !file.Has(DataSet + "/" + Level + "0"))
  {
    return std::nullopt;
  }
  return "the group '" + DataSet + "/" + Level + "0'" +
    (file.HasAttribute("/", "ImarisDataSet") ? " and the root's attribute ImarisDataSet" : "");
}

std::optional<double> Number(
  const HDF5File& file, const std::string& path, const std::string& attribute)
{
  const auto text = file.Text(path, attribute);
  const auto numbers = text ? ParseNumbers(*text, 1) : std::nullopt;
  return numbers && numbers->size() == 1 ? std::optional<double>(numbers->front()) : std::nullopt;
}

/// X, Y, Z behind a name: "ImageSize", or "" for the image as a whole.
std::optional<Int3> Size(const HDF5File& file, const std::string& path, const std::string& name)
{
  Int3 size{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    const auto n = Number(file, path, name + "XYZ"[a]);
    if (!n || !(*n >= 1) || !(*n <= 2147483647.0) || *n != std::floor(*n))
    {
      return std::nullopt;
    }
    size[a] = static_cast<std::int64_t>(*n);
  }
  return size;
}

void ReadChannel(
  const HDF5File& file, std::int64_t index, const std::string& group, ChannelDescription& channel)
{
  const std::string info = "/DataSetInfo/" + Channel + std::to_string(index);
  channel.Name = file.Text(info, "Name").value_or(Channel + std::to_string(index));
  const auto numbers = [&](const char* attribute) -> std::optional<std::vector<double>>
  {
    const auto text = file.Text(info, attribute);
    return text ? ParseNumbers(*text, 3) : std::nullopt;
  };
  const auto color = numbers("Color");
  if (color && color->size() == 3 &&
    std::all_of(color->begin(), color->end(), [](double c) { return c >= 0 && c <= 1; }))
  {
    channel.Color = Double3{ (*color)[0], (*color)[1], (*color)[2] };
  }
  const auto range = numbers("ColorRange");
  if (range && range->size() == 2 && std::isfinite((*range)[0]) && std::isfinite((*range)[1]) &&
    (*range)[0] < (*range)[1])
  {
    channel.Display = { (*range)[0], (*range)[1] };
  }
  const auto least = Number(file, group, "HistogramMin");
  const auto most = Number(file, group, "HistogramMax");
  const auto histogram = file.DatasetNumbers(group + "/Histogram", 1 << 16);
  if (least && most && std::isfinite(*least) && std::isfinite(*most) && *least <= *most)
  {
    channel.Range = { *least, *most };
    if (histogram && !histogram->empty())
    {
      channel.Histogram = *histogram;
    }
  }
}

Status ReadGeometry(const HDF5File& file, const Int3& size, VolumeDescription& d)
{
  const std::string image = "/DataSetInfo/Image";
  Double3 low{};
  Double3 high{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    const auto from = Number(file, image, "ExtMin" + std::to_string(a));
    const auto to = Number(file, image, "ExtMax" + std::to_string(a));
    if (!from || !to)
    {
      d.Seen.push_back("No extents: the voxels' edges are taken as 1.");
      return {};
    }
    low[a] = *from;
    high[a] = *to;
    d.Spacing[a] = (high[a] - low[a]) / static_cast<double>(size[a]);
    d.Origin[a] = low[a] + d.Spacing[a] / 2;
  }
  if (!IsSpacing(d.Spacing) ||
    !IsSpacing({ std::abs(low[0]) + 1, std::abs(low[1]) + 1, std::abs(low[2]) + 1 }))
  {
    return Corrupt(file,
      "the extents of '" + image + "', " + Text(low) + " to " + Text(high) +
        ", aren't those of a box");
  }
  d.Unit = file.Text(image, "Unit").value_or("um");
  d.Seen.push_back("Voxels of " + Text(d.Spacing) + " " + d.Unit +
    ": the extents, which lie on the borders of voxels, divided by ImageSizeX, Y, Z.");
  return {};
}

/// Sizes as the attributes have them; else, for a file without, the image's own.
std::optional<Int3> LevelSize(const HDF5File& file, const std::string& group, std::size_t level)
{
  const auto size = Size(file, group, "ImageSize");
  return size || level > 0 ? size : Size(file, "/DataSetInfo/Image", "");
}

Status ReadLevels(const HDF5File& file, const std::vector<std::string>& channels,
  const std::string& time, VolumeDescription& d)
{
  const std::vector<std::int64_t> levels = IndicesBehind(file.Children(DataSet, 4096), Level);
  Int3 before{ 0, 0, 0 };
  for (std::size_t l = 0; l < levels.size() && l < 32; ++l)
  {
    if (levels[l] != static_cast<std::int64_t>(l))
    {
      return Corrupt(file, "'" + DataSet + "/" + Level + std::to_string(l) + "' is missing");
    }
    const std::string group = DataSet + "/" + Level + std::to_string(l) + "/" + time;
    LevelDescription level;
    for (const std::string& channel : channels)
    {
      level.Paths.push_back(group + "/" + channel + "/Data");
    }
    const std::string first = group + "/" + channels.front();
    const auto size = LevelSize(file, first, l);
    if (!size)
    {
      d.Seen.push_back("No ImageSizeX, Y, Z at '" + first + "': " +
        (l == 0 ? "the size is that of the dataset."
                : "this and all coarser levels are left out."));
      if (l > 0)
      {
        break;
      }
    }
    level.Size = size.value_or(Int3{ 0, 0, 0 });
    if (l > 0)
    {
      if (before[0] == 0)
      {
        break;
      }
      for (std::size_t a = 0; a < 3; ++a)
      {
        const std::int64_t f = FactorBetween(before[a], level.Size[a]);
        if (f == 0)
        {
          return Corrupt(file,
            "level " + std::to_string(l) + " has " + Text(level.Size) +
              " voxels, and the level "
              "before " +
              Text(before));
        }
        if (__builtin_mul_overflow(d.Levels.back().Factor[a], f, &level.Factor[a]))
        {
          return Corrupt(file, "its levels get coarser without end");
        }
      }
    }
    before = level.Size;
    d.Levels.push_back(std::move(level));
  }
  return {};
}

Result<VolumeDescription> Describe(const HDF5File& file, const VolumeRequest& request)
{
  VolumeDescription d;
  const std::string finest = DataSet + "/" + Level + "0";
  const std::vector<std::int64_t> times = IndicesBehind(file.Children(finest, MostChildren), Time);
  if (times.empty())
  {
    return Corrupt(file, "'" + finest + "' has no time point");
  }
  const std::string anyTime = finest + "/" + Time + std::to_string(times.front());
  const std::vector<std::int64_t> channels =
    IndicesBehind(file.Children(anyTime, MostChildren), Channel);
  if (channels.empty())
  {
    return Corrupt(file, "'" + anyTime + "' has no channel");
  }
  Status status = CheckRequest(file, request, channels.size(), times.size());
  if (!status.Ok())
  {
    return status;
  }
  const std::string time =
    Time + std::to_string(times[static_cast<std::size_t>(request.TimePoint)]);
  d.Times.assign(times.begin(), times.end());
  d.Channels.assign(channels.size(), {});
  for (std::size_t c = 0; c < channels.size() && c < 256; ++c)
  {
    ReadChannel(file, channels[c],
      finest + "/" + time + "/" + Channel + std::to_string(channels[c]), d.Channels[c]);
  }
  std::vector<std::string> chosen;
  for (const std::size_t c : ChannelsOf(request, channels.size()))
  {
    chosen.push_back(Channel + std::to_string(channels[c]));
  }
  status = ReadLevels(file, chosen, time, d);
  if (!status.Ok())
  {
    return status;
  }
  d.Seen.push_back(Counted(d.Levels.size(), "level") + ", " + Counted(times.size(), "time point") +
    ", " + Counted(channels.size(), "channel") +
    "; the datasets are padded, ImageSizeX, Y, Z say what counts.");
  d.View.Automatic = false;
  d.View.Spatial = { 2, 1, 0 };
  d.ArrayName = chosen.size() == 1 ? d.Channels[static_cast<std::size_t>(request.Channel)].Name
                                   : std::string("channels");
  Int3 size = d.Levels.front().Size;
  if (size[0] == 0)
  {
    const auto shape = file.DatasetShape(d.Levels.front().Paths.front());
    if (!shape || shape->size() != 3)
    {
      return Corrupt(
        file, "'" + d.Levels.front().Paths.front() + "' isn't a dataset with three axes");
    }
    size = { std::max<std::int64_t>((*shape)[2], 1), std::max<std::int64_t>((*shape)[1], 1),
      std::max<std::int64_t>((*shape)[0], 1) };
  }
  status = ReadGeometry(file, size, d);
  if (!status.Ok())
  {
    return status;
  }
  return d;
}
} // namespace

const VolumeFormat ImarisFormat{ "Imaris", &Recognise, &Describe };

} // namespace teravox
