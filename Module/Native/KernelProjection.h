// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Blend modes other than composite: what each makes of a value, a range of values and a picture
// (Shaders/Library/Projection.glsl). All values are positions in nodes of the transfer table.

inline bool IsExtreme(const Context& c)
{
  return c.Scene.Blend == BlendKind::Maximum || c.Scene.Blend == BlendKind::Minimum;
}

// What a pass left of a ray.
inline ProjectionState LoadProjection(
  const Context& c, State& state, std::size_t, std::int32_t word)
{
  ProjectionState p;
  p.Any = IsExtreme(c) && state.Color[1] != 0.0f;
  p.Extreme = p.Any ? state.Color[0] : -FarAway;
  p.Sum = state.Color[0];
  p.Length = state.Color[2];
  p.Side = (word >> 20 & 1023) - 1;
  return p;
}

// Returns what belongs into the word of level and status. Isosurfaces and slices gather colours.
inline std::int32_t StoreProjection(const Context& c, State& state, std::size_t)
{
  const ProjectionState& p = c.Projection;
  switch (c.Scene.Blend)
  {
    case BlendKind::Maximum:
    case BlendKind::Minimum:
      state.Color = Quad{ p.Any ? p.Extreme : 0.0f, p.Any ? 1.0f : 0.0f, 0.0f, 0.0f };
      break;
    case BlendKind::Average:
      state.Color = Quad{ p.Sum, 1.0f, p.Length, 0.0f };
      break;
    case BlendKind::Additive:
      state.Color = Quad{ p.Sum, 1.0f, 0.0f, 0.0f };
      break;
    case BlendKind::Isosurface:
      return (p.Side + 1) << 20;
    default:
      break;
  }
  return 0;
}

// Premultiplied colour and transmittance of a pixel, from what its ray gathered.
inline void ResolveProjection(const NativeScene& scene, const Transfer& table, std::size_t i)
{
  float* pixel = scene.Color + 4 * i;
  const MarchParameters& p = *scene.Parameters;
  const bool any = pixel[1] != 0.0f;
  const auto gray = [&](bool seen, float value)
  {
    const float g = Min(Max(value, 0.0f), 1.0f);
    pixel[0] = pixel[1] = pixel[2] = seen ? g : 0.0f;
    pixel[3] = seen ? 0.0f : 1.0f;
  };
  switch (scene.Blend)
  {
    case BlendKind::Maximum:
    case BlendKind::Minimum:
    {
      const float node = p.Projection[0] * pixel[0];
      const Color<float> color = TransferColor(table, node);
      const float opacity = any ? Min(SampleTransfer(table, node).S, 1.0f) : 0.0f;
      pixel[0] = color.Red * opacity;
      pixel[1] = color.Green * opacity;
      pixel[2] = color.Blue * opacity;
      pixel[3] = 1.0f - opacity;
      break;
    }
    case BlendKind::Average:
      gray(any && pixel[2] > 0.0f, pixel[0] / Max(pixel[2], 1.0e-37f));
      break;
    case BlendKind::Additive:
      gray(any, pixel[0] * p.Projection[3]);
      break;
    default:
      break; // colours already
  }
}

// Where more makes no difference to the picture, values are cut off.
template <typename F>
TERAVOX_INLINE F ExtremeOf(const Context& c, F signedNode)
{
  return ExtremeWithin(c.P.Projection[0], c.Table.Nodes, signedNode);
}
// A value that is better by no more than rounding isn't better. So a region whose range promises
// nothing better can be left out without a change.
inline void TakeExtreme(Context& c, State& state, float best)
{
  ProjectionState& p = c.Projection;
  if (best > p.Extreme + c.P.Projection[1])
  {
    p.Extreme = best;
    p.Any = true;
    // Nothing that looks different can be met.
    state.Transmittance = best >= c.P.Projection[0] * c.P.Projection[2] ? 0.0f : 1.0f;
  }
}

// Iso values, ascending.
inline float IsoValue(const Context& c, std::int32_t i)
{
  const auto at = static_cast<std::size_t>(i);
  return c.P.IsoValues[at / 4][at % 4];
}
inline std::int32_t IsoCount(const Context& c)
{
  return static_cast<std::int32_t>(c.P.Projection[0]);
}
inline std::int32_t SideOf(const Context& c, float node)
{
  std::int32_t low = 0;
  std::int32_t high = IsoCount(c);
  while (low < high)
  {
    const std::int32_t middle = (low + high) / 2;
    const bool above = node >= IsoValue(c, middle);
    low = above ? middle + 1 : low;
    high = above ? high : middle;
  }
  return low;
}
inline bool IsAbove(const Context& c, std::int32_t side, float node)
{
  return side < IsoCount(c) && node >= IsoValue(c, side);
}
inline bool IsBelow(const Context& c, std::int32_t side, float node)
{
  return side > 0 && node < IsoValue(c, side - 1);
}

// Whether a range of values holds an iso value, or is next to one.
inline bool HasSurface(const Context& c, float from, float to)
{
  const float rounding = c.P.Projection[1];
  return IsAbove(c, SideOf(c, from - rounding), to + rounding);
}

