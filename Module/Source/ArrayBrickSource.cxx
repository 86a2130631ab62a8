// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ArrayBrickSource.h"

#include "BrickGeometry.h"
#include "Downsampling.h"
#include "Guarded.h"
#include "ParallelFor.h"
#include "ScanVoxels.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace teravox
{

/// One level: its voxels where they are kept, and the cells once somebody asks for ranges. The
/// pointers are guarded by StateMutex.
struct ArrayBrickSource::Level
{
  Int3 Dimensions{ 0, 0, 0 };
  Int3 Group{ 1, 1, 1 };      // voxels of the level before that make one of this
  std::int64_t RowStride = 0; // in scalars
  std::int64_t SliceStride = 0;
  std::shared_ptr<const std::vector<std::byte>> Own; // never for level 0
  std::shared_ptr<const CellRanges> Cells;
};

/// The voxels of a level, kept alive; no Data where the level isn't kept.
struct ArrayBrickSource::Voxels
{
  const std::byte* Data = nullptr;
  std::shared_ptr<const std::vector<std::byte>> Keep;
  Int3 Dimensions{ 0, 0, 0 };
  std::int64_t RowStride = 0;
  std::int64_t SliceStride = 0;

  template <typename T>
  BoxView<const T> Box(const VoxelBox& box, int components) const
  {
    BoxView<const T> view{ reinterpret_cast<const T*>(this->Data), box.Size(), components,
      this->RowStride, this->SliceStride };
    view.Data = view.Row(box.Low[1], box.Low[2]) + box.Low[0] * components;
    return view;
  }
};

namespace
{
// Edge of the pieces that a level which isn't kept is computed in, in its own voxels.
constexpr std::int64_t PieceEdge = 8;
constexpr std::size_t MostPieces = 4; // threads that compute at the same time
} // namespace

/// Room for one thread: a piece, and the voxels of each finer level that it is made of.
struct ArrayBrickSource::Pieces
{
  std::vector<std::vector<std::byte>> OfLevel;
};

/// Takes the room for a piece, waits while all are taken, and gives it back.
class ArrayBrickSource::PieceLease
{
public:
  explicit PieceLease(ArrayBrickSource& source)
    : Source(source)
  {
    std::unique_lock<std::mutex> lock(source.StateMutex);
    source.PiecesChanged.wait(
      lock, [&] { return !source.FreePieces.empty() || source.PiecesMade < MostPieces; });
    if (source.FreePieces.empty())
    {
      ++source.PiecesMade;
      source.Memory += source.PieceBytes();
      this->Taken = std::make_unique<Pieces>();
      this->Taken->OfLevel.resize(source.Levels.size());
      return;
    }
    this->Taken = std::move(source.FreePieces.back());
    source.FreePieces.pop_back();
  }
  PieceLease(const PieceLease&) = delete;
  PieceLease& operator=(const PieceLease&) = delete;
  PieceLease(PieceLease&&) = delete;
  PieceLease& operator=(PieceLease&&) = delete;
  ~PieceLease()
  {
    {
      const std::lock_guard<std::mutex> lock(this->Source.StateMutex);
      if (this->Source.Kept == 1)
      {
        // The budget has grown meanwhile: the room goes to the levels.
        --this->Source.PiecesMade;
        this->Source.Memory -= this->Source.PieceBytes();
      }
      else
      {
        this->Source.FreePieces.push_back(std::move(this->Taken));
      }
    }
    this->Source.PiecesChanged.notify_one();
  }
  Pieces& Get() { return *this->Taken; }

private:
  ArrayBrickSource& Source;
  std::unique_ptr<Pieces> Taken;
};

namespace
{
Status CheckArray(const ArrayDescription& array)
{
  const auto refuse = [&](const std::string& why)
  { return Status(StatusCode::InvalidArgument, array.Name + " can't be drawn: " + why); };
  if (array.Data == nullptr)
  {
    return refuse("it has no data.");
  }
  if (array.Layout && array.Layout->Dimensions(0) != array.Dimensions)
  {
    return refuse("its levels are those of a volume of another size.");
  }
  if (array.Components < 1 || array.Components > 4)
  {
    return refuse(
      "it has " + std::to_string(array.Components) + " components; 1 to 4 are possible.");
  }
  for (const double edge : array.Spacing)
  {
    if (!(edge > 0) || !std::isfinite(edge))
    {
      return refuse("its spacing must be positive and finite on each axis.");
    }
  }
  const std::int64_t row = array.Dimensions[0] * array.Components;
  const std::int64_t rowStride = array.RowStride == 0 ? row : array.RowStride;
  if (rowStride < row ||
    (array.SliceStride != 0 && array.SliceStride / rowStride < array.Dimensions[1]))
  {
    return refuse("its strides make rows or slices overlap.");
  }
  return {};
}
} // namespace

Result<std::shared_ptr<ArrayBrickSource>> ArrayBrickSource::Make(const ArrayDescription& array)
{
  // First, because the other checks multiply the dimensions.
  Result<PyramidLayout> layout = array.Layout
    ? Result<PyramidLayout>(*array.Layout)
    : PyramidLayout::MakeDefault(array.Dimensions, array.Spacing, array.BrickSize);
  if (!layout)
  {
    return Status(
      layout.GetStatus().Code(), array.Name + " can't be drawn: " + layout.GetStatus().Message());
  }
  const Status status = CheckArray(array);
  if (!status)
  {
    return status;
  }
  std::shared_ptr<ArrayBrickSource> source(new ArrayBrickSource(array));
  source->Info_.Layout = std::move(layout.Value());
  for (int l = 0; l < source->Info_.Layout.NumberOfLevels(); ++l)
  {
    source->Levels.push_back(std::make_unique<Level>());
    Level& level = *source->Levels.back();
    level.Dimensions = source->Info_.Layout.Dimensions(l);
    level.RowStride = level.Dimensions[0] * array.Components;
    level.SliceStride = level.RowStride * level.Dimensions[1];
    for (std::size_t a = 0; a < 3 && l > 0; ++a)
    {
      level.Group[a] = source->Info_.Layout.Factor(l)[a] / source->Info_.Layout.Factor(l - 1)[a];
    }
  }
  Level& finest = *source->Levels.front();
  finest.RowStride = array.RowStride != 0 ? array.RowStride : finest.RowStride;
  finest.SliceStride =
    array.SliceStride != 0 ? array.SliceStride : finest.RowStride * finest.Dimensions[1];
  return source;
}

ArrayBrickSource::ArrayBrickSource(const ArrayDescription& array)
  : Method(array.Mask  ? Downsampling::Any
        : array.Labels ? Downsampling::Mode
                       : Downsampling::Average)
  , Owner(array.Owner)
  , Finest(static_cast<const std::byte*>(array.Data))
  , OwnBytes(array.OwnBytes)
{
  this->Memory = array.OwnBytes;
  this->Info_.Type = array.Type;
  this->Info_.Components = array.Components;
  this->Info_.Labels = array.Labels;
  this->Info_.CellData = array.CellData;
  this->Info_.Range = array.Range;
  this->Info_.ComponentRanges = array.ComponentRanges;
  this->Info_.Origin = array.Origin;
  this->Info_.Spacing = array.Spacing;
  this->Info_.Direction = array.Direction;
  this->Info_.ExtentStart = array.ExtentStart;
  this->Info_.ArrayName = array.ArrayName;
  this->Info_.Name = array.Name;
}

ArrayBrickSource::~ArrayBrickSource() = default;

Result<BrickPointer> ArrayBrickSource::ReadBrick(const BrickKey& key)
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
      std::shared_ptr<Brick> brick = MakeEmptyBrick(this->Info_);
      const VoxelBox stored = StoredBox(this->Info_.Layout, key);
      const VoxelBox inside = Clamp(stored, this->Info_.Layout.Dimensions(key.Level));
      const std::int64_t edge = brick->StoredSize;
      const std::int64_t first =
        ((inside.Low[2] - stored.Low[2]) * edge + inside.Low[1] - stored.Low[1]) * edge +
        inside.Low[0] - stored.Low[0];
      const std::int64_t components = this->Info_.Components;
      const auto scalar = static_cast<std::int64_t>(SizeOf(this->Info_.Type));
      this->CopyBox(key.Level, inside, brick->Voxels.data() + first * components * scalar,
        edge * components, edge * edge * components);
      RepeatOutermostVoxels(*brick, stored, inside);
      return BrickPointer(std::move(brick));
    });
}

