// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "NativeMarcher.h"

#include "AtlasPlan.h"
#include "SharedLayout.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <omp.h>
#include <tuple>
#include <unordered_map>
#include <unordered_set>
#include <utility>

namespace teravox
{

static_assert(NativeScene::MacroEdge == MacroEdge);

namespace baseline
{
NativeKernel Kernel();
NativeRefiner Refiner();
NativeResolver Resolver();
}
namespace baseline_components
{
NativeKernel Kernel();
NativeResolver Resolver();
}
namespace baseline_gradient
{
NativeKernel Kernel();
}
namespace baseline_mask
{
NativeKernel Kernel();
}
namespace baseline_mask_gradient
{
NativeKernel Kernel();
}
#if TERAVOX_HAS_AVX2_KERNEL
namespace avx2
{
NativeKernel Kernel();
NativeRefiner Refiner();
NativeResolver Resolver();
}
namespace avx2_components
{
NativeKernel Kernel();
NativeResolver Resolver();
}
namespace avx2_gradient
{
NativeKernel Kernel();
}
namespace avx2_mask
{
NativeKernel Kernel();
}
namespace avx2_mask_gradient
{
NativeKernel Kernel();
}
#else
namespace avx2 = baseline;
namespace avx2_components = baseline_components;
namespace avx2_gradient = baseline_gradient;
namespace avx2_mask = baseline_mask;
namespace avx2_mask_gradient = baseline_mask_gradient;
#endif

namespace
{
bool UsesAVX2()
{
#if TERAVOX_HAS_AVX2_KERNEL
  const char* wanted = std::getenv("TERAVOX_NATIVE_ISA");
  const bool any = wanted != nullptr && std::strcmp(wanted, "baseline") == 0;
  return !any && __builtin_cpu_supports("avx2") != 0;
#else
  return false;
#endif
}
} // namespace

NativeKernel ChooseNativeKernel()
{
  return UsesAVX2() ? avx2::Kernel() : baseline::Kernel();
}

NativeRefiner ChooseNativeRefiner()
{
  return UsesAVX2() ? avx2::Refiner() : baseline::Refiner();
}

NativeKernel ChooseComponentKernel()
{
  return UsesAVX2() ? avx2_components::Kernel() : baseline_components::Kernel();
}

NativeKernel ChooseGradientKernel()
{
  return UsesAVX2() ? avx2_gradient::Kernel() : baseline_gradient::Kernel();
}

NativeKernel ChooseMaskKernel(bool gradientOpacity)
{
  if (gradientOpacity)
  {
    return UsesAVX2() ? avx2_mask_gradient::Kernel() : baseline_mask_gradient::Kernel();
  }
  return UsesAVX2() ? avx2_mask::Kernel() : baseline_mask::Kernel();
}

NativeResolver ChooseComponentResolver()
{
  return UsesAVX2() ? avx2_components::Resolver() : baseline_components::Resolver();
}

NativeResolver ChooseNativeResolver()
{
  return UsesAVX2() ? avx2::Resolver() : baseline::Resolver();
}

void NativeView::Resize(int width, int height, bool estimate, bool firstHit, bool lengths)
{
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  this->Width = width;
  this->Color.assign(pixels * 4, 0);
  this->Position.assign(pixels * 4, 0);
  this->Depth.assign(pixels, 1);
  this->Error.assign(estimate ? pixels : 0, 0);
  this->Lattice.assign(pixels, 0);
  this->Missed.assign(pixels, 0);
  this->Reach.assign(pixels, 0);
  this->FirstHit.assign(firstHit ? 2 * pixels : 0, NoHit);
  this->Lengths.assign(lengths ? 4 * pixels : 0, 0);
}

void NativeView::Clear(int stage, const LatticeLimits& limits, const std::array<float, 4>& ray)
{
  std::fill(this->Error.begin(), this->Error.end(), 0.0f);
  std::fill(this->FirstHit.begin(), this->FirstHit.end(), NoHit);
  std::fill(this->Lengths.begin(), this->Lengths.end(), 0.0f);
  this->HasLattice = stage > 0;
  this->LatticeStage = stage;
  this->LatticeChosen = false;
  this->Limits = limits;
  const auto width = static_cast<std::size_t>(this->Width);
  const auto rows = static_cast<std::int64_t>(width > 0 ? this->Depth.size() / width : 0);
#pragma omp parallel for schedule(static) if (rows > 128)
  for (std::int64_t y = 0; y < rows; ++y)
  {
    const std::size_t first = static_cast<std::size_t>(y) * width;
    std::fill_n(this->Position.data() + 4 * first, 4 * width, 0);
    for (std::size_t i = first; i < first + width; ++i)
    {
      std::copy(ray.begin(), ray.end(), this->Color.data() + 4 * i);
    }
    if (stage == 0)
    {
      continue;
    }
    std::fill_n(this->Missed.data() + first, width, 0.0f);
    std::fill_n(this->Reach.data() + first, width, NativeScene::NothingReached);
    for (std::size_t x = 0; x < width; ++x)
    {
      this->Lattice[first + x] = IsInLattice(stage, static_cast<int>(x), static_cast<int>(y))
        ? std::uint8_t{ 0 }
        : NativeScene::RayDeferred;
    }
  }
}

void NativeView::CastAll()
{
  for (std::size_t i = 0; i < this->Lattice.size(); ++i)
  {
    std::uint8_t& mark = this->Lattice[i];
    constexpr std::int32_t statusDone = 2;
    if ((mark & NativeScene::RayBetween) != 0 &&
      (this->Position[4 * i + 3] >> 16 & 3) != statusDone)
    {
      // It isn't what it was to become.
      const std::array<float, 4> nothing{ 0, 0, 0, 1 };
      std::copy(
        nothing.begin(), nothing.end(), this->Color.begin() + static_cast<std::ptrdiff_t>(4 * i));
      this->Missed[i] = 0;
      this->Reach[i] = NativeScene::NothingReached;
      if (!this->Error.empty())
      {
        this->Error[i] = 0;
      }
    }
    mark &= static_cast<std::uint8_t>(~NativeScene::RayDeferred);
  }
}

void NativeView::FillDeferred()
{
  if (this->LatticeStage == 0)
  {
    return;
  }
  const auto edge = static_cast<std::size_t>(LatticeEdge(this->LatticeStage));
  const auto width = static_cast<std::size_t>(this->Width);
  for (std::size_t i = 0; i < this->Lattice.size(); ++i)
  {
    if ((this->Lattice[i] & NativeScene::RayDeferred) != 0)
    {
      const std::size_t from = i / width / edge * edge * width + i % width / edge * edge;
      std::copy_n(this->Color.begin() + static_cast<std::ptrdiff_t>(4 * from), 4,
        this->Color.begin() + static_cast<std::ptrdiff_t>(4 * i));
    }
  }
}

void NativeView::SetSlice(const std::vector<float>& slice, const IntervalParameters& intervals)
{
  const std::array<float, 4>& v = intervals.DepthToView;
  for (std::size_t i = 0; i < this->Depth.size(); ++i)
  {
    const float d = this->Depth[i];
    const bool hidden =
      intervals.HasDepth && d < 1 && (v[0] + v[1] * d) / (v[2] + v[3] * d) < slice[i];
    this->Depth[i] = hidden ? std::numeric_limits<float>::quiet_NaN() : slice[i];
  }
}

void SetTables(NativeScene& scene, const TransferTable& table, std::uint32_t version)
{
  scene.Integrals = table.Integrals.front().data();
  scene.Colors = table.Colors.front().data();
  scene.Occupied = table.Occupied.data();
  scene.Extremes = table.Extremes.front().data();
  scene.Variation = table.Variation.data();
  scene.Blocks = table.Blocks;
  scene.ExtremesBlock = TransferTable::ExtremesBlock;
  scene.TableVersion = version;
}

void SetTables(NativeScene& scene, const std::vector<TransferTable>& tables, std::uint32_t version)
{
  scene.Components = static_cast<int>(tables.size());
  scene.ExtremesBlock = TransferTable::ExtremesBlock;
  scene.TableVersion = version;
  for (std::size_t c = 0; c < tables.size(); ++c)
  {
    const TransferTable& table = tables[c];
    if (table.Nodes != 0)
    {
      scene.ComponentTables[c] = { table.Integrals.front().data(), table.Colors.front().data(),
        table.Occupied.data(), table.Extremes.front().data(), table.Blocks };
    }
  }
}

void SetLabelTables(std::vector<NativeScene::LabelTable>& all,
  const std::vector<TransferTable>& tables, const GradientTable& gradient)
{
  all.clear();
  for (std::size_t i = 0; i < tables.size(); ++i)
  {
    const TransferTable& table = tables[i];
    const std::size_t node = i * GradientTable::Nodes;
    all.push_back({ table.Integrals.front().data(), table.Colors.front().data(),
      table.Occupied.data(), table.Extremes.front().data(), table.Variation.data(),
      gradient.IsOne() ? nullptr : gradient.Values[node].data() });
  }
}

void SetGradientTable(NativeScene& scene, const GradientTable& table)
{
  scene.GradientOpacity = table.IsOne() ? nullptr : table.Values.front().data();
}

void SetPlane(NativeScene& scene, const TransferPlane& plane)
{
  if (!plane.IsNone())
  {
    scene.Plane = plane.Nodes.front().data();
    scene.PlaneBounds = plane.Bounds.front().data();
    scene.PlaneFirst = plane.First.data();
    scene.PlaneColumns = plane.Columns;
  }
}

void SetAtlas(
  NativeScene& scene, const NativeAtlas& atlas, const PageTable& table, const TexelFormat& format)
{
  scene.Voxels = atlas.Voxels();
  scene.Cells = atlas.Cells();
  scene.Occupancy = atlas.Occupancy();
  scene.OccupancyVersion = atlas.OccupancyVersion();
  scene.SlotTable = atlas.SlotTable();
  static_assert(sizeof(PageEntry) == 3 * sizeof(std::uint32_t));
  scene.PageTable = reinterpret_cast<const std::uint32_t*>(table.Entries().data());
  scene.BytesPerTexel = format.BytesPerTexel;
  scene.FloatTexels = format.IsFloat();
}

void SetView(NativeScene& scene, NativeView& view, int width, int height)
{
  scene.Width = width;
  scene.Height = height;
  scene.Color = view.Color.data();
  scene.Position = view.Position.data();
  scene.Depth = view.Depth.data();
  scene.Error = view.Error.empty() ? nullptr : view.Error.data();
  if (view.HasLattice)
  {
    scene.Lattice = view.Lattice.data();
    scene.Missed = view.Missed.data();
    scene.Reach = view.Reach.data();
    scene.LatticeTolerance = static_cast<float>(view.Limits.Error);
    scene.LatticeMissed = static_cast<float>(view.Limits.Missed);
    scene.LatticeDistance = static_cast<float>(view.Limits.Distance);
  }
  scene.FirstHit = view.FirstHit.empty() ? nullptr : view.FirstHit.data();
  scene.Lengths = view.Lengths.empty() ? nullptr : view.Lengths.data();
}

namespace
{
// The bricks that the rays of one thread missed, with the sum of their weights.
struct Requests
{
  std::unordered_map<BrickKey, std::uint32_t, BrickKeyHash> Missed;
  bool Overflow = false;

