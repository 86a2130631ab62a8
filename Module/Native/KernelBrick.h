// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// From one visible cell of a brick to the next, in lots of eight.

// The cells of a lot in the slot of their brick.
struct LotView
{
  Floats Begin;
  Floats End;
  Ints X;
  Ints Y;
  Ints Z;
  Offsets At;
  Ints Valid;
};

// Where the cells of a lot end is computed as the walk does it. Border voxels are there for
// shading; rounding must not lead out of the slot.
template <typename T>
TERAVOX_INLINE LotView OpenLot(Context& c, const Walk& w, const BrickView& view)
{
  const Lot& lot = c.Cells;
  c.Steps += static_cast<std::uint32_t>(lot.Count);
  c.Samples += static_cast<std::uint64_t>(lot.Count);
  Floats cell[4];
  Transpose(lot.Cells, cell);
  const auto exit = [&](int a) { return (cell[a] + w.Forward[a] - w.First[a]) * w.Inverse[a]; };
  const Floats leave = Min(exit(0), Min(exit(1), exit(2)));
  LotView v;
  v.Begin = cell[3];
  v.End = Min(Max(leave, v.Begin), Splat(w.End));
  for (unsigned rest = lot.Uniform; rest != 0; rest &= rest - 1)
  {
    const int lane = __builtin_ctz(rest);
    v.End[lane] = lot.Stops[lane];
  }
  v.X = InSlot(cell[0], 1, view.Edge - 3);
  v.Y = InSlot(cell[1], 1, view.Edge - 3);
  v.Z = InSlot(cell[2], 1, view.Edge - 3);
  v.At = OffsetsOf<T>(v.X + view.Edge * (v.Y + view.Edge * v.Z));
  v.Valid = FirstLanes(lot.Count);
  return v;
}

// The field of the cells of a lot along the ray, in nodes.
struct LotField
{
  Cubic Field;
  Floats Least; // of the corners
  Floats Largest;
  Ints Valid; // there is such a cell, and all its corners have a value
};

template <typename T>
TERAVOX_INLINE Ints HaveValues(const Corners& k)
{
  if constexpr (sizeof(T) == 4)
  {
    // One voxel without a value, and there is none in between.
    const Floats sum =
      ((k.V[0] + k.V[1]) + (k.V[2] + k.V[3])) + ((k.V[4] + k.V[5]) + (k.V[6] + k.V[7]));
    return sum == sum;
  }
  return Splat(-1);
}

TERAVOX_INLINE Vectors PlacesIn(const Walk& walk, const LotView& v)
{
  const auto position = [&](int a, Ints cell)
  { return (walk.First[a] + v.Begin * walk.Direction[a]) - ToFloat(cell); };
  return { position(0, v.X), position(1, v.Y), position(2, v.Z) };
}
TERAVOX_INLINE Vectors PassedIn(const Walk& walk, const LotView& v)
{
  const Floats passed = v.End - v.Begin;
  return { passed * walk.Direction[0], passed * walk.Direction[1], passed * walk.Direction[2] };
}

template <typename T>
TERAVOX_INLINE LotField RangesOf(
  const Transfer& table, const BrickView& view, const LotView& v, const Corners& k)
{
  LotField f;
  Floats least = k.V[0];
  Floats largest = k.V[0];
  for (int i = 1; i < 8; ++i)
  {
    least = Min(least, k.V[i]);
    largest = Max(largest, k.V[i]);
  }
  f.Least = NodeOf(table, view, least);
  f.Largest = NodeOf(table, view, largest);
  f.Valid = v.Valid & HaveValues<T>(k);
  return f;
}

TERAVOX_INLINE Cubic FieldAlong(const Transfer& table, const BrickView& view, const Corners& k,
  const Vectors& from, const Vectors& passed)
{
  const Cubic texels = CubicAlong(k, from, passed);
  const float toNodes = view.Scale * table.NodesPerUnit;
  return { NodeOf(table, view, texels.A), texels.B * toNodes, texels.C * toNodes,
    texels.D * toNodes };
}

