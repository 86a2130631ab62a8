// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// What a pass leaves of a ray to the next, and tells of it.

// A ray that isn't done: it waits for a brick, or the pass was too short.
void ReportUnderWay(ivec2 pixel, bool waiting)
{
  b_feedback[waiting ? FEEDBACK_WAITING : FEEDBACK_UNFINISHED] = 1u;
  uvec2 tile = uvec2(pixel) / TILE_SIZE;
  Stamp(u_limits.w + tile.x + u_switches.z * tile.y);
}

// `word`: level, interval and status.
void StoreRay(State state, ivec2 pixel, uvec3 brick, int word)
{
  ReportCounts(state);
#if TERAVOX_COUNT
  if (u_switches.y != 0u)
  {
    float before = imageLoad(u_errorState, pixel).x;
    imageStore(u_errorState, pixel, vec4(before + float(state.samples)));
  }
#endif
#if TERAVOX_BLEND && TERAVOX_COMPONENTS
  vec4 kept = StoreProjection(pixel);
#elif TERAVOX_BLEND
  vec4 kept = vec4(StoreProjection(state.color), state.transmittance);
  word |= (g_side + 1) << 20;
#else
  vec4 kept = vec4(state.color, state.transmittance);
#endif
  imageStore(u_colorState, pixel, kept);
#if TERAVOX_ESTIMATE
  imageStore(u_errorState, pixel, vec4(state.error));
#endif
  imageStore(u_positionState, pixel, ivec4(ivec3(brick), word));
}
