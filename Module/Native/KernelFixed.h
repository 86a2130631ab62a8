// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Steps of a given length (see Shaders/Library/MarchFixed.glsl): what a user who switches error
// control off gets, and what the order of convergence is measured with.

// Position in nodes at eight places of a brick; NaN where a voxel has no value.
template <typename T>
inline Floats FieldAt(
  const Context& c, const BrickView& view, const Walk& walk, Floats t, Ints& at, Vectors& w)
{
  const Vectors q = Positions(walk, view, t);
  const Ints x = InSlot(Truncate(q.X), 1, view.Edge - 3);
  const Ints y = InSlot(Truncate(q.Y), 1, view.Edge - 3);
  const Ints z = InSlot(Truncate(q.Z), 1, view.Edge - 3);
  w = { q.X - ToFloat(x), q.Y - ToFloat(y), q.Z - ToFloat(z) };
  at = x + view.Edge * (y + view.Edge * z);
  const Vectors nowhere{ Floats{}, Floats{}, Floats{} };
  const Floats texel = CubicAlong(LoadCorners<T>(view, at), w, nowhere).A;
  return (texel * view.Scale + view.Offset) * c.Table.NodesPerUnit;
}

template <typename T, bool Shade>
void IntegrateFixed(
  Context& c, State& state, const Ray& ray, const BrickView& view, float t0, float t1)
{
  const float step = c.P.Step[0] / ray.World;
  Walk w{};
  w.First = { view.Base.X - 0.5f, view.Base.Y - 0.5f, view.Base.Z - 0.5f };
  Lot lot;
  float t = t0;
  while (t < t1)
  {
    for (lot.Count = 0; lot.Count < Lanes && t < t1; ++lot.Count)
    {
      // t is often a multiple itself, and t / step may be rounded to just below it.
      const float cut = __builtin_floorf(t / step);
      float next = (cut + 1.0f) * step;
      next = next > t ? next : (cut + 2.0f) * step;
      next = next > t ? Min(next, t1) : t1;
      lot.Begin[lot.Count] = t;
      lot.End[lot.Count] = next;
      t = next;
    }
    for (int l = lot.Count; l < Lanes; ++l)
    {
      lot.Begin[l] = lot.End[l] = t;
    }
    Ints at;
    Vectors within;
    const Floats begin = Load(lot.Begin);
    const Floats length = Load(lot.End) - begin;
    const Sample<Floats> a =
      SampleTransfer(c.Table, FieldAt<T>(c, view, w, begin, at, within));
    const Sample<Floats> b =
      SampleTransfer(c.Table, FieldAt<T>(c, view, w, Load(lot.End), at, within));
    Floats depth = MeanExtinction(a, b, Floats{}, Floats{}).Mean * (length * ray.World);
    depth = Select((a.X == a.X) & (b.X == b.X), depth, Floats{});
    const Floats opacity = OpacityOf(depth);
    const Floats gathered = CentroidOf(a.S, b.S, depth, opacity);
    Color<Floats> color =
      Mix(TransferColor(c.Table, a.X), TransferColor(c.Table, b.X), gathered);
    if constexpr (Shade)
    {
      FieldAt<T>(c, view, w, begin + length * gathered, at, within);
      const Vectors nowhere{ Floats{}, Floats{}, Floats{} };
      const Gradient g = LoadGradient<T>(view, at, LoadCorners<T>(view, at), within, nowhere);
      color = LitColor(c.P, color, g.X.A * view.PerVoxelX, g.Y.A * view.PerVoxelY,
        g.Z.A * view.PerVoxelZ, c.TowardsLight);
    }
    for (int l = 0; l < lot.Count; ++l)
    {
      c.Contributing += depth[l] > 0.0f ? 1 : 0;
      Accumulate(state, opacity[l], color.Red[l], color.Green[l], color.Blue[l]);
      if (IsOver(c, state))
      {
        return;
      }
    }
    c.Steps += static_cast<std::uint32_t>(lot.Count);
    c.Samples += static_cast<std::uint64_t>(lot.Count);
  }
}
