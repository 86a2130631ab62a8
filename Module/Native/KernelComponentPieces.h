// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// The integral through interpolation cells of voxels with several components: emission and
// extinction are those of Core/Components.h. A piece knows each component's extinction exactly in
// the mean, from its integral table, and all that the components do together at its ends and in its
// middle; where the two disagree, or light changes between the three, it is cut into eight
// (Shaders/Library/ComponentPieces.glsl cuts it into two).

// Share of the second difference of colours at the ends and in the middle that is taken as an error
// (a kink anywhere between them makes 0.085 at most), and of lit ones, which bend more.
constexpr float ColorBend = 0.1f;
constexpr float LitBend = 0.2f;
// Of the difference between two rules for what components do together.
constexpr float RuleWeight = 0.5f;
// Of the difference between a component's mean and what three places make of it: where it lies in
// the piece isn't known.
constexpr float UnseenPlace = 0.25f;
// Of light: less makes no difference.
constexpr float LeastChange = 1.0e-6f;
// Less isn't divided by: its inverse would be infinite.
constexpr float LeastKappa = 1.0e-37f;

// What the components do at a place of the ray.
template <typename F>
struct ComponentPoint
{
  Sample<F> S[MostComponents]; // of emitters
  // Of emitters: their gradients, where there are opacities by them, and what these leave of the
  // extinction.
  GradientSample<F> G[MostComponents];
  F Left[MostComponents];
  Color<F> Own[MostComponents]; // their colours, lit
  Normal<F> N[MostComponents];  // of shaded pictures
  F Has[MostComponents];        // 1 where there is a value, else 0
  F Kappa;                      // extinction
  Color<F> Light;               // emission
};

// The extinction that components have together.
template <typename F>
TERAVOX_INLINE F TogetherOf(const ComponentTables& t, const F (&s)[MostComponents])
{
  if (t.EmitterCount == 1)
  {
    return s[t.Emitters[0]] * t.PerWeight[t.Emitters[0]];
  }
  F total = F{};
  for (int e = 0; e < t.EmitterCount; ++e)
  {
    total = total + s[t.Emitters[e]] * t.Weight[t.Emitters[e]];
  }
  total = Max(total, F{} + LeastKappa);
  F kappa = F{};
  for (int e = 0; e < t.EmitterCount; ++e)
  {
    const F own = s[t.Emitters[e]];
    kappa = kappa + own * (own / total);
  }
  return kappa;
}

template <typename F>
TERAVOX_INLINE F Clamped(F v, float high)
{
  return Min(Max(v, F{}), F{} + high);
}

// `x`: positions of the components in nodes of their tables; red, green and blue in 0..1. `has`: 1
// where an emitter has a value, else 0. Normals and gradients are in `p` already.
template <typename F>
inline void FindPoint(const Context& c, const F (&x)[MostComponents],
  const F (&has)[MostComponents], F t, ComponentPoint<F>& p)
{
  const ComponentTables& k = c.Components;
  if (c.Plane.Nodes != nullptr)
  {
    const PlaneSample<F> there = SamplePlane(c.Plane, c.Gradient, x[0], Max(x[1], F{}));
    const F bound = SampleTransfer(k.Tables[0], x[0]).S;
    p.Has[0] = has[0];
    p.Kappa = p.Left[0] = p.S[0].S = Select(bound > F{}, there.S * has[0], F{});
    p.Own[0] = there.Value;
    if (c.Scene.Shade)
    {
      p.Own[0] = LitColor(k.Lit[0], p.Own[0], p.N[0], c.Light, t);
    }
    p.Light = { p.Kappa * p.Own[0].Red, p.Kappa * p.Own[0].Green, p.Kappa * p.Own[0].Blue };
    return;
  }
  F s[MostComponents] = {};
  p.Light = { F{}, F{}, F{} };
  for (int e = 0; e < k.EmitterCount; ++e)
  {
    const int i = k.Emitters[e];
    Sample<F>& sample = p.S[i];
    sample = SampleTransfer(k.Tables[i], x[i]);
    sample.S = sample.S * has[i];
    p.Has[i] = has[i];
    F& left = p.Left[i];
    left = k.ByGradient ? sample.S * p.G[i].Opacity : sample.S;
    s[i] = left;
    Color<F>& color = p.Own[i];
    if (!k.Dependent)
    {
      color = TransferColor(k.Tables[i], x[i]);
    }
    else if (k.Count == 2)
    {
      color = TransferColor(k.Tables[0], x[0]);
    }
    else
    {
      color = { Clamped(x[0], 1.0f), Clamped(x[1], 1.0f), Clamped(x[2], 1.0f) };
    }
    if (c.Scene.Shade)
    {
      color = LitColor(k.Lit[i], color, p.N[i], c.Light, t);
    }
    const F emitted = left * k.Weight[i];
    p.Light.Red = p.Light.Red + emitted * color.Red;
    p.Light.Green = p.Light.Green + emitted * color.Green;
    p.Light.Blue = p.Light.Blue + emitted * color.Blue;
  }
  p.Kappa = TogetherOf(k, s);
}

