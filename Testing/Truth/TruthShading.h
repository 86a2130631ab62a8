// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "TruthCamera.h"
#include "TruthVolume.h"

namespace teravox
{

/// What a shading may know of the ray it works on.
struct TruthShadingRay
{
  TruthRay Ray;
  Double3 Entry{}; ///< where the ray enters the volume's box, or starts inside it, world
  Double3 At{};    ///< what is shaded, world
};

/// Changes the colour of a sample, never its opacity. Extension point of the reference integrator.
/// Thread: functions are called from several threads at once.
class TruthShading
{
public:
  TruthShading() = default;
  TruthShading(const TruthShading&) = delete;
  TruthShading& operator=(const TruthShading&) = delete;
  TruthShading(TruthShading&&) = delete;
  TruthShading& operator=(TruthShading&&) = delete;
  virtual ~TruthShading() = default;

  /// Half the width of the central difference, in voxels of the level.
  virtual Double3 GradientStep(const TruthVolume& volume, int level) const;
  /// `difference`: F(p + h) - F(p - h) along each axis of the level, not divided by h; may be NaN.
  virtual Double3 Shade(const TruthShadingRay& ray, const TruthVolume& volume, int level,
    const Double3& difference, const Double3& color) const = 0;
  /// A *linear* function of the difference; Shade() may have a kink where it changes its sign.
  /// (Along a piece of a ray it is a cubic, so that the integrator can cut there.) 0: no such
  /// kinks.
  virtual double Facing(const TruthShadingRay& ray, const TruthVolume& volume, int level,
    const Double3& difference) const;
};

/// VTK 9.1's GPU mapper with one headlight of intensity 1 ("lighting complexity 1").
///
/// All vectors are in *dataset* space: world before the prop's matrix W, after origin, spacing and
/// direction matrix D of the image. With F the field (texture clamped at the outer voxels) and e_a
/// one texture step along axis a of the image:
///
///   g_a = (F(p + e_a) - F(p - e_a)) / spacing_a                     (not divided by 2,
///   range-scaled
///                                                                    values: only the direction
///                                                                    counts)
///   n   = g / |g|, or 0 where |g| = 0
///   L   = V = H = normalize(W^-1 eye - q)      q: point of the ray on the surface of the volume's
///   box d   = n.L;  where d < 0: with two-sided lighting (VTK's default) d = -d, else the diffuse
///   part is 0 c'  = clamp(ambient * c + diffuse * lightDiffuse * d * c + specular * lightSpecular
///   * d^power, 0, 1)
///
/// c is the transfer function's colour. The light's ambient colour is not used; the opacity is not
/// touched. Where n = 0 only ambient * c is left (for power > 0). One-sided with d < 0: GLSL's pow
/// is undefined; here the highlight is 0.
///
/// Perspective: L is the direction against the ray, the same for the whole ray. Parallel: `eye` is
/// still the position of the camera, so that L is *not* against the ray, but points from the place
/// where the ray enters the box (or passes the near plane inside it) to the camera's position; it
/// is constant along a ray and changes from pixel to pixel.
///
/// Two habits of VTK 9.1 are switches here. (1) The texture step is 1 / (n_a - 1) of the texture's
/// width, that is n_a / (n_a - 1) voxels and not one (`ExactVoxelStep`). (2) n is used in the axes
/// of the *image*: it is not turned by D, while L is (`TurnNormals`), so that shading is right only
/// where D is the identity. Levels coarser than 0 don't exist in VTK: there spacing_a is factor_a *
/// spacing_a. Where a voxel of the gradient is NaN, n = 0.
class TruthHeadlight : public TruthShading
{
public:
  struct Material
  {
    double Ambient = 0.1;
    double Diffuse = 0.7;
    double Specular = 0.2;
    double SpecularPower = 10;
    Double3 LightDiffuse{ 1, 1, 1 };
    Double3 LightSpecular{ 1, 1, 1 };
    bool TwoSided = true;
  };
  struct Geometry
  {
    Double3 Spacing{ 1, 1, 1 };
    Matrix3 Direction{ 1, 0, 0, 0, 1, 0, 0, 0, 1 };
    Matrix4 WorldFromDataset = IdentityMatrix();
    bool TurnNormals = true;
    bool ExactVoxelStep = true;
  };

  TruthHeadlight(const Material& material, const Geometry& geometry);

  Double3 GradientStep(const TruthVolume& volume, int level) const override;
  Double3 Shade(const TruthShadingRay& ray, const TruthVolume& volume, int level,
    const Double3& difference, const Double3& color) const override;

  /// |g| n.L
  double Facing(const TruthShadingRay& ray, const TruthVolume& volume, int level,
    const Double3& difference) const override;

  /// n of the formula above.
  Double3 Normal(const TruthVolume& volume, int level, const Double3& difference) const;

private:
  Double3 Gradient(const TruthVolume& volume, int level, const Double3& difference) const;
  Double3 LightDirection(const TruthShadingRay& ray) const;

  Material Material_;
  Geometry Geometry_;
  Matrix4 DatasetFromWorld{};
};

} // namespace teravox
