// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickCache.h"
#include "BrickGeometry.h"
#include "CellRanges.h"

#include <array>
#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace teravox
{

/// Voxels and ranges of one period of a repeated volume.
///
/// Along an axis of pitch P, voxel i of a level with factor F depends on i modulo P / gcd(P, F)
/// only, except for a last voxel whose group is cut by the end of the volume. So each level has a
/// small set of *classes* per axis: one period, and perhaps that last voxel. The classes of a level
/// are
///   the inner source's voxels and background, where F divides P and the inner level exists;
///   made from the classes of the level before, where it doesn't, and for groups over an inner end.
/// Made classes are cached by cubes of CubeEdge^3; a level with few classes is kept as a whole,
/// which gives it exact ranges. Thread: all functions may be called from several threads at once.
class RepeatPeriod
{
public:
  /// Where voxels go: dense along x, strides in bytes.
  struct Target
  {
    std::byte* Data = nullptr;
    std::int64_t RowBytes = 0;
    std::int64_t SliceBytes = 0;
  };

  RepeatPeriod(std::shared_ptr<BrickSource> inner, const VolumeInfo& outer, const Int3& pitch,
    const Int3& repetitions, double background, std::int64_t wholeLevelLimit, std::uint64_t budget);

  /// Reads a box of voxels inside a level of the repeated volume.
  Status ReadVoxels(int level, std::uint32_t time, const VoxelBox& box, const Target& target);
  /// Conservative range of such a box, which isn't empty.
  Result<ValueRange> RangeOfVoxels(int level, std::uint32_t time, const VoxelBox& box);

  const std::shared_ptr<BrickSource>& Inner() const { return this->Inner_; }
  std::uint64_t MemoryUsed() const;
  /// Five eighths for bricks and cubes, a quarter for whole levels, of which the last one always
  /// stays, an eighth for ranges. No budget changes a voxel or a range.
  void SetMemoryBudget(std::uint64_t bytes);

private:
  /// One axis of one level.
  struct Axis
  {
    std::int64_t Voxels = 0; ///< of the level
    std::int64_t Period = 1; ///< in voxels of the level
    std::int64_t Classes = 1;
    std::int64_t Group = 1; ///< from the level before
    std::int64_t Full = 0;  ///< inner-backed: classes wholly inside the inner volume
    std::int64_t Touch = 0; ///< inner-backed: classes at least partly inside of it

    std::int64_t ClassOf(std::int64_t voxel) const;
    std::int64_t VoxelOf(std::int64_t classIndex) const;
  };
  struct Level
  {
    std::array<Axis, 3> Axes;
    bool InnerBacked = false; ///< by the inner level of the same number
    bool Whole = false;       ///< few classes: kept as a whole

    Int3 Classes() const
    {
      return { this->Axes[0].Classes, this->Axes[1].Classes, this->Axes[2].Classes };
    }
  };
  /// All classes of a level, and their ranges by cells.
  struct WholeLevel
  {
    std::vector<std::byte> Voxels;
    CellRanges Ranges;
  };
  /// How a part of a level lies to the inner volume.
  enum class Part
  {
    Inside,
    Across,
    Background
  };
  /// The classes that a run of voxels needs, each once: all of the axis, or those of the voxels in
  /// their order.
  struct Window
  {
    std::vector<std::pair<std::int64_t, std::int64_t>> Runs; ///< [first, last) classes
    std::int64_t Length = 0;
    bool Whole = false;
  };

  static Window MakeWindow(const Axis& axis, std::int64_t low, std::int64_t high);
  template <typename F>
  static Status ForEachRun(const std::array<Window, 3>& windows, const F& f);

  Status ReadClasses(int level, std::uint32_t time, const VoxelBox& box, const Target& target);
  Status ReadScattered(int level, std::uint32_t time, const VoxelBox& box, const Target& target);
  template <typename F>
  Status ForEachPart(int level, const VoxelBox& box, const F& f) const;
  Status ReadInner(int level, std::uint32_t time, const VoxelBox& box, const Target& target);
  Status ReadMade(int level, std::uint32_t time, const VoxelBox& box, const Target& target);
  void FillBackground(const VoxelBox& box, const Target& target) const;
  Result<BrickPointer> RequireInnerBrick(const BrickKey& key);
  Result<BrickPointer> RequireCube(const BrickKey& key);
  Status MakeClasses(int level, std::uint32_t time, const VoxelBox& classes, const Target& target);
  Result<std::shared_ptr<const WholeLevel>> RequireWhole(int level, std::uint32_t time);
  CellRanges::ScanFunction ScanOf(const std::vector<std::byte>& voxels, const Int3& dims) const;

  Result<ValueRange> RangeOfClasses(int level, std::uint32_t time, const VoxelBox& box);
  Result<ValueRange> RangeOfParts(int level, std::uint32_t time, const VoxelBox& box);
  Result<ValueRange> RangeOfInner(int level, std::uint32_t time, const VoxelBox& box);
  Result<std::vector<ValueRange>> RequireInnerRanges(const BrickKey& first, const Int3& count);
  void Keep(const BrickKey& key, const BrickPointer& brick);
  std::int64_t VoxelBytes() const;

  const std::shared_ptr<BrickSource> Inner_;
  const VolumeInfo Outer;
  const double Background;
  std::vector<std::byte> BackgroundVoxel;
  std::vector<Level> Levels;
  BrickCache Cache;               // inner bricks (volume 0) and cubes (volume 1)
  std::recursive_mutex MakeMutex; // held while cubes and whole levels are made
  mutable std::mutex WholeMutex;
  std::map<std::pair<int, std::uint32_t>, std::shared_ptr<const WholeLevel>> WholeLevels;
  std::uint64_t WholeBytes = 0;
  mutable std::mutex RangesMutex;
  std::map<BrickKey, std::vector<ValueRange>> InnerRanges; // whole page levels
  std::uint64_t RangesBytes = 0;
  std::atomic<std::uint64_t> Budget;
};

} // namespace teravox
