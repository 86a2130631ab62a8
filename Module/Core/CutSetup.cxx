// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "CutSetup.h"

#include "SharedLayout.h"

#include <algorithm>
#include <cmath>

namespace teravox
{

namespace
{
constexpr double FarAway = 3.0e38;

float Limited(double v)
{
  return static_cast<float>(std::clamp(v, -FarAway, FarAway));
}
} // namespace

std::vector<PlaneAlongRays> MakePlanes(const std::vector<ClipPlane>& planes, const ViewRays& rays,
  const std::array<double, 16>& worldFromView)
{
  std::vector<PlaneAlongRays> result;
  for (const ClipPlane& plane : planes)
  {
    // normal . (worldFromView v - origin) as a function of v in view space.
    Double3 normal{};
    double offset = 0;
    for (std::size_t i = 0; i < 3; ++i)
    {
      for (std::size_t j = 0; j < 3; ++j)
      {
        normal[j] += plane.Normal[i] * worldFromView[4 * i + j];
      }
      offset += plane.Normal[i] * (worldFromView[4 * i + 3] - plane.Origin[i]);
    }
    const auto along = [&](const Double3& v)
    { return normal[0] * v[0] + normal[1] * v[1] + normal[2] * v[2]; };
    std::array<double, 8> words{};
    double largest = 0;
    for (std::size_t k = 0; k < 3; ++k)
    {
      words[k] = along(rays.Origin[k]) + (k == 0 ? offset : 0.0);
      words[4 + k] = along(rays.Direction[k]);
      largest = std::max({ largest, std::abs(words[k]), std::abs(words[4 + k]) });
    }
    if (!(largest > 0) || !std::isfinite(largest))
    {
      continue;
    }
    // Only the ratio counts, in whatever unit the world is.
    PlaneAlongRays& to = result.emplace_back();
    std::transform(words.begin(), words.end(), to.begin(),
      [largest](double w) { return static_cast<float>(w / largest); });
  }
  return result;
}

std::vector<MarchParameters::Vec> PlanesOfVoxels(const std::vector<ClipPlane>& planes,
  const std::array<double, 16>& worldFromVoxel, const Double3& anchor)
{
  std::vector<MarchParameters::Vec> result;
  for (const ClipPlane& plane : planes)
  {
    std::array<double, 4> words{};
    for (std::size_t i = 0; i < 3; ++i)
    {
      double there = worldFromVoxel[4 * i + 3] - plane.Origin[i];
      for (std::size_t j = 0; j < 3; ++j)
      {
        words[j] += plane.Normal[i] * worldFromVoxel[4 * i + j];
        there += worldFromVoxel[4 * i + j] * anchor[j];
      }
      words[3] += plane.Normal[i] * there;
    }
    const double largest = std::max({ std::abs(words[0]), std::abs(words[1]), std::abs(words[2]) });
    if (largest > 0 && std::isfinite(largest))
    {
      MarchParameters::Vec& to = result.emplace_back();
      std::transform(words.begin(), words.end(), to.begin(),
        [largest](double w) { return Limited(w / largest); });
    }
  }
  return result;
}

void SetClipped(MarchParameters& parameters, double intensity, const ValueRange& range,
  const std::vector<MarchParameters::Vec>& planes)
{
  constexpr double far = 1e6; // times the largest value
  constexpr double farthest = 1e15;
  const bool known = range.IsKnown();
  const double largest = std::max({ std::abs(range.Min), std::abs(range.Max), 1e-30 });
  const double reach = known ? far * largest : farthest;
  const double value =
    std::clamp(intensity, known ? range.Min - reach : -reach, known ? range.Max + reach : reach);
  const std::size_t count = std::min(planes.size(), parameters.ClippedPlanes.size());
  const auto high = static_cast<float>(value);
  parameters.Clipped = { high, static_cast<float>(value - static_cast<double>(high)), 0,
    static_cast<float>(count) };
  std::copy_n(planes.begin(), count, parameters.ClippedPlanes.begin());
}

void SetCrop(MarchParameters& parameters, const CropRegions& crop,
  const std::array<double, 16>& datasetFromVoxel, const Double3& anchor)
{
  parameters.Switches[3] = crop.On ? shared::CROP_ON | (crop.Flags & shared::CROP_REGIONS) : 0;
  if (!crop.On)
  {
    return;
  }
  for (std::size_t i = 0; i < 3; ++i)
  {
    const double* row = &datasetFromVoxel[4 * i];
    // In units of a voxel: without a rotation the planes are then faces like those of bricks.
    const double scale = std::max({ std::abs(row[0]), std::abs(row[1]), std::abs(row[2]) });
    const double here = row[0] * anchor[0] + row[1] * anchor[1] + row[2] * anchor[2] + row[3];
    for (std::size_t j = 0; j < 3; ++j)
    {
      parameters.Crop[i][j] = static_cast<float>(row[j] / scale);
    }
    parameters.Crop[3][i] = Limited((crop.Planes[2 * i] - here) / scale);
    // As VTK, what lies between planes in the wrong order is before the lower one.
    const double upper = std::max(crop.Planes[2 * i], crop.Planes[2 * i + 1]);
    parameters.Crop[4][i] = Limited((upper - here) / scale);
  }
}

} // namespace teravox
