// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TruthShading.h"

#include <algorithm>
#include <cmath>

namespace teravox
{

Double3 TruthShading::GradientStep(const TruthVolume& volume, int level) const
{
  static_cast<void>(volume);
  static_cast<void>(level);
  return { 1, 1, 1 };
}

TruthHeadlight::TruthHeadlight(const Material& material, const Geometry& geometry)
  : Material_(material)
  , Geometry_(geometry)
  , DatasetFromWorld(Invert(geometry.WorldFromDataset))
{
}

Double3 TruthHeadlight::GradientStep(const TruthVolume& volume, int level) const
{
  Double3 step{ 1, 1, 1 };
  if (!this->Geometry_.ExactVoxelStep)
  {
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      const auto n = static_cast<double>(volume.Level(level).Dimensions[axis]);
      step[axis] = n > 1 ? n / (n - 1) : 1;
    }
  }
  return step;
}

double TruthShading::Facing(
  const TruthShadingRay& ray, const TruthVolume& volume, int level, const Double3& difference) const
{
  static_cast<void>(ray);
  static_cast<void>(volume);
  static_cast<void>(level);
  static_cast<void>(difference);
  return 0;
}

Double3 TruthHeadlight::Gradient(
  const TruthVolume& volume, int level, const Double3& difference) const
{
  Double3 gradient{};
  for (std::size_t axis = 0; axis < 3; ++axis)
  {
    gradient[axis] = difference[axis] /
      (this->Geometry_.Spacing[axis] * static_cast<double>(volume.Level(level).Factor[axis]));
  }
  return this->Geometry_.TurnNormals ? TransformVector(this->Geometry_.Direction, gradient)
                                     : gradient;
}

Double3 TruthHeadlight::LightDirection(const TruthShadingRay& ray) const
{
  return Normalize(TransformPoint(this->DatasetFromWorld, ray.Ray.Eye) -
    TransformPoint(this->DatasetFromWorld, ray.Entry));
}

Double3 TruthHeadlight::Normal(
  const TruthVolume& volume, int level, const Double3& difference) const
{
  const Double3 gradient = this->Gradient(volume, level, difference);
  const double sum = gradient[0] + gradient[1] + gradient[2];
  return std::isfinite(sum) ? Normalize(gradient) : Double3{ 0, 0, 0 };
}

double TruthHeadlight::Facing(
  const TruthShadingRay& ray, const TruthVolume& volume, int level, const Double3& difference) const
{
  return Dot(this->Gradient(volume, level, difference), this->LightDirection(ray));
}

Double3 TruthHeadlight::Shade(const TruthShadingRay& ray, const TruthVolume& volume, int level,
  const Double3& difference, const Double3& color) const
{
  const Material& m = this->Material_;
  const Double3 normal = this->Normal(volume, level, difference);
  const Double3 light = this->LightDirection(ray);
  double cosine = Dot(normal, light);
  if (cosine < 0)
  {
    cosine = m.TwoSided ? -cosine : 0;
  }
  const double highlight = m.Specular * std::pow(cosine, m.SpecularPower);
  Double3 result{};
  for (std::size_t c = 0; c < 3; ++c)
  {
    result[c] = std::clamp(m.Ambient * color[c] +
        m.Diffuse * m.LightDiffuse[c] * cosine * color[c] + highlight * m.LightSpecular[c],
      0.0, 1.0);
  }
  return result;
}

} // namespace teravox
