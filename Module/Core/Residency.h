// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickLoader.h"
#include "BrickSource.h"
#include "PageTable.h"

#include <cstdint>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

namespace teravox
{

/// Where the rays come from, for the order in which bricks become visible: the eye in corner
/// coordinates of level 0, or for a parallel projection the direction of the rays; and what they
/// may meet.
struct ViewOrder
{
  bool Parallel = false;
  Double3 Eye{ 0, 0, 0 };
  Double3 Direction{ 0, 0, 1 };
  /// One box per level; levels without a box are in view as a whole. What lies outside costs a pass
  /// more where a ray meets it all the same.
  std::vector<BrickBox> InView;
};

/// What a pass reported. Missed bricks have page level 0, whatever was missing on the way to them.
struct Feedback
{
  struct Miss
  {
    BrickKey Key;
    std::uint32_t Weight = 0; ///< how visible: sum over rays of remaining transmittance, in 1/255
  };
  std::vector<Miss> Missed;
  std::vector<std::uint32_t> UsedSlots;
  std::vector<std::uint32_t> UsedBlocks;
};

/// What bricks and page blocks may take in main memory before they have a place on the GPU.
struct HostLimit
{
  std::uint64_t Bytes = ~std::uint64_t{ 0 };
  std::uint64_t BrickBytes = 0; ///< of each brick, overhead included
  std::uint64_t BlockBytes = 0; ///< of the ranges of each page block, likewise
};

/// What is to be carried out before the next pass, and what to load.
struct FramePlan
{
  struct Upload
  {
    std::uint32_t Slot = 0;
    BrickKey Key;
    BrickPointer Data;
  };
  std::vector<Upload> Uploads;
  std::vector<LoadRequest> Requests;
  /// Failures that are new in this step, for one message each.
  std::vector<LoadResult> Failures;
};

/// The one place where it is decided what is loaded, kept, evicted, uploaded: a deterministic
/// function of feedback, finished bricks and capacities. No I/O, no GL, no clock.
/// Thread: used by the render thread only.
///
/// Order and eviction. Each ray visits bricks by increasing *rank*: level first (levels grow with
/// view depth), then the Manhattan distance of the brick's index from the eye's. The *front* is the
/// smallest rank that a ray waits for: what lies before it is dead for this picture and goes first;
/// after that goes what is needed last. So an atlas of any size loads each brick about once.
///
/// A page block or brick isn't evicted in the step in which it was mapped.
class Residency
{
public:
  /// Requires: slots >= 2 (one is pinned by the coarsest brick); `table` outlives this object.
  Residency(PageTable& table, std::uint32_t slots);

  /// One step, between two passes. `limitUploads` bounds the uploads of the step (interactive
  /// mode).
  FramePlan Step(const Feedback& feedback, std::vector<LoadResult> finished, const ViewOrder& order,
    std::size_t limitUploads = ~std::size_t{ 0 });

  /// Forgets all failures of bricks and page blocks, so that they are asked for again.
  void RetryFailed();
  /// Page blocks whose ranges couldn't be read: nothing in them is known to be empty.
  std::size_t NumberOfFailedBlocks() const { return this->FailedBlocks.size(); }

  /// Hard: HeldBytes() stays below it, and no more is asked for than fits beside what is held.
  /// Requires: limit.Bytes >= the larger one of brick and block.
  void SetHostLimit(const HostLimit& limit) { this->Limit = limit; }

  /// The coarsest bricks, always wanted so that there is never a hole.
  void SetPinned(std::vector<BrickKey> bricks);

  std::uint32_t NumberOfSlots() const { return static_cast<std::uint32_t>(this->Slots.size()); }
  std::uint32_t SlotsInUse() const { return static_cast<std::uint32_t>(this->SlotOf.size()); }
  std::uint64_t NumberOfEvictions() const { return this->Evictions; }
  std::uint64_t NumberOfBlockEvictions() const { return this->BlockEvictions; }
  /// Bricks and page blocks that rays wait for and that aren't resident yet.
  std::size_t NumberOfMissing() const { return this->Missing; }
  bool IsResident(const BrickKey& brick) const { return this->SlotOf.count(brick) != 0; }
  /// The brick in a slot in use.
  const BrickKey& BrickInSlot(std::uint32_t slot) const { return this->Slots[slot].Key; }
  /// Of which levels bricks are resident.
  std::vector<bool> ResidentLevels() const;
  /// Bytes, as in the host limit, of bricks and page blocks that have arrived and wait for a place.
  std::uint64_t HeldBytes() const;

  std::string CheckInvariants() const;

private:
  struct Slot
  {
    BrickKey Key;
    bool Used = false;
    bool Pinned = false;
    std::uint64_t LastUsed = 0; ///< step number
    std::uint64_t MappedIn = 0;
  };
  struct BlockSlot
  {
    std::uint64_t LastUsed = 0;
    std::uint64_t MappedIn = 0;
  };
  using Rank = std::uint64_t;
  Rank RankOf(const BrickKey& brick, const ViewOrder& order) const;
  Rank NearestRank(const BrickKey& block, const ViewOrder& order) const;
  bool TakeSlot(Rank rank, const ViewOrder& order, std::uint32_t& slot);
  bool TakeBlockSlot(
    const BrickKey& wanted, bool front, const ViewOrder& order, std::uint32_t& slot);
  void UnmapBlockTree(const BrickKey& block);
  void Accept(std::vector<LoadResult> finished, FramePlan& plan);
  /// Which wish needs a key first, as an index in the order of the wishes.
  using FirstWish = std::unordered_map<BrickKey, std::size_t, BrickKeyHash>;
  bool DropHeld(const BrickKey* before, const FirstWish& neededBy);
  void KeepHostLimit(FramePlan& plan, const FirstWish& neededBy);
  std::uint64_t ChargeOf(const BrickKey& key) const
  {
    return key.PageLevel == 0 ? this->Limit.BrickBytes : this->Limit.BlockBytes;
  }

  PageTable& Table;
  std::vector<Slot> Slots;
  std::vector<std::uint32_t> FreeSlots;
  std::vector<BlockSlot> BlockSlots;
  std::unordered_map<BrickKey, std::uint32_t, BrickKeyHash> SlotOf;
  std::unordered_map<BrickKey, BrickPointer, BrickKeyHash> Arrived;
  std::unordered_map<BrickKey, std::shared_ptr<const std::vector<ValueRange>>, BrickKeyHash>
    ArrivedBlocks;
  HostLimit Limit;
  std::vector<BrickKey> Pinned;
  std::unordered_set<BrickKey, BrickKeyHash> FailedBlocks;
  std::unordered_set<BrickKey, BrickKeyHash> ProtectedBlocks;
  std::uint64_t StepNumber = 0;
  std::uint64_t Evictions = 0;
  std::uint64_t BlockEvictions = 0;
  std::size_t Missing = 0;
  Rank Front = 0;
};

} // namespace teravox
