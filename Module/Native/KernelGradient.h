// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Opacity by gradient: the extinction times a function of the gradient's magnitude, from a table
// over it (GradientTable, Shaders/Library/GradientOpacity.glsl). Of each half of a piece of a ray
// the extinction alone is known exactly in the mean, from its integral; what the two make together
// is taken from the ends of the piece and its middle (GradientPieces.glsl).

// A gradient, in nodes of the table, and the opacity that it leaves.
template <typename F>
struct GradientSample
{
  F X;
  F Y;
  F Z;
  F Magnitude; // as far as it matters
  F Opacity;
  F Slope; // per node
};

template <typename F>
TERAVOX_INLINE void LoadGradientNode(
  const GradientOpacityTable& table, F x, F& fraction, F (&node)[4])
{
  const F last = F{} + table.Scale[3];
  const F within = Min(Max(x, F{}), last);
  const auto i = Truncate(Min(within, last - 1.0f));
  fraction = within - ToFloat(i);
  LoadFour(table.Nodes, i, node);
}

// From the central difference per axis in voxels of level 0: all but the opacity. Beside voxels
// without a value there is no gradient.
template <typename F>
TERAVOX_INLINE GradientSample<F> PlaceGradient(const GradientOpacityTable& table, F x, F y, F z)
{
  const Vec& scale = table.Scale;
  GradientSample<F> r;
  r.X = x * scale[0];
  r.Y = y * scale[1];
  r.Z = z * scale[2];
  const F magnitude = SquareRoot((r.X * r.X + r.Y * r.Y) + r.Z * r.Z);
  r.Magnitude = Min(Max(magnitude, F{}), F{} + 2.0f * scale[3]);
  r.Opacity = r.Slope = F{};
  return r;
}

template <typename F>
TERAVOX_INLINE GradientSample<F> SampleGradient(const GradientOpacityTable& table, F x, F y, F z)
{
  const Vec& scale = table.Scale;
  GradientSample<F> r = PlaceGradient(table, x, y, z);
  F fraction;
  F node[4];
  LoadGradientNode(table, r.Magnitude, fraction, node);
  r.Slope = Select(r.Magnitude < F{} + scale[3], node[2] - node[0], F{});
  r.Opacity = node[0] + fraction * (node[2] - node[0]);
  return r;
}

// How far the opacity moves between two magnitudes in nodes, from <= to.
TERAVOX_INLINE Floats GradientVariation(const GradientOpacityTable& table, Floats from, Floats to)
{
  const auto at = [&](Floats x)
  {
    Floats fraction;
    Floats node[4];
    LoadGradientNode(table, x, fraction, node);
    return node[1] + fraction * (node[3] - node[1]);
  };
  return at(to) - at(from);
}

// Shares of what is seen that are taken as the error of a mean: of the difference between Simpson's
// rule and the trapezoidal one; of the deviation of the opacity between two places from what the
// slopes at them say; of what it may do at magnitudes that no place has seen; of extinction of
// which it isn't known where in half a piece it is, and that the opacity changes there.
constexpr float ProductRuleWeight = 0.25f;
constexpr float ProductKinkWeight = 0.25f;
constexpr float ProductUnseenWeight = 0.25f;
constexpr float ProductPlaceWeight = 0.5f;
constexpr float DenseWeight = 2.0f;

// The least magnitude on the line between two gradients.
TERAVOX_INLINE Floats LeastBetween(const GradientSample<Floats>& a, const GradientSample<Floats>& b)
{
  const Floats x = b.X - a.X;
  const Floats y = b.Y - a.Y;
  const Floats z = b.Z - a.Z;
  const Floats square = Max((x * x + y * y) + z * z, Splat(1.0e-30f));
  const Floats along = -((a.X * x + a.Y * y) + a.Z * z) / square;
  const Floats t = Min(Max(along, Floats{}), Splat(1.0f));
  const Floats px = a.X + t * x;
  const Floats py = a.Y + t * y;
  const Floats pz = a.Z + t * z;
  return SquareRoot((px * px + py * py) + pz * pz);
}

