// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "View.h"

#include "DisplayProbe.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fmt/format.h>
#include <limits>
#include <vtkCamera.h>
#include <vtkMath.h>

namespace teravox::program
{
namespace
{

/// Distances along the view direction to the nearest and the farthest corner of the bounds.
void DepthRange(vtkCamera* camera, const double bounds[6], double& nearest, double& farthest)
{
  double position[3];
  double direction[3];
  camera->GetPosition(position);
  camera->GetDirectionOfProjection(direction);
  nearest = std::numeric_limits<double>::infinity();
  farthest = -nearest;
  for (std::size_t corner = 0; corner < 8; ++corner)
  {
    double depth = 0.0;
    for (std::size_t a = 0; a < 3; ++a)
    {
      depth += direction[a] * (bounds[2 * a + (corner >> a & 1)] - position[a]);
    }
    nearest = std::min(nearest, depth);
    farthest = std::max(farthest, depth);
  }
}

/// Looks at the middle of the volume from the side that the angles say, from the least distance at
/// which all corners are in the picture.
void PlaceAround(
  vtkCamera* camera, const CameraOptions& options, const double bounds[6], double aspect)
{
  double center[3];
  for (std::size_t a = 0; a < 3; ++a)
  {
    center[a] = 0.5 * (bounds[2 * a] + bounds[2 * a + 1]);
  }
  camera->SetFocalPoint(center);
  camera->SetPosition(center[0], center[1] - 1.0, center[2]);
  camera->SetViewUp(0, 0, 1);
  camera->Azimuth(options.Azimuth);
  camera->Elevation(options.Elevation);
  camera->OrthogonalizeViewUp();
  double forward[3];
  double up[3];
  double right[3];
  camera->GetDirectionOfProjection(forward);
  camera->GetViewUp(up);
  vtkMath::Cross(forward, up, right);
  const double slope = std::tan(vtkMath::RadiansFromDegrees(0.5 * options.ViewAngle));
  double distance = 0.0;
  double scale = 0.0;
  for (std::size_t corner = 0; corner < 8; ++corner)
  {
    double p[3];
    for (std::size_t a = 0; a < 3; ++a)
    {
      p[a] = bounds[2 * a + (corner >> a & 1)] - center[a];
    }
    // What the corner needs of the picture's half height, at the distance 1.
    const double height =
      std::max(std::abs(vtkMath::Dot(p, up)), std::abs(vtkMath::Dot(p, right)) / aspect);
    distance = std::max(distance, height / slope - vtkMath::Dot(p, forward));
    scale = std::max(scale, height);
  }
  constexpr double margin = 1.03;
  camera->SetParallelScale(margin * scale);
  camera->SetPosition(center[0] - margin * distance * forward[0],
    center[1] - margin * distance * forward[1], center[2] - margin * distance * forward[2]);
}

Status PlaceGiven(vtkCamera* camera, const CameraOptions& options, const double bounds[6])
{
  double position[3];
  double focal[3];
  double extent = 0.0;
  for (std::size_t a = 0; a < 3; ++a)
  {
    const double size = bounds[2 * a + 1] - bounds[2 * a];
    position[a] = bounds[2 * a] + options.Position[a] * size;
    focal[a] = bounds[2 * a] + options.FocalPoint[a] * size;
    extent = std::max(extent, size);
  }
  double direction[3];
  vtkMath::Subtract(focal, position, direction);
  double up[3] = { options.ViewUp[0], options.ViewUp[1], options.ViewUp[2] };
  double side[3];
  const double length = vtkMath::Normalize(direction);
  const double upLength = vtkMath::Normalize(up);
  vtkMath::Cross(direction, up, side);
  if (!(length > 0.0) || !(upLength > 0.0) || vtkMath::Norm(side) < 1e-6)
  {
    return { StatusCode::InvalidArgument,
      "The camera needs a focal point away from its position and a view-up across its view." };
  }
  camera->SetPosition(position);
  camera->SetFocalPoint(focal);
  camera->SetViewUp(up);
  camera->SetParallelScale(0.5 * extent);
  return {};
}

} // namespace

Status CheckDisplay()
{
  const char* name = std::getenv("DISPLAY");
  if (!name || !*name || !CanOpenDisplay(name))
  {
    return { StatusCode::NotFound,
      name && *name
        ? fmt::format("The display {} can't be opened; run under xvfb-run for a display without a "
                      "screen.",
            name)
        : std::string("There is no display; run under xvfb-run for one without a screen.") };
  }
  return {};
}

Status PlaceCamera(vtkCamera* camera, const CameraOptions& options, const double bounds[6],
  double aspect, double voxel)
{
  camera->SetViewAngle(options.ViewAngle);
  camera->SetParallelProjection(options.Parallel ? 1 : 0);
  if (options.Given)
  {
    Status status = PlaceGiven(camera, options, bounds);
    if (!status.Ok())
    {
      return status;
    }
  }
  else
  {
    PlaceAround(camera, options, bounds, aspect);
  }
  camera->Zoom(options.Zoom);
  double nearest = 0.0;
  double farthest = 0.0;
  DepthRange(camera, bounds, nearest, farthest);
  if (!(farthest > 0.0))
  {
    return { StatusCode::InvalidArgument, "The camera looks away from the volume." };
  }
  const double margin = 1e-3 * (farthest - nearest) + voxel;
  const double least = options.Parallel ? nearest - margin : std::min(0.5 * voxel, 0.1 * farthest);
  camera->SetClippingRange(std::max(nearest - margin, least), farthest + margin);
  return {};
}

} // namespace teravox::program
