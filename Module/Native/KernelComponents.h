// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Bricks of voxels with several components: which of their cells are visible, and from one to the
// next.

inline float LargestLight(const Context& c)
{
  return c.Components.LargestLight;
}

// Ranges of bricks and regions are those of all components; in the place of nodes they are values.
// `isEmpty`: whether an emitter makes no difference between two positions in its nodes.
template <typename IsEmpty>
inline Found FindComponents(Context& c, const Level& level, Index brick, const IsEmpty& isEmpty)
{
  const ComponentTables& k = c.Components;
  Transfer values = c.Table;
  values.Low = values.LowRest = 0.0f;
  values.NodesPerUnit = 1.0f;
  const auto areEmpty = [&](float low, float high)
  {
    // The values may be rounded.
    const float first = low - Abs(low) * 1.2e-7f;
    const float last = high + Abs(high) * 1.2e-7f;
    for (int e = 0; e < k.EmitterCount; ++e)
    {
      const int i = k.Emitters[e];
      if (!isEmpty(i, TransferPosition(k.Tables[i], first, 0.0f),
            TransferPosition(k.Tables[i], last, 0.0f)))
      {
        return false;
      }
    }
    return true;
  };
  return Translate(c.Scene, values, level, brick,
    [&](bool none, float from, float to) { return none || areEmpty(from, to); });
}

// The largest extinction that values allow: components together have at most the largest of
// extinction per weight.
inline void ComponentExtremes(const Context& c, float low, float high, float& most)
{
  const ComponentTables& k = c.Components;
  most = 0.0f;
  for (int e = 0; e < k.EmitterCount; ++e)
  {
    const int i = k.Emitters[e];
    const Transfer& table = k.Tables[i];
    float least = 0.0f;
    float largest = 0.0f;
    ExtremesBetween(table, TransferPosition(table, low, 0.0f), TransferPosition(table, high, 0.0f),
      least, largest);
    most = Max(most, largest * k.PerWeight[i]);
  }
}

// One segment whose components all have one value. `slope`: their central difference, which is 0
// where nothing is cut away.
inline void ComponentsConstant(Context& c, State& state, const Ray& ray, float valueHigh,
  float valueLow, Quad slope, float t0, float t1)
{
  const ComponentTables& k = c.Components;
  float x[MostComponents] = {};
  float has[MostComponents] = {};
  ComponentPoint<float> p;
  for (int i = 0; i < k.Count; ++i)
  {
    x[i] = TransferPosition(k.Tables[i], valueHigh, valueLow);
    has[i] = 1.0f;
    p.N[i] = NormalOf(c.P, slope[0], slope[1], slope[2]);
    if (k.ByGradient)
    {
      p.G[i] = SampleGradient(k.Gradients[i], slope[0], slope[1], slope[2]);
    }
  }
  FindPoint(c, x, has, 0.5f * (t0 + t1), p);
  const float depth = p.Kappa * (Max(t1 - t0, 0.0f) * ray.World);
  const float opacity = OpacityOf(depth);
  const float inverse = p.Kappa > LeastKappa ? 1.0f / p.Kappa : 0.0f;
  Accumulate(state, opacity,
    Quad{ p.Light.Red * inverse, p.Light.Green * inverse, p.Light.Blue * inverse, 0.0f },
    -opacity * c.P.Step[1]);
  c.Steps += 1;
  c.Samples += 1;
  c.Report.Evaluated += 1;
  c.Contributing += depth > 0.0f ? 1 : 0;
}

using ComponentViews = BrickView[MostComponents];

// Eight segments of one value per component.
inline void TakeUniform(
  Context& c, State& state, const ComponentPoint<Floats>& p, Floats length, Ints valid)
{
  const Floats depth = Select(valid, p.Kappa * length, Floats{});
  const Floats inverse = 1.0f / Select(p.Kappa > LeastKappa, p.Kappa, Splat(1.0f));
  Quad colors[Lanes];
  ToQuads(Color<Floats>{ p.Light.Red * inverse, p.Light.Green * inverse, p.Light.Blue * inverse },
    OpacityOf(depth), colors);
  for (unsigned bits = Bits(depth > 0.0f); bits != 0; bits &= bits - 1)
  {
    const int lane = __builtin_ctz(bits);
    Accumulate(state, colors[lane][3], colors[lane], -colors[lane][3] * c.P.Step[1]);
    c.Report.Evaluated += 1;
    c.Contributing += 1;
    if (IsOver(c, state))
    {
      return;
    }
  }
}

