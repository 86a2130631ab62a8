// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// What a ray has gathered. Front to back: color is premultiplied, transmittance what is left.

struct State
{
  vec3 color;
  float transmittance;
#if TERAVOX_SHADE
  vec3 towardsLight;
#endif
  uint steps; // of this pass
#if TERAVOX_COUNT
  uint samples; // see FEEDBACK_SAMPLES
  uint evaluated;
  uint contributing;
  uint gradients;
  uint visits;
#endif
};

// Counts only in variants that do; the others have nothing of it.
#if TERAVOX_COUNT
#define COUNT(counter, condition) state.counter += (condition) ? 1u : 0u
#else
#define COUNT(counter, condition)
#endif

void Accumulate(inout State state, float opacity, vec3 litColor)
{
  precise vec3 color = state.color + (state.transmittance * opacity) * litColor;
  precise float transmittance = state.transmittance * (1.0 - opacity);
  state.color = color;
  state.transmittance = transmittance;
}

// One segment of one value.
void IntegrateConstant(inout State state, Ray ray, float position, float t0, float t1)
{
  Sample s = SampleTransfer(position);
  precise float depth = s.s * (max(t1 - t0, 0.0) * ray.world);
  vec3 color = TransferColor(position);
#if TERAVOX_SHADE
  color = LitColor(color, Shade(vec3(0.0), state.towardsLight));
#endif
  Accumulate(state, OpacityOf(depth), color);
  state.steps += 1u;
  COUNT(samples, true);
  COUNT(evaluated, true);
  COUNT(contributing, depth > 0.0);
}