// Whether anything depends on gradients.
TERAVOX_INLINE bool NeedsSlopes(const Context& c)
{
  return c.Scene.Shade || c.Components.ByGradient;
}

// Eight cells, or parts of them.
struct ComponentSegments
{
  Cubic Field[MostComponents];    // in nodes of their tables; red, green, blue in 0..1
  Gradient Slope[MostComponents]; // of emitters, in data per voxel of level 0; if NeedsSlopes()
  Floats Has[MostComponents];     // 1 where an emitter has a value, else 0
  Floats Length;                  // world units
  Floats Begin;                   // depth
};

TERAVOX_INLINE void PointAlong(
  const Context& c, const ComponentSegments& s, Floats u, ComponentPoint<Floats>& p)
{
  const ComponentTables& k = c.Components;
  Floats x[MostComponents] = {};
  for (int i = 0; i < k.Count; ++i)
  {
    x[i] = Along(s.Field[i], u);
  }
  Floats t = s.Begin;
  for (int e = 0; k.ByGradient && e < k.EmitterCount; ++e)
  {
    const int i = k.Emitters[e];
    p.G[i] = GradientAlong(k.Gradients[i], s.Slope[i], u);
  }
  if (c.Scene.Shade)
  {
    for (int e = 0; e < k.EmitterCount; ++e)
    {
      const int i = k.Emitters[e];
      p.N[i] =
        NormalOf(c.P, Along(s.Slope[i].X, u), Along(s.Slope[i].Y, u), Along(s.Slope[i].Z, u));
    }
    t = s.Begin + u * (s.Length * c.Light.PerWorld);
  }
  FindPoint(c, x, s.Has, t, p);
}

TERAVOX_INLINE Color<Floats> LightPerExtinction(
  const ComponentPoint<Floats>& p, const Color<Floats>& else_)
{
  const Ints any = p.Kappa > LeastKappa;
  const Floats inverse = 1.0f / Select(any, p.Kappa, Splat(1.0f));
  return { Select(any, p.Light.Red * inverse, else_.Red),
    Select(any, p.Light.Green * inverse, else_.Green),
    Select(any, p.Light.Blue * inverse, else_.Blue) };
}

// Where between two ends, as a share of the optical depth between them, light comes from, less a
// half: 1/d - 1/(exp(d) - 1) - 1/2.
TERAVOX_INLINE Floats FrontShare(Floats depth, Floats opacity)
{
  const Floats d = Max(depth, Splat(0.03f));
  const Floats thick = 1.0f / d - (1.0f - opacity) / Max(opacity, Splat(0.01f)) - 0.5f;
  return Select(depth < 0.03f, depth * (-1.0f / 12.0f), thick);
}

