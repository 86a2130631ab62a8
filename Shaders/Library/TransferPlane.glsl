// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Opacity and colour over the value and the gradient's magnitude, from a table of nodes
// (TransferPlane). The transfer table is an upper bound of its extinction then: what is empty there
// is exactly 0 here.
#if TERAVOX_PLANE

struct PlaneSample
{
  float s; // extinction
  vec3 color;
};

// -ln(1 - opacity), without cancellation.
float DepthOf(float opacity)
{
  float f = opacity / (2.0 - opacity);
  float square = f * f;
  precise float small = f * (2.0 + square * (0.66666667 + square * (0.4 + square * 0.28571429)));
  precise float large = -log(1.0 - opacity);
  return opacity < 0.2 ? small : large;
}

// In columns, of a position in nodes of the transfer table.
float ColumnOf(float position)
{
  precise float column = position * u_plane[0].x + u_plane[0].y;
  return clamp(column, 0.0, u_plane[0].z);
}

// In rows. `gradient`: central difference per axis, in voxels of level 0, in rows. Beside voxels
// without a value there is no gradient.
float RowOf(vec3 gradient)
{
  precise float square =
    (gradient.x * gradient.x + gradient.y * gradient.y) + gradient.z * gradient.z;
#if TERAVOX_FLOAT_DATA
  square = isnan(square) ? 0.0 : square;
#endif
  return min(sqrt(square), 2.0 * u_gradient.w);
}

PlaneSample SamplePlane(float position, float row)
{
  float x = ColumnOf(position);
  float y = min(row, u_gradient.w);
  int i = int(min(x, u_plane[0].z - 1.0));
  int j = int(min(y, u_gradient.w - 1.0));
  precise float u = x - float(i);
  precise float v = y - float(j);
  int columns = int(u_plane[0].z) + 1;
  int first = i + j * columns;
  vec4 a = texelFetch(u_planeTable, first);
  vec4 b = texelFetch(u_planeTable, first + 1);
  vec4 c = texelFetch(u_planeTable, first + columns);
  vec4 d = texelFetch(u_planeTable, first + columns + 1);
  precise vec4 near = a + u * (b - a);
  precise vec4 mixed = near + v * ((c + u * (d - c)) - near);
  float opacity = clamp(mixed.w, 0.0, 1.0); // rounding must leave one
  precise float s = min(DepthOf(opacity) * u_plane[1].x, u_plane[1].y);
  return PlaneSample(opacity < 1.0 ? s : u_plane[1].y, mixed.rgb);
}

// How far the extinction (x) and the colour (y) may move between two columns and two rows,
// from <= to.
vec2 PlaneReach(vec2 columns, vec2 rows)
{
  float wide = max(columns.y - columns.x, 0.0);
  float tall = max(rows.y - rows.x, 0.0);
  // The first level whose blocks are twice as large.
  float most = max(max(wide, tall), 1.0);
  int level = min(((floatBitsToInt(most) - 1) >> 23) - 126, int(u_plane[0].w) - 1);
  ivec2 nodes = ivec2(int(u_plane[0].z), int(u_gradient.w)) + 1;
  int at = nodes.x * nodes.y; // behind the nodes
  for (int l = 0; l < 12; ++l)
  {
    if (l >= level)
    {
      break;
    }
    ivec2 blocks = ((nodes - 2) >> l) + 1;
    at += blocks.x * blocks.y;
  }
  ivec2 first = ivec2(vec2(columns.x, rows.x));
  first = min(first, nodes - 2) >> level;
  vec4 bounds = texelFetch(u_planeTable, at + first.x + first.y * (((nodes.x - 2) >> level) + 1));
  return vec2(
    min(bounds.y * wide + bounds.z * tall, bounds.x), min(bounds.w * (wide + tall), 1.0));
}
#endif
