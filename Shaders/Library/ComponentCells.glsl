// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// The integral along a ray through one interpolation cell of several components, cut where one of
// their cubics turns and in halves where a piece may err more than its share.

// The line of a ray through a cell.
struct ComponentLine
{
  vec4 field[TERAVOX_COMPONENTS]; // in nodes of their tables
  float has[EMITTERS];
  vec2 turns[EMITTERS]; // where the field turns
#if TERAVOX_SHADE || TERAVOX_GRADIENT_OPACITY
  Gradient slope[EMITTERS]; // in data per voxel of level 0
#endif
  float begin; // depths
  float extent;
};

ComponentLine LineThrough(BrickView view, int level, CellWalk walk, VisitedCell visited)
{
  ComponentLine line;
  line.begin = visited.begin;
  line.extent = walk.t - visited.begin;
  precise vec3 w0 = (walk.first + visited.begin * view.direction) - visited.cell;
  precise vec3 dw = line.extent * view.direction;
  bool colored = true; // what dependent components take their colours from has values
#if TERAVOX_FLOAT_DATA && TERAVOX_DEPENDENT
  for (int c = 0; c < TERAVOX_COMPONENTS; ++c)
  {
    colored = colored && HasValues(visited.corners[c]);
  }
#endif
  for (int c = 0; c < TERAVOX_COMPONENTS; ++c)
  {
    bool has = colored;
#if TERAVOX_FLOAT_DATA
    has = has && HasValues(visited.corners[c]);
#endif
    vec4 cubic = CubicAlong(visited.corners[c], w0, dw);
    cubic *= view.parts[c].x;
    cubic.x += view.parts[c].y;
    line.field[c] = has ? cubic * u_componentTransfer[c].z : vec4(0.0);
    int e = c - FIRST_EMITTER;
    if (e >= 0 && e < EMITTERS)
    {
      line.has[e] = has && WeightOf(c) > 0.0 ? 1.0 : 0.0;
      line.turns[e] = line.has[e] > 0.0 ? TurningPoints(line.field[c]) : vec2(2.0);
#if TERAVOX_SHADE || TERAVOX_GRADIENT_OPACITY
      Gradient g = GradientAlong(PartOf(view, c), ivec3(visited.cell), visited.corners[c], w0, dw);
      vec3 perVoxel = view.parts[c].x / vec3(u_levelFactor[level].xyz);
      line.slope[e] = Gradient(g.x * perVoxel.x, g.y * perVoxel.y, g.z * perVoxel.z);
#endif
    }
  }
  return line;
}

Values ValuesAlong(ComponentLine line, float u)
{
  Values v;
  for (int c = 0; c < TERAVOX_COMPONENTS; ++c)
  {
    v.node[c] = Along(line.field[c], u);
  }
  v.has = line.has;
#if TERAVOX_SHADE || TERAVOX_GRADIENT_OPACITY
  for (int e = 0; e < EMITTERS; ++e)
  {
    SetDifference(v, e, Along(line.slope[e], u));
  }
#endif
  return v;
}

// The corners reach further than the line: a piece between ends that see nothing adds 0.
bool IsLineEmpty(ComponentLine line)
{
  bool empty = u_switches.x != 0u;
  for (int e = 0; e < EMITTERS; ++e)
  {
    vec4 f = line.field[FIRST_EMITTER + e];
    vec2 turns = min(line.turns[e], 1.0);
    vec3 ends = vec3(Along(f, turns.x), Along(f, turns.y), Along(f, 1.0));
    empty = empty &&
      (line.has[e] == 0.0 ||
        IsPartEmpty(FIRST_EMITTER + e, min(Minimum(ends), f.x), max(Maximum(ends), f.x)));
  }
  return empty;
}

