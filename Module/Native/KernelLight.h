// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Phong shading as Shaders/Library/Shade.glsl and Lights.glsl do it, for one lane or eight.

// What the light is like along a ray. Origin to Along: of the ray in the space of the lights.
struct RayLight
{
  Quad Towards;      // of one headlight
  const Vec* Lights; // instead of it (see LightSetup.h)
  bool Positional;   // one of them is
  Quad Origin;
  Quad Direction;
  Quad Along;     // the unit vector
  float PerWorld; // depth per world length
};

// Unit vector from where the ray begins in the volume to the eye, in dataset space.
inline Quad TowardsLight(const MarchParameters& p, const Ray& ray, float begin)
{
  const Quad v = Load(p.Eye) - (ray.Origin + begin * ray.Direction);
  const Quad d{ Dot(p.Dataset[0], v), Dot(p.Dataset[1], v), Dot(p.Dataset[2], v), 0.0f };
  return d / SquareRoot((d[0] * d[0] + d[1] * d[1]) + d[2] * d[2]);
}

inline RayLight MakeRayLight(const NativeScene& scene)
{
  const Quad none = {};
  RayLight light{ Quad{ 0.0f, 0.0f, 1.0f, 0.0f }, scene.Lights, false, none, none, none, 0.0f };
  if (scene.Lights != nullptr)
  {
    const auto count = static_cast<std::size_t>(scene.Lights[shared::LIGHTS_BEGIN - 1][3]);
    for (std::size_t i = 0; i < count; ++i)
    {
      const Vec& diffuse = scene.Lights[shared::LIGHTS_BEGIN + i * shared::LIGHT_VECTORS];
      light.Positional = light.Positional || diffuse[3] != 0.0f;
    }
  }
  return light;
}

// The ray of a pixel in the space of the lights.
inline void SetRayLight(RayLight& light, const Ray& ray, float x, float y)
{
  const auto row = [&](std::size_t first)
  {
    return (Load(light.Lights[first]) + x * Load(light.Lights[first + 1])) +
      y * Load(light.Lights[first + 2]);
  };
  light.Origin = row(0);
  light.Direction = row(3);
  const Quad& d = light.Direction;
  light.Along = d / SquareRoot((d[0] * d[0] + d[1] * d[1]) + d[2] * d[2]);
  light.PerWorld = 1.0f / ray.World;
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

// Of a light in a place to which it shines along `direction`: what arrives (see Lights.glsl).
template <typename F>
TERAVOX_INLINE F AttenuationOf(const Vec* light, const Normal<F>& direction, F distance)
{
  const F zero = F{};
  const Vec& falling = light[4];
  const F arriving = 1.0f / (falling[0] + distance * (falling[1] + distance * falling[2]));
  if (light[2][3] < -1.5f)
  {
    return arriving;
  }
  const F cosine =
    Min((direction.X * light[2][0] + direction.Y * light[2][1]) + direction.Z * light[2][2],
      zero + 1.0f);
  const auto inside = (cosine >= light[2][3]) & (cosine > zero);
  return Select(inside, arriving * PowerOf(Max(cosine, zero), light[1][3]), zero);
}

// The colour lit by lights of all kinds, at the depths t of a ray.
template <typename F>
__attribute__((noinline)) Color<F> LitByLights(
  const MarchParameters& p, const Color<F>& color, const Normal<F>& n, const RayLight& ray, F t)
{
  const F zero = F{};
  const bool twoSided = p.LightDiffuse[3] != 0.0f;
  const auto facing = [&](F cosine)
  { return Min(twoSided ? Abs(cosine) : Max(cosine, zero), zero + 1.0f); };
  const auto unit = [&](F x, F y, F z, F& size) -> Normal<F>
  {
    size = SquareRoot((x * x + y * y) + z * z);
    const F inverse = Select(size > zero, 1.0f / size, zero);
    return { x * inverse, y * inverse, z * inverse };
  };
  F diffuse[3] = { zero, zero, zero };
  F specular[3] = { zero, zero, zero };
  const Vec& ambient = ray.Lights[shared::LIGHTS_BEGIN - 1];
  const int count = static_cast<int>(ambient[3]);
  for (int i = 0; i < count; ++i)
  {
    const Vec* light =
      ray.Lights + shared::LIGHTS_BEGIN + static_cast<std::size_t>(i) * shared::LIGHT_VECTORS;
    Normal<F> direction{ zero + light[2][0], zero + light[2][1], zero + light[2][2] };
    F arriving = zero + 1.0f;
    if (light[0][3] != 0.0f)
    {
      const auto from = [&](int a)
      {
        const float relative = ray.Origin[a] - light[3][static_cast<std::size_t>(a)];
        return relative + t * ray.Direction[a];
      };
      F distance = zero;
      direction = unit(from(0), from(1), from(2), distance);
      arriving = AttenuationOf(light, direction, distance);
    }
    const F share = arriving * facing((n.X * direction.X + n.Y * direction.Y) + n.Z * direction.Z);
    F size = zero;
    const Normal<F> half = unit(
      direction.X + ray.Along[0], direction.Y + ray.Along[1], direction.Z + ray.Along[2], size);
    const F shine = facing((n.X * half.X + n.Y * half.Y) + n.Z * half.Z);
    const F highlight =
      arriving * Select(shine > zero, PowerOf(shine, p.Material[3]) * p.Material[2], zero);
    for (std::size_t c = 0; c < 3; ++c)
    {
      diffuse[c] = diffuse[c] + share * light[0][c];
      specular[c] = specular[c] + highlight * light[1][c];
    }
  }
  const auto lit = [&](F c, std::size_t channel)
  {
    const F v = (c * (diffuse[channel] * p.Material[1]) + specular[channel]) +
      ambient[channel] * p.Material[0];
    return Min(Max(v, zero), zero + 1.0f);
  };
  return { lit(color.Red, 0), lit(color.Green, 1), lit(color.Blue, 2) };
}

// The colour lit from one side. As in VTK, it is clamped before it is weighted with the opacity.
// `t`: depths, which matter to other lights than a headlight.
template <typename F>
TERAVOX_INLINE Color<F> LitColor(
  const MarchParameters& p, const Color<F>& color, const Normal<F>& n, const RayLight& ray, F t)
{
  if (ray.Lights != nullptr)
  {
    return LitByLights(p, color, n, ray, t);
  }
  const F zero = F{};
  const Quad towardsLight = ray.Towards;
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
