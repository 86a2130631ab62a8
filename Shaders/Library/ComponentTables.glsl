// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Voxels with several components: where each of them lies in the atlas, and its tables. Those with
// an opacity emit: each of independent ones, the last of dependent ones, the first of two that have
// one function, of which the second is the row.
#if TERAVOX_COMPONENTS

#if TERAVOX_PLANE
const int FIRST_EMITTER = 0;
const int EMITTERS = 1;
#elif TERAVOX_DEPENDENT
const int FIRST_EMITTER = TERAVOX_COMPONENTS - 1;
const int EMITTERS = 1;
#else
const int FIRST_EMITTER = 0;
const int EMITTERS = TERAVOX_COMPONENTS;
#endif

// One component of a brick.
BrickView PartOf(BrickView view, int component)
{
  BrickView part = view;
  part.firstVoxel.z += component * int(u_atlas.w);
  part.firstCell.z += component * CellsAlong();
  part.scale = view.parts[component].x;
  part.offset = view.parts[component].y;
#if TERAVOX_CLIPPED_GRADIENT
  part.clipped = ClippedTexel(part.scale, part.offset, u_componentTransfer[component].xy);
#endif
  return part;
}

// Position of a texel value in nodes of a component's table; red, green and blue as they are in
// 0..1.
float PartNode(BrickView view, int component, float texel)
{
  precise float fromLow = texel * view.parts[component].x + view.parts[component].y;
  precise float node = fromLow * u_componentTransfer[component].z;
  return node;
}

// The same of a data value given as a float pair.
float PartPosition(int component, float valueHigh, float valueLow)
{
  vec4 transfer = u_componentTransfer[component];
  precise float fromLow = (valueHigh - transfer.x) + (valueLow - transfer.y);
  return fromLow * transfer.z;
}

Sample SamplePart(int component, float node)
{
  return SampleTable(int(u_componentTable[component].x), u_componentTransfer[component].w, node);
}

vec3 PartColor(int component, float node)
{
  vec3 slope;
  return TableColor(
    int(u_componentTable[component].x), u_componentTransfer[component].w, node, slope);
}

// 0 where it doesn't emit.
float WeightOf(int component)
{
  return u_componentTable[component].z;
}

float PerWeight(int component)
{
  float weight = WeightOf(component);
  return weight > 0.0 ? 1.0 / weight : 0.0;
}

// The largest light per extinction.
float LargestLight()
{
  return u_componentTable[0].w;
}

// Whether nothing is to be seen of a component between two positions in nodes.
bool IsPartEmpty(int component, float from, float to)
{
  return WeightOf(component) <= 0.0 ||
    IsTableEmpty(int(u_componentTable[component].y), u_componentTransfer[component].w, from, to);
}

// The same of all components with values between two data values, which may be rounded.
bool AreValuesEmpty(float low, float high)
{
  float first = low - abs(low) * 1.2e-7;
  float last = high + abs(high) * 1.2e-7;
  bool empty = true;
  for (int e = 0; e < EMITTERS; ++e)
  {
    int c = FIRST_EMITTER + e;
    empty = empty && IsPartEmpty(c, PartPosition(c, first, 0.0), PartPosition(c, last, 0.0));
  }
  return empty;
}

// The same of the voxels of a cell of CELL_EDGE^3.
bool IsCellRangeEmpty(BrickView view, ivec3 at)
{
  bool empty = true;
  for (int e = 0; e < EMITTERS; ++e)
  {
    int c = FIRST_EMITTER + e;
    vec2 range = CellRange(PartOf(view, c), at);
    empty = empty &&
      (range.x > range.y || IsPartEmpty(c, PartNode(view, c, range.x), PartNode(view, c, range.y)));
  }
  return empty;
}
#endif
