// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ReadAhead.h"

#include "ScaledBrickSource.h"
#include "WaitScope.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

namespace teravox
{

namespace
{

std::array<std::int64_t, 3> At(const BrickKey& key)
{
  return { key.X, key.Y, key.Z };
}

// Bricks of a region: [first, end) per axis.
bool Meets(const BrickKey& region, const BrickBox& box)
{
  std::int64_t edge = 1;
  for (int p = 0; p < region.PageLevel; ++p)
  {
    edge *= PageBlockEdge;
  }
  const auto at = At(region);
  for (std::size_t a = 0; a < 3; ++a)
  {
    if (at[a] * edge >= box.High[a] || (at[a] + 1) * edge <= box.Low[a])
    {
      return false;
    }
  }
  return true;
}

// For what a source keeps itself, chunks for instance: half of what the engine gives to the source
// of the present step, which is a third of the cache's budget; no more than twice all of its
// voxels, as chunks at the ends of a volume reach beyond it.
std::uint64_t OwnBytes(const ReadAhead::Plan& plan)
{
  double voxels = 0;
  for (int l = 0; l < plan.Layout.NumberOfLevels(); ++l)
  {
    const Int3& n = plan.Layout.Dimensions(l);
    voxels += static_cast<double>(n[0]) * static_cast<double>(n[1]) * static_cast<double>(n[2]);
  }
  const double all = 2 * voxels * static_cast<double>(SizeOf(plan.Type)) * plan.Components;
  const std::uint64_t share = plan.Cache->Budget() / 6;
  return all < static_cast<double>(share) ? static_cast<std::uint64_t>(all) : share;
}

// Level first, then the Manhattan distance from the eye, as Residency orders bricks.
double RankOf(const PyramidLayout& layout, const ViewOrder& order, const BrickKey& brick)
{
  double distance = 0;
  const auto at = At(brick);
  for (std::size_t a = 0; a < 3; ++a)
  {
    const double index = static_cast<double>(at[a]);
    const double edge =
      static_cast<double>(layout.BrickSize()) * static_cast<double>(layout.Factor(brick.Level)[a]);
    distance += order.Parallel ? (order.Direction[a] < 0 ? -index : index)
                               : std::abs(index - std::floor(order.Eye[a] / edge));
  }
  return distance;
}

} // namespace

void StepVolume::Open(std::shared_ptr<BrickSource> source)
{
  this->Given = std::move(source);
  this->Exponent = this->Given ? ScaleExponent(this->Given->Info()) : 0;
  this->Source = this->Exponent == 0
    ? this->Given
    : std::make_shared<ScaledBrickSource>(this->Given, this->Exponent);
}

bool VisibleValues::Any(const ValueRange& range) const
{
  if (range.IsVoid())
  {
    return false;
  }
  if (this->Samples.size() < 2 || !range.IsKnown())
  {
    return true;
  }
  // From the sample before the range to the one behind it.
  auto first = std::lower_bound(this->Samples.begin(), this->Samples.end(), range.Min,
    [](const auto& sample, double v) { return sample.first < v; });
  auto last = std::upper_bound(first, this->Samples.end(), range.Max,
    [](double v, const auto& sample) { return v < sample.first; });
  first = first == this->Samples.begin() ? first : std::prev(first);
  last = last == this->Samples.end() ? last : std::next(last);
  return std::any_of(first, last, [](const auto& sample) { return sample.second; });
}

ReadAhead::~ReadAhead()
{
  this->Cancel();
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    this->Quit = true;
  }
  this->Changed.notify_all();
  if (this->Thread.joinable())
  {
    const WaitScope waiting; // for a read under way
    this->Thread.join();
  }
}

void ReadAhead::Start(Plan plan)
{
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    this->Stopping = false;
    this->Next = std::make_unique<Plan>(std::move(plan));
    if (!this->Thread.joinable())
    {
      this->Thread = std::thread([this] { this->Work(); });
    }
  }
  this->Changed.notify_all();
}

void ReadAhead::Cancel()
{
  const std::lock_guard<std::mutex> lock(this->Mutex);
  this->Stopping = true;
  this->Next.reset();
}