Result<std::vector<ValueRange>> ArrayBrickSource::ReadRanges(
  const BrickKey& first, const Int3& count)
{
  return Guarded(first, this->Info_,
    [&]() -> Result<std::vector<ValueRange>>
    {
      return RangesOfRegions(first, count, this->Info_,
        [&](const BrickKey& region) -> Result<ValueRange>
        {
          const Status status = this->CheckBudget();
          if (!status)
          {
            return status;
          }
          return this->RequireCells(region.Level)
            ->Query(SupportBox(this->Info_.Layout, region), this->ScanOf(region.Level));
        });
    });
}

Result<ValueRange> ArrayBrickSource::ComputeRange()
{
  return Guarded(BrickKey{}, this->Info_,
    [&]() -> Result<ValueRange>
    {
      const VoxelBox all{ { 0, 0, 0 }, this->Info_.Layout.Dimensions(0) };
      return this->RequireCells(0)->Query(all, this->ScanOf(0));
    });
}

std::uint64_t ArrayBrickSource::MemoryUsed() const
{
  return this->Memory.load();
}

std::uint64_t ArrayBrickSource::CellBytes() const
{
  std::uint64_t bytes = 0;
  for (const auto& level : this->Levels)
  {
    bytes += CellRanges::BytesFor(level->Dimensions);
  }
  return bytes;
}

