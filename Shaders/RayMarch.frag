// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// One pass of one ray: brick after brick, front to back, until the ray ends, a brick is missing or
// the pass was long enough. All that it doesn't hand to the next is computed again (contract 1b).
#include "Shared/Layout.glsl"
#include "Variant.glsl"
#include "Library/Bindings.glsl"
#include "Library/Ray.glsl"
#include "Library/Cut.glsl"
#include "Library/Transfer.glsl"
#include "Library/Atlas.glsl"
#include "Library/Shade.glsl"
#include "Library/GradientOpacity.glsl"
#include "Library/TransferPlane.glsl"
#include "Library/Segments.glsl"
#if TERAVOX_BLEND
#include "Library/Projection.glsl"
#endif
#include "Library/PageWalk.glsl"
#include "Library/Ancestor.glsl"
// What several of those below need: a file is included once.
#if !TERAVOX_NEAREST && !TERAVOX_FIXED_STEP
#include "Library/CellWalk.glsl"
#endif
#include "Library/Surfaces.glsl"
#include "Library/Sums.glsl"
#if TERAVOX_BLEND
#include "Library/ProjectValue.glsl"
#include "Library/ProjectComponents.glsl"
#endif
#if TERAVOX_NEAREST
#include "Library/MarchNearest.glsl"
#elif TERAVOX_FIXED_STEP
#include "Library/MarchFixed.glsl"
#else
#include "Library/MarchLinear.glsl"
#endif
#include "Library/DrawFound.glsl"
#include "Library/StoreRay.glsl"
const int STATUS_NEW = 0;
const int STATUS_RUNNING = 1;
const int STATUS_DONE = 2;
const int STATUS_LOCATE = 3; // at the begin of the level

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  ivec4 position = texelFetch(u_positionBefore, pixel, 0);
  int status = (position.w >> 16) & 3;
  if (status == STATUS_DONE)
  {
    return;
  }
  vec4 intervals = texelFetch(u_intervals, pixel, 0);
  vec4 accumulated = texelFetch(u_colorBefore, pixel, 0);
  Ray ray = MakeRay(gl_FragCoord.xy);

  State state = NewState(accumulated);
#if TERAVOX_SHADE
  state.light = LightOf(ray, intervals.z, gl_FragCoord.xy);
#endif
#if TERAVOX_BLEND && TERAVOX_COMPONENTS
  state.transmittance = LoadProjection(accumulated, pixel, intervals.x < intervals.y);
#elif TERAVOX_BLEND
  LoadProjection(accumulated, position.w, intervals.x < intervals.y);
#endif
#if TERAVOX_ESTIMATE
  state.error = imageLoad(u_errorState, pixel).x;
#endif
  int interval = (position.w >> 8) & 255;
  int level = position.w & 255;
  uvec3 brick = uvec3(position.xyz);
  bool enter = status == STATUS_NEW;              // an interval
  bool locate = enter || status == STATUS_LOCATE; // the brick isn't known
  bool waiting = false;
#if !TERAVOX_INTERACTIVE
  bool missing = false; // the brick that it waits for is `brick`
