// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "MarchParameters.h"
#include "TransferTable.h"

#include <array>
#include <cstddef>
#include <vector>

namespace teravox
{

/// A blend mode with what belongs to it, in data values.
struct Projection
{
  BlendKind Kind = BlendKind::Composite;
  std::vector<double> IsoValues; ///< of Isosurface, in any order
  double RangeLow = 0;           ///< values outside don't count for Average
  double RangeHigh = 0;
};

/// What a ray holds before it meets anything: colour and transmittance, or in blend modes other
/// than composite what stands there in voxels with so many components.
std::array<float, 4> NewRay(BlendKind kind, int components);

/// More isosurfaces than these aren't drawn.
constexpr std::size_t MaximumIsoValues = MarchParameters::MaximumIsoValues;

/// The function whose table a mode reads as "extinction": composite blending the extinction, the
/// others the opacity as it is, those that add up values opacity times the value's place in
/// `data`, from 0 to 1 (where that isn't known, in the function's own points).
TransferFunction ProjectedFunction(
  TransferFunction function, BlendKind kind, const ValueRange& data);

/// MarchParameters::Projection, IsoValues and IsoColors. `function` and `table` are those of the
/// mode. `unitDistance`: of the user's function. `relative`: voxels are stored relative to their
/// brick, so that how far values lie from 0 doesn't matter.
void SetProjection(MarchParameters& parameters, const Projection& projection,
  const TransferFunction& function, const TransferTable& table, double unitDistance, bool relative);

} // namespace teravox
