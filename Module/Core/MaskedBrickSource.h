// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSourceAdapter.h"

#include <memory>
#include <string>
#include <vector>

namespace teravox
{

/// The voxels of one source, and beside them what another one, the mask, makes of them. A level's
/// mask is that level of the mask's pyramid. Thread: as BrickSource.
///
/// Binary masks: what is drawn is where the mask is above 0. Regions that lie outside of it as a
/// whole have no values, so that they are never read; those at its border aren't said to have one
/// value. Label masks: of each voxel which of the labels that have names it belongs to
/// (Brick::Mask), values rounded down to integers, NaN as 0. No region is said to have one value.
/// If there are more than 254 names, volumes of 8 bits become such of 16, which have room for them.
class MaskedBrickSource final : public BrickSourcePair
{
public:
  /// Errors: the mask has several components, another size or other levels than the volume.
  static Result<std::shared_ptr<MaskedBrickSource>> Make(
    std::shared_ptr<BrickSource> source, std::shared_ptr<BrickSource> mask);
  /// A label mask. `names`: ascending, each once. Errors: also coarser levels of the mask that
  /// aren't by mode, more names than MostNames.
  static Result<std::shared_ptr<MaskedBrickSource>> MakeLabels(std::shared_ptr<BrickSource> source,
    std::shared_ptr<BrickSource> mask, std::vector<std::int64_t> names);
  static constexpr std::size_t MostNames = 65534;

  Result<BrickPointer> ReadBrick(const BrickKey& key) override;
  Result<std::vector<ValueRange>> ReadRanges(const BrickKey& first, const Int3& count) override;

private:
  MaskedBrickSource(std::shared_ptr<BrickSource> source, std::shared_ptr<BrickSource> mask);
  void TakeLabels(const Brick& mask, Brick& masked) const;

  std::vector<std::int64_t> Names; ///< of labels
};

} // namespace teravox
