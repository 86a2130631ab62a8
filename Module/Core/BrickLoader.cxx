// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BrickLoader.h"

#include "BrickGeometry.h"
#include "WaitScope.h"

#include <algorithm>
#include <cassert>
#include <chrono>
#include <exception>
#include <new>
#include <string>
#include <utility>

namespace teravox
{

namespace
{
constexpr std::uint64_t RangesPerBlock =
  std::uint64_t{ PageBlockEdge } * PageBlockEdge * PageBlockEdge;
/// How often a thread that waits for room looks again: nobody tells when a brick is let go.
constexpr std::chrono::milliseconds RoomPollInterval{ 2 };

Status CheckBrick(const BrickPointer& brick, const BrickKey& key, const VolumeInfo& info)
{
  if (!brick || brick->Type != info.Type || brick->Components != info.Components ||
    brick->StoredSize != info.Layout.StoredSize() ||
    brick->Voxels.size() != BrickVoxelBytes(info) || brick->Mask.size() != BrickMaskBytes(info))
  {
    return Status(StatusCode::Corrupt,
      "The source delivered " + std::to_string(brick ? brick->Voxels.size() : 0) +
        " bytes instead of " + std::to_string(BrickVoxelBytes(info)) +
        ", or voxels of another shape, for " + Subject(key, info) + ".");
  }
  return {};
}

LoadResult ReadUnguarded(BrickSource& source, const BrickKey& key)
{
  LoadResult result;
  result.Key = key;
  if (key.PageLevel == 0)
  {
    Result<BrickPointer> brick = source.ReadBrick(key);
    result.Outcome = brick ? CheckBrick(brick.Value(), key, source.Info()) : brick.GetStatus();
    if (result.Outcome)
    {
      result.Brick = std::move(brick.Value());
    }
    return result;
  }
  Result<std::vector<ValueRange>> ranges =
    source.ReadRanges(key.FirstChild(), { PageBlockEdge, PageBlockEdge, PageBlockEdge });
  if (!ranges)
  {
    result.Outcome = ranges.GetStatus();
  }
  else if (ranges.Value().size() != RangesPerBlock)
  {
    result.Outcome = Status(StatusCode::Corrupt,
      "The source delivered " + std::to_string(ranges.Value().size()) + " instead of " +
        std::to_string(RangesPerBlock) + " ranges for " + Subject(key, source.Info()) + ".");
  }
  else
  {
    result.Ranges = std::make_shared<const std::vector<ValueRange>>(std::move(ranges.Value()));
  }
  return result;
}

/// Reads through a source that may be a user's: whatever it throws becomes a status.
LoadResult Read(BrickSource& source, const BrickKey& key)
{
  LoadResult failure;
  failure.Key = key;
  try
  {
    return ReadUnguarded(source, key);
  }
  catch (const std::bad_alloc&)
  {
    failure.Outcome = Status(StatusCode::ResourceExhausted,
      "There was not enough memory to read " + Subject(key, source.Info()) + ".");
  }
  catch (const std::exception& error)
  {
    failure.Outcome = Status(StatusCode::InputOutput,
      "The source of " + Subject(key, source.Info()) + " failed: " + error.what());
  }
  catch (...)
  {
    failure.Outcome = Status(StatusCode::InputOutput,
      "The source of " + Subject(key, source.Info()) + " failed with an unknown exception.");
  }
  return failure;
}
} // namespace

std::uint64_t BrickLoader::ChargeOf(const BrickKey& key, const VolumeInfo& info)
{
  return CacheItem::Charge(key.PageLevel == 0
      ? BrickVoxelBytes(info) + BrickMaskBytes(info) + sizeof(Brick)
      : RangesPerBlock * sizeof(ValueRange));
}

BrickLoader::BrickLoader(
  std::shared_ptr<BrickCache> cache, int threads, std::optional<std::uint64_t> shuffleSeed)
  : Cache_(std::move(cache))
{
  assert(this->Cache_);
  if (shuffleSeed)
  {
    this->Queue.Shuffle(*shuffleSeed);
    this->Random.emplace(*shuffleSeed + 1);
  }
  for (int i = 0; i < std::max(threads, 1); ++i)
  {
    this->Threads.emplace_back([this] { this->Work(); });
  }
}

BrickLoader::~BrickLoader()
{
  this->EndWithin(0);
  const WaitScope waiting; // for reads under way
  for (std::thread& thread : this->Threads)
  {
    thread.join();
  }
}

bool BrickLoader::EndWithin(double seconds)
{
  const WaitScope waiting; // before the lock is taken: it ends after the lock is released
  std::unique_lock<std::mutex> lock(this->Mutex);
  this->Stop = true;
  this->Queue.Clear();
  this->WorkChanged.notify_all();
  this->FinishedChanged.notify_all();
  return this->FinishedChanged.wait_for(
    lock, std::chrono::duration<double>(seconds), [this] { return this->Running == 0; });
}

void BrickLoader::SetSource(
  std::uint32_t volume, std::shared_ptr<BrickSource> source, bool keepCached)
{
  std::shared_ptr<BrickSource> old; // dies after the lock is released: its destructor may be slow
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    this->Queue.RemoveVolume(volume);
    const auto dropped = std::remove_if(this->Finished.begin(), this->Finished.end(),
      [&](const LoadResult& result) { return result.Key.Volume == volume; });
    for (auto result = dropped; result != this->Finished.end(); ++result)
    {
      this->FinishedKeys.erase(result->Key);
    }
    this->Finished.erase(dropped, this->Finished.end());
    if (!keepCached)
    {
      this->Cache_->EraseVolume(volume);
    }
    const auto found = this->Sources.find(volume);
    if (found != this->Sources.end())
    {
      old = std::move(found->second);
      this->Sources.erase(found);
    }
    if (source)
    {
      this->Sources.emplace(volume, std::move(source));
    }
  }
  this->WorkChanged.notify_all();
  this->FinishedChanged.notify_all();
}