// How light changes from `from` to `to`, of which `middle` is the middle.
TERAVOX_INLINE Floats BendOf(
  const Color<Floats>& from, const Color<Floats>& middle, const Color<Floats>& to)
{
  const auto of = [](Floats a, Floats m, Floats b) { return Abs((a - m) + (b - m)); };
  return Max(Max(of(from.Red, middle.Red, to.Red), of(from.Green, middle.Green, to.Green)),
    of(from.Blue, middle.Blue, to.Blue));
}
TERAVOX_INLINE Floats TurnedBetween(const Normal<Floats>& a, const Normal<Floats>& b)
{
  const Ints both =
    (Abs(a.X) + Abs(a.Y) + Abs(a.Z) > 0.0f) & (Abs(b.X) + Abs(b.Y) + Abs(b.Z) > 0.0f);
  const Floats turned = Select(both, 1.0f - ((a.X * b.X + a.Y * b.Y) + a.Z * b.Z), Floats{});
  return turned * turned;
}

// What eight pieces add, from their ends and middles. `mean` and `change`: of the extinctions of
// emitters, and how much they may be off; `varied`: how far opacities by gradient may change, as a
// share of the largest.
inline void Combine(const Context& c, const ComponentPoint<Floats>& a,
  const ComponentPoint<Floats>& m, const ComponentPoint<Floats>& b,
  const Floats (&mean)[MostComponents], const Floats (&change)[MostComponents], Floats varied,
  Floats length, Pieces& out)
{
  const ComponentTables& k = c.Components;
  constexpr float sixth = 1.0f / 6.0f;
  const Floats zero = {};
  const Floats one = Splat(1.0f);
  const Floats tiny = Splat(1.0e-30f);
  Floats simpson[MostComponents] = {};
  Floats trapezoid[MostComponents] = {};
  Color<Floats> emission{ zero, zero, zero }; // mean, of the piece
  Floats unseen = zero;                       // of all extinctions
  Floats unseenLight = zero;
  Floats bent = zero; // light that may be of another colour
  Floats all = zero;
  Floats most = zero;
  Floats changed = zero;
  for (int e = 0; e < k.EmitterCount; ++e)
  {
    const int i = k.Emitters[e];
    const Floats sa = a.Left[i];
    const Floats sm = m.Left[i];
    const Floats sb = b.Left[i];
    simpson[i] = ((sa + sb) + 4.0f * sm) * sixth;
    trapezoid[i] = ((sa + sb) + 2.0f * sm) * 0.25f;
    // The colour of its light: weighted as the three places say, evenly where they see nothing.
    const Ints seen = simpson[i] > 0.0f;
    const Floats scale = sixth / Select(seen, simpson[i], one);
    const Floats wa = Select(seen, sa * scale, Splat(sixth));
    const Floats wm = Select(seen, sm * scale, Splat(sixth)) * 4.0f;
    const Floats wb = Select(seen, sb * scale, Splat(sixth));
    const Floats light = mean[i] * k.Weight[i];
    const auto of = [&](Floats ca, Floats cm, Floats cb)
    { return light * ((wa * ca + wb * cb) + wm * cm); };
    emission.Red = emission.Red + of(a.Own[i].Red, m.Own[i].Red, b.Own[i].Red);
    emission.Green = emission.Green + of(a.Own[i].Green, m.Own[i].Green, b.Own[i].Green);
    emission.Blue = emission.Blue + of(a.Own[i].Blue, m.Own[i].Blue, b.Own[i].Blue);
    const Floats missed = Abs(mean[i] - simpson[i]);
    unseen = unseen + missed;
    const Floats moves = Max(Difference(a.Own[i], m.Own[i]), Difference(m.Own[i], b.Own[i]));
    unseenLight = unseenLight + k.Weight[i] * missed * moves;
    Floats bend = BendOf(a.Own[i], m.Own[i], b.Own[i]) * (c.Scene.Shade ? LitBend : ColorBend);
    if (c.Scene.Shade)
    {
      bend =
        bend + NormalWeight * Max(TurnedBetween(a.N[i], m.N[i]), TurnedBetween(m.N[i], b.N[i]));
    }
    bent = bent + light * bend;
    const Floats larger = Max(mean[i], simpson[i]);
    all = all + larger;
    most = Max(most, larger);
    changed = changed + change[i] * k.PerWeight[i];
  }
  Floats kappa = TogetherOf(k, mean);
  if (k.EmitterCount > 1)
  {
    // What components do together, beyond what their means do; of a piece with one of them nothing.
    const Floats bySimpson =
      ((a.Kappa + b.Kappa) + 4.0f * m.Kappa) * sixth - TogetherOf(k, simpson);
    const Floats byTrapezoid =
      ((a.Kappa + b.Kappa) + 2.0f * m.Kappa) * 0.25f - TogetherOf(k, trapezoid);
    kappa = Max(kappa + bySimpson, zero);
    float perWeight = 0.0f;
    for (int e = 0; e < k.EmitterCount; ++e)
    {
      perWeight = Max(perWeight, k.PerWeight[k.Emitters[e]]);
    }
    changed = 2.0f * changed + RuleWeight * Abs(bySimpson - byTrapezoid) +
      (2.0f * perWeight) * Min(unseen, Max(all - most, zero));
  }
  const Floats depth = kappa * length;
  const Floats opacity = OpacityOf(depth);
  const Ints any = kappa > LeastKappa;
  const Floats inverse = 1.0f / Select(any, kappa, one);
  const auto lit = [&](Floats e)
  { return Select(any, Clamped(e * inverse, k.LargestLight), zero); };
  const Color<Floats> even{ lit(emission.Red), lit(emission.Green), lit(emission.Blue) };
  const Color<Floats> first = LightPerExtinction(a, even);
  const Color<Floats> middle = LightPerExtinction(m, even);
  const Color<Floats> last = LightPerExtinction(b, even);
  // The front of the piece hides its back. The nearer the mean over the optical depth is to one of
  // the ends, the more of the depth has its light: all of it behind the front of a wall.
  const Floats front = FrontShare(depth, opacity);
  const auto seenOf = [&](Floats of, Floats from, Floats to)
  {
    const Floats whole = to - from;
    const Ints changes = Abs(whole) > LeastChange;
    const Floats even4 = 4.0f * Max((of - from) * (to - of), zero);
    const Floats moved = Select(changes, even4 / Select(changes, whole, one), zero);
    return Clamped(of + moved * front, k.LargestLight);
  };
  const Color<Floats> color{ seenOf(even.Red, first.Red, last.Red),
    seenOf(even.Green, first.Green, last.Green), seenOf(even.Blue, first.Blue, last.Blue) };
  ToQuads(color, opacity, out.Color);

  const Floats thick = Min(depth * (1.0f / OpaqueDepth), one);
  const Floats deep = Min(depth, one);
  const Floats perKappa = 1.0f / Max(kappa, tiny);
  const Floats slope = Difference(first, last);
  const Floats bend = BendOf(first, middle, last);
  const Floats uneven = Min(unseen / Max(all, tiny), one);
  const Floats brightest = Max(color.Red, Max(color.Green, color.Blue));
  const Floats shift = (bent + unseenLight) * perKappa +
    (Max(Splat(OpaquePlace), varied) * thick * thick + UnseenPlace * uneven * deep) *
      (slope + bend) +
    LightBendWeight * 0.25f * deep * bend + brightest * deep * Min(changed * perKappa, one);
  const Floats lost = k.ByGradient ? LostOpacity(depth, opacity, changed * length)
                                   : Min(changed * length, one) * (1.0f - opacity);
  out.Error =
    lost * Max(one, brightest) + opacity * (Min(shift, Splat(k.LargestLight)) - c.P.Step[1]);
}

