// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "TruthShading.h"

#include <vector>

namespace teravox
{

/// VTK 9.1's GPU mapper with several lights, or others than a headlight ("lighting complexity 2
/// and 3"). With n the normal and V the direction of view along the ray, in the world, and for each
/// light L the direction in which it shines at the place, C its colours times its intensity, a what
/// arrives of it (1 of a directional one):
///
///   c' = clamp(ambient * sum(C_ambient) + diffuse * sum(a |n.L| C_diffuse) * c +
///              specular * sum(a |n.H|^power C_specular), 0, 1)      H = normalize(L + V)
///
/// With one-sided lighting max(n.L, 0) and max(n.H, 0): L leads away from the light, and n to
/// larger values. The ambient part doesn't know the colour, as in VTK. Three habits of VTK 9.1 are
/// not followed: of several directional lights only the last one's highlight is drawn; V is that of
/// a mirrored place (directional) or against the view (positional); and normals aren't turned by
/// the direction matrix.
class TruthLights : public TruthShading
{
public:
  struct Light
  {
    Double3 Ambient{};
    Double3 Diffuse{ 1, 1, 1 };
    Double3 Specular{ 1, 1, 1 };
    Double3 Direction{ 0, 0, -1 }; ///< of any length, world
    bool Positional = false;
    Double3 Position{};
    Double3 Attenuation{ 1, 0, 0 };
    double ConeAngle = 180; ///< degrees, axis to edge
    double Exponent = 1;
  };

  TruthLights(const TruthHeadlight::Material& material, const TruthHeadlight::Geometry& geometry,
    std::vector<Light> lights);

  Double3 Shade(const TruthShadingRay& ray, const TruthVolume& volume, int level,
    const Double3& difference, const Double3& color) const override;

private:
  TruthHeadlight::Material Material_;
  TruthHeadlight::Geometry Geometry_;
  Matrix4 DatasetFromWorld{};
  std::vector<Light> Lights;
};

} // namespace teravox
