// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Commands.h"
#include "Status.h"

class vtkCamera;

namespace teravox::program
{

/// Is there an X server? VTK aborts without one.
/// Errors: NotFound, with what to do.
Status CheckDisplay();

/// Places the camera for a volume. `bounds`: xmin, xmax, ymin, ... in world units. `aspect`: width
/// over height of the picture. The near plane goes down to half a voxel (`voxel`, world units) if
/// the camera is inside, so that the foreground stays; VTK's own rule would cut it off.
/// Errors: a camera that looks at itself, or upwards along its view-up.
Status PlaceCamera(vtkCamera* camera, const CameraOptions& options, const double bounds[6],
  double aspect, double voxel);

} // namespace teravox::program
