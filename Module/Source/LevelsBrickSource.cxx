// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "LevelsBrickSource.h"

#include "Downsampling.h"
#include "Guarded.h"
#include "ScanVoxels.h"
#include "WaitScope.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace teravox
{

namespace
{
constexpr std::int64_t CellEdge = 8;
constexpr int MostLeases = 4; // threads that hold a block of a given level to make others of it

std::string Text(const Int3& v)
{
  return std::to_string(v[0]) + " x " + std::to_string(v[1]) + " x " + std::to_string(v[2]);
}

/// Calls f(index) for each index in [low, high), x fastest, until one fails.
template <typename F>
Status ForEach(const Int3& low, const Int3& high, const F& f)
{
  Int3 index{};
  for (index[2] = low[2]; index[2] < high[2]; ++index[2])
  {
    for (index[1] = low[1]; index[1] < high[1]; ++index[1])
    {
      for (index[0] = low[0]; index[0] < high[0]; ++index[0])
      {
        const Status status = f(index);
        if (!status)
        {
          return status;
        }
      }
    }
  }
  return {};
}

/// Copies `from`, which covers the box `inside`, to `to`, which covers `all`; voxels of `all` that
/// lie outside of `inside` become the nearest ones inside.
void CopyClamped(const VoxelBox& inside, const std::byte* from, const VoxelBox& all, std::byte* to,
  std::size_t voxelBytes)
{
  const Int3 size = inside.Size();
  const auto clamped = [&](std::int64_t v, std::size_t a)
  { return std::clamp(v, inside.Low[a], inside.High[a] - 1) - inside.Low[a]; };
  const std::int64_t low = std::clamp(inside.Low[0], all.Low[0], all.High[0]);
  const std::int64_t high = std::clamp(inside.High[0], low, all.High[0]);
  for (std::int64_t z = all.Low[2]; z < all.High[2]; ++z)
  {
    for (std::int64_t y = all.Low[1]; y < all.High[1]; ++y)
    {
      const std::byte* const row = from +
        static_cast<std::size_t>((clamped(z, 2) * size[1] + clamped(y, 1)) * size[0]) * voxelBytes;
      const auto copy = [&](std::int64_t x, std::int64_t count)
      {
        const auto bytes = static_cast<std::size_t>(count) * voxelBytes;
        std::memcpy(to, row + static_cast<std::size_t>(clamped(x, 0)) * voxelBytes, bytes);
        to += bytes;
      };
      for (std::int64_t x = all.Low[0]; x < low; ++x)
      {
        copy(x, 1);
      }
      copy(low, high - low);
      for (std::int64_t x = high; x < all.High[0]; ++x)
      {
        copy(x, 1);
      }
    }
  }
}

/// The part of two dense arrays that both have.
void CopyCommon(const VoxelBox& source, const std::byte* from, const VoxelBox& target,
  std::byte* to, std::size_t voxelBytes)
{
  VoxelBox common;
  for (std::size_t a = 0; a < 3; ++a)
  {
    common.Low[a] = std::max(source.Low[a], target.Low[a]);
    common.High[a] = std::min(source.High[a], target.High[a]);
  }
  if (common.IsEmpty())
  {
    return;
  }
  const auto offset = [&](const VoxelBox& box, std::int64_t y, std::int64_t z)
  {
    const Int3 size = box.Size();
    return static_cast<std::size_t>(
             ((z - box.Low[2]) * size[1] + y - box.Low[1]) * size[0] + common.Low[0] - box.Low[0]) *
      voxelBytes;
  };
  const auto bytes = static_cast<std::size_t>(common.Size()[0]) * voxelBytes;
  for (std::int64_t z = common.Low[2]; z < common.High[2]; ++z)
  {
    for (std::int64_t y = common.Low[1]; y < common.High[1]; ++y)
    {
      std::memcpy(to + offset(target, y, z), from + offset(source, y, z), bytes);
    }
  }
}

Status CheckDescription(const LevelsDescription& levels)
{
  const auto refuse = [&](const std::string& why)
  { return Status(StatusCode::InvalidArgument, levels.Name + " can't be drawn: " + why); };
  if (!levels.Read)
  {
    return refuse("there is no function that reads it.");
  }
  if (levels.Levels.empty())
  {
    return refuse("it has no level.");
  }
  if (levels.Levels.front().Factor != Int3{ 1, 1, 1 })
  {
    return refuse("its first level must have the factor 1 on each axis.");
  }
  if (levels.Components < 1 || levels.Components > 4)
  {
    return refuse(
      "it has " + std::to_string(levels.Components) + " components; 1 to 4 are possible.");
  }
  for (const double edge : levels.Spacing)
  {
    if (!(edge > 0) || !std::isfinite(edge))
    {
      return refuse("its spacing must be positive and finite on each axis.");
    }
  }
  return {};
}

/// Given levels must be the first one's size by their factors, rounded up or down.
Status CheckSizes(const LevelsDescription& levels, const PyramidLayout& layout)
{
  for (std::size_t l = 0; l < levels.Levels.size(); ++l)
  {
    const Int3& has = levels.Levels[l].Dimensions;
    const Int3& up = layout.Dimensions(static_cast<int>(l));
    for (std::size_t a = 0; a < 3; ++a)
    {
      const std::int64_t down = levels.Levels.front().Dimensions[a] / levels.Levels[l].Factor[a];
      if (has[a] != up[a] && (has[a] != down || has[a] < 1))
      {
        return Status(StatusCode::InvalidArgument,
          "Level " + std::to_string(l) + " of " + levels.Name + " has " + Text(has) + " voxels; " +
            Text(levels.Levels.front().Dimensions) + " by a factor of " +
            Text(levels.Levels[l].Factor) + " are " + Text(up) + ".");
      }
    }
  }
  return {};
}
} // namespace

/// The voxels of one brick of an added level without border, cut at the end of the volume, and the
/// ranges of its cells; blocks of the level below have ranges only.
struct LevelsBrickSource::Block
{
  std::vector<std::byte> Voxels;
  Int3 CellCount{ 0, 0, 0 };
  std::vector<ValueRange> Cells;
  ValueRange Range = ValueRange::Void();

  std::uint64_t Bytes() const
  {
    return this->Voxels.size() + this->Cells.size() * sizeof(ValueRange);
  }

  void FindRanges(const std::byte* voxels, const Int3& size, ScalarType type, int components)
  {
    for (std::size_t a = 0; a < 3; ++a)
    {
      this->CellCount[a] = CeilDiv(size[a], CellEdge);
    }
    DispatchScalarType(type,
      [&](auto tag)
      {
        using T = decltype(tag);
        const auto view =
          BoxView<const T>::Dense(reinterpret_cast<const T*>(voxels), size, components);
        ForEach({ 0, 0, 0 }, this->CellCount,
          [&](const Int3& cell)
          {
            VoxelBox box;
            for (std::size_t a = 0; a < 3; ++a)
            {
              box.Low[a] = cell[a] * CellEdge;
              box.High[a] = std::min(box.Low[a] + CellEdge, size[a]);
            }
            this->Cells.push_back(ScanVoxels(view, box));
            this->Range.Include(this->Cells.back());
            return Status();
          });
      });
  }

  /// Of the cells that the box touches, which counts from the block's first voxel.
  ValueRange RangeOf(const VoxelBox& box) const
  {
    Int3 low{};
    Int3 high{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      low[a] = box.Low[a] / CellEdge;
      high[a] = CeilDiv(box.High[a], CellEdge);
    }
    if (low == Int3{ 0, 0, 0 } && high == this->CellCount)
    {
      return this->Range;
    }
    ValueRange range = ValueRange::Void();
    ForEach(low, high,
      [&](const Int3& c)
      {
        range.Include(this->Cells[static_cast<std::size_t>(
          (c[2] * this->CellCount[1] + c[1]) * this->CellCount[0] + c[0])]);
        return Status();
      });
    return range;
  }
};

/// The right to hold the voxels of a block of a given level for a while.
class LevelsBrickSource::ReadLease
{
public:
  explicit ReadLease(LevelsBrickSource& source)
    : Source(source)
  {
    const WaitScope waiting;
    std::unique_lock<std::mutex> lock(source.Mutex);
    source.Changed.wait(lock, [&] { return source.Leases < MostLeases; });
    ++source.Leases;
    source.Memory += source.BlockBytes();
  }
  ~ReadLease()
  {
    {
      const std::lock_guard<std::mutex> lock(this->Source.Mutex);
      --this->Source.Leases;
      this->Source.Memory -= this->Source.BlockBytes();
    }
    this->Source.Changed.notify_all();
  }
  ReadLease(const ReadLease&) = delete;
  ReadLease& operator=(const ReadLease&) = delete;
  ReadLease(ReadLease&&) = delete;
  ReadLease& operator=(ReadLease&&) = delete;

private:
  LevelsBrickSource& Source;
};

Result<std::shared_ptr<LevelsBrickSource>> LevelsBrickSource::Make(const LevelsDescription& levels)
{
  Status status = CheckDescription(levels);
  if (!status)
  {
    return status;
  }
  std::vector<Int3> factors;
  for (const GivenLevel& level : levels.Levels)
  {
    factors.push_back(level.Factor);
  }
  Result<PyramidLayout> layout =
    PyramidLayout::Make(levels.Levels.front().Dimensions, levels.BrickSize, factors);
  status = layout ? CheckSizes(levels, layout.Value()) : layout.GetStatus();
  if (!status)
  {
    return Status(status.Code(), levels.Name + " can't be drawn: " + status.Message());
  }
  // Levels above the coarsest given one, as if that were a volume of its own.
  const int last = static_cast<int>(levels.Levels.size()) - 1;
  const Int3 base = factors.back();
  Double3 spacing = levels.Spacing;
  for (std::size_t a = 0; a < 3; ++a)
  {
    spacing[a] *= static_cast<double>(base[a]);
  }
  std::vector<Int3> added =
    PyramidLayout::DefaultFactors(layout.Value().Dimensions(last), spacing, levels.BrickSize);
  if (added.size() > 1 && levels.BrickSize % 2 != 0)
  {
    return Status(StatusCode::InvalidArgument,
      levels.Name + " needs coarser levels, which take an even brick size; it is " +
        std::to_string(levels.BrickSize) + ".");
  }
  for (std::size_t l = 1; l < added.size(); ++l)
  {
    for (std::size_t a = 0; a < 3; ++a)
    {
      added[l][a] *= base[a];
    }
    factors.push_back(added[l]);
  }
  layout = PyramidLayout::Make(levels.Levels.front().Dimensions, levels.BrickSize, factors);
  if (!layout)
  {
    return Status(
      layout.GetStatus().Code(), levels.Name + " can't be drawn: " + layout.GetStatus().Message());
  }
  std::shared_ptr<LevelsBrickSource> source(new LevelsBrickSource(levels));
  source->Info_.Layout = std::move(layout.Value());
  return source;
}

LevelsBrickSource::LevelsBrickSource(const LevelsDescription& levels)
  : Read(levels.Read)
  , Given(levels.Levels)
{
  this->Info_.Type = levels.Type;
  this->Info_.Components = levels.Components;
  this->Info_.Labels = levels.Labels;
  this->Info_.Range = levels.Range;
  this->Info_.Histogram = levels.Histogram;
  this->Info_.Origin = levels.Origin;
  this->Info_.Spacing = levels.Spacing;
  this->Info_.Direction = levels.Direction;
  this->Info_.ArrayName = levels.ArrayName;
  this->Info_.Name = levels.Name;
}

LevelsBrickSource::~LevelsBrickSource() = default;

std::size_t LevelsBrickSource::VoxelBytes() const
{
  return SizeOf(this->Info_.Type) * static_cast<std::size_t>(this->Info_.Components);
}

std::uint64_t LevelsBrickSource::BlockBytes() const
{
  const auto edge = static_cast<std::uint64_t>(this->Info_.Layout.BrickSize());
  return edge * edge * edge * this->VoxelBytes();
}

std::uint64_t LevelsBrickSource::LeastMemory() const
{
  const PyramidLayout& layout = this->Info_.Layout;
  double bytes = 0;
  for (int l = this->LastGiven(); l < layout.NumberOfLevels(); ++l)
  {
    double voxels = 1;
    double cells = 1;
    for (std::size_t a = 0; a < 3; ++a)
    {
      voxels *= static_cast<double>(layout.Dimensions(l)[a]);
      // Each brick has cells of its own.
      cells *= static_cast<double>(
        layout.Bricks(l)[a] * CeilDiv(std::int64_t{ layout.BrickSize() }, CellEdge));
    }
    bytes += cells * sizeof(ValueRange) +
      (this->IsGiven(l) ? 0.0 : voxels * static_cast<double>(this->VoxelBytes()));
  }
  bytes += MostLeases * static_cast<double>(this->BlockBytes());
  return bytes < 0x1p62 ? static_cast<std::uint64_t>(bytes) : std::uint64_t{ 1 } << 62;
}

Status LevelsBrickSource::CheckBudget() const
{
  if (this->Budget.load() >= this->LeastMemory())
  {
    return {};
  }
  return Status(StatusCode::ResourceExhausted,
    "The coarser levels of " + this->Info_.Name + ", which it doesn't have itself, need " +
      std::to_string(this->LeastMemory()) + " bytes of main memory; there are " +
      std::to_string(this->Budget.load()) +
      ". Convert it to a pyramid, give coarser levels, or raise the host memory budget.");
}

VoxelBox LevelsBrickSource::BoxOf(int level, const Int3& index) const
{
  VoxelBox box;
  for (std::size_t a = 0; a < 3; ++a)
  {
    box.Low[a] = index[a] * this->Info_.Layout.BrickSize();
    box.High[a] = box.Low[a] + this->Info_.Layout.BrickSize();
  }
  return Clamp(box, this->Info_.Layout.Dimensions(level));
}

Status LevelsBrickSource::ReadGiven(int level, const VoxelBox& box, std::vector<std::byte>& out)
{
  const Int3& has = this->Given[static_cast<std::size_t>(level)].Dimensions;
  VoxelBox inside = Clamp(box, has);
  for (std::size_t a = 0; a < 3; ++a)
  {
    // A level that was rounded down may miss the whole box; then it's the outermost voxel.
    inside.Low[a] = std::min(inside.Low[a], has[a] - 1);
    inside.High[a] = std::max(inside.High[a], inside.Low[a] + 1);
  }
  const auto bytesOf = [&](const VoxelBox& b)
  { return static_cast<std::size_t>(b.Count()) * this->VoxelBytes(); };
  std::vector<std::byte> read(bytesOf(inside));
  const Status status = this->Read(level, inside.Low, inside.Size(), read.data());
  if (!status)
  {
    return status;
  }
  this->Delivered += read.size();
  if (inside == box)
  {
    out = std::move(read);
    return {};
  }
  out.resize(bytesOf(box));
  CopyClamped(inside, read.data(), box, out.data(), this->VoxelBytes());
  return {};
}

Result<LevelsBrickSource::BlockPointer> LevelsBrickSource::RequireBlock(
  int level, const Int3& index, Busy busy)
{
  const BrickKey key = BrickKey::Of(level, index);
  if (this->IsGiven(level) && level + 1 < this->Info_.Layout.NumberOfLevels())
  {
    // The block above needs these voxels as well, and finds the ranges of all that it is made of.
    // Where it fails, this one may still be had.
    Int3 parent{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      parent[a] =
        index[a] * this->Info_.Layout.Factor(level)[a] / this->Info_.Layout.Factor(level + 1)[a];
    }
    bool known = false;
    {
      const std::lock_guard<std::mutex> lock(this->Mutex);
      known = this->Blocks.count(key) != 0;
    }
    if (!known)
    {
      const Result<BlockPointer> above = this->RequireBlock(level + 1, parent, busy);
      if (above && !above.Value())
      {
        return BlockPointer();
      }
    }
  }
  {
    const WaitScope waiting; // ends after the lock is released
    std::unique_lock<std::mutex> lock(this->Mutex);
    while (true)
    {
      const auto found = this->Blocks.find(key);
      if (found == this->Blocks.end())
      {
        this->Blocks.emplace(key, nullptr);
        break;
      }
      if (found->second || busy == Busy::Leave)
      {
        return found->second;
      }
      this->Changed.wait(lock);
    }
  }
  // Whatever happens, those who wait for the block are told.
  Result<BlockPointer> made = Status(StatusCode::InputOutput, "not made");
  const auto settle = [&]
  {
    {
      const std::lock_guard<std::mutex> lock(this->Mutex);
      if (made)
      {
        this->Memory += made.Value()->Bytes();
        this->Blocks[key] = made.Value();
      }
      else
      {
        this->Blocks.erase(key);
      }
    }
    this->Changed.notify_all();
  };
  try
  {
    made = this->MakeBlock(level, index);
  }
  catch (...)
  {
    settle();
    throw;
  }
  settle();
  return made;
}

template <typename F>
Status LevelsBrickSource::ForEachBlock(int level, const Int3& low, const Int3& high, const F& use)
{
  std::vector<Int3> left;
  Status status = ForEach(low, high,
    [&](const Int3& index)
    {
      const Result<BlockPointer> block = this->RequireBlock(level, index, Busy::Leave);
      if (!block)
      {
        return block.GetStatus();
      }
      if (!block.Value())
      {
        left.push_back(index);
        return Status();
      }
      use(index, *block.Value());
      return Status();
    });
  for (auto index = left.begin(); status && index != left.end(); ++index)
  {
    const Result<BlockPointer> block = this->RequireBlock(level, *index);
    if (block)
    {
      use(*index, *block.Value());
    }
    status = block.GetStatus();
  }
  return status;
}

Result<LevelsBrickSource::BlockPointer> LevelsBrickSource::MakeBlock(int level, const Int3& index)
{
  const VoxelBox box = this->BoxOf(level, index);
  auto block = std::make_shared<Block>();
  if (this->IsGiven(level))
  {
    const ReadLease lease(*this);
    std::vector<std::byte> voxels;
    const Status status = this->ReadGiven(level, box, voxels);
    if (!status)
    {
      return status;
    }
    block->FindRanges(voxels.data(), box.Size(), this->Info_.Type, this->Info_.Components);
    return BlockPointer(block);
  }
  block->Voxels.resize(static_cast<std::size_t>(box.Count()) * this->VoxelBytes());
  const Status status = this->FillFromBelow(level, box, *block);
  if (!status)
  {
    return status;
  }
  block->FindRanges(block->Voxels.data(), box.Size(), this->Info_.Type, this->Info_.Components);
  return BlockPointer(block);
}

Status LevelsBrickSource::FillFromBelow(int level, const VoxelBox& box, Block& block)
{
  const PyramidLayout& layout = this->Info_.Layout;
  Int3 group{};
  Int3 low{};
  Int3 high{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    group[a] = layout.Factor(level)[a] / layout.Factor(level - 1)[a];
    low[a] = box.Low[a] * group[a] / layout.BrickSize();
    high[a] = std::min(CeilDiv(box.High[a] * group[a], std::int64_t{ layout.BrickSize() }),
      layout.Bricks(level - 1)[a]);
  }
  const auto downsample = [&](const VoxelBox& below, const std::byte* voxels)
  {
    DispatchScalarType(this->Info_.Type,
      [&](auto tag)
      {
        using T = decltype(tag);
        const auto from = BoxView<const T>::Dense(
          reinterpret_cast<const T*>(voxels), below.Size(), this->Info_.Components);
        auto to = BoxView<T>::Dense(
          reinterpret_cast<T*>(block.Voxels.data()), box.Size(), this->Info_.Components);
        Int3 first{};
        for (std::size_t a = 0; a < 3; ++a)
        {
          first[a] = below.Low[a] / group[a] - box.Low[a];
          to.Dimensions[a] = CeilDiv(below.Size()[a], group[a]);
        }
        to.Data = to.Row(first[1], first[2]) + first[0] * this->Info_.Components;
        DownsampleBox<T>(
          from, group, this->Info_.Labels ? Downsampling::Mode : Downsampling::Average, to);
      });
  };
  if (!this->IsGiven(level - 1))
  {
    return this->ForEachBlock(level - 1, low, high,
      [&](const Int3& child, const Block& made)
      { downsample(this->BoxOf(level - 1, child), made.Voxels.data()); });
  }
  return ForEach(low, high,
    [&](const Int3& child) -> Status
    {
      const VoxelBox below = this->BoxOf(level - 1, child);
      const ReadLease lease(*this);
      std::vector<std::byte> voxels;
      const Status status = this->ReadGiven(level - 1, below, voxels);
      if (!status)
      {
        return status;
      }
      downsample(below, voxels.data());
      // The ranges are had for nothing.
      auto ranges = std::make_shared<Block>();
      ranges->FindRanges(voxels.data(), below.Size(), this->Info_.Type, this->Info_.Components);
      const std::lock_guard<std::mutex> lock(this->Mutex);
      const auto added = this->Blocks.emplace(BrickKey::Of(level - 1, child), ranges);
      this->Memory += added.second ? ranges->Bytes() : 0;
      return {};
    });
}

VoxelBox LevelsBrickSource::BlocksOf(const VoxelBox& box) const
{
  VoxelBox blocks;
  for (std::size_t a = 0; a < 3; ++a)
  {
    blocks.Low[a] = box.Low[a] / this->Info_.Layout.BrickSize();
    blocks.High[a] = CeilDiv(box.High[a], std::int64_t{ this->Info_.Layout.BrickSize() });
  }
  return blocks;
}

Status LevelsBrickSource::CopyBlocks(int level, const VoxelBox& box, std::vector<std::byte>& out)
{
  out.resize(static_cast<std::size_t>(box.Count()) * this->VoxelBytes());
  const VoxelBox blocks = this->BlocksOf(box);
  return this->ForEachBlock(level, blocks.Low, blocks.High,
    [&](const Int3& index, const Block& block)
    {
      CopyCommon(
        this->BoxOf(level, index), block.Voxels.data(), box, out.data(), this->VoxelBytes());
    });
}

Result<BrickPointer> LevelsBrickSource::ReadBrick(const BrickKey& key)
{
  return Guarded(key, this->Info_,
    [&]() -> Result<BrickPointer>
    {
      Status status = CheckKey(key, this->Info_);
      if (status)
      {
        status = this->CheckBudget();
      }
      if (!status)
      {
        return status;
      }
      const VoxelBox stored = StoredBox(this->Info_.Layout, key);
      const VoxelBox inside = Clamp(stored, this->Info_.Layout.Dimensions(key.Level));
      std::vector<std::byte> voxels;
      status = this->IsGiven(key.Level) ? this->ReadGiven(key.Level, inside, voxels)
                                        : this->CopyBlocks(key.Level, inside, voxels);
      if (!status)
      {
        return Status(status.Code(), Subject(key, this->Info_) + ": " + status.Message());
      }
      std::shared_ptr<Brick> brick = MakeEmptyBrick(this->Info_);
      CopyClamped(inside, voxels.data(), stored, brick->Voxels.data(), this->VoxelBytes());
      return BrickPointer(std::move(brick));
    });
}

ValueRange LevelsBrickSource::RangeOf(const BrickKey& region)
{
  if (region.Level < this->LastGiven() ||
    region.PageLevel >= this->Info_.Layout.PageDepth(region.Level))
  {
    return ValueRange::Unknown();
  }
  const VoxelBox support = SupportBox(this->Info_.Layout, region);
  const VoxelBox blocks = this->BlocksOf(support);
  ValueRange range = ValueRange::Void();
  const Status status = this->ForEachBlock(region.Level, blocks.Low, blocks.High,
    [&](const Int3& index, const Block& block)
    {
      const VoxelBox box = this->BoxOf(region.Level, index);
      VoxelBox part;
      for (std::size_t a = 0; a < 3; ++a)
      {
        part.Low[a] = std::max(support.Low[a], box.Low[a]) - box.Low[a];
        part.High[a] = std::min(support.High[a], box.High[a]) - box.Low[a];
      }
      range.Include(block.RangeOf(part));
    });
  // What can't be read may be anything; its brick will tell why.
  return status ? range : ValueRange::Unknown();
}

Result<std::vector<ValueRange>> LevelsBrickSource::ReadRanges(
  const BrickKey& first, const Int3& count)
{
  return Guarded(first, this->Info_,
    [&]() -> Result<std::vector<ValueRange>>
    {
      const Status status = this->CheckBudget();
      if (!status)
      {
        return status;
      }
      return RangesOfRegions(first, count, this->Info_,
        [&](const BrickKey& region) -> Result<ValueRange> { return this->RangeOf(region); });
    });
}

} // namespace teravox