// The pieces of visible cells, one after the other. `turning`: these go on behind their turning
// points.
template <bool Shade>
TERAVOX_INLINE void TakeAll(Context& c, State& state, const Segments& s, const Pieces& front,
  const PieceEnds<Shade>& turn, const Turns& turns, unsigned bits, unsigned turning)
{
  // Transmittance only falls: what needn't be cut now needn't be later.
  const unsigned costly = Bits((front.Error * state.Transmittance) > c.P.Step[3]) & bits;
  std::uint64_t& evaluated = c.Report.Evaluated;
  if ((costly | turning) != 0)
  {
    evaluated += static_cast<std::uint64_t>(__builtin_popcount(bits));
    const unsigned twice = Bits(turns.Second < 1.0f) & turning;
    if ((costly | twice) != 0 ||
      !TakeTurning<Shade>(c, state, s, front, turn, turns, bits, turning))
    {
      TakeInParts<Shade>(c, state, s, front, turns, bits, turning, costly);
    }
    return;
  }
  const float end = c.P.Step[2];
  for (; bits != 0; bits &= bits - 1)
  {
    const int lane = __builtin_ctz(bits);
    const float opacity = front.Color[lane][3];
    evaluated += 1;
    c.Contributing += opacity > 0.0f ? 1 : 0;
    Accumulate(state, opacity, front.Color[lane], front.Error[lane]);
    if (state.Transmittance <= end)
    {
      return;
    }
  }
}

template <typename T, bool Shade>
__attribute__((noinline)) void IntegrateLinear(
  Context& c, State& state, const Ray& ray, const BrickView& view, const Walk& walk)
{
  const LotView v = OpenLot<T>(c, walk, view);
  const Corners k = LoadCorners<T>(view, v.At);
  const LotField field = RangesOf<T>(c.Table, view, v, k);
  const bool skip = c.P.Switches[0] != 0;
  const bool watch = c.Scene.Missed != nullptr;
  Ints visible = field.Valid;
  if (skip || watch)
  {
    visible &= ~IsEmptyBetween(c.Table, field.Least, field.Largest);
  }
  const unsigned visibleBits = Bits(visible);
  unsigned bits = skip ? visibleBits : Bits(field.Valid);
  if (bits == 0)
  {
    return;
  }
  const Vectors w = PlacesIn(walk, v);
  const Vectors d = PassedIn(walk, v);
  Segments s;
  s.Field = FieldAlong(c.Table, view, k, w, d);
  s.Length = (v.End - v.Begin) * ray.World;
  const Turns turns = TurningPoints(s.Field);
  if (skip || watch)
  {
    // The corners reach further than the line: a piece between ends that see nothing adds 0.
    const Floats ends[4] = { s.Field.A, Along(s.Field, turns.First), Along(s.Field, turns.Second),
      Along(s.Field, Splat(1.0f)) };
    const unsigned seen = visibleBits &
      ~Bits(IsEmptyBetween(c.Table, Min(Min(ends[0], ends[1]), Min(ends[2], ends[3])),
        Max(Max(ends[0], ends[1]), Max(ends[2], ends[3]))));
    if (watch)
    {
      NoteLot(c, v.Begin, v.End, field.Least, field.Largest, visibleBits, seen);
    }
    bits = skip ? seen : bits;
    if (bits == 0)
    {
      return;
    }
  }
  if constexpr (Shade || GradientOpacity)
  {
    s.Begin = v.Begin;
    c.Report.Gradients += static_cast<std::uint64_t>(__builtin_popcount(bits));
    s.Light = LoadGradient<T>(view, v.At, k, w, d);
    const auto scale = [](const Cubic& g, float f) -> Cubic {
      return { g.A * f, g.B * f, g.C * f, g.D * f };
    };
    s.Light = { scale(s.Light.X, view.PerVoxelX), scale(s.Light.Y, view.PerVoxelY),
      scale(s.Light.Z, view.PerVoxelZ) };
  }
  const unsigned turning = Bits(turns.First < 1.0f) & bits;
  PieceEnds<Shade> begin;
  PieceEnds<Shade> turn;
  FindEnds<Shade>(c, s, Floats{}, begin);
  FindEnds<Shade>(c, s, turns.First, turn);
  Pieces front;
  EvaluateBetween<Shade>(c, s, Floats{}, turns.First, begin, turn, front);
  TakeAll<Shade>(c, state, s, front, turn, turns, bits, turning);
}

