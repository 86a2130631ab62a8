// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// What vtkDualDepthPeelingPass asks of a volume. It puts its own text in the place of the tags: that
// calls castRay() for up to two stretches of each pixel's ray, and makes of their colours what goes
// into the pass's two targets. Drawn twice: to keep the stretches, and to give their colours.
#define texture2D texture

uniform vec2 in_inverseWindowSize;
uniform int u_give;                                // 0: keep the stretches
uniform ivec2 u_has;                               // of the first and second stretch, if there is
uniform vec2 u_window;                             // as in Compose.frag
uniform sampler2D u_first;                         // premultiplied colour, transmittance
uniform sampler2D u_second;                        // likewise

layout(location = 0) out vec4 f_back;
layout(location = 1) out vec4 f_front;
layout(location = 2) out vec4 f_stretches; // window depths: begin, end of the first, of the second

const float g_opacityThreshold = 2.0; // what lies behind is wanted in any case
int g_calls = 0;
bool g_give = false;
vec4 g_stretches = vec4(1.0, 0.0, 1.0, 0.0); // none: the end isn't behind the begin
vec4 g_data[2]; // what the pass makes of it, for its back and its front target

void initializeRayCast()
{
  g_calls = 0;
  g_data[0] = vec4(0.0);
  g_data[1] = vec4(0.0);
}

vec4 castRay(float begin, float end)
{
  ++g_calls;
  bool first = g_calls == 1;
  if (first)
  {
    g_stretches.xy = vec2(begin, end);
  }
  else
  {
    g_stretches.zw = vec2(begin, end);
  }
  if (!g_give || (first ? u_has.x : u_has.y) == 0)
  {
    return vec4(0.0);
  }
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 c = first ? texelFetch(u_first, pixel, 0) : texelFetch(u_second, pixel, 0);
  return vec4(c.rgb * u_window.x + u_window.y * (1.0 - c.a), 1.0 - c.a);
}

//VTK::DepthPeeling::Dec

void Work()
{
//VTK::CallWorker::Impl
}

void main()
{
  initializeRayCast();
  Work();
  f_stretches = g_stretches;
  vec4 before = g_data[1]; // what the front target holds without this volume
  g_give = u_give != 0;
  Work();
  // Blended over the target, which volumes that were drawn earlier have changed already.
  float left = before.a < 1.0 ? (1.0 - g_data[1].a) / (1.0 - before.a) : 1.0;
  f_front = vec4(g_data[1].rgb - left * before.rgb, 1.0 - left);
  f_back = g_data[0];
}
