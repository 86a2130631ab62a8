// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Blend modes other than composite through a resident brick: from cell to cell, in lots of eight.

// What an average may be off by in a cell, as a share of what the cell adds and at least.
constexpr float SumTolerance = 1.0e-3f;
constexpr float LeastSumTolerance = 1.0e-6f;

// The best value of each cell, at its ends or where its cubic turns.
TERAVOX_INLINE void TakeExtremes(Context& c, State& state, Floats best, Ints valid)
{
  const Ints better = valid & (best > c.Projection.Extreme + c.P.Projection[1]);
  for (unsigned bits = Bits(better); bits != 0; bits &= bits - 1)
  {
    c.Contributing += 1;
    TakeExtreme(c, state, best[__builtin_ctz(bits)]);
  }
}

TERAVOX_INLINE void ProjectExtremes(Context& c, State& state, const BrickView& view,
  const Corners& k, const Vectors& from, const Vectors& passed, LotField& f)
{
  const float sign = c.P.Projection[0];
  const Floats low = Min(sign * f.Least, sign * f.Largest);
  const Floats high = Max(sign * f.Least, sign * f.Largest);
  const Ints promising = f.Valid & (ExtremeOf(c, high) > c.Projection.Extreme + c.P.Projection[1]);
  if (Bits(promising) == 0)
  {
    return;
  }
  f.Field = FieldAlong(c, view, k, from, passed);
  const Turns turns = TurnsOf(f.Field);
  const Floats ends = Max(sign * f.Field.A, sign * Along(f.Field, Splat(1.0f)));
  const Floats middle =
    Max(sign * Along(f.Field, turns.First), sign * Along(f.Field, turns.Second));
  // Between the corners, whatever rounding does.
  const Floats best = Min(Max(Max(ends, middle), low), high);
  TakeExtremes(c, state, ExtremeOf(c, best), promising);
}

// Where on a part of a cell, on which the cubic of a lane only rises or only falls, it meets a
// value: Newton's steps, halves where those lead astray.
struct LaneCubic
{
  float A;
  float B;
  float C;
  float D;
  float At(float u) const { return this->A + u * (this->B + u * (this->C + u * this->D)); }
  float SlopeAt(float u) const { return this->B + u * (2.0f * this->C + 3.0f * this->D * u); }
};
inline float MeetingPoint(const LaneCubic& f, float from, float to, float value, bool up)
{
  const auto isBefore = [&](float u) { return up ? f.At(u) < value : f.At(u) >= value; };
  if (!isBefore(from))
  {
    return from;
  }
  float before = from;
  float behind = to;
  float u = 0.5f * (from + to);
  for (int i = 0; i < 20 && behind - before > 1.0e-6f; ++i)
  {
    const float v = f.At(u) - value;
    (isBefore(u) ? before : behind) = u;
    const float next = u - v / f.SlopeAt(u);
    const bool astray = !(next > before && next < behind);
    const float step = astray ? 0.5f * (before + behind) : next;
    if (Abs(step - u) < 1.0e-7f)
    {
      return step;
    }
    u = step;
  }
  return u;
}

