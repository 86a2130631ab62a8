// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BrickCache.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace teravox
{

std::uint64_t CacheItem::Bytes() const
{
  std::uint64_t bytes = 0;
  if (this->Brick)
  {
    bytes += this->Brick->SizeInBytes();
  }
  if (this->Ranges)
  {
    bytes += this->Ranges->size() * sizeof(ValueRange);
  }
  return Charge(bytes);
}

bool CacheItem::IsHeldOutside() const
{
  // Copies are made under the cache's lock only: a count of one can't grow while it is held.
  return this->Brick.use_count() > 1 || this->Ranges.use_count() > 1;
}

BrickCache::BrickCache(std::uint64_t budget)
  : Budget_(budget)
{
}

void BrickCache::SetBudget(std::uint64_t bytes)
{
  const std::lock_guard<std::mutex> lock(this->Mutex);
  this->Budget_ = bytes;
  this->DropReleasedOrphans();
  this->EvictDownTo(bytes);
}

std::uint64_t BrickCache::Budget() const
{
  const std::lock_guard<std::mutex> lock(this->Mutex);
  return this->Budget_;
}

bool BrickCache::Reserve(std::uint64_t bytes, std::uint64_t headroom)
{
  const std::lock_guard<std::mutex> lock(this->Mutex);
  if (bytes > this->Budget_ || headroom > this->Budget_ - bytes)
  {
    return false;
  }
  this->DropReleasedOrphans();
  const std::uint64_t limit = this->Budget_ - bytes - headroom;
  if (!this->CanEvictDownTo(limit))
  {
    return false;
  }
  this->EvictDownTo(limit);
  this->Reserved += bytes;
  this->UpdatePeak();
  return true;
}

void BrickCache::ForceReserve(std::uint64_t bytes)
{
  const std::lock_guard<std::mutex> lock(this->Mutex);
  this->DropReleasedOrphans();
  this->EvictDownTo(bytes > this->Budget_ ? 0 : this->Budget_ - bytes);
  this->Reserved += bytes;
  this->UpdatePeak();
}

void BrickCache::Release(std::uint64_t bytes)
{
  const std::lock_guard<std::mutex> lock(this->Mutex);
  assert(bytes <= this->Reserved);
  this->Reserved -= bytes;
}

void BrickCache::Commit(const BrickKey& key, CacheItem item, std::uint64_t reserved)
{
  const std::lock_guard<std::mutex> lock(this->Mutex);
  const std::uint64_t bytes = item.Bytes();
  assert(bytes <= reserved && reserved <= this->Reserved);
  const auto old = this->Index.find(key);
  if (old != this->Index.end())
  {
    this->EraseEntry(old->second);
  }
  Entries made; // where there is no memory for it, nothing else has happened
  made.push_back(Entry{ key, std::move(item), bytes });
  this->Index.emplace(key, made.begin());
  this->Order.splice(this->Order.end(), made);
  this->Reserved -= reserved;
  this->Used += bytes;
  this->UpdatePeak();
}

std::optional<CacheItem> BrickCache::Find(const BrickKey& key)
{
  const std::lock_guard<std::mutex> lock(this->Mutex);
  const auto found = this->Index.find(key);
  if (found == this->Index.end())
  {
    ++this->Misses;
    return std::nullopt;
  }
  ++this->Hits;
  this->Order.splice(this->Order.end(), this->Order, found->second);
  return found->second->Item;
}

bool BrickCache::Contains(const BrickKey& key) const
{
  const std::lock_guard<std::mutex> lock(this->Mutex);
  return this->Index.count(key) != 0;
}

void BrickCache::Erase(const BrickKey& key)
{
  const std::lock_guard<std::mutex> lock(this->Mutex);
  const auto found = this->Index.find(key);
  if (found != this->Index.end())
  {
    this->EraseEntry(found->second);
  }
}

void BrickCache::EraseVolume(std::uint32_t volume)
{
  const std::lock_guard<std::mutex> lock(this->Mutex);
  for (auto entry = this->Order.begin(); entry != this->Order.end();)
  {
    const auto next = std::next(entry);
    if (entry->Key.Volume == volume)
    {
      this->EraseEntry(entry);
    }
    entry = next;
  }
}

BrickCache::Counters BrickCache::GetCounters() const
{
  const std::lock_guard<std::mutex> lock(this->Mutex);
  Counters counters;
  counters.BytesUsed = this->Used;
  counters.BytesReserved = this->Reserved;
  counters.Items = this->Order.size();
  counters.Hits = this->Hits;
  counters.Misses = this->Misses;
  counters.Evictions = this->Evictions;
  counters.PeakBytes = this->Peak;
  for (const Entry& entry : this->Order)
  {
    counters.BytesPinned += entry.Item.IsHeldOutside() ? entry.Bytes : 0;
  }
  for (const Entry& entry : this->Orphans)
  {
    // Released ones are dropped by the next function that changes something.
    if (entry.Item.IsHeldOutside())
    {
      counters.BytesPinned += entry.Bytes;
    }
    else
    {
      counters.BytesUsed -= entry.Bytes;
    }
  }
  return counters;
}

std::vector<BrickKey> BrickCache::Keys() const
{
  const std::lock_guard<std::mutex> lock(this->Mutex);
  std::vector<BrickKey> keys;
  for (const Entry& entry : this->Order)
  {
    keys.push_back(entry.Key);
  }
  return keys;
}

void BrickCache::DropReleasedOrphans()
{
  for (auto entry = this->Orphans.begin(); entry != this->Orphans.end();)
  {
    const bool held = entry->Item.IsHeldOutside();
    this->Used -= held ? 0 : entry->Bytes;
    entry = held ? std::next(entry) : this->Orphans.erase(entry);
  }
}

bool BrickCache::CanEvictDownTo(std::uint64_t limit) const
{
  std::uint64_t total = this->Used + this->Reserved;
  for (auto entry = this->Order.begin(); entry != this->Order.end() && total > limit; ++entry)
  {
    total -= entry->Item.IsHeldOutside() ? 0 : entry->Bytes;
  }
  return total <= limit;
}

void BrickCache::EvictDownTo(std::uint64_t limit)
{
  for (auto entry = this->Order.begin();
       entry != this->Order.end() && this->Used + this->Reserved > limit;)
  {
    const auto next = std::next(entry);
    if (!entry->Item.IsHeldOutside())
    {
      this->EraseEntry(entry);
      ++this->Evictions;
    }
    entry = next;
  }
}

// Needs no memory.
void BrickCache::EraseEntry(Entries::iterator entry)
{
  this->Index.erase(entry->Key);
  if (entry->Item.IsHeldOutside())
  {
    this->Orphans.splice(this->Orphans.end(), this->Order, entry);
    return;
  }
  this->Used -= entry->Bytes;
  this->Order.erase(entry);
}

void BrickCache::UpdatePeak()
{
  this->Peak = std::max(this->Peak, this->Used + this->Reserved);
}

} // namespace teravox
