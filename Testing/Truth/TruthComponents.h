// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "TruthIntegrator.h"

#include <vector>

namespace teravox
{

/// A picture of voxels with several components, each a field of its own with a scene of its own:
/// its volume, its transfer function, its shading. Camera, levels, cuts, a mask (without labels),
/// tolerance and the measure of lengths are those of the first. Not owned.
///
/// GradientOpacity is that of each emitter.
///
/// Independent: with weights w, extinctions s and colours c of the components at a place, what a
/// length emits is sum w s c, and what it takes away sum s^2 / sum w s, both over w > 0. Where an
/// opacity is 1, there is a wall: with W the components that have it, its light is
/// (sum_W w c) (sum_W w) / |W|, the limit of emission per extinction.
///
/// Dependent: the extinction is that of the last component by the first function's opacity. The
/// colour is that of the first component (of two), or the first three components as they are, 1 at
/// FullColor (of four).
///
/// With an Image, two components have one function: opacity and colour are those of the image at
/// the first one's value and the second one's, counted from the first of Rows. Light falls on the
/// first.
struct TruthComponents
{
  std::vector<const TruthScene*> Parts; ///< one per component
  std::vector<double> Weights;          ///< likewise; of independent ones
  bool Dependent = false;
  double FullColor = 255;
  const TruthImage* Image = nullptr;
  std::vector<double> Rows; ///< values of the second component, ascending
};

/// The truth of a pixel, see IntegratePixel(): the ray is cut at all planes of voxel centres, and
/// in between where any component's cubic is stationary or meets a knot of its function. A
/// component with a NaN among the eight voxels of a cell isn't there in that cell; of dependent
/// ones, and of two with an image, none is.
TruthColor IntegrateComponents(
  const TruthComponents& scene, int x, int y, double offsetX = 0, double offsetY = 0);

/// As RenderEnvelope().
TruthEnvelope RenderComponentEnvelope(
  const TruthComponents& scene, const std::vector<TruthPixel>& pixels);
/// As RenderTruth().
std::vector<TruthColor> RenderComponents(
  const TruthComponents& scene, const std::vector<TruthPixel>& pixels);

} // namespace teravox
