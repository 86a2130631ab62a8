// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Bricks with a mask (Shaders/Library/Mask.glsl). Its values lie behind the voxels of a slot, in
// texels of the same type: 0 where nothing is drawn; with a label mask else whose tables count,
// with a binary one 1. It is sampled with nearest neighbour: in a cell between voxels it is
// constant in each of the eight octants, and a ray is cut where it passes from one into another.
// What lies between is integrated as it always is.
#if TERAVOX_MASK

// It lies behind so many components, of which `view` is the first.
inline void FindMask(const NativeScene& scene, std::size_t components, BrickView& view)
{
  const auto cubed = [](std::int32_t n) {
    return static_cast<std::size_t>(n) * static_cast<std::size_t>(n) * static_cast<std::size_t>(n);
  };
  view.Mask = view.Voxels + components * cubed(view.Edge) * scene.BytesPerTexel;
  view.MaskCells = view.Cells + components * cubed(view.CellsAlong) * 2 * scene.BytesPerTexel;
}

inline BrickView ViewMasked(const NativeScene& scene, const Transfer& transfer, const Ray& ray,
  int level, Index brick, std::uint32_t slot)
{
  BrickView view = ViewBrick(scene, transfer, ray, level, brick, 2 * slot);
  FindMask(scene, 1, view);
  return view;
}

// The range of the mask's values in a cell of CELL_EDGE^3 voxels, and of those around it that are
// interpolated with them.
template <typename T>
TERAVOX_INLINE TexelRange MaskRange(const BrickView& view, std::size_t cell)
{
  T range[2];
  __builtin_memcpy(range, view.MaskCells + cell * sizeof(range), sizeof(range));
  return { static_cast<float>(range[0]), static_cast<float>(range[1]) };
}

// The one value of such a cell, or -1.
template <typename T>
TERAVOX_INLINE int MaskOf(const BrickView& view, std::size_t cell)
{
  const TexelRange range = MaskRange<T>(view, cell);
  return range.Least == range.Largest ? static_cast<int>(range.Least) : -1;
}

// From now on the tables of a value of the mask count; 0: what is known of all labels together.
TERAVOX_INLINE void SelectTables(Context& c, int value)
{
  if (c.Scene.LabelTables == nullptr || c.Label == value)
  {
    return;
  }
  const NativeScene::LabelTable& table = c.Scene.LabelTables[value];
  c.Table.Integrals = table.Integrals;
  c.Table.Colors = reinterpret_cast<const float*>(table.Colors);
  c.Table.Occupied = table.Occupied;
  c.Table.Extremes = table.Extremes;
  c.Table.Variation = table.Variation;
  c.Gradient.Nodes = table.GradientOpacity;
  c.Label = value;
}

// Whether anything may be seen of values between two positions in nodes under one of the labels
// that a cell may have: of many, under any.
inline bool MayLabelsShow(const Context& c, const TexelRange& mask, float from, float to)
{
  constexpr int most = 8;
  if (c.Scene.LabelTables == nullptr || mask.Largest - mask.Least >= static_cast<float>(most))
  {
    return !IsEmptyBetween(c.Table, from, to);
  }
  Transfer table = c.Table;
  bool any = false;
  for (int value = static_cast<int>(mask.Least); value <= static_cast<int>(mask.Largest); ++value)
  {
    table.Occupied = c.Scene.LabelTables[value].Occupied;
    any = any || !IsEmptyBetween(table, from, to);
  }
  return any;
}

// The mask's values of the eight voxels around a cell between voxels (index x + 2 y + 4 z), or of
// the one voxel that is the cell.
struct MaskValues
{
  int V[8];
};
template <typename T, bool Nearest>
inline MaskValues MaskAround(const BrickView& view, Quad cell)
{
  const auto inSlot = [&](int a)
  { return Min(Max(static_cast<std::int32_t>(cell[a]), 1), view.Edge - 3); };
  const std::int32_t first = inSlot(0) + view.Edge * (inSlot(1) + view.Edge * inSlot(2));
  MaskValues values;
  for (int i = 0; i < 8; ++i)
  {
    const std::int32_t at =
      Nearest ? first : first + (i & 1) + view.Edge * ((i >> 1 & 1) + view.Edge * (i >> 2));
    T value;
    __builtin_memcpy(&value, view.Mask + static_cast<std::size_t>(at) * sizeof(T), sizeof(T));
    values.V[i] = static_cast<int>(value);
  }
  return values;
}

