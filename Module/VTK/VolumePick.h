// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"
#include "VolumeEngine.h"

#include <memory>
#include <optional>
#include <vector>

namespace teravox
{

/// Where a ray's opacity passed a threshold.
struct VolumePick
{
  Double3 Position{}; ///< world
  Double3 Voxel{};    ///< corner coordinates of level 0: voxel i covers [i, i + 1]
  int Level = 0;      ///< that was drawn there
  double Value = 0;   ///< of level 0 there
};

/// Draws the one ray of a pixel (from the lower left of the viewport) with the engine that drew
/// `request`, and reads the value from the source: trilinear between the centres of voxels, or the
/// nearest one's, of component 0. Nothing if the opacity stays at `opacity` (0...1) or below.
/// Neither the picture of the view nor what is known of the last frame changes.
/// Errors: those of drawing; a brick that can't be read.
Result<std::optional<VolumePick>> PickVolume(VolumeEngine& engine, const FrameRequest& request,
  BrickSource& source, int x, int y, double opacity);

/// One of several volumes that are drawn together.
struct PickPart
{
  VolumeEngine* Engine = nullptr;
  FrameRequest Request;
  std::shared_ptr<BrickSource> Source;
};
/// The same of several volumes in one picture: where their opacity together passes the threshold.
/// Level and value are of the one that adds most to it just before, which is drawn there, voxel and
/// value are that volume's. By bisection, to a millionth of the depth of all of them.
Result<std::optional<VolumePick>> PickTogether(
  const std::vector<PickPart>& parts, int x, int y, double opacity);

/// The value of level 0 at a place, as above; outside that of the nearest place inside. NaN where
/// voxels that count are NaN.
Result<double> ReadValue(BrickSource& source, const Double3& voxel, bool nearest);

} // namespace teravox
