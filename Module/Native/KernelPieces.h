// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// The integral along a ray through interpolation cells, eight at a time: a cell is one piece, two
// where its cubic turns, and is cut into two to eight where the estimated error is more than its
// share. The estimates are those of Shaders/Library/Pieces.glsl.

constexpr float SmallestPiece = 1.0f / 512.0f; // of a cell
// Where in a piece of an optical depth of OpaqueDepth and more light is gathered isn't known better
// than to this share of the piece: the front of the extinction decides.
constexpr float OpaquePlace = 0.35f;
constexpr float OpaqueDepth = 4.0f;
// Share of the change of light, and of its deviation from a linear change, taken as its error.
constexpr float LightWeight = 0.06f;
constexpr float LightBendWeight = 0.5f;
// Of the square of 1 - the cosine between the normals at the ends: between such ends light may do
// anything.
constexpr float NormalWeight = 0.3f;
// Share of the deviation of colours at the ends from a linear change that is taken as an error: of
// any, and where one kink explains it (99 of 100 random pieces err less). And of the bend of the
// field.
constexpr float KinkWeight = 0.25f;
constexpr float SingleKinkWeight = 0.05f;
constexpr float LeastKink = 1.0e-3f; // that is worth a division
constexpr float BendWeight = 0.1f;

// What a ray has gathered, front to back: the colour (red, green, blue and a rest) is
// premultiplied. Error: estimates of what the colour may be off, less what pieces may err for the
// opacity that they add.
struct State
{
  Quad Color;
  float Transmittance;
  float Error;
};

// Cells one behind the other on a ray: x, y, z and the depth where each begins.
struct Lot
{
  Quad Cells[Lanes];
  float Stops[Lanes]; // where they end, of those in Uniform
  unsigned Uniform; // one bit per cell that goes on through others of the same value, or is a part
  int Count;
  int Mask; // their value of the mask, where there is one
};

