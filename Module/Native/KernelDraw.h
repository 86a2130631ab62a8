// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// What a brick, or the ancestor that stands in its place, adds to a ray between two depths; and
// where on the way the ray's opacity becomes what is looked for (Shaders/Library/DrawFound.glsl).

#if TERAVOX_COMPONENTS
template <typename T>
inline void DrawComponentsOf(Context& c, State& state, const Ray& ray, ComponentViews& views,
  std::uint32_t slot, float t0, float t1)
{
  if (c.Scene.Blend != BlendKind::Composite)
  {
    ProjectComponents<T>(c, state, ray, views, t0, t1);
    return;
  }
  if (c.Scene.FixedStep)
  {
    ComponentsFixed<T>(c, state, ray, views, t0, t1);
    return;
  }
  views[0].Occupancy = ComponentOccupancyOf<T>(c, views, slot);
  ComponentsBrick<T>(c, state, ray, views, t0, t1);
}

// A brick in a slot; `level` and `brick` are those that lie there.
inline void DrawMapped(Context& c, State& state, const Ray& ray, int level, Index brick,
  std::uint32_t slot, float t0, float t1)
{
  ComponentViews views;
  const auto count = static_cast<std::uint32_t>(c.Components.Count);
  const std::uint32_t first = slot * (count + (c.Scene.Masked ? 1 : 0));
  for (std::uint32_t i = 0; i < count; ++i)
  {
    // Slots hold component after component.
    views[i] = ViewBrick(c.Scene, c.Components.Tables[i], ray, level, brick, first + i);
    SetClipped(c.P, c.Clipped, c.Components.Tables[i], views[i]);
  }
  if (c.Scene.Masked)
  {
    FindMask(c.Scene, count, views[0]);
  }
  if (c.Scene.FloatTexels)
  {
    DrawComponentsOf<float>(c, state, ray, views, slot, t0, t1);
  }
  else if (c.Scene.BytesPerTexel == 1)
  {
    DrawComponentsOf<std::uint8_t>(c, state, ray, views, slot, t0, t1);
  }
  else
  {
    DrawComponentsOf<std::uint16_t>(c, state, ray, views, slot, t0, t1);
  }
}
inline void DrawConstant(
  Context& c, State& state, const Ray& ray, const Found& found, Quad slope, float t0, float t1)
{
  if (c.Scene.Blend != BlendKind::Composite)
  {
    ProjectComponentsConstant(c, state, ray, found.Low, found.High, t0, t1);
    return;
  }
  ComponentsConstant(c, state, ray, found.Low, found.High, slope, t0, t1);
}
#else
template <typename T>
inline void IntegrateMapped(
  Context& c, State& state, const Ray& ray, BrickView view, std::uint32_t slot, float t0, float t1)
{
  const NativeScene& scene = c.Scene;
  if (scene.Blend != BlendKind::Composite)
  {
    ProjectMapped<T>(c, state, ray, view, t0, t1);
    return;
  }
  if (scene.FixedStep)
  {
    scene.Shade ? IntegrateFixed<T, true>(c, state, ray, view, t0, t1)
                : IntegrateFixed<T, false>(c, state, ray, view, t0, t1);
    return;
  }
  view.Occupancy = OccupancyOf<T>(c, view, slot);
  if (scene.Nearest)
  {
    scene.Shade ? IntegrateBrick<T, true, true>(c, state, ray, view, t0, t1)
                : IntegrateBrick<T, false, true>(c, state, ray, view, t0, t1);
  }
  else
  {
    scene.Shade ? IntegrateBrick<T, true, false>(c, state, ray, view, t0, t1)
                : IntegrateBrick<T, false, false>(c, state, ray, view, t0, t1);
  }
}

