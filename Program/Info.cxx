// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ByteCount.h"
#include "Commands.h"
#include "HDF5BrickSource.h"

#include <cstdio>
#include <filesystem>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

namespace teravox::program
{
namespace
{

nlohmann::ordered_json ToJson(
  const VolumeInfo& info, const VolumeDescription& description, std::uint64_t fileBytes)
{
  nlohmann::ordered_json json;
  json["format"] = description.Format;
  json["seen"] = description.Seen;
  json["name"] = info.Name;
  json["array"] = info.ArrayName;
  json["association"] = info.CellData ? "cells" : "points";
  json["type"] = ToString(info.Type);
  json["components"] = info.Components;
  json["labels"] = info.Labels;
  json["dimensions"] = info.Layout.Dimensions(0);
  json["spacing"] = info.Spacing;
  json["origin"] = info.Origin;
  json["direction"] = info.Direction;
  json["extent_start"] = info.ExtentStart;
  if (info.Range.IsKnown() && !info.Range.IsVoid())
  {
    json["range"] = { info.Range.Min, info.Range.Max };
  }
  json["histogram"] = info.Histogram;
  json["file_bytes"] = fileBytes;
  json["unit"] = description.Unit;
  json["times"] = description.Times;
  for (const ChannelDescription& channel : description.Channels)
  {
    nlohmann::ordered_json entry{ { "name", channel.Name } };
    if (channel.Color)
    {
      entry["color"] = *channel.Color;
    }
    if (channel.Display.IsKnown())
    {
      entry["display"] = { channel.Display.Min, channel.Display.Max };
    }
    json["channels"].push_back(std::move(entry));
  }
  for (int level = 0; level < info.Layout.NumberOfLevels(); ++level)
  {
    json["levels"].push_back({ { "level", level }, { "dimensions", info.Layout.Dimensions(level) },
      { "factor", info.Layout.Factor(level) } });
  }
  return json;
}

void PrintChannels(const VolumeDescription& description)
{
  for (std::size_t c = 0; c < description.Channels.size() && description.Channels.size() > 1; ++c)
  {
    const ChannelDescription& channel = description.Channels[c];
    fmt::print("  channel {:<3} {}{}\n", c, channel.Name,
      channel.Color ? fmt::format(", colour {} {} {}", (*channel.Color)[0], (*channel.Color)[1],
                        (*channel.Color)[2])
                    : std::string());
  }
  if (description.Times.size() > 1)
  {
    fmt::print("  time points {}, from {} to {}\n", description.Times.size(),
      description.Times.front(), description.Times.back());
  }
}

void Print(const VolumeInfo& info, const VolumeDescription& description, std::uint64_t fileBytes)
{
  const Int3& size = info.Layout.Dimensions(0);
  const double voxels =
    static_cast<double>(size[0]) * static_cast<double>(size[1]) * static_cast<double>(size[2]);
  const double bytes =
    voxels * static_cast<double>(SizeOf(info.Type)) * static_cast<double>(info.Components);
  fmt::print("{}\n", info.Name);
  fmt::print("  voxels      {} x {} x {} {}, {} component{}, {} data{}\n", size[0], size[1],
    size[2], ToString(info.Type), info.Components, info.Components == 1 ? "" : "s",
    info.CellData ? "cell" : "point", info.Labels ? ", labels" : "");
  fmt::print("  size        {} of voxels, {} on disk\n", FormatByteCount(bytes),
    FormatByteCount(static_cast<double>(fileBytes)));
  fmt::print("  spacing     {} x {} x {}\n", info.Spacing[0], info.Spacing[1], info.Spacing[2]);
  fmt::print("  origin      {}, {}, {}\n", info.Origin[0], info.Origin[1], info.Origin[2]);
  if (info.Range.IsKnown() && !info.Range.IsVoid())
  {
    fmt::print("  range       {} to {}\n", info.Range.Min, info.Range.Max);
  }
  else
  {
    fmt::print("  range       unknown\n");
  }
  PrintChannels(description);
  for (int level = 0; level < info.Layout.NumberOfLevels(); ++level)
  {
    const Int3& dims = info.Layout.Dimensions(level);
    fmt::print("  level {:<5} {} x {} x {}\n", level, dims[0], dims[1], dims[2]);
  }
  for (const std::string& line : description.Seen)
  {
    fmt::print("  - {}\n", line);
  }
}

} // namespace

Status RunInfo(const InfoOptions& options)
{
  HDF5OpenOptions open;
  open.DatasetPath = options.Dataset;
  open.Channel = options.Channel;
  open.TimePoint = options.TimePoint;
  auto source = HDF5BrickSource::Open(options.File, open);
  if (!source.Ok())
  {
    return source.GetStatus();
  }
  std::error_code error;
  const auto fileBytes = std::filesystem::file_size(options.File, error);
  const VolumeInfo& info = source.Value()->Info();
  const VolumeDescription& description = source.Value()->Description();
  if (options.Json)
  {
    fmt::print("{}\n",
      ToJson(info, description, error ? 0 : fileBytes)
        .dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
  }
  else
  {
    Print(info, description, error ? 0 : fileBytes);
  }
  return {};
}

} // namespace teravox::program