// The field is constant in each voxel: one segment per voxel.
template <typename T, bool Shade>
__attribute__((noinline)) void IntegrateNearest(
  Context& c, State& state, const Ray& ray, const BrickView& view, const Walk& walk)
{
  const LotView v = OpenLot<T>(c, walk, view);
  const Floats texel = LoadTexel<T>(view, v.At, 0);
  const Floats node = NodeOf(c.Table, view, texel);
  const Floats length = (v.End - v.Begin) * ray.World;
  Floats depth = SampleTransfer(c.Table, node).S * length;
  depth = Select(v.Valid & (texel == texel), depth, Floats{});
  unsigned bits = Bits(depth > 0.0f);
  if (bits == 0)
  {
    return;
  }
  const auto seen = static_cast<std::uint64_t>(__builtin_popcount(bits));
  c.Report.Evaluated += seen;
  Color<Floats> color = TransferColor(c.Table, node);
  if constexpr (Shade || GradientOpacity)
  {
    c.Report.Gradients += seen;
    const auto [x, y, z] = DifferenceOf<T>(view, v.At);
#if TERAVOX_GRADIENT_PLANE
    if (c.Plane.Nodes != nullptr)
    {
      const PlaneSample<Floats> sample =
        SamplePlane(c.Plane, c.Gradient, node, PlaceGradient(c.Gradient, x, y, z).Magnitude);
      depth = Select(depth > 0.0f, sample.S * length, Floats{});
      color = sample.Value;
    }
    else
#endif
    {
#if TERAVOX_GRADIENT_OPACITY
      depth = depth * SampleGradient(c.Gradient, x, y, z).Opacity;
#endif
    }
    if constexpr (Shade)
    {
      color = LitColor(c.P, color, NormalOf(c.P, x, y, z), c.Light, 0.5f * (v.Begin + v.End));
    }
  }
  Quad colors[Lanes];
  ToQuads(color, OpacityOf(depth), colors);
  for (; bits != 0; bits &= bits - 1)
  {
    const int lane = __builtin_ctz(bits);
    Accumulate(state, colors[lane][3], colors[lane], -colors[lane][3] * c.P.Step[1]);
    c.Contributing += 1;
    if (IsOver(c, state))
    {
      return;
    }
  }
}

// The bits of the cells of a slot, made anew where the slot or the transfer function is. Several
// threads may do so at once: they write the same. `bitsOf` tells of a cell whether it may be seen
// and whether it has one value.
template <typename BitsOf>
inline const std::uint64_t* OccupancyWords(
  const NativeScene& scene, const BrickView& view, std::uint32_t slot, const BitsOf& bitsOf)
{
  const auto cells = static_cast<std::size_t>(view.CellsAlong);
  const auto macros = static_cast<std::size_t>(view.MacrosAlong);
  std::uint64_t* words = scene.Occupancy + slot * macros * macros * macros * 2;
  std::uint32_t* version = scene.OccupancyVersion + slot;
  if (__atomic_load_n(version, __ATOMIC_ACQUIRE) == scene.TableVersion)
  {
    return words;
  }
  constexpr std::size_t edge = MacroEdge;
  for (std::size_t m = 0; m < macros * macros * macros; ++m)
  {
    const std::size_t x = m % macros * edge;
    const std::size_t y = m / macros % macros * edge;
    const std::size_t z = m / (macros * macros) * edge;
    std::uint64_t occupied = 0;
    std::uint64_t uniform = 0;
    for (std::size_t i = 0; i < edge * edge * edge; ++i)
    {
      const std::size_t cx = x + i % edge;
      const std::size_t cy = y + i / edge % edge;
      const std::size_t cz = z + i / (edge * edge);
      if (cx >= cells || cy >= cells || cz >= cells)
      {
        continue;
      }
      bool seen = false;
      bool single = false;
      bitsOf(cx + cells * (cy + cells * cz), seen, single);
      occupied |= std::uint64_t{ seen ? 1u : 0u } << i;
      uniform |= std::uint64_t{ single ? 1u : 0u } << i;
    }
    __atomic_store_n(words + 2 * m, occupied, __ATOMIC_RELAXED);
    __atomic_store_n(words + 2 * m + 1, uniform, __ATOMIC_RELAXED);
  }
  __atomic_store_n(version, scene.TableVersion, __ATOMIC_RELEASE);
  return words;
}

