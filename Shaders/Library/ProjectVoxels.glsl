// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Blend modes other than composite, nearest interpolation: what they make of a voxel.

void TakeVoxel(
  inout State state, Ray ray, BrickView view, int level, ivec3 voxel, float t0, float t1)
{
  float texel = Voxel(view, voxel);
  float node = NodeOf(view, texel);
  vec3 gradient = vec3(0.0);
#if TERAVOX_SHADE
  gradient = CentralDifference(view, voxel) / vec3(u_levelFactor[level].xyz);
#endif
#if TERAVOX_FLOAT_DATA
  bool none = isnan(texel);
  g_side = none ? -1 : g_side;
#else
  bool none = false;
#endif
  if (!none)
  {
    TakeValue(state, ray, node, gradient, t0, t1);
  }
  COUNT(samples, true);
  COUNT(contributing, !none);
}
