// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickKey.h"
#include "PyramidLayout.h"
#include "Types.h"

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <unordered_map>
#include <vector>

namespace teravox
{

/// One entry as the GPU reads it, 12 bytes. The state and the slot (of a brick in the atlas, or of
/// a page block in the pool) lie in Word; beside them the range of the brick or of the whole
/// region. As default nothing is known of it.
struct PageEntry
{
  enum State : std::uint32_t
  {
    Unmapped = 0,
    Mapped = 1,
    Failed = 2, ///< can't be read; the renderer takes its finest readable ancestor
    Single = 3  ///< a brick of one value, Low + High (a float pair); never in the atlas
  };
  std::uint32_t Word = 0;
  float Low = -std::numeric_limits<float>::infinity();
  float High = std::numeric_limits<float>::infinity();

  static constexpr std::uint32_t SlotMask = 0x3fffffffu;
  static std::uint32_t Pack(State state, std::uint32_t slot) { return state << 30 | slot; }
  State GetState() const { return static_cast<State>(this->Word >> 30); }
  std::uint32_t Slot() const { return this->Word & SlotMask; }
};
static_assert(sizeof(PageEntry) == 12, "the GPU reads entries of three words");

/// Bricks of one level, [Low, High) along each axis; as default all of them.
struct BrickBox
{
  Int3 Low{ 0, 0, 0 };
  Int3 High{ std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::max(),
    std::numeric_limits<std::int64_t>::max() };

  bool operator==(const BrickBox& o) const { return this->Low == o.Low && this->High == o.High; }
};

/// Which brick lies in which slot: the page directory and a pool of page blocks, for one volume.
/// Multi-level, multi-resolution (Sarton 2018, section 3.3; Hadwiger et al. 2012). Only what is
/// resident costs memory: a block that leaves the pool loses nothing, because ranges come back with
/// the block and the slots of resident bricks are kept by brick.
/// Thread: used by the render thread only.
///
/// Entries of regions (page level >= 1) are written when they come into view: on the way from the
/// directory to a brick of a huge volume each block has 512 regions, of which a view meets a few.
/// Until then they read as unknown and unmapped, so that a ray that meets one asks for its brick.
///
/// Invariant: an entry of page level k >= 1 is Mapped if and only if the block below it is in the
/// pool; an entry of page level 0 in the pool is Mapped if and only if its brick has a slot.
class PageTable
{
public:
  /// Requires: blockCapacity >= layout.PageDepth(), so that one chain fits.
  PageTable(const PyramidLayout& layout, std::uint32_t blockCapacity, std::uint32_t volume = 0);

  static constexpr std::uint32_t EntriesPerBlock = PageBlockEdge * PageBlockEdge * PageBlockEdge;

  /// Ranges of the directory entries of one level, x fastest; as many as it has.
  void SetDirectoryRanges(int level, const std::vector<ValueRange>& ranges);

  /// The bricks that rays may meet, one box per level; levels without a box are in view as a whole.
  /// What was in view before stays written. Before the first call nothing is in view.
  void SetView(const std::vector<BrickBox>& view);
  /// Writes the entry of a region that a ray has met out of view. Returns whether it was unknown.
  /// Requires: page level >= 1, the block that holds the entry is in the pool.
  bool Show(const BrickKey& region);

  /// The block that holds the entry of this brick or region: the key one page level up.
  static BrickKey ParentBlock(const BrickKey& key);
  bool HasBlock(const BrickKey& block) const { return this->Blocks.count(block) != 0; }
  /// The topmost block on the way to the brick's entry that isn't in the pool; none if all are.
  std::optional<BrickKey> FirstMissingBlock(const BrickKey& brick) const;

  /// Puts a block into pool slot `slot`. `ranges` has EntriesPerBlock values; those outside of the
  /// volume are never addressed and not written.
  /// Requires: the slot is unused, the parent is in the pool (or is the directory).
  void MapBlock(const BrickKey& block, std::uint32_t slot, const std::vector<ValueRange>& ranges);
  /// Requires: HasBlock(block) and no block below it in the pool.
  void UnmapBlock(const BrickKey& block);
  /// Blocks of the pool directly below this one.
  std::vector<BrickKey> ChildBlocks(const BrickKey& block) const;
  std::uint32_t BlockSlot(const BrickKey& block) const { return this->Blocks.at(block).Slot; }
  std::optional<BrickKey> BlockInSlot(std::uint32_t slot) const;