// Whether anything may be seen of values in a range of texels.
TERAVOX_INLINE bool MayBeSeen(const Transfer& table, const BrickView& view, const TexelRange& range)
{
  return !(range.Least > range.Largest) &&
    !IsEmptyBetween(table, NodeOf(table, view, range.Least), NodeOf(table, view, range.Largest));
}

template <typename T>
inline const std::uint64_t* OccupancyOf(const Context& c, const BrickView& view, std::uint32_t slot)
{
  return OccupancyWords(c.Scene, view, slot,
    [&](std::size_t cell, bool& seen, bool& single)
    {
      const TexelRange range = RangeOf<T>(view, cell);
      single = range.Least == range.Largest;
#if TERAVOX_MASK
      const TexelRange mask = MaskRange<T>(view, cell);
      seen = !(range.Least > range.Largest) &&
        MayLabelsShow(
          c, mask, NodeOf(c.Table, view, range.Least), NodeOf(c.Table, view, range.Largest));
      single = single && mask.Least == mask.Largest;
#else
      seen = MayBeSeen(c.Table, view, range);
#endif
    });
}

// Leaves all the rest of the MacroEdge^3 cells around a cell at once. Returns false beyond the last
// face, which is reached by a rounding error.
TERAVOX_INLINE bool LeapMacro(
  const Walk& w, const BrickView& view, float t1, float& t, Quad& cell, Quad& at, bool& known)
{
  constexpr auto edge = static_cast<float>(shared::CELL_EDGE);
  constexpr auto macroEdge = static_cast<float>(MacroEdge);
  const Quad first = Floor(at * (1.0f / macroEdge)) * macroEdge;
  const Quad far = (FacesAhead(w, first, edge * macroEdge) - w.First) * w.Inverse;
  t = Max(LeastOfThree(far)[0], t);
  if (!(t < t1))
  {
    return true;
  }
  cell = CellAt(w, t);
  known = true;
  const Quad before = at;
  at = CellOf(view, cell);
  return Bits(at != before) != 0;
}

