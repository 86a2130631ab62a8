// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "NativeMarcher.h"

#include "AtlasPlan.h"
#include "SharedLayout.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <omp.h>
#include <unordered_map>
#include <utility>

namespace teravox
{

static_assert(NativeScene::MacroEdge == MacroEdge);

namespace baseline
{
NativeKernel Kernel();
NativeResolver Resolver();
}
#if TERAVOX_HAS_AVX2_KERNEL
namespace avx2
{
NativeKernel Kernel();
NativeResolver Resolver();
}
#endif

#if TERAVOX_HAS_AVX2_KERNEL
namespace
{
bool UsesAVX2()
{
  const char* wanted = std::getenv("TERAVOX_NATIVE_ISA");
  const bool any = wanted != nullptr && std::strcmp(wanted, "baseline") == 0;
  return !any && __builtin_cpu_supports("avx2") != 0;
}
} // namespace
#endif

NativeKernel ChooseNativeKernel()
{
#if TERAVOX_HAS_AVX2_KERNEL
  if (UsesAVX2())
  {
    return avx2::Kernel();
  }
#endif
  return baseline::Kernel();
}

NativeResolver ChooseNativeResolver()
{
#if TERAVOX_HAS_AVX2_KERNEL
  if (UsesAVX2())
  {
    return avx2::Resolver();
  }
#endif
  return baseline::Resolver();
}

void NativeView::Resize(int width, int height, bool estimate)
{
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  this->Color.assign(pixels * 4, 0);
  this->Position.assign(pixels * 4, 0);
  this->Depth.assign(pixels, 1);
  this->Error.assign(estimate ? pixels : 0, 0);
}

void NativeView::Clear()
{
  std::fill(this->Position.begin(), this->Position.end(), 0);
  std::fill(this->Error.begin(), this->Error.end(), 0.0f);
  std::fill(this->Color.begin(), this->Color.end(), 0.0f);
  for (std::size_t i = 3; i < this->Color.size(); i += 4)
  {
    this->Color[i] = 1;
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

NativeMarcher::NativeMarcher()
  : Kernel(ChooseNativeKernel())
{
}

PassResult NativeMarcher::DrawPass(NativeScene scene, std::uint32_t slots, std::uint32_t pageBlocks,
  std::vector<std::uint32_t>& tiles)
{
  this->UsedSlots.assign(slots, 0);
  this->UsedBlocks.assign(pageBlocks, 0);
  scene.UsedSlots = this->UsedSlots.data();
  scene.UsedBlocks = this->UsedBlocks.data();
  constexpr int edge = static_cast<int>(shared::TILE_SIZE);
  const auto count = static_cast<std::int64_t>(tiles.size());
  std::vector<NativeReport> reports(tiles.size());
  Requests all;
  // Nothing in the region throws but an exhausted heap, which ends the process as it should.
#pragma omp parallel
  {
    Requests mine;
#pragma omp for schedule(dynamic)
    for (std::int64_t t = 0; t < count; ++t)
    {
      const auto i = static_cast<std::size_t>(t);
      const int x = static_cast<int>(tiles[i] & 0xffffu) * edge;
      const int y = static_cast<int>(tiles[i] >> 16) * edge;
      reports[i].Request = &Requests::Add;
      reports[i].Context = &mine;
      this->Kernel(
        scene, x, y, std::min(x + edge, scene.Width), std::min(y + edge, scene.Height), reports[i]);
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
  std::vector<std::uint32_t> active;
  for (std::size_t i = 0; i < reports.size(); ++i)
  {
    const NativeReport& report = reports[i];
    result.Waiting = result.Waiting || report.Waiting;
    result.Unfinished = result.Unfinished || report.Unfinished;
    result.Fallback = result.Fallback || report.Fallback;
    result.Samples += report.Samples;
    result.Evaluated += report.Evaluated;
    result.Contributing += report.Contributing;
    result.Gradients += report.Gradients;
    result.Visits += report.Visits;
    if (report.Waiting || report.Unfinished)
    {
      active.push_back(tiles[i]);
    }
  }
  tiles = std::move(active);
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

} // namespace teravox