// A brick in a slot; `level` and `brick` are those that lie there.
inline void DrawMapped(Context& c, State& state, const Ray& ray, int level, Index brick,
  std::uint32_t slot, float t0, float t1)
{
#if TERAVOX_MASK
  BrickView view = ViewMasked(c.Scene, c.Table, ray, level, brick, slot);
#else
  BrickView view = ViewBrick(c.Scene, c.Table, ray, level, brick, slot);
#endif
  SetClipped(c.P, c.Clipped, c.Table, view);
  if (c.Scene.FloatTexels)
  {
    IntegrateMapped<float>(c, state, ray, view, slot, t0, t1);
  }
  else if (c.Scene.BytesPerTexel == 1)
  {
    IntegrateMapped<std::uint8_t>(c, state, ray, view, slot, t0, t1);
  }
  else
  {
    IntegrateMapped<std::uint16_t>(c, state, ray, view, slot, t0, t1);
  }
}

// A brick of one value.
inline void DrawConstant(
  Context& c, State& state, const Ray& ray, const Found& found, Quad slope, float t0, float t1)
{
  const float position = TransferPosition(c.Table, found.Low, found.High);
  if (c.Scene.Blend != BlendKind::Composite)
  {
    ProjectConstant(c, state, ray, position, slope, t0, t1);
    return;
  }
  IntegrateConstant(c, state, ray, position, slope, t0, t1);
  c.Report.Evaluated += 1;
}
#endif

inline void DrawStretch(Context& c, State& state, const Ray& ray, const Found& found, int level,
  Index brick, float t0, float t1)
{
  if (found.Kind == FoundKind::Mapped)
  {
    c.Watch.Light = state.Transmittance;
    DrawMapped(c, state, ray, level, brick, found.Slot, t0, t1);
#if TERAVOX_MASK
    SelectTables(c, 0);
#endif
    EndRun(c);
  }
  else if (found.Kind == FoundKind::Single)
  {
    const Quad slope = ClippedDifference(c.P, c.Clipped, found.Low, found.High, level);
    DrawConstant(c, state, ray, found, slope, t0, t1);
    NoteSeen(c, t1);
  }
}

inline void DrawFound(Context& c, State& state, const Ray& ray, const Found& found, int level,
  Index brick, float t0, float t1)
{
  const bool draws = found.Kind == FoundKind::Mapped || found.Kind == FoundKind::Single;
  if (!(c.P.Clipped[3] > 0.0f) || !draws)
  {
    DrawStretch(c, state, ray, found, level, brick, t0, t1);
    return;
  }
  for (float from = t0; from < t1 && !IsOver(c, state);)
  {
    const ClippedStretch stretch = NextStretch(c.P, ray, level, from, t1);
    c.Clipped = stretch.Clipped;
    DrawStretch(c, state, ray, found, level, brick, from, stretch.End);
    from = stretch.End;
  }
  c.Clipped = 0;
}

// The whole first: it alone makes the picture. Then, if the ray's opacity has become large enough
// in it, half after half of what is left; each begins with what was gathered up to there, so that
// all of them together are as long as the whole.
inline void DrawAndSearch(Context& c, State& state, const Ray& ray, const Found& found, int level,
  Index brick, float t0, float t1, float* hit)
{
  const State before = state;
  const ProjectionState projectionBefore = c.Projection;
  const float wanted = c.P.Value[3];
  DrawFound(c, state, ray, found, level, brick, t0, t1);
  if (hit == nullptr || !(before.Transmittance > wanted) || !(state.Transmittance <= wanted))
  {
    return;
  }
  // Halves of a brick's part of a ray: of a part of 100 voxels about a ten-thousandth of a voxel.
  constexpr int halvings = 20;
  const ProjectionState projection = c.Projection;
  State from = before;
  ProjectionState projectionFrom = projectionBefore;
  float low = t0;
  float high = t1;
  for (int i = 0; i < halvings; ++i)
  {
    const float end = low + 0.5f * (high - low);
    State tried = from;
    c.Projection = projectionFrom;
    DrawFound(c, tried, ray, found, level, brick, low, end);
    if (tried.Transmittance <= wanted)
    {
      high = end;
    }
    else
    {
      low = end;
      from = tried;
      projectionFrom = c.Projection;
    }
  }
  c.Projection = projection;
  hit[0] = high;
  hit[1] = static_cast<float>(level);
}
