// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Phong shading as Shaders/Library/Shade.glsl does it, for one lane or eight.

// Unit vector from where the ray begins in the volume to the eye, in dataset space.
inline Quad TowardsLight(const MarchParameters& p, const Ray& ray, float begin)
{
  const Quad v = Load(p.Eye) - (ray.Origin + begin * ray.Direction);
  const Quad d{ Dot(p.Dataset[0], v), Dot(p.Dataset[1], v), Dot(p.Dataset[2], v), 0.0f };
  return d / SquareRoot((d[0] * d[0] + d[1] * d[1]) + d[2] * d[2]);
}

// A unit vector, or 0 where there is no direction.
template <typename F>
struct Normal
{
  F X;
  F Y;
  F Z;
};

constexpr float FaintGradient = 1.0e-15f;
constexpr float FaintScale = 1.0e24f;

// In dataset space, from the central difference per axis in voxels of level 0.
template <typename F>
TERAVOX_INLINE Normal<F> NormalOf(const MarchParameters& p, F x, F y, F z)
{
  F gx = (x * p.Normal[0][0] + y * p.Normal[0][1]) + z * p.Normal[0][2];
  F gy = (x * p.Normal[1][0] + y * p.Normal[1][1]) + z * p.Normal[1][2];
  F gz = (x * p.Normal[2][0] + y * p.Normal[2][1]) + z * p.Normal[2][2];
  F square = (gx * gx + gy * gy) + gz * gz;
  const auto faint = square < F{} + FaintGradient * FaintGradient;
  if (Bits(faint) != 0)
  {
    // Squares of what is left would vanish.
    const F scale = Select(faint, F{} + FaintScale, F{} + 1.0f);
    gx = gx * scale;
    gy = gy * scale;
    gz = gz * scale;
    square = (gx * gx + gy * gy) + gz * gz;
  }
  const F magnitude = SquareRoot(square);
  // Neither beside voxels without a value nor beside infinite ones.
  const auto has = (magnitude > F{}) & (magnitude < F{} + FarAway);
  const F inverse = 1.0f / magnitude;
  return { Select(has, gx * inverse, F{}), Select(has, gy * inverse, F{}),
    Select(has, gz * inverse, F{}) };
}

// The colour lit from one side. As in VTK, it is clamped before it is weighted with the opacity.
template <typename F>
TERAVOX_INLINE Color<F> LitColor(
  const MarchParameters& p, const Color<F>& color, const Normal<F>& n, Quad towardsLight)
{
  const F zero = F{};
  F cosine = (n.X * towardsLight[0] + n.Y * towardsLight[1]) + n.Z * towardsLight[2];
  cosine = Min(p.LightDiffuse[3] != 0.0f ? Abs(cosine) : Max(cosine, zero), zero + 1.0f);
  const F diffuse = cosine * p.Material[1];
  F specular = zero;
  if (p.Material[2] != 0.0f)
  {
    specular = Select(cosine > zero, PowerOf(cosine, p.Material[3]) * p.Material[2], zero);
  }
  const auto lit = [&](F c, std::size_t channel)
  {
    const F v =
      c * (p.Material[0] + diffuse * p.LightDiffuse[channel]) + specular * p.LightSpecular[channel];
    return Min(Max(v, zero), zero + 1.0f);
  };
  return { lit(color.Red, 0), lit(color.Green, 1), lit(color.Blue, 2) };
}
