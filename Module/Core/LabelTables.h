// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "TransferTable.h"

#include <vector>

namespace teravox
{

/// What is drawn of a label by a mask that counts to a share only (vtkGPUVolumeRayCastMapper's
/// MaskBlendFactor), 0..1. VTK 9.1 mixes the opacity and the colour of a sample, each by itself,
/// where without an opacity of its own the volume has no colour; as steps become short, that mixes
/// extinctions. Both functions have one UnitDistance. Gradient opacity: none.
TransferFunction MixLabel(
  const TransferFunction& volume, const TransferFunction& label, double share);

/// The tables of a volume with a label mask, all with the same nodes: [1] that of the function
/// itself, [2 + i] that of its Labels[i]. What [0] says of a range of values (Occupied, Extremes,
/// LargestExtinction) holds for each of the others. Arguments: as BuildTransferTable().
std::vector<TransferTable> BuildLabelTables(
  const TransferFunction& function, const ValueRange& data, bool integers, double smallestStep);

} // namespace teravox
