// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// The walk of a ray from cell to cell of a brick.

// Cells between voxel centres, or voxels where the field is constant in each. x, y, z, and a fourth
// lane in which nothing is ever met.
struct Walk
{
  Quad First;     // position at depth 0, in the units and from the place that cells are counted in
  Quad Direction; // cells per depth
  Quad Inverse;   // depth per cell
  Quad Forward;   // 1 where the ray goes up, else 0
  Quad Move;      // 1 or -1
  float End;      // depth
};

inline Walk BeginWalk(const Ray& ray, const BrickView& view, float shift, float end)
{
  Walk w;
  w.First = WithFourth(view.Base - shift, 0.0f);
  w.Direction = WithFourth(view.Direction, 0.0f);
  w.Inverse = WithFourth(1.0f / w.Direction, FarAway);
  w.Forward = ToFloat(ray.Positive);
  w.Move = WithFourth(w.Forward * 2.0f - 1.0f, 0.0f);
  w.End = end;
  return w;
}

// The cell at a depth: faces decide, as they do when the walk steps over them.
TERAVOX_INLINE Quad CellAt(const Walk& w, float t)
{
  const Quad cell = Floor(w.First + t * w.Direction);
  const Quad exits = (cell + w.Forward - w.First) * w.Inverse;
  const Quad entries = (cell + (1.0f - w.Forward) - w.First) * w.Inverse;
  const Quad none = {};
  return cell + ((exits <= Spread(t) ? w.Move : none) - (entries > Spread(t) ? w.Move : none));
}

TERAVOX_INLINE Ints InSlot(Floats v, std::int32_t first, std::int32_t last)
{
  return Min(Max(Truncate(v), Splat(first)), Splat(last));
}

// The first `count` lanes.
inline Ints FirstLanes(int count)
{
  const Ints lane = { 0, 1, 2, 3, 4, 5, 6, 7 };
  return lane < count;
}

TERAVOX_INLINE Quad LastCell(const BrickView& view)
{
  return Spread(static_cast<float>(view.CellsAlong - 1));
}
TERAVOX_INLINE bool IsOutside(const BrickView& view, Quad at)
{
  return Bits((at < Quad{}) | (at > LastCell(view))) != 0;
}

TERAVOX_INLINE Quad Within(const BrickView& view, Quad at)
{
  const Quad none = {};
  const Quad last = LastCell(view);
  return at < none ? none : at > last ? last : at;
}
// The cell of CELL_EDGE^3 voxels of a voxel cell.
TERAVOX_INLINE Quad CellOf(const BrickView& view, Quad voxelCell)
{
  constexpr auto edge = static_cast<float>(shared::CELL_EDGE);
  return Within(view, Floor((voxelCell - Border) * (1.0f / edge)));
}

// Puts the voxel cell in which a ray is at depth t into a lot, and goes on to the next.
TERAVOX_INLINE void PutCell(Lot& lot, const Walk& w, Quad& cell, float& t, float t1)
{
  const Quad ahead = (cell + w.Forward - w.First) * w.Inverse;
  const Quad leave = LeastOfThree(ahead);
  lot.Cells[lot.Count] = WithFourth(cell, t);
  const float begin = t;
  t = Min(Max(leave[0], begin), t1);
  lot.Count += t > begin ? 1 : 0;
  cell += ahead <= leave ? w.Move : Quad{};
}

// Which of the MacroEdge^3 cells of a word can be met by a ray from each of them on: those that
// aren't behind it on any axis. One table for each of the eight combinations of signs (x + 2 y +
// 4 z, 1 for upwards).
struct OnwardTable
{
  std::uint64_t Cells[8][MacroEdge * MacroEdge * MacroEdge];
};
constexpr OnwardTable MakeOnward()
{
  OnwardTable table{};
  constexpr int count = MacroEdge * MacroEdge * MacroEdge;
  for (int signs = 0; signs < 8; ++signs)
  {
    for (int from = 0; from < count; ++from)
    {
      for (int to = 0; to < count; ++to)
      {
        bool met = true;
        for (int axis = 0; axis < 3; ++axis)
        {
          const int shift = 2 * axis;
          const int step = (to >> shift & 3) - (from >> shift & 3);
          met = met && ((signs >> axis & 1) != 0 ? step >= 0 : step <= 0);
        }
        table.Cells[signs][from] |= std::uint64_t{ met ? 1u : 0u } << to;
      }
    }
  }
  return table;
}
constexpr OnwardTable Onward = MakeOnward();
inline const std::uint64_t* OnwardOf(const Walk& w)
{
  return Onward.Cells[Bits(w.Forward > Quad{}) & 7u];
}

// Faces ahead of a ray of `size` voxels from the cell of CELL_EDGE^3 voxels `at` on. The first cell
// begins half a voxel before the brick.
TERAVOX_INLINE Quad FacesAhead(const Walk& w, Quad at, float size)
{
  const Quad none = {};
  const Quad low = at * static_cast<float>(shared::CELL_EDGE) + Border;
  return w.Forward > none ? low + size : low - (at == none ? none + 1.0f : none);
}

// Where a cell of CELL_EDGE^3 voxels is found: its words of bits, its bit and its range.
struct CellPlace
{
  const std::uint64_t* Words;
  int Bit;
  std::size_t Range;

  bool MayBeSeen() const { return (this->Seen() >> this->Bit & 1u) != 0; }
  bool IsUniform() const
  {
    return (__atomic_load_n(this->Words + 1, __ATOMIC_RELAXED) >> this->Bit & 1u) != 0;
  }
  // All MacroEdge^3 whose bits are in the word.
  std::uint64_t Seen() const { return __atomic_load_n(this->Words, __ATOMIC_RELAXED); }
  // Of those whose bits are in its word: whether the ray may meet one that may be seen.
  bool MayMeet(const std::uint64_t* onward) const
  {
    return (this->Seen() & onward[this->Bit]) != 0;
  }
};
// Of a cell of CELL_EDGE^3 voxels among those of its brick, x fastest.
TERAVOX_INLINE std::size_t IndexOf(const BrickView& view, Quad at)
{
  const auto x = static_cast<std::int32_t>(at[0]);
  const auto y = static_cast<std::int32_t>(at[1]);
  const auto z = static_cast<std::int32_t>(at[2]);
  return static_cast<std::size_t>(x + view.CellsAlong * (y + view.CellsAlong * z));
}
TERAVOX_INLINE CellPlace PlaceOf(const BrickView& view, Quad at)
{
  static_assert(MacroEdge == 4);
  const auto x = static_cast<std::int32_t>(at[0]);
  const auto y = static_cast<std::int32_t>(at[1]);
  const auto z = static_cast<std::int32_t>(at[2]);
  return { view.Occupancy +
      2 * ((x >> 2) + view.MacrosAlong * ((y >> 2) + view.MacrosAlong * (z >> 2))),
    (x & 3) | (y & 3) << 2 | (z & 3) << 4, IndexOf(view, at) };
}

// The range of the texels of a cell.
struct TexelRange
{
  float Least;
  float Largest;
};
template <typename T>
TERAVOX_INLINE TexelRange RangeOf(const BrickView& view, std::size_t cell)
{
  T range[2];
  __builtin_memcpy(range, view.Cells + cell * sizeof(range), sizeof(range));
  return { static_cast<float>(range[0]), static_cast<float>(range[1]) };
}
