// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// The integral through one brick, interpolation cell after interpolation cell: between eight voxel
// centres the trilinear field along a ray is a cubic, known exactly from one fetch of the corners
// (Parker et al. 1998, section 4.2 use it for isosurfaces). It is cut where it turns and where a
// linear piece would miss more than the error allows; no ray is cut by what the cache holds. The
// result depends on the cell alone, so that empty cells can be leapt over.

const float SMALLEST_PIECE = 1.0 / 64.0; // of a cell

// Share of the colour's change along a piece that is taken as its error: light is gathered at the
// centroid; ...
const float HUE_WEIGHT = 0.08;
// ... of the change of light, which turns about linearly.
const float LIGHT_WEIGHT = 0.06;

// Cells of voxel corners: cell c lies between the centres of the voxels c and c + 1 of the brick.
struct CellWalk
{
  vec3 first;   // position between voxel centres at depth 0, in cells
  vec3 inverse; // depth per cell
  vec3 forward; // 1 where the ray goes up, else 0
  vec3 move;    // 1 or -1
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

float LargestOf(vec4 v)
{
  return max(max(v.x, v.y), max(v.z, v.w));
}

float SmallestOf(vec4 v)
{
  return min(min(v.x, v.y), min(v.z, v.w));
}

// Where in (0, 1) the cubic turns; 2 for nowhere.
vec2 TurningPoints(vec4 c)
{
  float root = sqrt(max(c.z * c.z - 3.0 * c.w * c.y, 0.0));
  float q = -(c.z + (c.z < 0.0 ? -root : root));
  vec2 at = vec2(q / (3.0 * c.w), c.y / q);
  bvec2 inside = bvec2(at.x > 0.0 && at.x<1.0, at.y> 0.0 && at.y < 1.0);
  at = mix(vec2(2.0), at, inside);
  return vec2(min(at.x, at.y), max(at.x, at.y));
}

void IntegrateBrick(inout State state, Ray ray, BrickView view, int level, float t0, float t1)
{
  CellWalk walk;
  walk.first = view.base - 0.5;
  walk.inverse = 1.0 / view.direction;
  walk.forward = vec3(ray.positive);
  walk.move = walk.forward * 2.0 - 1.0;
  float lastRange = float(CellsAlong() - 1);
  bool skip = u_switches.x != 0u;
  float t = t0;
  vec3 cell = CellAt(walk, view.direction, t);
  float runEnd = t0; // up to here cells are looked at one by one

  for (int event = 0; event < 8192; ++event)
  {
    if (t >= t1 || state.transmittance <= u_step.z)
    {
      break;
    }
    // The next interpolation cell that is visible. Loops are nested so that the code below runs
    // only for those: drivers on the CPU execute what any ray of a group needs.
    bool found = false;
    Corners corners = Corners(vec4(0.0), vec4(0.0));
    vec3 here = cell;
    float begin = t;
    for (int search = 0; search < 8192; ++search)
    {
      if (t >= t1)
      {
        break;
      }
      for (int i = 0; i < 256; ++i)
      {
        if (found || t >= t1)
        {
          break;
        }
        here = cell;
        begin = t;
        corners = FetchCorners(view, ivec3(here));
        precise vec3 exits = (here + walk.forward - walk.first) * walk.inverse;
        float leave = Minimum(exits);
        t = min(max(leave, begin), t1);
        cell = here + walk.move * vec3(lessThanEqual(exits, vec3(leave)));
        float least = min(SmallestOf(corners.near), SmallestOf(corners.far));
        float largest = max(LargestOf(corners.near), LargestOf(corners.far));
        found = !(skip && IsEmptyBetween(NodeOf(view, least), NodeOf(view, largest)));
#if TERAVOX_FLOAT_DATA
        // One voxel without a value, and there is none in between.
        found = found && !isnan(dot(corners.near + corners.far, vec4(1.0)));
#endif
        state.steps += 1u;
        Count(state, false);
        if (found || t >= runEnd || t >= t1)
        {
          break;
        }
      }
      if (found || t >= t1)
      {
        break;
      }
      // Leap over cells of CELL_EDGE^3 whose range is invisible.
      for (int i = 0; i < 256; ++i)
      {
        if (t < runEnd || t >= t1)
        {
          break;
        }
        vec3 at = clamp(floor((cell - BORDER) * (1.0 / float(CELL_EDGE))), 0.0, lastRange);
        vec2 range = CellRange(view, ivec3(at));
        bool empty = skip &&
          (range.x > range.y || IsEmptyBetween(NodeOf(view, range.x), NodeOf(view, range.y)));
        vec3 low = at * float(CELL_EDGE) + BORDER;
        // The first cell begins half a voxel before the brick.
        vec3 face = mix(low - vec3(equal(at, vec3(0.0))), low + float(CELL_EDGE), walk.forward);
        precise vec3 exits = (face - walk.first) * walk.inverse;
        float leave = max(Minimum(exits), t);
        vec3 next = CellAt(walk, view.direction, leave);
        vec3 beyond = face - (1.0 - walk.forward);
        next = mix(next, beyond, vec3(lessThanEqual(exits, vec3(leave))));
        runEnd = empty ? runEnd : leave;
        cell = empty ? next : cell;
        t = empty ? leave : t;
        if (!empty || t >= t1)
        {
          break;
        }
      }
    }
    if (found)
    {
      precise vec3 w0 = (walk.first + begin * view.direction) - here;
      precise vec3 dw = (t - begin) * view.direction;
      vec4 cubic = CubicAlong(corners, w0, dw);
      cubic *= view.scale;
      cubic.x += view.offset;
      cubic *= u_transfer.z;
      float length_ = (t - begin) * ray.world;
      vec2 turns = TurningPoints(cubic);
      // Twice the largest second derivative.
      float bend = max(abs(cubic.z), abs(cubic.z + 3.0 * cubic.w));
#if TERAVOX_SHADE
      Gradient gradient = GradientAlong(view, ivec3(here), corners, w0, dw);
      float scale = view.scale;
      vec3 perVoxel = scale / vec3(u_levelFactor[level].xyz);
#endif
      float u = 0.0;
      float size = 1.0;
      Sample a = SampleTransfer(cubic.x);
      vec3 colorA = TransferColor(cubic.x);
#if TERAVOX_SHADE
      Light lightA = Shade(Along(gradient, 0.0) * perVoxel, state.towardsLight);
#endif
      bool contributes = false;
      for (int i = 0; i < 512; ++i)
      {
        if (u >= 1.0 || state.transmittance <= u_step.z)
        {
          break;
        }
        float to = min(u + size, 1.0);
        to = turns.x > u && turns.x < to ? turns.x : to;
        to = turns.y > u && turns.y < to ? turns.y : to;
        precise float x = Along(cubic, to);
        Sample b = SampleTransfer(x);
        float mean = MeanExtinction(a, b);
        precise float pieceLength = (to - u) * length_;
        precise float depth = mean * pieceLength;
        float opacity = OpacityOf(depth);
        vec3 colorB = TransferColor(x);
        float gathered = CentroidOf(a.s, b.s, depth, opacity);
        vec3 color = mix(colorA, colorB, gathered);
        // How far the field is from the line between its ends; what that does to the optical depth.
        float off = bend * (to - u) * (to - u) * 0.25;
        float dx = abs(x - a.x);
        float rise = abs(b.s - a.s);
        float uneven = abs(mean - 0.5 * (a.s + b.s));
        float slope = max(max(abs(a.slope), abs(b.slope)), rise / max(dx, 1.0e-3));
        float change = min(0.67 * slope * off + 4.0 * uneven * min(1.0, off / max(dx, 1.0e-3)),
          a.s + b.s + 2.0 * mean);
        vec3 hue = abs(colorB - colorA);
        float turn = max(hue.x, max(hue.y, hue.z)) *
          (HUE_WEIGHT * min(depth, 1.0) + uneven / max(mean, 1.0e-30) * 0.25);
#if TERAVOX_SHADE
        Light lightB = Shade(Along(gradient, to) * perVoxel, state.towardsLight);
        Light light;
        light.diffuse = mix(lightA.diffuse, lightB.diffuse, gathered);
        light.specular = mix(lightA.specular, lightB.specular, gathered);
        vec3 lit = abs(LitColor(colorB, lightB) - LitColor(colorA, lightA));
        turn += max(lit.x, max(lit.y, lit.z)) * LIGHT_WEIGHT;
        color = LitColor(color, light);
#endif
        float gained = state.transmittance * opacity;
        float error = state.transmittance * min(change * pieceLength, 1.0) * (1.0 - opacity) +
          gained * min(turn, 1.0);
        state.steps += 1u;
        if (error > u_step.y * gained + u_step.w && to - u > SMALLEST_PIECE)
        {
          size = (to - u) * 0.5;
        }
        else
        {
          Accumulate(state, opacity, color);
          contributes = contributes || depth > 0.0;
          u = to;
          a = b;
          colorA = colorB;
#if TERAVOX_SHADE
          lightA = lightB;
#endif
          size *= 2.0;
        }
        if (u >= 1.0 || state.transmittance <= u_step.z)
        {
          break;
        }
      }
#if TERAVOX_COUNT
      state.contributing += contributes ? 1u : 0u;
#endif
    }
  }
}
