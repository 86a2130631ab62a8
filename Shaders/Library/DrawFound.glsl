// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// What a brick, or the ancestor that stands in its place, adds to a ray between two depths; and
// where on the way the ray's opacity becomes what is looked for.

void DrawStretch(
  inout State state, Ray ray, Found found, int level, uvec3 brick, float t0, float t1)
{
  if (found.kind == FOUND_MAPPED)
  {
    BrickView view = ViewBrick(ray, level, brick, found.slot);
    IntegrateBrick(state, ray, view, level, t0, t1);
  }
  else if (found.kind == FOUND_SINGLE)
  {
#if TERAVOX_BLEND
    ProjectConstant(state, ray, vec2(found.low, found.high), level, t0, t1);
#else
    IntegrateConstant(state, ray, vec2(found.low, found.high), level, t0, t1);
#endif
  }
}

void DrawFound(
  inout State state, Ray ray, Found found, int level, uvec3 brick, float t0, float t1)
{
#if TERAVOX_CLIPPED_GRADIENT
  // Of up to six places for each plane.
  float from = t0;
  for (int i = 0; i < 6 * int(MAXIMUM_CLIPPED_PLANES) + 1; ++i)
  {
    if (from >= t1 || state.transmittance <= u_step.z)
    {
      break;
    }
    float end = EnterStretch(ray, level, from, t1);
    DrawStretch(state, ray, found, level, brick, from, end);
    from = end;
  }
#else
  DrawStretch(state, ray, found, level, brick, t0, t1);
#endif
}

// What would have come behind the end of a ray that is over is taken to be like what was met: as
// thick in the mean, of the same colour. reached: the depth, at the middle of the last brick. A ray
// that is over has met something.
void TakeRest(inout State state, float reached, float first, float last)
{
#if !TERAVOX_BLEND
  const float longest = 16.0; // times what was passed: then all is taken
  float left = state.transmittance;
  if (left > u_step.z || left <= 0.0)
  {
    return;
  }
  float passed = max(reached - first, 1.0e-30);
  float share = 1.0 - pow(left, clamp((last - reached) / passed, 0.0, longest));
  vec3 mean = state.color / (1.0 - left);
#if TERAVOX_ESTIMATE
  // Nothing more might have come, or as much light as there can be.
  state.error += left * max(share, 1.0 - share * min(mean.r, min(mean.g, mean.b)));
#endif
  state.color += (share * left) * mean;
  state.transmittance -= share * left;
#endif
}

#if TERAVOX_FIRST_HIT
// Halves of a brick's part of a ray: of a part of 100 voxels about a ten-thousandth of a voxel.
const int HIT_HALVINGS = 20;

// The whole first: it alone makes the picture. Then, if the ray's opacity has become large enough
// in it, half after half of what is left; each begins with what was gathered up to there, so that
// all of them together are as long as the whole.
void DrawAndSearch(
  inout State state, Ray ray, Found found, int level, uvec3 brick, float t0, float t1)
{
  State before = state;
  float low = t0;
  float high = t1;
  bool searching = state.transmittance > u_value.w;
  uint searched = 0u; // steps
#if TERAVOX_BLEND
  int sideBefore = g_side;
  int sideAfter = g_side;
#endif
  for (int i = 0; i <= HIT_HALVINGS; ++i)
  {
    if (i > 0 && !searching)
    {
      break;
    }
    float end = i == 0 ? t1 : low + 0.5 * (high - low);
    State tried = before;
#if TERAVOX_BLEND
    g_side = sideBefore;
#endif
    DrawFound(tried, ray, found, level, brick, low, end);
    searched += i == 0 ? 0u : tried.steps - before.steps;
    bool met = tried.transmittance <= u_value.w;
    if (i == 0)
    {
      state = tried;
      searching = searching && met;
#if TERAVOX_BLEND
      sideAfter = g_side;
#endif
    }
    else
    {
      high = met ? end : high;
      low = met ? low : end;
      if (!met)
      {
        before = tried;
#if TERAVOX_BLEND
        sideBefore = g_side;
#endif
      }
    }
  }
#if TERAVOX_BLEND
  g_side = sideAfter;
#endif
  state.steps += searched;
  if (searching)
  {
    imageStore(u_firstHit, ivec2(gl_FragCoord.xy), vec4(high, float(level), 0.0, 0.0));
  }
}
#endif
