// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Turns what rays gathered in a blend mode other than composite into premultiplied colour and
// transmittance.
#include "Shared/Layout.glsl"
#include "Variant.glsl"
#include "Library/Bindings.glsl"
#include "Library/Transfer.glsl"

uniform int u_blend;

#if TERAVOX_COMPONENTS
// Of several components, see SetComponentProjection().
vec4 ResolveComponents(vec4 state, ivec2 pixel)
{
  const float nothing = -3.0e38;
#if TERAVOX_DEPENDENT
  // The place where the last one has its extreme.
  const int last = TERAVOX_COMPONENTS - 1;
  bool any = state[last] > nothing;
  vec3 slope_;
#if TERAVOX_COMPONENTS == COMPONENTS_RGBA
  vec3 color = state.rgb;
#else
  vec3 color =
    TableColor(int(u_componentTable[0].x), u_componentTransfer[0].w, any ? state.x : 0.0, slope_);
#endif
  float opacity = any ? min(SampleTable(int(u_componentTable[last].x),
                              u_componentTransfer[last].w, u_projection.x * state[last])
                              .s,
                          1.0)
                      : 0.0;
  return any ? vec4(clamp(color, 0.0, 1.0) * opacity, 1.0 - opacity) : vec4(0.0, 0.0, 0.0, 1.0);
#endif
  bool extreme = u_blend == BLEND_MAXIMUM || u_blend == BLEND_MINIMUM;
  vec4 lengths = vec4(0.0);
  if (u_blend == BLEND_AVERAGE)
  {
    lengths = texelFetch(u_lengthsBefore, pixel, 0);
  }
  vec4 sum = vec4(0.0);
  for (int c = 0; c < TERAVOX_COMPONENTS; ++c)
  {
    float weight = u_componentTable[c].z;
    if (weight > 0.0 && state[c] > nothing)
    {
      int first = int(u_componentTable[c].x);
      float nodes = u_componentTransfer[c].w;
      float node = u_projection.x * state[c];
      if (extreme)
      {
        vec3 slope;
        float share = min(SampleTable(first, nodes, node).s, 1.0) * weight;
        sum += vec4(TableColor(first, nodes, node, slope) * share, share);
      }
      else if (u_blend == BLEND_AVERAGE)
      {
        sum.x += lengths[c] > 0.0 ? state[c] / max(lengths[c], 1.0e-37) * weight : 0.0;
      }
      else
      {
        sum.x += state[c] * u_componentProjection[c].w;
      }
    }
  }
  if (!extreme)
  {
    bool crossed = state.x > nothing;
    sum = crossed ? vec4(vec3(clamp(sum.x, 0.0, 1.0)), 1.0) : vec4(0.0);
  }
  return vec4(sum.rgb, max(1.0 - sum.a, 0.0));
}
#endif

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 state = texelFetch(u_colorBefore, pixel, 0);
  bool any = state.y != 0.0;
#if TERAVOX_COMPONENTS
  imageStore(u_colorState, pixel, ResolveComponents(state, pixel));
  return;
#endif
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