  /// Records that the brick lies in an atlas slot, lies in none any more, or can't be read.
  void MapBrick(const BrickKey& brick, std::uint32_t slot);
  void UnmapBrick(const BrickKey& brick);
  void SetFailed(const BrickKey& brick);
  /// Forgets all failures, so that the bricks are asked for again.
  void ClearFailed();
  std::size_t NumberOfFailed() const { return this->FailedBricks.size(); }
  bool IsFailed(const BrickKey& brick) const { return this->FailedBricks.count(brick) != 0; }

  /// The entry of a brick or region, in view or not; none if its block isn't in the pool.
  std::optional<PageEntry> Entry(const BrickKey& key) const;

  const PyramidLayout& Layout() const { return this->Layout_; }
  std::uint32_t BlockCapacity() const { return this->Capacity; }
  std::uint32_t NumberOfBlocks() const { return static_cast<std::uint32_t>(this->Blocks.size()); }
  /// The whole table as the GPU holds it: directory, then the pool's blocks by slot. The GPU's copy
  /// begins with default entries.
  const std::vector<PageEntry>& Entries() const { return this->Table; }
  std::uint64_t SizeInBytes() const { return this->Table.size() * sizeof(PageEntry); }
  /// Index of the first entry of a pool slot in Entries().
  std::size_t BlockOffset(std::uint32_t slot) const
  {
    return this->DirectorySize + std::size_t{ slot } * EntriesPerBlock;
  }

  /// A run of entries in Entries(), inside of the directory or of one block.
  struct Change
  {
    std::size_t First = 0;
    std::size_t Count = 0;
  };
  /// What changed since the last call, in order. Runs that lie close together are one.
  std::vector<Change> TakeChanges();

  /// Recomputes the invariants from scratch; an empty text if they hold.
  std::string CheckInvariants() const;

private:
  struct BlockInfo
  {
    std::uint32_t Slot = 0;
    std::vector<PageEntry> Regions; ///< ranges of all entries, but for blocks of bricks
  };
  /// Where in the directory or in a block something changed.
  struct ChangedSection
  {
    std::size_t First = 0;
    std::size_t End = 0; ///< 0: nothing changed
  };
  std::optional<std::size_t> Locate(const BrickKey& key) const;
  void Touch(std::size_t entry);
  void Write(std::size_t at, const PageEntry& entry);
  bool WriteRange(std::size_t at, const PageEntry& region);
  bool IsInView(const BrickKey& region) const;
  const PageEntry& Region(const BrickKey& region, std::size_t at) const;
  template <typename F>
  void ForEachChild(const BrickKey& block, const F& f) const;
  template <typename F>
  void ForEachInDirectory(int level, const F& f) const;
  void Occupy(const BrickKey& block, std::uint32_t slot);
  void RefreshBrickEntry(const BrickKey& brick, PageEntry& entry) const;

  PyramidLayout Layout_;
  std::uint32_t Capacity = 0;
  std::uint32_t Volume = 0;
  std::size_t DirectorySize = 0;
  std::vector<PageEntry> Table;
  std::vector<PageEntry> Directory; // ranges of all entries
  std::optional<std::vector<BrickBox>> View;
  std::unordered_map<BrickKey, BlockInfo, BrickKeyHash> Blocks;
  std::vector<std::optional<BrickKey>> SlotOwner;
  std::unordered_map<BrickKey, std::uint32_t, BrickKeyHash> Bricks;
  std::unordered_map<BrickKey, bool, BrickKeyHash> FailedBricks;
  std::vector<bool> Changed;                // each entry
  std::vector<ChangedSection> Sections;     // the directory, then the blocks by slot
  std::vector<std::size_t> ChangedSections; // indices of those in which something changed
};

} // namespace teravox
