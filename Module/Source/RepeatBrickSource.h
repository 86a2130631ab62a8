// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"

#include <memory>
#include <string>

namespace teravox
{

/// What is repeated, how often, and in which cell.
struct RepeatDescription
{
  std::shared_ptr<BrickSource> Inner;
  Int3 Repetitions{ 1, 1, 1 };
  /// Voxels from one copy to the next, at least the inner dimensions; what lies between two copies
  /// is background. 0 takes the inner dimensions. Multiples of a power of two are fast: their
  /// levels are the inner source's own (AlignedPitch()).
  Int3 Pitch{ 0, 0, 0 };
  double Background = 0; ///< a value of the inner type
  int BrickSize = 0;     ///< 0 takes the inner one
  std::uint64_t MemoryBudget = std::uint64_t{ 64 } << 20;
  /// Levels of which one period has at most so many voxels are kept whole, with exact ranges.
  std::int64_t WholeLevelLimit = std::int64_t{ 1 } << 18;
  std::string Name; ///< empty: made of the inner name
};

class RepeatPeriod;

/// Repeats a volume along each axis: the largest volumes that can be made of real data (1.3e12
/// voxels of one brain).
///
/// Voxels are those of the pyramid that the array of all copies would have, bit for bit: a level's
/// voxels repeat with the period pitch / gcd(pitch, factor). Levels that fit the pitch are the
/// inner source's levels, except for groups that reach over an end of the inner volume; all other
/// voxels are made from the level before and cached by cubes of one period. Where the factor
/// doesn't divide the pitch a level costs as much as one whole copy, once. Thread: as BrickSource.
class RepeatBrickSource : public BrickSource
{
public:
  /// Errors: no inner source, a pitch below the inner dimensions, 2^31 voxels or more along an
  /// axis, a background outside of the type.
  static Result<std::shared_ptr<RepeatBrickSource>> Make(const RepeatDescription& repeat);
  RepeatBrickSource(const RepeatBrickSource&) = delete;
  RepeatBrickSource& operator=(const RepeatBrickSource&) = delete;
  RepeatBrickSource(RepeatBrickSource&&) = delete;
  RepeatBrickSource& operator=(RepeatBrickSource&&) = delete;
  ~RepeatBrickSource() override;

  /// The inner dimensions rounded up to multiples, e.g. 301 x 370 x 316 to 320 x 384 x 320 for 64.
  static Int3 AlignedPitch(const Int3& dimensions, std::int64_t multiple);

  const VolumeInfo& Info() const override { return this->Info_; }
  Result<BrickPointer> ReadBrick(const BrickKey& key) override;
  /// Conservative: the ranges of the inner bricks that the region covers; exact for levels that are
  /// kept whole.
  Result<std::vector<ValueRange>> ReadRanges(const BrickKey& first, const Int3& count) override;
  std::uint64_t BytesRead() const override;
  std::uint64_t MemoryUsed() const override;
  void SetMemoryBudget(std::uint64_t bytes) override;
  std::uint64_t LeastMemory() const override;

private:
  RepeatBrickSource(VolumeInfo info, std::unique_ptr<RepeatPeriod> period);

  const VolumeInfo Info_;
  const std::unique_ptr<RepeatPeriod> Period;
};

} // namespace teravox