// The same of two components that have one function, of which the second is the row.
template <bool Shade>
__attribute__((noinline)) void EvaluatePlane(
  const Context& c, const ComponentSegments& s, Floats from, Floats to, Pieces& out)
{
  const Floats places[3] = { from, 0.5f * (from + to), to };
  Floats rows[3];
  PlacedSamples at[3];
  for (int i = 0; i < 3; ++i)
  {
    const Floats u = places[i];
    at[i].Node = Along(s.Field[0], u);
    rows[i] = Along(s.Field[1], u);
    at[i].Plain = SamplePlane(c.Plane, c.Gradient, at[i].Node, Max(rows[i], Floats{}));
    at[i].Lit = at[i].Plain.Value;
    if constexpr (Shade)
    {
      const Gradient& g = s.Slope[0];
      at[i].Direction = NormalOf(c.P, Along(g.X, u), Along(g.Y, u), Along(g.Z, u));
      const Floats depth = s.Begin + u * (s.Length * c.Light.PerWorld);
      at[i].Lit = LitColor(c.Components.Lit[0], at[i].Lit, at[i].Direction, c.Light, depth);
    }
  }
  // How far they may be from lines between the three, as BendOf() of gradients.
  const Cubic& f = s.Field[1];
  const Floats half = 0.5f * (to - from);
  const Floats bend =
    Max(Abs(f.C + 3.0f * f.D * from), Abs(f.C + 3.0f * f.D * to)) * (0.25f * half * half);
  const Floats low = Min(rows[0], Min(rows[1], rows[2])) - bend;
  const Floats high = Max(rows[0], Max(rows[1], rows[2])) + bend;
  TakePlaced<Shade>(c, c.Components.Tables[0], at, low, high, (to - from) * s.Length, out);
}

