// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSourceAdapter.h"

#include <memory>
#include <string>
#include <vector>

namespace teravox
{

/// A volume of which only a part is drawn: the voxels of one source, and beside them where another
/// one, the mask, is above 0. A level's mask is that level of the mask's pyramid. Regions that lie
/// outside of the mask as a whole have no values, so that they are never read; those at its border
/// aren't said to have one value. Thread: as BrickSource.
class MaskedBrickSource final : public BrickSourceAdapter
{
public:
  /// Errors: the mask has several components, another size or other levels than the volume.
  static Result<std::shared_ptr<MaskedBrickSource>> Make(
    std::shared_ptr<BrickSource> source, std::shared_ptr<BrickSource> mask);

  Result<BrickPointer> ReadBrick(const BrickKey& key) override;
  Result<std::vector<ValueRange>> ReadRanges(const BrickKey& first, const Int3& count) override;
  std::uint64_t BytesRead() const override;
  std::uint64_t MemoryUsed() const override;
  /// Each gets the least that it needs; half of the rest is the mask's.
  void SetMemoryBudget(std::uint64_t bytes) override;
  std::uint64_t LeastMemory() const override;

private:
  MaskedBrickSource(std::shared_ptr<BrickSource> source, std::shared_ptr<BrickSource> mask);

  const std::shared_ptr<BrickSource> Mask;
};

} // namespace teravox
