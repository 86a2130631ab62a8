// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// The field is constant in each voxel: one segment per voxel, cut exactly at voxel faces.
#if TERAVOX_BLEND
#include "Library/ProjectVoxels.glsl"
#elif TERAVOX_COMPONENTS
#include "Library/ComponentVoxels.glsl"
#else
void TakeVoxel(
  inout State state, Ray ray, BrickView view, int level, ivec3 voxel, float t0, float t1)
{
  float texel = Voxel(view, voxel);
  float node = NodeOf(view, texel);
#if TERAVOX_MASK
  int mask = MaskAt(view, voxel);
  SelectTables(mask);
#endif
  precise float depth = SampleTransfer(node).s * ((t1 - t0) * ray.world);
#if TERAVOX_FLOAT_DATA
  depth = isnan(texel) ? 0.0 : depth;
#endif
#if TERAVOX_MASK
  depth = mask != 0 ? depth : 0.0;
#endif
  vec3 color = TransferColor(node);
#if TERAVOX_SHADE || TERAVOX_GRADIENT_OPACITY || TERAVOX_PLANE
  if (depth > 0.0)
  {
    vec3 difference = CentralDifference(view, voxel) / vec3(u_levelFactor[level].xyz);
#if TERAVOX_GRADIENT_OPACITY
    depth *= SampleGradient(MainGradients(), difference).opacity;
#endif
#if TERAVOX_PLANE
    PlaneSample there = SamplePlane(node, RowOf(difference * u_gradient.xyz));
    depth = there.s * ((t1 - t0) * ray.world);
    color = there.color;
#endif
#if TERAVOX_SHADE
    color = LitColor(color, Shade(difference, state.light, mix(t0, t1, 0.5)));
#endif
    COUNT(gradients, true);
  }
#endif
  Accumulate(state, OpacityOf(depth), color);
  COUNT(samples, true);
  COUNT(evaluated, depth > 0.0);
  COUNT(contributing, depth > 0.0);
#if TERAVOX_MASK
  SelectTables(0);
#endif
}
#endif

void IntegrateBrick(inout State state, Ray ray, BrickView view, int level, float t0, float t1)
{
  vec3 inverse = 1.0 / view.direction;
  ivec3 forward = ivec3(ray.positive);
  ivec3 last = ivec3(int(u_atlas.w) - 1);
  ivec3 voxel = clamp(ivec3(floor(LocalPosition(view, t0))), ivec3(0), last);
  float t = t0;
  for (int i = 0; i < 16384; ++i)
  {
    if (t >= t1 || state.transmittance <= u_step.z)
    {
      break;
    }
    precise vec3 exits = (vec3(voxel + forward) - view.base) * inverse;
    float next = min(Minimum(exits), t1);
    if (next > t)
    {
      TakeVoxel(state, ray, view, level, voxel, t, next);
      t = next;
    }
    state.steps += 1u;
    bvec3 passed = lessThanEqual(exits, vec3(t));
    if (!any(passed))
    {
      break; // the end of the interval lies inside this voxel
    }
    voxel = clamp(voxel + (forward * 2 - 1) * ivec3(passed), ivec3(-1), last + 1);
    if (any(lessThan(voxel, ivec3(0))) || any(greaterThan(voxel, last)))
    {
      break;
    }
  }
}
