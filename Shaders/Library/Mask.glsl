// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Volumes of which only a part is drawn, by the mask that lies behind the voxels of a slot (Atlas).
// It is sampled with nearest neighbour: in a cell between voxels it is constant in each of the eight
// octants, and a ray is cut where it passes from one into another.

// Whether all voxels are of the cell of CELL_EDGE^3 that a cell lies in, with those that are
// interpolated with them.
bool IsWhollyIn(BrickView view, vec3 cell)
{
  float last = float(CellsAlong() - 1);
  ivec3 at = ivec3(clamp(floor((cell - BORDER) * (1.0 / float(CELL_EDGE))), 0.0, last));
  at.z += CellsAlong();
  return CellRange(view, at).x > 0.0;
}

// IntegrateCell() for the parts of a cell that are in the mask.
void IntegrateMasked(
  inout State state, Ray ray, BrickView view, int level, CellWalk walk, VisitedCell visited)
{
  uint bits = 255u; // of the voxels around it: x + 2 y + 4 z
  if (!IsWhollyIn(view, visited.cell))
  {
    ivec3 first = ivec3(visited.cell);
    bits = 0u;
    for (int i = 0; i < 8; ++i)
    {
      bits |= IsInMask(view, first + ivec3(i & 1, i >> 1 & 1, i >> 2)) ? 1u << uint(i) : 0u;
    }
  }
  float end = walk.t;
  precise vec3 middles = (visited.cell + 0.5 - walk.first) * walk.inverse;
  float least = min(middles.x, middles.y);
  float largest = max(middles.x, middles.y);
  vec4 cuts = vec4(min(least, middles.z), max(least, min(largest, middles.z)),
    max(largest, middles.z), end);
  cuts = bits == 0u || bits == 255u ? vec4(end) : cuts;
  float from = visited.begin;
  for (int i = 0; i < 4; ++i)
  {
    if (from >= end || bits == 0u || state.transmittance <= u_step.z)
    {
      break;
    }
    float to = min(max(cuts[i], from), end);
    if (to > from)
    {
      // Behind the middle of an axis lies the upper half, if the ray goes up.
      uvec3 upper = uvec3(
        equal(lessThanEqual(middles, vec3(from)), greaterThan(walk.forward, vec3(0.0))));
      uint octant = upper.x | upper.y << 1u | upper.z << 2u;
      if ((bits >> octant & 1u) != 0u)
      {
        CellWalk upTo = walk;
        upTo.t = to;
        VisitedCell part = visited;
        part.begin = from;
        IntegrateCell(state, ray, view, level, upTo, part);
      }
      from = to;
    }
  }
}
