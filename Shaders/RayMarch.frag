// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// One pass of one ray: brick after brick, front to back, until the ray ends, a brick is missing or the
// pass has been long enough. What a pass hands to the next is colour, transmittance, the integer
// position and the interval; everything else is computed again (contract 1b).
#include "Shared/Layout.glsl"
#include "Variant.glsl"
#include "Library/Bindings.glsl"
#include "Library/Ray.glsl"
#include "Library/Transfer.glsl"
#include "Library/Atlas.glsl"
#include "Library/PageWalk.glsl"
#include "Library/Shade.glsl"
#include "Library/Segments.glsl"
#if TERAVOX_NEAREST
#include "Library/MarchNearest.glsl"
#else
#include "Library/MarchLinear.glsl"
#endif

const int STATUS_NEW = 0;
const int STATUS_RUNNING = 1;
const int STATUS_DONE = 2;

// The finest ancestor that can be drawn instead: resident (interactive), or readable (a failed brick:
// requested and waited for). Returns false if the ray has to wait.
bool FindAncestor(inout Found found, int level, uvec3 brick, float weight, out int drawnLevel,
  out uvec3 drawnBrick)
{
  bool failed = found.kind == FOUND_FAILED;
  drawnLevel = level;
  drawnBrick = brick;
  uvec3 fine = brick * u_levelFactor[level].xyz;
  bool wait = false;
  bool reached = false;
  for (int l = level + 1; l < int(u_levels.x); ++l)
  {
    if (wait || reached)
    {
      break;
    }
    uvec3 coarse = fine / u_levelFactor[l].xyz;
    Found at = Translate(l, coarse);
    if (at.kind == FOUND_MAPPED || at.kind == FOUND_SINGLE || at.kind == FOUND_EMPTY)
    {
      found = at;
      found.region = 0;
      drawnLevel = l;
      drawnBrick = coarse;
      reached = true;
    }
    else if (failed && at.kind == FOUND_MISSING)
    {
      Request(l, coarse, weight);
      wait = true;
    }
  }
  if (!wait)
  {
    b_feedback[FEEDBACK_FALLBACK] = 1u;
    if (!reached)
    {
      found.kind = FOUND_EMPTY;
      found.region = 0;
    }
  }
  return !wait;
}

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  ivec4 position = imageLoad(u_positionState, pixel);
  int status = (position.w >> 16) & 3;
  if (status == STATUS_DONE)
  {
    return;
  }
  vec4 intervals = texelFetch(u_intervals, pixel, 0);
  vec4 accumulated = imageLoad(u_colorState, pixel);
  Ray ray = MakeRay(gl_FragCoord.xy);

  State state;
  state.color = accumulated.rgb;
  state.transmittance = accumulated.a;
  state.towardsLight = vec3(0.0, 0.0, 1.0);
#if TERAVOX_SHADE
  state.towardsLight = TowardsLight(ray, intervals.x);