// Of half a piece, from its outer end to its inner one: the extinction's exact mean less that of
// the parabola through `outer`, `inner` and `other`, the extinction at the ends and the middle of
// the piece. It lies somewhere there: for it the opacity is that in the middle of the half.
struct HalfPiece
{
  Floats Rest;
  Floats Opacity;
  Floats Change; // of the opacity
  Floats Kink;   // how far it may be from what its ends say
};
TERAVOX_INLINE HalfPiece HalfOf(Floats mean, Floats outer, Floats inner, Floats other,
  const GradientSample<Floats>& a, const GradientSample<Floats>& b)
{
  HalfPiece h;
  h.Rest = mean - ((5.0f * outer - other) + 8.0f * inner) * (1.0f / 12.0f);
  h.Opacity = 0.5f * (a.Opacity + b.Opacity);
  const Floats chord = b.Opacity - a.Opacity;
  const Floats dx = b.Magnitude - a.Magnitude;
  h.Change = Abs(chord);
  h.Kink = Max(Abs(a.Slope * dx - chord), Abs(chord - b.Slope * dx));
  return h;
}

// Turns the mean extinction of pieces, whose halves have those of `first` and `last`, into what the
// gradient leaves of it. `s`: the extinction at the ends and in the middle; `bend`: how far the
// gradient may be from the lines between the three, in nodes. Returns how far the opacity may
// change there, as a share of the largest.
inline Floats AttenuateMean(const GradientOpacityTable& table, const Extinction& first,
  const Extinction& last, const Floats (&s)[3], const GradientSample<Floats> (&gradient)[3],
  Floats bend, Extinction& e)
{
  const Floats ga = gradient[0].Opacity;
  const Floats gm = gradient[1].Opacity;
  const Floats gb = gradient[2].Opacity;
  const HalfPiece front = HalfOf(first.Mean, s[0], s[1], s[2], gradient[0], gradient[1]);
  const HalfPiece back = HalfOf(last.Mean, s[2], s[1], s[0], gradient[2], gradient[1]);
  const Floats pa = s[0] * ga;
  const Floats pm = s[1] * gm;
  const Floats pb = s[2] * gb;
  const Floats mean = 0.5f * (first.Mean + last.Mean);
  const Floats bySimpson = ((pa + pb) + 4.0f * pm) * (1.0f / 6.0f) +
    0.5f * (front.Rest * front.Opacity + back.Rest * back.Opacity);
  const Floats byTrapezoid = ((pa + pb) + 2.0f * pm) * 0.25f +
    0.5f *
      ((first.Mean - 0.5f * (s[0] + s[1])) * front.Opacity +
        (last.Mean - 0.5f * (s[1] + s[2])) * back.Opacity);
  const Floats least = Min(ga, Min(gm, gb));
  const Floats largest = Max(ga, Max(gm, gb));
  const Floats from =
    Min(LeastBetween(gradient[0], gradient[1]), LeastBetween(gradient[1], gradient[2])) - bend;
  const Floats to =
    Max(gradient[0].Magnitude, Max(gradient[1].Magnitude, gradient[2].Magnitude)) + bend;
  const Floats unseen = Max(GradientVariation(table, from, to) - (largest - least), Floats{});
  const auto place = [&](const HalfPiece& h) { return Abs(h.Rest) * (h.Change + h.Kink + unseen); };
  // Where the ends, and what lies between them, see nothing there is nothing, as for those who skip
  // it. The mean alone doesn't say so: what the field's bend takes from it may leave nothing.
  const Ints any = (s[0] + s[2]) + e.Uneven > 0.0f;
  e.Mean = Select(any, Min(Max(bySimpson, mean * least), mean * largest), Floats{});
  e.Uneven = Abs(e.Mean - 0.5f * (pa + pb));
  const Floats change = 0.5f * (first.Change + last.Change) * Min(largest + unseen, Splat(1.0f)) +
    ProductRuleWeight * Abs(bySimpson - byTrapezoid) +
    (0.5f * ProductPlaceWeight) * (place(front) + place(back)) +
    mean * ((0.5f * ProductKinkWeight) * (front.Kink + back.Kink) + ProductUnseenWeight * unseen);
  e.Change = Select(any, change, Floats{});
  const Floats most = largest + unseen;
  return (most - least) / Max(most, Splat(1.0e-30f));
}

