// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// From one visible cell of a brick to the next, in lots of eight.

// Cells between voxel centres, or voxels where the field is constant in each; `First` is the
// position at depth 0 in the units and from the place that the cells are counted in.
struct Walk
{
  Vector First;
  Vector Inverse; // depth per cell
  std::int32_t Forward[3]; // 1 where the ray goes up, else 0
  float T;   // where the walk is
  float End; // depth
};

struct alignas(32) Lot
{
  std::int32_t X[Lanes];
  std::int32_t Y[Lanes];
  std::int32_t Z[Lanes];
  float Begin[Lanes];
  float End[Lanes];
  int Count = 0;
};

inline Floats Load(const float (&v)[Lanes])
{
  Floats r;
  __builtin_memcpy(&r, v, sizeof(r));
  return r;
}
inline Ints Load(const std::int32_t (&v)[Lanes])
{
  Ints r;
  __builtin_memcpy(&r, v, sizeof(r));
  return r;
}

inline Vectors Positions(const Walk& w, const BrickView& view, Floats t)
{
  return { w.First.X + t * view.Direction.X, w.First.Y + t * view.Direction.Y,
    w.First.Z + t * view.Direction.Z };
}

inline Ints InSlot(Ints v, std::int32_t first, std::int32_t last)
{
  return Min(Max(v, Splat(first)), Splat(last));
}

// The first `count` lanes.
inline Ints FirstLanes(int count)
{
  const Ints lane = { 0, 1, 2, 3, 4, 5, 6, 7 };
  return lane < count;
}

template <typename T, bool Shade>
inline void IntegrateLinear(
  Context& c, State& state, const Ray& ray, const BrickView& view, const Walk& walk, const Lot& lot)
{
  c.Steps += static_cast<std::uint32_t>(lot.Count);
  c.Samples += static_cast<std::uint64_t>(lot.Count);
  // Border voxels are there for shading; rounding must not lead out of the slot.
  const Ints x = InSlot(Load(lot.X), 1, view.Edge - 3);
  const Ints y = InSlot(Load(lot.Y), 1, view.Edge - 3);
  const Ints z = InSlot(Load(lot.Z), 1, view.Edge - 3);
  const Ints at = x + view.Edge * (y + view.Edge * z);
  const Corners k = LoadCorners<T>(view, at);
  Floats least = k.V[0];
  Floats largest = k.V[0];
  for (int i = 1; i < 8; ++i)
  {
    least = Min(least, k.V[i]);
    largest = Max(largest, k.V[i]);
  }
  Ints visible = FirstLanes(lot.Count);
  if (c.P.Switches[0] != 0)
  {
    visible &= ~IsEmptyBetween(c.Table, (least * view.Scale + view.Offset) * c.Table.NodesPerUnit,
      (largest * view.Scale + view.Offset) * c.Table.NodesPerUnit);
  }
  if constexpr (sizeof(T) == 4)
  {
    // One voxel without a value, and there is none in between.
    const Floats sum = ((k.V[0] + k.V[1]) + (k.V[2] + k.V[3])) +
      ((k.V[4] + k.V[5]) + (k.V[6] + k.V[7]));
    visible &= sum == sum;
  }
  unsigned bits = Bits(visible);
  if (bits == 0)
  {
    return;
  }
  const Floats begin = Load(lot.Begin);
  const Floats passed = Load(lot.End) - begin;
  Vectors w = Positions(walk, view, begin);
  w = { w.X - ToFloat(x), w.Y - ToFloat(y), w.Z - ToFloat(z) };
  const Vectors d{ passed * view.Direction.X, passed * view.Direction.Y,
    passed * view.Direction.Z };
  Segments s;
  s.Field = CubicAlong(k, w, d);
  const float toNodes = view.Scale * c.Table.NodesPerUnit;
  s.Field = { (s.Field.A * view.Scale + view.Offset) * c.Table.NodesPerUnit, s.Field.B * toNodes,
    s.Field.C * toNodes, s.Field.D * toNodes };
  s.Length = passed * ray.World;
  if constexpr (Shade)
  {
    s.Light = LoadGradient<T>(view, at, k, w, d);
    const auto scale = [](const Cubic& g, float f) -> Cubic
    { return { g.A * f, g.B * f, g.C * f, g.D * f }; };
    s.Light = { scale(s.Light.X, view.PerVoxelX), scale(s.Light.Y, view.PerVoxelY),
      scale(s.Light.Z, view.PerVoxelZ) };
  }
  const Floats turn = TurningPoint(s.Field);
  const unsigned turning = Bits(turn < 1.0f) & bits;
  Pieces front;
  Pieces back;
  Evaluate<Shade>(c, s, Floats{}, turn, front);
  if (turning != 0)
  {
    Evaluate<Shade>(c, s, turn, Splat(1.0f), back);
  }
  while (bits != 0)
  {
    const int lane = __builtin_ctz(bits);
    bits &= bits - 1;
    const float before = state.Transmittance;
    Take<Shade>(c, state, s, front, lane, lane, 0.0f, turn[lane]);
    if ((turning >> lane & 1u) != 0 && !IsOver(c, state))
    {
      Take<Shade>(c, state, s, back, lane, lane, turn[lane], 1.0f);
    }
    c.Contributing += state.Transmittance < before ? 1 : 0;
    if (IsOver(c, state))
    {
      return;
    }
  }
}