// Surfaces through the cells of a lot. The side where the ray is comes from the cell before, so
// that none is lost or met twice at a face, where two cells round in different ways.
template <typename T>
TERAVOX_INLINE void ProjectSurfaces(Context& c, State& state, const BrickView& view,
  const LotView& v, const Corners& k, const Vectors& from, const Vectors& passed, LotField& f)
{
  Gradient g{};
  bool ready = false;
  std::int32_t& side = c.Projection.Side;
  Turns turns{};
  const auto prepare = [&]
  {
    f.Field = FieldAlong(c, view, k, from, passed);
    turns = TurnsOf(f.Field);
    if (c.Scene.Shade)
    {
      g = LoadGradient<T>(view, v.At, k, from, passed);
    }
    ready = true;
  };
  for (int l = 0; l < c.Cells.Count && !IsOver(c, state); ++l)
  {
    if (f.Valid[l] == 0)
    {
      LoseSide(c);
      continue;
    }
    const float least = f.Least[l];
    const float largest = f.Largest[l];
    if (side >= 0 && !IsBelow(c, side, least) && !IsAbove(c, side, largest))
    {
      continue;
    }
    if (!ready)
    {
      prepare();
    }
    const LaneCubic lane{ f.Field.A[l], f.Field.B[l], f.Field.C[l], f.Field.D[l] };
    const auto normalAt = [&](float u)
    {
      const auto along = [&](const Cubic& d) {
        return LaneCubic{ d.A[l], d.B[l], d.C[l], d.D[l] }.At(u);
      };
      return c.Scene.Shade ? NormalOf(c.P, along(g.X) * view.PerVoxelX, along(g.Y) * view.PerVoxelY,
                               along(g.Z) * view.PerVoxelZ)
                           : Normal<float>{ 0.0f, 0.0f, 0.0f };
    };
    const auto valueAt = [&](float u) { return Min(Max(lane.At(u), least), largest); };
    const auto depthAt = [&](float u) { return v.Begin[l] + u * (v.End[l] - v.Begin[l]); };
    JumpTo(
      c, state, valueAt(0.0f), [&] { return normalAt(0.0f); }, depthAt(0.0f));
    float begin = 0.0f;
    const float ends[3] = { turns.First[l], turns.Second[l], 1.0f };
    for (const float end : ends)
    {
      const float value = valueAt(end);
      while (!IsOver(c, state) && (IsAbove(c, side, value) || IsBelow(c, side, value)))
      {
        const bool up = IsAbove(c, side, value);
        const std::int32_t i = up ? side : side - 1;
        begin = MeetingPoint(lane, begin, end, IsoValue(c, i), up);
        TakeSurface(c, state, i, normalAt(begin), depthAt(begin));
        side += up ? 1 : -1;
      }
      begin = end;
    }
  }
}

// Of a piece on which the field is nearly linear: the integral of the table, over the part where
// values count, and the share of that part.
struct PieceSum
{
  Floats Mean;
  Floats Share;
};
TERAVOX_INLINE PieceSum SumBetween(const Context& c, Floats a, Floats b)
{
  const Floats zero = {};
  const Floats one = zero + 1.0f;
  PieceSum s;
  s.Share = one;
  Floats from = a;
  Floats to = b;
  if (c.Scene.Blend == BlendKind::Average)
  {
    const Floats low = zero + c.P.Projection[2];
    const Floats high = zero + c.P.Projection[3];
    from = Min(Max(a, low), high);
    to = Min(Max(b, low), high);
    const Floats whole = b - a;
    // A piece of nearly one value counts or doesn't.
    const Ints flat = Abs(whole) < 1.0e-6f * Max(Abs(a), Abs(b)) + 1.0e-20f;
    const Ints inside = (a >= low) & (a <= high);
    s.Share = Select(flat, Select(inside, one, zero), (to - from) / Select(flat, one, whole));
  }
  const Sample<Floats> first = SampleTransfer(c.Table, from);
  const Sample<Floats> last = SampleTransfer(c.Table, to);
  s.Mean = MeanExtinction(first, last, zero, zero).Mean * s.Share;
  return s;
}

// Eight pieces of one or several cubics: as two and as four linear ones.
struct PieceSums
{
  Floats Sum; // lengths are shares of the piece
  Floats Share;
  Ints Exact; // halves wouldn't differ
};
TERAVOX_INLINE PieceSums SumsOf(const Context& c, const Cubic& f, Floats from, Floats to)
{
  const Floats size = to - from;
  Floats at[5];
  for (int i = 0; i < 5; ++i)
  {
    at[i] = Along(f, from + size * (0.25f * static_cast<float>(i)));
  }
  const auto add = [](const PieceSum& a, const PieceSum& b) {
    return PieceSum{ a.Mean + b.Mean, a.Share + b.Share };
  };
  const PieceSum two = add(SumBetween(c, at[0], at[2]), SumBetween(c, at[2], at[4]));
  const PieceSum four = add(add(SumBetween(c, at[0], at[1]), SumBetween(c, at[1], at[2])),
    add(SumBetween(c, at[2], at[3]), SumBetween(c, at[3], at[4])));
  PieceSums s;
  s.Sum = four.Mean * 0.25f;
  s.Share = four.Share * 0.25f;
  const Floats offSum = Abs(s.Sum - 0.5f * two.Mean);
  const Floats offShare = Abs(s.Share - 0.5f * two.Share);
  s.Exact = (offSum <= SumTolerance * s.Sum + LeastSumTolerance) &
    (offShare <= SumTolerance * s.Share + LeastSumTolerance);
  return s;
}

