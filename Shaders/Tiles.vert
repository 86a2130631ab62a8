// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// One quad per tile of the picture in which a ray is still under way.
#include "Shared/Layout.glsl"

layout(location = 0) in uvec2 a_tile; // per instance
uniform vec2 u_pictureSize;           // pixels

void main()
{
  vec2 corner = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1));
  vec2 pixel = min((vec2(a_tile) + corner) * float(TILE_SIZE), u_pictureSize);
  gl_Position = vec4(2.0 * pixel / u_pictureSize - 1.0, 0.0, 1.0);
}
