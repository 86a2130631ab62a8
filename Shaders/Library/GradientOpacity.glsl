// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Opacity by gradient: the extinction times a function of the gradient's magnitude, from a table
// over it (GradientTable).
#if TERAVOX_GRADIENT_OPACITY

// A table. xyz: nodes per central difference along an axis, in data per voxel of level 0; w: its
// first node.
vec4 MainGradients()
{
  return vec4(u_gradient.xyz, float(g_label * (int(u_gradient.w) + 1)));
}

// A gradient, in nodes of the table, and the opacity that it leaves.
struct SampledGradient
{
  vec3 gradient;
  float magnitude; // as far as it matters
  float opacity;
  float slope; // per node
};

// Opacity, how far it has moved, and both at the next node.
vec4 GradientNode(vec4 table, float x, out float fraction)
{
  float within = x > 0.0 ? min(x, u_gradient.w) : 0.0; // of no number 0
  int i = int(min(within, u_gradient.w - 1.0));
  precise float f = within - float(i);
  fraction = f;
  return texelFetch(u_gradientTable, int(table.w) + i);
}

// `gradient`: central difference per axis, in voxels of level 0.
SampledGradient SampleGradient(vec4 table, vec3 gradient)
{
  precise vec3 g = gradient * table.xyz;
  precise float square = (g.x * g.x + g.y * g.y) + g.z * g.z;
#if TERAVOX_FLOAT_DATA
  square = isnan(square) ? 0.0 : square; // beside voxels without a value there is no gradient
#endif
  SampledGradient r;
  r.gradient = g;
  r.magnitude = min(sqrt(square), 2.0 * u_gradient.w);
  float fraction;
  vec4 node = GradientNode(table, r.magnitude, fraction);
  r.slope = r.magnitude < u_gradient.w ? node.z - node.x : 0.0;
  precise float opacity = node.x + fraction * (node.z - node.x);
  r.opacity = opacity;
  return r;
}
#endif
