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
// Unchanged entries between two runs; fewer are cheaper to send than another call.
constexpr std::size_t SmallestGap = std::size_t{ 2 } * Edge;

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
  , Directory(DirectorySize)
  , SlotOwner(blockCapacity)
  , Changed(Table.size(), false)
  , Sections(std::size_t{ blockCapacity } + 1)
{
  assert(blockCapacity >= static_cast<std::uint32_t>(layout.PageDepth()));
}

void PageTable::SetDirectoryRanges(int level, const std::vector<ValueRange>& ranges)
{
  const auto base = static_cast<std::size_t>(this->Layout_.DirectoryBase(level));
  assert(base + ranges.size() <= this->DirectorySize);
  std::transform(ranges.begin(), ranges.end(),
    this->Directory.begin() + static_cast<std::ptrdiff_t>(base),
    [](const ValueRange& range) { return MakeEntry(range, false); });
  this->ForEachInDirectory(level,
    [this](const BrickKey& region, std::size_t at)
    {
      if (this->IsInView(region) || this->Table[at].GetState() == PageEntry::Mapped)
      {
        this->WriteRange(at, this->Directory[at]);
      }
    });
}

void PageTable::SetView(const std::vector<BrickBox>& view)
{
  if (this->View && *this->View == view)
  {
    return;
  }
  this->View = view;
  const auto show = [this](const BrickKey& region, std::size_t at, const PageEntry& known)
  {
    if (this->IsInView(region))
    {
      this->WriteRange(at, known);
    }
  };
  for (int l = 0; l < this->Layout_.NumberOfLevels(); ++l)
  {
    this->ForEachInDirectory(
      l, [&](const BrickKey& region, std::size_t at) { show(region, at, this->Directory[at]); });
  }
  for (const auto& [key, info] : this->Blocks)
  {
    if (key.PageLevel >= 2)
    {
      const std::size_t offset = this->BlockOffset(info.Slot);
      const std::vector<PageEntry>& regions = info.Regions;
      this->ForEachChild(key,
        [&](const BrickKey& region, std::uint32_t index)
        { show(region, offset + index, regions[index]); });
    }
  }
}

bool PageTable::IsInView(const BrickKey& region) const
{
  if (!this->View)
  {
    return false;
  }
  if (region.Level >= this->View->size())
  {
    return true;
  }
  const BrickBox& box = (*this->View)[region.Level];
  // Whole regions: 8^20 bricks are more than any level has along an axis.
  const int shift = 3 * std::min<int>(region.PageLevel, 20);
  const std::array<std::int64_t, 3> at{ region.X, region.Y, region.Z };
  for (std::size_t a = 0; a < 3; ++a)
  {
    if (box.Low[a] >= box.High[a] || at[a] < box.Low[a] >> shift ||
      at[a] > (box.High[a] - 1) >> shift)
    {
      return false;
    }
  }
  return true;
}

const PageEntry& PageTable::Region(const BrickKey& region, std::size_t at) const
{
  return at < this->DirectorySize
    ? this->Directory[at]
    : this->Blocks.at(ParentBlock(region)).Regions[IndexInBlock(region)];
}

void PageTable::Write(std::size_t at, const PageEntry& entry)
{
  PageEntry& written = this->Table[at];
  if (written.Word != entry.Word || written.Low != entry.Low || written.High != entry.High)
  {
    written = entry;
    this->Touch(at);
  }
}

bool PageTable::WriteRange(std::size_t at, const PageEntry& region)
{
  PageEntry entry = region;
  entry.Word = this->Table[at].Word;
  const bool unknown = entry.Low != this->Table[at].Low || entry.High != this->Table[at].High;
  this->Write(at, entry);
  return unknown;
}

