// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Turns what rays gathered in a blend mode other than composite into premultiplied colour and
// transmittance.
#include "Shared/Layout.glsl"
#include "Variant.glsl"
#include "Library/Bindings.glsl"
#include "Library/Transfer.glsl"

uniform int u_blend;

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 state = texelFetch(u_colorBefore, pixel, 0);
  bool any = state.y != 0.0;
  vec4 color = state; // isosurfaces and slices are colours already
  if (u_blend == BLEND_MAXIMUM || u_blend == BLEND_MINIMUM)
  {
    float node = u_projection.x * state.x;
    float opacity = any ? min(SampleTransfer(node).s, 1.0) : 0.0;
    color = vec4(TransferColor(node) * opacity, 1.0 - opacity);
  }
  else if (u_blend == BLEND_AVERAGE)
  {
    bool seen = any && state.z > 0.0;
    float gray = clamp(state.x / max(state.z, 1.0e-37), 0.0, 1.0);
    color = seen ? vec4(vec3(gray), 0.0) : vec4(0.0, 0.0, 0.0, 1.0);
  }
  else if (u_blend == BLEND_ADDITIVE)
  {
    float gray = clamp(state.x * u_projection.w, 0.0, 1.0);
    color = any ? vec4(vec3(gray), 0.0) : vec4(0.0, 0.0, 0.0, 1.0);
  }
  imageStore(u_colorState, pixel, color);
}
