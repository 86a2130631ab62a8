// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Phong shading as Shaders/Library/Shade.glsl does it, for one lane or eight.

// Unit vector from where the ray begins in the volume to the eye, in dataset space.
inline Vector TowardsLight(const MarchParameters& p, const Ray& ray, float begin)
{
  const Vector v{ p.Eye[0] - (ray.Origin.X + begin * ray.Direction.X),
    p.Eye[1] - (ray.Origin.Y + begin * ray.Direction.Y),
    p.Eye[2] - (ray.Origin.Z + begin * ray.Direction.Z) };
  const Vector d{ Dot(p.Dataset[0], v), Dot(p.Dataset[1], v), Dot(p.Dataset[2], v) };
  const float length = SquareRoot((d.X * d.X + d.Y * d.Y) + d.Z * d.Z);
  return { d.X / length, d.Y / length, d.Z / length };
}

// The colour lit at a place with this central difference per axis, in voxels of level 0. As in VTK,
// it is clamped before it is weighted with the opacity.
template <typename F>
TERAVOX_INLINE Color<F> LitColor(
  const MarchParameters& p, const Color<F>& color, F x, F y, F z, const Vector& towardsLight)
{
  const F gx = (x * p.Normal[0][0] + y * p.Normal[0][1]) + z * p.Normal[0][2];
  const F gy = (x * p.Normal[1][0] + y * p.Normal[1][1]) + z * p.Normal[1][2];
  const F gz = (x * p.Normal[2][0] + y * p.Normal[2][1]) + z * p.Normal[2][2];
  const F zero = F{};
  const F magnitude = SquareRoot((gx * gx + gy * gy) + gz * gz);
  const F inverse = Select(magnitude > zero, 1.0f / magnitude, zero);
  F cosine = ((gx * towardsLight.X + gy * towardsLight.Y) + gz * towardsLight.Z) * inverse;
  cosine = Min(p.LightDiffuse[3] != 0.0f ? Abs(cosine) : Max(cosine, zero), zero + 1.0f);
  const F diffuse = cosine * p.Material[1];
  F specular = zero;
  if (p.Material[2] != 0.0f)
  {
    specular = Select(cosine > zero, PowerOf(cosine, p.Material[3]) * p.Material[2], zero);
  }
  const auto lit = [&](F c, std::size_t channel)
  {
    const F v = c * (p.Material[0] + diffuse * p.LightDiffuse[channel]) +
      specular * p.LightSpecular[channel];
    return Min(Max(v, zero), zero + 1.0f);
  };
  return { lit(color.Red, 0), lit(color.Green, 1), lit(color.Blue, 2) };
}
