// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// How much of the difference of light between the halves of a segment counts as error: the midpoint
// rule errs by about an eighth of what a linear change would add up to.
const float SHADING_WEIGHT = 0.06;

// Steps end at multiples of base * 2^-j from the eye, j chosen by the error of the last attempt: the
// segment as one piece against two; what is kept is the result with two. Cells that the transfer
// function makes invisible are leapt over by whole base steps, which would have added exactly 0.
void IntegrateBrick(inout State state, Ray ray, BrickView view, int level, float t0, float t1)
{
  // Scaled by its largest component: squares of voxels per world unit leave the range of a float.
  vec3 size = abs(view.direction);
  float largest = max(size.x, max(size.y, size.z));
  float perVoxel = largest * length(size / largest);
  float base = u_step.x > 0.0 ? u_step.x / perVoxel : -u_step.x / ray.world;
  float refinement = 0.0;
  float t = t0;
  Sample s0 = SampleAt(view, t0);
  bool known = true; // s0 belongs to t
#if TERAVOX_COUNT
  state.samples += 1u;
#endif
  for (int run = 0; run < 4096; ++run)
  {
    if (t >= t1 || state.transmittance <= u_step.z)
    {
      break;
    }
    // Leap: to the last multiple of the base step inside the run of empty cells.
    float runEnd = t;
    float cellEnd = t1;
    for (int i = 0; i < 256; ++i)
    {
      if (runEnd >= t1 || refinement != 0.0)
      {
        break;
      }
      Cell cell = CellAt(view, ray, runEnd);
      cellEnd = cell.end;
      if (!cell.empty || cell.end <= runEnd)
      {
        break;
      }
      runEnd = cell.end;
    }
    precise float leap = runEnd >= t1 ? t1 : floor(runEnd / base) * base;
    if (leap > t)
    {
      t = leap;
      known = false;
    }
    // At least one step, and not more than a cell, before the next look.
    cellEnd = max(cellEnd, t + base);
    if (!known && t < t1)
    {
      s0 = SampleAt(view, t);
#if TERAVOX_COUNT
      state.samples += 1u;
#endif
    }
    known = true;
    state.steps += 1u;
    for (int i = 0; i < 4096; ++i)
    {
      if (t >= cellEnd || t >= t1 || state.transmittance <= u_step.z)
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
      precise float half_ = 0.5 * (next - t) * ray.world;
      Piece near = IntegratePiece(s0, sm, half_);
      Piece far = IntegratePiece(sm, s1, half_);
      // The same segment as one piece: the integrals of the two parts add up.
      precise float dx = s1.x - s0.x;
      precise float ds = (s1.integralHigh - s0.integralHigh) + (s1.integralLow - s0.integralLow);
      float whole = 2.0 * half_ * (abs(dx) >= 0.015625 ? ds / dx : 0.5 * (s0.s + s1.s));
      float depth = near.depth + far.depth;
      // Between the samples the field may bulge to the side that its second difference tells: by half
      // of it at a kink, which faces of voxel cells are.
      float bend = s0.x - 2.0 * sm.x + s1.x;
      Sample outer = s0;
      if ((sm.x > outer.x) == (bend < 0.0))
      {
        outer = sm;
      }
      if ((s1.x > outer.x) == (bend < 0.0))
      {
        outer = s1;
      }
      float bulge = half_ * ExtinctionBeyond(outer, outer.x - bend);
#if TERAVOX_FLOAT_DATA
      bulge = s0.x < 0.0 || sm.x < 0.0 || s1.x < 0.0 ? 0.0 : bulge;
      whole = s0.x < 0.0 || sm.x < 0.0 || s1.x < 0.0 ? depth : whole;
#endif
      float through = (1.0 - near.opacity) * (1.0 - far.opacity);
      vec3 nearColor = near.color;
      vec3 farColor = far.color;
#if TERAVOX_SHADE
      nearColor = LitColor(near, LightAt(state, view, level, 0.5 * (t + middle)));
      farColor = LitColor(far, LightAt(state, view, level, 0.5 * (middle + next)));
      // Light changes inside the pieces as it does between them.
      vec3 turn = abs(nearColor - farColor);
      float shading = max(turn.x, max(turn.y, turn.z)) * (1.0 - through) * SHADING_WEIGHT;
#else
      float shading = 0.0;
#endif
      vec3 hue = abs(near.color - far.color);
      float order = max(hue.x, max(hue.y, hue.z)) * (1.0 - through) * min(depth, 1.0) * 0.25;
      float error = state.transmittance *
        max(min(abs(depth - whole) + bulge, 1.0) * max(through, 0.1 * (1.0 - through)),
          max(order, shading));
      state.steps += 1u;
#if TERAVOX_COUNT
      state.samples += 2u;
      state.contributing += depth > 0.0 ? 2u : 0u;
#endif
      if (error > u_step.y && refinement < u_step.w)
      {
        // The error falls with the square of the step.
        float more = error > 16.0 * u_step.y ? 2.0 : 1.0;
        refinement = min(refinement + more, u_step.w);
      }
      else
      {
        Accumulate(state, near, nearColor, far, farColor);
        t = next;
        s0 = s1;
        // Nothing is remembered of an invisible base step, so that it can be leapt over.
        bool forget = depth == 0.0 && floor(next / base + 0.5) * base == next;
        refinement = forget ? 0.0
          : error < 0.0625 * u_step.y ? max(refinement - 1.0, 0.0) : refinement;
      }
    }
  }
}
