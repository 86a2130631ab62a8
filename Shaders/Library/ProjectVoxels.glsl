// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Blend modes other than composite, nearest interpolation: voxel after voxel.

#if TERAVOX_BLEND == BLEND_ISOSURFACE
Place PlaceWith(vec3 gradient, float t)
{
  Place place;
  place.u = 0.0;
#if TERAVOX_SHADE
  place.gradient =
    Gradient(vec4(gradient.x, 0.0, 0.0, 0.0), vec4(gradient.y, 0.0, 0.0, 0.0), vec4(gradient.z, 0.0, 0.0, 0.0));
  place.perVoxel = vec3(1.0);
  place.begin = t;
  place.extent = 0.0;
#endif
  return place;
}
#endif

// A part of the ray with one value. `gradient`: in data per voxel of level 0.
void TakeValue(inout State state, Ray ray, float node, vec3 gradient, float t0, float t1)
{
#if TERAVOX_BLEND == BLEND_MAXIMUM
  TakeExtreme(state, ExtremeOf(node));
#elif TERAVOX_BLEND == BLEND_MINIMUM
  TakeExtreme(state, ExtremeOf(-node));
#elif TERAVOX_BLEND == BLEND_ISOSURFACE
  JumpTo(state, node, PlaceWith(gradient, t0));
#elif TERAVOX_BLEND == BLEND_SLICE
  if (!g_any)
  {
    Accumulate(state, min(SampleTransfer(node).s, 1.0), TransferColor(node));
    g_any = true;
  }
#else
  AddSum(SumBetween(node, node), (t1 - t0) * ray.world);
#endif
}

void ProjectConstant(inout State state, Ray ray, float node, float t0, float t1)
{
  state.steps += 1u;
  if (t1 > t0)
  {
    TakeValue(state, ray, node, vec3(0.0), t0, t1);
  }
}

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
        TakeValue(state, ray, node, gradient, t, next);
      }
      COUNT(samples, true);
      COUNT(contributing, !none);
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
