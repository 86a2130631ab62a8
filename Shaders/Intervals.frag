// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Where each ray runs: up to two intervals of view depth per pixel, from the box of the volume, the
// near plane and the depth of opaque geometry. The marcher only reads them.
#include "Shared/Layout.glsl"
#include "Variant.glsl"
#include "Library/Bindings.glsl"
#include "Library/Ray.glsl"

uniform vec3 u_boxLow; // anchored corner coordinates of level 0
uniform vec3 u_boxHigh;
uniform vec2 u_nearFar;       // view depths
#if TERAVOX_OPAQUE_DEPTH
uniform vec4 u_depthToView;   // view depth = (x + y * d) / (z + w * d), d = window depth in 0..1
layout(binding = 0) uniform sampler2D u_depth; // of this viewport only
#endif

layout(location = 0) out vec4 f_intervals;

void main()
{
  Ray ray = MakeRay(gl_FragCoord.xy);
  vec3 a = (u_boxLow - ray.origin) * ray.inverse;
  vec3 b = (u_boxHigh - ray.origin) * ray.inverse;
  float first = max(Maximum(min(a, b)), u_nearFar.x);
  float last = min(Minimum(max(a, b)), u_nearFar.y);
#if TERAVOX_OPAQUE_DEPTH
  float d = texelFetch(u_depth, ivec2(gl_FragCoord.xy), 0).r;
  if (d < 1.0)
  {
    last = min(last, (u_depthToView.x + u_depthToView.y * d) / (u_depthToView.z + u_depthToView.w * d));
  }
#endif
  f_intervals = first < last ? vec4(first, last, 0.0, 0.0) : vec4(0.0);
}