// The sums over a cell that isn't smooth, in eighths and eighths of those.
inline void SumInParts(
  Context& c, const Cubic& f, float from, float to, float length, float& sum, float& counted)
{
  const Floats eighths = { 0.0f, 0.125f, 0.25f, 0.375f, 0.5f, 0.625f, 0.75f, 0.875f };
  const Floats begin = from + (to - from) * eighths;
  const Floats end = from + (to - from) * (eighths + 0.125f);
  const PieceSums s = SumsOf(c, f, begin, end);
  c.Steps += 4;
  const float part = length * 0.125f;
  for (int l = 0; l < Lanes; ++l)
  {
    if (s.Exact[l] == 0 && to - from > 8.0f * SmallestPiece)
    {
      SumInParts(c, f, begin[l], end[l], part, sum, counted);
      continue;
    }
    sum += s.Sum[l] * part;
    counted += s.Share[l] * part;
  }
}

TERAVOX_INLINE void ProjectSums(Context& c, const Ray& ray, const BrickView& view, const LotView& v,
  const Corners& k, const Vectors& from, const Vectors& passed, LotField& f)
{
  f.Field = FieldAlong(c, view, k, from, passed);
  const Turns turns = TurnsOf(f.Field);
  const Floats zero = {};
  const PieceSums s = SumsOf(c, f.Field, zero, zero + 1.0f);
  const Floats length = (v.End - v.Begin) * ray.World;
  for (unsigned bits = Bits(f.Valid); bits != 0; bits &= bits - 1)
  {
    const int l = __builtin_ctz(bits);
    if (s.Exact[l] != 0 && !(turns.First[l] < 1.0f))
    {
      c.Projection.Sum += s.Sum[l] * length[l];
      c.Projection.Length += s.Share[l] * length[l];
      continue;
    }
    const Cubic lane{ Splat(f.Field.A[l]), Splat(f.Field.B[l]), Splat(f.Field.C[l]),
      Splat(f.Field.D[l]) };
    float sum = 0;
    float counted = 0;
    // Nothing is missed between the ends of a part that doesn't turn.
    const float ends[4] = { 0.0f, turns.First[l], turns.Second[l], 1.0f };
    for (int i = 0; i < 3; ++i)
    {
      if (ends[i] < ends[i + 1])
      {
        SumInParts(
          c, lane, ends[i], ends[i + 1], (ends[i + 1] - ends[i]) * length[l], sum, counted);
      }
    }
    c.Projection.Sum += sum;
    c.Projection.Length += counted;
  }
}

template <typename T>
__attribute__((noinline)) void ProjectLinear(
  Context& c, State& state, const Ray& ray, const BrickView& view, const Walk& walk)
{
  const LotView v = OpenLot<T>(c, walk, view);
  const Corners k = LoadCorners<T>(view, v.At);
  LotField f = RangesOf<T>(c, view, v, k);
  const Vectors from = PlacesIn(walk, v);
  const Vectors passed = PassedIn(walk, v);
  switch (c.Scene.Blend)
  {
    case BlendKind::Maximum:
    case BlendKind::Minimum:
      ProjectExtremes(c, state, view, k, from, passed, f);
      break;
    case BlendKind::Isosurface:
      ProjectSurfaces<T>(c, state, view, v, k, from, passed, f);
      break;
    case BlendKind::Slice:
      if (f.Valid[0] != 0)
      {
        TakeSlice(c, state, NodeOf(c.Table, view, CubicAlong(k, from, passed).A[0]));
      }
      break;
    default:
      ProjectSums(c, ray, view, v, k, from, passed, f);
      break;
  }
}

