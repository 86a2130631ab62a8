// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// What blend modes other than composite make of a cell, a voxel and a part of one value of several
// components.
#if TERAVOX_COMPONENTS && TERAVOX_BLEND

// A part of the ray on which a component has one value.
void TakeValue(inout State state, int component, float node, float length_)
{
#if TERAVOX_BLEND == BLEND_MAXIMUM
  TakeExtreme(state, component, ExtremeOf(component, node));
#elif TERAVOX_BLEND == BLEND_MINIMUM
  TakeExtreme(state, component, ExtremeOf(component, -node));
#else
  vec2 sum = SumBetween(SumRuleOf(component), node, node);
  AddSum(component, sum * length_);
#endif
}

// One on which all have one.
void ProjectConstant(inout State state, Ray ray, vec2 value, int level, float t0, float t1)
{
  state.steps += 1u;
#if TERAVOX_DEPENDENT
  float nodes[TERAVOX_COMPONENTS];
  for (int c = 0; c < TERAVOX_COMPONENTS; ++c)
  {
    nodes[c] = PartPosition(c, value.x, value.y);
  }
  if (t1 > t0)
  {
    TakeDependent(SignedNode(nodes[LAST_COMPONENT]), nodes);
  }
#else
  for (int c = 0; c < TERAVOX_COMPONENTS; ++c)
  {
    if (t1 > t0 && WeightOf(c) > 0.0)
    {
      TakeValue(state, c, PartPosition(c, value.x, value.y), (t1 - t0) * ray.world);
    }
  }
#endif
}

#if TERAVOX_NEAREST
void TakeVoxel(
  inout State state, Ray ray, BrickView view, int level, ivec3 voxel, float t0, float t1)
{
  COUNT(samples, true);
#if TERAVOX_MASK
  if (MaskAt(view, voxel) == 0)
  {
    return;
  }
#endif
#if TERAVOX_DEPENDENT
  float nodes[TERAVOX_COMPONENTS];
  bool all_ = true;
  for (int c = 0; c < TERAVOX_COMPONENTS; ++c)
  {
    float texel = Voxel(PartOf(view, c), voxel);
    nodes[c] = PartNode(view, c, texel);
#if TERAVOX_FLOAT_DATA
    all_ = all_ && !isnan(texel);
#endif
  }
  if (all_)
  {
    TakeDependent(SignedNode(nodes[LAST_COMPONENT]), nodes);
  }
  COUNT(contributing, all_);
#else
  for (int c = 0; c < TERAVOX_COMPONENTS; ++c)
  {
    float texel = Voxel(PartOf(view, c), voxel);
    bool has = WeightOf(c) > 0.0;
#if TERAVOX_FLOAT_DATA
    has = has && !isnan(texel);
#endif
    if (has)
    {
      TakeValue(state, c, PartNode(view, c, texel), (t1 - t0) * ray.world);
    }
    COUNT(contributing, has);
  }
#endif
}
#else

vec4 FieldOf(BrickView view, int component, Corners k, vec3 w0, vec3 dw)
{
  vec4 cubic = CubicAlong(k, w0, dw) * view.parts[component].x;
  cubic.x += view.parts[component].y;
  return cubic * u_componentTransfer[component].z;
}

#if TERAVOX_DEPENDENT
void IntegrateCell(
  inout State state, Ray ray, BrickView view, int level, CellWalk walk, VisitedCell visited)
{
  precise vec3 w0 = (walk.first + visited.begin * view.direction) - visited.cell;
  precise vec3 dw = (walk.t - visited.begin) * view.direction;
  Corners k = visited.corners[LAST_COMPONENT];
  vec4 cubic = FieldOf(view, LAST_COMPONENT, k, w0, dw);
  vec2 turns = TurnsOf(cubic);
#if TERAVOX_BLEND == BLEND_MAXIMUM
  float sign_ = 1.0;
#else
  float sign_ = -1.0;
#endif
  // The first place with the best value.
  float where = 0.0;
  float best = sign_ * cubic.x;
  vec3 places = vec3(turns, 1.0);
  for (int i = 0; i < 3; ++i)
  {
    float there = sign_ * Along(cubic, places[i]);
    where = there > best ? places[i] : where;
    best = max(best, there);
  }
  // Values lie between the corners', whatever rounding does.
  float a = sign_ * PartNode(view, LAST_COMPONENT, min(SmallestOf(k.near), SmallestOf(k.far)));
  float b = sign_ * PartNode(view, LAST_COMPONENT, max(LargestOf(k.near), LargestOf(k.far)));
  best = ExtremeOf(LAST_COMPONENT, clamp(best, min(a, b), max(a, b)));
  float nodes[TERAVOX_COMPONENTS];
  bool all_ = true;
  for (int c = 0; c < TERAVOX_COMPONENTS; ++c)
  {
    nodes[c] = Along(FieldOf(view, c, visited.corners[c], w0, dw), where);
#if TERAVOX_FLOAT_DATA
    all_ = all_ && HasValues(visited.corners[c]);
#endif
  }
  if (all_)
  {
    TakeDependent(best, nodes);
  }
}
#else
void IntegrateCell(
  inout State state, Ray ray, BrickView view, int level, CellWalk walk, VisitedCell visited)
{
  precise vec3 w0 = (walk.first + visited.begin * view.direction) - visited.cell;
  precise vec3 dw = (walk.t - visited.begin) * view.direction;
  for (int c = 0; c < TERAVOX_COMPONENTS; ++c)
  {
    Corners k = visited.corners[c];
    bool has = WeightOf(c) > 0.0;
#if TERAVOX_FLOAT_DATA
    has = has && HasValues(k);
#endif
    vec4 cubic = FieldOf(view, c, k, w0, dw);
    vec2 turns = TurnsOf(cubic);
#if TERAVOX_BLEND == BLEND_MAXIMUM || TERAVOX_BLEND == BLEND_MINIMUM
    vec4 ends =
      vec4(cubic.x, Along(cubic, 1.0), Along(cubic, turns.x), Along(cubic, turns.y));
    // Values lie between the corners', whatever rounding does.
    float least = PartNode(view, c, min(SmallestOf(k.near), SmallestOf(k.far)));
    float largest = PartNode(view, c, max(LargestOf(k.near), LargestOf(k.far)));
#if TERAVOX_BLEND == BLEND_MAXIMUM
    float best = clamp(LargestOf(ends), least, largest);
#else
    float best = -clamp(SmallestOf(ends), least, largest);
#endif
    if (has)
    {
      TakeExtreme(state, c, ExtremeOf(c, best));
    }
#else
    if (has)
    {
      AddSum(c,
        SumCell(state, SumRuleOf(c), cubic, turns, (walk.t - visited.begin) * ray.world));
    }
#endif
  }
}
#endif
#endif
#endif
