// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Start-up probe: is the driver's linear filter exact, and the same at every place in the atlas? The
// texture holds one 4^3 brick at two places; positions are rounded to 2^-12 voxel.
layout(binding = 0) uniform sampler3D u_probe;
uniform vec3 u_scale;   // 1 / texels
uniform vec3 u_placeA;  // first texel of the two copies
uniform vec3 u_placeB;

layout(location = 0) out vec4 f_result; // filtered at A, at B, by eight fetches

uint Hash(uint x)
{
  x = (x ^ 61u) ^ (x >> 16u);
  x *= 9u;
  x = x ^ (x >> 4u);
  x *= 0x27d4eb2du;
  return x ^ (x >> 15u);
}

void main()
{
  uint seed = Hash(uint(gl_FragCoord.x) + 977u * uint(gl_FragCoord.y));
  vec3 p;
  p.x = 0.5 + float(seed % 12289u) * (1.0 / 4096.0);
  seed = Hash(seed);
  p.y = 0.5 + float(seed % 12289u) * (1.0 / 4096.0);
  seed = Hash(seed);
  p.z = 0.5 + float(seed % 12289u) * (1.0 / 4096.0);
  vec3 q = p - 0.5;
  vec3 corner = min(floor(q), vec3(2.0));
  vec3 w = q - corner;
  ivec3 at = ivec3(u_placeA + corner);
  float v = 0.0;
  for (int i = 0; i < 8; ++i)
  {
    ivec3 d = ivec3(i & 1, (i >> 1) & 1, i >> 2);
    vec3 k = mix(1.0 - w, w, vec3(d));
    v += k.x * k.y * k.z * texelFetch(u_probe, at + d, 0).r;
  }
  f_result = vec4(textureLod(u_probe, (u_placeA + p) * u_scale, 0.0).r,
    textureLod(u_probe, (u_placeB + p) * u_scale, 0.0).r, v, 1.0);
}
