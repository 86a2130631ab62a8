// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Isosurfaces: where the cubic of a cell meets a value, and what is seen there. Slices: the latter.

#if TERAVOX_BLEND == BLEND_ISOSURFACE || TERAVOX_BLEND == BLEND_SLICE
// What is known of the place where a ray is, for the light there.
struct Place
{
#if TERAVOX_SHADE
  Gradient gradient; // along the cell
  vec3 perVoxel;
  float begin; // depth of the ray at u = 0
  float extent;
#endif
  float u;
};

vec3 ColorAt(State state, Place place, vec3 color)
{
#if TERAVOX_SHADE
  color = LitColor(color,
    Shade(Along(place.gradient, place.u) * place.perVoxel, state.light,
      place.begin + place.u * place.extent));
#endif
  return color;
}
#endif

#if TERAVOX_BLEND == BLEND_ISOSURFACE
void TakeSurface(inout State state, int i, Place place)
{
  vec4 surface = u_isoColors[i];
  Accumulate(state, surface.a, ColorAt(state, place, surface.rgb));
}

// From the side where a ray is to that of a value, where the field jumps or is known not to.
void JumpTo(inout State state, float node, Place place)
{
  if (g_side < 0)
  {
    g_side = SideOf(node);
    return;
  }
  for (int i = 0; i < int(MAXIMUM_ISO_VALUES) + 1; ++i)
  {
    bool up = IsAbove(g_side, node);
    if (state.transmittance <= u_step.z || !(up || IsBelow(g_side, node)))
    {
      break;
    }
    TakeSurface(state, up ? g_side : g_side - 1, place);
    g_side += up ? 1 : -1;
  }
}

float SlopeOf(vec4 c, float u)
{
  precise float slope = c.y + u * (2.0 * c.z + 3.0 * c.w * u);
  return slope;
}

// Where on a part on which a cubic only rises or only falls it meets a value: Newton's steps,
// halves where those lead astray.
float MeetingPoint(vec4 cubic, float from, float to, float value, bool up)
{
  float before = from;
  float behind = to;
  float start = Along(cubic, from);
  bool met = up ? start >= value : start < value;
  float u = met ? from : 0.5 * (from + to);
  bool done = met;
  for (int i = 0; i < 20; ++i)
  {
    if (done || behind - before <= 1.0e-6)
    {
      break;
    }
    float v = Along(cubic, u);
    bool isBefore = up ? v < value : v >= value;
    before = isBefore ? u : before;
    behind = isBefore ? behind : u;
    precise float next = u - (v - value) / SlopeOf(cubic, u);
    next = next > before && next < behind ? next : 0.5 * (before + behind);
    done = abs(next - u) < 1.0e-7;
    u = next;
  }
  return u;
}

// The surfaces through a cell. The side where the ray is comes from the cell before, so that none
// is lost or met twice at a face, where two cells round in different ways.
void CrossCell(inout State state, vec4 cubic, float least, float largest, vec2 turns, Place place)
{
  place.u = 0.0;
  JumpTo(state, clamp(Along(cubic, 0.0), least, largest), place);
  float begin = 0.0;
  int part = 0;
  for (int i = 0; i < 2 * int(MAXIMUM_ISO_VALUES) + 4; ++i)
  {
    if (part > 2 || state.transmittance <= u_step.z)
    {
      break;
    }
    float end = part == 0 ? turns.x : part == 1 ? turns.y : 1.0;
    float value = clamp(Along(cubic, end), least, largest);
    bool up = IsAbove(g_side, value);
    if (up || IsBelow(g_side, value))
    {
      int surface = up ? g_side : g_side - 1;
      begin = MeetingPoint(cubic, begin, end, IsoValue(surface), up);
      place.u = begin;
      TakeSurface(state, surface, place);
      g_side += up ? 1 : -1;
    }
    else
    {
      begin = end;
      ++part;
    }
  }
}
#endif
