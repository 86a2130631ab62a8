// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Eight samples of a smooth field at once, several voxels apart: where all that lies between them
// is bounded by the ranges of the cells, and where pieces of twice the length say the same, the
// cells needn't be looked at one by one.

constexpr int SpanPieces = Lanes - 1;
// Longest distance of samples, in voxels, and the first that is tried: in pictures exact to a grey
// level samples next to each other mostly fail, and are taken in vain then.
constexpr float LongestStep = 8.0f;
constexpr float FirstStep = 1.0f;
constexpr float FirstFineStep = 2.0f;
constexpr float FineError = 1.5f / 255.0f / 16.0f; // of a piece that adds nothing
constexpr float ShortestSpan = 3.0f;               // first steps
// Spans that may fail in a brick before there are no more.
constexpr int MostFailures = 2;
// Shares of what is seen that are taken as the error: of the difference between pieces and pairs of
// pieces (a third of it for a smooth field), and of what the cells' ranges allow but no sample saw.
constexpr float PairWeight = 0.2f;
// Of what the bend of the field may do where the function is uneven.
constexpr float SpanBendWeight = 1.0f;
constexpr float LitPairWeight = 0.4f;
constexpr float UnseenWeight = 0.25f;
// How much more may lie between the bounds of the extinction for samples to be tried: of those with
// twice as much one in thirty is accepted (counted in noise, waves, shells and a sponge).
constexpr float MostUneven = 2.0f;

// Eight places of a brick, and the field there.
struct Places
{
  Offsets At;
  Vectors Within; // from the voxel before
  Corners Around;
  Floats Node; // of the transfer table; NaN where a voxel has no value
};
template <typename T>
inline Places PlacesAt(const Context& c, const BrickView& view, const Walk& walk, Floats t)
{
  Places p;
  const auto along = [&](int a, Floats& within)
  {
    const Floats q = walk.First[a] + t * walk.Direction[a];
    const Ints cell = InSlot(q, 1, view.Edge - 3);
    within = q - ToFloat(cell);
    return cell;
  };
  const Ints x = along(0, p.Within.X);
  const Ints y = along(1, p.Within.Y);
  const Ints z = along(2, p.Within.Z);
  p.At = OffsetsOf<T>(x + view.Edge * (y + view.Edge * z));
  p.Around = LoadCorners<T>(view, p.At);
  const Vectors nowhere{ Floats{}, Floats{}, Floats{} };
  p.Node = NodeOf(c.Table, view, CubicAlong(p.Around, p.Within, nowhere).A);
  return p;
}

#if TERAVOX_GRADIENT_OPACITY
template <typename T>
inline GradientSample<Floats> GradientAt(const Context& c, const BrickView& view, const Places& p)
{
  const Vectors nowhere{ Floats{}, Floats{}, Floats{} };
  const Gradient g = LoadGradient<T>(view, p.At, p.Around, p.Within, nowhere);
  const Floats x = g.X.A * view.PerVoxelX;
  const Floats y = g.Y.A * view.PerVoxelY;
  const Floats z = g.Z.A * view.PerVoxelZ;
  return c.Gradient.Nodes != nullptr ? SampleGradient(c.Gradient, x, y, z)
                                     : PlaceGradient(c.Gradient, x, y, z);
}
#endif

template <typename T>
inline Normal<Floats> NormalAt(const Context& c, const BrickView& view, const Places& p)
{
  const Vectors nowhere{ Floats{}, Floats{}, Floats{} };
  const Gradient g = LoadGradient<T>(view, p.At, p.Around, p.Within, nowhere);
  return NormalOf(c.P, g.X.A * view.PerVoxelX, g.Y.A * view.PerVoxelY, g.Z.A * view.PerVoxelZ);
}

