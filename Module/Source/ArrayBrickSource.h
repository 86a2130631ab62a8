// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"
#include "CellRanges.h"
#include "Downsampling.h"

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace teravox
{

/// An array in memory and where it lies in the world.
struct ArrayDescription
{
  const void* Data = nullptr;
  std::shared_ptr<const void> Owner; ///< keeps Data alive; may be null if the caller does
  std::uint64_t OwnBytes = 0; ///< of Data that is a copy, made to be drawn: counts as the source's
  ScalarType Type = ScalarType::UInt8;
  int Components = 1; ///< 1 to 4, interleaved
  Int3 Dimensions{ 0, 0, 0 };
  /// From one row, one slice to the next, in scalars; 0 means dense.
  std::int64_t RowStride = 0;
  std::int64_t SliceStride = 0;
  int BrickSize = 64;
  bool Labels = false;
  bool Mask = false; ///< levels by Downsampling::Any
  bool CellData = false;
  /// Levels and bricks, instead of the default ones with BrickSize.
  std::optional<PyramidLayout> Layout;
  ValueRange Range = ValueRange::Unknown(); ///< of all voxels, where the caller knows it
  std::vector<ValueRange> ComponentRanges;  ///< likewise, see VolumeInfo
  Double3 Origin{ 0, 0, 0 };
  Double3 Spacing{ 1, 1, 1 };
  std::array<double, 9> Direction{ 1, 0, 0, 0, 1, 0, 0, 0, 1 };
  Int3 ExtentStart{ 0, 0, 0 };
  std::string ArrayName = "scalars";
  std::string Name = "array in memory";
};

/// Makes a brick source of an array in memory.
///
/// Making it costs nothing. A coarser level is computed as a whole from the level before (box
/// average, or mode for labels) when its first brick is read; the ranges come from the minimum and
/// maximum of 8^3 cells, found when the first range of a level is asked for, and are exact. Both
/// use OpenMP. Several components share one range. Requires: the array doesn't change while the
/// source lives. Thread: as BrickSource.
///
/// The memory budget is hard. As many levels are kept as fit, the coarsest first; each brick of the
/// others is computed from the finer levels again, in small pieces, with the same bits. The cells
/// and the room for those pieces must fit (LeastMemory()), else bricks and ranges are refused.
class ArrayBrickSource : public BrickSource
{
public:
  /// Errors: no data, dimensions or components out of range, strides that overlap, a layout of
  /// other dimensions.
  static Result<std::shared_ptr<ArrayBrickSource>> Make(const ArrayDescription& array);
  ArrayBrickSource(const ArrayBrickSource&) = delete;
  ArrayBrickSource& operator=(const ArrayBrickSource&) = delete;
  ArrayBrickSource(ArrayBrickSource&&) = delete;
  ArrayBrickSource& operator=(ArrayBrickSource&&) = delete;
  ~ArrayBrickSource() override;

  const VolumeInfo& Info() const override { return this->Info_; }
  Result<BrickPointer> ReadBrick(const BrickKey& key) override;
  Result<std::vector<ValueRange>> ReadRanges(const BrickKey& first, const Int3& count) override;
  /// The levels and cells made so far, the room for pieces, and OwnBytes.
  std::uint64_t MemoryUsed() const override;
  void SetMemoryBudget(std::uint64_t bytes) override;
  std::uint64_t LeastMemory() const override;
  /// The finest level that the budget allows to keep; the number of levels if there is none.
  int FirstKeptLevel() const;

  /// Range of all voxels of level 0; reads them all when it is asked for the first time.
  Result<ValueRange> ComputeRange();

private:
  struct Level;
  struct Voxels;
  struct Pieces;
  class PieceLease;

  explicit ArrayBrickSource(const ArrayDescription& array);

  Status CheckBudget() const;
  std::uint64_t CellBytes() const;
  std::uint64_t LevelBytes(int level) const;
  std::uint64_t PieceBytes() const;
  int FirstKept(std::uint64_t budget) const;

  Voxels Look(int level) const;
  Voxels RequireLevel(int level);
  std::shared_ptr<const CellRanges> RequireCells(int level);
  CellRanges::ScanFunction ScanOf(int level);
  /// Strides in scalars.
  void CopyBox(int level, const VoxelBox& box, std::byte* out, std::int64_t rowStride,
    std::int64_t sliceStride);
  template <typename T>
  void MakeBox(int level, const VoxelBox& box, const BoxView<T>& out, Pieces& pieces);
  /// What a box is made of, in the level before.
  VoxelBox BoxBelow(int level, const VoxelBox& box) const;
  void BuildLevel(int level);

  VolumeInfo Info_;
  const Downsampling Method;
  const std::shared_ptr<const void> Owner;
  const std::byte* const Finest; // level 0, the array itself
  const std::uint64_t OwnBytes;
  std::mutex BuildMutex;         // one builds; taken before StateMutex
  mutable std::mutex StateMutex; // pointers of levels and cells, Kept, free pieces
  std::condition_variable PiecesChanged;
  std::vector<std::unique_ptr<Level>> Levels;
  std::vector<std::unique_ptr<Pieces>> FreePieces;
  std::size_t PiecesMade = 0;
  int Kept = 1; // levels from this one are kept
  std::atomic<std::uint64_t> Budget{ ~std::uint64_t{ 0 } };
  std::atomic<std::uint64_t> Memory{ 0 };
};

} // namespace teravox