std::uint64_t ArrayBrickSource::LevelBytes(int level) const
{
  const Level& of = *this->Levels[static_cast<std::size_t>(level)];
  // 2^31 voxels along each axis are too many for 64 bits; such a level fits nowhere.
  const double bytes = static_cast<double>(of.SliceStride) * static_cast<double>(of.Dimensions[2]) *
    static_cast<double>(SizeOf(this->Info_.Type));
  return bytes < 0x1p62 ? static_cast<std::uint64_t>(bytes) : std::uint64_t{ 1 } << 62;
}

std::uint64_t ArrayBrickSource::PieceBytes() const
{
  // A piece of level l takes edge^3 voxels, what it is made of at most Group^3 times as many, and
  // so on: but each finer level again in pieces.
  std::uint64_t bytes = 0;
  for (std::size_t l = 1; l < this->Levels.size(); ++l)
  {
    const Int3& group = this->Levels[l]->Group;
    bytes += static_cast<std::uint64_t>(PieceEdge * PieceEdge * PieceEdge) *
      static_cast<std::uint64_t>(group[0] * group[1] * group[2] + 1);
  }
  return bytes * static_cast<std::uint64_t>(this->Info_.Components) * SizeOf(this->Info_.Type);
}

int ArrayBrickSource::FirstKept(std::uint64_t budget) const
{
  const auto levels = static_cast<int>(this->Levels.size());
  std::uint64_t needed = this->OwnBytes + this->CellBytes();
  int first = levels;
  while (first > 1 && budget >= needed && budget - needed >= this->LevelBytes(first - 1))
  {
    needed += this->LevelBytes(--first);
  }
  if (first == 1)
  {
    return first; // all are kept: nothing is computed in pieces
  }
  needed = this->OwnBytes + this->CellBytes() + MostPieces * this->PieceBytes();
  first = levels;
  while (first > 1 && budget >= needed && budget - needed >= this->LevelBytes(first - 1))
  {
    needed += this->LevelBytes(--first);
  }
  return std::max(first, 2);
}

std::uint64_t ArrayBrickSource::LeastMemory() const
{
  std::uint64_t levels = 0;
  for (std::size_t l = 1; l < this->Levels.size(); ++l)
  {
    levels += this->LevelBytes(static_cast<int>(l));
  }
  return this->OwnBytes + this->CellBytes() + std::min(levels, MostPieces * this->PieceBytes());
}

Status ArrayBrickSource::CheckBudget() const
{
  if (this->Budget.load() >= this->LeastMemory())
  {
    return {};
  }
  return Status(StatusCode::ResourceExhausted,
    "The levels and ranges of " + this->Info_.Name + " need " +
      std::to_string(this->LeastMemory()) + " bytes of main memory at least; they have " +
      std::to_string(this->Budget.load()) + ".");
}

int ArrayBrickSource::FirstKeptLevel() const
{
  const std::lock_guard<std::mutex> lock(this->StateMutex);
  return std::min(this->Kept, static_cast<int>(this->Levels.size()));
}

