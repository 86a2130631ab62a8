// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TruthLevelOfDetail.h"

#include <algorithm>
#include <cmath>

namespace teravox
{

TruthLevelOfDetail::TruthLevelOfDetail(
  const TruthVolume& volume, const TruthCamera& camera, double bias, int minimum, int maximum)
{
  const int last = std::clamp(maximum, 0, volume.NumberOfLevels() - 1);
  this->Minimum = std::clamp(minimum, 0, last);
  const double scale = std::exp2(bias);
  this->WidthAt0 = scale * camera.PixelWidth(0);
  this->WidthPerDepth =
    camera.IsParallel() ? 0 : scale * (camera.PixelWidth(1) - camera.PixelWidth(0));
  for (int level = this->Minimum + 1; level <= last; ++level)
  {
    double edge = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      if (volume.Level(level).Factor[axis] > 1)
      {
        edge = std::max(edge, volume.VoxelEdge(level, axis));
      }
    }
    this->Steps.push_back({ edge, level });
    if (!camera.IsParallel())
    {
      this->Boundaries.push_back((edge - this->WidthAt0) / this->WidthPerDepth);
    }
  }
  std::sort(this->Boundaries.begin(), this->Boundaries.end());
}

TruthLevelOfDetail::TruthLevelOfDetail(int level)
  : Minimum(level)
{
}

int TruthLevelOfDetail::LevelAtDepth(double depth) const
{
  const double width = this->WidthAt0 + this->WidthPerDepth * depth;
  int result = this->Minimum;
  for (const Step& step : this->Steps)
  {
    if (step.Edge <= width)
    {
      result = step.Level;
    }
  }
  return result;
}

} // namespace teravox
