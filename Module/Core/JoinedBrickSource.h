// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSourceAdapter.h"

#include <memory>

namespace teravox
{

/// The voxels of two sources as two components of one volume, for functions over both
/// (ComponentMode::Plane). Of two types they become floats, or doubles where floats don't hold
/// them. Thread: as BrickSource.
///
/// Ranges are those of the first component, by which alone it is known whether something may be
/// seen; only where both have one and the same value a region has one. A region in which either has
/// no values has none.
class JoinedBrickSource final : public BrickSourcePair
{
public:
  /// Errors: a source of several components, another size or other levels.
  static Result<std::shared_ptr<JoinedBrickSource>> Make(
    std::shared_ptr<BrickSource> first, std::shared_ptr<BrickSource> second);

  Result<BrickPointer> ReadBrick(const BrickKey& key) override;
  Result<std::vector<ValueRange>> ReadRanges(const BrickKey& first, const Int3& count) override;

private:
  JoinedBrickSource(std::shared_ptr<BrickSource> first, std::shared_ptr<BrickSource> second);
};

} // namespace teravox