void BrickLoader::Request(std::vector<LoadRequest> wishes)
{
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    const auto settled = [&](const LoadRequest& wish)
    {
      if (this->FinishedKeys.count(wish.Key) != 0)
      {
        return true;
      }
      if (!this->Cache_->Contains(wish.Key))
      {
        return false;
      }
      const std::optional<CacheItem> item = this->Cache_->Find(wish.Key);
      if (item)
      {
        ++this->Counts.FromCache;
        this->Publish({ wish.Key, {}, item->Brick, item->Ranges });
      }
      return item.has_value();
    };
    wishes.erase(std::remove_if(wishes.begin(), wishes.end(), settled), wishes.end());
    this->Queue.Replace(std::move(wishes));
  }
  this->WorkChanged.notify_all();
  this->FinishedChanged.notify_all();
}

std::vector<LoadResult> BrickLoader::TakeFinished()
{
  std::vector<LoadResult> taken;
  {
    const std::lock_guard<std::mutex> lock(this->Mutex);
    taken.swap(this->Finished);
    this->FinishedKeys.clear();
    if (this->Random)
    {
      std::shuffle(taken.begin(), taken.end(), *this->Random);
    }
  }
  this->WorkChanged.notify_all();
  return taken;
}

bool BrickLoader::WaitFinished(double seconds)
{
  constexpr double year = 365.0 * 24 * 3600;
  // NaN waits for nothing.
  const double limit = seconds > 0 ? std::min(seconds, year) : 0.0;
  const WaitScope waiting; // before the lock is taken: it ends after the lock is released
  std::unique_lock<std::mutex> lock(this->Mutex);
  return this->FinishedChanged.wait_for(lock, std::chrono::duration<double>(limit),
    [&] {
      return !this->Finished.empty() || (this->Queue.Queued() == 0 && this->Queue.InFlight() == 0);
    });
}

std::size_t BrickLoader::Pending() const
{
  const std::lock_guard<std::mutex> lock(this->Mutex);
  return this->Queue.Queued() + this->Queue.InFlight() + this->Finished.size();
}

BrickLoader::Counters BrickLoader::GetCounters() const
{
  const std::lock_guard<std::mutex> lock(this->Mutex);
  return this->Counts;
}

void BrickLoader::Work()
{
  std::unique_lock<std::mutex> lock(this->Mutex);
  while (true)
  {
    std::optional<Job> job;
    try
    {
      job = this->TakeJob(lock);
    }
    catch (const std::bad_alloc&)
    {
      this->FinishedChanged.notify_all();
      this->WorkChanged.wait_for(lock, RoomPollInterval);
      continue;
    }
    if (!job)
    {
      return;
    }
    ++this->Running;
    this->BytesInFlight_ += job->Bytes;
    lock.unlock();
    std::optional<LoadResult> result;
    try
    {
      result = Read(*job->Source, job->Flight.Request.Key);
    }
    catch (const std::exception&)
    {
      // Not even memory to say so.
    }
    lock.lock();
    --this->Running;
    this->BytesInFlight_ -= job->Bytes;
    this->FinishJob(*job, std::move(result));
    this->WorkChanged.notify_all();
    this->FinishedChanged.notify_all();
  }
}