// How far the gradient may be from a line between the middle and an end of parts of segments: at
// most an eighth of its second derivative times the square of half their size, in nodes.
TERAVOX_INLINE Floats BendOf(
  const GradientOpacityTable& table, const Gradient& gradient, Floats from, Floats to)
{
  const auto square = [&](Floats u)
  {
    const auto second = [&](const Cubic& g, float scale) { return (g.C + 3.0f * g.D * u) * scale; };
    const Vec& scale = table.Scale;
    const Floats x = second(gradient.X, scale[0]);
    const Floats y = second(gradient.Y, scale[1]);
    const Floats z = second(gradient.Z, scale[2]);
    return (x * x + y * y) + z * z;
  };
  const Floats size = 0.5f * (to - from);
  return SquareRoot(Max(square(from), square(to))) * (0.25f * size * size);
}

// Turns the mean extinction of parts of segments, of which `a`, `m` and `b` are the ends and the
// middle, into what the gradient leaves of it. Returns what AttenuateMean() does.
inline Floats AttenuateBetween(const GradientOpacityTable& table, const Cubic& field,
  const Gradient& gradient, Floats from, Floats to, const Sample<Floats>& a,
  const Sample<Floats>& m, const Sample<Floats>& b, const GradientSample<Floats> (&places)[3],
  Extinction& e)
{
  const Floats half = 0.5f * (from + to);
  const Floats size = 0.5f * (to - from);
  const auto meanOf = [&](const Sample<Floats>& begin, const Sample<Floats>& end, Floats u)
  {
    const Floats bend = field.C + 3.0f * field.D * u;
    const Floats bendBehind = bend + 3.0f * field.D * size;
    return MeanExtinction(begin, end, Max(Abs(bend), Abs(bendBehind)) * (size * size),
      (-1.0f / 6.0f) * (bend + 1.5f * field.D * size) * (size * size));
  };
  const Floats bend = BendOf(table, gradient, from, to);
  const Floats s[3] = { a.S, m.S, b.S };
  return AttenuateMean(table, meanOf(a, m, from), meanOf(m, b, half), s, places, bend, e);
}

TERAVOX_INLINE GradientSample<Floats> GradientAlong(
  const GradientOpacityTable& table, const Gradient& gradient, Floats u)
{
  return SampleGradient(table, Along(gradient.X, u), Along(gradient.Y, u), Along(gradient.Z, u));
}

// The same, and of the extinctions at the ends.
inline Floats Attenuate(const GradientOpacityTable& table, const Cubic& field,
  const Gradient& gradient, Floats from, Floats to, Sample<Floats>& a, const Sample<Floats>& m,
  Sample<Floats>& b, Extinction& e)
{
  const GradientSample<Floats> places[3] = { GradientAlong(table, gradient, from),
    GradientAlong(table, gradient, 0.5f * (from + to)), GradientAlong(table, gradient, to) };
  const Floats varied = AttenuateBetween(table, field, gradient, from, to, a, m, b, places, e);
  a.S = a.S * places[0].Opacity;
  b.S = b.S * places[2].Opacity;
  return varied;
}

// How far off the opacity of a piece may be, whose optical depth may be so by `change`, by the
// estimates of shares of the piece. Through a dense one light comes where gradients leave nothing:
// it matters more how long that is than how much is missing in the mean.
TERAVOX_INLINE Floats LostOpacity(Floats depth, Floats opacity, Floats change)
{
  const Floats one = Splat(1.0f);
  const Floats off = change * (1.0f + DenseWeight * Min(depth * 0.25f, one));
  const Floats less = opacity - OpacityOf(Max(depth - off, Floats{}));
  return Max(less, Min(change, one) * (1.0f - opacity));
}