#endif
  status = STATUS_RUNNING;

  // Span after span: an interval, or what a level has of it.
  for (int span = 0; span < 256; ++span)
  {
    if (status == STATUS_DONE || waiting || state.steps >= u_limits.x)
    {
      break;
    }
    vec2 kept = KeptInterval(ray, intervals.xy, interval);
    float begin = kept.x;
    float end = kept.y;
    level = enter ? LevelAt(begin) : level;
    Level here = LoadLevel(level);
    float last = end;
    begin = max(begin, here.begin);
    end = min(end, here.end);
    brick = locate ? BrickAt(ray, here, begin) : brick;
    bool running = begin < end;
    enter = false;
    locate = false;
    for (int visit = 0; visit < 1024; ++visit)
    {
      if (!running || waiting || state.steps >= u_limits.x)
      {
        break;
      }
      // The next brick that isn't empty. What is done for it is outside this loop: drivers on the
      // CPU execute what any ray of a group needs.
      Found found = Nothing();
      uvec3 current = brick;
      float t0 = begin;
      float t1 = begin;
      bool held = false; // there is one
      for (int i = 0; i < 1024; ++i)
      {
        if (!running)
        {
          break;
        }
        vec3 exits = ExitDepths(ray, here, brick);
        float leave = Minimum(exits); // depth at which the next brick begins
        current = brick;
        t0 = max(Maximum(EntryDepths(ray, here, brick)), begin);
        t1 = min(leave, end);
        found = Translate(here, brick);
        bool empty = found.kind == FOUND_EMPTY;
        bool leap = empty && found.region > 0;
        if (leap)
        {
          // The exit of the whole empty region.
          uint shift = PAGE_SHIFT * uint(found.region);
          uvec3 first = (brick >> shift) << shift;
          uvec3 face = min(first + (ray.positive << shift), here.bricks);
          leave = Minimum(FaceDepths(ray, here, face));
        }
        ivec3 move = (ivec3(ray.positive) * 2 - 1) * ivec3(lessThanEqual(exits, vec3(leave)));
        ivec3 next = leap ? ivec3(BrickAt(ray, here, leave)) : ivec3(brick) + move;
        // The same brick only where a rounding error passed the last face of the volume.
        bool outside = leave < end &&
          (any(lessThan(next, ivec3(0))) || any(greaterThanEqual(next, ivec3(here.bricks))) ||
            next == ivec3(brick));
        // A brick without a sample costs about as much as 16 steps, and llvmpipe counts iterations.
        state.steps += 16u;
        COUNT(visits, true);
        held = !empty;
#if !TERAVOX_INTERACTIVE
        missing = found.kind == FOUND_MISSING;
        waiting = missing;
#endif
        if (waiting)
        {
          break;
        }
        running = leave < end && !outside;
        brick = running ? uvec3(next) : brick;
        // The rest of the interval lies outside, too.
        end = outside ? -3.0e38 : end;
        if (held || !running || state.steps >= u_limits.x)
        {
          break;
        }
      }
      if (held && !waiting)
      {
        int drawnLevel = level;
        uvec3 drawnBrick = current;
#if TERAVOX_ESTIMATE
        State entered = state;
        bool substituted = found.kind == FOUND_FAILED || found.kind == FOUND_MISSING;
#endif
#if TERAVOX_INTERACTIVE || TERAVOX_SUBSTITUTE
#if TERAVOX_INTERACTIVE
        if (found.kind == FOUND_MISSING)
        {
          Request(level, current, state.transmittance);
        }
        bool substitute = found.kind == FOUND_FAILED || found.kind == FOUND_MISSING;
#else
        bool substitute = found.kind == FOUND_FAILED;
#endif
        if (substitute)
        {
          waiting =
            !FindAncestor(found, level, current, state.transmittance, drawnLevel, drawnBrick);
          // It is this brick that the next pass goes on with.
          brick = waiting ? current : brick;
        }
#endif
#if TERAVOX_SHOW_LEVEL
        float before = state.transmittance;
#endif
#if TERAVOX_FIRST_HIT
        DrawAndSearch(state, ray, found, drawnLevel, drawnBrick, t0, t1);
#else
        DrawFound(state, ray, found, drawnLevel, drawnBrick, t0, t1);
#endif
#if TERAVOX_ESTIMATE
        if (substituted && !waiting && t1 > t0)
        {
          state.error = entered.error + SubstituteError(entered, state, (t1 - t0) * ray.world);
        }
#endif
#if TERAVOX_SHOW_LEVEL
        if (state.transmittance < before)
        {
          state.color = vec3(float(level + 1) / float(MAXIMUM_LEVELS));
          state.transmittance = 0.0;
        }
#endif
        TakeRest(state, 0.5 * (t0 + t1), kept.x, last);
        running = running && state.transmittance > u_step.z;
      }
    }
    if (state.transmittance <= u_step.z)
    {
      status = STATUS_DONE;
    }
    else if (!running && !waiting)
    {
      // The next level, if the interval goes on there; else the next interval.
      bool deeper = end == here.end && here.end < last;
      enter = !deeper;
      locate = true;
      interval += deeper ? 0 : 1;
#if TERAVOX_BLEND == BLEND_ISOSURFACE
      g_side = deeper ? g_side : -1; // what lies between two intervals is no surface
#endif
      status = interval >= IntervalCount() ? STATUS_DONE : status;
      level = deeper ? level + 1 : level;
    }
  }

#if !TERAVOX_INTERACTIVE
  if (missing)
  {
    Request(level, brick, state.transmittance);
  }
#endif
  if (status != STATUS_DONE)
  {
    ReportUnderWay(pixel, waiting);
  }
  if (status == STATUS_RUNNING)
  {
    status = enter ? STATUS_NEW : locate ? STATUS_LOCATE : STATUS_RUNNING;
  }
  StoreRay(state, pixel, brick, level | (interval << 8) | (status << 16));
}