// The parts from `from` to `to` (in 0..1) of eight segments.
__attribute__((noinline)) void EvaluateComponents(
  const Context& c, const ComponentSegments& s, Floats from, Floats to, Pieces& out)
{
  const ComponentTables& k = c.Components;
  if (c.Plane.Nodes != nullptr)
  {
    c.Scene.Shade ? EvaluatePlane<true>(c, s, from, to, out)
                  : EvaluatePlane<false>(c, s, from, to, out);
    return;
  }
  ComponentPoint<Floats> a;
  ComponentPoint<Floats> m;
  ComponentPoint<Floats> b;
  PointAlong(c, s, from, a);
  PointAlong(c, s, 0.5f * (from + to), m);
  PointAlong(c, s, to, b);
  Floats mean[MostComponents] = {};
  Floats change[MostComponents] = {};
  Floats varied = {};
  const Floats size = to - from;
  const Floats size2 = size * size;
  for (int e = 0; e < k.EmitterCount; ++e)
  {
    const int i = k.Emitters[e];
    const Cubic& f = s.Field[i];
    const Floats bendA = f.C + 3.0f * f.D * from;
    const Floats bendB = f.C + 3.0f * f.D * to;
    Extinction x = MeanExtinction(a.S[i], b.S[i], Max(Abs(bendA), Abs(bendB)) * size2,
      (-1.0f / 6.0f) * (bendA + 1.5f * f.D * size) * size2);
    if (k.ByGradient)
    {
      const GradientSample<Floats> places[3] = { a.G[i], m.G[i], b.G[i] };
      varied = Max(varied,
        AttenuateBetween(
          k.Gradients[i], f, s.Slope[i], from, to, a.S[i], m.S[i], b.S[i], places, x));
    }
    mean[i] = x.Mean * s.Has[i];
    change[i] = x.Change * s.Has[i];
  }
  Combine(c, a, m, b, mean, change, varied, size * s.Length, out);
}

// Segments one by one, to be put together anew.
struct ComponentRows
{
  Quad Field[MostComponents][Lanes];
  Quad Slope[MostComponents][3][Lanes];
  float Has[MostComponents][Lanes];
  float Length[Lanes];
  float Begin[Lanes];
};

inline void FillRows(const Context& c, const ComponentSegments& s, ComponentRows& rows)
{
  for (int i = 0; i < c.Components.Count; ++i)
  {
    ToRows(s.Field[i], rows.Field[i]);
    __builtin_memcpy(rows.Has[i], &s.Has[i], sizeof(rows.Has[i]));
    if (NeedsSlopes(c) && c.Components.Weight[i] > 0.0f)
    {
      ToRows(s.Slope[i].X, rows.Slope[i][0]);
      ToRows(s.Slope[i].Y, rows.Slope[i][1]);
      ToRows(s.Slope[i].Z, rows.Slope[i][2]);
    }
  }
  __builtin_memcpy(rows.Length, &s.Length, sizeof(rows.Length));
  __builtin_memcpy(rows.Begin, &s.Begin, sizeof(rows.Begin));
}

