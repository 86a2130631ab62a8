// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "CutSetup.h"
#include "MarchParameters.h"

#include <array>
#include <vector>

namespace teravox
{

/// A light of a scene, in world coordinates. Colours come times the intensity.
struct LightInput
{
  std::array<double, 3> Ambient{};
  std::array<double, 3> Diffuse{};
  std::array<double, 3> Specular{};
  Double3 Direction{ 0, 0, -1 }; ///< in which it shines; of any length
  bool Positional = false;       ///< else it comes from infinitely far away
  Double3 Position{};
  std::array<double, 3> Attenuation{ 1, 0, 0 }; ///< 1 / (x + y distance + z distance^2)
  double ConeAngle = 180; ///< degrees between axis and edge; more than 90: it shines everywhere
  double Exponent = 1;    ///< of the cosine to the axis, within a cone
};

/// What both marchers are told of lights that aren't one headlight: the ray of a pixel in view
/// space relative to a point near the volume (six vectors, as ViewRays), the sum of the ambient
/// colours with the number of lights, and for each light diffuse colour and whether it is
/// positional, specular colour and exponent, direction and cosine of the cone (-2: none), position,
/// attenuation. Empty without lights. View space: rows of `viewFromWorld`.
std::vector<MarchParameters::Vec> MakeLightTable(const std::vector<LightInput>& lights,
  const std::array<double, 16>& viewFromWorld, const ViewRays& rays, int width, int height);

} // namespace teravox
