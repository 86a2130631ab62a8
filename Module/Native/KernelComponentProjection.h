// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Blend modes other than composite of voxels with several components: each is a field of its own,
// of which a ray keeps an extreme or a sum; what they show together is made of a whole picture
// (Shaders/Library/ComponentProjection.glsl). Of dependent ones it keeps the extreme of the last,
// and what the others are there. All values are positions in nodes of the component's
// table.

inline bool IsExtreme(const NativeScene& scene)
{
  return scene.Blend == BlendKind::Maximum || scene.Blend == BlendKind::Minimum;
}

// MarchParameters::ComponentProjection of an emitter.
inline const Vec& RuleOf(const Context& c, int i)
{
  return c.P.ComponentProjection[static_cast<std::size_t>(i)];
}

// What a pass left of a ray: four numbers in the place of colour and transmittance, of averages
// four more. A ray that isn't over sees all that there is.
inline ProjectionState LoadProjection(
  const Context& c, State& state, std::size_t pixel, std::int32_t)
{
  ProjectionState p;
  const float kept[MostComponents] = { state.Color[0], state.Color[1], state.Color[2],
    state.Transmittance };
  for (int i = 0; i < MostComponents; ++i)
  {
    p.Extreme[i] = kept[i];
    p.Sum[i] = Max(kept[i], 0.0f);
    p.Length[i] =
      c.Scene.Lengths != nullptr ? c.Scene.Lengths[4 * pixel + static_cast<std::size_t>(i)] : 0.0f;
  }
  state.Transmittance = 1.0f;
  return p;
}

inline std::int32_t StoreProjection(const Context& c, State& state, std::size_t pixel)
{
  const ProjectionState& p = c.Projection;
  const float(&kept)[MostComponents] = IsExtreme(c.Scene) ? p.Extreme : p.Sum;
  state.Color = Quad{ kept[0], kept[1], kept[2], 0.0f };
  state.Transmittance = kept[3];
  for (int i = 0; i < MostComponents && c.Scene.Lengths != nullptr; ++i)
  {
    c.Scene.Lengths[4 * pixel + static_cast<std::size_t>(i)] = p.Length[i];
  }
  return 0;
}

// Premultiplied colour and transmittance of a pixel, from what its ray gathered; of rays that met
// nothing that is MarchParameters::NothingMet.
inline void ResolveProjection(const NativeScene& scene, const ComponentTables& k, std::size_t pixel)
{
  const MarchParameters& p = *scene.Parameters;
  float* out = scene.Color + 4 * pixel;
  float sum[4] = { 0, 0, 0, 0 };
  if (k.Dependent)
  {
    const int last = k.Count - 1;
    const bool any = out[last] > MarchParameters::NothingMet;
    const float opacity =
      any ? Min(SampleTransfer(k.Tables[last], p.Projection[0] * out[last]).S, 1.0f) : 0.0f;
    const Color<float> color = k.Count == 2 ? TransferColor(k.Tables[0], any ? out[0] : 0.0f)
                                            : Color<float>{ out[0], out[1], out[2] };
    out[0] = any ? Clamped(color.Red, 1.0f) * opacity : 0.0f;
    out[1] = any ? Clamped(color.Green, 1.0f) * opacity : 0.0f;
    out[2] = any ? Clamped(color.Blue, 1.0f) * opacity : 0.0f;
    out[3] = 1.0f - opacity;
    return;
  }
  for (int e = 0; e < k.EmitterCount; ++e)
  {
    const auto i = static_cast<std::size_t>(k.Emitters[e]);
    if (IsExtreme(scene))
    {
      const bool any = out[i] > MarchParameters::NothingMet;
      const float node = any ? p.Projection[0] * out[i] : 0.0f;
      const Color<float> color = TransferColor(k.Tables[i], node);
      const float opacity = any ? Min(SampleTransfer(k.Tables[i], node).S, 1.0f) : 0.0f;
      const float share = opacity * k.Weight[i];
      sum[0] += color.Red * share;
      sum[1] += color.Green * share;
      sum[2] += color.Blue * share;
      sum[3] += share;
    }
    else if (scene.Blend == BlendKind::Average)
    {
      const float length = scene.Lengths[4 * pixel + i];
      sum[0] += length > 0.0f ? out[i] / Max(length, 1.0e-37f) * k.Weight[i] : 0.0f;
    }
    else
    {
      sum[0] += out[i] * p.ComponentProjection[i][3];
    }
  }
  if (!IsExtreme(scene))
  {
    const bool crossed = out[0] > MarchParameters::NothingMet;
    sum[0] = sum[1] = sum[2] = crossed ? Min(Max(sum[0], 0.0f), 1.0f) : 0.0f;
    sum[3] = crossed ? 1.0f : 0.0f;
  }
  out[0] = sum[0];
  out[1] = sum[1];
  out[2] = sum[2];
  out[3] = Max(1.0f - sum[3], 0.0f);
}

