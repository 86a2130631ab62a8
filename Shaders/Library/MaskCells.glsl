// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// A mask is sampled with nearest neighbour: in a cell between voxels it is constant in each of the
// eight octants, and a ray is cut where it passes from one into another. What lies between is
// integrated as it always is.

// The values of the eight voxels around a cell: (0,0,0), (1,0,0), (0,1,0), (1,1,0), and the same at
// z = 1.
struct MaskCorners
{
  ivec4 near;
  ivec4 far;
};

MaskCorners MaskAround(BrickView view, vec3 cell)
{
  float last = float(CellsAlong() - 1);
  vec3 at = clamp(floor((cell - BORDER) * (1.0 / float(CELL_EDGE))), 0.0, last);
  ivec2 range = MaskRange(view, ivec3(at));
  MaskCorners corners = MaskCorners(ivec4(range.x), ivec4(range.x));
  if (range.x != range.y)
  {
    ivec3 first = ivec3(cell);
    for (int i = 0; i < 4; ++i)
    {
      ivec3 voxel = first + ivec3(i & 1, i >> 1, 0);
      corners.near[i] = MaskAt(view, voxel);
      corners.far[i] = MaskAt(view, voxel + ivec3(0, 0, 1));
    }
  }
  return corners;
}

// IntegrateCell() for the parts of a cell that are drawn, each by its own tables.
void IntegrateMasked(
  inout State state, Ray ray, BrickView view, int level, CellWalk walk, VisitedCell visited)
{
  MaskCorners mask = MaskAround(view, visited.cell);
  int one = mask.near.x;
  bool isOne = mask.near == ivec4(one) && mask.far == ivec4(one);
  float end = walk.t;
  precise vec3 middles = (visited.cell + 0.5 - walk.first) * walk.inverse;
  float least = min(middles.x, middles.y);
  float largest = max(middles.x, middles.y);
  vec4 cuts = vec4(min(least, middles.z), max(least, min(largest, middles.z)),
    max(largest, middles.z), end);
  cuts = isOne ? vec4(end) : cuts;
  float from = visited.begin;
  for (int i = 0; i < 4; ++i)
  {
    if (from >= end || (isOne && one == 0) || state.transmittance <= u_step.z)
    {
      break;
    }
    float to = min(max(cuts[i], from), end);
    if (to > from)
    {
      // Behind the middle of an axis lies the upper half, if the ray goes up.
      ivec3 upper = ivec3(
        equal(lessThanEqual(middles, vec3(from)), greaterThan(walk.forward, vec3(0.0))));
      int row = upper.x | upper.y << 1;
      int value = isOne ? one : upper.z > 0 ? mask.far[row] : mask.near[row];
      if (value != 0)
      {
        CellWalk upTo = walk;
        upTo.t = to;
        VisitedCell part = visited;
        part.begin = from;
        SelectTables(value);
        IntegrateCell(state, ray, view, level, upTo, part);
        SelectTables(0);
      }
      from = to;
    }
  }
}
