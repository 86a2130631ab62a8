// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Blend modes other than composite, linear interpolation: from one interpolation cell that may make
// a difference to the next, and what it does.

#if !TERAVOX_COMPONENTS
void IntegrateCell(
  inout State state, Ray ray, BrickView view, int level, CellWalk walk, VisitedCell visited)
{
  precise vec3 w0 = (walk.first + visited.begin * view.direction) - visited.cell;
  precise vec3 dw = (walk.t - visited.begin) * view.direction;
  precise vec4 cubic = CubicAlong(visited.corners, w0, dw) * view.scale;
  cubic.x += view.offset;
  cubic *= u_transfer.z;
#if TERAVOX_BLEND != BLEND_SLICE
  vec2 turns = TurnsOf(cubic);
#endif
#if TERAVOX_BLEND == BLEND_MAXIMUM || TERAVOX_BLEND == BLEND_MINIMUM || TERAVOX_BLEND == BLEND_ISOSURFACE
  // Values lie between the corners', whatever rounding does.
  float least =
    NodeOf(view, min(SmallestOf(visited.corners.near), SmallestOf(visited.corners.far)));
  float largest =
    NodeOf(view, max(LargestOf(visited.corners.near), LargestOf(visited.corners.far)));
#endif
#if TERAVOX_BLEND == BLEND_ISOSURFACE || TERAVOX_BLEND == BLEND_SLICE
  Place place;
  place.u = 0.0;
#if TERAVOX_SHADE
  place.gradient = GradientAlong(view, ivec3(visited.cell), visited.corners, w0, dw);
  place.perVoxel = view.scale / vec3(u_levelFactor[level].xyz);
  place.begin = visited.begin;
  place.extent = walk.t - visited.begin;
#endif
#endif
#if TERAVOX_BLEND == BLEND_MAXIMUM
  float best = max(max(cubic.x, Along(cubic, 1.0)), max(Along(cubic, turns.x), Along(cubic, turns.y)));
  TakeExtreme(state, ExtremeOf(clamp(best, least, largest)));
#elif TERAVOX_BLEND == BLEND_MINIMUM
  float best = min(min(cubic.x, Along(cubic, 1.0)), min(Along(cubic, turns.x), Along(cubic, turns.y)));
  TakeExtreme(state, ExtremeOf(-clamp(best, least, largest)));
#elif TERAVOX_BLEND == BLEND_ISOSURFACE
  CrossCell(state, cubic, least, largest, turns, place);
#elif TERAVOX_BLEND == BLEND_SLICE
  TakeSlice(state, cubic.x, place);
#else
  AddSum(SumCell(state, TheSumRule(), cubic, turns, (walk.t - visited.begin) * ray.world));
#endif
}
#endif
