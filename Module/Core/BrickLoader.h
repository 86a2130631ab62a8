// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickCache.h"
#include "BrickSource.h"
#include "RequestQueue.h"
#include "Status.h"

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <thread>
#include <unordered_map>
#include <unordered_set>
#include <vector>

namespace teravox
{

/// How one wish ended. Brick or Ranges is set if Outcome is Ok, as the key's PageLevel says.
struct LoadResult
{
  BrickKey Key;
  Status Outcome;
  BrickPointer Brick;
  RangesPointer Ranges;
};

/// Worker threads that turn wishes into bricks and page blocks in the host cache.
///
/// Memory: each read is reserved in the cache before it starts; results that weren't taken are held
/// and count. Where there is no room, threads wait for it. One read may always start when none is
/// under way and nothing waits to be taken: a brick's worth of the budget is kept free for it.
/// A failed read is reported once and not remembered: it is tried again when it is wished for
/// again. Thread: all functions may be called from several threads at once; sources are called from
/// the worker threads.
class BrickLoader
{
public:
  struct Counters
  {
    std::uint64_t BricksRead = 0;
    std::uint64_t PageBlocksRead = 0;
    std::uint64_t Failures = 0;
    std::uint64_t FromCache = 0;
    std::uint64_t BytesDecoded = 0;
  };

  /// `shuffleSeed` randomises the order of service and of TakeFinished(); for tests.
  /// Requires: cache isn't null. Fewer than one thread is one.
  BrickLoader(std::shared_ptr<BrickCache> cache, int threads,
    std::optional<std::uint64_t> shuffleSeed = std::nullopt);
  BrickLoader(const BrickLoader&) = delete;
  BrickLoader& operator=(const BrickLoader&) = delete;
  BrickLoader(BrickLoader&&) = delete;
  BrickLoader& operator=(BrickLoader&&) = delete;
  /// Running reads finish first; queued wishes are dropped. See EndOrLeave().
  ~BrickLoader();
  /// Begins no other read, and waits for those that are under way; false after `seconds`. Requires:
  /// nothing but the destructor is called afterwards.
  bool EndWithin(double seconds);

  /// Gives a volume its source; null removes it. What was queued, read, finished or cached of the
  /// source before is dropped; with `keepCached` the cache stays as it is, for a source that gives
  /// the same bricks. Doesn't wait for running reads; they hold their source until they end.
  void SetSource(
    std::uint32_t volume, std::shared_ptr<BrickSource> source, bool keepCached = false);
  /// Replaces the wishes that weren't started. Cached items finish at once.
  void Request(std::vector<LoadRequest> wishes);
  /// What finished since the last call, in any order. Doesn't block.
  std::vector<LoadResult> TakeFinished();
  /// Waits until something is finished, or nothing is queued or in flight; false on time-out.
  /// Seconds beyond a year, infinity included, are a year.
  bool WaitFinished(double seconds);

  /// What the cache charges for the brick or the page block of this key.
  static std::uint64_t ChargeOf(const BrickKey& key, const VolumeInfo& info);

  /// Queued, in flight, and finished but not taken.
  std::size_t Pending() const;
  /// Memory reserved for running reads.
  std::uint64_t BytesInFlight() const { return this->BytesInFlight_.load(); }
  int NumberOfThreads() const { return static_cast<int>(this->Threads.size()); }
  const std::shared_ptr<BrickCache>& Cache() const { return this->Cache_; }
  Counters GetCounters() const;

private:
  struct Job
  {
    RequestQueue::Flight Flight;
    std::shared_ptr<BrickSource> Source;
    std::uint64_t Bytes = 0;
  };

  void Work();
  std::optional<Job> TakeJob(std::unique_lock<std::mutex>& lock);
  bool FinishWithoutReading(Job& job);
  bool ReserveFor(std::uint64_t bytes);
  void FinishJob(const Job& job, std::optional<LoadResult> result);
  void Publish(LoadResult result);
  std::uint64_t Headroom() const;

  const std::shared_ptr<BrickCache> Cache_;
  mutable std::mutex Mutex;
  std::condition_variable WorkChanged;     // wishes, room, stop
  std::condition_variable FinishedChanged; // results, idleness
  RequestQueue Queue;
  std::unordered_map<std::uint32_t, std::shared_ptr<BrickSource>> Sources;
  std::vector<LoadResult> Finished;
  std::unordered_set<BrickKey, BrickKeyHash> FinishedKeys;
  std::size_t Running = 0; // reads under way, forgotten ones included
  std::optional<std::mt19937_64> Random;
  Counters Counts;
  bool Stop = false;
  std::atomic<std::uint64_t> BytesInFlight_{ 0 };
  std::vector<std::thread> Threads; // last: started when all else is ready
};

} // namespace teravox
