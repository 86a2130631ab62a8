// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSourceAdapter.h"

#include <memory>

namespace teravox
{

/// One scalar per voxel of a source of several components: one of them, or the magnitude of all as
/// a vector. Made when a brick is read, so that caches and atlases hold one component only. A
/// magnitude is a float, or a double of 32-bit integers and doubles; levels are magnitudes of the
/// source's levels; NaN where a component is NaN. Ranges are as wide as those of the source, which
/// are those of all components. Thread: as BrickSource.
class ScalarBrickSource final : public BrickSourceAdapter
{
public:
  static constexpr int Magnitude = -1;
  /// `component`: 0 and up, or Magnitude. Requires: a component that the source has.
  ScalarBrickSource(std::shared_ptr<BrickSource> source, int component);

  Result<BrickPointer> ReadBrick(const BrickKey& key) override;
  Result<std::vector<ValueRange>> ReadRanges(const BrickKey& first, const Int3& count) override;

private:
  ValueRange RangeOf(const ValueRange& all) const;

  int Component;
};

} // namespace teravox
