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
