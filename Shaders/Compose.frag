// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// The one blend of the accumulators into VTK's frame buffer: premultiplied colour over background.
layout(binding = 0) uniform sampler2D u_colors; // premultiplied colour, transmittance
uniform ivec2 u_offset; // of the viewport in the frame buffer, in pixels

layout(location = 0) out vec4 f_color;

void main()
{
  vec4 c = texelFetch(u_colors, ivec2(gl_FragCoord.xy) - u_offset, 0);
  if (c.a >= 1.0)
  {
    discard;
  }
  f_color = vec4(c.rgb, 1.0 - c.a);
}