// The field is constant in each voxel: one segment per voxel.
template <typename T, bool Shade>
inline void IntegrateNearest(
  Context& c, State& state, const Ray& ray, const BrickView& view, const Lot& lot)
{
  c.Steps += static_cast<std::uint32_t>(lot.Count);
  c.Samples += static_cast<std::uint64_t>(lot.Count);
  const Ints at = InSlot(Load(lot.X), 1, view.Edge - 2) +
    view.Edge *
      (InSlot(Load(lot.Y), 1, view.Edge - 2) + view.Edge * InSlot(Load(lot.Z), 1, view.Edge - 2));
  const Floats texel = LoadTexel<T>(view, at);
  const Floats node = (texel * view.Scale + view.Offset) * c.Table.NodesPerUnit;
  const Floats length = (Load(lot.End) - Load(lot.Begin)) * ray.World;
  Floats depth = SampleTransfer(c.Table, node).S * length;
  depth = Select(FirstLanes(lot.Count) & (texel == texel), depth, Floats{});
  unsigned bits = Bits(depth > 0.0f);
  if (bits == 0)
  {
    return;
  }
  Color<Floats> color = TransferColor(c.Table, node);
  if constexpr (Shade)
  {
    const auto difference = [&](std::int32_t step, float perVoxel)
    { return (LoadTexel<T>(view, at + step) - LoadTexel<T>(view, at - step)) * perVoxel; };
    color = LitColor(c.P, color, difference(1, view.PerVoxelX),
      difference(view.Edge, view.PerVoxelY), difference(view.Edge * view.Edge, view.PerVoxelZ),
      c.TowardsLight);
  }
  const Floats opacity = OpacityOf(depth);
  while (bits != 0)
  {
    const int lane = __builtin_ctz(bits);
    bits &= bits - 1;
    Accumulate(state, opacity[lane], color.Red[lane], color.Green[lane], color.Blue[lane]);
    c.Contributing += 1;
    if (IsOver(c, state))
    {
      return;
    }
  }
}

// The cell at a depth: faces decide, as they do when the walk steps over them.
inline std::int32_t CellAt(float first, float direction, float inverse, std::int32_t forward,
  float t)
{
  const std::int32_t cell = Floor(first + t * direction);
  const float exit = (static_cast<float>(cell + forward) - first) * inverse;
  const float entry = (static_cast<float>(cell + 1 - forward) - first) * inverse;
  return cell + (2 * forward - 1) * ((exit <= t ? 1 : 0) - (entry > t ? 1 : 0));
}

// Whether nothing in a cell of CELL_EDGE^3 voxels is visible.
template <typename T>
inline bool IsEmptyCell(const Context& c, const BrickView& view, std::int32_t index)
{
  T range[2];
  __builtin_memcpy(range, view.Cells + static_cast<std::size_t>(index) * sizeof(range),
    sizeof(range));
  const auto least = static_cast<float>(range[0]);
  const auto largest = static_cast<float>(range[1]);
  return least > largest ||
    IsEmptyBetween(c.Table, (least * view.Scale + view.Offset) * c.Table.NodesPerUnit,
      (largest * view.Scale + view.Offset) * c.Table.NodesPerUnit);
}

