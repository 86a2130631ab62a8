// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// The integral through one brick. Front to back: color is premultiplied, transmittance what is left.

struct State
{
  vec3 color;
  float transmittance;
  vec3 towardsLight;
  uint steps;        // of this pass
  uint samples;      // taken and contributing, in variants that count
  uint contributing;
};

void Accumulate(inout State state, Piece near, Piece far, Light light)
{
  // near, then far behind it
  precise float pass = exp(-near.depth);
  precise vec3 emission = near.emission + pass * far.emission;
  precise float opacity = 1.0 - pass * exp(-far.depth);
#if TERAVOX_SHADE
  // As VTK, the lit colour is clamped before it is weighted with the opacity.
  vec3 own = opacity > 0.0 ? emission / opacity : vec3(0.0);
  precise vec3 lit = clamp(own * light.diffuse + light.specular, 0.0, 1.0) * opacity;
  precise vec3 color = state.color + state.transmittance * lit;
#else
  precise vec3 color = state.color + state.transmittance * emission;
#endif
  precise float transmittance = state.transmittance * (1.0 - opacity);
  state.color = color;
  state.transmittance = transmittance;
}

// One segment of one value.
void IntegrateConstant(inout State state, Ray ray, float position, float t0, float t1)
{
  Sample s = SampleTransfer(position);
  Piece piece = IntegratePiece(s, s, max(t1 - t0, 0.0) * ray.world);
  Piece nothing;
  nothing.depth = 0.0;
  nothing.emission = vec3(0.0);
  Light light;
  light.diffuse = vec3(1.0);
  light.specular = vec3(0.0);
#if TERAVOX_SHADE
  light = Shade(vec3(0.0), state.towardsLight);
#endif
  Accumulate(state, piece, nothing, light);
  state.steps += 1u;
#if TERAVOX_COUNT
  state.samples += 1u;
  state.contributing += s.s > 0.0 ? 1u : 0u;
#endif
}

Light LightAt(State state, BrickView view, int level, float t)
{
  Light light;
  light.diffuse = vec3(1.0);
  light.specular = vec3(0.0);
#if TERAVOX_SHADE
  vec3 difference = CentralDifference(view, LocalPosition(view, t)) / vec3(u_levelFactor[level].xyz);
  light = Shade(difference, state.towardsLight);
#endif
  return light;
}

#if TERAVOX_NEAREST

// The field is constant in each voxel: one segment per voxel, cut exactly at voxel faces.
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
      Sample s = Classify(view, FetchNearest(view, voxel));
      Piece piece = IntegratePiece(s, s, (next - t) * ray.world);
      Piece nothing;
      nothing.depth = 0.0;
      nothing.emission = vec3(0.0);
      Accumulate(state, piece, nothing, LightAt(state, view, level, 0.5 * (t + next)));
#if TERAVOX_COUNT
      state.samples += 1u;
      state.contributing += piece.depth > 0.0 ? 1u : 0u;
#endif
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

#else

// Steps end at multiples of base * 2^-j from the eye, j chosen by the error of the last attempt: the
// segment as one piece against two. What is kept is the better of the two, the result with two pieces.
void IntegrateBrick(inout State state, Ray ray, BrickView view, int level, float t0, float t1)
{
  float base = u_step.x > 0.0 ? u_step.x / length(view.direction) : -u_step.x / ray.world;
  float refinement = 0.0;
  float t = t0;
  Sample s0 = SampleAt(view, t0);
#if TERAVOX_COUNT
  state.samples += 1u;
#endif
  for (int i = 0; i < 24000; ++i)
  {
    if (t >= t1 || state.transmittance <= u_step.z)
    {
      break;
    }
    precise float h = base * exp2(-refinement);
    // t is often a multiple itself, and t / h may be rounded to just below it.
    precise float cut = floor(t / h);
    precise float next = (cut + 1.0) * h;
    next = next > t ? next : (cut + 2.0) * h;
    next = next > t ? min(next, t1) : t1;
    precise float middle = 0.5 * (t + next);
    Sample sm = SampleAt(view, middle);
    Sample s1 = SampleAt(view, next);
    precise float length_ = (next - t) * ray.world;
    Piece near = IntegratePiece(s0, sm, 0.5 * length_);
    Piece far = IntegratePiece(sm, s1, 0.5 * length_);
    Piece whole = IntegratePiece(s0, s1, length_);
    float pass = exp(-near.depth);
    vec3 emission = near.emission + pass * far.emission;
    vec3 difference = abs(emission - whole.emission);
    float opacity = abs(pass * exp(-far.depth) - exp(-whole.depth));
    float error = state.transmittance * max(max(difference.x, difference.y), max(difference.z, opacity));
    state.steps += 1u;
#if TERAVOX_COUNT
    state.samples += 2u;
    state.contributing += near.depth + far.depth > 0.0 ? 2u : 0u;
#endif
    if (error > u_step.y && refinement < u_step.w)
    {
      // The error falls with the square of the step.
      float more = error > 16.0 * u_step.y ? 2.0 : 1.0;
      refinement = min(refinement + more, u_step.w);
    }
    else
    {
      Accumulate(state, near, far, LightAt(state, view, level, middle));
      t = next;
      s0 = s1;
      refinement = error < 0.0625 * u_step.y ? max(refinement - 1.0, 0.0) : refinement;
    }
  }
}

#endif
