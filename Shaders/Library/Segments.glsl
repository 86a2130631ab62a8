// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// What a ray has gathered. Front to back: color is premultiplied, transmittance what is left.

struct State
{
  vec3 color;
  float transmittance;
  RayLight light;
  uint steps;   // of this pass
  uint samples; // taken and contributing, in variants that count
  uint contributing;
#if TERAVOX_ESTIMATE
  float error; // estimate of what the colour may be off
#endif
};

void Accumulate(inout State state, float opacity, vec3 litColor)
{
  precise vec3 color = state.color + (state.transmittance * opacity) * litColor;
  precise float transmittance = state.transmittance * (1.0 - opacity);
  state.color = color;
  state.transmittance = transmittance;
}

void Count(inout State state, bool contributes)
{
#if TERAVOX_COUNT
  state.samples += 1u;
  state.contributing += contributes ? 1u : 0u;
#endif
}

#if TERAVOX_ESTIMATE
// What drawing an ancestor, or nothing, in the place of a brick may cost: all that the transfer
// function allows. The light that it adds lies between none and the most, whatever was drawn; what
// lies behind is seen through another transmittance than it should.
float SubstituteError(State before, State after, float length_)
{
  float darkest = before.transmittance * exp(-u_lightSpecular.w * length_);
  vec3 drawn = after.color - before.color;
  float light = max(max(drawn.r, max(drawn.g, drawn.b)), before.transmittance - darkest);
  return light + max(abs(after.transmittance - darkest),
    abs(after.transmittance - before.transmittance));
}
#endif

// One segment of one value.
void IntegrateConstant(inout State state, Ray ray, float position, float t0, float t1)
{
  Sample s = SampleTransfer(position);
  precise float depth = s.s * (max(t1 - t0, 0.0) * ray.world);
  vec3 color = TransferColor(position);
#if TERAVOX_SHADE
  color = LitColor(color, Shade(vec3(0.0), state.light, t0));
#endif
  Accumulate(state, OpacityOf(depth), color);
  state.steps += 1u;
  Count(state, depth > 0.0);
}