  static void Add(void* context, int level, const std::uint32_t* brick, float weight)
  {
    auto& self = *static_cast<Requests*>(context);
    BrickKey key;
    key.Level = static_cast<std::uint8_t>(level);
    key.X = brick[0];
    key.Y = brick[1];
    key.Z = brick[2];
    const auto found = self.Missed.find(key);
    const auto w = static_cast<std::uint32_t>(weight * 255.0f) + 1;
    if (found != self.Missed.end())
    {
      found->second += w;
    }
    else if (self.Missed.size() < RequestTableEntries)
    {
      self.Missed.emplace(key, w);
    }
    else
    {
      self.Overflow = true;
    }
  }
};

void Add(NativeReport& sum, const NativeReport& more)
{
  sum.Samples += more.Samples;
  sum.Evaluated += more.Evaluated;
  sum.Contributing += more.Contributing;
  sum.Gradients += more.Gradients;
  sum.Visits += more.Visits;
  sum.Waiting = sum.Waiting || more.Waiting;
  sum.Unfinished = sum.Unfinished || more.Unfinished;
  sum.Fallback = sum.Fallback || more.Fallback;
}

// A tile pixel by pixel, so that each has a report of its own.
void DrawPixels(NativeKernel kernel, const NativeScene& scene, int left, int bottom, int right,
  int top, NativeReport& report, float* samples)
{
  for (int y = bottom; y < top; ++y)
  {
    for (int x = left; x < right; ++x)
    {
      NativeReport pixel;
      pixel.Request = report.Request;
      pixel.Context = report.Context;
      kernel(scene, x, y, x + 1, y + 1, pixel);
      samples[static_cast<std::size_t>(y) * static_cast<std::size_t>(scene.Width) +
        static_cast<std::size_t>(x)] += static_cast<float>(pixel.Samples);
      Add(report, pixel);
    }
  }
}

std::vector<std::uint32_t> Indices(const std::vector<std::uint8_t>& used)
{
  std::vector<std::uint32_t> indices;
  for (std::size_t i = 0; i < used.size(); ++i)
  {
    if (used[i] != 0)
    {
      indices.push_back(static_cast<std::uint32_t>(i));
    }
  }
  return indices;
}
} // namespace

namespace
{
// `samples`: see NativeMarcher::DrawPass(). `part`: left, bottom, right, top.
void DrawPart(const NativeKernel& kernel, const NativeScene& scene, const std::array<int, 4>& part,
  NativeReport& report, float* samples)
{
  if (samples != nullptr)
  {
    DrawPixels(kernel, scene, part[0], part[1], part[2], part[3], report, samples);
  }
  else
  {
    kernel(scene, part[0], part[1], part[2], part[3], report);
  }
}

// A part of a picture whose rays begin at depths of their own: behind a plane each, that clips.
// Neighbours with the same depth are drawn together.
void DrawFromBegins(const NativeKernel& kernel, NativeScene scene, const std::vector<float>& begins,
  const std::array<int, 4>& part, NativeReport& report, float* samples)
{
  constexpr std::size_t plane = std::tuple_size_v<PlaneAlongRays>;
  std::vector<float> planes(
    scene.Planes, scene.Planes + plane * static_cast<std::size_t>(scene.NumberOfPlanes));
  planes.resize(planes.size() + plane, 0.0f);
  float* const own = planes.data() + planes.size() - plane;
  own[4] = 1;
  scene.Planes = planes.data();
  ++scene.NumberOfPlanes;
  const std::array<float, 4>& v = scene.Intervals->DepthToView;
  for (int y = part[1]; y < part[3]; ++y)
  {
    const float* const row =
      begins.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(scene.Width);
    for (int x = part[0]; x < part[2];)
    {
      const float begin = row[x];
      int next = x + 1;
      while (next < part[2] && row[next] == begin)
      {
        ++next;
      }
      // Nothing is seen of a ray that begins at the far plane.
      if (begin < 1)
      {
        own[0] = begin > 0 ? -((v[0] + v[1] * begin) / (v[2] + v[3] * begin))
                           : std::numeric_limits<float>::max();
        DrawPart(kernel, scene, { x, y, next, y + 1 }, report, samples);
      }
      x = next;
    }
  }
}
} // namespace

NativeMarcher::NativeMarcher()
  : Kernel(ChooseNativeKernel())
  , Refiner(ChooseNativeRefiner())
  , ComponentKernel(ChooseComponentKernel())
  , GradientKernel(ChooseGradientKernel())
  , MaskKernel(ChooseMaskKernel(false))
  , MaskGradientKernel(ChooseMaskKernel(true))
{
}

PassResult NativeMarcher::DrawPass(NativeScene scene, std::uint32_t slots, std::uint32_t pageBlocks,
  std::vector<std::uint32_t>& tiles, float* samples, const std::vector<float>& begins)
{
  this->UsedSlots.assign(slots, 0);
  this->UsedBlocks.assign(pageBlocks, 0);
  scene.UsedSlots = this->UsedSlots.data();
  scene.UsedBlocks = this->UsedBlocks.data();
  constexpr int edge = static_cast<int>(shared::TILE_SIZE);
  const auto count = static_cast<std::int64_t>(tiles.size());
  const bool gradient = scene.GradientOpacity != nullptr || scene.Plane != nullptr;
  const NativeKernel kernel = scene.Components > 1 ? this->ComponentKernel
    : scene.Masked ? (gradient ? this->MaskGradientKernel : this->MaskKernel)
    : gradient     ? this->GradientKernel
                   : this->Kernel;
  std::vector<NativeReport> reports(tiles.size());
  Requests all;
  // Nothing in the region throws but an exhausted heap, which ends the process as it should.
  // Waking threads for a single tile, and their waiting at its end, takes longer than most tiles.
#pragma omp parallel if (count > 1)
  {
    Requests mine;
#pragma omp for schedule(dynamic) nowait
    for (std::int64_t t = 0; t < count; ++t)
    {
      const auto i = static_cast<std::size_t>(t);
      const int x = static_cast<int>(tiles[i] & 0xffffu) * edge;
      const int y = static_cast<int>(tiles[i] >> 16) * edge;
      reports[i].Request = &Requests::Add;
      reports[i].Context = &mine;
      const std::array<int, 4> part{ x, y, std::min(x + edge, scene.Width),
        std::min(y + edge, scene.Height) };
      if (begins.empty())
      {
        DrawPart(kernel, scene, part, reports[i], samples);
      }
      else
      {
        DrawFromBegins(kernel, scene, begins, part, reports[i], samples);
      }
    }
#pragma omp critical(TeravoxRequests)
    {
      for (const auto& missed : mine.Missed)
      {
        all.Missed[missed.first] += missed.second;
      }
      all.Overflow = all.Overflow || mine.Overflow;
    }
  }
  PassResult result;
  NativeReport sum;
  std::vector<std::uint32_t> active;
  for (std::size_t i = 0; i < reports.size(); ++i)
  {
    const NativeReport& report = reports[i];
    Add(sum, report);
    if (report.Waiting || report.Unfinished)
    {
      active.push_back(tiles[i]);
    }
  }
  tiles = std::move(active);
  result.Waiting = sum.Waiting;
  result.Unfinished = sum.Unfinished;
  result.Fallback = sum.Fallback;
  result.Samples = sum.Samples;
  result.Evaluated = sum.Evaluated;
  result.Contributing = sum.Contributing;
  result.Gradients = sum.Gradients;
  result.Visits = sum.Visits;
  result.Overflow = all.Overflow;
  for (const auto& missed : all.Missed)
  {
    Feedback::Miss miss;
    miss.Key = missed.first;
    miss.Weight = missed.second;
    result.Report.Missed.push_back(miss);
  }
  // In an order that depends on no hash and no thread.
  std::sort(result.Report.Missed.begin(), result.Report.Missed.end(),
    [](const Feedback::Miss& a, const Feedback::Miss& b) { return a.Key < b.Key; });
  result.Report.UsedSlots = Indices(this->UsedSlots);
  result.Report.UsedBlocks = Indices(this->UsedBlocks);
  return result;
}

namespace
{
// Tiles (x | y << 16 each) that are marked, and those around them.
std::vector<std::uint8_t> WithNeighbours(
  const std::vector<std::uint32_t>& tiles, const std::vector<std::uint8_t>& marked)
{
  std::unordered_set<std::uint32_t> near;
  for (std::size_t i = 0; i < tiles.size(); ++i)
  {
    for (std::uint32_t n = 0; n < 9 && marked[i] != 0; ++n)
    {
      // Those before the first row and column are none of the tiles.
      const std::uint32_t x = (tiles[i] & 0xffffu) + n % 3 - 1;
      const std::uint32_t y = (tiles[i] >> 16) + n / 3 - 1;
      near.insert((x & 0xffffu) | y << 16);
    }
  }
  std::vector<std::uint8_t> result(tiles.size());
  std::transform(tiles.begin(), tiles.end(), result.begin(),
    [&](std::uint32_t tile) { return static_cast<std::uint8_t>(near.count(tile)); });
  return result;
}
} // namespace

std::vector<std::uint32_t> NativeMarcher::Refine(
  const NativeScene& scene, NativeView& view, const std::vector<std::uint32_t>& tiles)
{
  constexpr int edge = static_cast<int>(shared::TILE_SIZE);
  const auto count = static_cast<std::int64_t>(tiles.size());
  std::vector<LatticeCount> counts(tiles.size());
  const auto sweep = [&](LatticeStep step, const std::vector<std::uint8_t>& where)
  {
#pragma omp parallel for schedule(dynamic) if (count > 1)
    for (std::int64_t t = 0; t < count; ++t)
    {
      const auto i = static_cast<std::size_t>(t);
      counts[i] = {};
      if (where.empty() || where[i] != 0)
      {
        const int x = static_cast<int>(tiles[i] & 0xffffu) * edge;
        const int y = static_cast<int>(tiles[i] >> 16) * edge;
        counts[i] = this->Refiner(scene, view.LatticeStage, step, x, y,
          std::min(x + edge, scene.Width), std::min(y + edge, scene.Height));
      }
    }
  };
  const std::vector<std::uint8_t> everywhere;
  const auto tilesWith = [&counts](std::uint32_t LatticeCount::*number)
  {
    std::vector<std::uint8_t> with(counts.size());
    std::transform(counts.begin(), counts.end(), with.begin(),
      [&](const LatticeCount& c) { return static_cast<std::uint8_t>(c.*number > 0 ? 1 : 0); });
    return with;
  };
  const auto isAny = [](const std::vector<std::uint8_t>& where)
  { return std::any_of(where.begin(), where.end(), [](std::uint8_t w) { return w != 0; }); };
  std::vector<std::uint32_t> active;
  while (active.empty() && view.LatticeStage > 0)
  {
    bool chosen = true;
    if (!view.LatticeChosen)
    {
      sweep(LatticeStep::Choose, everywhere);
      view.LatticeCast = tilesWith(&LatticeCount::Chosen);
      view.LatticeChosen = true;
    }
    else
    {
      // Only what was cast since is new to judge, and only beside what surprises something spreads.
      sweep(LatticeStep::Judge, view.LatticeCast);
      const std::vector<std::uint8_t> surprising = tilesWith(&LatticeCount::Surprising);
      chosen = isAny(surprising);
      if (chosen)
      {
        sweep(LatticeStep::Spread, WithNeighbours(tiles, surprising));
        view.LatticeCast = tilesWith(&LatticeCount::Chosen);
        chosen = isAny(view.LatticeCast);
      }
    }
    if (!chosen)
    {
      sweep(LatticeStep::Fill, everywhere);
      view.LatticeChosen = false;
      --view.LatticeStage;
      continue;
    }
    for (std::size_t i = 0; i < tiles.size(); ++i)
    {
      if (counts[i].ToCast > 0)
      {
        active.push_back(tiles[i]);
      }
    }
  }
  return active;
}

} // namespace teravox
