// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "AtlasPlan.h"
#include "ByteCount.h"
#include "Commands.h"
#include "PyramidLayout.h"

#include <cstdio>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace teravox::program
{
namespace
{

/// What the mapper asks for, when it draws such a volume with such a driver.
AtlasRequest RequestFor(const PlanOptions& options)
{
  AtlasRequest request = AtlasRequest::For(
    TexelFormat::Choose(options.Type), options.Components, options.Size[0], options.Size[1]);
  request.BudgetBytes = options.GPUMemory;
  request.MaximumTextureSize = options.TextureSize;
  request.Native = options.Native;
  return request;
}

nlohmann::ordered_json ToJson(const PlanOptions& options, const PyramidLayout& pyramid,
  const AtlasRequest& request, const AtlasPlan& atlas)
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
  json["assumed"] = { { "size", options.Size }, { "marcher", options.Native ? "native" : "gpu" },
    { "texture_size", options.TextureSize } };
  json["bytes_per_texel"] = request.BytesPerTexel;
  json["reserved_bytes"] = request.ReservedBytes;
  json["atlas_slots"] = atlas.Slots;
  json["atlas_size"] = atlas.AtlasSize;
  json["atlas_bytes"] = atlas.AtlasBytes;
  json["page_blocks"] = atlas.PageBlocks;
  json["directory_bytes"] = atlas.DirectoryBytes;
  json["page_block_bytes"] = atlas.PageBlockBytes;
  json["slot_table_bytes"] = atlas.SlotTableBytes;
  json["addressing_bytes"] = atlas.AddressingBytes();
  json["feedback_bytes"] = atlas.FeedbackBytes;
  json["total_bytes"] = atlas.TotalBytes() + request.ReservedBytes;
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
  const AtlasRequest request = RequestFor(options);
  const auto plan = PlanAtlas(layout.Value(), request);
  if (!plan.Ok())
  {
    return plan.GetStatus();
  }
  const AtlasPlan& atlas = plan.Value();
  const PyramidLayout& pyramid = layout.Value();
  if (options.Json)
  {
    fmt::print("{}\n", ToJson(options, pyramid, request, atlas).dump(2));
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
  fmt::print("  picture            {} x {} pixels and tables, {}\n", options.Size[0],
    options.Size[1], FormatByteCount(static_cast<double>(request.ReservedBytes)));
  fmt::print("  together           {} of {}\n",
    FormatByteCount(static_cast<double>(atlas.TotalBytes() + request.ReservedBytes)),
    FormatByteCount(static_cast<double>(options.GPUMemory)));
  fmt::print("Assumed: an atlas in {}.\n",
    atlas.Native ? std::string("the memory of the host, for the native marcher")
                 : fmt::format("a 3-D texture of {} texels per axis at most", options.TextureSize));
  return {};
}

} // namespace teravox::program
