// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PageTable.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <map>
#include <optional>
#include <ostream>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace teravox
{

// Gives GoogleTest a printable and filterable name of the instance.
struct PageTableCase
{
  const char* Name;
  Int3 Dimensions;
  Double3 Spacing;
  int BrickSize;
};

static void PrintTo(const PageTableCase& c, std::ostream* out)
{
  *out << c.Name;
}

namespace
{
constexpr std::uint32_t Edge = PageBlockEdge;
constexpr double FloatMax = std::numeric_limits<float>::max();

PyramidLayout LayoutOf(const PageTableCase& c)
{
  return PyramidLayout::MakeDefault(c.Dimensions, c.Spacing, c.BrickSize).Value();
}

// Ranges of every kind, the same for a key each time it is asked: what a block brings back.
ValueRange RangeOf(const PyramidLayout& layout, const BrickKey& key)
{
  const Int3 pages = layout.Pages(key.Level, key.PageLevel);
  if (key.X >= pages[0] || key.Y >= pages[1] || key.Z >= pages[2])
  {
    return ValueRange::Void();
  }
  const std::uint64_t hash = BrickKeyHash()(key);
  const auto value = static_cast<double>(hash >> 40);
  switch (hash % 8)
  {
    case 0:
      return ValueRange::Unknown();
    case 1:
      return ValueRange::Void();
    case 2:
      return { value, value };
    case 3:
      return { -value / 3, -value / 3 };
    case 4:
      return { value / 7, value / 7 + 1e-9 };
    case 5:
      return { 4294967295.0 - value, 4294967295.0 };
    case 6:
      return { -1.7e308, 5e-324 };
    default:
      return { 0.1, std::numeric_limits<double>::infinity() };
  }
}

std::vector<ValueRange> RangesOf(const PyramidLayout& layout, const BrickKey& block)
{
  std::vector<ValueRange> ranges;
  BrickKey child = block;
  child.PageLevel = static_cast<std::uint8_t>(block.PageLevel - 1);
  for (std::uint32_t i = 0; i < PageTable::EntriesPerBlock; ++i)
  {
    child.X = block.X * Edge + i % Edge;
    child.Y = block.Y * Edge + i / Edge % Edge;
    child.Z = block.Z * Edge + i / Edge / Edge;
    ranges.push_back(RangeOf(layout, child));
  }
  return ranges;
}

BrickKey RandomBrick(const PyramidLayout& layout, std::mt19937_64& random)
{
  // Few places, so that blocks and bricks are met again.
  BrickKey key;
  key.Level = static_cast<std::uint8_t>(random() % layout.NumberOfLevels());
  const Int3& n = layout.Bricks(key.Level);
  const auto pick = [&](std::int64_t count)
  {
    const std::int64_t offset = std::min<std::int64_t>(count - 1, random() % 12);
    return static_cast<std::uint32_t>(random() % 2 == 0 ? offset : count - 1 - offset);
  };
  key.X = pick(n[0]);
  key.Y = pick(n[1]);
  key.Z = pick(n[2]);
  return key;
}

// What a page table is, without any of its data structures.
class NaiveTable
{
public:
  NaiveTable(const PyramidLayout& layout, std::uint32_t capacity)
    : Layout(layout)
    , Capacity(capacity)
  {
  }

  PyramidLayout Layout;
  std::uint32_t Capacity;
  std::map<BrickKey, std::uint32_t> Blocks;
  std::map<BrickKey, std::uint32_t> Bricks;
  std::set<BrickKey> Failed;

  bool Known(const BrickKey& key) const
  {
    return key.PageLevel == this->Layout.PageDepth(key.Level) ||
      this->Blocks.count(PageTable::ParentBlock(key)) != 0;
  }

  bool IsSingle(const BrickKey& brick) const
  {
    const ValueRange range = RangeOf(this->Layout, brick);
    return range.IsSingle() && std::abs(range.Min) <= FloatMax;
  }

  std::uint32_t Word(const BrickKey& key) const
  {
    if (key.PageLevel > 0)
    {
      const auto block = this->Blocks.find(key);
      return block == this->Blocks.end() ? 0 : PageEntry::Pack(PageEntry::Mapped, block->second);
    }
    if (this->IsSingle(key))
    {
      return PageEntry::Pack(PageEntry::Single, 0);
    }
    const auto brick = this->Bricks.find(key);
    return brick != this->Bricks.end() ? PageEntry::Pack(PageEntry::Mapped, brick->second)
      : this->Failed.count(key) != 0   ? PageEntry::Pack(PageEntry::Failed, 0)
                                       : 0;
  }

  std::optional<std::uint32_t> FreeSlot() const
  {
    std::set<std::uint32_t> used;
    for (const auto& block : this->Blocks)
    {
      used.insert(block.second);
    }
    for (std::uint32_t s = 0; s < this->Capacity; ++s)
    {
      if (used.count(s) == 0)
      {
        return s;
      }
    }
    return std::nullopt;
  }

  std::vector<BrickKey> Leaves() const
  {
    std::set<BrickKey> parents;
    for (const auto& block : this->Blocks)
    {
      parents.insert(PageTable::ParentBlock(block.first));
    }
    std::vector<BrickKey> leaves;
    for (const auto& block : this->Blocks)
    {
      if (parents.count(block.first) == 0)
      {
        leaves.push_back(block.first);
      }
    }
    return leaves;
  }
};

// Random steps on a table and on the model; what the GPU would hold follows by the changes alone.
class Walk
{
public:
  Walk(const PyramidLayout& layout, std::uint32_t capacity, std::uint64_t seed)
    : Table(layout, capacity)
    , Model(layout, capacity)
    , Random(seed)
    , Shadow(Table.Entries().size()) // what the GPU begins with
  {
    for (int l = 0; l < layout.NumberOfLevels(); ++l)
    {
      Table.SetDirectoryRanges(l, this->DirectoryRanges(l));
    }
    EXPECT_TRUE(Table.TakeChanges().empty()) << "nothing is in view";
    EXPECT_EQ(Table.CheckInvariants(), "");
  }

  void Step()
  {
    this->Allowed.clear();
    this->AllowedDirectory = false;
    const BrickKey brick = RandomBrick(Model.Layout, Random);
    switch (Random() % 10)
    {
      case 0:
      case 1:
      case 2:
        this->MapMissingBlock(brick);
        break;
      case 3:
        this->UnmapLeaf();
        break;
      case 4:
      case 5:
        this->MapBrick(brick);
        break;
      case 6:
        this->UnmapBrick();
        break;
      case 7:
        this->LookElsewhere();
        break;
      case 8:
        this->Show(brick);
        break;
      default:
        this->Fail(brick);
    }
    this->Compare(brick);
  }

  void CompareAll() const
  {
    for (const auto& block : Model.Blocks)
    {
      BrickKey child = block.first;
      child.PageLevel = static_cast<std::uint8_t>(block.first.PageLevel - 1);
      const Int3 pages = Model.Layout.Pages(child.Level, child.PageLevel);
      for (std::uint32_t i = 0; i < PageTable::EntriesPerBlock; ++i)
      {
        child.X = block.first.X * Edge + i % Edge;
        child.Y = block.first.Y * Edge + i / Edge % Edge;
        child.Z = block.first.Z * Edge + i / Edge / Edge;
        const bool inside = child.X < pages[0] && child.Y < pages[1] && child.Z < pages[2];
        ASSERT_TRUE(!inside || this->SameEntry(child)) << child.ToString();
      }
    }
    for (const auto& brick : Model.Bricks)
    {
      ASSERT_TRUE(this->SameEntry(brick.first)) << brick.first.ToString();
    }
  }

  PageTable Table;
  NaiveTable Model;
  std::size_t MostBlocks = 0;
  std::size_t BricksMapped = 0;
  std::size_t RegionsHidden = 0; ///< met while they were out of view, and unknown
  std::size_t RegionsShown = 0;  ///< one by one

private:
  std::vector<ValueRange> DirectoryRanges(int level) const
  {
    const int depth = Model.Layout.PageDepth(level);
    const Int3 n = Model.Layout.Pages(level, depth);
    std::vector<ValueRange> ranges;
    BrickKey key;
    key.Level = static_cast<std::uint8_t>(level);
    key.PageLevel = static_cast<std::uint8_t>(depth);
    for (key.Z = 0; key.Z < n[2]; ++key.Z)
    {
      for (key.Y = 0; key.Y < n[1]; ++key.Y)
      {
        for (key.X = 0; key.X < n[0]; ++key.X)
        {
          ranges.push_back(RangeOf(Model.Layout, key));
        }
      }
    }
    return ranges;
  }

  // The entry of this key may change in this step.
  void Allow(const BrickKey& key)
  {
    if (key.PageLevel == Model.Layout.PageDepth(key.Level))
    {
      this->AllowedDirectory = true;
    }
    else if (Model.Known(key))
    {
      this->Allowed.insert(Model.Blocks.at(PageTable::ParentBlock(key)));
    }
  }

  void MapMissingBlock(const BrickKey& brick)
  {
    const auto missing = Table.FirstMissingBlock(brick);
    const auto slot = Model.FreeSlot();
    BrickKey expected = brick;
    bool found = false;
    for (BrickKey key = brick; key.PageLevel < Model.Layout.PageDepth(key.Level);)
    {
      key = PageTable::ParentBlock(key);
      if (Model.Blocks.count(key) == 0)
      {
        expected = key;
        found = true;
      }
    }
    ASSERT_EQ(missing.has_value(), found);
    if (found && slot)
    {
      ASSERT_EQ(*missing, expected);
      Table.MapBlock(expected, *slot, RangesOf(Model.Layout, expected));
      Model.Blocks[expected] = *slot;
      this->MostBlocks = std::max(this->MostBlocks, Model.Blocks.size());
      this->Allowed.insert(*slot);
      this->Allow(expected);
    }
  }

  void UnmapLeaf()
  {
    const std::vector<BrickKey> leaves = Model.Leaves();
    if (!leaves.empty())
    {
      const BrickKey block = leaves[Random() % leaves.size()];
      this->Allow(block);
      EXPECT_TRUE(Table.ChildBlocks(block).empty());
      Table.UnmapBlock(block);
      Model.Blocks.erase(block);
    }
  }

  void MapBrick(const BrickKey& brick)
  {
    if (Model.Bricks.count(brick) == 0 && !Model.IsSingle(brick))
    {
      const std::uint32_t slot = this->NextSlot++;
      this->Allow(brick);
      Table.MapBrick(brick, slot);
      Model.Bricks[brick] = slot;
      ++this->BricksMapped;
      Model.Failed.erase(brick);
    }
  }

  void UnmapBrick()
  {
    if (!Model.Bricks.empty())
    {
      auto at = Model.Bricks.begin();
      std::advance(at, Random() % Model.Bricks.size());
      this->Allow(at->first);
      Table.UnmapBrick(at->first);
      Model.Bricks.erase(at);
    }
  }

  void Fail(const BrickKey& brick)
  {
    if (Random() % 50 == 0)
    {
      for (const BrickKey& key : Model.Failed)
      {
        this->Allow(key);
      }
      Table.ClearFailed();
      Model.Failed.clear();
    }
    else if (Model.Bricks.count(brick) == 0)
    {
      this->Allow(brick);
      Table.SetFailed(brick);
      Model.Failed.insert(brick);
    }
  }

  // Boxes around a few bricks of some levels; others are in view as a whole, or not at all.
  void LookElsewhere()
  {
    const PyramidLayout& layout = Model.Layout;
    this->View.assign(Random() % static_cast<std::size_t>(layout.NumberOfLevels() + 1),
      BrickBox{ { 0, 0, 0 }, { 0, 0, 0 } });
    for (BrickBox& box : this->View)
    {
      const BrickKey corner = RandomBrick(layout, Random);
      const Int3 at{ corner.X, corner.Y, corner.Z };
      for (std::size_t a = 0; a < 3 && Random() % 8 != 0; ++a)
      {
        box.Low[a] = at[a];
        box.High[a] = at[a] + static_cast<std::int64_t>(Random() % 40);
      }
    }
    Table.SetView(this->View);
    this->HasView = true;
    this->AllowedDirectory = true;
    for (const auto& block : Model.Blocks)
    {
      if (block.first.PageLevel >= 2)
      {
        this->Allowed.insert(block.second);
      }
    }
  }

  void Show(const BrickKey& brick)
  {
    for (BrickKey key = brick; key.PageLevel < Model.Layout.PageDepth(key.Level);)
    {
      key = PageTable::ParentBlock(key);
      if (Model.Known(key) && Random() % 2 == 0)
      {
        this->Allow(key);
        this->RegionsShown += Table.Show(key) ? 1 : 0;
        EXPECT_FALSE(Table.Show(key));
        EXPECT_TRUE(this->IsWritten(key));
      }
    }
  }

  bool IsInView(const BrickKey& region) const
  {
    const std::size_t level = region.Level;
    if (!this->HasView || level >= this->View.size())
    {
      return this->HasView;
    }
    const double edge = std::pow(8.0, region.PageLevel);
    const std::array<double, 3> at{ edge * region.X, edge * region.Y, edge * region.Z };
    bool in = true;
    for (std::size_t a = 0; a < 3; ++a)
    {
      const auto low = static_cast<double>(this->View[level].Low[a]);
      const auto high = static_cast<double>(this->View[level].High[a]);
      in = in && low < high && at[a] < high && at[a] + edge > low;
    }
    return in;
  }

  // Does the GPU know the range of a region?
  bool IsWritten(const BrickKey& region) const
  {
    std::size_t at = 0;
    if (region.PageLevel == Model.Layout.PageDepth(region.Level))
    {
      const Int3 n = Model.Layout.Pages(region.Level, region.PageLevel);
      at = static_cast<std::size_t>(Model.Layout.DirectoryBase(region.Level) + region.X +
        n[0] * (region.Y + n[1] * std::int64_t{ region.Z }));
    }
    else
    {
      at = Table.BlockOffset(Model.Blocks.at(PageTable::ParentBlock(region))) + region.X % Edge +
        Edge * (region.Y % Edge + Edge * (region.Z % Edge));
    }
    const PageEntry& written = Table.Entries()[at];
    const PageEntry entry = *Table.Entry(region);
    if (written.Low == entry.Low && written.High == entry.High)
    {
      return written.Word == entry.Word;
    }
    EXPECT_EQ(std::memcmp(&written, &Unknown, sizeof(PageEntry)), 0) << region.ToString();
    return false;
  }

  // What the table knows of a region, and what of that it has told the GPU.
  void CompareRegion(const BrickKey& region)
  {
    const ValueRange range = RangeOf(Model.Layout, region);
    const PageEntry entry = *Table.Entry(region);
    ASSERT_EQ(entry.Low > entry.High, range.IsVoid());
    ASSERT_LE(static_cast<double>(entry.Low), range.Min);
    ASSERT_GE(static_cast<double>(entry.High), range.Max);
    const bool written = this->IsWritten(region);
    ASSERT_TRUE(written || !this->IsInView(region)) << region.ToString();
    this->RegionsHidden += written ? 0 : 1;
  }

  bool SameEntry(const BrickKey& key) const
  {
    const auto entry = Table.Entry(key);
    return entry.has_value() == Model.Known(key) && (!entry || entry->Word == Model.Word(key));
  }

  void Replay(const std::vector<PageTable::Change>& changes)
  {
    for (const PageTable::Change& change : changes)
    {
      std::copy_n(Table.Entries().begin() + static_cast<std::ptrdiff_t>(change.First), change.Count,
        this->Shadow.begin() + static_cast<std::ptrdiff_t>(change.First));
    }
  }

  void Compare(const BrickKey& brick)
  {
    ASSERT_EQ(Table.CheckInvariants(), "");
    for (BrickKey key = brick;; key = PageTable::ParentBlock(key))
    {
      ASSERT_TRUE(this->SameEntry(key)) << key.ToString();
      if (key.PageLevel >= 1 && Model.Known(key))
      {
        this->CompareRegion(key);
      }
      if (key.PageLevel == Model.Layout.PageDepth(key.Level))
      {
        break;
      }
      ASSERT_EQ(Table.HasBlock(PageTable::ParentBlock(key)), Model.Known(key));
    }
    ASSERT_EQ(Table.NumberOfBlocks(), Model.Blocks.size());
    ASSERT_EQ(Table.NumberOfFailed(), Model.Failed.size());
    ASSERT_EQ(Table.IsFailed(brick), Model.Failed.count(brick) != 0);

    // Nothing that changed is kept back, and nothing else is sent.
    const std::vector<PageTable::Change> changes = Table.TakeChanges();
    std::size_t end = 0;
    for (const PageTable::Change& change : changes)
    {
      ASSERT_TRUE(change.Count > 0 && change.First >= end);
      end = change.First + change.Count;
      if (end <= Table.BlockOffset(0))
      {
        ASSERT_TRUE(this->AllowedDirectory);
        continue;
      }
      const auto slot = static_cast<std::uint32_t>(
        (change.First - Table.BlockOffset(0)) / PageTable::EntriesPerBlock);
      ASSERT_GE(change.First, Table.BlockOffset(slot));
      ASSERT_LE(end, Table.BlockOffset(slot + 1));
      ASSERT_EQ(this->Allowed.count(slot), 1u);
    }
    this->Replay(changes);
    ASSERT_EQ(std::memcmp(this->Shadow.data(), Table.Entries().data(), Table.SizeInBytes()), 0);
    ASSERT_TRUE(Table.TakeChanges().empty());
  }

  std::mt19937_64 Random;
  std::vector<PageEntry> Shadow;
  std::set<std::uint32_t> Allowed;
  bool AllowedDirectory = false;
  std::uint32_t NextSlot = 0;
  std::vector<BrickBox> View;
  bool HasView = false;
  const PageEntry Unknown;
};

class PageTableWalk : public testing::TestWithParam<PageTableCase>
{
};

// One entry for a range, as brick and as region.
PageEntry EntryOf(const ValueRange& range, int pageLevel = 0)
{
  const PyramidLayout layout = PyramidLayout::MakeDefault({ 64, 64, 64 }, { 1, 1, 1 }, 8).Value();
  PageTable table(layout, 4);
  BrickKey key;
  if (pageLevel > 0)
  {
    table.SetDirectoryRanges(0, { range });
    key.PageLevel = 1;
    return *table.Entry(key);
  }
  std::vector<ValueRange> ranges(PageTable::EntriesPerBlock, ValueRange::Void());
  ranges[0] = range;
  table.MapBlock(PageTable::ParentBlock(key), 0, ranges);
  return *table.Entry(key);
}

const std::vector<double> Extremes{ 0.0, 1.0, -1.0, 0.1, -0.1, 255.0, 65535.0, 16777217.0,
  4294967295.0, -2147483648.0, 1e-30, 1e-45, 5e-324, -5e-324, 1e30, FloatMax, FloatMax * 1.0000001,
  1e300, 1.7976931348623157e308, -1.7976931348623157e308, std::numeric_limits<double>::infinity(),
  -std::numeric_limits<double>::infinity() };
} // namespace

TEST_P(PageTableWalk, EqualsANaiveModelAfterEachOfTenThousandSteps)
{
  const PyramidLayout layout = LayoutOf(GetParam());
  const auto least = static_cast<std::uint32_t>(layout.PageDepth());
  for (const std::uint32_t capacity : { least, least + 4 })
  {
    Walk walk(layout, capacity, 4711 + capacity);
    for (int i = 0; i < 10000 && !testing::Test::HasFatalFailure(); ++i)
    {
      walk.Step();
      if (i % 1000 == 0)
      {
        walk.CompareAll();
      }
    }
    EXPECT_GT(walk.MostBlocks, 0u);
    EXPECT_GT(walk.RegionsHidden, 0u);
    EXPECT_TRUE(walk.RegionsShown > 0 || layout.PageDepth() == 1);
    EXPECT_GT(walk.BricksMapped, 0u);
  }
}

INSTANTIATE_TEST_SUITE_P(Layouts, PageTableWalk,
  testing::Values(PageTableCase{ "Deep", { 1 << 30, 1 << 30, 1 << 30 }, { 1, 1, 1 }, 32 },
    PageTableCase{ "Flat", { 64000, 50000, 114 }, { 1, 1, 1 }, 32 },
    PageTableCase{ "Anisotropic", { 700, 900, 120 }, { 1, 1, 5 }, 16 },
    PageTableCase{ "OneBrick", { 20, 31, 32 }, { 1, 1, 1 }, 32 }),
  [](const testing::TestParamInfo<PageTableCase>& instance)
  { return std::string(instance.param.Name); });

TEST(PageTable, TheDeepTableIsDeep)
{
  const PyramidLayout layout =
    PyramidLayout::MakeDefault({ 1 << 30, 1 << 30, 1 << 30 }, { 1, 1, 1 }, 32).Value();
  EXPECT_GE(layout.PageDepth(), 4);
  // What a 2^30 volume costs before anything is resident: a directory and the pool.
  const PageTable table(layout, 64);
  EXPECT_LT(table.SizeInBytes(), 64u * 1024 * 7 + 12u * 4096);
}

TEST(PageTable, RangesAreRoundedOutwards)
{
  std::mt19937_64 random(17);
  std::vector<double> values = Extremes;
  for (int i = 0; i < 200; ++i)
  {
    const double mantissa = static_cast<double>(random() >> 11) / 4503599627370496.0 - 1;
    values.push_back(std::ldexp(mantissa, static_cast<int>(random() % 2000) - 1000));
  }
  for (const double low : values)
  {
    for (const double high : values)
    {
      if (low < high)
      {
        for (const int pageLevel : { 0, 1 })
        {
          const PageEntry entry = EntryOf({ low, high }, pageLevel);
          ASSERT_EQ(entry.GetState(), PageEntry::Unmapped);
          ASSERT_LE(static_cast<double>(entry.Low), low);
          ASSERT_GE(static_cast<double>(entry.High), high);
          // By no more than one float.
          ASSERT_GE(static_cast<double>(std::nextafter(entry.Low, HUGE_VALF)), low);
          ASSERT_LE(static_cast<double>(std::nextafter(entry.High, -HUGE_VALF)), high);
        }
      }
    }
  }
}

TEST(PageTable, VoidAndUnknownStayWhatTheyAre)
{
  for (const int pageLevel : { 0, 1 })
  {
    const PageEntry nothing = EntryOf(ValueRange::Void(), pageLevel);
    EXPECT_GT(nothing.Low, nothing.High);
    const PageEntry unknown = EntryOf(ValueRange::Unknown(), pageLevel);
    EXPECT_EQ(unknown.Low, -HUGE_VALF);
    EXPECT_EQ(unknown.High, HUGE_VALF);
  }
}

TEST(PageTable, SingleValuesAreExactToFortySevenBits)
{
  std::mt19937_64 random(18);
  std::vector<double> values{ 0.0, 1.0, -1.0, 0.1, 255.0, 65535.0, 4294967295.0, 4294967294.0,
    -2147483648.0, 2147483647.0, 1e-20, 1e30, -1e30, FloatMax };
  for (int i = 0; i < 1000; ++i)
  {
    const double mantissa = static_cast<double>(random() >> 11) / 4503599627370496.0 - 1;
    values.push_back(std::ldexp(mantissa, static_cast<int>(random() % 150) - 70));
    values.push_back(static_cast<double>(random() >> 32));
  }
  for (const double value : values)
  {
    const PageEntry entry = EntryOf({ value, value });
    ASSERT_EQ(entry.GetState(), PageEntry::Single) << value;
    const double back = static_cast<double>(entry.Low) + static_cast<double>(entry.High);
    ASSERT_LE(std::abs(back - value), std::ldexp(std::abs(value), -47)) << value;
    if (value == std::floor(value) && std::abs(value) <= 4294967295.0)
    {
      ASSERT_EQ(back, value);
    }
  }
  // A region of one value isn't a brick of one value: its bricks have entries of their own.
  EXPECT_EQ(EntryOf({ 7, 7 }, 1).GetState(), PageEntry::Unmapped);
}

TEST(PageTable, SingleValuesBeyondFloatAreOrdinaryBricks)
{
  for (const double value : { 1e39, -1e39, 1.7976931348623157e308, -1.7976931348623157e308 })
  {
    const PageEntry entry = EntryOf({ value, value });
    EXPECT_EQ(entry.GetState(), PageEntry::Unmapped) << value;
    EXPECT_LE(static_cast<double>(entry.Low), value);
    EXPECT_GE(static_cast<double>(entry.High), value);
  }
}

TEST(PageTable, BlocksThatComeBackBringTheirBricks)
{
  const PyramidLayout layout =
    PyramidLayout::MakeDefault({ 4096, 4096, 4096 }, { 1, 1, 1 }, 8).Value();
  ASSERT_GE(layout.PageDepth(), 2);
  PageTable table(layout, static_cast<std::uint32_t>(layout.PageDepth()));
  BrickKey resident;
  BrickKey failed;
  // Neither may be of one value, whose entry says all there is to say.
  while (RangeOf(layout, resident).IsSingle())
  {
    ++resident.X;
  }
  failed.Y = 1;
  while (RangeOf(layout, failed).IsSingle())
  {
    ++failed.X;
  }
  table.MapBrick(resident, 77); // before its block is known
  table.SetFailed(failed);
  EXPECT_FALSE(table.Entry(resident).has_value());
  std::vector<PageEntry> before;
  for (int round = 0; round < 3; ++round)
  {
    std::uint32_t slot = 0;
    while (const auto missing = table.FirstMissingBlock(resident))
    {
      table.MapBlock(*missing, slot++, RangesOf(layout, *missing));
    }
    ASSERT_EQ(table.CheckInvariants(), "");
    ASSERT_EQ(table.Entry(resident)->Word, PageEntry::Pack(PageEntry::Mapped, 77));
    ASSERT_EQ(table.Entry(failed)->GetState(), PageEntry::Failed);
    if (round > 0)
    {
      ASSERT_EQ(std::memcmp(before.data(), table.Entries().data(), table.SizeInBytes()), 0);
    }
    before = table.Entries();
    BrickKey block = PageTable::ParentBlock(resident);
    while (block.PageLevel <= layout.PageDepth())
    {
      table.UnmapBlock(block);
      block = PageTable::ParentBlock(block);
    }
    ASSERT_EQ(table.NumberOfBlocks(), 0u);
    ASSERT_EQ(table.CheckInvariants(), "");
  }
}

TEST(PageTable, ChildBlocksAreThoseInThePool)
{
  const PyramidLayout layout =
    PyramidLayout::MakeDefault({ 1 << 20, 1 << 20, 1 << 20 }, { 1, 1, 1 }, 32).Value();
  ASSERT_GE(layout.PageDepth(), 2);
  PageTable table(layout, 16);
  std::uint32_t slot = 0;
  std::set<BrickKey> expected;
  BrickKey top;
  for (const std::uint32_t x : { 0u, 8u, 16u, 63u })
  {
    BrickKey brick;
    brick.X = x;
    brick.Y = x / 2;
    while (const auto missing = table.FirstMissingBlock(brick))
    {
      table.MapBlock(*missing, slot++, RangesOf(layout, *missing));
    }
    expected.insert(PageTable::ParentBlock(brick));
    top = PageTable::ParentBlock(PageTable::ParentBlock(brick));
  }
  const std::vector<BrickKey> children = table.ChildBlocks(top);
  EXPECT_EQ(std::set<BrickKey>(children.begin(), children.end()), expected);
  EXPECT_EQ(children.size(), expected.size());
  for (const BrickKey& child : children)
  {
    EXPECT_EQ(table.BlockInSlot(table.BlockSlot(child)), child);
  }
}

} // namespace teravox
