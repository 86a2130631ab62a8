// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// The integral along a ray through interpolation cells, eight at a time: a cell is one piece, two
// where its cubic turns, and is cut into eight where the estimated error is more than its share.
// The estimates are those of Shaders/Library/Pieces.glsl, with one thing more: the mean of the
// cubic is known exactly, so that only what the transfer function bends is an error.

constexpr float SmallestPiece = 1.0f / 512.0f; // of a cell
// Where in an opaque piece light is gathered isn't known better than to this share of the piece.
constexpr float OpaquePlace = 0.35f;
// Share of the change of light, and of its deviation from a linear change, taken as its error.
constexpr float LightWeight = 0.06f;
constexpr float LightBendWeight = 0.5f;
// Share of the deviation of colours at the ends from a linear change that is taken as an error, and
// of the bend of the field.
constexpr float KinkWeight = 0.25f;
constexpr float BendWeight = 0.1f;

// What a ray has gathered, front to back: the colour (red, green, blue and a rest) is premultiplied.
struct State
{
  Quad Color;
  float Transmittance;
};

// What doesn't change along a ray.
struct Context
{
  const NativeScene& Scene;
  const MarchParameters& P;
  Transfer Table;
  Vector TowardsLight;
  std::uint32_t Steps;        // of this pass
  std::uint64_t Samples;      // cells or segments looked at
  std::uint64_t Contributing; // of them
};

inline bool IsOver(const Context& c, const State& s)
{
  return s.Transmittance <= c.P.Step[2];
}

TERAVOX_INLINE void Accumulate(State& s, float opacity, Quad color)
{
  s.Color += (s.Transmittance * opacity) * color;
  s.Transmittance *= 1.0f - opacity;
}

// Eight cells or parts of them.
struct Segments
{
  Cubic Field; // in nodes of the transfer table
  Gradient Light; // in data per voxel of level 0; of shaded pictures only
  Floats Length;  // world units
};

// Eight pieces. Error: what accepting a piece costs per transmittance before it, less what it may
// cost for the opacity that it adds.
struct Pieces
{
  Quad Color[Lanes]; // red, green, blue, opacity
  Floats Error;
};

struct Extinction
{
  Floats Mean;
  Floats Uneven; // |mean - half of the sum of the ends|, without the field's bend
  Floats Change; // how much the mean may be off
  Floats Off;    // how far the cubic is from the line between its ends, as a share of their distance
  Floats Ahead;  // how far its mean is ahead of theirs, likewise
};

// Mean extinction between two samples of a cubic, `bend` twice the largest second derivative of
// that part and `excess` the mean of the cubic above the mean of its ends.
TERAVOX_INLINE Extinction MeanExtinction(
  const Sample<Floats>& a, const Sample<Floats>& b, Floats bend, Floats excess)
{
  const Floats dx = b.X - a.X;
  const Floats distance = Abs(dx);
  const Floats ds = (b.High - a.High) + (b.Low - a.Low);
  const Floats half = 0.5f * (a.S + b.S);
  const Floats one = Splat(1.0f);
  // Between two nodes the mean of the ends is exact, and nothing has to cancel.
  const auto interval = [&](Floats x) { return Truncate(Max(x, -one) + 1.0f); };
  const Ints wide = distance >= 0.015625f;
  const Floats inverse = one / Select(wide, dx, one);
  const Floats chord =
    Max(Select(wide & (interval(a.X) != interval(b.X)), ds * inverse, half), Floats{});
  const Floats slope = Select(wide, (b.S - a.S) * inverse, 0.5f * (a.Slope + b.Slope));
  Extinction e;
  e.Mean = Max(chord + slope * excess, Floats{});
  e.Uneven = Abs(chord - half);
  const Floats off = 0.25f * bend;
  e.Off = Min(one, off / Max(distance, Splat(1.0e-3f)));
  e.Ahead = Select(wide, excess * inverse, Floats{});
  const Floats variation = Max(Abs(a.Slope - slope), Abs(b.Slope - slope));
  e.Change = Min(0.67f * variation * off +
      4.0f * e.Uneven * e.Off,
    a.S + b.S + 2.0f * chord);
  return e;
}

template <bool Shade>
TERAVOX_INLINE Color<Floats> LightAt(
  const Context& c, const Segments& s, const Color<Floats>& color, Floats u)
{
  if constexpr (Shade)
  {
    return LitColor(c.P, color, Along(s.Light.X, u), Along(s.Light.Y, u), Along(s.Light.Z, u),
      c.TowardsLight);
  }
  else
  {
    return color;
  }
}

