// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Eight samples of a smooth field at once, several voxels apart: where all that lies between them
// is bounded by the ranges of the cells, and where pieces of twice the length say the same, the
// cells needn't be looked at one by one.

constexpr int SpanPieces = Lanes - 1;
// Longest and shortest distance of samples, in voxels.
constexpr float LongestStep = 8.0f;
constexpr float FirstStep = 2.0f;
constexpr float ShortestSpan = 6.0f; // voxels
// Spans that may fail in a brick before there are no more.
constexpr int MostFailures = 2;
// Shares of what is seen that are taken as the error: of the difference between pieces and pairs of
// pieces (a third of it for a smooth field), and of what the cells' ranges allow but no sample saw.
constexpr float PairWeight = 0.2f;
// Of what the bend of the field may do where the function is uneven.
constexpr float SpanBendWeight = 1.0f;
constexpr float LitPairWeight = 0.4f;
constexpr float UnseenWeight = 0.25f;
// How much more may lie between the bounds of the extinction for samples to be tried.
constexpr float MostUneven = 32.0f;

// Position in nodes at eight places of a brick; NaN where a voxel has no value.
template <typename T>
inline Floats FieldAt(
  const Context& c, const BrickView& view, const Walk& walk, Floats t, Offsets& at, Vectors& w)
{
  const auto along = [&](int a, Ints& cell, Floats& within)
  {
    const Floats q = walk.First[a] + t * walk.Direction[a];
    cell = InSlot(q, 1, view.Edge - 3);
    within = q - ToFloat(cell);
  };
  Ints x;
  Ints y;
  Ints z;
  along(0, x, w.X);
  along(1, y, w.Y);
  along(2, z, w.Z);
  at = OffsetsOf<T>(x + view.Edge * (y + view.Edge * z));
  const Vectors nowhere{ Floats{}, Floats{}, Floats{} };
  const Floats texel = CubicAlong(LoadCorners<T>(view, at), w, nowhere).A;
  return (texel * view.Scale + view.Offset) * c.Table.NodesPerUnit;
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

// Whether samples `step` apart may find a field smooth whose values lie between two positions.
TERAVOX_INLINE bool IsEvenEnough(
  const Context& c, const State& state, const Ray& ray, float step, float least, float largest)
{
  float low = 0;
  float high = 0;
  ExtremesBetween(c.Table, least, largest, low, high);
  return (high - low) * (step * ray.World * UnseenWeight) * state.Transmittance <=
    MostUneven * c.P.Step[3];
}

// From t0 to t1, where values lie between `least` and `largest` (nodes). Returns the estimated
// error in units of what is allowed; where that is more than 1 nothing has been added.
template <typename T, bool Shade>
__attribute__((noinline)) float IntegrateSpan(Context& c, State& state, const Ray& ray,
  const BrickView& view, const Walk& walk, float t0, float t1, float least, float largest)
{
  const Floats one = Splat(1.0f);
  const Floats steps = { 0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f };
  const float step = (t1 - t0) * (1.0f / static_cast<float>(SpanPieces));
  float low = 0;
  float high = 0;
  ExtremesBetween(c.Table, least, largest, low, high);
  const float weight = step * ray.World * UnseenWeight;
  const float allowed = c.P.Step[3] / state.Transmittance;
  if (!((high - low) * weight <= MostUneven * allowed))
  {
    return 2.0f; // surely more than samples would find to be smooth
  }
  Offsets at;
  Vectors within;
  const Sample<Floats> a =
    SampleTransfer(c.Table, FieldAt<T>(c, view, walk, t0 + step * steps, at, within));
  c.Steps += SpanPieces;
  c.Samples += SpanPieces;
  // What the samples didn't see; no value anywhere is for the cells to find out.
  const float highest = LargestLane(a.S);
  const float lowest = -LargestLane(-a.S);
  const float unseen = Max(high - highest, lowest - low) * weight;
  if (!(unseen <= allowed) || Bits(a.X == a.X) != 0xffu)
  {
    return 2.0f;
  }
  Color<Floats> slopeA;
  Color<Floats> colorA = TransferColor(c.Table, a.X, slopeA);
  const Color<Floats> plain = colorA;
  Floats turned = {};
  if constexpr (Shade)
  {
    const Vectors nowhere{ Floats{}, Floats{}, Floats{} };
    const Gradient g = LoadGradient<T>(view, at, LoadCorners<T>(view, at), within, nowhere);
    const Normal<Floats> n =
      NormalOf(c.P, g.X.A * view.PerVoxelX, g.Y.A * view.PerVoxelY, g.Z.A * view.PerVoxelZ);
    colorA = LitColor(c.P, colorA, n, c.TowardsLight);
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
  const Floats gathered = CentroidOf(a.S, b.S, depth, opacity);
  const Color<Floats> color = Mix(colorA, colorB, gathered);
  const Floats off = (OfPieces(Abs(pair - 0.5f * (mean + Ahead<1>(mean)))) * PairWeight +
                       fine.Change * SpanBendWeight) *
    length;
  const Floats thick = Min(depth, one);
  const Floats between = OfPieces(Difference(colorB, Mix(colorA, Ahead<2>(colorA), Splat(0.5f))));
  const Color<Floats> next = Ahead<1>(plain);
  const Color<Floats> chord{ next.Red - plain.Red, next.Green - plain.Green,
    next.Blue - plain.Blue };
  const Floats dx = b.X - a.X;
  const Floats kink =
    Max(Difference(chord, Times(slopeA, dx)), Difference(chord, Times(Ahead<1>(slopeA), dx)));
  const Floats place =
    OpaquePlace * thick * thick + 0.25f * fine.Uneven / Max(mean, Splat(1.0e-30f));
  const Floats shift = between * (Shade ? LitPairWeight : PairWeight) +
    Difference(colorA, colorB) * (place + BendWeight * fine.Off + (Shade ? LightWeight : 0.0f)) +
    KinkWeight * kink + NormalWeight * turned * turned;
  const Floats error = Min(off, one) * (1.0f - opacity) + opacity * (Min(shift, one) - c.P.Step[1]);
  const float worst = LargestLane(Select(FirstLanes(SpanPieces), error, Floats{}));
  if (!(worst <= allowed))
  {
    return 2.0f;
  }
  const Floats channels[4] = { color.Red, color.Green, color.Blue, opacity };
  Quad colors[Lanes];
  Transpose(channels, colors);
  for (int i = 0; i < SpanPieces && !IsOver(c, state); ++i)
  {
    c.Contributing += colors[i][3] > 0.0f ? 1 : 0;
    Accumulate(state, colors[i][3], colors[i]);
  }
  return Max(worst, unseen) / allowed;
}

// Depth that a ray needs for the length of a voxel.
inline float VoxelDepth(const Walk& w)
{
  return 1.0f /
    SquareRoot((w.Direction[0] * w.Direction[0] + w.Direction[1] * w.Direction[1]) +
      w.Direction[2] * w.Direction[2]);
}

// How far a ray meets cells of CELL_EDGE^3 voxels that may be visible and have more than one value,
// and the range of their texels.
struct Reach
{
  float End;
  float Least;
  float Largest;
};
template <typename T>
inline Reach LookAhead(const BrickView& view, const Walk& w, Quad at, float t, float wanted)
{
  constexpr auto edge = static_cast<float>(shared::CELL_EDGE);
  const Quad none = {};
  const Quad last = Spread(static_cast<float>(view.CellsAlong - 1));
  Reach reach{ t, FarAway, -FarAway };
  while (reach.End < wanted && Bits((at < none) | (at > last)) == 0)
  {
    const auto x = static_cast<std::int32_t>(at[0]);
    const auto y = static_cast<std::int32_t>(at[1]);
    const auto z = static_cast<std::int32_t>(at[2]);
    const std::uint64_t* words =
      view.Occupancy + 2 * ((x >> 2) + view.MacrosAlong * ((y >> 2) + view.MacrosAlong * (z >> 2)));
    const std::uint64_t uniform = __atomic_load_n(words + 1, __ATOMIC_RELAXED);
    const std::uint64_t marching = __atomic_load_n(words, __ATOMIC_RELAXED) & ~uniform;
    if ((marching >> ((x & 3) | (y & 3) << 2 | (z & 3) << 4) & 1u) == 0)
    {
      break;
    }
    T range[2];
    __builtin_memcpy(range,
      view.Cells +
        static_cast<std::size_t>(x + view.CellsAlong * (y + view.CellsAlong * z)) * sizeof(range),
      sizeof(range));
    reach.Least = Min(reach.Least, static_cast<float>(range[0]));
    reach.Largest = Max(reach.Largest, static_cast<float>(range[1]));
    const Quad low = at * edge + Border;
    const Quad face = w.Forward > none ? low + edge : low - (at == none ? none + 1.0f : none);
    const Quad exits = (face - w.First) * w.Inverse;
    const Quad next = LeastOfThree(exits);
    reach.End = Max(next[0], reach.End);
    at += exits <= next ? w.Move : none;
  }
  reach.End = Min(reach.End, wanted);
  return reach;
}
