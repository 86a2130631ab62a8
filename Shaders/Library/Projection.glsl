// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Blend modes other than composite: what a ray keeps of the field, and which ranges of values make
// no difference to it. All values are positions in nodes of the transfer table.
#if !TERAVOX_COMPONENTS

// Of the ray of this invocation; loaded and stored by RayMarch.frag.
bool g_any;      // a value that counts has been met
float g_extreme; // with the other sign for minima, so that more is better
float g_sum;     // of the table's values times lengths
float g_length;  // of the ray where values count, world units
int g_side;      // how many iso values the field isn't below; -1: not known

// `crossed`: whether the ray meets the volume at all, which is all that sums ask for.
void LoadProjection(vec4 state, int word, bool crossed)
{
#if TERAVOX_BLEND == BLEND_AVERAGE || TERAVOX_BLEND == BLEND_ADDITIVE
  g_any = crossed;
#elif TERAVOX_BLEND == BLEND_MAXIMUM || TERAVOX_BLEND == BLEND_MINIMUM
  g_any = state.y != 0.0;
#else
  g_any = false;
#endif
  g_extreme = g_any ? state.x : -3.0e38;
  g_sum = state.x;
  g_length = state.z;
  g_side = ((word >> 20) & 1023) - 1;
}

// The colour's place holds what is gathered; isosurfaces and slices gather colours.
vec3 StoreProjection(vec3 color)
{
#if TERAVOX_BLEND == BLEND_MAXIMUM || TERAVOX_BLEND == BLEND_MINIMUM
  return g_any ? vec3(g_extreme, 1.0, 0.0) : vec3(0.0);
#elif TERAVOX_BLEND == BLEND_AVERAGE || TERAVOX_BLEND == BLEND_ADDITIVE
  return vec3(g_sum, g_any ? 1.0 : 0.0, g_length);
#else
  return color;
#endif
}

#if TERAVOX_BLEND == BLEND_MAXIMUM || TERAVOX_BLEND == BLEND_MINIMUM
// Where more makes no difference to the picture it is cut off.
float ExtremeOf(float signedNode)
{
#if TERAVOX_BLEND == BLEND_MAXIMUM
  return clamp(signedNode, -1.0, u_transfer.w);
#else
  return clamp(signedNode, -u_transfer.w, 1.0);
#endif
}

// A value that is better by no more than rounding isn't better. So a region whose range promises
// nothing better can be left out without a change.
bool IsBetter(float best)
{
  return best > g_extreme + u_projection.y;
}

void TakeExtreme(inout State state, float best)
{
  if (IsBetter(best))
  {
    g_extreme = best;
    g_any = true;
    // Nothing that looks different can be met.
    state.transmittance = best >= u_projection.x * u_projection.z ? 0.0 : 1.0;
  }
}
#endif

#if TERAVOX_BLEND == BLEND_ISOSURFACE
int IsoCount()
{
  return int(u_projection.x);
}

float IsoValue(int i)
{
  return u_isoValues[i / 4][i & 3];
}

int SideOf(float node)
{
  int low = 0;
  int high = IsoCount();
  for (int i = 0; i < 16; ++i)
  {
    if (low >= high)
    {
      break;
    }
    int middle = (low + high) / 2;
    bool above = node >= IsoValue(middle);
    low = above ? middle + 1 : low;
    high = above ? high : middle;
  }
  return low;
}

bool IsAbove(int side, float node)
{
  return side < IsoCount() && node >= IsoValue(min(side, int(MAXIMUM_ISO_VALUES) - 1));
}

bool IsBelow(int side, float node)
{
  return side > 0 && node < IsoValue(max(side - 1, 0));
}
#endif

// Where there is no value, it isn't known on which side of a surface a ray goes on. Of a mask parts
// of regions may be left out, of which ranges don't tell: as in VTK rays stay on their side there.
void LoseSide()
{
#if !TERAVOX_MASK
  g_side = -1;
#endif
}

// Whether a region without any value, or with values in a range, leaves the ray as it is; of a ray
// through surfaces it tells on which side the region is.
bool SkipsRange(bool none, float from, float to)
{
#if TERAVOX_BLEND == BLEND_MAXIMUM
  return none || ExtremeOf(to) <= g_extreme;
#elif TERAVOX_BLEND == BLEND_MINIMUM
  return none || ExtremeOf(-from) <= g_extreme;
#elif TERAVOX_BLEND == BLEND_AVERAGE
  return none || to + u_projection.y < u_projection.z || from - u_projection.y > u_projection.w;
#elif TERAVOX_BLEND == BLEND_ISOSURFACE
  if (none || IsoCount() == 0)
  {
    LoseSide();
    return true;
  }
#if TERAVOX_MASK
  // A ray may meet nothing but holes of a region: it tells the side of no ray.
  if (g_side < 0)
  {
    return false;
  }
#endif
  int side = g_side >= 0 ? g_side : SideOf(from);
  bool same = !(IsBelow(side, from - u_projection.y) || IsAbove(side, to + u_projection.y));
  g_side = same ? side : g_side;
  return same;
#else
  return none || IsEmptyBetween(from, to);
#endif
}
#endif
#include "Library/ComponentProjection.glsl"
