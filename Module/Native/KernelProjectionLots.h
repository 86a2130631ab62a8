// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Blend modes other than composite through a resident brick: from cell to cell, in lots of eight.

// The best values of cells, in the order of the ray.
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
  const Floats high = Max(sign * f.Least, sign * f.Largest);
  const Ints promising = f.Valid & (ExtremeOf(c, high) > c.Projection.Extreme + c.P.Projection[1]);
  if (Bits(promising) == 0)
  {
    return;
  }
  f.Field = FieldAlong(c.Table, view, k, from, passed);
  const Floats best = BestAlong(f.Field, sign, f.Least, f.Largest);
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
    f.Field = FieldAlong(c.Table, view, k, from, passed);
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

TERAVOX_INLINE void ProjectSums(Context& c, const Ray& ray, const BrickView& view, const LotView& v,
  const Corners& k, const Vectors& from, const Vectors& passed, LotField& f)
{
  f.Field = FieldAlong(c.Table, view, k, from, passed);
  const SumRule rule{ c.Table, c.Scene.Blend == BlendKind::Average, c.P.Projection[2],
    c.P.Projection[3] };
  const Turns turns = TurnsOf(f.Field);
  const Floats zero = {};
  const PieceSums s = SumsOf(rule, f.Field, zero, zero + 1.0f);
  const Floats length = (v.End - v.Begin) * ray.World;
  for (unsigned bits = Bits(f.Valid); bits != 0; bits &= bits - 1)
  {
    const int l = __builtin_ctz(bits);
    const CellSum sum = SumOfCell(rule, f.Field, turns, s, l, length[l], c.Steps);
    c.Projection.Sum += sum.Sum;
    c.Projection.Length += sum.Length;
  }
}

template <typename T>
__attribute__((noinline)) void ProjectLinear(
  Context& c, State& state, const Ray& ray, const BrickView& view, const Walk& walk)
{
  const LotView v = OpenLot<T>(c, walk, view);
  const Corners k = LoadCorners<T>(view, v.At);
  LotField f = RangesOf<T>(c.Table, view, v, k);
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
        const auto normal = [&]
        {
          const Gradient g = LoadGradient<T>(view, v.At, k, from, passed);
          return NormalOf(
            c.P, g.X.A[0] * view.PerVoxelX, g.Y.A[0] * view.PerVoxelY, g.Z.A[0] * view.PerVoxelZ);
        };
        TakeSlice(
          c, state, NodeOf(c.Table, view, CubicAlong(k, from, passed).A[0]), normal, v.Begin[0]);
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
    else if (c.Scene.Blend == BlendKind::Isosurface || c.Scene.Blend == BlendKind::Slice)
    {
      const auto normal = [&]
      {
        const Vectors difference = DifferenceOf<T>(view, v.At);
        return NormalOf(c.P, difference.X[l], difference.Y[l], difference.Z[l]);
      };
      c.Scene.Blend == BlendKind::Slice ? TakeSlice(c, state, node[l], normal, v.Begin[l])
                                        : JumpTo(c, state, node[l], normal, v.Begin[l]);
    }
    else
    {
      ProjectConstant(c, state, ray, node[l], Quad{}, v.Begin[l], v.End[l]);
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