// Lane i + n in lane i.
template <int N>
TERAVOX_INLINE Floats Ahead(Floats v)
{
  return N == 1 ? __builtin_shufflevector(v, v, 1, 2, 3, 4, 5, 6, 7, 7)
                : __builtin_shufflevector(v, v, 2, 3, 4, 5, 6, 7, 7, 7);
}
template <int N>
TERAVOX_INLINE Sample<Floats> Ahead(const Sample<Floats>& s)
{
  return { Ahead<N>(s.X), Ahead<N>(s.S), Ahead<N>(s.Slope), Ahead<N>(s.High), Ahead<N>(s.Low) };
}
template <int N>
TERAVOX_INLINE Color<Floats> Ahead(const Color<Floats>& c)
{
  return { Ahead<N>(c.Red), Ahead<N>(c.Green), Ahead<N>(c.Blue) };
}
// What is known of the pairs that begin at the first six samples, for each of the seven pieces: the
// larger of the pairs that it belongs to.
TERAVOX_INLINE Floats OfPieces(Floats pairs)
{
  return Max(__builtin_shufflevector(pairs, pairs, 0, 1, 2, 3, 4, 5, 5, 5),
    __builtin_shufflevector(pairs, pairs, 0, 0, 1, 2, 3, 4, 5, 5));
}
TERAVOX_INLINE float LargestLane(Floats v)
{
  const Floats a = Max(v, __builtin_shufflevector(v, v, 4, 5, 6, 7, 0, 1, 2, 3));
  const Floats b = Max(a, __builtin_shufflevector(a, a, 2, 3, 0, 1, 6, 7, 4, 5));
  return Max(b[0], b[1]);
}

// Depth that a ray needs for the length of a voxel.
inline float VoxelDepth(const Walk& w)
{
  return 1.0f /
    SquareRoot((w.Direction[0] * w.Direction[0] + w.Direction[1] * w.Direction[1]) +
      w.Direction[2] * w.Direction[2]);
}

// How far a ray meets cells of CELL_EDGE^3 voxels that may be visible as a whole and have more than
// one value, and the range of their texels.
struct Reach
{
  float End;
  TexelRange Range;
};
template <typename T>
inline Reach LookAhead(const BrickView& view, const Walk& w, Quad at, float t, float wanted)
{
  Reach reach{ t, { FarAway, -FarAway } };
#if TERAVOX_MASK
  const int mask = MaskOf<T>(view, IndexOf(view, at));
#endif
  while (reach.End < wanted && !IsOutside(view, at))
  {
    const CellPlace place = PlaceOf(view, at);
    if (!place.MayBeSeen() || place.IsUniform())
    {
      break;
    }
#if TERAVOX_MASK
    if (mask < 0 || MaskOf<T>(view, place.Range) != mask)
    {
      break;
    }
#endif
    const TexelRange range = RangeOf<T>(view, place.Range);
    reach.Range.Least = Min(reach.Range.Least, range.Least);
    reach.Range.Largest = Max(reach.Range.Largest, range.Largest);
    const Quad exits =
      (FacesAhead(w, at, static_cast<float>(shared::CELL_EDGE)) - w.First) * w.Inverse;
    const Quad next = LeastOfThree(exits);
    reach.End = Max(next[0], reach.End);
    at += exits <= next ? w.Move : Quad{};
  }
  reach.End = Min(reach.End, wanted);
  return reach;
}

// Bounds of the extinction over a range of texels, and what samples `step` apart may miss of it.
struct Bounds
{
  float From; // in nodes
  float To;
  float Low;
  float High;
  float Weight;  // optical depth that is taken as the error, per extinction that no sample saw
  float Allowed; // error
};
TERAVOX_INLINE Bounds BoundsOf(const Context& c, const State& state, const Ray& ray,
  const BrickView& view, float step, const TexelRange& range)
{
  Bounds b;
  b.From = NodeOf(c.Table, view, range.Least);
  b.To = NodeOf(c.Table, view, range.Largest);
  ExtremesBetween(c.Table, b.From, b.To, b.Low, b.High);
  b.Weight = step * ray.World * UnseenWeight;
  b.Allowed = c.P.Step[3] / state.Transmittance;
  return b;
}
// Whether it is worth while to take samples: else they would surely not find the field smooth.
TERAVOX_INLINE bool IsEvenEnough(const Bounds& b)
{
  return (b.High - b.Low) * b.Weight <= MostUneven * b.Allowed;
}

