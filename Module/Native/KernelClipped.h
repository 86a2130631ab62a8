// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Gradients where clipping planes cut: of what they cut away a central difference finds one given
// value, whatever voxels are there (VTK's UseClippedVoxelIntensity;
// Shaders/Library/ClippedGradient.glsl). Along a ray each of the six places that a difference takes
// is cut away or not in stretches, in each of which the difference is a cubic per cell as usual.

// A part of a ray on which the same of the six places are cut away: bit 2 a of axis a is the one
// before, the next one the one behind.
struct ClippedStretch
{
  float End;
  unsigned Clipped;
};

inline ClippedStretch NextStretch(
  const MarchParameters& p, const Ray& ray, int level, float from, float to)
{
  const Quad factor = ToFloat(Load(p.LevelFactor[static_cast<std::size_t>(level)]));
  const auto count = static_cast<std::size_t>(p.Clipped[3]);
  // How far the six places are before a plane at depth 0.
  const auto distance = [&](const Vec& plane, int place)
  {
    const float step = plane[static_cast<std::size_t>(place / 2)] * factor[place / 2];
    return (Dot(plane, ray.Origin) + plane[3]) + (place % 2 == 0 ? -step : step);
  };
  ClippedStretch s{ to, 0 };
  for (std::size_t i = 0; i < count; ++i)
  {
    const Vec& plane = p.ClippedPlanes[i];
    const float slope = Dot(plane, ray.Direction);
    for (int place = 0; place < 6; ++place)
    {
      // Along the plane: infinite, or not a number.
      const float cut = -distance(plane, place) / slope;
      s.End = cut > from && cut < s.End ? cut : s.End;
    }
  }
  const float middle = 0.5f * (from + s.End);
  for (std::size_t i = 0; i < count; ++i)
  {
    const Vec& plane = p.ClippedPlanes[i];
    const float passed = middle * Dot(plane, ray.Direction);
    for (int place = 0; place < 6; ++place)
    {
      s.Clipped |= distance(plane, place) + passed < 0.0f ? 1u << place : 0u;
    }
  }
  return s;
}

// What is found there, as a texel of a brick.
inline float ClippedTexel(const MarchParameters& p, const Transfer& transfer, const BrickView& view)
{
  const float above =
    ((p.Clipped[0] - transfer.Low) + (p.Clipped[1] - transfer.LowRest)) - view.Offset;
  return view.Scale != 0.0f ? above / view.Scale : 0.0f;
}

// Tells a brick what is cut away of the stretch at hand.
inline void SetClipped(
  const MarchParameters& p, unsigned clipped, const Transfer& transfer, BrickView& view)
{
  if (clipped != 0)
  {
    view.Clipped = clipped;
    view.ClippedTexel = ClippedTexel(p, transfer, view);
  }
}

// The difference where all voxels have one value, a float pair: per axis, in data per voxel of
// level 0.
inline Quad ClippedDifference(
  const MarchParameters& p, unsigned clipped, float valueHigh, float valueLow, int level)
{
  if (clipped == 0)
  {
    return Quad{};
  }
  const float step = (p.Clipped[0] - valueHigh) + (p.Clipped[1] - valueLow);
  Quad difference = {};
  for (int a = 0; a < 3; ++a)
  {
    const bool before = (clipped >> (2 * a) & 1u) != 0;
    const bool behind = (clipped >> (2 * a + 1) & 1u) != 0;
    difference[a] = before == behind ? 0.0f : behind ? step : -step;
  }
  const Quad factor = ToFloat(Load(p.LevelFactor[static_cast<std::size_t>(level)]));
  return difference * WithFourth(1.0f / factor, 0.0f);
}