// The parts of a ray in a cell that are drawn: three planes make at most four pieces; what has one
// value stays together.
struct Stretches
{
  float Begin[4];
  float End[4];
  int Mask[4];
  int Count;
};
inline Stretches StretchesOf(
  const Walk& w, Quad cell, const MaskValues& values, float begin, float end)
{
  Stretches s{ { begin }, { end }, { values.V[0] }, values.V[0] != 0 ? 1 : 0 };
  bool isOne = true;
  for (const int value : values.V)
  {
    isOne = isOne && value == values.V[0];
  }
  if (isOne)
  {
    return s;
  }
  s.Count = 0;
  const Quad middles = (cell + 0.5f - w.First) * w.Inverse;
  const float least = Min(middles[0], middles[1]);
  const float largest = Max(middles[0], middles[1]);
  const float cuts[4] = { Min(least, middles[2]), Max(least, Min(largest, middles[2])),
    Max(largest, middles[2]), end };
  float from = begin;
  for (const float cut : cuts)
  {
    const float to = Min(Max(cut, from), end);
    if (!(to > from))
    {
      continue;
    }
    // Behind the middle of an axis lies the upper half, if the ray goes up.
    int octant = 0;
    for (int a = 0; a < 3; ++a)
    {
      octant |= ((middles[a] <= from) == (w.Forward[a] > 0.0f) ? 1 : 0) << a;
    }
    const int value = values.V[octant];
    if (value != 0)
    {
      const bool goesOn = s.Count > 0 && s.End[s.Count - 1] == from && s.Mask[s.Count - 1] == value;
      s.Count += goesOn ? 0 : 1;
      s.Begin[s.Count - 1] = goesOn ? s.Begin[s.Count - 1] : from;
      s.End[s.Count - 1] = to;
      s.Mask[s.Count - 1] = value;
    }
    from = to;
  }
  return s;
}

// What comes next has a value of the mask. Returns whether the ray goes on: a lot has one value, so
// what waits in it may be due.
template <typename IntegrateIf>
TERAVOX_INLINE bool EnterMask(const Context& c, Lot& lot, int value, const IntegrateIf& integrateIf)
{
  if (c.Scene.LabelTables != nullptr && lot.Count != 0 && lot.Mask != value && !integrateIf(true))
  {
    return false;
  }
  lot.Mask = value;
  return true;
}

// PutCell() for a cell with several values of the mask. Returns whether the ray goes on.
template <typename T, bool Nearest, typename IntegrateIf>
TERAVOX_INLINE bool PutMasked(const Context& c, Lot& lot, const Walk& w, const BrickView& view,
  Quad& cell, float& t, float t1, const IntegrateIf& integrateIf)
{
  const Quad here = cell;
  const float begin = t;
  const int count = lot.Count;
  PutCell(lot, w, cell, t, t1);
  lot.Count = count;
  const Stretches s = StretchesOf(w, here, MaskAround<T, Nearest>(view, here), begin, t);
  for (int i = 0; i < s.Count && t > begin; ++i)
  {
    if (!EnterMask(c, lot, s.Mask[i], integrateIf))
    {
      return false;
    }
    lot.Cells[lot.Count] = WithFourth(here, s.Begin[i]);
    lot.Stops[lot.Count] = s.End[i];
    lot.Uniform |= 1u << lot.Count;
    ++lot.Count;
    if (!integrateIf(lot.Count == Lanes))
    {
      return false;
    }
  }
  return true;
}
#endif
