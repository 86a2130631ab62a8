// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Gradients where clipping planes cut: of what they cut away a central difference finds one given
// value, whatever voxels are there (VTK's UseClippedVoxelIntensity). Along a ray each of the six
// places that a difference takes is cut away or not in stretches, in each of which the difference
// is a cubic per cell as usual.
#if TERAVOX_CLIPPED_GRADIENT
// Which places of the stretch at hand are cut away: bit 2 a of axis a is the one before, the next
// one the one behind.
uint g_clipped = 0u;

// What is found there, as a texel of a brick whose data values are scale * texel + offset above
// `low`, a float pair.
float ClippedTexel(float scale, float offset, vec2 low)
{
  precise float above = ((u_clipped.x - low.x) + (u_clipped.y - low.y)) - offset;
  return scale != 0.0 ? above / scale : 0.0;
}

// How far a place is before a plane at depth 0.
float DistanceOf(vec4 plane, Ray ray, vec3 factor, int place)
{
  float along = plane[place / 2] * factor[place / 2];
  precise float distance_ =
    (dot(plane.xyz, ray.origin) + plane.w) + (place % 2 == 0 ? -along : along);
  return distance_;
}

// Sets g_clipped behind `from`, and returns how far it stays so.
float EnterStretch(Ray ray, int level, float from, float to)
{
  vec3 factor = vec3(u_levelFactor[level].xyz);
  int count = int(u_clipped.w);
  float end = to;
  for (int i = 0; i < count; ++i)
  {
    precise float slope = dot(u_clippedPlanes[i].xyz, ray.direction);
    for (int place = 0; place < 6; ++place)
    {
      precise float cut = -DistanceOf(u_clippedPlanes[i], ray, factor, place) / slope;
      end = slope != 0.0 && cut > from && cut < end ? cut : end;
    }
  }
  float middle = 0.5 * (from + end);
  g_clipped = 0u;
  for (int i = 0; i < count; ++i)
  {
    float passed = middle * dot(u_clippedPlanes[i].xyz, ray.direction);
    for (int place = 0; place < 6; ++place)
    {
      bool away = DistanceOf(u_clippedPlanes[i], ray, factor, place) + passed < 0.0;
      g_clipped |= away ? 1u << uint(place) : 0u;
    }
  }
  return end;
}

// The texel at one of the places of a difference, where it would be `there`.
float PlaceTexel(int place, float there, float clipped)
{
  return (g_clipped >> uint(place) & 1u) != 0u ? clipped : there;
}
vec4 PlaceTexels(int place, vec4 there, float clipped)
{
  return (g_clipped >> uint(place) & 1u) != 0u ? vec4(clipped) : there;
}
#endif

// The central difference per axis in voxels of level 0 where all voxels have one value, a float
// pair: 0 but at a cut.
vec3 PlainDifference(vec2 value, int level)
{
  vec3 difference = vec3(0.0);
#if TERAVOX_CLIPPED_GRADIENT
  precise float step_ = (u_clipped.x - value.x) + (u_clipped.y - value.y);
  for (int a = 0; a < 3; ++a)
  {
    difference[a] = PlaceTexel(2 * a + 1, 0.0, step_) - PlaceTexel(2 * a, 0.0, step_);
  }
  difference /= vec3(u_levelFactor[level].xyz);
#endif
  return difference;
}