#if !TERAVOX_PLANE
Means MeansBetween(ComponentLine line, Point a, Point m, Point b, float u, float to)
{
  Means means;
  means.varied = 0.0;
  float size = to - u;
  float size2 = size * size;
  for (int e = 0; e < EMITTERS; ++e)
  {
    vec4 f = line.field[FIRST_EMITTER + e];
    // Half of the second derivatives at both ends.
    float bendA = f.z + 3.0 * f.w * u;
    float bendB = f.z + 3.0 * f.w * to;
    vec2 mean = MeanOfPart(a.s[e], b.s[e], max(abs(bendA), abs(bendB)) * size2,
      (-1.0 / 6.0) * (bendA + 1.5 * f.w * size) * size2);
#if TERAVOX_GRADIENT_OPACITY
    vec4 table = u_componentGradient[FIRST_EMITTER + e];
    float bendM = 0.5 * (bendA + bendB);
    float quarter = 0.25 * size2;
    float third = 0.75 * f.w * size;
    float uneven = abs(MeanExtinction(a.s[e], b.s[e]) - 0.5 * (a.s[e].s + b.s[e].s));
    float varied = Attenuate(table,
      MeanOfPart(a.s[e], m.s[e], max(abs(bendA), abs(bendM)) * quarter,
        (-1.0 / 6.0) * (bendA + third) * quarter),
      MeanOfPart(m.s[e], b.s[e], max(abs(bendM), abs(bendB)) * quarter,
        (-1.0 / 6.0) * (bendM + third) * quarter),
      vec3(a.s[e].s, m.s[e].s, b.s[e].s), uneven, a.gradient[e], m.gradient[e], b.gradient[e],
      GradientBend(line.slope[e], table.xyz, u, to), mean.x, mean.y);
    means.varied = max(means.varied, varied);
#endif
    means.mean[e] = mean.x * line.has[e];
    means.change[e] = mean.y * line.has[e];
  }
  return means;
}
#endif

void IntegrateCell(
  inout State state, Ray ray, BrickView view, int level, CellWalk walk, VisitedCell visited)
{
  ComponentLine line = LineThrough(view, level, walk, visited);
  if (IsLineEmpty(line))
  {
    return;
  }
  COUNT(evaluated, true);
#if TERAVOX_SHADE || TERAVOX_GRADIENT_OPACITY
  COUNT(gradients, true);
#endif
#if TERAVOX_COUNT
  float before = state.transmittance;
#endif
#if TERAVOX_PLANE
  IntegratePlane(state,
    PlaneLine(line.field[0], line.turns[0], line.field[1],
#if TERAVOX_SHADE
      line.slope[0], vec3(1.0),
#endif
      line.begin, line.extent),
    line.extent * ray.world);
#else
  float u = 0.0;
  float size = 1.0;
  Values values = ValuesAlong(line, 0.0);
  Point a = FindPoint(values, state, line.begin);
  for (int i = 0; i < 1024; ++i)
  {
    if (u >= 1.0 || state.transmittance <= u_step.z)
    {
      break;
    }
    float to = min(u + size, 1.0);
    for (int e = 0; e < EMITTERS; ++e)
    {
      vec2 turns = line.turns[e];
      to = turns.x > u && turns.x < to ? turns.x : to;
      to = turns.y > u && turns.y < to ? turns.y : to;
    }
    float half_ = 0.5 * (u + to);
    Values middle = ValuesAlong(line, half_);
    Values end = ValuesAlong(line, to);
    Point m = FindPoint(middle, state, line.begin + half_ * line.extent);
    Point b = FindPoint(end, state, line.begin + to * line.extent);
    float turned[EMITTERS];
    for (int e = 0; e < EMITTERS; ++e)
    {
      turned[e] = 0.0;
#if TERAVOX_SHADE
      turned[e] = max(TurnedBetween(values.normal[e], middle.normal[e]),
        TurnedBetween(middle.normal[e], end.normal[e]));
#endif
    }
    Piece piece = Combine(
      a, m, b, MeansBetween(line, a, m, b, u, to), turned, (to - u) * (line.extent * ray.world));
    float gained = state.transmittance * piece.opacity;
    precise float error = state.transmittance * piece.error.x + gained * piece.error.y;
    state.steps += 2u;
    if (error > u_step.y * gained + u_step.w && to - u > SMALLEST_PIECE)
    {
      size = (to - u) * 0.5;
    }
    else
    {
#if TERAVOX_ESTIMATE
      state.error += error;
#endif
      Accumulate(state, piece.opacity, piece.color);
      u = to;
      a = b;
      values = end;
      size *= 2.0;
    }
  }
#endif
  COUNT(contributing, state.transmittance < before);
}
