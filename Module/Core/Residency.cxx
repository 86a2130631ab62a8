// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Residency.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>

namespace teravox
{

namespace
{
constexpr std::uint64_t NoRank = ~std::uint64_t{ 0 };

std::int64_t FloorDivide(double value, double by)
{
  constexpr double limit = 4.0e18;
  return static_cast<std::int64_t>(std::clamp(std::floor(value / by), -limit, limit));
}

std::uint64_t Distance(std::int64_t a, std::int64_t b)
{
  const double d = std::abs(static_cast<double>(a) - static_cast<double>(b));
  return static_cast<std::uint64_t>(std::min(d, 1.0e15));
}
} // namespace

Residency::Residency(PageTable& table, std::uint32_t slots)
  : Table(table)
  , Slots(slots)
  , BlockSlots(table.BlockCapacity())
{
  assert(slots >= 2);
  for (std::uint32_t s = slots; s-- > 0;)
  {
    this->FreeSlots.push_back(s);
  }
}

void Residency::SetPinned(std::vector<BrickKey> bricks)
{
  this->Pinned = std::move(bricks);
  for (Slot& slot : this->Slots)
  {
    slot.Pinned = slot.Used &&
      std::find(this->Pinned.begin(), this->Pinned.end(), slot.Key) != this->Pinned.end();
  }
}

void Residency::RetryFailed()
{
  this->Table.ClearFailed();
  for (const BrickKey& block : this->FailedBlocks)
  {
    if (this->Table.HasBlock(block))
    {
      this->UnmapBlockTree(block);
    }
    this->ArrivedBlocks.erase(block);
  }
  this->FailedBlocks.clear();
}

std::vector<bool> Residency::ResidentLevels() const
{
  std::vector<bool> levels(static_cast<std::size_t>(this->Table.Layout().NumberOfLevels()), false);
  for (const auto& [key, slot] : this->SlotOf)
  {
    levels[key.Level] = true;
  }
  return levels;
}

std::uint64_t Residency::HeldBytes() const
{
  return this->Arrived.size() * this->Limit.BrickBytes +
    this->ArrivedBlocks.size() * this->Limit.BlockBytes;
}

Residency::Rank Residency::RankOf(const BrickKey& brick, const ViewOrder& order) const
{
  const PyramidLayout& layout = this->Table.Layout();
  const std::array<std::int64_t, 3> index{ brick.X, brick.Y, brick.Z };
  const Int3& count = layout.Bricks(brick.Level);
  std::uint64_t distance = 0;
  for (std::size_t a = 0; a < 3; ++a)
  {
    if (order.Parallel)
    {
      distance +=
        static_cast<std::uint64_t>(order.Direction[a] < 0 ? count[a] - index[a] : index[a]);
    }
    else
    {
      const double edge = static_cast<double>(layout.BrickSize()) *
        static_cast<double>(layout.Factor(brick.Level)[a]);
      distance += Distance(index[a], FloorDivide(order.Eye[a], edge));
    }
  }
  return std::uint64_t{ brick.Level } << 56 | std::min(distance, (std::uint64_t{ 1 } << 56) - 1);
}

Residency::Rank Residency::NearestRank(const BrickKey& block, const ViewOrder& order) const
{
  // The nearest brick of the region: per axis the index clamped to the eye's.
  const PyramidLayout& layout = this->Table.Layout();
  BrickKey nearest = block;
  nearest.PageLevel = 0;
  std::int64_t edge = 1;
  for (int k = 0; k < block.PageLevel; ++k)
  {
    edge *= PageBlockEdge;
  }
  const std::array<std::uint32_t BrickKey::*, 3> axes{ &BrickKey::X, &BrickKey::Y, &BrickKey::Z };
  for (std::size_t a = 0; a < 3; ++a)
  {
    const std::int64_t low = block.*axes[a] * edge;
    const std::int64_t high = std::min(low + edge, layout.Bricks(block.Level)[a]) - 1;
    std::int64_t at = order.Direction[a] < 0 ? high : low;
    if (!order.Parallel)
    {
      const double size = static_cast<double>(layout.BrickSize()) *
        static_cast<double>(layout.Factor(block.Level)[a]);
      at = std::clamp(FloorDivide(order.Eye[a], size), low, std::max(low, high));
    }
    nearest.*axes[a] = static_cast<std::uint32_t>(at);
  }
  return this->RankOf(nearest, order);
}

bool Residency::TakeSlot(Rank rank, const ViewOrder& order, std::uint32_t& slot)
{
  if (!this->FreeSlots.empty())
  {
    slot = this->FreeSlots.back();
    this->FreeSlots.pop_back();
    return true;
  }
  // Dead bricks first, the least recently used of them; then the one that is needed last, if it is
  // needed after this one.
  std::uint32_t dead = PageEntry::SlotMask;
  std::uint32_t last = PageEntry::SlotMask;
  Rank lastRank = 0;
  for (std::uint32_t s = 0; s < this->Slots.size(); ++s)
  {
    const Slot& candidate = this->Slots[s];
    if (candidate.Pinned || candidate.MappedIn == this->StepNumber)
    {
      continue;
    }
    const Rank candidateRank = this->RankOf(candidate.Key, order);
    if (candidateRank <= this->Front)
    {
      if (dead == PageEntry::SlotMask || candidate.LastUsed < this->Slots[dead].LastUsed)
      {
        dead = s;
      }
    }
    else if (last == PageEntry::SlotMask || candidateRank > lastRank)
    {
      last = s;
      lastRank = candidateRank;
    }
  }
  if (dead != PageEntry::SlotMask)
  {
    slot = dead;
  }
  else if (last != PageEntry::SlotMask && lastRank > rank)
  {
    slot = last;
  }
  else
  {
    return false;
  }
  this->Table.UnmapBrick(this->Slots[slot].Key);
  this->SlotOf.erase(this->Slots[slot].Key);
  this->Slots[slot].Used = false;
  ++this->Evictions;
  return true;
}

void Residency::UnmapBlockTree(const BrickKey& block)
{
  for (const BrickKey& child : this->Table.ChildBlocks(block))
  {
    this->UnmapBlockTree(child);
  }
  this->Table.UnmapBlock(block);
  ++this->BlockEvictions;
}

bool Residency::TakeBlockSlot(
  const BrickKey& wanted, bool front, const ViewOrder& order, std::uint32_t& slot)
{
  const std::uint32_t capacity = this->Table.BlockCapacity();
  if (this->Table.NumberOfBlocks() < capacity)
  {
    for (slot = 0; slot < capacity; ++slot)
    {
      if (!this->Table.BlockInSlot(slot))
      {
        return true;
      }
    }
  }
  // Least recently used first among blocks that lie before the front, else the farthest.
  const Rank wantedRank = this->NearestRank(wanted, order);
  std::uint32_t best = capacity;
  bool bestIdle = false;
  Rank bestRank = 0;
  for (std::uint32_t s = 0; s < capacity; ++s)
  {
    const BrickKey key = *this->Table.BlockInSlot(s);
    if (this->ProtectedBlocks.count(key) != 0 || this->BlockSlots[s].MappedIn == this->StepNumber)
    {
      continue;
    }
    // The last pass didn't use it: whatever rays still come, they can fetch it again.
    const bool idle = this->BlockSlots[s].LastUsed + 1 < this->StepNumber;
    const Rank rank = idle ? NoRank - this->BlockSlots[s].LastUsed : this->NearestRank(key, order);
    if (best == capacity || (idle && !bestIdle) || (idle == bestIdle && rank > bestRank))
    {
      best = s;
      bestIdle = idle;
      bestRank = rank;
    }
  }
  // The block that the front waits for takes any place: with the smallest pool all blocks may have
  // been used by the last pass and lie nearer to the eye.
  if (best == capacity || (!front && !bestIdle && bestRank <= wantedRank))
  {
    return false;
  }
  this->UnmapBlockTree(*this->Table.BlockInSlot(best));
  slot = best;
  return true;
}

void Residency::Accept(std::vector<LoadResult> finished, FramePlan& plan)
{
  for (LoadResult& result : finished)
  {
    if (!result.Outcome)
    {
      if (result.Key.PageLevel == 0)
      {
        if (!this->Table.IsFailed(result.Key))
        {
          this->Table.SetFailed(result.Key);
          plan.Failures.push_back(std::move(result));
        }
      }
      else
      {
        // Without ranges nothing is known to be empty; the bricks themselves may be readable.
        static const auto unknown =
          std::make_shared<const std::vector<ValueRange>>(PageTable::EntriesPerBlock);
        this->ArrivedBlocks[result.Key] = unknown;
        if (this->FailedBlocks.insert(result.Key).second)
        {
          plan.Failures.push_back(std::move(result));
        }
      }
    }
    else if (result.Key.PageLevel > 0)
    {
      this->ArrivedBlocks[result.Key] = std::move(result.Ranges);
    }
    else if (this->SlotOf.count(result.Key) == 0)
    {
      this->Arrived[result.Key] = std::move(result.Brick);
    }
  }
}

bool Residency::DropHeld(const BrickKey* before, const FirstWish& neededBy)
{
  // What is needed last goes first: by the last wish, and of one way to a brick the lowest page
  // level. Only what is needed after `before` may go.
  struct Need
  {
    std::size_t Wish = 0;
    BrickKey Key;
    bool IsAfter(const Need& o) const
    {
      return this->Wish != o.Wish                ? this->Wish > o.Wish
        : this->Key.PageLevel != o.Key.PageLevel ? this->Key.PageLevel < o.Key.PageLevel
                                                 : o.Key < this->Key;
    }
  };
  const auto needOf = [&](const BrickKey& key)
  {
    const auto found = neededBy.find(key);
    return Need{ found == neededBy.end() ? ~std::size_t{ 0 } : found->second, key };
  };
  std::optional<Need> last;
  const auto look = [&](const BrickKey& key)
  {
    const Need need = needOf(key);
    if ((before == nullptr || need.IsAfter(needOf(*before))) && (!last || need.IsAfter(*last)))
    {
      last = need;
    }
  };
  for (const auto& item : this->Arrived)
  {
    look(item.first);
  }
  for (const auto& item : this->ArrivedBlocks)
  {
    look(item.first);
  }
  if (!last)
  {
    return false;
  }
  return this->Arrived.erase(last->Key) + this->ArrivedBlocks.erase(last->Key) > 0;
}

void Residency::KeepHostLimit(FramePlan& plan, const FirstWish& neededBy)
{
  // Nothing arrives that wasn't asked for, so this finds something only where the limit has shrunk.
  while (this->HeldBytes() > this->Limit.Bytes && this->DropHeld(nullptr, neededBy))
  {
  }
  if (plan.Requests.empty())
  {
    return;
  }
  // What came too early must not keep the room from the first that is still missing.
  const BrickKey& first = plan.Requests.front().Key;
  while (this->HeldBytes() + this->ChargeOf(first) > this->Limit.Bytes &&
    this->DropHeld(&first, neededBy))
  {
  }
  std::uint64_t bytes = this->HeldBytes();
  std::size_t fitting = 0;
  while (fitting < plan.Requests.size() &&
    bytes + this->ChargeOf(plan.Requests[fitting].Key) <= this->Limit.Bytes)
  {
    bytes += this->ChargeOf(plan.Requests[fitting].Key);
    ++fitting;
  }
  plan.Requests.resize(fitting);
}

FramePlan Residency::Step(const Feedback& feedback, std::vector<LoadResult> finished,
  const ViewOrder& order, std::size_t limitUploads)
{
  FramePlan plan;
  ++this->StepNumber;
  for (const std::uint32_t s : feedback.UsedSlots)
  {
    this->Slots[s].LastUsed = this->StepNumber;
  }
  for (const std::uint32_t s : feedback.UsedBlocks)
  {
    this->BlockSlots[s].LastUsed = this->StepNumber;
  }
  this->Accept(std::move(finished), plan);
  this->Table.SetView(order.InView);

  struct Wish
  {
    Rank Order;
    BrickKey Key;
    std::uint32_t Weight;
    bool Pin;
  };
  std::vector<Wish> wishes;
  wishes.reserve(feedback.Missed.size() + this->Pinned.size());
  for (const BrickKey& key : this->Pinned)
  {
    if (this->SlotOf.count(key) == 0 && !this->Table.IsFailed(key))
    {
      wishes.push_back({ 0, key, ~std::uint32_t{ 0 }, true });
    }
  }
  this->Front = NoRank;
  for (const Feedback::Miss& miss : feedback.Missed)
  {
    const Rank rank = this->RankOf(miss.Key, order);
    this->Front = std::min(this->Front, rank);
    wishes.push_back({ rank, miss.Key, miss.Weight, false });
  }
  std::sort(wishes.begin(), wishes.end(),
    [](const Wish& a, const Wish& b)
    { return a.Order != b.Order ? a.Order < b.Order : a.Key < b.Key; });
  if (feedback.Missed.empty())
  {
    this->Front = 0; // nothing is known to be dead
  }

  // What arrived but isn't wished for any more gives its memory back (the host cache may keep it).
  std::unordered_set<BrickKey, BrickKeyHash> wished;
  this->ProtectedBlocks.clear();
  for (const Wish& wish : wishes)
  {
    wished.insert(wish.Key);
    BrickKey block = wish.Key;
    while (block.PageLevel < this->Table.Layout().PageDepth(block.Level))
    {
      block = PageTable::ParentBlock(block);
      wished.insert(block);
    }
  }
  for (auto item = this->Arrived.begin(); item != this->Arrived.end();)
  {
    item = wished.count(item->first) == 0 ? this->Arrived.erase(item) : std::next(item);
  }
  for (auto item = this->ArrivedBlocks.begin(); item != this->ArrivedBlocks.end();)
  {
    item = wished.count(item->first) == 0 ? this->ArrivedBlocks.erase(item) : std::next(item);
  }

  FirstWish neededBy;
  this->Missing = 0;
  // A little more than fits, so that the loader has work while a pass is drawn.
  std::size_t loadable = this->Slots.size() + 32;
  std::size_t loadableBlocks = this->Table.BlockCapacity() + 32;
  const auto request = [&](const BrickKey& key, std::size_t wish)
  {
    std::size_t& left = key.PageLevel == 0 ? loadable : loadableBlocks;
    if (left > 0 && neededBy.emplace(key, wish).second)
    {
      --left;
      plan.Requests.push_back({ key, static_cast<double>(wishes.size() - wish) });
    }
  };
  std::unordered_set<BrickKey, BrickKeyHash> shown; // regions that rays have met out of view
  for (std::size_t w = 0; w < wishes.size(); ++w)
  {
    const Wish& wish = wishes[w];
    // The way to the entry, topmost block first.
    std::vector<BrickKey> chain;
    BrickKey block = wish.Key;
    while (block.PageLevel < this->Table.Layout().PageDepth(block.Level))
    {
      block = PageTable::ParentBlock(block);
      chain.push_back(block);
    }
    bool mapped = true;
    bool fresh = false;
    bool known = true;
    for (auto key = chain.rbegin(); key != chain.rend(); ++key)
    {
      if (this->Table.HasBlock(*key))
      {
        this->ProtectedBlocks.insert(*key);
        const BlockSlot& present = this->BlockSlots[this->Table.BlockSlot(*key)];
        fresh = fresh || present.MappedIn == this->StepNumber;
        continue;
      }
      // Had the rays known the range of this region, they had perhaps passed.
      if (mapped && (shown.count(*key) != 0 || this->Table.Show(*key)))
      {
        shown.insert(*key);
        known = false;
      }
      if (!known)
      {
        mapped = false;
        neededBy.emplace(*key, w);
        continue;
      }
      const auto arrived = this->ArrivedBlocks.find(*key);
      if (arrived == this->ArrivedBlocks.end())
      {
        request(*key, w);
        mapped = false;
        continue;
      }
      std::uint32_t slot = 0;
      if (!mapped || !this->TakeBlockSlot(*key, wish.Order <= this->Front, order, slot))
      {
        mapped = false;
        neededBy.emplace(*key, w);
        continue;
      }
      this->Table.MapBlock(*key, slot, *arrived->second);
      this->ArrivedBlocks.erase(arrived);
      this->BlockSlots[slot] = { this->StepNumber, this->StepNumber };
      this->ProtectedBlocks.insert(*key);
      fresh = true;
    }
    // Behind a new block lies perhaps nothing: the next pass tells which of its bricks are needed.
    if (!mapped || fresh)
    {
      neededBy.emplace(wish.Key, w);
      ++this->Missing;
      continue;
    }
    const auto entry = this->Table.Entry(wish.Key);
    if (entry && entry->GetState() != PageEntry::Unmapped)
    {
      continue; // single, failed, or resident since the pass
    }
    ++this->Missing;
    const auto arrived = this->Arrived.find(wish.Key);
    if (arrived == this->Arrived.end())
    {
      request(wish.Key, w);
      continue;
    }
    std::uint32_t slot = 0;
    if (plan.Uploads.size() >= limitUploads || !this->TakeSlot(wish.Order, order, slot))
    {
      neededBy.emplace(wish.Key, w);
      continue;
    }
    this->Slots[slot] = { wish.Key, true, wish.Pin, this->StepNumber, this->StepNumber };
    this->SlotOf[wish.Key] = slot;
    this->Table.MapBrick(wish.Key, slot);
    plan.Uploads.push_back({ slot, wish.Key, std::move(arrived->second) });
    this->Arrived.erase(arrived);
  }
  this->KeepHostLimit(plan, neededBy);
  return plan;
}

std::string Residency::CheckInvariants() const
{
  std::size_t used = 0;
  for (std::uint32_t s = 0; s < this->Slots.size(); ++s)
  {
    if (!this->Slots[s].Used)
    {
      continue;
    }
    ++used;
    const auto at = this->SlotOf.find(this->Slots[s].Key);
    if (at == this->SlotOf.end() || at->second != s)
    {
      return "slot " + std::to_string(s) + " holds a brick that isn't recorded there";
    }
    const auto entry = this->Table.Entry(this->Slots[s].Key);
    if (entry && entry->GetState() == PageEntry::Mapped && entry->Slot() != s)
    {
      return "the entry of " + this->Slots[s].Key.ToString() + " points to another slot";
    }
  }
  if (used != this->SlotOf.size() || used + this->FreeSlots.size() != this->Slots.size())
  {
    return "used and free slots don't add up";
  }
  return this->Table.CheckInvariants();
}

} // namespace teravox
