// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TruthLights.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace teravox
{

TruthLights::TruthLights(const TruthHeadlight::Material& material,
  const TruthHeadlight::Geometry& geometry, std::vector<Light> lights)
  : Material_(material)
  , Geometry_(geometry)
  , DatasetFromWorld(Invert(geometry.WorldFromDataset))
  , Lights(std::move(lights))
{
}

Double3 TruthLights::Shade(const TruthShadingRay& ray, const TruthVolume& volume, int level,
  const Double3& difference, const Double3& color) const
{
  const TruthHeadlight::Material& m = this->Material_;
  Double3 gradient{};
  for (std::size_t axis = 0; axis < 3; ++axis)
  {
    gradient[axis] = difference[axis] /
      (this->Geometry_.Spacing[axis] * static_cast<double>(volume.Level(level).Factor[axis]));
  }
  gradient = TransformVector(this->Geometry_.Direction, gradient);
  // Gradients transform with the transpose of the inverse.
  Double3 normal{};
  for (std::size_t i = 0; i < 3; ++i)
  {
    for (std::size_t j = 0; j < 3; ++j)
    {
      normal[i] += this->DatasetFromWorld[4 * j + i] * gradient[j];
    }
  }
  const double sum = normal[0] + normal[1] + normal[2];
  normal = std::isfinite(sum) ? Normalize(normal) : Double3{ 0, 0, 0 };
  const auto facing = [&](const Double3& direction)
  {
    const double cosine = Dot(normal, direction);
    return m.TwoSided ? std::fabs(cosine) : std::max(cosine, 0.0);
  };
  Double3 result{};
  for (const Light& light : this->Lights)
  {
    Double3 direction = Normalize(light.Direction);
    double arriving = 1;
    if (light.Positional)
    {
      const Double3 axis = direction;
      const Double3 from = ray.At - light.Position;
      const double d = Length(from);
      direction = Normalize(from);
      arriving =
        1 / (light.Attenuation[0] + d * light.Attenuation[1] + d * d * light.Attenuation[2]);
      if (light.ConeAngle <= 90)
      {
        const double cosine = Dot(direction, axis);
        arriving *= cosine >= std::cos(light.ConeAngle * std::acos(-1.0) / 180)
          ? std::pow(cosine, light.Exponent)
          : 0;
      }
    }
    const double diffuse = m.Diffuse * arriving * facing(direction);
    const double shine = facing(Normalize(direction + ray.Ray.Direction));
    const double highlight =
      shine > 0 ? m.Specular * arriving * std::pow(shine, m.SpecularPower) : 0;
    for (std::size_t c = 0; c < 3; ++c)
    {
      result[c] += m.Ambient * light.Ambient[c] + diffuse * light.Diffuse[c] * color[c] +
        highlight * light.Specular[c];
    }
  }
  for (double& channel : result)
  {
    channel = std::clamp(channel, 0.0, 1.0);
  }
  return result;
}

} // namespace teravox
