// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Pieces of segments of which value and gradient decide together, or the values of two components
// (KernelPlane.h): from both ends and the middle. What may lie between these is bounded by the
// table's changes there.

// Shares of what is seen that are taken as the error of a mean: of the deviation of the middle from
// the line between the ends; of what no place has seen. Likewise of the colour.
constexpr float PlaneBendWeight = 0.25f;
constexpr float PlaneUnseenWeight = 0.25f;
constexpr float PlaneLightBendWeight = 0.25f;

// What is known of a place of eight segments.
struct PlacedSamples
{
  Floats Node;
  PlaneSample<Floats> Plain;
  Color<Floats> Lit;
  Normal<Floats> Direction; // of shaded pictures only
};

// Eight pieces, from their ends and middles. `table`: that bounds the extinction; `low`, `high`:
// the rows that a piece may meet.
template <bool Shade>
TERAVOX_INLINE void TakePlaced(const Context& c, const Transfer& table,
  const PlacedSamples (&at)[3], Floats low, Floats high, Floats length, Pieces& out)
{
  const Floats one = Splat(1.0f);
  const Floats none = {};
  // Where the ends see nothing there is nothing, as for those who skip it.
  const Ints empty =
    IsEmptyBetween(table, Min(at[0].Node, at[2].Node), Max(at[0].Node, at[2].Node));
  const Floats sa = Select(empty, none, at[0].Plain.S);
  const Floats sm = Select(empty, none, at[1].Plain.S);
  const Floats sb = Select(empty, none, at[2].Plain.S);
  const Floats least = Min(sa, Min(sm, sb));
  const Floats largest = Max(sa, Max(sm, sb));
  const Floats lastRow = Splat(c.Gradient.Scale[3]);
  const Floats columnA = ColumnOf(c.Plane, at[0].Node);
  const Floats columnB = ColumnOf(c.Plane, at[2].Node);
  const PlaneReach reach = ReachOf(c.Plane, c.Gradient, Min(columnA, columnB),
    Max(columnA, columnB), Min(Max(low, none), lastRow), Min(Max(high, none), lastRow));
  const Floats unseen = Select(empty, none, Max(reach.Extinction - (largest - least), none));
  const Floats off = Abs(sm - 0.5f * (sa + sb));
  // The parabola through the three, half by half.
  const auto meanOf = [&](Floats outer, Floats other)
  { return Max((5.0f * outer - other) + 8.0f * sm, none) * (1.0f / 12.0f); };
  const Floats depthA = meanOf(sa, sb) * (0.5f * length);
  const Floats depthB = meanOf(sb, sa) * (0.5f * length);
  const Floats depth = depthA + depthB;
  const Floats opacity = OpacityOf(depth);
  const Floats opacityA = OpacityOf(depthA);
  const Floats share = Select(
    opacity > none, ((one - opacityA) * OpacityOf(depthB)) / Max(opacity, Splat(1.0e-37f)), none);
  const Floats behind = Min(share, one);
  const Color<Floats> color = Mix(Mix(at[0].Lit, at[1].Lit, CentroidOf(sa, sm, depthA)),
    Mix(at[1].Lit, at[2].Lit, CentroidOf(sm, sb, depthB)), behind);
  const Floats most = largest + unseen;
  const Floats varied = (most - least) / Max(most, Splat(1.0e-30f));
  const Floats thick = Min(depth * (1.0f / OpaqueDepth), one);
  const Floats uneven = (0.25f * off + PlaneUnseenWeight * unseen) / Max(largest, Splat(1.0e-30f));
  const Floats place =
    Max(OpaquePlace * thick * thick + Min(uneven, one), FrontError(depth, varied));
  const Floats stepA = Difference(at[0].Lit, at[1].Lit);
  const Floats stepB = Difference(at[1].Lit, at[2].Lit);
  const Floats sag = Difference(at[1].Lit, Mix(at[0].Lit, at[2].Lit, Splat(0.5f)));
  const Floats seen = Difference(at[0].Plain.Value, at[1].Plain.Value) +
    Difference(at[1].Plain.Value, at[2].Plain.Value);
  Floats shift = PlaneUnseenWeight * Max(reach.Color - seen, none);
  if constexpr (Shade)
  {
    const auto isThere = [](const Normal<Floats>& n)
    { return Abs(n.X) + Abs(n.Y) + Abs(n.Z) > 0.0f; };
    const auto turn = [&](const Normal<Floats>& a, const Normal<Floats>& b)
    {
      const Floats turned = one - ((a.X * b.X + a.Y * b.Y) + a.Z * b.Z);
      return Select(isThere(a) & isThere(b), turned * turned, none);
    };
    shift += Max(stepA, stepB) * (LightWeight + place) + sag * PlaneLightBendWeight +
      NormalWeight *
        Max(turn(at[0].Direction, at[1].Direction), turn(at[1].Direction, at[2].Direction));
  }
  else
  {
    shift += Max(stepA, stepB) * place + sag * KinkWeight;
  }
  ToQuads(color, opacity, out.Color);
  const Floats change = (PlaneBendWeight * off + PlaneUnseenWeight * unseen) * length;
  out.Error = LostOpacity(depth, opacity, change) + opacity * (Min(shift, one) - c.P.Step[1]);
}

#if !TERAVOX_COMPONENTS
// Evaluate() for such segments.
template <bool Shade>
__attribute__((noinline)) void EvaluatePlane(
  const Context& c, const Segments& s, Floats from, Floats to, Pieces& out)
{
  const Floats places[3] = { from, 0.5f * (from + to), to };
  GradientSample<Floats> gradient[3];
  PlacedSamples at[3];
  for (int i = 0; i < 3; ++i)
  {
    const Floats u = places[i];
    const Floats x = Along(s.Light.X, u);
    const Floats y = Along(s.Light.Y, u);
    const Floats z = Along(s.Light.Z, u);
    at[i].Node = Along(s.Field, u);
    gradient[i] = PlaceGradient(c.Gradient, x, y, z);
    at[i].Plain = SamplePlane(c.Plane, c.Gradient, at[i].Node, gradient[i].Magnitude);
    at[i].Lit = at[i].Plain.Value;
    if constexpr (Shade)
    {
      at[i].Direction = NormalOf(c.P, x, y, z);
      const Floats depth = s.Begin + u * (s.Length * c.Light.PerWorld);
      at[i].Lit = LitColor(c.P, at[i].Lit, at[i].Direction, c.Light, depth);
    }
  }
  const Floats bend = BendOf(c.Gradient, s.Light, from, to);
  const Floats low =
    Min(LeastBetween(gradient[0], gradient[1]), LeastBetween(gradient[1], gradient[2])) - bend;
  const Floats high =
    Max(gradient[0].Magnitude, Max(gradient[1].Magnitude, gradient[2].Magnitude)) + bend;
  TakePlaced<Shade>(c, c.Table, at, low, high, (to - from) * s.Length, out);
}
#endif
