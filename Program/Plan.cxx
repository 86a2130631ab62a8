// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "AtlasPlan.h"
#include "ByteCount.h"
#include "Commands.h"
#include "PyramidLayout.h"

#include <algorithm>
#include <cstdio>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace teravox::program
{
namespace
{

/// The atlas that the mapper makes for a scalar type: integers of 8 and 16 bits as they are, all
/// others as 32-bit floats, wide ones relative to their brick.
AtlasRequest RequestFor(const PlanOptions& options)
{
  AtlasRequest request;
  request.BudgetBytes = options.GPUMemory;
  const std::size_t texel = std::min<std::size_t>(4, SizeOf(options.Type));
  request.BytesPerTexel =
    static_cast<std::uint32_t>(texel) * static_cast<std::uint32_t>(options.Components);
  request.SlotTable = options.Type == ScalarType::UInt32 || options.Type == ScalarType::Int32 ||
    options.Type == ScalarType::Float64;
  return request;
}

nlohmann::ordered_json ToJson(
  const PlanOptions& options, const PyramidLayout& pyramid, const AtlasPlan& atlas)
{
  nlohmann::ordered_json json;
  json["dimensions"] = options.Dimensions;
  json["type"] = ToString(options.Type);
  json["components"] = options.Components;
  json["brick"] = options.BrickSize;
  for (int level = 0; level < pyramid.NumberOfLevels(); ++level)
  {
    json["levels"].push_back({ { "level", level }, { "dimensions", pyramid.Dimensions(level) },
      { "factor", pyramid.Factor(level) }, { "bricks", pyramid.Bricks(level) } });
  }
  json["bricks"] = pyramid.TotalBricks();
  json["page_depth"] = pyramid.PageDepth();
  json["directory_entries"] = pyramid.DirectoryEntries();
  json["gpu_budget_bytes"] = options.GPUMemory;
  json["atlas_slots"] = atlas.Slots;
  json["atlas_size"] = atlas.AtlasSize;
  json["atlas_bytes"] = atlas.AtlasBytes;
  json["page_blocks"] = atlas.PageBlocks;
  json["directory_bytes"] = atlas.DirectoryBytes;
  json["page_block_bytes"] = atlas.PageBlockBytes;
  json["slot_table_bytes"] = atlas.SlotTableBytes;
  json["addressing_bytes"] = atlas.AddressingBytes();
  json["feedback_bytes"] = atlas.FeedbackBytes;
  json["total_bytes"] = atlas.TotalBytes();
  return json;
}

} // namespace

Status RunPlan(const PlanOptions& options)
{
  const auto layout =
    PyramidLayout::MakeDefault(options.Dimensions, options.Spacing, options.BrickSize);
  if (!layout.Ok())
  {
    return layout.GetStatus();
  }
  const auto plan = PlanAtlas(layout.Value(), RequestFor(options));
  if (!plan.Ok())
  {
    return plan.GetStatus();
  }
  const AtlasPlan& atlas = plan.Value();
  const PyramidLayout& pyramid = layout.Value();
  if (options.Json)
  {
    fmt::print("{}\n", ToJson(options, pyramid, atlas).dump(2));
    return {};
  }
  fmt::print("{} x {} x {} {}, {} component{}, bricks of {}^3\n", options.Dimensions[0],
    options.Dimensions[1], options.Dimensions[2], ToString(options.Type), options.Components,
    options.Components == 1 ? "" : "s", options.BrickSize);
  for (int level = 0; level < pyramid.NumberOfLevels(); ++level)
  {
    const Int3& dims = pyramid.Dimensions(level);
    const Int3& bricks = pyramid.Bricks(level);
    fmt::print("  level {:<2}  {} x {} x {} voxels, {} x {} x {} bricks\n", level, dims[0], dims[1],
      dims[2], bricks[0], bricks[1], bricks[2]);
  }
  fmt::print("  bricks             {}\n", pyramid.TotalBricks());
  fmt::print("  page levels        {}, and a directory of {} entries\n", pyramid.PageDepth(),
    pyramid.DirectoryEntries());
  fmt::print("  atlas              {} slots, {} x {} x {} texels, {}\n", atlas.Slots,
    atlas.AtlasSize[0], atlas.AtlasSize[1], atlas.AtlasSize[2],
    FormatByteCount(static_cast<double>(atlas.AtlasBytes)));
  fmt::print("  addressing         {} bytes ({}): directory {}, page blocks {}, slots {}\n",
    atlas.AddressingBytes(), FormatByteCount(static_cast<double>(atlas.AddressingBytes())),
    atlas.DirectoryBytes, atlas.PageBlockBytes, atlas.SlotTableBytes);
  fmt::print("  together           {} of {}\n",
    FormatByteCount(static_cast<double>(atlas.TotalBytes())),
    FormatByteCount(static_cast<double>(options.GPUMemory)));
  return {};
}

} // namespace teravox::program
