// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PageTable.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <string>

namespace teravox
{

namespace
{
constexpr std::uint32_t Edge = PageBlockEdge;

std::uint32_t IndexInBlock(const BrickKey& key)
{
  return (key.X % Edge) + Edge * ((key.Y % Edge) + Edge * (key.Z % Edge));
}

// Rounded outwards, so that the float interval contains the double one.
float RoundDown(double v)
{
  const auto f = static_cast<float>(v);
  return f > v ? std::nextafter(f, -std::numeric_limits<float>::infinity()) : f;
}
float RoundUp(double v)
{
  const auto f = static_cast<float>(v);
  return f < v ? std::nextafter(f, std::numeric_limits<float>::infinity()) : f;
}

PageEntry MakeEntry(const ValueRange& range, bool isBrick)
{
  PageEntry entry;
  // A value beyond what a float holds has no pair; such a brick is an ordinary one.
  if (isBrick && range.IsSingle() &&
    std::abs(range.Min) <= static_cast<double>(std::numeric_limits<float>::max()))
  {
    entry.Word = PageEntry::Pack(PageEntry::Single, 0);
    entry.Low = static_cast<float>(range.Min);
    entry.High = static_cast<float>(range.Min - static_cast<double>(entry.Low));
    return entry;
  }
  entry.Low = RoundDown(range.Min);
  entry.High = RoundUp(range.Max);
  return entry;
}
} // namespace

PageTable::PageTable(const PyramidLayout& layout, std::uint32_t blockCapacity, std::uint32_t volume)
  : Layout_(layout)
  , Capacity(blockCapacity)
  , Volume(volume)
  , DirectorySize(static_cast<std::size_t>(layout.DirectoryEntries()))
  , Table(DirectorySize + std::size_t{ blockCapacity } * EntriesPerBlock)
  , SlotOwner(blockCapacity)
  , BlockChanged(blockCapacity, 0)
{
  assert(blockCapacity >= static_cast<std::uint32_t>(layout.PageDepth()));
  for (std::size_t i = 0; i < this->DirectorySize; ++i)
  {
    this->Table[i] = MakeEntry(ValueRange::Unknown(), false);
  }
}

void PageTable::SetDirectoryRanges(int level, const std::vector<ValueRange>& ranges)
{
  const auto base = static_cast<std::size_t>(this->Layout_.DirectoryBase(level));
  assert(base + ranges.size() <= this->DirectorySize);
  for (std::size_t i = 0; i < ranges.size(); ++i)
  {
    const std::uint32_t word = this->Table[base + i].Word;
    this->Table[base + i] = MakeEntry(ranges[i], false);
    this->Table[base + i].Word = word;
  }
  this->DirectoryChanged = true;
}

BrickKey PageTable::ParentBlock(const BrickKey& key)
{
  BrickKey parent = key;
  parent.PageLevel = static_cast<std::uint8_t>(key.PageLevel + 1);
  parent.X /= Edge;
  parent.Y /= Edge;
  parent.Z /= Edge;
  return parent;
}

std::optional<BrickKey> PageTable::FirstMissingBlock(const BrickKey& brick) const
{
  std::optional<BrickKey> missing;
  BrickKey key = brick;
  while (key.PageLevel < this->Layout_.PageDepth())
  {
    key = ParentBlock(key);
    if (!this->HasBlock(key))
    {
      missing = key;
    }
  }
  return missing;
}

std::optional<std::size_t> PageTable::Locate(const BrickKey& key) const
{
  const int depth = this->Layout_.PageDepth();
  if (key.PageLevel == depth)
  {
    const Int3 n = this->Layout_.Pages(key.Level, depth);
    return static_cast<std::size_t>(this->Layout_.DirectoryBase(key.Level) + key.X +
      n[0] * (key.Y + n[1] * std::int64_t{ key.Z }));
  }
  const auto block = this->Blocks.find(ParentBlock(key));
  if (block == this->Blocks.end())
  {
    return std::nullopt;
  }
  return this->BlockOffset(block->second.Slot) + IndexInBlock(key);
}

void PageTable::Touch(const BrickKey& key)
{
  if (key.PageLevel == this->Layout_.PageDepth())
  {
    this->DirectoryChanged = true;
    return;
  }
  const std::uint32_t slot = this->Blocks.at(ParentBlock(key)).Slot;
  if (this->BlockChanged[slot] == 0)
  {
    this->BlockChanged[slot] = 1;
    this->ChangedBlocks.push_back(slot);
  }
}

void PageTable::RefreshBrickEntry(const BrickKey& brick, PageEntry& entry) const
{
  if (entry.GetState() == PageEntry::Single)
  {
    return;
  }
  const auto slot = this->Bricks.find(brick);
  if (slot != this->Bricks.end())
  {
    entry.Word = PageEntry::Pack(PageEntry::Mapped, slot->second);
  }
  else
  {
    entry.Word = PageEntry::Pack(
      this->FailedBricks.count(brick) != 0 ? PageEntry::Failed : PageEntry::Unmapped, 0);
  }
}

void PageTable::MapBlock(
  const BrickKey& block, std::uint32_t slot, const std::vector<ValueRange>& ranges)
{
  assert(block.PageLevel >= 1 && slot < this->Capacity && !this->SlotOwner[slot]);
  assert(ranges.size() == EntriesPerBlock && !this->HasBlock(block));
  this->Blocks[block] = { slot };
  this->SlotOwner[slot] = block;
  const bool holdsBricks = block.PageLevel == 1;
  BrickKey child = block;
  child.PageLevel = static_cast<std::uint8_t>(block.PageLevel - 1);
  for (std::uint32_t i = 0; i < EntriesPerBlock; ++i)
  {
    PageEntry& entry = this->Table[this->BlockOffset(slot) + i];
    entry = MakeEntry(ranges[i], holdsBricks);
    child.X = block.X * Edge + i % Edge;
    child.Y = block.Y * Edge + i / Edge % Edge;
    child.Z = block.Z * Edge + i / (Edge * Edge);
    if (holdsBricks)
    {
      this->RefreshBrickEntry(child, entry);
    }
  }
  if (this->BlockChanged[slot] == 0)
  {
    this->BlockChanged[slot] = 1;
    this->ChangedBlocks.push_back(slot);
  }
  const std::optional<std::size_t> parent = this->Locate(block);
  assert(parent);
  this->Table[*parent].Word = PageEntry::Pack(PageEntry::Mapped, slot);
  this->Touch(block);
}

void PageTable::UnmapBlock(const BrickKey& block)
{
  const std::uint32_t slot = this->Blocks.at(block).Slot;
  const std::optional<std::size_t> parent = this->Locate(block);
  assert(parent);
  this->Table[*parent].Word = PageEntry::Pack(PageEntry::Unmapped, 0);
  this->Touch(block);
  this->SlotOwner[slot].reset();
  this->Blocks.erase(block);
}

std::vector<BrickKey> PageTable::ChildBlocks(const BrickKey& block) const
{
  std::vector<BrickKey> children;
  if (block.PageLevel < 2)
  {
    return children;
  }
  const std::size_t offset = this->BlockOffset(this->Blocks.at(block).Slot);
  for (std::uint32_t i = 0; i < EntriesPerBlock; ++i)
  {
    if (this->Table[offset + i].GetState() == PageEntry::Mapped)
    {
      children.push_back(*this->SlotOwner[this->Table[offset + i].Slot()]);
    }
  }
  return children;
}

std::optional<BrickKey> PageTable::BlockInSlot(std::uint32_t slot) const
{
  return this->SlotOwner[slot];
}

void PageTable::MapBrick(const BrickKey& brick, std::uint32_t slot)
{
  this->Bricks[brick] = slot;
  this->FailedBricks.erase(brick);
  if (const auto at = this->Locate(brick))
  {
    this->RefreshBrickEntry(brick, this->Table[*at]);
    this->Touch(brick);
  }
}

void PageTable::UnmapBrick(const BrickKey& brick)
{
  this->Bricks.erase(brick);
  if (const auto at = this->Locate(brick))
  {
    this->RefreshBrickEntry(brick, this->Table[*at]);
    this->Touch(brick);
  }
}

void PageTable::SetFailed(const BrickKey& brick)
{
  this->FailedBricks[brick] = true;
  if (const auto at = this->Locate(brick))
  {
    this->RefreshBrickEntry(brick, this->Table[*at]);
    this->Touch(brick);
  }
}

void PageTable::ClearFailed()
{
  const auto failed = std::move(this->FailedBricks);
  this->FailedBricks.clear();
  for (const auto& item : failed)
  {
    if (const auto at = this->Locate(item.first))
    {
      this->RefreshBrickEntry(item.first, this->Table[*at]);
      this->Touch(item.first);
    }
  }
}

std::optional<PageEntry> PageTable::Entry(const BrickKey& key) const
{
  const auto at = this->Locate(key);
  return at ? std::optional<PageEntry>(this->Table[*at]) : std::nullopt;
}

PageTable::Changes PageTable::TakeChanges()
{
  Changes changes;
  changes.Directory = this->DirectoryChanged;
  this->DirectoryChanged = false;
  changes.Blocks = std::move(this->ChangedBlocks);
  this->ChangedBlocks.clear();
  for (const std::uint32_t slot : changes.Blocks)
  {
    this->BlockChanged[slot] = 0;
  }
  std::sort(changes.Blocks.begin(), changes.Blocks.end());
  return changes;
}

std::string PageTable::CheckInvariants() const
{
  std::size_t mappedParents = 0;
  for (std::size_t i = 0; i < this->DirectorySize; ++i)
  {
    mappedParents += this->Table[i].GetState() == PageEntry::Mapped ? 1 : 0;
  }
  for (const auto& [key, info] : this->Blocks)
  {
    if (!this->SlotOwner[info.Slot] || *this->SlotOwner[info.Slot] != key)
    {
      return "the pool slot of " + key.ToString() + " belongs to another block";
    }
    const auto parent = this->Locate(key);
    if (!parent)
    {
      return "the parent of " + key.ToString() + " is not in the pool";
    }
    if (this->Table[*parent].GetState() != PageEntry::Mapped ||
      this->Table[*parent].Slot() != info.Slot)
    {
      return "the entry of " + key.ToString() + " does not point to its block";
    }
    for (std::uint32_t i = 0; i < EntriesPerBlock; ++i)
    {
      const PageEntry& entry = this->Table[this->BlockOffset(info.Slot) + i];
      BrickKey child = key;
      child.PageLevel = static_cast<std::uint8_t>(key.PageLevel - 1);
      child.X = key.X * Edge + i % Edge;
      child.Y = key.Y * Edge + i / Edge % Edge;
      child.Z = key.Z * Edge + i / (Edge * Edge);
      if (child.PageLevel >= 1)
      {
        mappedParents += entry.GetState() == PageEntry::Mapped ? 1 : 0;
        continue;
      }
      const auto slot = this->Bricks.find(child);
      const bool mapped = entry.GetState() == PageEntry::Mapped;
      if (entry.GetState() != PageEntry::Single &&
        (mapped != (slot != this->Bricks.end()) || (mapped && entry.Slot() != slot->second)))
      {
        return "the entry of " + child.ToString() + " contradicts the brick's slot";
      }
    }
  }
  return mappedParents == this->Blocks.size() ? "" : "an entry points to a block that isn't there";
}

} // namespace teravox