template <typename T, bool Shade, bool Nearest>
void IntegrateBrick(
  Context& c, State& state, const Ray& ray, const BrickView& view, float t0, float t1)
{
  constexpr auto edge = static_cast<std::int32_t>(shared::CELL_EDGE);
  constexpr auto border = static_cast<std::int32_t>(Border);
  constexpr float shift = Nearest ? 0.0f : 0.5f;
  Walk w;
  w.First = { view.Base.X - shift, view.Base.Y - shift, view.Base.Z - shift };
  w.Inverse = { 1.0f / view.Direction.X, 1.0f / view.Direction.Y, 1.0f / view.Direction.Z };
  w.Forward[0] = static_cast<std::int32_t>(ray.Positive.X);
  w.Forward[1] = static_cast<std::int32_t>(ray.Positive.Y);
  w.Forward[2] = static_cast<std::int32_t>(ray.Positive.Z);
  w.T = t0;
  w.End = t1;
  const std::int32_t move[3] = { 2 * w.Forward[0] - 1, 2 * w.Forward[1] - 1,
    2 * w.Forward[2] - 1 };
  const float first[3] = { w.First.X, w.First.Y, w.First.Z };
  const float direction[3] = { view.Direction.X, view.Direction.Y, view.Direction.Z };
  const float inverse[3] = { w.Inverse.X, w.Inverse.Y, w.Inverse.Z };
  std::int32_t cell[3];
  for (int a = 0; a < 3; ++a)
  {
    cell[a] = CellAt(first[a], direction[a], inverse[a], w.Forward[a], t0);
  }
  const bool skip = c.P.Switches[0] != 0;
  Lot lot;
  const auto integrate = [&]
  {
    if constexpr (Nearest)
    {
      IntegrateNearest<T, Shade>(c, state, ray, view, lot);
    }
    else
    {
      IntegrateLinear<T, Shade>(c, state, ray, view, w, lot);
    }
    lot.Count = 0;
  };
  while (w.T < w.End)
  {
    std::int32_t at[3];
    float exits[3];
    std::int32_t face[3];
    for (int a = 0; a < 3; ++a)
    {
      const std::int32_t last = view.CellsAlong - 1;
      at[a] = Min(Max((cell[a] - border + edge) / edge - 1, 0), last);
      const std::int32_t low = at[a] * edge + border;
      // The first cell begins half a voxel before the brick.
      face[a] = w.Forward[a] != 0 ? low + edge : low - (at[a] == 0 ? 1 : 0);
      exits[a] = (static_cast<float>(face[a]) - first[a]) * inverse[a];
    }
    const float leave = Max(Min(exits[0], Min(exits[1], exits[2])), w.T);
    if (skip &&
      IsEmptyCell<T>(c, view, at[0] + view.CellsAlong * (at[1] + view.CellsAlong * at[2])))
    {
      for (int a = 0; a < 3; ++a)
      {
        cell[a] = exits[a] <= leave
          ? face[a] - (1 - w.Forward[a])
          : CellAt(first[a], direction[a], inverse[a], w.Forward[a], leave);
      }
      w.T = leave;
      c.Steps += 1;
      continue;
    }
    // One by one up to the end of that cell; the faces ahead of the ray are kept.
    const float stop = Min(leave, w.End);
    for (int a = 0; a < 3; ++a)
    {
      exits[a] = (static_cast<float>(cell[a] + w.Forward[a]) - first[a]) * inverse[a];
    }
    do
    {
      const float next = Min(exits[0], Min(exits[1], exits[2]));
      const float begin = w.T;
      w.T = Min(Max(next, begin), w.End);
      const int i = lot.Count;
      lot.X[i] = cell[0];
      lot.Y[i] = cell[1];
      lot.Z[i] = cell[2];
      lot.Begin[i] = begin;
      lot.End[i] = w.T;
      lot.Count += w.T > begin ? 1 : 0;
      for (int a = 0; a < 3; ++a)
      {
        if (exits[a] <= next)
        {
          cell[a] += move[a];
          exits[a] = (static_cast<float>(cell[a] + w.Forward[a]) - first[a]) * inverse[a];
        }
      }
      if (lot.Count == Lanes)
      {
        integrate();
        if (IsOver(c, state))
        {
          return;
        }
      }
    } while (w.T < stop);
  }
  if (lot.Count != 0)
  {
    integrate();
  }
}
