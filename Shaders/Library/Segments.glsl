// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// What a ray has gathered. Front to back: color is premultiplied, transmittance what is left.

struct State
{
  vec3 color;
  float transmittance;
#if TERAVOX_SHADE
  RayLight light;
#endif
  uint steps; // of this pass
#if TERAVOX_COUNT
  uint samples; // see FEEDBACK_SAMPLES
  uint evaluated;
  uint contributing;
  uint gradients;
  uint visits;
#endif
#if TERAVOX_ESTIMATE
  float error; // estimate of what the colour may be off
#endif
};

// Counts only in variants that do; the others have nothing of it.
#if TERAVOX_COUNT
#define COUNT(counter, condition) state.counter += (condition) ? 1u : 0u
#else
#define COUNT(counter, condition)
#endif

State NewState(vec4 accumulated)
{
  State state;
  state.color = accumulated.rgb;
  state.transmittance = accumulated.a;
  state.steps = 0u;
#if TERAVOX_COUNT
  state.samples = 0u;
  state.evaluated = 0u;
  state.contributing = 0u;
  state.gradients = 0u;
  state.visits = 0u;
#endif
  return state;
}

void ReportCounts(State state)
{
#if TERAVOX_COUNT
  atomicAdd(b_feedback[FEEDBACK_SAMPLES], state.samples);
  atomicAdd(b_feedback[FEEDBACK_EVALUATED], state.evaluated);
  atomicAdd(b_feedback[FEEDBACK_CONTRIBUTING], state.contributing);
  atomicAdd(b_feedback[FEEDBACK_GRADIENTS], state.gradients);
  atomicAdd(b_feedback[FEEDBACK_VISITS], state.visits);
#endif
}

void Accumulate(inout State state, float opacity, vec3 litColor)
{
  precise vec3 color = state.color + (state.transmittance * opacity) * litColor;
  precise float transmittance = state.transmittance * (1.0 - opacity);
  state.color = color;
  state.transmittance = transmittance;
}

#if TERAVOX_ESTIMATE
// What drawing an ancestor, or nothing, in the place of a brick may cost: all that the transfer
// function allows. The light that it adds lies between none and the most, whatever was drawn; what
// lies behind is seen through another transmittance than it should.
float SubstituteError(State before, State after, float length_)
{
  float darkest = before.transmittance * exp(-u_lightSpecular.w * length_);
  vec3 drawn = after.color - before.color;
#if TERAVOX_COMPONENTS
  float brightest = LargestLight();
#else
  float brightest = 1.0;
#endif
  float light =
    max(max(drawn.r, max(drawn.g, drawn.b)), brightest * (before.transmittance - darkest));
  return light + max(abs(after.transmittance - darkest),
    abs(after.transmittance - before.transmittance));
}
#endif

#if !TERAVOX_COMPONENTS
// One segment of one value, given as a float pair.
void IntegrateConstant(inout State state, Ray ray, vec2 value, int level, float t0, float t1)
{
  float position = TransferPosition(value.x, value.y);
#if TERAVOX_SHADE || TERAVOX_GRADIENT_OPACITY || TERAVOX_PLANE
  vec3 difference = PlainDifference(value, level);
#endif
  Sample s = SampleTransfer(position);
  precise float depth = s.s * (max(t1 - t0, 0.0) * ray.world);
#if TERAVOX_PLANE
  PlaneSample there = SamplePlane(position, RowOf(difference * u_gradient.xyz));
  depth = there.s * (max(t1 - t0, 0.0) * ray.world);
  vec3 color = there.color;
#else
#if TERAVOX_GRADIENT_OPACITY
  depth *= SampleGradient(MainGradients(), difference).opacity;
#endif
  vec3 color = TransferColor(position);
#endif
#if TERAVOX_SHADE
  color = LitColor(color, Shade(difference, state.light, mix(t0, t1, 0.5)));
#endif
  Accumulate(state, OpacityOf(depth), color);
  state.steps += 1u;
  COUNT(samples, true);
  COUNT(evaluated, true);
  COUNT(contributing, depth > 0.0);
}
#endif
// A file is included once: what several ways through a brick need.
#include "Library/PieceRules.glsl"
#include "Library/GradientPieces.glsl"
#include "Library/ComponentPoints.glsl"
#include "Library/ComponentPieces.glsl"