// Where there is no value, it isn't known on which side of a surface a ray goes on. Of a mask parts
// of regions may be left out, of which ranges don't tell: as in VTK rays stay on their side there.
inline void LoseSide(Context& c)
{
#if !TERAVOX_MASK
  c.Projection.Side = -1;
#else
  static_cast<void>(c);
#endif
}

// Whether a region without any value, or with values in a range, leaves the ray as it is; of a ray
// through surfaces it tells on which side the region is.
inline bool SkipsRange(Context& c, bool none, float from, float to)
{
  ProjectionState& p = c.Projection;
  const float rounding = c.P.Projection[1];
  switch (c.Scene.Blend)
  {
    case BlendKind::Maximum:
      return none || ExtremeOf(c, to) <= p.Extreme;
    case BlendKind::Minimum:
      return none || ExtremeOf(c, -from) <= p.Extreme;
    case BlendKind::Average:
      return none || to + rounding < c.P.Projection[2] || from - rounding > c.P.Projection[3];
    case BlendKind::Isosurface:
    {
      if (none || IsoCount(c) == 0)
      {
        LoseSide(c);
        return true;
      }
#if TERAVOX_MASK
      // A ray may meet nothing but holes of a region: it tells the side of no ray.
      if (p.Side < 0)
      {
        return false;
      }
#endif
      const std::int32_t side = p.Side >= 0 ? p.Side : SideOf(c, from);
      if (IsBelow(c, side, from - rounding) || IsAbove(c, side, to + rounding))
      {
        return false;
      }
      p.Side = side;
      return true;
    }
    default:
      return none || IsEmptyBetween(c.Table, from, to);
  }
}

inline Found FindBrick(Context& c, const Level& level, Index brick)
{
  if (c.Scene.Blend == BlendKind::Composite)
  {
    return Translate(c.Scene, c.Table, level, brick);
  }
  return Translate(c.Scene, c.Table, level, brick,
    [&](bool none, float from, float to) { return SkipsRange(c, none, from, to); });
}

// A surface at a depth of the ray, where its normal is known.
inline void TakeSurface(
  Context& c, State& state, std::int32_t i, const Normal<float>& normal, float t)
{
  const Vec& v = c.P.IsoColors[static_cast<std::size_t>(i)];
  Color<float> color{ v[0], v[1], v[2] };
  if (c.Scene.Shade)
  {
    color = LitColor(c.P, color, normal, c.Light, t);
  }
  Accumulate(state, v[3], Quad{ color.Red, color.Green, color.Blue, 0.0f });
  c.Contributing += 1;
}

// From the side where a ray is to that of a value, where the field jumps or is known not to.
template <typename NormalHere>
inline void JumpTo(Context& c, State& state, float node, const NormalHere& normal, float t)
{
  std::int32_t& side = c.Projection.Side;
  if (side < 0)
  {
    side = SideOf(c, node);
    return;
  }
  while (!IsOver(c, state) && (IsAbove(c, side, node) || IsBelow(c, side, node)))
  {
    const bool up = IsAbove(c, side, node);
    TakeSurface(c, state, up ? side : side - 1, normal(), t);
    side += up ? 1 : -1;
  }
}

// What a slice shows of a value at a depth of the ray, where its normal is known.
template <typename NormalHere>
inline void TakeSlice(Context& c, State& state, float node, const NormalHere& normal, float t)
{
  if (!c.Projection.Any)
  {
    Color<float> color = TransferColor(c.Table, node);
    if (c.Scene.Shade)
    {
      color = LitColor(c.P, color, normal(), c.Light, t);
    }
    Accumulate(state, Min(SampleTransfer(c.Table, node).S, 1.0f),
      Quad{ color.Red, color.Green, color.Blue, 0.0f });
    c.Projection.Any = true;
    c.Contributing += 1;
  }
}

inline bool IsInRange(const Context& c, float node)
{
  return node >= c.P.Projection[2] && node <= c.P.Projection[3];
}

// A part of the ray with one value; slope: see ComponentsConstant().
inline void ProjectConstant(
  Context& c, State& state, const Ray& ray, float node, Quad slope, float t0, float t1)
{
  c.Steps += 1;
  if (!(t1 > t0))
  {
    return;
  }
  c.Samples += 1;
  const float length = (t1 - t0) * ray.World;
  const auto normal = [&] { return NormalOf(c.P, slope[0], slope[1], slope[2]); };
  switch (c.Scene.Blend)
  {
    case BlendKind::Maximum:
    case BlendKind::Minimum:
      TakeExtreme(c, state, ExtremeOf(c, c.P.Projection[0] * node));
      break;
    case BlendKind::Average:
      if (IsInRange(c, node))
      {
        c.Projection.Sum += SampleTransfer(c.Table, node).S * length;
        c.Projection.Length += length;
      }
      break;
    case BlendKind::Additive:
      c.Projection.Sum += SampleTransfer(c.Table, node).S * length;
      break;
    case BlendKind::Isosurface:
      JumpTo(c, state, node, normal, t0);
      break;
    default:
      TakeSlice(c, state, node, normal, t0);
      break;
  }
}
