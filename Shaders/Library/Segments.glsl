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

// Colour that leaves a piece towards the eye.
vec3 LitColor(Piece piece, Light light)
{
#if TERAVOX_SHADE
  // As VTK, the lit colour is clamped before it is weighted with the opacity.
  return clamp(piece.color * light.diffuse + light.specular, 0.0, 1.0);
#else
  return piece.color;
#endif
}

// The nearer piece, then the farther one behind it, with their lit colours.
void Accumulate(inout State state, Piece near, vec3 nearColor, Piece far, vec3 farColor)
{
  precise float behind = (1.0 - near.opacity) * far.opacity;
  precise vec3 emission = nearColor * near.opacity + farColor * behind;
  precise vec3 color = state.color + state.transmittance * emission;
  precise float transmittance = state.transmittance * ((1.0 - near.opacity) * (1.0 - far.opacity));
  state.color = color;
  state.transmittance = transmittance;
}

Piece NoPiece()
{
  Piece nothing;
  nothing.depth = 0.0;
  nothing.opacity = 0.0;
  nothing.color = vec3(0.0);
  return nothing;
}

// One segment of one value.
void IntegrateConstant(inout State state, Ray ray, float position, float t0, float t1)
{
  Sample s = SampleTransfer(position);
  Piece piece = IntegratePiece(s, s, max(t1 - t0, 0.0) * ray.world);
  Light light;
  light.diffuse = vec3(1.0);
  light.specular = vec3(0.0);
#if TERAVOX_SHADE
  light = Shade(vec3(0.0), state.towardsLight);
#endif
  Accumulate(state, piece, LitColor(piece, light), NoPiece(), vec3(0.0));
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