void ArrayBrickSource::SetMemoryBudget(std::uint64_t bytes)
{
  if (this->Budget.exchange(bytes) == bytes)
  {
    return;
  }
  const std::lock_guard<std::mutex> building(this->BuildMutex);
  const std::lock_guard<std::mutex> lock(this->StateMutex);
  this->Kept = this->FirstKept(bytes);
  for (int l = 1; l < std::min(this->Kept, static_cast<int>(this->Levels.size())); ++l)
  {
    Level& level = *this->Levels[static_cast<std::size_t>(l)];
    this->Memory -= level.Own ? level.Own->size() : 0;
    level.Own.reset();
  }
  if (this->Kept == 1 || bytes < this->LeastMemory())
  {
    this->Memory -= this->FreePieces.size() * this->PieceBytes();
    this->PiecesMade -= this->FreePieces.size();
    this->FreePieces.clear();
  }
  if (bytes < this->LeastMemory())
  {
    for (const auto& level : this->Levels)
    {
      this->Memory -= level->Cells ? level->Cells->MemoryUsed() : 0;
      level->Cells.reset();
    }
  }
}

ArrayBrickSource::Voxels ArrayBrickSource::Look(int level) const
{
  const std::lock_guard<std::mutex> lock(this->StateMutex);
  const Level& of = *this->Levels[static_cast<std::size_t>(level)];
  Voxels voxels;
  voxels.Keep = of.Own;
  voxels.Data = level == 0 ? this->Finest : of.Own ? of.Own->data() : nullptr;
  voxels.Dimensions = of.Dimensions;
  voxels.RowStride = of.RowStride;
  voxels.SliceStride = of.SliceStride;
  return voxels;
}

ArrayBrickSource::Voxels ArrayBrickSource::RequireLevel(int level)
{
  Voxels voxels = this->Look(level);
  if (voxels.Data != nullptr || level < this->FirstKeptLevel())
  {
    return voxels;
  }
  const std::lock_guard<std::mutex> building(this->BuildMutex);
  for (int l = this->FirstKeptLevel(); l <= level; ++l)
  {
    if (this->Look(l).Data == nullptr)
    {
      this->BuildLevel(l);
    }
  }
  return this->Look(level);
}

void ArrayBrickSource::BuildLevel(int level)
{
  Level& of = *this->Levels[static_cast<std::size_t>(level)];
  auto own = std::make_shared<std::vector<std::byte>>(this->LevelBytes(level));
  const Voxels finer = this->Look(level - 1);
  DispatchScalarType(this->Info_.Type,
    [&](auto tag)
    {
      using T = decltype(tag);
      const auto out =
        BoxView<T>::Dense(reinterpret_cast<T*>(own->data()), of.Dimensions, this->Info_.Components);
      ParallelFor(of.Dimensions[2],
        [&](std::int64_t z)
        {
          const VoxelBox box{ { 0, 0, z }, { of.Dimensions[0], of.Dimensions[1], z + 1 } };
          BoxView<T> slice = out;
          slice.Data = out.Row(0, z);
          slice.Dimensions[2] = 1;
          if (finer.Data != nullptr)
          {
            DownsampleBox<T>(finer.Box<T>(this->BoxBelow(level, box), this->Info_.Components),
              of.Group, this->Method, slice);
            return;
          }
          PieceLease lease(*this);
          this->MakeBox(level, box, slice, lease.Get());
        });
    });
  const std::lock_guard<std::mutex> lock(this->StateMutex);
  this->Memory += own->size();
  of.Own = std::move(own);
}

VoxelBox ArrayBrickSource::BoxBelow(int level, const VoxelBox& box) const
{
  VoxelBox below;
  for (std::size_t a = 0; a < 3; ++a)
  {
    const std::int64_t group = this->Levels[static_cast<std::size_t>(level)]->Group[a];
    below.Low[a] = box.Low[a] * group;
    below.High[a] = std::min(
      box.High[a] * group, this->Levels[static_cast<std::size_t>(level) - 1]->Dimensions[a]);
  }
  return below;
}

