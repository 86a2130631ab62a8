// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Steps of a given length through several components (see MarchFixed.glsl).

Values ValuesAt(BrickView view, int level, float t)
{
  Values v;
  precise vec3 q = LocalPosition(view, t) - 0.5;
  vec3 cell = clamp(floor(q), 1.0, float(u_atlas.w) - 3.0);
  precise vec3 w = q - cell;
  bool all_ = true;
  bool has[TERAVOX_COMPONENTS];
  for (int c = 0; c < TERAVOX_COMPONENTS; ++c)
  {
    BrickView part = PartOf(view, c);
    Corners corners = FetchCorners(part, ivec3(cell));
    float texel = CubicAlong(corners, w, vec3(0.0)).x;
    v.node[c] = PartNode(view, c, texel);
    has[c] = true;
#if TERAVOX_FLOAT_DATA
    has[c] = !isnan(texel);
    v.node[c] = has[c] ? v.node[c] : 0.0;
#endif
    all_ = all_ && has[c];
#if TERAVOX_SHADE || TERAVOX_GRADIENT_OPACITY
    if (c >= FIRST_EMITTER && c < FIRST_EMITTER + EMITTERS)
    {
      Gradient g = GradientAlong(part, ivec3(cell), corners, w, vec3(0.0));
      SetDifference(
        v, c - FIRST_EMITTER, Along(g, 0.0) * (part.scale / vec3(u_levelFactor[level].xyz)));
    }
#endif
  }
  for (int e = 0; e < EMITTERS; ++e)
  {
    int c = FIRST_EMITTER + e;
#if TERAVOX_DEPENDENT
    v.has[e] = all_ && WeightOf(c) > 0.0 ? 1.0 : 0.0;
#else
    v.has[e] = has[c] && WeightOf(c) > 0.0 ? 1.0 : 0.0;
#endif
  }
  return v;
}

// The mean extinction of half a step: what its ends say of extinction and gradient together, and
// for the rest of the extinction the mean opacity.
float MeanOfHalfStep(Point a, Point b, int e)
{
#if TERAVOX_PLANE
  precise float mean = 0.5 * (a.left[e] + b.left[e]);
#else
  precise float mean = MeanExtinction(a.s[e], b.s[e]);
#endif
#if TERAVOX_GRADIENT_OPACITY
  precise float unseen = mean - 0.5 * (a.s[e].s + b.s[e].s);
  mean = max(0.5 * (a.left[e] + b.left[e]) +
      unseen * (0.5 * (a.gradient[e].opacity + b.gradient[e].opacity)),
    0.0);
#endif
  return mean;
}

void IntegrateBrick(inout State state, Ray ray, BrickView view, int level, float t0, float t1)
{
  float step_ = u_step.x / ray.world;
  float t = t0;
  Values values = ValuesAt(view, level, t0);
  Point a = FindPoint(values, state, t0);
  float turned[EMITTERS];
  for (int e = 0; e < EMITTERS; ++e)
  {
    turned[e] = 0.0;
  }
  for (int i = 0; i < 16384; ++i)
  {
    if (t >= t1 || state.transmittance <= u_step.z)
    {
      break;
    }
    // t is often a multiple itself, and t / step may be rounded to just below it.
    precise float cut = floor(t / step_);
    precise float next = (cut + 1.0) * step_;
    next = next > t ? next : (cut + 2.0) * step_;
    next = next > t ? min(next, t1) : t1;
    float half_ = 0.5 * (t + next);
    Values middle = ValuesAt(view, level, half_);
    Values end = ValuesAt(view, level, next);
    Point m = FindPoint(middle, state, half_);
    Point b = FindPoint(end, state, next);
    Means means;
    means.varied = 0.0;
    for (int e = 0; e < EMITTERS; ++e)
    {
      precise float mean = 0.5 * (MeanOfHalfStep(a, m, e) + MeanOfHalfStep(m, b, e));
      means.mean[e] = mean * ((values.has[e] * middle.has[e]) * end.has[e]);
      means.change[e] = 0.0;
    }
    Piece piece = Combine(a, m, b, means, turned, (next - t) * ray.world);
    Accumulate(state, piece.opacity, piece.color);
    state.steps += 2u;
    COUNT(samples, true);
    COUNT(evaluated, true);
    COUNT(contributing, piece.opacity > 0.0);
#if TERAVOX_SHADE || TERAVOX_GRADIENT_OPACITY
    COUNT(gradients, true);
#endif
    t = next;
    a = b;
    values = end;
  }
}
