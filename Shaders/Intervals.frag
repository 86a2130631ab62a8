// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Where each ray runs: an interval of view depth per pixel, from the box of the volume, the block of
// it that is drawn, the near plane, the clipping planes and the depths of geometry. The marcher only
// reads it.
#include "Shared/Layout.glsl"
#include "Variant.glsl"
#include "Library/Bindings.glsl"
#include "Library/Ray.glsl"

uniform vec3 u_boxLow; // anchored corner coordinates of level 0
uniform vec3 u_boxHigh;
uniform vec3 u_blockLow; // likewise
uniform vec3 u_blockHigh;
uniform vec2 u_nearFar;       // view depths
uniform int u_hasSlice; // positions hold, as floats, the depth at which a ray meets the slice
uniform int u_hasBegin; // and behind it the window depth where rays begin
uniform int u_planeCount;
layout(std430, binding = 3) readonly buffer Planes
{
  vec4 b_planes[]; // two per clipping plane: distance at depth 0 and its change per depth, each at
                   // pixel corner (0, 0), per pixel in x, in y
};
#if TERAVOX_OPAQUE_DEPTH
uniform vec4 u_depthToView; // view depth = (x + y * d) / (z + w * d), d = window depth in 0..1
layout(binding = 0) uniform sampler2D u_depth; // of this viewport only

float ViewDepth(float d)
{
  return (u_depthToView.x + u_depthToView.y * d) / (u_depthToView.z + u_depthToView.w * d);
}
#endif

const float SLICE_REACH = 1.0e-3;   // voxels
const float SLICE_LENGTH = 2.4e-7; // share of its depth

layout(location = 0) out vec4 f_intervals;

void main()
{
  Ray ray = MakeRay(gl_FragCoord.xy);
  vec3 a = (u_boxLow - ray.origin) * ray.inverse;
  vec3 b = (u_boxHigh - ray.origin) * ray.inverse;
  float first = max(Maximum(min(a, b)), u_nearFar.x);
  float last = min(Minimum(max(a, b)), u_nearFar.y);
  // VTK's headlight doesn't know of clipping planes, nor of blocks.
  float lit = first;
  // Faces of a block are met at the depths at which those of bricks are (FaceDepths).
  precise vec3 low = (u_blockLow - ray.origin) * ray.inverse;
  precise vec3 high = (u_blockHigh - ray.origin) * ray.inverse;
  first = max(first, Maximum(min(low, high)));
  last = min(last, Minimum(max(low, high)));
  vec3 place = vec3(1.0, gl_FragCoord.xy);
  for (int i = 0; i < u_planeCount; ++i)
  {
    float from = dot(b_planes[2 * i].xyz, place);
    float slope = dot(b_planes[2 * i + 1].xyz, place);
    float cut = -from / slope;
    first = slope > 0.0 ? max(first, cut) : first;
    last = slope < 0.0 ? min(last, cut) : slope == 0.0 && from < 0.0 ? first : last;
  }
#if TERAVOX_OPAQUE_DEPTH
  float d = texelFetch(u_depth, ivec2(gl_FragCoord.xy), 0).r;
  if (d < 1.0)
  {
    // Nothing is seen of what lies behind something at the near plane.
    last = d > 0.0 ? min(last, ViewDepth(d)) : -3.0e38;
  }
  float from = intBitsToFloat(texelFetch(u_positionBefore, ivec2(gl_FragCoord.xy), 0).g);
  if (u_hasBegin != 0 && from > 0.0)
  {
    first = max(first, ViewDepth(from));
  }
#endif
  if (u_hasSlice != 0)
  {
    // An interval that is as short as floats allow. Faces of the volume count, whatever side of
    // them rounding puts the slice on.
    float at = intBitsToFloat(texelFetch(u_positionBefore, ivec2(gl_FragCoord.xy), 0).r);
    float near = SLICE_REACH / length(ray.direction);
    bool met = first < last && at >= first - near && at <= last + near;
    first = max(min(at, last - abs(last) * SLICE_LENGTH), first);
    last = met ? min(last, first + max(abs(first) * SLICE_LENGTH, 1.0e-30)) : -3.0e38;
  }
  f_intervals = first < last ? vec4(first, last, lit, 0.0) : vec4(0.0);
}