template <typename T, bool Shade, bool Nearest>
void IntegrateBrick(
  Context& c, State& state, const Ray& ray, const BrickView& view, float t0, float t1)
{
  constexpr auto edge = static_cast<float>(shared::CELL_EDGE);
  const Walk w = BeginWalk(ray, view, Nearest ? 0.0f : 0.5f, t1);
  const Quad none = {};
  const bool skip = c.P.Switches[0] != 0;
  const std::uint64_t* onward = OnwardOf(w);
  // Spans of samples: their distance, whence on and how often they may fail.
  const float voxel = VoxelDepth(w);
  c.Watch.Voxel = voxel * ray.World;
  const float firstStep = (c.P.Step[3] > FineError ? FirstStep : FirstFineStep) * voxel;
  float spanStep = firstStep;
  // Not where voxels may have no value: samples could miss them.
  // Nor where a light may have an edge between them, or the opacity of gradients.
  float spansFrom =
    Nearest || sizeof(T) == 4 || (Shade && c.Light.Positional) || GradientOpacity ? t1 : t0;
  int spansLeft = MostFailures;
  // What was left of the ray when last nothing waited in the lot. What waits differs with skipping,
  // and whether spans are tried must not.
  State settled = state;
  // A gradient reaches further than the values of a cell.
  constexpr bool uniformToo = !Shade && !GradientOpacity;
  Lot& lot = c.Cells;
  lot.Count = 0;
  lot.Uniform = 0;
  const auto integrate = [&]
  {
#if TERAVOX_MASK
    SelectTables(c, lot.Mask);
#endif
    if constexpr (Nearest)
    {
      IntegrateNearest<T, Shade>(c, state, ray, view, w);
    }
    else
    {
      IntegrateLinear<T, Shade>(c, state, ray, view, w);
    }
    lot.Count = 0;
    lot.Uniform = 0;
  };
  // Returns whether the ray goes on.
  const auto integrateIf = [&](bool due)
  {
    if (due)
    {
      integrate();
    }
    return !due || !IsOver(c, state);
  };
  const auto cellOf = [&](Quad voxelCell) { return CellOf(view, voxelCell); };
  Quad cell = CellAt(w, t0);
  bool known = true; // `cell` is where the ray is
  Quad at = cellOf(cell);
  float t = t0;
  while (t < t1)
  {
    const Quad exits = (FacesAhead(w, at, edge) - w.First) * w.Inverse;
    const Quad next = LeastOfThree(exits);
    const float stop = Min(Max(next[0], t), t1);
    const CellPlace place = PlaceOf(view, at);
    if (skip && !place.MayMeet(onward))
    {
      if (!LeapMacro(w, view, t1, t, cell, at, known))
      {
        break;
      }
      c.Steps += 1;
      continue;
    }
    const bool occupied = !skip || place.MayBeSeen();
    const bool uniform = uniformToo && occupied && place.IsUniform();
#if TERAVOX_MASK
    const int mask = MaskOf<T>(view, place.Range);
    if (mask > 0 && occupied)
    {
      if (!EnterMask(c, lot, mask, integrateIf))
      {
        return;
      }
      SelectTables(c, mask);
    }
#endif
    if (uniform && stop > t)
    {
      // The field has one value there: one piece.
      lot.Cells[lot.Count] = WithFourth(known ? cell : CellAt(w, t), t);
      lot.Stops[lot.Count] = stop;
      lot.Uniform |= 1u << lot.Count;
      ++lot.Count;
      if (!integrateIf(lot.Count == Lanes))
      {
        return;
      }
    }
    if (!occupied || uniform)
    {
      t = stop;
      known = false;
      at += exits <= next ? w.Move : none;
      if (IsOutside(view, at))
      {
        break; // likewise
      }
      c.Steps += 1;
      continue;
    }
    if (t >= spansFrom && place.MayBeSeen())
    {
      // Most cells of a surface are out of the question by themselves.
      const bool even =
        IsEvenEnough(BoundsOf(c, settled, ray, view, spanStep, RangeOf<T>(view, place.Range)));
      if (!even && spanStep > firstStep)
      {
        spanStep = Max(0.5f * spanStep, firstStep);
        continue;
      }
      const Reach reach =
        even ? LookAhead<T>(view, w, at, t, Min(t + spanStep * SpanPieces, t1)) : Reach{ stop, {} };
      if (even && reach.End - t >= ShortestSpan * firstStep)
      {
        if (!integrateIf(lot.Count != 0))
        {
          return;
        }
        const float cost = IntegrateSpan<T, Shade>(c, state, ray, view, w, t, reach);
        settled = state;
        if (cost <= 1.0f)
        {
          if (IsOver(c, state))
          {
            return;
          }
          t = reach.End;
          NoteSeen(c, t);
          if (t < t1)
          {
            cell = CellAt(w, t);
            known = true;
            at = cellOf(cell);
          }
          // A step of twice the length errs eight times as much.
          spanStep = cost < 0.1f && spanStep < LongestStep * voxel ? 2.0f * spanStep : spanStep;
          continue;
        }
        spansLeft -= spanStep > firstStep || cost == Uneven ? 0 : 1;
        spanStep = firstStep;
      }
      spansFrom = spansLeft > 0 ? reach.End : t1;
    }
    // Voxel cell after voxel cell up to its end.
    if (!known)
    {
      cell = CellAt(w, t);
      known = true;
    }
    do
    {
#if TERAVOX_MASK
      if (mask <= 0)
      {
        if (!PutMasked<T, Nearest>(c, lot, w, view, cell, t, t1, integrateIf))
        {
          return;
        }
        continue;
      }
#endif
      PutCell(lot, w, cell, t, t1);
      if (!integrateIf(lot.Count == Lanes))
      {
        return;
      }
    } while (t < stop);
    at = Within(view, at + (exits <= next ? w.Move : none));
  }
  if (lot.Count != 0)
  {
    integrate();
  }
}
