// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "TruthCamera.h"
#include "TruthVolume.h"

#include <vector>

namespace teravox
{

/// lambda(z): the coarsest level, not beyond `maximum`, whose voxel edge is at most w(z) on every
/// axis that this level has averaged (cumulative factor > 1), and never finer than `minimum`; w(z)
/// is the width of a pixel in world units at view depth z, times 2^bias. Thread: immutable.
class TruthLevelOfDetail
{
public:
  /// `minimum` and `maximum` are clamped to the levels that exist.
  TruthLevelOfDetail(const TruthVolume& volume, const TruthCamera& camera, double bias = 0,
    int minimum = 0, int maximum = 255);

  /// One level everywhere.
  explicit TruthLevelOfDetail(int level);

  int LevelAtDepth(double depth) const;
  /// View depths where the level changes, ascending; empty in parallel projection.
  const std::vector<double>& BoundaryDepths() const { return this->Boundaries; }

private:
  struct Step
  {
    double Edge; ///< coarsest averaged edge: the level may be used where w(z) >= Edge
    int Level;
  };
  std::vector<Step> Steps;
  std::vector<double> Boundaries;
  int Minimum = 0;
  double WidthAt0 = 0;
  double WidthPerDepth = 0;
};

} // namespace teravox
