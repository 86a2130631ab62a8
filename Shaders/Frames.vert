// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Edges of bricks, a debug view: projected already, in double precision.
layout(location = 0) in vec4 a_clip;
layout(location = 1) in vec3 a_color;

out vec3 v_color;

void main()
{
  v_color = a_color;
  gl_Position = a_clip;
}