#endif
  state.steps = 0u;
  state.samples = 0u;
  state.contributing = 0u;
  int interval = (position.w >> 8) & 255;
  int level = position.w & 255;
  uvec3 brick = uvec3(position.xyz);
  bool enter = status == STATUS_NEW;
  status = STATUS_RUNNING;
  bool waiting = false;

  // A brick without a sample costs about as much as 16 steps, and llvmpipe counts all iterations.
  for (int i = 0; i < 1024; ++i)
  {
    if (status == STATUS_DONE || waiting || state.steps >= u_limits.x)
    {
      break;
    }
    float begin = interval == 0 ? intervals.x : intervals.z;
    float end = interval == 0 ? intervals.y : intervals.w;
    if (enter)
    {
      if (!(begin < end))
      {
        interval += 1;
        status = interval > 1 ? STATUS_DONE : status;
        continue;
      }
      level = LevelAt(begin);
      brick = BrickAt(ray, level, begin);
      enter = false;
    }
    vec3 exits = ExitDepths(ray, level, brick);
    float levelEnd = LevelEnd(level);
    float levelBegin = level > int(u_levels.y) ? u_levelStart[level].x : begin;
    float t0 = max(max(Maximum(EntryDepths(ray, level, brick)), levelBegin), begin);
    float brickEnd = min(Minimum(exits), levelEnd);
    float t1 = min(brickEnd, end);
    float leave = brickEnd; // depth at which the next brick begins
    state.steps += 16u;

    Found found = Translate(level, brick);
    int drawnLevel = level;
    uvec3 drawnBrick = brick;
#if TERAVOX_INTERACTIVE
    if (found.kind == FOUND_MISSING)
    {
      Request(level, brick, state.transmittance);
    }
    bool substitute = found.kind == FOUND_FAILED || found.kind == FOUND_MISSING;
#else
    bool substitute = found.kind == FOUND_FAILED;
    if (found.kind == FOUND_MISSING)
    {
      Request(level, brick, state.transmittance);
      waiting = true;
    }
#endif
#if TERAVOX_INTERACTIVE || TERAVOX_SUBSTITUTE
    if (substitute)
    {
      waiting =
        !FindAncestor(found, level, brick, state.transmittance, drawnLevel, drawnBrick);
    }
#endif
    if (waiting)
    {
      break;
    }
#if TERAVOX_SHOW_LEVEL
    float before = state.transmittance;
#endif
    if (found.kind == FOUND_MAPPED)
    {
      BrickView view = ViewBrick(ray, drawnLevel, drawnBrick, found.slot);
      IntegrateBrick(state, ray, view, drawnLevel, t0, t1);
    }
    else if (found.kind == FOUND_SINGLE)
    {
      IntegrateConstant(state, ray, TransferPosition(found.low, found.high), t0, t1);
    }
    else if (found.region > 0)
    {
      // The exit of the whole empty region.
      uint shift = PAGE_SHIFT * uint(found.region);
      uvec3 first = (brick >> shift) << shift;
      uvec3 face = min(first + (ray.positive << shift), u_levelBricks[level].xyz);
      exits = FaceDepths(ray, level, face);
      leave = min(Minimum(exits), levelEnd);
    }
#if TERAVOX_SHOW_LEVEL
    if (state.transmittance < before)
    {
      state.color = vec3(float(level + 1) / float(MAXIMUM_LEVELS));
      state.transmittance = 0.0;
    }
#endif
    if (state.transmittance <= u_step.z)
    {
      status = STATUS_DONE;
    }
    else if (leave >= end)
    {
      interval += 1;
      enter = true;
      status = interval > 1 ? STATUS_DONE : status;
    }
    else if (levelEnd <= leave)
    {
      level = LevelAt(levelEnd);
      brick = BrickAt(ray, level, levelEnd);
    }
    else if (found.region > 0 && found.kind == FOUND_EMPTY)
    {
      uvec3 next = BrickAt(ray, level, leave);
      if (next == brick)
      {
        // Only where the last face of the volume was passed by a rounding error.
        interval += 1;
        enter = true;
        status = interval > 1 ? STATUS_DONE : status;
      }
      brick = next;
    }
    else
    {
      ivec3 move = (ivec3(ray.positive) * 2 - 1) * ivec3(lessThanEqual(exits, vec3(leave)));
      ivec3 next = ivec3(brick) + move;
      if (any(lessThan(next, ivec3(0))) ||
        any(greaterThanEqual(next, ivec3(u_levelBricks[level].xyz))))
      {
        interval += 1;
        enter = true;
        status = interval > 1 ? STATUS_DONE : status;
      }
      else
      {
        brick = uvec3(next);
      }
    }
  }

  if (status != STATUS_DONE)
  {
    b_feedback[waiting ? FEEDBACK_WAITING : FEEDBACK_UNFINISHED] = 1u;
    uvec2 tile = uvec2(pixel) / TILE_SIZE;
    Stamp(u_limits.w + tile.x + u_switches.z * tile.y);
  }
#if TERAVOX_COUNT
  atomicAdd(b_feedback[FEEDBACK_SAMPLES], state.samples);
  atomicAdd(b_feedback[FEEDBACK_CONTRIBUTING], state.contributing);
#endif
  imageStore(u_colorState, pixel, vec4(state.color, state.transmittance));
  imageStore(u_positionState, pixel,
    ivec4(ivec3(brick), level | (interval << 8) | ((enter && status == STATUS_RUNNING ? STATUS_NEW : status) << 16)));
}