bool ReadAhead::EndWithin(double seconds)
{
  this->Cancel();
  return this->Wait(seconds);
}

bool ReadAhead::Wait(double seconds)
{
  const WaitScope waiting; // before the lock is taken: it ends after the lock is released
  std::unique_lock<std::mutex> lock(this->Mutex);
  return this->Changed.wait_for(lock, std::chrono::duration<double>(std::clamp(seconds, 0.0, 1e7)),
    [this] { return !this->Busy && !this->Next; });
}

void ReadAhead::Work()
{
  std::unique_lock<std::mutex> lock(this->Mutex);
  while (true)
  {
    this->Changed.wait(lock, [this] { return this->Quit || this->Next; });
    if (this->Quit)
    {
      return;
    }
    const std::unique_ptr<Plan> plan = std::move(this->Next);
    this->Busy = true;
    lock.unlock();
    try
    {
      this->Run(*plan);
    }
    catch (...) // NOLINT: a user's source may throw anything
    {
      // Then nothing more is read ahead; whoever shows the step meets the error.
    }
    lock.lock();
    this->Busy = false;
    this->Changed.notify_all();
  }
}

bool ReadAhead::OpenStep(const Plan& plan, StepVolume& step) const
{
  if (!step.Given)
  {
    // One that can't be opened is told of when it is to be shown.
    Result<std::shared_ptr<BrickSource>> opened = plan.Series->Step(step.Step);
    if (!opened)
    {
      return false;
    }
    step.Open(std::move(opened.Value()));
    const std::uint64_t own = std::max(step.Source->LeastMemory(), OwnBytes(plan));
    const std::uint64_t least =
      own + static_cast<std::uint64_t>(plan.Layout.DirectoryEntries()) * sizeof(ValueRange);
    if (!(step.Source->Info().Layout == plan.Layout) || step.Source->Info().Type != plan.Type ||
      step.Source->Info().Components != plan.Components ||
      !plan.Cache->Reserve(least, plan.Headroom))
    {
      step.Open(nullptr);
      return false;
    }
    step.Reserved = least;
    step.Source->SetMemoryBudget(own);
  }
  step.Directory.resize(static_cast<std::size_t>(plan.Layout.NumberOfLevels()));
  for (int l = 0; l < plan.Layout.NumberOfLevels() && !this->Stopping; ++l)
  {
    std::vector<ValueRange>& ranges = step.Directory[static_cast<std::size_t>(l)];
    if (ranges.empty())
    {
      BrickKey first;
      first.Level = static_cast<std::uint8_t>(l);
      first.PageLevel = static_cast<std::uint8_t>(plan.Layout.PageDepth(l));
      Result<std::vector<ValueRange>> read =
        step.Source->ReadRanges(first, plan.Layout.Pages(l, plan.Layout.PageDepth(l)));
      if (read)
      {
        ranges = std::move(read.Value());
      }
    }
  }
  return true;
}

RangesPointer ReadAhead::LoadBlock(
  const Plan& plan, const StepVolume& step, const BrickKey& key, std::uint64_t& room)
{
  const std::uint64_t bytes = plan.BlockBytes;
  if (bytes > room)
  {
    return nullptr;
  }
  room -= bytes;
  if (const auto item = plan.Cache->Find(key))
  {
    return item->Ranges;
  }
  if (!plan.Cache->Reserve(bytes, plan.Headroom))
  {
    return nullptr;
  }
  Result<std::vector<ValueRange>> read =
    step.Source->ReadRanges(key.FirstChild(), { PageBlockEdge, PageBlockEdge, PageBlockEdge });
  if (!read || read.Value().size() != std::size_t{ PageBlockEdge } * PageBlockEdge * PageBlockEdge)
  {
    plan.Cache->Release(bytes);
    return nullptr;
  }
  auto ranges = std::make_shared<const std::vector<ValueRange>>(std::move(read.Value()));
  plan.Cache->Commit(key, { nullptr, ranges }, bytes);
  return ranges;
}

