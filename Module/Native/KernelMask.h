// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Bricks of which only a part is drawn (Shaders/Library/Mask.glsl). A mask of ones and zeros lies
// behind the voxels of a slot, in texels of the same type. It is sampled with nearest neighbour: in
// a cell between voxels it is constant in each of the eight octants, and a ray is cut where it
// passes from one into another. What is in the mask is integrated as it always is.
#if TERAVOX_MASK

inline BrickView ViewMasked(const NativeScene& scene, const Transfer& transfer, const Ray& ray,
  int level, Index brick, std::uint32_t slot)
{
  BrickView view = ViewBrick(scene, transfer, ray, level, brick, 2 * slot);
  const auto cubed = [](std::int32_t n) {
    return static_cast<std::size_t>(n) * static_cast<std::size_t>(n) * static_cast<std::size_t>(n);
  };
  view.Mask = view.Voxels + cubed(view.Edge) * scene.BytesPerTexel;
  view.MaskCells = view.Cells + cubed(view.CellsAlong) * 2 * scene.BytesPerTexel;
  return view;
}

// Whether all voxels of a cell of CELL_EDGE^3 are in the mask, and those around it that are
// interpolated with them.
template <typename T>
TERAVOX_INLINE bool IsWhollyIn(const BrickView& view, std::size_t cell)
{
  T least;
  __builtin_memcpy(&least, view.MaskCells + cell * 2 * sizeof(T), sizeof(T));
  return least != 0;
}

// One bit per voxel that is in the mask, of the eight around a cell between voxels (index x + 2 y +
// 4 z), or of the one voxel that is the cell.
template <typename T, bool Nearest>
inline unsigned MaskBits(const BrickView& view, Quad cell)
{
  const auto inSlot = [&](int a)
  { return Min(Max(static_cast<std::int32_t>(cell[a]), 1), view.Edge - 3); };
  const std::int32_t first = inSlot(0) + view.Edge * (inSlot(1) + view.Edge * inSlot(2));
  unsigned bits = 0;
  for (int i = 0; i < (Nearest ? 1 : 8); ++i)
  {
    const std::int32_t at = first + (i & 1) + view.Edge * ((i >> 1 & 1) + view.Edge * (i >> 2));
    T value;
    __builtin_memcpy(&value, view.Mask + static_cast<std::size_t>(at) * sizeof(T), sizeof(T));
    bits |= (value != 0 ? 1u : 0u) << i;
  }
  return Nearest && bits != 0 ? 255u : bits;
}

// The parts of a ray in a cell that are in the mask: three planes make at most four pieces, of
// which two with one between them may be in.
struct Stretches
{
  float Begin[2];
  float End[2];
  int Count;
};
inline Stretches StretchesOf(const Walk& w, Quad cell, unsigned bits, float begin, float end)
{
  Stretches s{ { begin, 0.0f }, { end, 0.0f }, bits != 0 ? 1 : 0 };
  if (bits == 0 || bits == 255u)
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
    if ((bits >> octant & 1u) != 0)
    {
      const bool goesOn = s.Count > 0 && s.End[s.Count - 1] == from;
      s.Count += goesOn ? 0 : 1;
      s.Begin[s.Count - 1] = goesOn ? s.Begin[s.Count - 1] : from;
      s.End[s.Count - 1] = to;
    }
    from = to;
  }
  return s;
}

// PutCell() for a cell that may lie in the mask in part. Returns whether the ray goes on.
template <typename T, bool Nearest, typename IntegrateIf>
TERAVOX_INLINE bool PutMasked(Lot& lot, const Walk& w, const BrickView& view, Quad& cell, float& t,
  float t1, const IntegrateIf& integrateIf)
{
  const Quad here = cell;
  const float begin = t;
  const int count = lot.Count;
  PutCell(lot, w, cell, t, t1);
  lot.Count = count;
  const Stretches s = StretchesOf(w, here, MaskBits<T, Nearest>(view, here), begin, t);
  for (int i = 0; i < s.Count && t > begin; ++i)
  {
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
