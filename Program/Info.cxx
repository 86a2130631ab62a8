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

namespace teravox::program
{
namespace
{

nlohmann::ordered_json ToJson(const VolumeInfo& info, std::uint64_t fileBytes)
{
  nlohmann::ordered_json json;
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
  for (int level = 0; level < info.Layout.NumberOfLevels(); ++level)
  {
    json["levels"].push_back({ { "level", level }, { "dimensions", info.Layout.Dimensions(level) },
      { "factor", info.Layout.Factor(level) } });
  }
  return json;
}

void Print(const VolumeInfo& info, std::uint64_t fileBytes)
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
  for (int level = 0; level < info.Layout.NumberOfLevels(); ++level)
  {
    const Int3& dims = info.Layout.Dimensions(level);
    fmt::print("  level {:<5} {} x {} x {}\n", level, dims[0], dims[1], dims[2]);
  }
}

} // namespace

Status RunInfo(const InfoOptions& options)
{
  HDF5OpenOptions open;
  open.DatasetPath = options.Dataset;
  auto source = HDF5BrickSource::Open(options.File, open);
  if (!source.Ok())
  {
    return source.GetStatus();
  }
  std::error_code error;
  const auto fileBytes = std::filesystem::file_size(options.File, error);
  const VolumeInfo& info = source.Value()->Info();
  if (options.Json)
  {
    fmt::print("{}\n", ToJson(info, error ? 0 : fileBytes).dump(2));
  }
  else
  {
    Print(info, error ? 0 : fileBytes);
  }
  return {};
}

} // namespace teravox::program
