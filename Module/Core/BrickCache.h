// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickKey.h"
#include "BrickSource.h"

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <vector>

namespace teravox
{

/// The ranges of one page block, PageBlockEdge^3 of them, x fastest.
using RangesPointer = std::shared_ptr<const std::vector<ValueRange>>;

/// What the host cache holds under one key: a brick, or the ranges of a page block.
struct CacheItem
{
  BrickPointer Brick;
  RangesPointer Ranges;

  /// What the cache charges beside the payload: list and map nodes, control blocks, allocator.
  static constexpr std::uint64_t Overhead = 320;
  /// Charge of an item whose payload has this many bytes.
  static constexpr std::uint64_t Charge(std::uint64_t payload) { return payload + Overhead; }
  std::uint64_t Bytes() const;
  /// Somebody beside the cache holds the payload.
  bool IsHeldOutside() const;
};

/// Keeps decoded bricks and page blocks in host memory: least recently used, limited by bytes.
///
/// Bricks that are being read count through Reserve(), items that somebody still holds (shared_ptr)
/// count and aren't evicted, also when they were erased meanwhile.
/// Invariant: used + reserved <= budget, except for what is held outside when the budget shrinks
/// and for ForceReserve(). Thread: all functions may be called from several threads at once.
class BrickCache
{
public:
  struct Counters
  {
    std::uint64_t BytesUsed = 0;     ///< items, erased ones still held outside included
    std::uint64_t BytesReserved = 0; ///< reads under way
    std::uint64_t BytesPinned = 0;   ///< part of BytesUsed that is held outside
    std::uint64_t Items = 0;
    std::uint64_t Hits = 0;
    std::uint64_t Misses = 0;
    std::uint64_t Evictions = 0;
    std::uint64_t PeakBytes = 0; ///< largest used + reserved so far
  };

  explicit BrickCache(std::uint64_t budget);

  /// Evicts at once what no longer fits and isn't held outside.
  void SetBudget(std::uint64_t bytes);
  std::uint64_t Budget() const;

  /// Makes room for `bytes` by eviction and sets them aside, with `headroom` bytes left free beside
  /// them. Returns false, and evicts nothing, when that is impossible.
  bool Reserve(std::uint64_t bytes, std::uint64_t headroom = 0);
  /// Reserve() that evicts what it can and never fails: goes beyond the budget by what is held
  /// outside. For the one read that makes progress certain.
  void ForceReserve(std::uint64_t bytes);
  /// Gives back a reservation that wasn't used.
  void Release(std::uint64_t bytes);
  /// Turns a reservation into an item, the most recently used. An item of the same key is replaced.
  /// Requires: item.Bytes() <= reserved. Throws std::bad_alloc, and has changed nothing but the old
  /// item then.
  void Commit(const BrickKey& key, CacheItem item, std::uint64_t reserved);

  /// The item, which becomes the most recently used; counts a hit or a miss.
  std::optional<CacheItem> Find(const BrickKey& key);
  /// Is the item here? Counts nothing and changes no order.
  bool Contains(const BrickKey& key) const;

  void Erase(const BrickKey& key);
  /// Erases all bricks and page blocks of a volume.
  void EraseVolume(std::uint32_t volume);

  Counters GetCounters() const;
  /// Keys from the least to the most recently used; for tests.
  std::vector<BrickKey> Keys() const;

private:
  struct Entry
  {
    BrickKey Key;
    CacheItem Item;
    std::uint64_t Bytes = 0;
  };
  using Entries = std::list<Entry>;

  void DropReleasedOrphans();
  void EvictDownTo(std::uint64_t limit);
  void EraseEntry(Entries::iterator entry);
  bool CanEvictDownTo(std::uint64_t limit) const;
  void UpdatePeak();

  mutable std::mutex Mutex;
  std::uint64_t Budget_;
  std::uint64_t Used = 0;
  std::uint64_t Reserved = 0;
  std::uint64_t Peak = 0;
  std::uint64_t Hits = 0;
  std::uint64_t Misses = 0;
  std::uint64_t Evictions = 0;
  Entries Order; // least recently used first
  std::unordered_map<BrickKey, Entries::iterator, BrickKeyHash> Index;
  Entries Orphans; // erased while held outside
};

} // namespace teravox