// The field is constant in each voxel.
template <typename T>
__attribute__((noinline)) void ProjectNearest(
  Context& c, State& state, const Ray& ray, const BrickView& view, const Walk& walk)
{
  const LotView v = OpenLot<T>(c, walk, view);
  const Floats texel = LoadTexel<T>(view, v.At, 0);
  const Floats node = NodeOf(c.Table, view, texel);
  const Ints valid = v.Valid & (node == node);
  if (IsExtreme(c))
  {
    TakeExtremes(c, state, ExtremeOf(c, c.P.Projection[0] * node), valid);
    return;
  }
  for (int l = 0; l < c.Cells.Count && !IsOver(c, state); ++l)
  {
    if (valid[l] == 0)
    {
      LoseSide(c);
    }
    else if (c.Scene.Blend == BlendKind::Isosurface)
    {
      const auto normal = [&]
      {
        const auto difference = [&](std::ptrdiff_t voxels, float perVoxel)
        {
          const std::uint8_t* at = view.Voxels + v.At.V[l];
          const std::ptrdiff_t step = static_cast<std::ptrdiff_t>(sizeof(T)) * voxels;
          T ahead;
          T behind;
          __builtin_memcpy(&ahead, at + step, sizeof(ahead));
          __builtin_memcpy(&behind, at - step, sizeof(behind));
          return (static_cast<float>(ahead) - static_cast<float>(behind)) * perVoxel;
        };
        return NormalOf(c.P, difference(1, view.PerVoxelX), difference(view.Edge, view.PerVoxelY),
          difference(std::ptrdiff_t{ view.Edge } * view.Edge, view.PerVoxelZ));
      };
      JumpTo(c, state, node[l], normal, v.Begin[l]);
    }
    else
    {
      ProjectConstant(c, state, ray, node[l], v.Begin[l], v.End[l]);
    }
  }
}

// Through a brick, over cells of CELL_EDGE^3 that make no difference.
template <typename T>
void ProjectMapped(
  Context& c, State& state, const Ray& ray, const BrickView& view, float t0, float t1)
{
  constexpr auto edge = static_cast<float>(shared::CELL_EDGE);
  const bool nearest = c.Scene.Nearest;
  const Walk w = BeginWalk(ray, view, nearest ? 0.0f : 0.5f, t1);
  const Quad none = {};
  const bool skip = c.P.Switches[0] != 0;
  // On which side of a surface a cell lies has to be told to a ray that has got there.
  const bool inOrder = c.Scene.Blend == BlendKind::Isosurface;
  Lot& lot = c.Cells;
  lot.Count = 0;
  lot.Uniform = 0;
  const auto project = [&]
  {
    nearest ? ProjectNearest<T>(c, state, ray, view, w) : ProjectLinear<T>(c, state, ray, view, w);
    lot.Count = 0;
    lot.Uniform = 0;
  };
  // Returns whether the ray goes on.
  const auto projectIf = [&](bool due)
  {
    if (due)
    {
      project();
    }
    return !due || !IsOver(c, state);
  };
  Quad cell = CellAt(w, t0);
  bool known = true; // `cell` is where the ray is
  Quad at = CellOf(view, cell);
  float t = t0;
  while (t < t1)
  {
    const Quad exits = (FacesAhead(w, at, edge) - w.First) * w.Inverse;
    const Quad next = LeastOfThree(exits);
    const float stop = Min(Max(next[0], t), t1);
    bool skipped = false;
    if (skip && stop > t)
    {
      const TexelRange range = RangeOf<T>(view, IndexOf(view, at));
      const float from = NodeOf(c.Table, view, range.Least);
      const float to = NodeOf(c.Table, view, range.Largest);
      const bool crossed = inOrder && HasSurface(c, from, to);
      if (!projectIf(inOrder && !crossed && lot.Count != 0))
      {
        return;
      }
      skipped = !crossed && SkipsRange(c, range.Least > range.Largest, from, to);
    }
    if (skipped)
    {
      t = stop;
      known = false;
      at += exits <= next ? w.Move : none;
      if (IsOutside(view, at))
      {
        break; // beyond the last face, by a rounding error
      }
      c.Steps += 1;
      continue;
    }
    if (!known)
    {
      cell = CellAt(w, t);
      known = true;
    }
#if TERAVOX_MASK
    const bool whole = MaskOf<T>(view, IndexOf(view, at)) > 0;
#endif
    do
    {
#if TERAVOX_MASK
      if (!whole)
      {
        const bool goesOn = nearest ? PutMasked<T, true>(c, lot, w, view, cell, t, t1, projectIf)
                                    : PutMasked<T, false>(c, lot, w, view, cell, t, t1, projectIf);
        if (!goesOn)
        {
          return;
        }
        continue;
      }
#endif
      PutCell(lot, w, cell, t, t1);
      if (!projectIf(lot.Count == Lanes))
      {
        return;
      }
    } while (t < stop);
    at = Within(view, at + (exits <= next ? w.Move : none));
  }
  if (lot.Count != 0)
  {
    project();
  }
}
