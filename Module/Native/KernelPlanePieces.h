// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Pieces of segments of which value and gradient decide together (KernelPlane.h): from both ends
// and the middle. What may lie between these is bounded by the table's changes there.

// Shares of what is seen that are taken as the error of a mean: of the deviation of the middle from
// the line between the ends; of what no place has seen. Likewise of the colour.
constexpr float PlaneBendWeight = 0.25f;
constexpr float PlaneUnseenWeight = 0.25f;
constexpr float PlaneLightBendWeight = 0.25f;

// Evaluate() for such segments.
template <bool Shade>
__attribute__((noinline)) void EvaluatePlane(
  const Context& c, const Segments& s, Floats from, Floats to, Pieces& out)
{
  const Floats one = Splat(1.0f);
  const Floats none = {};
  const Floats places[3] = { from, 0.5f * (from + to), to };
  Floats nodes[3];
  GradientSample<Floats> gradient[3];
  PlaneSample<Floats> samples[3];
  Color<Floats> colors[3];
  Normal<Floats> normals[3];
  for (int i = 0; i < 3; ++i)
  {
    const Floats u = places[i];
    const Floats x = Along(s.Light.X, u);
    const Floats y = Along(s.Light.Y, u);
    const Floats z = Along(s.Light.Z, u);
    nodes[i] = Along(s.Field, u);
    gradient[i] = PlaceGradient(c.Gradient, x, y, z);
    samples[i] = SamplePlane(c.Plane, c.Gradient, nodes[i], gradient[i].Magnitude);
    colors[i] = samples[i].Value;
    if constexpr (Shade)
    {
      normals[i] = NormalOf(c.P, x, y, z);
      const Floats at = s.Begin + u * (s.Length * c.Light.PerWorld);
      colors[i] = LitColor(c.P, colors[i], normals[i], c.Light, at);
    }
  }
  // Where the ends see nothing there is nothing, as for those who skip it.
  const Ints empty = IsEmptyBetween(c.Table, Min(nodes[0], nodes[2]), Max(nodes[0], nodes[2]));
  const Floats sa = Select(empty, none, samples[0].S);
  const Floats sm = Select(empty, none, samples[1].S);
  const Floats sb = Select(empty, none, samples[2].S);
  const Floats least = Min(sa, Min(sm, sb));
  const Floats largest = Max(sa, Max(sm, sb));
  const Floats bend = BendOf(c.Gradient, s.Light, from, to);
  const Floats low =
    Min(LeastBetween(gradient[0], gradient[1]), LeastBetween(gradient[1], gradient[2])) - bend;
  const Floats high =
    Max(gradient[0].Magnitude, Max(gradient[1].Magnitude, gradient[2].Magnitude)) + bend;
  const Floats lastRow = Splat(c.Gradient.Scale[3]);
  const Floats columnA = ColumnOf(c.Plane, nodes[0]);
  const Floats columnB = ColumnOf(c.Plane, nodes[2]);
  const PlaneReach reach = ReachOf(c.Plane, c.Gradient, Min(columnA, columnB),
    Max(columnA, columnB), Min(Max(low, none), lastRow), Min(Max(high, none), lastRow));
  const Floats unseen = Select(empty, none, Max(reach.Extinction - (largest - least), none));
  const Floats off = Abs(sm - 0.5f * (sa + sb));
  // The parabola through the three, half by half.
  const Floats length = (to - from) * s.Length;
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
  const Color<Floats> color = Mix(Mix(colors[0], colors[1], CentroidOf(sa, sm, depthA)),
    Mix(colors[1], colors[2], CentroidOf(sm, sb, depthB)), behind);
  const Floats most = largest + unseen;
  const Floats varied = (most - least) / Max(most, Splat(1.0e-30f));
  const Floats thick = Min(depth * (1.0f / OpaqueDepth), one);
  const Floats uneven = (0.25f * off + PlaneUnseenWeight * unseen) / Max(largest, Splat(1.0e-30f));
  const Floats place =
    Max(OpaquePlace * thick * thick + Min(uneven, one), FrontError(depth, varied));
  const Floats stepA = Difference(colors[0], colors[1]);
  const Floats stepB = Difference(colors[1], colors[2]);
  const Floats sag = Difference(colors[1], Mix(colors[0], colors[2], Splat(0.5f)));
  const Floats seen =
    Difference(samples[0].Value, samples[1].Value) + Difference(samples[1].Value, samples[2].Value);
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
      NormalWeight * Max(turn(normals[0], normals[1]), turn(normals[1], normals[2]));
  }
  else
  {
    shift += Max(stepA, stepB) * place + sag * KinkWeight;
  }
  ToQuads(color, opacity, out.Color);
  const Floats change = (PlaneBendWeight * off + PlaneUnseenWeight * unseen) * length;
  out.Error = LostOpacity(depth, opacity, change) + opacity * (Min(shift, one) - c.P.Step[1]);
}
