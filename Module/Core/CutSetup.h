// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "MarchParameters.h"
#include "Types.h"

#include <array>
#include <cstdint>
#include <vector>

namespace teravox
{

/// A half space of the world: what lies before the plane, where its normal points, is kept.
struct ClipPlane
{
  Double3 Origin{};
  Double3 Normal{};
};

/// The 27 regions into which two planes per axis divide the space of the image.
struct CropRegions
{
  bool On = false;
  std::array<double, 6> Planes{}; ///< of x, y, z: the lower and the upper one, image's space
  std::uint32_t Flags = 0;        ///< bit x + 3 y + 9 z: whether that region is kept
};

/// The rays of a view as functions of the pixel, in view space: at pixel corner (0, 0), change per
/// pixel in x, in y. A ray is at Origin + t * Direction at the depth t of the marchers.
struct ViewRays
{
  std::array<Double3, 3> Origin{};
  std::array<Double3, 3> Direction{};
};

/// The planes along the rays of a view (`worldFromView`: rows of a matrix). Those without a normal
/// are left out.
std::vector<PlaneAlongRays> MakePlanes(const std::vector<ClipPlane>& planes, const ViewRays& rays,
  const std::array<double, 16>& worldFromView);

/// The planes as functions of a place p in corner coordinates of level 0 relative to `anchor`:
/// xyz . p + w, kept where that isn't negative. Those without a normal are left out.
/// `worldFromVoxel`: rows of a matrix.
std::vector<MarchParameters::Vec> PlanesOfVoxels(const std::vector<ClipPlane>& planes,
  const std::array<double, 16>& worldFromVoxel, const Double3& anchor);

/// MarchParameters::Clipped and ClippedPlanes: `intensity` is what gradients find where planes cut
/// away; further from all values than a million times the largest it counts as that far, of
/// an unknown range as 1e15. Planes beyond MaximumClippedPlanes are left out.
void SetClipped(MarchParameters& parameters, double intensity, const ValueRange& range,
  const std::vector<MarchParameters::Vec>& planes);

/// MarchParameters::Crop and Switches[3]. `datasetFromVoxel`: rows of a matrix; `anchor`: the point
/// that the positions of rays are relative to.
void SetCrop(MarchParameters& parameters, const CropRegions& crop,
  const std::array<double, 16>& datasetFromVoxel, const Double3& anchor);

} // namespace teravox
