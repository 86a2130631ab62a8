// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSourceAdapter.h"
#include "TransferTable.h"

#include <memory>

namespace teravox
{

/// The marcher computes in floats: squares of gradients and nodes per unit of value must neither
/// overflow nor vanish. So floating-point volumes whose largest finite magnitude is known and far
/// from 1 are drawn as if their values were 2^-exponent times what they are. Returns that exponent,
/// 0 for all others. Exact but for what lies below the smallest number of the type.
int ScaleExponent(const VolumeInfo& info);

/// A floating-point source with all values multiplied by 2^-exponent. Everything else is that of
/// the other source. Thread: as BrickSource.
class ScaledBrickSource final : public BrickSourceAdapter
{
public:
  ScaledBrickSource(std::shared_ptr<BrickSource> source, int exponent);

  Result<BrickPointer> ReadBrick(const BrickKey& key) override;
  Result<std::vector<ValueRange>> ReadRanges(const BrickKey& first, const Int3& count) override;

private:
  int Exponent;
};

/// The function over values that are scaled in that way.
TransferFunction ScaleTransferFunction(TransferFunction function, int exponent);

} // namespace teravox
