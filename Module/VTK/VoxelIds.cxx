// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "VoxelIds.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace teravox
{

namespace
{
Int3 CountPerAxis(const Int3& dimensions, bool cellData, VoxelIdKind kind)
{
  const std::int64_t more = (kind == VoxelIdKind::Points ? 1 : 0) - (cellData ? 0 : 1);
  Int3 count{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    count[a] = std::max<std::int64_t>(dimensions[a] + more, 1);
  }
  return count;
}
} // namespace

std::int64_t NumberOfIds(const Int3& dimensions, bool cellData, VoxelIdKind kind)
{
  const Int3 n = CountPerAxis(dimensions, cellData, kind);
  return n[0] * n[1] * n[2];
}

std::vector<std::array<std::uint8_t, 4>> EncodeIds(const FirstHits& hits,
  const FrameRequest& request, const Int3& dimensions, VoxelIdKind kind, int shift)
{
  const ViewInput& camera = request.Camera;
  std::vector<std::array<std::uint8_t, 4>> pixels(hits.DepthAndLevel.size() / 2);
  const auto voxelFromView = InvertMatrix(MultiplyMatrices(
    MultiplyMatrices(camera.ViewFromWorld, camera.WorldFromDataset), camera.DatasetFromVoxel));
  if (!voxelFromView)
  {
    return pixels;
  }
  const Int3 n = CountPerAxis(dimensions, camera.CellData, kind);
  // Of corner coordinates, in which voxel i covers [i, i + 1]: cells of point data lie between the
  // centres, points of cell data at the corners.
  const double move = camera.CellData == (kind == VoxelIdKind::Cells) ? 0.0
    : camera.CellData                                                 ? 0.5
                                                                      : -0.5;
  for (std::size_t i = 0; i < pixels.size(); ++i)
  {
    if (hits.DepthAndLevel[2 * i] >= NativeView::NoHit)
    {
      continue;
    }
    const auto width = static_cast<std::size_t>(camera.Width);
    const Double3 voxel = ApplyToPoint(voxelFromView.Value(),
      hits.Geometry->PointInView(static_cast<double>(i % width) + 0.5,
        static_cast<double>(i / width) + 0.5, static_cast<double>(hits.DepthAndLevel[2 * i])));
    std::int64_t id = 0;
    for (std::size_t a = 3; a-- > 0;)
    {
      const double at = std::clamp(std::floor(voxel[a] + move), 0.0, static_cast<double>(n[a] - 1));
      id = id * n[a] + static_cast<std::int64_t>(at);
    }
    const auto code = static_cast<std::uint64_t>(id) >> shift;
    pixels[i] = { static_cast<std::uint8_t>(code), static_cast<std::uint8_t>(code >> 8),
      static_cast<std::uint8_t>(code >> 16), 255 };
  }
  return pixels;
}

} // namespace teravox
