// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "VolumePick.h"

#include "ReadBox.h"

#include <algorithm>
#include <cmath>
#include <limits>
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

namespace
{
// Position, voxel and value of a place in view space.
Status PlaceAt(
  const Double3& view, const FrameRequest& request, BrickSource& source, VolumePick& pick)
{
  const auto worldFromView = InvertMatrix(request.Camera.ViewFromWorld);
  const auto voxelFromWorld = InvertMatrix(
    MultiplyMatrices(request.Camera.WorldFromDataset, request.Camera.DatasetFromVoxel));
  if (!worldFromView || !voxelFromWorld)
  {
    return worldFromView ? voxelFromWorld.GetStatus() : worldFromView.GetStatus();
  }
  pick.Position = ApplyToPoint(worldFromView.Value(), view);
  pick.Voxel = ApplyToPoint(voxelFromWorld.Value(), pick.Position);
  const Result<double> value = ReadValue(source, pick.Voxel, request.Nearest);
  pick.Value = value ? value.Value() : 0;
  return value ? Status() : value.GetStatus();
}
} // namespace

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
  VolumePick pick;
  const auto depth = static_cast<double>(hits.DepthAndLevel[0]);
  pick.Level = static_cast<int>(hits.DepthAndLevel[1]);
  const Status status = PlaceAt(hits.Geometry->PointInView(0.5, 0.5, depth), request, source, pick);
  return status ? Result<Picked>(pick) : Result<Picked>(status);
}

Result<std::optional<VolumePick>> PickTogether(
  const std::vector<PickPart>& parts, int x, int y, double opacity)
{
  using Picked = std::optional<VolumePick>;
  double near = std::numeric_limits<double>::infinity();
  double far = -near;
  for (const PickPart& part : parts)
  {
    const DepthRange depths =
      ViewDepthsOf(part.Request.Camera, part.Source->Info().Layout.Dimensions(0));
    near = std::min(near, depths.Near);
    far = std::max(far, depths.Far);
  }
  // Of each volume up to a depth, and of all of them together.
  std::vector<double> each(parts.size());
  const auto upTo = [&](double depth, double& together) -> Status
  {
    double left = 1;
    for (std::size_t v = 0; v < parts.size(); ++v)
    {
      const Result<double> one = parts[v].Engine->OpacityOfRay(parts[v].Request, x, y, depth);
      if (!one)
      {
        return one.GetStatus();
      }
      each[v] = one.Value();
      left *= 1 - one.Value();
    }
    together = 1 - left;
    return {};
  };
  // A ray that a picture ends early counts as opaque.
  const double wanted = std::min(opacity, 1 - 0.25 * std::max(parts[0].Request.Tolerance, 1e-6));
  double together = 0;
  if (Status status = upTo(far, together); !status)
  {
    return status;
  }
  if (!(together > wanted))
  {
    return Picked();
  }
  constexpr int halvings = 20;
  double before = near;
  for (int i = 0; i < halvings; ++i)
  {
    const double middle = 0.5 * (before + far);
    if (Status status = upTo(middle, together); !status)
    {
      return status;
    }
    (together > wanted ? far : before) = middle;
  }
  // Who it is: of the last voxel before it.
  if (Status status = upTo(far, together); !status)
  {
    return status;
  }
  const std::vector<double> here = each;
  double edge = std::numeric_limits<double>::infinity();
  for (const PickPart& part : parts)
  {
    const Result<ViewGeometry> geometry =
      ViewGeometry::Make(part.Source->Info().Layout, part.Request.Camera);
    edge = geometry ? std::min(edge, geometry.Value().SmallestEdge) : edge;
  }
  if (Status status = upTo(far - edge, together); !status)
  {
    return status;
  }
  std::size_t who = 0;
  for (std::size_t v = 1; v < parts.size(); ++v)
  {
    const auto gain = [&](std::size_t i) { return (here[i] - each[i]) / (1 - each[i] + 1e-12); };
    who = gain(v) > gain(who) ? v : who;
  }
  const PickPart& part = parts[who];
  const Result<ViewGeometry> geometry =
    ViewGeometry::Make(part.Source->Info().Layout, part.Request.Camera);
  const Result<FirstHits> hits =
    part.Engine->DrawOneRay(part.Request, x, y, std::max(0.0, here[who] * (1 - 1e-5)));
  if (!geometry || !hits)
  {
    return geometry ? hits.GetStatus() : geometry.GetStatus();
  }
  VolumePick pick;
  const std::vector<float>& found = hits.Value().DepthAndLevel;
  pick.Level = !found.empty() && found[0] < NativeView::NoHit ? static_cast<int>(found[1]) : 0;
  const ViewGeometry& g = geometry.Value();
  const Status status =
    PlaceAt(g.PointInView(x + 0.5, y + 0.5, far - g.DepthOrigin), part.Request, *part.Source, pick);
  return status ? Result<Picked>(pick) : Result<Picked>(status);
}

} // namespace teravox
