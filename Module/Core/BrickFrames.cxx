// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BrickFrames.h"

#include <algorithm>

namespace teravox
{

std::array<float, 3> FrameColor(int level)
{
  constexpr std::array<std::array<float, 3>, 8> colors{ { { 1, 1, 1 }, { 1, 1, 0 }, { 0, 1, 1 },
    { 1, 0, 1 }, { 0, 1, 0 }, { 1, 0, 0 }, { 0, 0, 1 }, { 1, 0.5F, 0 } } };
  return colors.at(static_cast<std::size_t>(level) % colors.size());
}

std::vector<FrameVertex> BrickFrames(
  const PyramidLayout& layout, const ViewInput& view, std::vector<BrickKey> bricks)
{
  std::sort(bricks.begin(), bricks.end(),
    [](const BrickKey& a, const BrickKey& b)
    { return a.Level != b.Level ? a.Level > b.Level : a < b; });
  const Matrix4 clipFromVoxel = MultiplyMatrices(view.ClipFromView,
    MultiplyMatrices(
      view.ViewFromWorld, MultiplyMatrices(view.WorldFromDataset, view.DatasetFromVoxel)));
  const double inset = view.CellData ? 0.0 : 0.5;
  std::vector<FrameVertex> lines;
  lines.reserve(bricks.size() * FrameVerticesPerBrick);
  for (const BrickKey& brick : bricks)
  {
    const std::array<std::uint32_t, 3> index{ brick.X, brick.Y, brick.Z };
    std::array<Double3, 2> box{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      const std::int64_t edge = layout.Factor(brick.Level)[a] * layout.BrickSize();
      double low = inset;
      double high = static_cast<double>(layout.Dimensions(0)[a]) - inset;
      if (view.Block)
      {
        low = std::max(low, static_cast<double>(view.Block->Low[a]));
        high = std::min(high, static_cast<double>(view.Block->High[a]));
      }
      box[0][a] = std::clamp(static_cast<double>(index[a] * edge), low, std::max(low, high));
      box[1][a] = std::clamp(static_cast<double>((index[a] + 1) * edge), low, std::max(low, high));
    }
    const auto add = [&](unsigned corner)
    {
      FrameVertex& vertex = lines.emplace_back();
      vertex.Color = FrameColor(brick.Level);
      for (std::size_t r = 0; r < 4; ++r)
      {
        double sum = clipFromVoxel[4 * r + 3];
        for (std::size_t a = 0; a < 3; ++a)
        {
          sum += clipFromVoxel[4 * r + a] * box.at(corner >> a & 1U)[a];
        }
        vertex.Clip[r] = static_cast<float>(sum);
      }
    };
    for (unsigned corner = 0; corner < 8; ++corner)
    {
      for (unsigned axis = 0; axis < 3; ++axis)
      {
        if ((corner >> axis & 1U) == 0)
        {
          add(corner);
          add(corner | 1U << axis);
        }
      }
    }
  }
  return lines;
}

} // namespace teravox
