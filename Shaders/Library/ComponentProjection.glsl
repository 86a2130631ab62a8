// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Blend modes other than composite of voxels with several components: each is a field of its own,
// of which a ray keeps an extreme or a sum; what they show together is made of a whole picture. Of
// dependent ones it keeps the extreme of the last, and what the others are there. All values are
// positions in nodes of the component's table.
#if TERAVOX_COMPONENTS && TERAVOX_BLEND

// What rays hold that have met nothing.
const float NOTHING_MET = -3.0e38;

// Of the ray of this invocation; loaded and stored by RayMarch.frag.
vec4 g_extremes; // with the other sign for minima, so that more is better
vec4 g_sums;     // of the tables' values times lengths
vec4 g_lengths;  // of the ray where values count, world units
int g_side = -1; // of nothing: isosurfaces are of one component

// A ray that isn't over sees all that there is. `crossed`: whether it meets the volume at all, which
// is all that sums ask for.
float LoadProjection(vec4 state, ivec2 pixel, bool crossed)
{
  g_extremes = state;
  g_sums = crossed ? max(state, 0.0) : state;
#if TERAVOX_BLEND == BLEND_AVERAGE
  g_lengths = texelFetch(u_lengthsBefore, pixel, 0);
#else
  g_lengths = vec4(0.0);
#endif
  return 1.0;
}

// In the place of colour and transmittance.
vec4 StoreProjection(ivec2 pixel)
{
#if TERAVOX_BLEND == BLEND_MAXIMUM || TERAVOX_BLEND == BLEND_MINIMUM
  return g_extremes;
#else
#if TERAVOX_BLEND == BLEND_AVERAGE
  imageStore(u_lengthsState, pixel, g_lengths);
#endif
  return g_sums;
#endif
}

#if TERAVOX_BLEND == BLEND_MAXIMUM || TERAVOX_BLEND == BLEND_MINIMUM
// Where more makes no difference to the picture it is cut off.
float ExtremeOf(int component, float signedNode)
{
  float nodes = u_componentTransfer[component].w;
#if TERAVOX_BLEND == BLEND_MAXIMUM
  return clamp(signedNode, -1.0, nodes);
#else
  return clamp(signedNode, -nodes, 1.0);
#endif
}

// See TakeExtreme() of one component. The ray is over where none can show anything else.
void TakeExtreme(inout State state, int component, float best)
{
  if (WeightOf(component) > 0.0 &&
    best > g_extremes[component] + u_componentProjection[component].x)
  {
    g_extremes[component] = best;
    bool last = true;
    for (int c = 0; c < TERAVOX_COMPONENTS; ++c)
    {
      last = last &&
        (WeightOf(c) <= 0.0 || g_extremes[c] >= u_projection.x * u_componentProjection[c].y);
    }
    state.transmittance = last ? 0.0 : 1.0;
  }
}
#endif

#if TERAVOX_DEPENDENT
const int LAST_COMPONENT = TERAVOX_COMPONENTS - 1;

// The last one's best, and what all are where that is.
void TakeDependent(float best, float nodes[TERAVOX_COMPONENTS])
{
  if (best > g_extremes[LAST_COMPONENT] + u_componentProjection[LAST_COMPONENT].x)
  {
    for (int c = 0; c < LAST_COMPONENT; ++c)
    {
      g_extremes[c] = nodes[c];
    }
    g_extremes[LAST_COMPONENT] = best;
  }
}

float SignedNode(float node)
{
#if TERAVOX_BLEND == BLEND_MAXIMUM
  return ExtremeOf(LAST_COMPONENT, node);
#else
  return ExtremeOf(LAST_COMPONENT, -node);
#endif
}
#endif

// Whether a component without any value, or with values in a range, leaves the ray as it is.
bool SkipsPart(int component, bool none, float from, float to)
{
  if (none || WeightOf(component) <= 0.0)
  {
    return true;
  }
#if TERAVOX_BLEND == BLEND_MAXIMUM
  return ExtremeOf(component, to) <= g_extremes[component];
#elif TERAVOX_BLEND == BLEND_MINIMUM
  return ExtremeOf(component, -from) <= g_extremes[component];
#elif TERAVOX_BLEND == BLEND_AVERAGE
  vec4 rule = u_componentProjection[component];
  return to + rule.x < rule.y || from - rule.x > rule.z;
#else
  return IsPartEmpty(component, from, to);
#endif
}

// The same of all components with values between two data values, which may be rounded.
bool SkipsValues(float low, float high)
{
  float first = low - abs(low) * 1.2e-7;
  float last = high + abs(high) * 1.2e-7;
  bool skips = true;
  for (int c = 0; c < TERAVOX_COMPONENTS; ++c)
  {
    skips =
      skips && SkipsPart(c, false, PartPosition(c, first, 0.0), PartPosition(c, last, 0.0));
  }
  return skips;
}

// The same of the voxels of a cell of CELL_EDGE^3.
bool SkipsCellRange(BrickView view, ivec3 at)
{
  bool skips = true;
  for (int c = 0; c < TERAVOX_COMPONENTS; ++c)
  {
    vec2 range = CellRange(PartOf(view, c), at);
    skips = skips &&
      SkipsPart(c, range.x > range.y, PartNode(view, c, range.x), PartNode(view, c, range.y));
  }
  return skips;
}
#endif