template <typename T>
void ArrayBrickSource::MakeBox(
  int level, const VoxelBox& box, const BoxView<T>& out, Pieces& pieces)
{
  const int components = this->Info_.Components;
  const Voxels finer = this->Look(level - 1);
  const Int3& group = this->Levels[static_cast<std::size_t>(level)]->Group;
  for (std::int64_t z = box.Low[2]; z < box.High[2]; z += PieceEdge)
  {
    for (std::int64_t y = box.Low[1]; y < box.High[1]; y += PieceEdge)
    {
      for (std::int64_t x = box.Low[0]; x < box.High[0]; x += PieceEdge)
      {
        const VoxelBox piece{ { x, y, z },
          { std::min(x + PieceEdge, box.High[0]), std::min(y + PieceEdge, box.High[1]),
            std::min(z + PieceEdge, box.High[2]) } };
        const VoxelBox below = this->BoxBelow(level, piece);
        BoxView<T> to = out;
        to.Data = out.Row(y - box.Low[1], z - box.Low[2]) + (x - box.Low[0]) * components;
        to.Dimensions = piece.Size();
        BoxView<const T> from;
        if (finer.Data != nullptr)
        {
          from = finer.Box<T>(below, components);
        }
        else
        {
          const Int3 size = below.Size();
          std::vector<std::byte>& room = pieces.OfLevel[static_cast<std::size_t>(level) - 1];
          room.resize(std::max(room.size(),
            static_cast<std::size_t>(size[0] * size[1] * size[2] * components) * sizeof(T)));
          const auto made = BoxView<T>::Dense(reinterpret_cast<T*>(room.data()), size, components);
          this->MakeBox(level - 1, below, made, pieces);
          from = BoxView<const T>::Dense(made.Data, size, components);
        }
        DownsampleBox<T>(from, group, this->Method, to);
      }
    }
  }
}

void ArrayBrickSource::CopyBox(
  int level, const VoxelBox& box, std::byte* out, std::int64_t rowStride, std::int64_t sliceStride)
{
  const int components = this->Info_.Components;
  const Voxels voxels = this->RequireLevel(level);
  DispatchScalarType(this->Info_.Type,
    [&](auto tag)
    {
      using T = decltype(tag);
      const BoxView<T> to{ reinterpret_cast<T*>(out), box.Size(), components, rowStride,
        sliceStride };
      if (voxels.Data == nullptr)
      {
        PieceLease lease(*this);
        this->MakeBox(level, box, to, lease.Get());
        return;
      }
      const auto from = voxels.Box<T>(box, components);
      for (std::int64_t z = 0; z < to.Dimensions[2]; ++z)
      {
        for (std::int64_t y = 0; y < to.Dimensions[1]; ++y)
        {
          std::copy_n(from.Row(y, z), to.Dimensions[0] * components, to.Row(y, z));
        }
      }
    });
}

CellRanges::ScanFunction ArrayBrickSource::ScanOf(int level)
{
  const Voxels voxels = this->RequireLevel(level);
  return DispatchScalarType(this->Info_.Type,
    [&](auto tag) -> CellRanges::ScanFunction
    {
      using T = decltype(tag);
      const int components = this->Info_.Components;
      if (voxels.Data != nullptr)
      {
        return [voxels, components](const VoxelBox& box) {
          return ScanVoxels(voxels.Box<T>(box, components), VoxelBox{ { 0, 0, 0 }, box.Size() });
        };
      }
      return [this, level, components](const VoxelBox& box)
      {
        // A cell, or a part of one: a piece at most.
        const Int3 size = box.Size();
        PieceLease lease(*this);
        std::vector<std::byte>& room = lease.Get().OfLevel[static_cast<std::size_t>(level)];
        room.resize(std::max(room.size(),
          static_cast<std::size_t>(size[0] * size[1] * size[2] * components) * sizeof(T)));
        const auto made = BoxView<T>::Dense(reinterpret_cast<T*>(room.data()), size, components);
        this->MakeBox(level, box, made, lease.Get());
        return ScanVoxels(
          BoxView<const T>::Dense(made.Data, size, components), VoxelBox{ { 0, 0, 0 }, size });
      };
    });
}

std::shared_ptr<const CellRanges> ArrayBrickSource::RequireCells(int level)
{
  Level& wanted = *this->Levels[static_cast<std::size_t>(level)];
  const auto look = [&]
  {
    const std::lock_guard<std::mutex> lock(this->StateMutex);
    return wanted.Cells;
  };
  if (auto cells = look())
  {
    return cells;
  }
  const CellRanges::ScanFunction scan = this->ScanOf(level); // builds the level if need be
  const std::lock_guard<std::mutex> building(this->BuildMutex);
  if (auto cells = look())
  {
    return cells;
  }
  auto cells = std::make_shared<const CellRanges>(wanted.Dimensions, scan);
  const std::lock_guard<std::mutex> lock(this->StateMutex);
  this->Memory += cells->MemoryUsed();
  wanted.Cells = cells;
  return cells;
}

} // namespace teravox