// The parts from `from` to `to` (in 0..1) of eight segments.
template <bool Shade>
inline void Evaluate(const Context& c, const Segments& s, Floats from, Floats to, Pieces& out)
{
  const Sample<Floats> a = SampleTransfer(c.Table, Along(s.Field, from));
  const Sample<Floats> b = SampleTransfer(c.Table, Along(s.Field, to));
  const Floats size = to - from;
  const Floats size2 = size * size;
  // Half of the second derivatives at both ends.
  const Floats bendA = s.Field.C + 3.0f * s.Field.D * from;
  const Floats bendB = s.Field.C + 3.0f * s.Field.D * to;
  const Extinction e = MeanExtinction(a, b, Max(Abs(bendA), Abs(bendB)) * size2,
    (-1.0f / 6.0f) * (bendA + 1.5f * s.Field.D * size) * size2);
  const Floats length = size * s.Length;
  const Floats depth = e.Mean * length;
  const Floats opacity = OpacityOf(depth);
  Color<Floats> slopeA;
  Color<Floats> slopeB;
  const Color<Floats> colorA = TransferColor(c.Table, a.X, slopeA);
  const Color<Floats> colorB = TransferColor(c.Table, b.X, slopeB);
  const Floats one = Splat(1.0f);
  const Floats gathered = CentroidOf(a.S, b.S, depth, opacity);
  Color<Floats> color = Mix(colorA, colorB, Min(Max(gathered + e.Ahead, Floats{}), one));
  // How far the colours of the piece are from the line between those of its ends.
  const Color<Floats> chord{ colorB.Red - colorA.Red, colorB.Green - colorA.Green,
    colorB.Blue - colorA.Blue };
  const Floats dx = b.X - a.X;
  const Floats kink =
    Max(Difference(chord, Times(slopeA, dx)), Difference(chord, Times(slopeB, dx)));
  // Where in the piece light is gathered is known only as far as the extinction is linear.
  const Floats thick = Min(depth, one);
  const Floats place =
    OpaquePlace * thick * thick + 0.25f * e.Uneven / Max(e.Mean, Splat(1.0e-30f));
  Floats shift;
  if constexpr (Shade)
  {
    const Color<Floats> litA = LightAt<Shade>(c, s, colorA, from);
    const Color<Floats> litB = LightAt<Shade>(c, s, colorB, to);
    color = LightAt<Shade>(c, s, color, from + size * gathered);
    shift = Difference(litA, litB) * (LightWeight + place) +
      Difference(color, Mix(litA, litB, gathered)) * LightBendWeight;
  }
  else
  {
    shift = Difference(colorA, colorB) * (place + BendWeight * e.Off);
  }
  shift = shift + KinkWeight * kink;
  const Floats error = Min(e.Change * length, one) * (1.0f - opacity) +
    opacity * (Min(shift, one) - c.P.Step[1]);
  const Floats colors[4] = { color.Red, color.Green, color.Blue, opacity };
  Transpose(colors, out.Color);
  out.Error = error;
}

inline Cubic Spread(const Cubic& c, int lane)
{
  return { Splat(c.A[lane]), Splat(c.B[lane]), Splat(c.C[lane]), Splat(c.D[lane]) };
}

template <bool Shade>
inline void Take(Context& c, State& state, const Segments& s, const Pieces& pieces, int lane,
  int segment, float from, float to);

// A part of one segment in eight pieces.
template <bool Shade>
__attribute__((noinline)) void Refine(
  Context& c, State& state, const Segments& whole, int lane, float from, float to)
{
  Segments s;
  s.Field = Spread(whole.Field, lane);
  if constexpr (Shade)
  {
    s.Light = { Spread(whole.Light.X, lane), Spread(whole.Light.Y, lane),
      Spread(whole.Light.Z, lane) };
  }
  s.Length = Splat(whole.Length[lane]);
  const Floats eighths = { 0.0f, 0.125f, 0.25f, 0.375f, 0.5f, 0.625f, 0.75f, 0.875f };
  const Floats begin = from + (to - from) * eighths;
  const Floats end = from + (to - from) * (eighths + 0.125f);
  Pieces pieces;
  Evaluate<Shade>(c, s, begin, end, pieces);
  c.Steps += 4;
  for (int i = 0; i < Lanes && !IsOver(c, state); ++i)
  {
    Take<Shade>(c, state, s, pieces, i, i, begin[i], end[i]);
  }
}

// Accepts a piece or cuts it.
template <bool Shade>
inline void Take(Context& c, State& state, const Segments& s, const Pieces& pieces, int lane,
  int segment, float from, float to)
{
  if (state.Transmittance * pieces.Error[lane] > c.P.Step[3] && to - from > SmallestPiece)
  {
    Refine<Shade>(c, state, s, segment, from, to);
    return;
  }
  Accumulate(state, pieces.Color[lane][3], pieces.Color[lane]);
}

// Where in (0, 1) a cubic turns, to a thousandth or so; 1 for nowhere. One that turns twice inside
// hardly bends; what it does is part of the error of its pieces.
TERAVOX_INLINE Floats TurningPoint(const Cubic& c)
{
  const Floats begin = c.B;
  const Floats end = c.B + (2.0f * c.C + 3.0f * c.D);
  // False position, twice.
  Floats u = begin / (begin - end);
  const Floats at = c.B + u * (2.0f * c.C + 3.0f * c.D * u);
  const Ints before = (at > 0.0f) == (end > 0.0f);
  u = Select(before, u * begin / (begin - at), u + (1.0f - u) * at / (at - end));
  const Ints turns = ((begin > 0.0f) != (end > 0.0f)) & (u > 0.0f) & (u < 1.0f);
  return Select(turns, u, Splat(1.0f));
}

// One segment of one value, without light from a side.
inline void IntegrateConstant(Context& c, State& state, const Ray& ray, float position, float t0,
  float t1)
{
  const float depth =
    SampleTransfer(c.Table, position).S * (Max(t1 - t0, 0.0f) * ray.World);
  Color<float> color = TransferColor(c.Table, position);
  if (c.Scene.Shade)
  {
    color = LitColor(c.P, color, 0.0f, 0.0f, 0.0f, c.TowardsLight);
  }
  Accumulate(state, OpacityOf(depth), Quad{ color.Red, color.Green, color.Blue, 0.0f });
  c.Steps += 1;
  c.Samples += 1;
  c.Contributing += depth > 0.0f ? 1 : 0;
}
