// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// The one blend of the accumulators into VTK's frame buffer: premultiplied colour over background.
// Or, where pixels tell which prop they belong to, that of the prop.
layout(binding = 0) uniform sampler2D u_colors; // premultiplied colour, transmittance
uniform ivec2 u_offset; // of the viewport in the frame buffer, in pixels
uniform vec2 u_window;  // final colours: factor, what is added for an opacity of 1
uniform vec4 u_prop;    // rgb: colour of the prop; a: opacity that is needed, 0: none is drawn

layout(location = 0) out vec4 f_color;

void main()
{
  vec4 c = texelFetch(u_colors, ivec2(gl_FragCoord.xy) - u_offset, 0);
  if (c.a >= 1.0 || 1.0 - c.a < u_prop.a)
  {
    discard;
  }
  vec3 color = c.rgb * u_window.x + u_window.y * (1.0 - c.a);
  f_color = u_prop.a > 0.0 ? vec4(u_prop.rgb, 1.0) : vec4(color, 1.0 - c.a);
}
