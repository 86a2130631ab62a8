// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "LightSetup.h"

#include "SharedLayout.h"
#include "ViewGeometry.h"

#include <cmath>

namespace teravox
{

namespace
{
using Vec = MarchParameters::Vec;

Vec ToVec(const Double3& v, double fourth = 0)
{
  return { static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2]),
    static_cast<float>(fourth) };
}

Double3 Unit(const Double3& v)
{
  const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  return length > 0 ? Double3{ v[0] / length, v[1] / length, v[2] / length } : Double3{ 0, 0, 0 };
}
} // namespace

std::vector<Vec> MakeLightTable(const std::vector<LightInput>& lights,
  const std::array<double, 16>& viewFromWorld, const ViewRays& rays, int width, int height)
{
  std::vector<Vec> table;
  if (lights.empty())
  {
    return table;
  }
  // Relative to where the middle of the picture meets the volume: floats hold places around it.
  Double3 here{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    here[a] =
      rays.Origin[0][a] + 0.5 * width * rays.Origin[1][a] + 0.5 * height * rays.Origin[2][a];
  }
  const auto relative = [&here](const Double3& v) {
    return Double3{ v[0] - here[0], v[1] - here[1], v[2] - here[2] };
  };
  table.push_back(ToVec(relative(rays.Origin[0])));
  table.push_back(ToVec(rays.Origin[1]));
  table.push_back(ToVec(rays.Origin[2]));
  for (const Double3& direction : rays.Direction)
  {
    table.push_back(ToVec(direction));
  }
  Double3 ambient{};
  for (const LightInput& light : lights)
  {
    for (std::size_t a = 0; a < 3; ++a)
    {
      ambient[a] += light.Ambient[a];
    }
  }
  table.push_back(ToVec(ambient, static_cast<double>(lights.size())));
  static_assert(shared::LIGHTS_BEGIN == 7 && shared::LIGHT_VECTORS == 5);
  constexpr double radians = 3.14159265358979323846 / 180;
  for (const LightInput& light : lights)
  {
    const bool cone = light.Positional && light.ConeAngle <= 90;
    table.push_back(ToVec(light.Diffuse, light.Positional ? 1 : 0));
    table.push_back(ToVec(light.Specular, light.Exponent));
    table.push_back(ToVec(Unit(ApplyToVector(viewFromWorld, light.Direction)),
      cone ? std::cos(light.ConeAngle * radians) : -2));
    table.push_back(ToVec(relative(ApplyToPoint(viewFromWorld, light.Position))));
    table.push_back(ToVec(light.Attenuation));
  }
  return table;
}

} // namespace teravox