// What doesn't change along a ray, and what is used anew.
struct Context
{
  const NativeScene& Scene;
  const MarchParameters& P;
  NativeReport& Report; // of the tile
  Transfer Table;
  RayLight Light;
  std::uint32_t Steps;        // of this pass
  std::uint64_t Samples;      // cells or segments looked at
  std::uint64_t Contributing; // of them
  Lot Cells;
  ProjectionState Projection;
  WatchState Watch;
  ComponentTables Components;
  GradientOpacityTable Gradient;
  PlaneTable Plane;
  unsigned Clipped; // see BrickView
  int Label;        // whose tables Table and Gradient are; 0: those of all (KernelMask.h)
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

TERAVOX_INLINE void Accumulate(State& s, float opacity, Quad color, float error)
{
  s.Error += s.Transmittance * error;
  Accumulate(s, opacity, color);
}

TERAVOX_INLINE void ToQuads(const Color<Floats>& color, Floats opacity, Quad (&out)[Lanes])
{
  const Floats channels[4] = { color.Red, color.Green, color.Blue, opacity };
  Transpose(channels, out);
}

// Eight cells or parts of them.
struct Segments
{
  Cubic Field;    // in nodes of the transfer table
  Gradient Light; // in data per voxel of level 0; where it is needed
  Floats Length;  // world units
  Floats Begin;   // depth; of shaded pictures only
};

// Eight pieces. Error: what accepting a piece costs per transmittance before it, less what it may
// cost for the opacity that it adds.
struct Pieces
{
  Quad Color[Lanes]; // red, green, blue, opacity
  Floats Error;
};

// The colours of a piece of `dx` nodes against the line between those of its ends. Where the slopes
// at the ends say so, the function has one kink in between: then the peak of the triangle is known.
struct Kink
{
  Color<Floats> Mean; // how far the mean is from the line
  Floats Error;
};
TERAVOX_INLINE Kink KinkOf(const Color<Floats>& a, const Color<Floats>& slopeA,
  const Color<Floats>& b, const Color<Floats>& slopeB, Floats dx)
{
  const Floats zero = {};
  Kink kink{ { zero, zero, zero }, zero };
  const auto channel = [&](Floats from, Floats slopeFrom, Floats to, Floats slopeTo, Floats& mean)
  {
    const Floats chord = to - from;
    const Floats before = slopeFrom * dx - chord;
    const Floats behind = chord - slopeTo * dx;
    const Floats most = Max(Abs(before), Abs(behind));
    const Ints single = (before * behind > 0.0f) & (most > LeastKink);
    if (Bits(single) != 0)
    {
      const Floats sum = Select(single, before + behind, zero + 1.0f);
      mean = Select(single, 0.5f * (before * behind) / sum, zero);
    }
    kink.Error = Max(kink.Error, most * Select(single, zero + SingleKinkWeight, zero + KinkWeight));
  };
  channel(a.Red, slopeA.Red, b.Red, slopeB.Red, kink.Mean.Red);
  channel(a.Green, slopeA.Green, b.Green, slopeB.Green, kink.Mean.Green);
  channel(a.Blue, slopeA.Blue, b.Blue, slopeB.Blue, kink.Mean.Blue);
  return kink;
}

// How well it is known where in a piece light is gathered, as a share of the piece: only as far as
// the extinction is linear.
TERAVOX_INLINE Floats PlaceError(const Extinction& e, Floats depth)
{
  const Floats thick = Min(depth * (1.0f / OpaqueDepth), Splat(1.0f));
  return OpaquePlace * thick * thick + 0.25f * e.Uneven / Max(e.Mean, Splat(1.0e-30f));
}

#if TERAVOX_GRADIENT_OPACITY || TERAVOX_COMPONENTS
// Where in a piece of this depth light is gathered isn't known better than to this share of it, if
// the opacity may change by a share of `varied`: a dense one begins where gradients leave
// something.
TERAVOX_INLINE Floats FrontError(Floats depth, Floats varied)
{
  const Floats thick = Min(depth * (1.0f / OpaqueDepth), Splat(1.0f));
  return varied * thick * thick;
}
#endif

// Of pieces whose optical depth may be off by `depth` and whose colour by `shift`.
TERAVOX_INLINE Floats ErrorOf(const Context& c, Floats opacity, Floats depth, Floats shift)
{
  const Floats one = Splat(1.0f);
  return Min(depth, one) * (1.0f - opacity) + opacity * (Min(shift, one) - c.P.Step[1]);
}

TERAVOX_INLINE Normal<Floats> NormalAt(const Context& c, const Segments& s, Floats u)
{
  return NormalOf(c.P, Along(s.Light.X, u), Along(s.Light.Y, u), Along(s.Light.Z, u));
}

#if TERAVOX_GRADIENT_PLANE
template <bool Shade>
void EvaluatePlane(const Context& c, const Segments& s, Floats from, Floats to, Pieces& out);
#endif

// What is needed of an end of eight pieces. Two that follow each other share one.
template <bool Shade>
struct PieceEnds
{
  Sample<Floats> At;
  Color<Floats> Plain;
  Color<Floats> Slope;
  Normal<Floats> Direction; // of shaded pictures only, as the next
  Color<Floats> Lit;
};

// The ends at `u` (in 0..1) of eight segments.
template <bool Shade>
__attribute__((noinline)) void FindEnds(
  const Context& c, const Segments& s, Floats u, PieceEnds<Shade>& ends)
{
#if TERAVOX_GRADIENT_PLANE
  if (c.Plane.Nodes != nullptr)
  {
    return; // its pieces have other ones
  }
#endif
  ends.At = SampleTransfer(c.Table, Along(s.Field, u));
  ends.Plain = TransferColor(c.Table, ends.At.X, ends.Slope);
  if constexpr (Shade)
  {
    ends.Direction = NormalAt(c, s, u);
    const Floats extent = s.Length * c.Light.PerWorld;
    ends.Lit = LitColor(c.P, ends.Plain, ends.Direction, c.Light, s.Begin + u * extent);
  }
}

// The parts from `from` to `to` of eight segments, whose ends are known.
template <bool Shade>
__attribute__((noinline)) void EvaluateBetween(const Context& c, const Segments& s, Floats from,
  Floats to, const PieceEnds<Shade>& front, const PieceEnds<Shade>& back, Pieces& out)
{
#if TERAVOX_GRADIENT_PLANE
  if (c.Plane.Nodes != nullptr)
  {
    EvaluatePlane<Shade>(c, s, from, to, out);
    return;
  }
#endif
  const Sample<Floats>& a = front.At;
  const Sample<Floats>& b = back.At;
  const Floats size = to - from;
  const Floats size2 = size * size;
  // Half of the second derivatives at both ends.
  const Floats bendA = s.Field.C + 3.0f * s.Field.D * from;
  const Floats bendB = s.Field.C + 3.0f * s.Field.D * to;
  Extinction e = MeanExtinction(a, b, Max(Abs(bendA), Abs(bendB)) * size2,
    (-1.0f / 6.0f) * (bendA + 1.5f * s.Field.D * size) * size2);
#if TERAVOX_GRADIENT_OPACITY
  const Sample<Floats> middle = SampleTransfer(c.Table, Along(s.Field, 0.5f * (from + to)));
  Sample<Floats> left = a;
  Sample<Floats> right = b;
  const Floats varied = Attenuate(c.Gradient, s.Field, s.Light, from, to, left, middle, right, e);
  const Floats firstS = left.S;
  const Floats lastS = right.S;
#else
  const Floats firstS = a.S;
  const Floats lastS = b.S;
#endif
  const Floats length = size * s.Length;
  const Floats depth = e.Mean * length;
  const Floats opacity = OpacityOf(depth);
  const Floats one = Splat(1.0f);
  const Floats gathered = CentroidOf(firstS, lastS, depth);
  Color<Floats> color = Mix(front.Plain, back.Plain, Min(Max(gathered + e.Ahead, Floats{}), one));
  const Kink kink = KinkOf(front.Plain, front.Slope, back.Plain, back.Slope, b.X - a.X);
  color = Moved(color, kink.Mean);
#if TERAVOX_GRADIENT_OPACITY
  const Floats place = Max(PlaceError(e, depth), FrontError(depth, varied));
#else
  const Floats place = PlaceError(e, depth);
#endif
  Floats shift;
  if constexpr (Shade)
  {
    const Normal<Floats>& normalA = front.Direction;
    const Normal<Floats>& normalB = back.Direction;
    const Floats at = from + size * gathered;
    const Floats extent = s.Length * c.Light.PerWorld;
    color = LitColor(c.P, color, NormalAt(c, s, at), c.Light, s.Begin + at * extent);
    // Where there is none at one end, as where values saturate, it usually has one direction still.
    const Ints both = (Abs(normalA.X) + Abs(normalA.Y) + Abs(normalA.Z) > 0.0f) &
      (Abs(normalB.X) + Abs(normalB.Y) + Abs(normalB.Z) > 0.0f);
    const Floats turned = Select(both,
      one - ((normalA.X * normalB.X + normalA.Y * normalB.Y) + normalA.Z * normalB.Z), Floats{});
    shift = Difference(front.Lit, back.Lit) * (LightWeight + place) +
      Difference(color, Mix(front.Lit, back.Lit, gathered)) * LightBendWeight +
      NormalWeight * turned * turned;
  }
  else
  {
    shift = Difference(front.Plain, back.Plain) * (place + BendWeight * e.Off);
  }
  shift = shift + kink.Error;
  ToQuads(color, opacity, out.Color);
#if TERAVOX_GRADIENT_OPACITY
  // There may be less of it, or more.
  const Floats lost = LostOpacity(depth, opacity, e.Change * length);
  out.Error = lost + opacity * (Min(shift, one) - c.P.Step[1]);
#else
  out.Error = ErrorOf(c, opacity, e.Change * length, shift);
#endif
}

// The parts from `from` to `to` of eight segments.
template <bool Shade>
inline void Evaluate(const Context& c, const Segments& s, Floats from, Floats to, Pieces& out)
{
  PieceEnds<Shade> front;
  PieceEnds<Shade> back;
  FindEnds<Shade>(c, s, from, front);
  FindEnds<Shade>(c, s, to, back);
  EvaluateBetween<Shade>(c, s, from, to, front, back, out);
}

// Segments one by one, to be put together anew.
template <bool Shade>
struct Rows
{
  Quad Field[Lanes];
  Quad Light[Shade || GradientOpacity ? 3 : 1][Lanes];
  float Length[Lanes];
  float Begin[Lanes];
};

TERAVOX_INLINE void ToRows(const Cubic& c, Quad (&rows)[Lanes])
{
  const Floats columns[4] = { c.A, c.B, c.C, c.D };
  Transpose(columns, rows);
}
TERAVOX_INLINE Cubic FromRows(const Quad (&rows)[Lanes], const int (&lanes)[Lanes])
{
  const Quad chosen[Lanes] = { rows[lanes[0]], rows[lanes[1]], rows[lanes[2]], rows[lanes[3]],
    rows[lanes[4]], rows[lanes[5]], rows[lanes[6]], rows[lanes[7]] };
  Floats columns[4];
  Transpose(chosen, columns);
  return { columns[0], columns[1], columns[2], columns[3] };
}

template <bool Shade>
TERAVOX_INLINE Rows<Shade> RowsOf(const Segments& s)
{
  Rows<Shade> rows;
  ToRows(s.Field, rows.Field);
  if constexpr (Shade || GradientOpacity)
  {
    ToRows(s.Light.X, rows.Light[0]);
    ToRows(s.Light.Y, rows.Light[1]);
    ToRows(s.Light.Z, rows.Light[2]);
  }
  if constexpr (Shade)
  {
    __builtin_memcpy(rows.Begin, &s.Begin, sizeof(rows.Begin));
  }
  __builtin_memcpy(rows.Length, &s.Length, sizeof(rows.Length));
  return rows;
}

template <bool Shade>
TERAVOX_INLINE Segments Choose(const Rows<Shade>& rows, const int (&lanes)[Lanes])
{
  Segments s;
  s.Field = FromRows(rows.Field, lanes);
  if constexpr (Shade || GradientOpacity)
  {
    s.Light = { FromRows(rows.Light[0], lanes), FromRows(rows.Light[1], lanes),
      FromRows(rows.Light[2], lanes) };
  }
  for (int l = 0; l < Lanes; ++l)
  {
    s.Length[l] = rows.Length[lanes[l]];
    if constexpr (Shade)
    {
      s.Begin[l] = rows.Begin[lanes[l]];
    }
  }
  return s;
}

// Accepts a piece or cuts it into eight, and so on.
template <bool Shade>
void Take(Context& c, State& state, const Rows<Shade>& rows, int segment, const Pieces& pieces,
  int lane, float from, float to);

template <bool Shade>
__attribute__((noinline)) void Refine(
  Context& c, State& state, const Rows<Shade>& rows, int segment, float from, float to)
{
  const int lanes[Lanes] = { segment, segment, segment, segment, segment, segment, segment,
    segment };
  const Floats eighths = { 0.0f, 0.125f, 0.25f, 0.375f, 0.5f, 0.625f, 0.75f, 0.875f };
  const Floats begin = from + (to - from) * eighths;
  const Floats end = from + (to - from) * (eighths + 0.125f);
  Pieces pieces;
  Evaluate<Shade>(c, Choose<Shade>(rows, lanes), begin, end, pieces);
  c.Steps += 4;
  for (int i = 0; i < Lanes && !IsOver(c, state); ++i)
  {
    Take<Shade>(c, state, rows, segment, pieces, i, begin[i], end[i]);
  }
}

template <bool Shade>
void Take(Context& c, State& state, const Rows<Shade>& rows, int segment, const Pieces& pieces,
  int lane, float from, float to)
{
  if (state.Transmittance * pieces.Error[lane] > c.P.Step[3] && to - from > SmallestPiece)
  {
    Refine<Shade>(c, state, rows, segment, from, to);
    return;
  }
  Accumulate(state, pieces.Color[lane][3], pieces.Color[lane], pieces.Error[lane]);
}

// Parts of segments in the order of the ray, evaluated eight at a time when the ray gets there.
template <bool Shade>
struct Queue
{
  const Rows<Shade>& Source;
  int Lane[Lanes * (Lanes + 2)];
  float From[Lanes * (Lanes + 2)];
  float To[Lanes * (Lanes + 2)];
  int Count = 0;
  int Evaluated = 0;
  Pieces Results;

