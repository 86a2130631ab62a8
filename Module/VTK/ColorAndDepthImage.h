// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "VolumeEngine.h"

#include <vector>

class vtkImageData;

namespace teravox
{

/// A volume of a picture: where its rays hit, and how it is seen.
struct SeenVolume
{
  FirstHits Hits;
  ViewInput Camera;
};

/// Premultiplied colours and opacities (rows from the bottom, 4 floats per pixel) as 8-bit RGBA in
/// an image of one slice, as VTK's volume mappers give them: what `how` makes of them, and white
/// with opacity 0 where no volume's box is seen. Requires: there are volumes, and all is of
/// pictures of one size.
void FillColorImage(vtkImageData* image, const std::vector<float>& colors,
  const std::vector<SeenVolume>& volumes, const Composition& how);

/// Depths in 0...1 as the depth buffer counts them, of the first hits of a picture. Without a hit:
/// 1, or with `backface` that of the place where the ray leaves the last of the boxes that are
/// seen. `scalarType`: VTK_FLOAT, or VTK_UNSIGNED_CHAR or VTK_UNSIGNED_SHORT, whose largest value
/// is a depth of 1; others are taken as VTK_FLOAT.
void FillDepthImage(
  vtkImageData* image, const std::vector<SeenVolume>& volumes, int scalarType, bool backface);

} // namespace teravox
