// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "VolumePick.h"

#include "ReadBox.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace teravox
{

Result<double> ReadValue(BrickSource& source, const Double3& voxel, bool nearest)
{
  const VolumeInfo& info = source.Info();
  const Int3& n = info.Layout.Dimensions(0);
  Int3 first{};
  Int3 size{};
  Double3 share{}; // of the second voxel along each axis
  for (std::size_t a = 0; a < 3; ++a)
  {
    const auto last = static_cast<double>(n[a] - 1);
    const double at = std::clamp(voxel[a] - 0.5, 0.0, last);
    first[a] = static_cast<std::int64_t>(
      nearest ? std::clamp(std::floor(voxel[a]), 0.0, last) : std::floor(at));
    share[a] = nearest ? 0.0 : at - static_cast<double>(first[a]);
    size[a] = share[a] > 0 ? 2 : 1;
  }
  return DispatchScalarType(info.Type,
    [&](auto zero) -> Result<double>
    {
      using T = decltype(zero);
      const auto components = static_cast<std::size_t>(info.Components);
      std::vector<T> voxels(static_cast<std::size_t>(size[0] * size[1] * size[2]) * components);
      const ReadBoxReport report =
        ReadBox(source, 0, first, size, reinterpret_cast<std::byte*>(voxels.data()));
      if (report.FailedBricks > 0)
      {
        return report.FirstFailure;
      }
      double value = 0;
      std::size_t i = 0;
      for (int z = 0; z < size[2]; ++z)
      {
        for (int y = 0; y < size[1]; ++y)
        {
          for (int x = 0; x < size[0]; ++x, i += components)
          {
            const double weight = (x != 0 ? share[0] : 1 - share[0]) *
              (y != 0 ? share[1] : 1 - share[1]) * (z != 0 ? share[2] : 1 - share[2]);
            value += weight * static_cast<double>(voxels[i]);
          }
        }
      }
      return value;
    });
}

Result<std::optional<VolumePick>> PickVolume(VolumeEngine& engine, const FrameRequest& request,
  BrickSource& source, int x, int y, double opacity)
{
  using Picked = std::optional<VolumePick>;
  const Result<FirstHits> drawn = engine.DrawOneRay(request, x, y, opacity);
  if (!drawn)
  {
    return drawn.GetStatus();
  }
  const FirstHits& hits = drawn.Value();
  if (hits.DepthAndLevel.empty() || hits.DepthAndLevel[0] >= NativeView::NoHit)
  {
    return Picked();
  }
  const auto worldFromView = InvertMatrix(request.Camera.ViewFromWorld);
  const auto voxelFromWorld = InvertMatrix(
    MultiplyMatrices(request.Camera.WorldFromDataset, request.Camera.DatasetFromVoxel));
  if (!worldFromView || !voxelFromWorld)
  {
    return worldFromView ? voxelFromWorld.GetStatus() : worldFromView.GetStatus();
  }
  VolumePick pick;
  const auto depth = static_cast<double>(hits.DepthAndLevel[0]);
  pick.Position = ApplyToPoint(worldFromView.Value(), hits.Geometry->PointInView(0.5, 0.5, depth));
  pick.Voxel = ApplyToPoint(voxelFromWorld.Value(), pick.Position);
  pick.Level = static_cast<int>(hits.DepthAndLevel[1]);
  const Result<double> value = ReadValue(source, pick.Voxel, request.Nearest);
  if (!value)
  {
    return value.GetStatus();
  }
  pick.Value = value.Value();
  return Picked(pick);
}

} // namespace teravox
