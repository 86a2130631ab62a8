// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Edges of bricks over the picture.
in vec3 v_color;

layout(location = 0) out vec4 f_color;

void main()
{
  f_color = vec4(v_color, 1.0);
}