  explicit Queue(const Rows<Shade>& source)
    : Source(source)
  {
  }
  void Push(int lane, float from, float to)
  {
    this->Lane[this->Count] = lane;
    this->From[this->Count] = from;
    this->To[this->Count] = to;
    ++this->Count;
  }
  void TakeAt(Context& c, State& state, int i)
  {
    if (i >= this->Evaluated)
    {
      int lanes[Lanes];
      Floats from;
      Floats to;
      this->Evaluated = i;
      for (int l = 0; l < Lanes; ++l)
      {
        const int e = Min(i + l, this->Count - 1);
        lanes[l] = this->Lane[e];
        from[l] = this->From[e];
        to[l] = this->To[e];
      }
      this->Evaluated += Lanes;
      Evaluate<Shade>(c, Choose<Shade>(this->Source, lanes), from, to, this->Results);
      c.Steps += 4;
    }
    Take<Shade>(c, state, this->Source, this->Lane[i], this->Results, i + Lanes - this->Evaluated,
      this->From[i], this->To[i]);
  }
};

// The pieces of segments that some have to be cut, or that turn and go on behind their turning
// points. How many parts a piece gets depends on itself alone, that it gets them on what the ray
// has left.
template <bool Shade>
__attribute__((noinline)) void TakeInParts(Context& c, State& state, const Segments& s,
  const Pieces& front, const Turns& turns, unsigned bits, unsigned turning, unsigned costly)
{
  const Rows<Shade> rows = RowsOf<Shade>(s);
  Queue<Shade> queue(rows);
  int first[Lanes];
  int parts[Lanes];
  for (unsigned rest = bits; rest != 0; rest &= rest - 1)
  {
    const int lane = __builtin_ctz(rest);
    first[lane] = queue.Count;
    parts[lane] = 0;
    if ((costly >> lane & 1u) != 0)
    {
      // A cubic's part of half the length errs an eighth.
      const float error = front.Error[lane];
      const int n = error < 8.0f * c.P.Step[3] ? 2 : error < 64.0f * c.P.Step[3] ? 4 : 8;
      parts[lane] = n;
      const float turn = turns.First[lane];
      const float step = turn / static_cast<float>(n);
      for (int i = 0; i < n; ++i)
      {
        queue.Push(
          lane, static_cast<float>(i) * step, i + 1 == n ? turn : static_cast<float>(i + 1) * step);
      }
    }
    if ((turning >> lane & 1u) != 0)
    {
      queue.Push(lane, turns.First[lane], turns.Second[lane]);
      if (turns.Second[lane] < 1.0f)
      {
        queue.Push(lane, turns.Second[lane], 1.0f);
      }
    }
  }
  for (; bits != 0; bits &= bits - 1)
  {
    const int lane = __builtin_ctz(bits);
    const float before = state.Transmittance;
    if (parts[lane] != 0 && before * front.Error[lane] > c.P.Step[3])
    {
      for (int i = 0; i < parts[lane] && !IsOver(c, state); ++i)
      {
        queue.TakeAt(c, state, first[lane] + i);
      }
    }
    else
    {
      Accumulate(state, front.Color[lane][3], front.Color[lane], front.Error[lane]);
    }
    if ((turning >> lane & 1u) != 0 && !IsOver(c, state))
    {
      queue.TakeAt(c, state, first[lane] + parts[lane]);
      if (turns.Second[lane] < 1.0f && !IsOver(c, state))
      {
        queue.TakeAt(c, state, first[lane] + parts[lane] + 1);
      }
    }
    c.Contributing += state.Transmittance < before ? 1 : 0;
    if (IsOver(c, state))
    {
      return;
    }
  }
}

// The same where nothing has to be cut but at a turning point: both pieces of all cells at once.
// Returns false, having added nothing, where the second pieces have to be cut. turn: the ends of
// the first ones.
template <bool Shade>
TERAVOX_INLINE bool TakeTurning(Context& c, State& state, const Segments& s, const Pieces& front,
  const PieceEnds<Shade>& turn, const Turns& turns, unsigned bits, unsigned turning)
{
  PieceEnds<Shade> last;
  FindEnds<Shade>(c, s, turns.Second, last);
  Pieces second;
  EvaluateBetween<Shade>(c, s, turns.First, turns.Second, turn, last, second);
  c.Steps += 4;
  if ((Bits(second.Error * state.Transmittance > c.P.Step[3]) & turning) != 0)
  {
    return false;
  }
  for (; bits != 0 && !IsOver(c, state); bits &= bits - 1)
  {
    const int lane = __builtin_ctz(bits);
    const float before = state.Transmittance;
    Accumulate(state, front.Color[lane][3], front.Color[lane], front.Error[lane]);
    if ((turning >> lane & 1u) != 0 && !IsOver(c, state))
    {
      Accumulate(state, second.Color[lane][3], second.Color[lane], second.Error[lane]);
    }
    c.Contributing += state.Transmittance < before ? 1 : 0;
  }
  return true;
}

// One segment of one value, without light from a side.
// `slope`: its central difference, which is 0 where nothing is cut away (KernelClipped.h).
inline void IntegrateConstant(
  Context& c, State& state, const Ray& ray, float position, Quad slope, float t0, float t1)
{
  const float length = Max(t1 - t0, 0.0f) * ray.World;
  float depth = SampleTransfer(c.Table, position).S * length;
  Color<float> color = TransferColor(c.Table, position);
#if TERAVOX_GRADIENT_PLANE
  if (c.Plane.Nodes != nullptr)
  {
    const PlaneSample<float> sample = SamplePlane(c.Plane, c.Gradient, position,
      PlaceGradient(c.Gradient, slope[0], slope[1], slope[2]).Magnitude);
    depth = sample.S * length;
    color = sample.Value;
  }
  else
#endif
  {
#if TERAVOX_GRADIENT_OPACITY
    depth = depth * SampleGradient(c.Gradient, slope[0], slope[1], slope[2]).Opacity;
#endif
  }
  if (c.Scene.Shade)
  {
    color =
      LitColor(c.P, color, NormalOf(c.P, slope[0], slope[1], slope[2]), c.Light, 0.5f * (t0 + t1));
  }
  const float opacity = OpacityOf(depth);
  Accumulate(
    state, opacity, Quad{ color.Red, color.Green, color.Blue, 0.0f }, -opacity * c.P.Step[1]);
  c.Steps += 1;
  c.Samples += 1;
  c.Contributing += depth > 0.0f ? 1 : 0;
}