template <typename F>
TERAVOX_INLINE F ExtremeOf(const Context& c, int i, F signedNode)
{
  return ExtremeWithin(c.P.Projection[0], c.Components.Tables[i].Nodes, signedNode);
}

// See TakeExtreme() of one component. The ray is over where none can show anything else.
inline void TakeExtreme(Context& c, State& state, int i, float best)
{
  const ComponentTables& k = c.Components;
  ProjectionState& p = c.Projection;
  if (best > p.Extreme[i] + RuleOf(c, i)[0])
  {
    p.Extreme[i] = best;
    bool last = true;
    for (int e = 0; e < k.EmitterCount; ++e)
    {
      const int j = k.Emitters[e];
      last = last && p.Extreme[j] >= c.P.Projection[0] * RuleOf(c, j)[1];
    }
    state.Transmittance = last ? 0.0f : 1.0f;
  }
}

TERAVOX_INLINE void TakeExtremes(Context& c, State& state, int i, Floats best, Ints valid)
{
  const Ints better = valid & (best > c.Projection.Extreme[i] + RuleOf(c, i)[0]);
  for (unsigned bits = Bits(better); bits != 0; bits &= bits - 1)
  {
    c.Contributing += 1;
    TakeExtreme(c, state, i, best[__builtin_ctz(bits)]);
  }
}

// Of dependent components: the last one's best, and what the others are where that is.
inline void TakeDependent(
  Context& c, Floats best, const Floats (&others)[MostComponents], Ints valid)
{
  const int last = c.Components.Count - 1;
  ProjectionState& p = c.Projection;
  const float rounding = RuleOf(c, last)[0];
  for (unsigned bits = Bits(valid & (best > p.Extreme[last] + rounding)); bits != 0;
       bits &= bits - 1)
  {
    const int l = __builtin_ctz(bits);
    c.Contributing += 1;
    if (best[l] > p.Extreme[last] + rounding)
    {
      for (int i = 0; i < last; ++i)
      {
        p.Extreme[i] = others[i][l];
      }
      p.Extreme[last] = best[l];
    }
  }
}

TERAVOX_INLINE SumRule SumRuleOf(const Context& c, int i)
{
  const Vec& rule = RuleOf(c, i);
  return { c.Components.Tables[i], c.Scene.Blend == BlendKind::Average, rule[1], rule[2] };
}

// A length of one value of a component.
inline void AddValue(Context& c, int i, float node, float length)
{
  const Vec& rule = RuleOf(c, i);
  if (c.Scene.Blend != BlendKind::Average || (node >= rule[1] && node <= rule[2]))
  {
    c.Projection.Sum[i] += SampleTransfer(c.Components.Tables[i], node).S * length;
    c.Projection.Length[i] += length;
  }
}

// Whether a component without any value, or with values in a range, leaves the ray as it is.
inline bool SkipsPart(const Context& c, int i, bool none, float from, float to)
{
  const Vec& rule = RuleOf(c, i);
  switch (c.Scene.Blend)
  {
    case BlendKind::Maximum:
      return none || ExtremeOf(c, i, to) <= c.Projection.Extreme[i];
    case BlendKind::Minimum:
      return none || ExtremeOf(c, i, -from) <= c.Projection.Extreme[i];
    case BlendKind::Average:
      return none || to + rule[0] < rule[1] || from - rule[0] > rule[2];
    default:
      return none || IsEmptyBetween(c.Components.Tables[i], from, to);
  }
}