void ReadAhead::Collect(const Plan& plan, const StepVolume& step, const BrickKey& region,
  const ValueRange& range, std::vector<BrickKey>& bricks, std::uint64_t& room)
{
  const bool limited = region.Level < plan.Order.InView.size();
  if (this->Stopping || (limited && !Meets(region, plan.Order.InView[region.Level])) ||
    (plan.SkipEmpty && !plan.Visible.Any(range)))
  {
    return;
  }
  if (region.PageLevel == 0)
  {
    if (!range.IsSingle())
    {
      bricks.push_back(region);
    }
    return;
  }
  const RangesPointer ranges = this->LoadBlock(plan, step, region, room);
  if (!ranges)
  {
    return;
  }
  const Int3& count = plan.Layout.Pages(region.Level, region.PageLevel - 1);
  const BrickKey first = region.FirstChild();
  for (std::uint32_t i = 0; i < ranges->size(); ++i)
  {
    constexpr std::uint32_t edge = PageBlockEdge;
    BrickKey child = first;
    child.X += i % edge;
    child.Y += i / edge % edge;
    child.Z += i / edge / edge;
    if (child.X < count[0] && child.Y < count[1] && child.Z < count[2])
    {
      this->Collect(plan, step, child, (*ranges)[i], bricks, room);
    }
  }
}

void ReadAhead::Run(const Plan& plan)
{
  std::uint64_t present = 0;
  for (const BrickKey& key : plan.Cache->Keys())
  {
    present += key.Volume != plan.Present ? 0
      : key.PageLevel == 0                ? plan.BrickBytes
                                          : plan.BlockBytes;
  }
  const std::uint64_t budget = plan.Cache->Budget();
  std::uint64_t room = budget > present + plan.Headroom ? budget - present - plan.Headroom : 0;
  for (const std::shared_ptr<StepVolume>& step : plan.Steps)
  {
    if (this->Stopping || (!step->Given && room < OwnBytes(plan)) || !this->OpenStep(plan, *step))
    {
      continue;
    }
    room -= std::min(room, step->Reserved);
    std::vector<BrickKey> bricks;
    for (int l = 0; l < plan.Layout.NumberOfLevels(); ++l)
    {
      const std::vector<ValueRange>& directory = step->Directory[static_cast<std::size_t>(l)];
      const int depth = plan.Layout.PageDepth(l);
      const Int3 count = plan.Layout.Pages(l, depth);
      if (!plan.Levels[static_cast<std::size_t>(l)] ||
        directory.size() != static_cast<std::size_t>(count[0] * count[1] * count[2]))
      {
        continue;
      }
      for (std::size_t i = 0; i < directory.size(); ++i)
      {
        const auto n = static_cast<std::int64_t>(i);
        BrickKey region =
          BrickKey::Of(l, { n % count[0], n / count[0] % count[1], n / count[0] / count[1] });
        region.PageLevel = static_cast<std::uint8_t>(depth);
        region.Volume = step->Volume;
        this->Collect(plan, *step, region, directory[i], bricks, room);
      }
    }
    std::stable_sort(bricks.begin(), bricks.end(),
      [&](const BrickKey& a, const BrickKey& b)
      {
        return a.Level != b.Level
          ? a.Level < b.Level
          : RankOf(plan.Layout, plan.Order, a) < RankOf(plan.Layout, plan.Order, b);
      });
    const std::uint64_t bytes = plan.BrickBytes;
    for (const BrickKey& key : bricks)
    {
      if (this->Stopping || bytes > room)
      {
        break;
      }
      room -= bytes;
      if (plan.Cache->Contains(key))
      {
        continue;
      }
      if (!plan.Cache->Reserve(bytes, plan.Headroom))
      {
        break;
      }
      Result<BrickPointer> brick = step->Source->ReadBrick(key);
      CacheItem item;
      item.Brick = brick ? std::move(brick.Value()) : nullptr;
      if (!item.Brick || item.Bytes() > bytes)
      {
        plan.Cache->Release(bytes); // it is asked for again, and told of, when it is to be shown
        continue;
      }
      ++this->BricksRead_;
      plan.Cache->Commit(key, std::move(item), bytes);
    }
  }
}

} // namespace teravox
