// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PresentedLevel.h"

#include <algorithm>
#include <limits>
#include <string>

namespace teravox
{

Result<PresentedLevel> PresentedLevel::Make(const VolumeInfo& info, int level)
{
  PresentedLevel image;
  image.CellData = info.CellData;
  image.Direction = info.Direction;
  const Int3& factor = info.Layout.Factor(level);
  const Int3& size = info.Layout.Dimensions(level);
  Double3 shift{}; // of the image's index (0,0,0) from the centre of voxel 0, in level-0 voxels
  for (std::size_t a = 0; a < 3; ++a)
  {
    const std::int64_t first = level == 0 ? info.ExtentStart[a] : 0;
    const std::int64_t last = first + size[a] - (info.CellData ? 0 : 1);
    if (first < std::numeric_limits<int>::min() || last > std::numeric_limits<int>::max())
    {
      return Status(StatusCode::Unsupported,
        "Level " + std::to_string(level) + " of " + info.Name + " has indices from " +
          std::to_string(first) + " to " + std::to_string(last) +
          " along one axis; an image extent has 32 bits, present a coarser level.");
    }
    image.WholeExtent[2 * a] = static_cast<int>(first);
    image.WholeExtent[2 * a + 1] = static_cast<int>(last);
    const double f = static_cast<double>(factor[a]);
    image.Spacing[a] = info.Spacing[a] * f;
    shift[a] = (info.CellData ? -0.5 : (f - 1.0) / 2.0) - static_cast<double>(first) * f;
  }
  for (std::size_t row = 0; row < 3; ++row)
  {
    image.Origin[row] = info.Origin[row];
    for (std::size_t a = 0; a < 3; ++a)
    {
      image.Origin[row] += info.Direction[3 * row + a] * info.Spacing[a] * shift[a];
    }
  }
  return image;
}

PresentedLevel::Box PresentedLevel::VoxelsOf(const int extent[6]) const
{
  Box box;
  for (std::size_t a = 0; a < 3; ++a)
  {
    const std::int64_t first = std::int64_t{ extent[2 * a] } - this->WholeExtent[2 * a];
    const std::int64_t size =
      std::int64_t{ extent[2 * a + 1] } - extent[2 * a] + (this->CellData ? 0 : 1);
    if (size <= 0)
    {
      return {};
    }
    box.First[a] = first;
    box.Size[a] = size;
  }
  return box;
}

} // namespace teravox