std::optional<BrickLoader::Job> BrickLoader::TakeJob(std::unique_lock<std::mutex>& lock)
{
  while (true)
  {
    this->WorkChanged.wait(lock, [&] { return this->Stop || this->Queue.Queued() != 0; });
    if (this->Stop)
    {
      return std::nullopt;
    }
    Job job;
    job.Flight = *this->Queue.Pop();
    const BrickKey& key = job.Flight.Request.Key;
    try
    {
      if (this->FinishWithoutReading(job))
      {
        this->FinishedChanged.notify_all();
        continue;
      }
      if (this->ReserveFor(job.Bytes))
      {
        ++(key.PageLevel == 0 ? this->Counts.BricksRead : this->Counts.PageBlocksRead);
        return job;
      }
      this->Queue.PutBack(job.Flight);
    }
    catch (const std::bad_alloc&)
    {
      this->Queue.Finish(job.Flight); // as if it had not been asked for
      throw;
    }
    this->WorkChanged.wait_for(lock, RoomPollInterval);
  }
}

bool BrickLoader::FinishWithoutReading(Job& job)
{
  const BrickKey& key = job.Flight.Request.Key;
  LoadResult result;
  result.Key = key;
  const auto source = this->Sources.find(key.Volume);
  if (source == this->Sources.end())
  {
    result.Outcome = Status(StatusCode::NotFound,
      "Volume " + std::to_string(key.Volume) + " has no source to read " + key.ToString() + ".");
  }
  else
  {
    job.Source = source->second;
    const VolumeInfo& info = job.Source->Info();
    job.Bytes = ChargeOf(key, info);
    result.Outcome = CheckKey(key, info);
    if (result.Outcome && job.Bytes > this->Cache_->Budget())
    {
      result.Outcome = Status(StatusCode::ResourceExhausted,
        "The host budget of " + std::to_string(this->Cache_->Budget()) +
          " bytes is too small for " + Subject(key, info) + "; it must be at least " +
          std::to_string(std::max(job.Bytes, this->Headroom())) + " bytes.");
    }
  }
  if (result.Outcome)
  {
    // Another loader of the same cache may have read it meanwhile. Counts the miss otherwise.
    const std::optional<CacheItem> item = this->Cache_->Find(key);
    if (!item)
    {
      return false;
    }
    ++this->Counts.FromCache;
    result.Brick = item->Brick;
    result.Ranges = item->Ranges;
  }
  else
  {
    ++this->Counts.Failures;
  }
  this->Queue.Finish(job.Flight);
  this->Publish(std::move(result));
  return true;
}

bool BrickLoader::ReserveFor(std::uint64_t bytes)
{
  const bool idle = this->Running == 0 && this->Finished.empty();
  if (this->Cache_->Reserve(bytes, idle ? 0 : this->Headroom()))
  {
    return true;
  }
  if (!idle)
  {
    return false;
  }
  // All of the budget is held by others, who may be waiting for this very brick.
  this->Cache_->ForceReserve(bytes);
  return true;
}

// Without a result, or without memory to hand it on, it is as if the brick had not been asked for:
// who waits for it asks again.
void BrickLoader::FinishJob(const Job& job, std::optional<LoadResult> result)
{
  bool reserved = true;
  if (result && this->Queue.IsInFlight(job.Flight))
  {
    try
    {
      if (result->Outcome)
      {
        const CacheItem item{ result->Brick, result->Ranges };
        this->Cache_->Commit(result->Key, item, job.Bytes);
        reserved = false;
        this->Counts.BytesDecoded += item.Bytes() - CacheItem::Overhead;
      }
      else
      {
        ++this->Counts.Failures;
      }
      this->Publish(std::move(*result));
    }
    catch (const std::bad_alloc&)
    {
      ++this->Counts.Failures;
    }
  }
  this->Queue.Finish(job.Flight);
  if (reserved)
  {
    result.reset(); // its memory goes before its reservation
    this->Cache_->Release(job.Bytes);
  }
}

void BrickLoader::Publish(LoadResult result)
{
  const BrickKey key = result.Key;
  this->Finished.push_back(std::move(result));
  try
  {
    this->FinishedKeys.insert(key);
  }
  catch (const std::bad_alloc&)
  {
    this->Finished.pop_back();
    throw;
  }
}

std::uint64_t BrickLoader::Headroom() const
{
  std::uint64_t largest = 0;
  for (const auto& [volume, source] : this->Sources)
  {
    BrickKey page;
    page.PageLevel = 1;
    largest =
      std::max({ largest, ChargeOf(BrickKey{}, source->Info()), ChargeOf(page, source->Info()) });
  }
  return largest;
}

} // namespace teravox
