// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// One pass of the rays of a tile: brick after brick, front to back, until the ray ends, a brick is
// missing or the pass has been long enough (Shaders/RayMarch.frag for one ray at a time). What a
// pass hands to the next is colour, transmittance and the integer position; everything else is
// computed again (contract 1b).
//
// A translation unit sets TERAVOX_KERNEL to a namespace of its own and includes this file.
#include "ImageLattice.h"
#include "NativeScene.h"
#include "SharedLayout.h"

#include <array>
#include <cstddef>
#include <cstdint>
#ifdef __SSE__
#include <immintrin.h>
#endif

namespace teravox::TERAVOX_KERNEL
{
namespace
{
using Vec = MarchParameters::Vec;
using UVec = MarchParameters::UVec;
constexpr int MacroEdge = NativeScene::MacroEdge;
// Each needs those before it.
// clang-format off
#include "KernelVector.h"
#include "KernelTransfer.h"
#include "KernelComponentTables.h"
#include "KernelRay.h"
#include "KernelCut.h"
#include "KernelCells.h"
#include "KernelClipped.h"
#include "KernelLight.h"
#include "KernelExtinction.h"
#if TERAVOX_GRADIENT_OPACITY || TERAVOX_COMPONENTS
#include "KernelGradient.h"
#endif
#if TERAVOX_TRANSFER_PLANE
#include "KernelPlane.h"
#endif
#include "KernelProjectionState.h"
#include "KernelWatchState.h"
#include "KernelTurns.h"
#include "KernelPieces.h"
#if TERAVOX_TRANSFER_PLANE
#include "KernelPlanePieces.h"
#endif
#include "KernelWalk.h"
#include "KernelMask.h"
#include "KernelSpan.h"
#include "KernelWatch.h"
#include "KernelBrick.h"
#include "KernelFixed.h"
#include "KernelProjectionCells.h"
#if TERAVOX_COMPONENTS
#include "KernelComponentPieces.h"
#include "KernelComponents.h"
#include "KernelComponentProjection.h"
#else
#include "KernelProjection.h"
#include "KernelProjectionLots.h"
#endif
#include "KernelDraw.h"
// clang-format on
enum Status : std::int32_t
{
  StatusNew = 0,
  StatusRunning = 1,
  StatusDone = 2,
  StatusLocate = 3 // at the begin of the level
};

// Shortens an interval to what lies in the block that is drawn. Its faces are met at the depths at
// which those of bricks are.
inline void KeepBlock(const IntervalParameters& v, const Ray& ray, float& first, float& last)
{
  if (!v.HasBlock)
  {
    return;
  }
  const Quad a =
    (Quad{ v.BlockLow[0], v.BlockLow[1], v.BlockLow[2], 0.0f } - ray.Origin) * ray.Inverse;
  const Quad b =
    (Quad{ v.BlockHigh[0], v.BlockHigh[1], v.BlockHigh[2], 0.0f } - ray.Origin) * ray.Inverse;
  first = Max(first, Largest(a < b ? a : b));
  last = Min(last, LeastOfThree(a < b ? b : a)[0]);
}

// The interval of view depth from the box, the block, the near plane, clipping planes and opaque
// depth (Intervals.frag). `lit`: where a light at the eye is taken; VTK's doesn't know of clipping
// planes, nor of blocks.
inline bool FindInterval(
  const NativeScene& scene, const Ray& ray, int x, int y, float& first, float& last, float& lit)
{
  const IntervalParameters& v = *scene.Intervals;
  const std::size_t pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(scene.Width) +
    static_cast<std::size_t>(x);
  const Quad a = (Quad{ v.BoxLow[0], v.BoxLow[1], v.BoxLow[2], 0.0f } - ray.Origin) * ray.Inverse;
  const Quad b =
    (Quad{ v.BoxHigh[0], v.BoxHigh[1], v.BoxHigh[2], 0.0f } - ray.Origin) * ray.Inverse;
  first = Max(Largest(a < b ? a : b), v.Near);
  last = Min(LeastOfThree(a < b ? b : a)[0], v.Far);
  lit = first;
  KeepBlock(v, ray, first, last);
  ClipInterval(scene, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, first, last);
  if (scene.Blend == BlendKind::Slice)
  {
    return NarrowToSlice(scene, ray, pixel, first, last);
  }
  if (v.HasDepth && scene.Depth[pixel] < 1.0f)
  {
    const float d = scene.Depth[pixel];
    last = Min(
      last, (v.DepthToView[0] + v.DepthToView[1] * d) / (v.DepthToView[2] + v.DepthToView[3] * d));
  }
  return first < last;
}

inline void Request(NativeReport& report, int level, Index brick, float weight)
{
  const std::uint32_t at[3] = { brick[0], brick[1], brick[2] };
  report.Request(report.Context, level, at, weight);
}

// The finest ancestor that can be drawn instead of a brick: resident (interactive), or readable (a
// failed brick: requested, and waited for when converging). Returns false if the ray has to wait.
inline bool FindAncestor(
  Context& c, NativeReport& report, Found& found, int& level, Index& brick, float weight)
{
  const MarchParameters& p = c.P;
  const Index fine = brick * Load(p.LevelFactor[static_cast<std::size_t>(level)]);
  const bool failed = found.Kind == FoundKind::Failed;
  for (int l = level + 1; l < static_cast<int>(p.Levels[0]); ++l)
  {
    const UVec& f = p.LevelFactor[static_cast<std::size_t>(l)];
    const Index coarse{ fine[0] / f[0], fine[1] / f[1], fine[2] / f[2], 0 };
    const Found at = FindBrick(c, LoadLevel(p, l), coarse);
    if (at.Kind == FoundKind::Missing && failed)
    {
      Request(report, l, coarse, weight);
      if (!c.Scene.Interactive)
      {
        return false;
      }
    }
    if (at.Kind != FoundKind::Missing && at.Kind != FoundKind::Failed)
    {
      found = at;
      found.Region = 0;
      level = l;
      brick = coarse;
      report.Fallback = true;
      return true;
    }
  }
  report.Fallback = true;
  found.Kind = FoundKind::Empty;
  return true;
}

// What drawing an ancestor, or nothing, in the place of a brick may cost: all that its range
// allows, certain if the range is. The light that it adds lies between none and the most, whatever
// was drawn; what lies behind is seen through another transmittance than it should.
inline float SubstituteError(
  const Context& c, const State& before, const State& after, const Found& wanted, float length)
{
  float least = 0;
  float most = 0;
#if TERAVOX_COMPONENTS
  const float brightestLight = LargestLight(c);
  ComponentExtremes(c, wanted.Low, wanted.High, most);
#else
  constexpr float brightestLight = 1.0f;
  ExtremesBetween(c.Table, wanted.Low, wanted.High, least, most);
#endif
  // There may be voxels without a value or outside of the mask, and gradients that leave nothing.
  least = c.Scene.FloatTexels || c.Scene.Masked || GradientOpacity ? 0.0f : least;
  const float darkest = before.Transmittance * ExpOfMinus(most * length);
  const float brightest = before.Transmittance * ExpOfMinus(least * length);
  const Quad drawn = after.Color - before.Color;
  const float light =
    Max(Max(drawn[0], Max(drawn[1], drawn[2])), brightestLight * (before.Transmittance - darkest));
  return light + Max(Abs(after.Transmittance - darkest), Abs(after.Transmittance - brightest));
}

// Where a ray is.
struct Position
{
  Index Brick;
  int Level;
  int Interval;
  std::int32_t Status;
};

// The bricks of one level within an interval, from `begin` on. Returns whether the ray waits.
// `hit`: where the depth and level are put at which the ray meets what is looked for, or nothing.
inline bool MarchLevel(Context& c, NativeReport& report, State& state, const Ray& ray, Position& at,
  const Level& here, float begin, float& end, bool& finished, float& reached, float* hit)
{
  const MarchParameters& p = c.P;
  bool running = begin < end;
  while (running && c.Steps < p.Limits[0])
  {
    const Index current = at.Brick;
    const Quad exits = ExitDepths(p, ray, here, current);
    float leave = LeastOfThree(exits)[0]; // depth at which the next brick begins
    const float t0 = Max(Largest(EntryDepths(p, ray, here, current)), begin);
    const float t1 = Min(leave, end);
    Found found = FindBrick(c, here, current);
    c.Steps += 16; // a brick costs about as much
    report.Visits += 1;
    if (found.Kind == FoundKind::Missing)
    {
      Request(report, at.Level, current, state.Transmittance);
      if (!c.Scene.Interactive)
      {
        return true;
      }
    }
    int drawnLevel = at.Level;
    Index drawn = current;
    const bool substituted = found.Kind == FoundKind::Missing || found.Kind == FoundKind::Failed;
    const Found wanted = found;
    if (substituted)
    {
      if (!FindAncestor(c, report, found, drawnLevel, drawn, state.Transmittance))
      {
        return true;
      }
    }
    Index next = current;
    if (found.Kind == FoundKind::Empty && found.Region > 0)
    {
      // The exit of the whole empty region.
      const std::uint32_t shift = shared::PAGE_SHIFT * static_cast<std::uint32_t>(found.Region);
      const Index beyond = ((current >> shift) << shift) + (ray.Positive << shift);
      const Index face = beyond < here.Bricks ? beyond : here.Bricks;
      leave = LeastOfThree(FaceDepths(p, ray, here, face))[0];
      next = BrickAt(p, ray, here, leave);
    }
    else
    {
      // Below 0 becomes a large number: outside.
      const auto met = reinterpret_cast<Index>(exits <= Spread(leave));
      next += WithFourth(met & (2 * ray.Positive - 1), 0);
    }
    const State before = state;
    DrawAndSearch(c, state, ray, found, drawnLevel, drawn, t0, t1, hit);
    reached = 0.5f * (t0 + t1);
    if (substituted && c.Scene.Error != nullptr && t1 > t0)
    {
      // Its own pieces don't matter then.
      state.Error = before.Error - (before.Transmittance - state.Transmittance) * p.Step[1] +
        SubstituteError(c, before, state, wanted, (t1 - t0) * ray.World);
    }
    if (c.Scene.ShowLevel && state.Transmittance < before.Transmittance)
    {
      const float shown =
        static_cast<float>(at.Level + 1) / static_cast<float>(shared::MAXIMUM_LEVELS);
      state = { Quad{ shown, shown, shown, 0.0f }, 0.0f, 0.0f };
    }
    // The same brick only where a rounding error passed the last face of the volume.
    const bool outside = Bits(reinterpret_cast<QuadMask>(next >= here.Bricks)) != 0 ||
      Bits(reinterpret_cast<QuadMask>(next != current)) == 0;
    running = leave < end && !outside && !IsOver(c, state);
    at.Brick = running ? next : current;
    // The rest of the interval lies outside, too.
    end = leave < end && outside ? -FarAway : end;
  }
  finished = !running;
  return false;
}

#include "KernelLattice.h"

// What would have come behind the end of a ray that is over is taken to be like what was met: as
// thick in the mean, of the same colour. reached: the depth, at the middle of the last brick. A ray
// that is over has met something. (Shaders/Library/DrawFound.glsl)
inline void TakeRest(const Context& c, State& state, float first, float reached, float last)
{
  constexpr float longest = 16.0f; // times what was passed: then all is taken
  const float left = state.Transmittance;
  if (c.Scene.Blend != BlendKind::Composite || !(left > 0.0f))
  {
    return;
  }
  const float passed = Max(reached - first, 1.0e-30f);
  const float share = 1.0f - PowerOf(left, Min(Max((last - reached) / passed, 0.0f), longest));
  const Quad mean = state.Color * (1.0f / (1.0f - left));
  // Nothing more might have come, or as much light as there can be.
  const float dimmest = Min(mean[0], Min(mean[1], mean[2]));
  state.Error += left * Max(share, 1.0f - share * dimmest);
  state.Color += (share * left) * mean;
  state.Transmittance -= share * left;
}

// One pass of one ray.
inline void MarchRay(Context& c, NativeReport& report, int x, int y)
{
  const NativeScene& scene = c.Scene;
  const MarchParameters& p = c.P;
  const std::size_t pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(scene.Width) +
    static_cast<std::size_t>(x);
  if (scene.Lattice != nullptr && (scene.Lattice[pixel] & RayDeferred) != 0)
  {
    return;
  }
  std::int32_t* position = scene.Position + 4 * pixel;
  float* color = scene.Color + 4 * pixel;
  Position at{ Index{ static_cast<std::uint32_t>(position[0]),
                 static_cast<std::uint32_t>(position[1]), static_cast<std::uint32_t>(position[2]),
                 0 },
    position[3] & 255, (position[3] >> 8) & 255, (position[3] >> 16) & 3 };
  if (at.Status == StatusDone)
  {
    return;
  }
  const Ray ray = MakeRay(p, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
  float first = 0;
  float last = 0;
  float lit = 0;
  if (!FindInterval(scene, ray, x, y, first, last, lit))
  {
    position[3] = StatusDone << 16;
    return;
  }
  State state{ Quad{ color[0], color[1], color[2], 0.0f }, color[3],
    scene.Error != nullptr ? scene.Error[pixel] : 0.0f };
  if (scene.Blend != BlendKind::Composite)
  {
    c.Projection = LoadProjection(c, state, pixel, position[3]);
  }
  if (scene.Shade)
  {
    c.Light.Towards = TowardsLight(p, ray, lit);
    if (c.Light.Lights != nullptr)
    {
      SetRayLight(c.Light, ray, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
    }
  }
  if (scene.Missed != nullptr)
  {
    c.Watch = {};
    c.Watch.Missed = scene.Missed[pixel];
    c.Watch.End = scene.Reach[pixel];
    scene.Lattice[pixel] |= RayInside;
  }
  c.Steps = 0;
  bool waiting = false;
  while (at.Status != StatusDone && !waiting && c.Steps < p.Limits[0])
  {
    float from = first;
    float to = last;
    KeepInterval(p, ray, at.Interval, from, to);
    at.Level = at.Status == StatusNew ? LevelAt(p, from) : at.Level;
    const Level here = LoadLevel(p, at.Level);
    const float begin = Max(from, here.Begin);
    float end = Min(to, here.End);
    if (at.Status != StatusRunning)
    {
      at.Brick = BrickAt(p, ray, here, begin);
    }
    at.Status = StatusRunning;
    bool finished = false;
    float reached = begin;
    waiting = MarchLevel(c, report, state, ray, at, here, begin, end, finished, reached,
      scene.FirstHit != nullptr ? scene.FirstHit + 2 * pixel : nullptr);
    if (IsOver(c, state))
    {
      at.Status = StatusDone;
      TakeRest(c, state, from, reached, to);
    }
    else if (finished)
    {
      // The next level, if the interval goes on there; else the next interval.
      const bool deeper = end == here.End && here.End < to;
      at.Interval += deeper ? 0 : 1;
      // What lies between two intervals is no surface.
      c.Projection.Side = deeper ? c.Projection.Side : -1;
      at.Status = deeper ? StatusLocate : at.Interval < IntervalCount(p) ? StatusNew : StatusDone;
      at.Level += deeper ? 1 : 0;
    }
  }
  std::int32_t side = 0;
  if (scene.Blend != BlendKind::Composite)
  {
    side = StoreProjection(c, state, pixel);
  }
  color[0] = state.Color[0];
  color[1] = state.Color[1];
  color[2] = state.Color[2];
  color[3] = state.Transmittance;
  if (scene.Error != nullptr)
  {
    scene.Error[pixel] = state.Error;
  }
  if (scene.Missed != nullptr)
  {
    scene.Missed[pixel] = c.Watch.Missed;
    scene.Reach[pixel] = c.Watch.End;
  }
  position[0] = static_cast<std::int32_t>(at.Brick[0]);
  position[1] = static_cast<std::int32_t>(at.Brick[1]);
  position[2] = static_cast<std::int32_t>(at.Brick[2]);
  position[3] = at.Level | at.Interval << 8 | at.Status << 16 | side;
  if (at.Status != StatusDone)
  {
    report.Waiting = report.Waiting || waiting;
    report.Unfinished = report.Unfinished || !waiting;
  }
}

inline PlaneTable PlaneOf(const NativeScene& scene)
{
  return { scene.Plane, scene.PlaneBounds, scene.PlaneFirst, scene.PlaneColumns,
    scene.Parameters->Plane };
}

inline Transfer TableOf(const NativeScene& scene)
{
  const MarchParameters& p = *scene.Parameters;
  // Tables of four words per node.
  return { scene.Integrals, reinterpret_cast<const float*>(scene.Colors), scene.Occupied,
    scene.Extremes, scene.Variation, scene.Blocks, scene.ExtremesBlock, p.Transfer[0],
    p.Transfer[1], p.Transfer[2], p.Transfer[3] };
}

void MarchTile(
  const NativeScene& scene, int left, int bottom, int right, int top, NativeReport& report)
{
  const MarchParameters& p = *scene.Parameters;
  Context c{ scene, p, report, TableOf(scene), MakeRayLight(scene), 0, 0, 0, {}, {}, {},
    ComponentsOf(scene), { scene.GradientOpacity, p.Gradient }, PlaneOf(scene), 0, 0 };
  for (int y = bottom; y < top; ++y)
  {
    for (int x = left; x < right; ++x)
    {
      MarchRay(c, report, x, y);
    }
  }
  report.Samples += c.Samples;
  report.Contributing += c.Contributing;
}

void ResolvePicture(const NativeScene& scene)
{
#if TERAVOX_COMPONENTS
  const ComponentTables tables = ComponentsOf(scene);
#else
  const Transfer tables = TableOf(scene);
#endif
  const std::size_t pixels =
    static_cast<std::size_t>(scene.Width) * static_cast<std::size_t>(scene.Height);
  for (std::size_t i = 0; i < pixels; ++i)
  {
    ResolveProjection(scene, tables, i);
  }
}
} // namespace

NativeKernel Kernel()
{
  return &MarchTile;
}

NativeRefiner Refiner()
{
  return &RefineTile;
}

NativeResolver Resolver()
{
  return &ResolvePicture;
}

} // namespace teravox::TERAVOX_KERNEL