TERAVOX_INLINE Cubic Scaled(const Cubic& g, float f)
{
  return { g.A * f, g.B * f, g.C * f, g.D * f };
}

template <typename T>
__attribute__((noinline)) void ComponentsLinear(
  Context& c, State& state, const Ray& ray, const ComponentViews& views, const Walk& walk)
{
  const ComponentTables& k = c.Components;
  const LotView v = OpenLot<T>(c, walk, views[0]);
  Corners corners[MostComponents];
  Ints has[MostComponents];
  Ints colors = v.Valid; // what dependent components take their colours from has values
  for (int i = 0; i < k.Count; ++i)
  {
    corners[i] = LoadCorners<T>(views[i], v.At);
    has[i] = v.Valid & HaveValues<T>(corners[i]);
    colors &= k.Dependent ? has[i] : v.Valid;
  }
  const bool skip = c.P.Switches[0] != 0;
  Ints visible = {};
  for (int e = 0; e < k.EmitterCount; ++e)
  {
    const int i = k.Emitters[e];
    has[i] &= colors;
    Floats least = corners[i].V[0];
    Floats largest = corners[i].V[0];
    for (int j = 1; j < 8; ++j)
    {
      least = Min(least, corners[i].V[j]);
      largest = Max(largest, corners[i].V[j]);
    }
    const Transfer& table = k.Tables[i];
    visible |= skip ? has[i] &
        ~IsEmptyBetween(table, NodeOf(table, views[i], least), NodeOf(table, views[i], largest))
                    : has[i];
  }
  const unsigned bits = Bits(visible);
  if (bits == 0)
  {
    return;
  }
  const Vectors w = PlacesIn(walk, v);
  const Vectors d = PassedIn(walk, v);
  ComponentSegments s;
  s.Length = (v.End - v.Begin) * ray.World;
  s.Begin = v.Begin;
  for (int i = 0; i < k.Count; ++i)
  {
    const Cubic texels = CubicAlong(corners[i], w, d);
    const float toNodes = views[i].Scale * k.Tables[i].NodesPerUnit;
    const auto known = [&](Floats f) { return Select(has[i], f, Floats{}); };
    s.Field[i] = { known(NodeOf(k.Tables[i], views[i], texels.A)), known(texels.B * toNodes),
      known(texels.C * toNodes), known(texels.D * toNodes) };
    s.Has[i] = Select(has[i], Splat(1.0f), Floats{});
    if (NeedsSlopes(c) && k.Weight[i] > 0.0f)
    {
      c.Report.Gradients += static_cast<std::uint64_t>(__builtin_popcount(bits));
      const Gradient g = LoadGradient<T>(views[i], v.At, corners[i], w, d);
      s.Slope[i] = { Scaled(g.X, views[i].PerVoxelX), Scaled(g.Y, views[i].PerVoxelY),
        Scaled(g.Z, views[i].PerVoxelZ) };
    }
  }
  TakeSegments(c, state, s, bits);
}

// From a component's central difference per axis in voxels of level 0.
TERAVOX_INLINE void SetGradient(
  const Context& c, int i, Floats x, Floats y, Floats z, ComponentPoint<Floats>& p)
{
  if (c.Scene.Shade)
  {
    p.N[i] = NormalOf(c.P, x, y, z);
  }
  if (c.Components.ByGradient)
  {
    p.G[i] = SampleGradient(c.Components.Gradients[i], x, y, z);
  }
}