bool PageTable::Show(const BrickKey& region)
{
  const std::optional<std::size_t> at = this->Locate(region);
  assert(at && region.PageLevel >= 1);
  return this->WriteRange(*at, this->Region(region, *at));
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
  while (key.PageLevel < this->Layout_.PageDepth(key.Level))
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
  const int depth = this->Layout_.PageDepth(key.Level);
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

void PageTable::Touch(std::size_t entry)
{
  const std::size_t section =
    entry < this->DirectorySize ? 0 : 1 + (entry - this->DirectorySize) / EntriesPerBlock;
  this->Changed[entry] = true;
  ChangedSection& changed = this->Sections[section];
  if (changed.End == 0)
  {
    changed = { entry, entry + 1 };
    this->ChangedSections.push_back(section);
    return;
  }
  changed.First = std::min(changed.First, entry);
  changed.End = std::max(changed.End, entry + 1);
}

template <typename F>
void PageTable::ForEachInDirectory(int level, const F& f) const
{
  BrickKey region;
  region.Volume = this->Volume;
  region.Level = static_cast<std::uint8_t>(level);
  region.PageLevel = static_cast<std::uint8_t>(this->Layout_.PageDepth(level));
  const Int3 n = this->Layout_.Pages(level, region.PageLevel);
  auto at = static_cast<std::size_t>(this->Layout_.DirectoryBase(level));
  for (region.Z = 0; region.Z < n[2]; ++region.Z)
  {
    for (region.Y = 0; region.Y < n[1]; ++region.Y)
    {
      for (region.X = 0; region.X < n[0]; ++region.X)
      {
        f(region, at++);
      }
    }
  }
}

template <typename F>
void PageTable::ForEachChild(const BrickKey& block, const F& f) const
{
  // f(child, index in the block) for the children that lie in the volume.
  BrickKey child = block;
  child.PageLevel = static_cast<std::uint8_t>(block.PageLevel - 1);
  const Int3 pages = this->Layout_.Pages(block.Level, child.PageLevel);
  const auto end = [](std::uint32_t at, std::int64_t all)
  {
    return static_cast<std::uint32_t>(
      std::min<std::int64_t>(Edge, all - std::int64_t{ at } * Edge));
  };
  const std::uint32_t columns = end(block.X, pages[0]);
  const std::uint32_t rows = end(block.Y, pages[1]);
  const std::uint32_t slices = end(block.Z, pages[2]);
  for (std::uint32_t z = 0; z < slices; ++z)
  {
    for (std::uint32_t y = 0; y < rows; ++y)
    {
      for (std::uint32_t x = 0; x < columns; ++x)
      {
        child.X = block.X * Edge + x;
        child.Y = block.Y * Edge + y;
        child.Z = block.Z * Edge + z;
        f(child, x + Edge * (y + Edge * z));
      }
    }
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

void PageTable::Occupy(const BrickKey& block, std::uint32_t slot)
{
  assert(block.PageLevel >= 1 && slot < this->Capacity && !this->SlotOwner[slot]);
  assert(!this->HasBlock(block));
  this->Blocks[block] = { slot, {} };
  this->SlotOwner[slot] = block;
  const std::optional<std::size_t> parent = this->Locate(block);
  assert(parent);
  this->Show(block);
  this->Table[*parent].Word = PageEntry::Pack(PageEntry::Mapped, slot);
  this->Touch(*parent);
}

void PageTable::MapBlock(
  const BrickKey& block, std::uint32_t slot, const std::vector<ValueRange>& ranges)
{
  assert(ranges.size() == EntriesPerBlock);
  this->Occupy(block, slot);
  const std::size_t offset = this->BlockOffset(slot);
  if (block.PageLevel > 1)
  {
    std::vector<PageEntry>& regions = this->Blocks.at(block).Regions;
    regions.resize(EntriesPerBlock);
    this->ForEachChild(block,
      [&](const BrickKey& child, std::uint32_t index)
      {
        regions[index] = MakeEntry(ranges[index], false);
        this->Write(offset + index, this->IsInView(child) ? regions[index] : PageEntry());
      });
    return;
  }
  this->ForEachChild(block,
    [&](const BrickKey& child, std::uint32_t index)
    {
      PageEntry& entry = this->Table[offset + index];
      entry = MakeEntry(ranges[index], true);
      this->RefreshBrickEntry(child, entry);
      this->Touch(offset + index);
    });
}

void PageTable::UnmapBlock(const BrickKey& block)
{
  const std::uint32_t slot = this->Blocks.at(block).Slot;
  const std::optional<std::size_t> parent = this->Locate(block);
  assert(parent);
  this->Table[*parent].Word = PageEntry::Pack(PageEntry::Unmapped, 0);
  this->Touch(*parent);
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
  this->ForEachChild(block,
    [&](const BrickKey& child, std::uint32_t index)
    {
      if (this->Table[offset + index].GetState() == PageEntry::Mapped)
      {
        children.push_back(child);
      }
    });
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
    this->Touch(*at);
  }
}

void PageTable::UnmapBrick(const BrickKey& brick)
{
  this->Bricks.erase(brick);
  if (const auto at = this->Locate(brick))
  {
    this->RefreshBrickEntry(brick, this->Table[*at]);
    this->Touch(*at);
  }
}

void PageTable::SetFailed(const BrickKey& brick)
{
  this->FailedBricks[brick] = true;
  if (const auto at = this->Locate(brick))
  {
    this->RefreshBrickEntry(brick, this->Table[*at]);
    this->Touch(*at);
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
      this->Touch(*at);
    }
  }
}

std::optional<PageEntry> PageTable::Entry(const BrickKey& key) const
{
  const auto at = this->Locate(key);
  if (!at)
  {
    return std::nullopt;
  }
  PageEntry entry = this->Table[*at];
  if (key.PageLevel >= 1)
  {
    entry = this->Region(key, *at);
    entry.Word = this->Table[*at].Word;
  }
  return entry;
}

std::vector<PageTable::Change> PageTable::TakeChanges()
{
  std::sort(this->ChangedSections.begin(), this->ChangedSections.end());
  std::vector<Change> changes;
  for (const std::size_t section : this->ChangedSections)
  {
    ChangedSection& changed = this->Sections[section];
    std::size_t end = 0; // of the run in this section; 0: none yet
    for (std::size_t i = changed.First; i < changed.End; ++i)
    {
      if (!this->Changed[i])
      {
        continue;
      }
      this->Changed[i] = false;
      if (end != 0 && i - end < SmallestGap)
      {
        changes.back().Count = i + 1 - changes.back().First;
      }
      else
      {
        changes.push_back({ i, 1 });
      }
      end = i + 1;
    }
    changed = {};
  }
  this->ChangedSections.clear();
  return changes;
}

std::string PageTable::CheckInvariants() const
{
  std::size_t mappedParents = 0;
  std::string wrongRegion;
  const auto checkRegion = [&](const BrickKey& region, std::size_t at, const PageEntry& range)
  {
    const PageEntry& entry = this->Table[at];
    const bool mapped = entry.GetState() == PageEntry::Mapped;
    mappedParents += mapped ? 1 : 0;
    const bool known = entry.Low == range.Low && entry.High == range.High;
    const bool unknown =
      entry.Word == 0 && entry.Low == PageEntry().Low && entry.High == PageEntry().High;
    if (!known && (!unknown || this->IsInView(region)))
    {
      wrongRegion = "the range of " + region.ToString() + " isn't what was read";
    }
  };
  for (int l = 0; l < this->Layout_.NumberOfLevels(); ++l)
  {
    this->ForEachInDirectory(l,
      [&](const BrickKey& region, std::size_t at)
      { checkRegion(region, at, this->Directory[at]); });
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
    const BrickKey* wrong = nullptr;
    BrickKey found;
    const std::size_t offset = this->BlockOffset(info.Slot);
    const std::vector<PageEntry>& regions = info.Regions;
    this->ForEachChild(key,
      [&](const BrickKey& child, std::uint32_t index)
      {
        const PageEntry& entry = this->Table[offset + index];
        const bool mapped = entry.GetState() == PageEntry::Mapped;
        if (child.PageLevel >= 1)
        {
          checkRegion(child, offset + index, regions[index]);
          return;
        }
        const auto slot = this->Bricks.find(child);
        if (entry.GetState() != PageEntry::Single &&
          (mapped != (slot != this->Bricks.end()) || (mapped && entry.Slot() != slot->second)))
        {
          found = child;
          wrong = &found;
        }
      });
    if (wrong != nullptr)
    {
      return "the entry of " + wrong->ToString() + " contradicts the brick's slot";
    }
  }
  if (!wrongRegion.empty())
  {
    return wrongRegion;
  }
  return mappedParents == this->Blocks.size() ? "" : "an entry points to a block that isn't there";
}

} // namespace teravox
