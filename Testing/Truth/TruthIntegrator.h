// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "TruthCamera.h"
#include "TruthGradientOpacity.h"
#include "TruthImage.h"
#include "TruthLevelOfDetail.h"
#include "TruthShading.h"
#include "TruthTransfer.h"
#include "TruthVolume.h"

#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <vector>

namespace teravox
{

/// Premultiplied red, green, blue, and opacity.
using TruthColor = std::array<double, 4>;

/// What lies behind a plane is cut away: n . (x - origin) < 0, world.
struct TruthPlane
{
  Double3 Origin{};
  Double3 Normal{};
};

/// Two planes per axis of a space divide it into 27 regions, of which some are kept.
struct TruthCrop
{
  Matrix4 FromWorld = IdentityMatrix(); ///< that space
  std::array<double, 6> Planes{};       ///< x lower, x upper, y ...
  unsigned Flags = 0;                   ///< bit x + 3 y + 9 z
};

/// What is drawn of the voxels of one label.
struct TruthLabel
{
  TruthTransfer Transfer;
  std::shared_ptr<const TruthGradientOpacity> GradientOpacity; ///< null: 1 everywhere
};

/// Everything that the truth of a picture depends on, beside the pixel. Not owned.
struct TruthScene
{
  const TruthVolume& Volume;
  const TruthTransfer& Transfer;
  const TruthCamera& Camera;
  TruthLevelOfDetail LevelOfDetail;
  const TruthShading* Shading = nullptr; ///< null: unshaded
  double Tolerance = 1e-9;               ///< absolute, per pixel and channel
  /// Where the unit distance of the transfer function is measured. VTK 9.1 steps and measures in
  /// the space of the data set: give the inverse of the prop's matrix there, which matters only if
  /// that matrix scales. Identity: in world units.
  Matrix4 LengthFromWorld = IdentityMatrix();
  std::vector<TruthPlane> Planes{};
  /// What central differences find at places that a plane cuts away, whatever voxels are there: VTK
  /// 9.1's UseClippedVoxelIntensity. None: those voxels.
  std::optional<double> ClippedIntensity{};
  std::optional<TruthCrop> Crop{};
  const TruthGradientOpacity* GradientOpacity = nullptr; ///< null: 1 everywhere
  /// Instead of Transfer and GradientOpacity; not with labels. Null: none.
  const TruthImage* Image = nullptr;
  /// Nothing is drawn where this isn't above 0: a volume with nearest interpolation and the levels
  /// of `Volume`. Null: no mask.
  const TruthVolume* Mask = nullptr;
  /// Null: the mask is as said above. Else all is drawn, and where the mask, rounded down, is one
  /// of these, by the functions that belong to it, which replace Transfer and GradientOpacity.
  const std::map<std::int64_t, TruthLabel>* Labels = nullptr;
};

/// The truth of a pixel: the integral of c sigma exp(-tau) along the ray through
/// (x + 0.5 + offsetX, y + 0.5 + offsetY), from the near plane to the end of the box, the far plane
/// or the opaque view depth, whichever is first. Ends where the transmittance is below 1e-12.
///
/// Linear interpolation: the ray is cut at the view depths where lambda changes and at all planes
/// of voxel centres; in a piece the field is a cubic, which is cut where it is stationary and where
/// it meets a knot of the transfer function, and where the gradient's magnitude is stationary or
/// meets a knot of its opacity; what is left is smooth and integrated adaptively.
/// Nearest: cut at voxel faces, closed form. NaN adds nothing. With a
/// mask both are cut at the voxel faces of the level, which are the mask's.
TruthColor IntegratePixel(const TruthScene& scene, int x, int y, double offsetX = 0,
  double offsetY = 0, double opaqueDepth = std::numeric_limits<double>::infinity());

/// A stretch of a ray inside the box that is drawn from one level, as view depths.
struct TruthLevelSpan
{
  int Level;
  double DepthBegin;
  double DepthEnd;
};
/// The levels along the ray of a pixel, front to back; neighbours differ, or don't touch where
/// something is cropped away. Empty where it misses the box.
std::vector<TruthLevelSpan> LevelSpans(const TruthScene& scene, int x, int y, double offsetX = 0,
  double offsetY = 0, double opaqueDepth = std::numeric_limits<double>::infinity());

struct TruthPixel
{
  int X;
  int Y;
};
/// The pixels of a box, x fastest, from the lower left; those outside the picture are left out.
std::vector<TruthPixel> PixelBox(const TruthCamera& camera, int x, int y, int width, int height);
std::vector<TruthPixel> AllPixels(const TruthCamera& camera);

/// The truth of many pixels, in their order, on all cores. `opaqueDepth`: view depths of opaque
/// geometry for the *whole* picture (x fastest, lower left first; infinite where there is none), or
/// null.
std::vector<TruthColor> RenderTruth(const TruthScene& scene, const std::vector<TruthPixel>& pixels,
  const std::vector<double>* opaqueDepth = nullptr);

/// Smallest and largest truth over the 9 rays within +-1/32 pixel, per pixel and channel.
struct TruthEnvelope
{
  std::vector<TruthColor> Center;
  std::vector<TruthColor> Min;
  std::vector<TruthColor> Max;
};
TruthEnvelope RenderEnvelope(const TruthScene& scene, const std::vector<TruthPixel>& pixels,
  const std::vector<double>* opaqueDepth = nullptr);

/// As a plain RGBA buffer, for ImageMetrics.
std::vector<float> ToFloat(const std::vector<TruthColor>& colors);

} // namespace teravox