template <typename T>
__attribute__((noinline)) void ComponentsNearest(
  Context& c, State& state, const Ray& ray, const ComponentViews& views, const Walk& walk)
{
  const ComponentTables& k = c.Components;
  const LotView v = OpenLot<T>(c, walk, views[0]);
  Floats x[MostComponents] = {};
  Floats has[MostComponents] = {};
  Ints colors = v.Valid;
  ComponentPoint<Floats> p;
  for (int i = 0; i < k.Count; ++i)
  {
    const Floats texel = LoadTexel<T>(views[i], v.At, 0);
    const Ints known = texel == texel;
    x[i] = Select(known, NodeOf(k.Tables[i], views[i], texel), Floats{});
    has[i] = Select(known, Splat(1.0f), Floats{});
    colors &= k.Dependent ? known : v.Valid;
    if (NeedsSlopes(c) && k.Weight[i] > 0.0f)
    {
      const Vectors difference = DifferenceOf<T>(views[i], v.At);
      SetGradient(c, i, difference.X, difference.Y, difference.Z, p);
    }
  }
  FindPoint(c, x, has, 0.5f * (v.Begin + v.End), p);
  TakeUniform(c, state, p, (v.End - v.Begin) * ray.World, colors);
}

// The bits of the cells of a slot (see OccupancyOf): visible is what any component is.
template <typename T>
inline const std::uint64_t* ComponentOccupancyOf(
  const Context& c, const ComponentViews& views, std::uint32_t slot)
{
  const ComponentTables& k = c.Components;
  return OccupancyWords(c.Scene, views[0], slot,
    [&](std::size_t cell, bool& seen, bool&)
    {
      for (int e = 0; e < k.EmitterCount && !seen; ++e)
      {
        const BrickView& view = views[k.Emitters[e]];
        seen = MayBeSeen(k.Tables[k.Emitters[e]], view, RangeOf<T>(view, cell));
      }
    });
}

// Puts the voxel cell where the ray is into the lot, or the parts of it that a mask lets through,
// which is done for the cells of CELL_EDGE^3 at `place` whose mask isn't of one value. Returns
// whether the ray goes on.
template <typename T, typename IntegrateIf>
TERAVOX_INLINE bool PutComponents(const Context& c, Lot& lot, const Walk& w, const BrickView& view,
  std::size_t place, Quad& cell, float& t, float t1, const IntegrateIf& integrateIf)
{
  if (c.Scene.Masked && MaskOf<T>(view, place) <= 0)
  {
    return c.Scene.Nearest ? PutMasked<T, true>(c, lot, w, view, cell, t, t1, integrateIf)
                           : PutMasked<T, false>(c, lot, w, view, cell, t, t1, integrateIf);
  }
  PutCell(lot, w, cell, t, t1);
  return integrateIf(lot.Count == Lanes);
}

