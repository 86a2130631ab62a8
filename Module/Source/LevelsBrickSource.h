// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickGeometry.h"
#include "BrickSource.h"

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <vector>

namespace teravox
{

/// One level that somebody else has.
struct GivenLevel
{
  /// Voxels along each axis: the volume's divided by Factor, rounded up or down. Where it is
  /// rounded down, the outermost voxels are repeated for what is left out.
  Int3 Dimensions{ 0, 0, 0 };
  Int3 Factor{ 1, 1, 1 }; ///< cumulative against the first level; a multiple of the one before
};

/// Levels that are read box by box by a function, and where they lie in the world.
struct LevelsDescription
{
  /// Writes the voxels of a box inside level `level` to `out`: dense, x fastest, components
  /// interleaved. Called from several threads at once; without any lock of the source held.
  using ReadFunction =
    std::function<Status(int level, const Int3& start, const Int3& size, void* out)>;

  ReadFunction Read;
  std::vector<GivenLevel> Levels; ///< the finest first, at least one
  ScalarType Type = ScalarType::UInt8;
  int Components = 1; ///< 1 to 4, interleaved
  int BrickSize = 64;
  bool Labels = false;
  ValueRange Range = ValueRange::Unknown(); ///< of all voxels, where the caller knows it
  std::vector<double> Histogram;            ///< as in VolumeInfo; empty where unknown
  Double3 Origin{ 0, 0, 0 };
  Double3 Spacing{ 1, 1, 1 };
  std::array<double, 9> Direction{ 1, 0, 0, 0, 1, 0, 0, 0, 1 };
  std::string ArrayName = "scalars";
  std::string Name = "levels read by a function";
};

/// Makes a brick source of levels that are read by a function of the user's: arrays of Python,
/// archives, services.
///
/// Bricks of the given levels are read when they are asked for. If the coarsest given level is
/// larger than one brick, levels are added by box average (mode for labels), with the bits that a
/// pyramid file would have; a brick of such a level is made when it is asked for, of all that lies
/// below it, and kept. The finest given level that levels are added to is therefore read twice: for
/// the levels, and for its bricks.
///
/// Ranges of that level and of the added ones are those of 8^3 cells; finer levels have none
/// (Unknown()), because nobody could tell them without reading. So has what can't be read, and so
/// have the page directory's entries, which are asked for before anything is drawn.
///
/// The added levels and cells must fit into the memory budget (LeastMemory()): about a seventh of
/// the level that they are added to, and 16 bytes for 512 voxels; else bricks are refused.
/// A read that failed is tried again when it is asked for again. Thread: as BrickSource.
class LevelsBrickSource : public BrickSource
{
public:
  /// Errors: no function, no level, dimensions, factors or components out of range, a spacing that
  /// isn't above 0, an odd brick size where levels have to be added.
  static Result<std::shared_ptr<LevelsBrickSource>> Make(const LevelsDescription& levels);
  LevelsBrickSource(const LevelsBrickSource&) = delete;
  LevelsBrickSource& operator=(const LevelsBrickSource&) = delete;
  LevelsBrickSource(LevelsBrickSource&&) = delete;
  LevelsBrickSource& operator=(LevelsBrickSource&&) = delete;
  ~LevelsBrickSource() override;

  const VolumeInfo& Info() const override { return this->Info_; }
  Result<BrickPointer> ReadBrick(const BrickKey& key) override;
  Result<std::vector<ValueRange>> ReadRanges(const BrickKey& first, const Int3& count) override;
  /// Bytes that the function has delivered.
  std::uint64_t BytesRead() const override { return this->Delivered.load(); }
  std::uint64_t MemoryUsed() const override { return this->Memory.load(); }
  void SetMemoryBudget(std::uint64_t bytes) override { this->Budget.store(bytes); }
  std::uint64_t LeastMemory() const override;

private:
  struct Block;
  using BlockPointer = std::shared_ptr<const Block>;
  class ReadLease;

  explicit LevelsBrickSource(const LevelsDescription& levels);

  bool IsGiven(int level) const { return level < static_cast<int>(this->Given.size()); }
  int LastGiven() const { return static_cast<int>(this->Given.size()) - 1; }
  std::size_t VoxelBytes() const;
  std::uint64_t BlockBytes() const;
  Status CheckBudget() const;
  Status ReadGiven(int level, const VoxelBox& box, std::vector<std::byte>& out);
  /// What to do about a block that another thread is making.
  enum class Busy
  {
    Wait,
    Leave ///< the result is null
  };
  Result<BlockPointer> RequireBlock(int level, const Int3& index, Busy busy = Busy::Wait);
  /// The blocks, as indices, in which a box of voxels lies.
  VoxelBox BlocksOf(const VoxelBox& box) const;
  /// Calls use(index, block) for each block; those that other threads are making come last, so that
  /// several threads share the work. Ends with the first failure.
  template <typename F>
  Status ForEachBlock(int level, const Int3& low, const Int3& high, const F& use);
  Result<BlockPointer> MakeBlock(int level, const Int3& index);
  Status FillFromBelow(int level, const VoxelBox& box, Block& block);
  Status CopyBlocks(int level, const VoxelBox& box, std::vector<std::byte>& out);
  ValueRange RangeOf(const BrickKey& region);
  VoxelBox BoxOf(int level, const Int3& index) const;

  VolumeInfo Info_;
  const LevelsDescription::ReadFunction Read;
  const std::vector<GivenLevel> Given;
  std::mutex Mutex; // all of the following; never held while the function runs
  std::condition_variable Changed;
  // A block under construction is null.
  std::unordered_map<BrickKey, BlockPointer, BrickKeyHash> Blocks;
  int Leases = 0;
  std::atomic<std::uint64_t> Budget{ ~std::uint64_t{ 0 } };
  std::atomic<std::uint64_t> Memory{ 0 };
  std::atomic<std::uint64_t> Delivered{ 0 };
};

} // namespace teravox