inline Found FindBrick(Context& c, const Level& level, Index brick)
{
  if (c.Scene.Blend == BlendKind::Composite)
  {
    return FindComponents(c, level, brick,
      [&](int i, float from, float to)
      { return IsEmptyBetween(c.Components.Tables[i], from, to); });
  }
  return FindComponents(
    c, level, brick, [&](int i, float from, float to) { return SkipsPart(c, i, false, from, to); });
}

// A part of the ray on which all components have one value.
inline void ProjectComponentsConstant(
  Context& c, State& state, const Ray& ray, float valueHigh, float valueLow, float t0, float t1)
{
  const ComponentTables& k = c.Components;
  c.Steps += 1;
  if (!(t1 > t0))
  {
    return;
  }
  c.Samples += 1;
  if (k.Dependent)
  {
    Floats nodes[MostComponents] = {};
    for (int i = 0; i < k.Count; ++i)
    {
      nodes[i] = Splat(TransferPosition(k.Tables[i], valueHigh, valueLow));
    }
    const int last = k.Count - 1;
    TakeDependent(c, ExtremeOf(c, last, c.P.Projection[0] * nodes[last]), nodes, FirstLanes(1));
    return;
  }
  for (int e = 0; e < k.EmitterCount; ++e)
  {
    const int i = k.Emitters[e];
    const float node = TransferPosition(k.Tables[i], valueHigh, valueLow);
    if (IsExtreme(c.Scene))
    {
      TakeExtreme(c, state, i, ExtremeOf(c, i, c.P.Projection[0] * node));
    }
    else
    {
      AddValue(c, i, node, (t1 - t0) * ray.World);
    }
  }
}

template <typename T>
__attribute__((noinline)) void ProjectDependentLinear(
  Context& c, const ComponentViews& views, const Walk& walk)
{
  const ComponentTables& k = c.Components;
  const int last = k.Count - 1;
  const float sign = c.P.Projection[0];
  const LotView v = OpenLot<T>(c, walk, views[0]);
  const Corners corners = LoadCorners<T>(views[last], v.At);
  const LotField f = RangesOf<T>(k.Tables[last], views[last], v, corners);
  const Floats high = Max(sign * f.Least, sign * f.Largest);
  Ints promising =
    f.Valid & (ExtremeOf(c, last, high) > c.Projection.Extreme[last] + RuleOf(c, last)[0]);
  if (Bits(promising) == 0)
  {
    return;
  }
  const Vectors from = PlacesIn(walk, v);
  const Vectors passed = PassedIn(walk, v);
  Floats where;
  const Floats best = BestAlong(FieldAlong(k.Tables[last], views[last], corners, from, passed),
    sign, f.Least, f.Largest, where);
  Floats others[MostComponents] = {};
  for (int i = 0; i < last; ++i)
  {
    const Corners own = LoadCorners<T>(views[i], v.At);
    promising &= HaveValues<T>(own);
    others[i] = Along(FieldAlong(k.Tables[i], views[i], own, from, passed), where);
  }
  TakeDependent(c, ExtremeOf(c, last, best), others, promising);
}

template <typename T>
__attribute__((noinline)) void ProjectComponentsLinear(
  Context& c, State& state, const Ray& ray, const ComponentViews& views, const Walk& walk)
{
  const ComponentTables& k = c.Components;
  const LotView v = OpenLot<T>(c, walk, views[0]);
  const Vectors from = PlacesIn(walk, v);
  const Vectors passed = PassedIn(walk, v);
  const float sign = c.P.Projection[0];
  for (int e = 0; e < k.EmitterCount; ++e)
  {
    const int i = k.Emitters[e];
    const Transfer& table = k.Tables[i];
    const Corners corners = LoadCorners<T>(views[i], v.At);
    const LotField f = RangesOf<T>(table, views[i], v, corners);
    if (IsExtreme(c.Scene))
    {
      const Floats high = Max(sign * f.Least, sign * f.Largest);
      const Ints promising =
        f.Valid & (ExtremeOf(c, i, high) > c.Projection.Extreme[i] + RuleOf(c, i)[0]);
      if (Bits(promising) != 0)
      {
        const Floats best =
          BestAlong(FieldAlong(table, views[i], corners, from, passed), sign, f.Least, f.Largest);
        TakeExtremes(c, state, i, ExtremeOf(c, i, best), promising);
      }
      continue;
    }
    const SumRule rule = SumRuleOf(c, i);
    const Cubic field = FieldAlong(table, views[i], corners, from, passed);
    const Turns turns = TurnsOf(field);
    const PieceSums s = SumsOf(rule, field, Floats{}, Splat(1.0f));
    const Floats length = (v.End - v.Begin) * ray.World;
    for (unsigned bits = Bits(f.Valid); bits != 0; bits &= bits - 1)
    {
      const int l = __builtin_ctz(bits);
      const CellSum sum = SumOfCell(rule, field, turns, s, l, length[l], c.Steps);
      c.Projection.Sum[i] += sum.Sum;
      c.Projection.Length[i] += sum.Length;
    }
  }
}

