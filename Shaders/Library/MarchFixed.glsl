// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Steps of a given length: samples at its multiples of depth and at brick faces, linear in
// between. What a user who switches error control off gets, and what the order of convergence is
// measured with.
#if TERAVOX_COMPONENTS
#include "Library/ComponentSteps.glsl"
#else
Sample SampleAt(BrickView view, float t)
{
  precise vec3 q = LocalPosition(view, t) - 0.5;
  vec3 cell = clamp(floor(q), 0.0, float(u_atlas.w) - 2.0);
  precise vec3 w = q - cell;
  float texel = CubicAlong(FetchCorners(view, ivec3(cell)), w, vec3(0.0)).x;
  Sample s = SampleTransfer(NodeOf(view, texel));
#if TERAVOX_FLOAT_DATA
  s.s = isnan(texel) ? -1.0 : s.s; // no value
#endif
  return s;
}

#if TERAVOX_SHADE || TERAVOX_GRADIENT_OPACITY || TERAVOX_PLANE
// In data per voxel of level 0.
vec3 GradientAt(BrickView view, int level, float t)
{
  precise vec3 q = LocalPosition(view, t) - 0.5;
  vec3 cell = clamp(floor(q), 1.0, float(u_atlas.w) - 3.0);
  precise vec3 w = q - cell;
  Corners corners = FetchCorners(view, ivec3(cell));
  Gradient gradient = GradientAlong(view, ivec3(cell), corners, w, vec3(0.0));
  return Along(gradient, 0.0) * (view.scale / vec3(u_levelFactor[level].xyz));
}
#endif

void IntegrateBrick(inout State state, Ray ray, BrickView view, int level, float t0, float t1)
{
  float step_ = u_step.x / ray.world;
  float t = t0;
  Sample a = SampleAt(view, t0);
  COUNT(samples, true);
  for (int i = 0; i < 16384; ++i)
  {
    if (t >= t1 || state.transmittance <= u_step.z)
    {
      break;
    }
    // t is often a multiple itself, and t / step may be rounded to just below it.
    precise float cut = floor(t / step_);
    precise float next = (cut + 1.0) * step_;
    next = next > t ? next : (cut + 2.0) * step_;
    next = next > t ? min(next, t1) : t1;
    Sample b = SampleAt(view, next);
    precise float mean = MeanExtinction(a, b);
    float sA = a.s;
    float sB = b.s;
#if TERAVOX_GRADIENT_OPACITY
    if (mean > 0.0)
    {
      COUNT(gradients, true);
      float before = SampleGradient(MainGradients(), GradientAt(view, level, t)).opacity;
      float behind = SampleGradient(MainGradients(), GradientAt(view, level, next)).opacity;
      // What the ends say of both together, and for the rest of the extinction the mean opacity.
      precise float unseen = mean - 0.5 * (sA + sB);
      sA *= before;
      sB *= behind;
      mean = max(0.5 * (sA + sB) + unseen * (0.5 * (before + behind)), 0.0);
    }
#endif
    vec3 colorA = TransferColor(a.x);
    vec3 colorB = TransferColor(b.x);
#if TERAVOX_PLANE
    if (mean > 0.0)
    {
      COUNT(gradients, true);
      PlaneSample before = SamplePlane(a.x, RowOf(GradientAt(view, level, t) * u_gradient.xyz));
      PlaneSample behind = SamplePlane(b.x, RowOf(GradientAt(view, level, next) * u_gradient.xyz));
      sA = before.s;
      sB = behind.s;
      mean = 0.5 * (sA + sB);
      colorA = before.color;
      colorB = behind.color;
    }
#endif
    precise float depth = mean * ((next - t) * ray.world);
#if TERAVOX_FLOAT_DATA
    depth = a.s < 0.0 || b.s < 0.0 ? 0.0 : depth;
#endif
    float opacity = OpacityOf(depth);
    float gathered = CentroidOf(sA, sB, depth);
    vec3 color = mix(colorA, colorB, gathered);
#if TERAVOX_SHADE
    if (depth > 0.0)
    {
      float at = mix(t, next, gathered);
      color = LitColor(color, Shade(GradientAt(view, level, at), state.light, at));
      COUNT(gradients, true);
    }
#endif
    Accumulate(state, opacity, color);
    state.steps += 1u;
    COUNT(samples, true);
    COUNT(evaluated, true);
    COUNT(contributing, depth > 0.0);
    t = next;
    a = b;
  }
}
#endif