// From t0 as far as it was looked ahead. Returns the estimated error in units of what is allowed;
// where that is more than 1 nothing has been added, and where it is Uneven no sample was taken.
constexpr float Uneven = 4.0f;
template <typename T, bool Shade>
__attribute__((noinline)) float IntegrateSpan(Context& c, State& state, const Ray& ray,
  const BrickView& view, const Walk& walk, float t0, const Reach& reach)
{
  const Floats one = Splat(1.0f);
  const Floats steps = { 0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f };
  const float step = (reach.End - t0) * (1.0f / static_cast<float>(SpanPieces));
  const Bounds bounds = BoundsOf(c, state, ray, view, step, reach.Range);
  if (!IsEvenEnough(bounds))
  {
    return Uneven;
  }
  const Places places = PlacesAt<T>(c, view, walk, t0 + step * steps);
  const Sample<Floats> a = SampleTransfer(c.Table, places.Node);
  c.Steps += SpanPieces;
  c.Samples += SpanPieces;
  c.Report.Evaluated += SpanPieces;
  // What the samples didn't see; no value anywhere is for the cells to find out.
  const float highest = LargestLane(a.S);
  const float lowest = -LargestLane(-a.S);
  const float unseen = Max(bounds.High - highest, lowest - bounds.Low) * bounds.Weight;
  if (!(unseen <= bounds.Allowed) || Bits(a.X == a.X) != 0xffu)
  {
    return 2.0f;
  }
  // Likewise of the colours.
  const float unseenColors = Max(VariationBetween(c.Table, bounds.From, -LargestLane(-a.X)),
                               VariationBetween(c.Table, LargestLane(a.X), bounds.To)) *
    (bounds.Weight * highest);
  if (!(unseenColors <= bounds.Allowed))
  {
    return 2.0f;
  }
  Color<Floats> slopeA;
  Color<Floats> colorA = TransferColor(c.Table, a.X, slopeA);
  const Color<Floats> plain = colorA;
  Floats turned = {};
  if constexpr (Shade)
  {
    c.Report.Gradients += SpanPieces;
    const Normal<Floats> n = NormalAt<T>(c, view, places);
    colorA = LitColor(c.P, colorA, n, c.Light, t0 + step * steps);
    turned = one - ((n.X * Ahead<1>(n.X) + n.Y * Ahead<1>(n.Y)) + n.Z * Ahead<1>(n.Z));
  }
  const Sample<Floats> b = Ahead<1>(a);
  const Color<Floats> colorB = Ahead<1>(colorA);
  // How far the field bends away from the lines between samples, by its second differences.
  const Sample<Floats> second = Ahead<2>(a);
  const Floats bend = OfPieces(Abs((a.X - b.X) - (b.X - second.X)));
  const Extinction fine = MeanExtinction(a, b, bend, Floats{});
  const Floats mean = fine.Mean;
  const Floats pair = MeanExtinction(a, second, Floats{}, Floats{}).Mean;
  const Floats length = Splat(step * ray.World);
  const Floats depth = mean * length;
  const Floats opacity = OpacityOf(depth);
  const Floats gathered = CentroidOf(a.S, b.S, depth);
  Color<Floats> color = Mix(colorA, colorB, gathered);
  const Floats off = (OfPieces(Abs(pair - 0.5f * (mean + Ahead<1>(mean)))) * PairWeight +
                       fine.Change * SpanBendWeight) *
    length;
  const Floats between = OfPieces(Difference(colorB, Mix(colorA, Ahead<2>(colorA), Splat(0.5f))));
  const Kink kink = KinkOf(plain, slopeA, Ahead<1>(plain), Ahead<1>(slopeA), b.X - a.X);
  Floats kinkError = kink.Error;
  if constexpr (Shade)
  {
    // What a kink does to lit colours isn't known.
    const Floats none = {};
    kinkError += Difference(kink.Mean, Color<Floats>{ none, none, none });
  }
  else
  {
    color = Moved(color, kink.Mean);
  }
  const Floats place = PlaceError(fine, depth);
  const Floats shift = between * (Shade ? LitPairWeight : PairWeight) +
    Difference(colorA, colorB) * (place + BendWeight * fine.Off + (Shade ? LightWeight : 0.0f)) +
    kinkError + NormalWeight * turned * turned;
  const Floats error = ErrorOf(c, opacity, off, shift);
  const float worst = LargestLane(Select(FirstLanes(SpanPieces), error, Floats{}));
  if (!(worst <= bounds.Allowed))
  {
    return 2.0f;
  }
  Quad colors[Lanes];
  ToQuads(color, opacity, colors);
  state.Error += state.Transmittance * (unseen + unseenColors);
  for (int i = 0; i < SpanPieces && !IsOver(c, state); ++i)
  {
    c.Contributing += colors[i][3] > 0.0f ? 1 : 0;
    Accumulate(state, colors[i][3], colors[i], error[i]);
  }
  return Max(worst, unseen) / bounds.Allowed;
}
