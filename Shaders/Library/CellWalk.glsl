// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// From one visible interpolation cell of a brick to the next.

// Cells of voxel corners: cell c lies between the centres of the voxels c and c + 1 of the brick.
struct CellWalk
{
  vec3 first;   // position between voxel centres at depth 0, in cells
  vec3 inverse; // depth per cell
  vec3 forward; // 1 where the ray goes up, else 0
  vec3 move;    // 1 or -1
  vec3 cell;    // where the walk is, ...
  float t;      // ... at this depth; the cell begins here
  float end;    // depth
  float runEnd; // up to here cells are looked at one by one
};

vec3 CellAt(CellWalk walk, vec3 direction, float t)
{
  precise vec3 q = walk.first + t * direction;
  vec3 cell = floor(q);
  // Faces decide, as they do when the walk steps over them.
  precise vec3 exits = (cell + walk.forward - walk.first) * walk.inverse;
  precise vec3 entries = (cell + (1.0 - walk.forward) - walk.first) * walk.inverse;
  return cell +
    walk.move * (vec3(lessThanEqual(exits, vec3(t))) - vec3(greaterThan(entries, vec3(t))));
}

float LargestOf(vec3 v)
{
  return max(v.x, max(v.y, v.z));
}

float LargestOf(vec4 v)
{
  return max(max(v.x, v.y), max(v.z, v.w));
}

float SmallestOf(vec4 v)
{
  return min(min(v.x, v.y), min(v.z, v.w));
}

// An interpolation cell that the ray crosses from `begin` to the walk's depth.
struct VisitedCell
{
  bool visible;
  vec3 cell;
  float begin;
#if TERAVOX_COMPONENTS
  Corners corners[TERAVOX_COMPONENTS];
#else
  Corners corners;
#endif
};

#if TERAVOX_COMPONENTS
// Fetches the corners of a cell's components, and tells whether one of them may be seen.
bool FetchComponents(BrickView view, bool skip, inout VisitedCell cell)
{
  bool all_ = true;
  for (int c = 0; c < TERAVOX_COMPONENTS; ++c)
  {
    cell.corners[c] = FetchCorners(PartOf(view, c), ivec3(cell.cell));
#if TERAVOX_FLOAT_DATA && TERAVOX_DEPENDENT
    all_ = all_ && HasValues(cell.corners[c]);
#endif
  }
  bool seen = false;
  for (int e = 0; e < EMITTERS; ++e)
  {
    int c = FIRST_EMITTER + e;
    Corners k = cell.corners[c];
    float least = min(SmallestOf(k.near), SmallestOf(k.far));
    float largest = max(LargestOf(k.near), LargestOf(k.far));
    float from = PartNode(view, c, least);
    float to = PartNode(view, c, largest);
#if TERAVOX_BLEND
    bool visible = !(skip && SkipsPart(c, false, from, to));
#else
    bool visible = !(skip && IsPartEmpty(c, from, to));
#endif
#if TERAVOX_FLOAT_DATA
    visible = visible && HasValues(k);
#endif
    seen = seen || visible;
  }
  return seen && all_;
}
#endif

CellWalk BeginWalk(Ray ray, BrickView view, float t0, float t1)
{
  CellWalk walk;
  walk.first = view.base - 0.5;
  walk.inverse = 1.0 / view.direction;
  walk.forward = vec3(ray.positive);
  walk.move = walk.forward * 2.0 - 1.0;
  walk.t = t0;
  walk.end = t1;
  walk.runEnd = t0;
  walk.cell = CellAt(walk, view.direction, t0);
  return walk;
}

