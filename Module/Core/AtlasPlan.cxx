// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "AtlasPlan.h"

#include "PageTable.h"

#include <algorithm>
#include <string>

namespace teravox
{

namespace
{
constexpr std::uint64_t SlotTableEntryBytes = 16;
constexpr std::uint32_t SmallestAtlas = 2;
constexpr std::int64_t VersionBytes = 4;

// One page block for 96 slots: a surface crosses some 90 of the 512 bricks of a block.
std::uint32_t PageBlocksFor(const PyramidLayout& layout, std::uint32_t slots)
{
  const auto chain = static_cast<std::uint32_t>(layout.PageDepth());
  return std::max<std::uint32_t>({ 64, slots / 96, 4 * chain });
}

std::uint64_t SlotTableBytesOf(const AtlasRequest& request, std::uint32_t slots)
{
  return request.SlotTable ? std::uint64_t{ slots } * request.Components * SlotTableEntryBytes : 0;
}

AtlasPlan Complete(
  const PyramidLayout& layout, const AtlasRequest& request, const Int3& perAxis, const Int3& size)
{
  AtlasPlan plan;
  plan.SlotsPerAxis = perAxis;
  plan.Components = request.Components;
  plan.AtlasSize = size;
  plan.Slots = static_cast<std::uint32_t>(
    std::min<std::int64_t>(perAxis[0] * perAxis[1] * perAxis[2], request.MaximumSlots));
  plan.PageBlocks = PageBlocksFor(layout, plan.Slots);
  plan.AtlasBytes = static_cast<std::uint64_t>(size[0] * size[1] * size[2]) * request.BytesPerTexel;
  const std::int64_t cells = CeilDiv(layout.BrickSize(), CellEdge);
  plan.CellBytes =
    static_cast<std::uint64_t>(perAxis[0] * perAxis[1] * perAxis[2] * cells * cells * cells) * 2 *
    request.BytesPerTexel;
  plan.DirectoryBytes = static_cast<std::uint64_t>(layout.DirectoryEntries()) * sizeof(PageEntry);
  plan.PageBlockBytes =
    std::uint64_t{ plan.PageBlocks } * PageTable::EntriesPerBlock * sizeof(PageEntry);
  plan.SlotTableBytes = SlotTableBytesOf(request, plan.Slots);
  plan.FeedbackBytes = 4 *
    (std::uint64_t{ FeedbackHeaderWords } +
      std::uint64_t{ RequestTableEntries } * RequestTableWords + plan.Slots + plan.PageBlocks);
  return plan;
}

// The most slots within the budget, one after the other; the least atlas if none fit.
AtlasPlan PlanNative(
  const PyramidLayout& layout, const AtlasRequest& request, std::int64_t useful, bool& fits)
{
  const std::int64_t edge = layout.StoredSize();
  const auto with = [&](std::int64_t slots)
  {
    AtlasPlan plan = Complete(layout, request, { slots, 1, 1 }, { slots * edge, edge, edge });
    plan.Native = true;
    const std::int64_t words = CeilDiv(CeilDiv(layout.BrickSize(), CellEdge), MacroEdge);
    plan.OccupancyBytes =
      static_cast<std::uint64_t>(slots * (words * words * words * 16 + VersionBytes));
    return plan;
  };
  const auto fit = [&](std::int64_t slots)
  { return with(slots).TotalBytes() + request.ReservedBytes <= request.BudgetBytes; };
  std::int64_t low = SmallestAtlas;
  std::int64_t high = useful;
  fits = fit(low);
  while (fits && low < high)
  {
    const std::int64_t middle = low + (high - low + 1) / 2;
    if (fit(middle))
    {
      low = middle;
    }
    else
    {
      high = middle - 1;
    }
  }
  return with(low);
}

// The same with slots side by side in a 3-D texture.
AtlasPlan PlanTexture(
  const PyramidLayout& layout, const AtlasRequest& request, std::int64_t useful, bool& fits)
{
  const std::int64_t edge = layout.StoredSize();
  const std::int64_t most = request.MaximumTextureSize / edge;
  const std::int64_t mostDeep = most / static_cast<std::int64_t>(request.Components);
  fits = false;
  AtlasPlan best;
  AtlasPlan least;
  for (std::int64_t z = 1; z <= mostDeep; ++z)
  {
    for (std::int64_t y = z; y <= most; ++y)
    {
      for (std::int64_t x = y; x <= most; ++x)
      {
        if (x * y * z < SmallestAtlas)
        {
          continue;
        }
        const AtlasPlan plan =
          Complete(layout, request, { x, y, z }, { x * edge, y * edge, z * edge });
        if (least.Slots == 0 || plan.TotalBytes() < least.TotalBytes())
        {
          least = plan;
        }
        if (plan.TotalBytes() + request.ReservedBytes > request.BudgetBytes)
        {
          break;
        }
        const auto worth = [&](const AtlasPlan& p)
        { return std::min<std::int64_t>(p.Slots, useful); };
        if (!fits || worth(plan) > worth(best) ||
          (worth(plan) == worth(best) && plan.TotalBytes() < best.TotalBytes()))
        {
          fits = true;
          best = plan;
        }
      }
    }
  }
  return fits ? best : least;
}
} // namespace

AtlasRequest AtlasRequest::For(const TexelFormat& format, int components, int width, int height)
{
  AtlasRequest request;
  request.Components = static_cast<std::uint32_t>(components);
  request.BytesPerTexel = format.BytesPerTexel * request.Components;
  request.SlotTable = format.Relative;
  request.ReservedBytes = PictureBytes(width, height) + TableBytesReserved;
  return request;
}

std::uint64_t PictureBytes(int width, int height)
{
  constexpr std::uint64_t tileBytes = 12; // 8 in the list, 4 for the stamp
  constexpr std::int64_t tileEdge = 32;
  const auto tiles =
    static_cast<std::uint64_t>(CeilDiv(width, tileEdge) * CeilDiv(height, tileEdge));
  return static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) *
    RayStateBytesPerPixel +
    tiles * tileBytes;
}

Result<AtlasPlan> PlanAtlas(const PyramidLayout& layout, const AtlasRequest& request)
{
  const std::int64_t edge = layout.StoredSize();
  const std::int64_t useful = std::max<std::int64_t>(
    SmallestAtlas, std::min<std::int64_t>(layout.TotalBricks(), request.MaximumSlots));
  bool fits = false;
  AtlasPlan plan = request.Native ? PlanNative(layout, request, useful, fits)
                                  : PlanTexture(layout, request, useful, fits);
  if (plan.Slots == 0)
  {
    return Status(StatusCode::ResourceExhausted,
      "A brick of " + std::to_string(edge) +
        " voxels per axis (with its border) doesn't fit twice into a texture of at most " +
        std::to_string(request.MaximumTextureSize) + " texels per axis.");
  }
  if (!fits)
  {
    return Status(StatusCode::ResourceExhausted,
      "The GPU memory budget of " + std::to_string(request.BudgetBytes) +
        " bytes is too small; the least that works here is " +
        std::to_string(plan.TotalBytes() + request.ReservedBytes) + " bytes.");
  }
  plan.Slots = static_cast<std::uint32_t>(std::min<std::int64_t>(plan.Slots, useful));
  plan.SlotTableBytes = SlotTableBytesOf(request, plan.Slots);
  return plan;
}

} // namespace teravox
