// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Blend modes other than composite, nearest interpolation: what they make of a voxel.
#if !TERAVOX_COMPONENTS

void TakeVoxel(
  inout State state, Ray ray, BrickView view, int level, ivec3 voxel, float t0, float t1)
{
  float texel = Voxel(view, voxel);
  float node = NodeOf(view, texel);
  vec3 gradient = vec3(0.0);
#if TERAVOX_SHADE
  gradient = CentralDifference(view, voxel) / vec3(u_levelFactor[level].xyz);
#endif
  bool none = false;
#if TERAVOX_FLOAT_DATA
  none = isnan(texel);
#endif
#if TERAVOX_MASK
  none = none || MaskAt(view, voxel) == 0;
#endif
  if (none)
  {
    LoseSide();
  }
  else
  {
    TakeValue(state, ray, node, gradient, t0, t1);
  }
  COUNT(samples, true);
  COUNT(contributing, !none);
}
#endif