// The fields are constant in each voxel.
template <typename T>
__attribute__((noinline)) void ProjectComponentsNearest(
  Context& c, State& state, const Ray& ray, const ComponentViews& views, const Walk& walk)
{
  const ComponentTables& k = c.Components;
  const LotView v = OpenLot<T>(c, walk, views[0]);
  if (k.Dependent)
  {
    Floats nodes[MostComponents] = {};
    Ints all = v.Valid;
    for (int i = 0; i < k.Count; ++i)
    {
      nodes[i] = NodeOf(k.Tables[i], views[i], LoadTexel<T>(views[i], v.At, 0));
      all &= nodes[i] == nodes[i];
    }
    const int last = k.Count - 1;
    TakeDependent(c, ExtremeOf(c, last, c.P.Projection[0] * nodes[last]), nodes, all);
    return;
  }
  for (int e = 0; e < k.EmitterCount; ++e)
  {
    const int i = k.Emitters[e];
    const Floats node = NodeOf(k.Tables[i], views[i], LoadTexel<T>(views[i], v.At, 0));
    const Ints valid = v.Valid & (node == node);
    if (IsExtreme(c.Scene))
    {
      TakeExtremes(c, state, i, ExtremeOf(c, i, c.P.Projection[0] * node), valid);
      continue;
    }
    for (unsigned bits = Bits(valid); bits != 0; bits &= bits - 1)
    {
      const int l = __builtin_ctz(bits);
      AddValue(c, i, node[l], (v.End[l] - v.Begin[l]) * ray.World);
    }
  }
}

// Through a brick, over cells of CELL_EDGE^3 that make no difference (see ProjectMapped).
template <typename T>
void ProjectComponents(
  Context& c, State& state, const Ray& ray, const ComponentViews& views, float t0, float t1)
{
  constexpr auto edge = static_cast<float>(shared::CELL_EDGE);
  const ComponentTables& k = c.Components;
  const BrickView& view = views[0];
  const bool nearest = c.Scene.Nearest;
  const Walk w = BeginWalk(ray, view, nearest ? 0.0f : 0.5f, t1);
  const Quad none = {};
  const bool skip = c.P.Switches[0] != 0;
  Lot& lot = c.Cells;
  lot.Count = 0;
  lot.Uniform = 0;
  const auto project = [&]
  {
    if (nearest)
    {
      ProjectComponentsNearest<T>(c, state, ray, views, w);
    }
    else if (k.Dependent)
    {
      ProjectDependentLinear<T>(c, views, w);
    }
    else
    {
      ProjectComponentsLinear<T>(c, state, ray, views, w);
    }
    lot.Count = 0;
    lot.Uniform = 0;
  };
  const auto projectIf = [&](bool due)
  {
    if (due)
    {
      project();
    }
    return !due || !IsOver(c, state);
  };
  const auto skips = [&](std::size_t at)
  {
    bool all = true;
    for (int e = 0; e < k.EmitterCount; ++e)
    {
      const int i = k.Emitters[e];
      const TexelRange range = RangeOf<T>(views[i], at);
      all = all &&
        SkipsPart(c, i, range.Least > range.Largest, NodeOf(k.Tables[i], views[i], range.Least),
          NodeOf(k.Tables[i], views[i], range.Largest));
    }
    return all;
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
    if (skip && stop > t && skips(IndexOf(view, at)))
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
    do
    {
      if (!PutComponents<T>(c, lot, w, view, IndexOf(view, at), cell, t, t1, projectIf))
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