// From visible cell to visible cell (see IntegrateBrick).
template <typename T>
void ComponentsBrick(
  Context& c, State& state, const Ray& ray, const ComponentViews& views, float t0, float t1)
{
  constexpr auto edge = static_cast<float>(shared::CELL_EDGE);
  const BrickView& view = views[0];
  const Walk w = BeginWalk(ray, view, c.Scene.Nearest ? 0.0f : 0.5f, t1);
  const Quad none = {};
  const bool skip = c.P.Switches[0] != 0;
  const std::uint64_t* onward = OnwardOf(w);
  Lot& lot = c.Cells;
  lot.Count = 0;
  lot.Uniform = 0;
  const auto integrate = [&]
  {
    if (c.Scene.Nearest)
    {
      ComponentsNearest<T>(c, state, ray, views, w);
    }
    else
    {
      ComponentsLinear<T>(c, state, ray, views, w);
    }
    lot.Count = 0;
    lot.Uniform = 0;
  };
  const auto integrateIf = [&](bool due)
  {
    if (due)
    {
      integrate();
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
    if (skip && !place.MayBeSeen())
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
    if (!known)
    {
      cell = CellAt(w, t);
      known = true;
    }
    do
    {
      if (!PutComponents<T>(c, lot, w, view, place.Range, cell, t, t1, integrateIf))
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

// The components at eight depths.
template <typename T>
inline void FindPlaces(const Context& c, const ComponentViews& views, const Walk& walk, Floats t,
  ComponentPoint<Floats>& p)
{
  const ComponentTables& k = c.Components;
  Floats x[MostComponents] = {};
  Floats has[MostComponents] = {};
  Ints all = Splat(-1);
  const Vectors nowhere{ Floats{}, Floats{}, Floats{} };
  for (int i = 0; i < k.Count; ++i)
  {
    const Places places = PlacesAt<T>(c, views[i], walk, t);
    const Floats texel = CubicAlong(places.Around, places.Within, nowhere).A;
    const Ints known = texel == texel;
    x[i] = Select(known, NodeOf(k.Tables[i], views[i], texel), Floats{});
    has[i] = Select(known, Splat(1.0f), Floats{});
    all &= known;
    if (NeedsSlopes(c) && k.Weight[i] > 0.0f)
    {
      const BrickView& view = views[i];
      const Gradient g = LoadGradient<T>(view, places.At, places.Around, places.Within, nowhere);
      SetGradient(c, i, g.X.A * view.PerVoxelX, g.Y.A * view.PerVoxelY, g.Z.A * view.PerVoxelZ, p);
    }
  }
  if (k.Dependent)
  {
    Floats& ofEmitter = has[k.Emitters[0]];
    ofEmitter = Select(all, ofEmitter, Floats{});
  }
  FindPoint(c, x, has, t, p);
}

// Steps of a given length (see IntegrateFixed).
template <typename T>
void ComponentsFixed(
  Context& c, State& state, const Ray& ray, const ComponentViews& views, float t0, float t1)
{
  const ComponentTables& k = c.Components;
  const float step = c.P.Step[0] / ray.World;
  const Walk w = BeginWalk(ray, views[0], 0.5f, t1);
  float t = t0;
  while (t < t1)
  {
    Floats begin = Splat(t);
    Floats end = Splat(t);
    int count = 0;
    for (; count < Lanes && t < t1; ++count)
    {
      const float cut = __builtin_floorf(t / step);
      float next = (cut + 1.0f) * step;
      next = next > t ? next : (cut + 2.0f) * step;
      next = next > t ? Min(next, t1) : t1;
      begin[count] = t;
      end[count] = next;
      t = next;
    }
    ComponentPoint<Floats> a;
    ComponentPoint<Floats> m;
    ComponentPoint<Floats> b;
    FindPlaces<T>(c, views, w, begin, a);
    FindPlaces<T>(c, views, w, 0.5f * (begin + end), m);
    FindPlaces<T>(c, views, w, end, b);
    Floats mean[MostComponents] = {};
    const Floats change[MostComponents] = {};
    for (int e = 0; e < k.EmitterCount; ++e)
    {
      const int i = k.Emitters[e];
      // Of each half what its ends say of extinction and gradient together, and for the rest of the
      // extinction the mean opacity.
      const auto half = [&](const ComponentPoint<Floats>& from, const ComponentPoint<Floats>& to)
      {
        if (c.Plane.Nodes != nullptr)
        {
          return 0.5f * (from.Left[i] + to.Left[i]);
        }
        const Floats whole = MeanExtinction(from.S[i], to.S[i], Floats{}, Floats{}).Mean;
        if (!k.ByGradient)
        {
          return whole;
        }
        const Floats unseen = whole - 0.5f * (from.S[i].S + to.S[i].S);
        return Max(0.5f * (from.Left[i] + to.Left[i]) +
            unseen * (0.5f * (from.G[i].Opacity + to.G[i].Opacity)),
          Floats{});
      };
      mean[i] = 0.5f * (half(a, m) + half(m, b)) * ((a.Has[i] * m.Has[i]) * b.Has[i]);
    }
    Pieces pieces;
    Combine(c, a, m, b, mean, change, Floats{}, (end - begin) * ray.World, pieces);
    for (int l = 0; l < count; ++l)
    {
      c.Contributing += pieces.Color[l][3] > 0.0f ? 1 : 0;
      Accumulate(state, pieces.Color[l][3], pieces.Color[l]);
      if (IsOver(c, state))
      {
        return;
      }
    }
    c.Report.Evaluated += static_cast<std::uint64_t>(count);
    c.Steps += static_cast<std::uint32_t>(2 * count);
    c.Samples += static_cast<std::uint64_t>(2 * count);
  }
}