// The next cell that is visible; none if the walk has come to its end. Loops are nested so that
// what is done for visible cells is outside: drivers on the CPU execute what any ray of a group
// needs.
VisitedCell NextVisibleCell(inout CellWalk walk, inout State state, BrickView view)
{
  float lastRange = float(CellsAlong() - 1);
  bool skip = u_switches.x != 0u;
  VisitedCell found;
  found.visible = false;
  found.cell = walk.cell;
  found.begin = walk.t;
#if TERAVOX_COMPONENTS
  for (int c = 0; c < TERAVOX_COMPONENTS; ++c)
  {
    found.corners[c] = Corners(vec4(0.0), vec4(0.0));
  }
#else
  found.corners = Corners(vec4(0.0), vec4(0.0));
#endif
  for (int search = 0; search < 8192; ++search)
  {
    if (walk.t >= walk.end)
    {
      break;
    }
    for (int i = 0; i < 256; ++i)
    {
      if (found.visible || walk.t >= walk.end)
      {
        break;
      }
      found.cell = walk.cell;
      found.begin = walk.t;
#if !TERAVOX_COMPONENTS
      found.corners = FetchCorners(view, ivec3(found.cell));
#endif
      precise vec3 exits = (found.cell + walk.forward - walk.first) * walk.inverse;
      float leave = Minimum(exits);
      walk.t = min(max(leave, found.begin), walk.end);
      walk.cell = found.cell + walk.move * vec3(lessThanEqual(exits, vec3(leave)));
#if TERAVOX_COMPONENTS
      found.visible = FetchComponents(view, skip, found);
#else
      float least = min(SmallestOf(found.corners.near), SmallestOf(found.corners.far));
      float largest = max(LargestOf(found.corners.near), LargestOf(found.corners.far));
#endif
#if TERAVOX_BLEND && TERAVOX_COMPONENTS
      found.visible = found.visible && walk.t > found.begin;
#elif TERAVOX_BLEND
      // Cells without length don't count: leaps pass them by.
      bool none = false;
#if TERAVOX_FLOAT_DATA
      none = isnan(dot(found.corners.near + found.corners.far, vec4(1.0)));
#endif
      bool crossed = walk.t > found.begin;
      found.visible = crossed && !none;
      if (crossed && (none || skip))
      {
        found.visible = !SkipsRange(none, NodeOf(view, least), NodeOf(view, largest));
      }
#elif !TERAVOX_COMPONENTS
      found.visible = !(skip && IsEmptyBetween(NodeOf(view, least), NodeOf(view, largest)));
#endif
#if TERAVOX_FLOAT_DATA && !TERAVOX_BLEND && !TERAVOX_COMPONENTS
      // One voxel without a value, and there is none in between.
      found.visible =
        found.visible && !isnan(dot(found.corners.near + found.corners.far, vec4(1.0)));
#endif
      state.steps += 1u;
      COUNT(samples, true);
      if (found.visible || walk.t >= walk.runEnd || walk.t >= walk.end)
      {
        break;
      }
    }
    if (found.visible || walk.t >= walk.end)
    {
      break;
    }
    // Leap over cells of CELL_EDGE^3 whose range is invisible.
    for (int i = 0; i < 256; ++i)
    {
      if (walk.t < walk.runEnd || walk.t >= walk.end)
      {
        break;
      }
      vec3 at = clamp(floor((walk.cell - BORDER) * (1.0 / float(CELL_EDGE))), 0.0, lastRange);
#if TERAVOX_BLEND && TERAVOX_COMPONENTS
      bool empty = skip && SkipsCellRange(view, ivec3(at));
#elif TERAVOX_COMPONENTS
      bool empty = skip && IsCellRangeEmpty(view, ivec3(at));
#else
      vec2 range = CellRange(view, ivec3(at));
#endif
#if TERAVOX_MASK
      SelectTablesOf(view, ivec3(at));
#endif
#if TERAVOX_BLEND && !TERAVOX_COMPONENTS
      bool empty = false;
#elif !TERAVOX_COMPONENTS
      bool empty =
        skip && (range.x > range.y || IsEmptyBetween(NodeOf(view, range.x), NodeOf(view, range.y)));
#endif
#if TERAVOX_MASK
      SelectTables(0);
#endif
      vec3 low = at * float(CELL_EDGE) + BORDER;
      // The first cell begins half a voxel before the brick.
      vec3 face = mix(low - vec3(equal(at, vec3(0.0))), low + float(CELL_EDGE), walk.forward);
      precise vec3 exits = (face - walk.first) * walk.inverse;
      float leave = max(Minimum(exits), walk.t);
#if TERAVOX_BLEND && TERAVOX_COMPONENTS
      empty = empty || (skip && !(leave > walk.t));
#elif TERAVOX_BLEND
      if (skip)
      {
        empty = !(leave > walk.t) ||
          SkipsRange(range.x > range.y, NodeOf(view, range.x), NodeOf(view, range.y));
      }
#endif
      vec3 next = CellAt(walk, view.direction, leave);
      vec3 beyond = face - (1.0 - walk.forward);
      next = mix(next, beyond, vec3(lessThanEqual(exits, vec3(leave))));
      walk.runEnd = empty ? walk.runEnd : leave;
      walk.cell = empty ? next : walk.cell;
      walk.t = empty ? leave : walk.t;
      if (!empty || walk.t >= walk.end)
      {
        break;
      }
    }
  }
  return found;
}