inline void ChooseRows(
  const Context& c, const ComponentRows& rows, const int (&lanes)[Lanes], ComponentSegments& s)
{
  for (int i = 0; i < c.Components.Count; ++i)
  {
    s.Field[i] = FromRows(rows.Field[i], lanes);
    if (NeedsSlopes(c) && c.Components.Weight[i] > 0.0f)
    {
      s.Slope[i] = { FromRows(rows.Slope[i][0], lanes), FromRows(rows.Slope[i][1], lanes),
        FromRows(rows.Slope[i][2], lanes) };
    }
    for (int l = 0; l < Lanes; ++l)
    {
      s.Has[i][l] = rows.Has[i][lanes[l]];
    }
  }
  for (int l = 0; l < Lanes; ++l)
  {
    s.Length[l] = rows.Length[lanes[l]];
    s.Begin[l] = rows.Begin[lanes[l]];
  }
}

// Accepts a piece, or cuts it into eight, and so on.
inline void TakeComponents(Context& c, State& state, const ComponentRows& rows, int segment,
  const Pieces& pieces, int lane, float from, float to)
{
  if (!(state.Transmittance * pieces.Error[lane] > c.P.Step[3] && to - from > SmallestPiece))
  {
    Accumulate(state, pieces.Color[lane][3], pieces.Color[lane], pieces.Error[lane]);
    return;
  }
  const int lanes[Lanes] = { segment, segment, segment, segment, segment, segment, segment,
    segment };
  const Floats eighths = { 0.0f, 0.125f, 0.25f, 0.375f, 0.5f, 0.625f, 0.75f, 0.875f };
  const Floats begin = from + (to - from) * eighths;
  const Floats end = from + (to - from) * (eighths + 0.125f);
  ComponentSegments s;
  ChooseRows(c, rows, lanes, s);
  Pieces parts;
  EvaluateComponents(c, s, begin, end, parts);
  c.Steps += 4;
  for (int i = 0; i < Lanes && !IsOver(c, state); ++i)
  {
    TakeComponents(c, state, rows, segment, parts, i, begin[i], end[i]);
  }
}

// Visible segments, cut where one of their fields turns.
inline void TakeSegments(Context& c, State& state, const ComponentSegments& s, unsigned bits)
{
  constexpr int most = Lanes * (2 * MostComponents + 1);
  const ComponentTables& k = c.Components;
  int lane[most];
  float from[most];
  float to[most];
  int count = 0;
  float turns[2 * MostComponents][Lanes];
  for (int e = 0; e < k.EmitterCount; ++e)
  {
    const Turns turn = TurningPoints(s.Field[k.Emitters[e]]);
    __builtin_memcpy(turns[2 * e], &turn.First, sizeof(turn.First));
    __builtin_memcpy(turns[2 * e + 1], &turn.Second, sizeof(turn.Second));
  }
  for (unsigned rest = bits; rest != 0; rest &= rest - 1)
  {
    const int l = __builtin_ctz(rest);
    float begin = 0.0f;
    while (begin < 1.0f)
    {
      float next = 1.0f;
      for (int e = 0; e < 2 * k.EmitterCount; ++e)
      {
        next = turns[e][l] > begin ? Min(next, turns[e][l]) : next;
      }
      lane[count] = l;
      from[count] = begin;
      to[count] = next;
      ++count;
      begin = next;
    }
  }
  ComponentRows rows;
  FillRows(c, s, rows);
  ComponentSegments chosen;
  Pieces pieces;
  float before = state.Transmittance;
  for (int i = 0; i < count && !IsOver(c, state); ++i)
  {
    if (i % Lanes == 0)
    {
      int lanes[Lanes];
      Floats begin;
      Floats end;
      for (int l = 0; l < Lanes; ++l)
      {
        const int at = Min(i + l, count - 1);
        lanes[l] = lane[at];
        begin[l] = from[at];
        end[l] = to[at];
      }
      ChooseRows(c, rows, lanes, chosen);
      EvaluateComponents(c, chosen, begin, end, pieces);
      c.Steps += 4;
    }
    TakeComponents(c, state, rows, lane[i], pieces, i % Lanes, from[i], to[i]);
    if (i + 1 == count || lane[i + 1] != lane[i] || IsOver(c, state))
    {
      c.Report.Evaluated += 1;
      c.Contributing += state.Transmittance < before ? 1 : 0;
      before = state.Transmittance;
    }
  }
}
