// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"
#include "ViewGeometry.h"

#include <algorithm>
#include <vtkMatrix4x4.h>

namespace teravox
{

inline Matrix4 ToMatrix(vtkMatrix4x4* m)
{
  Matrix4 result{};
  std::copy_n(m->GetData(), 16, result.begin());
  return result;
}

/// From voxel indices (centres at whole numbers) to the image's space.
inline Matrix4 IndexToDataset(
  const Double3& origin, const Double3& spacing, const double* direction)
{
  Matrix4 m{};
  for (std::size_t i = 0; i < 3; ++i)
  {
    for (std::size_t j = 0; j < 3; ++j)
    {
      m[4 * i + j] = direction[3 * i + j] * spacing[j];
    }
    m[4 * i + 3] = origin[i];
  }
  m[15] = 1;
  return m;
}

inline Matrix4 ScaleAndShift(const Double3& scale, const Double3& shift)
{
  return { scale[0], 0, 0, shift[0], 0, scale[1], 0, shift[1], 0, 0, scale[2], shift[2], 0, 0, 0,
    1 };
}

/// From corner coordinates of level 0 to the volume's space, as the source says.
inline Matrix4 DatasetFromVoxel(const VolumeInfo& info)
{
  return MultiplyMatrices(IndexToDataset(info.Origin, info.Spacing, info.Direction.data()),
    ScaleAndShift({ 1, 1, 1 }, { -0.5, -0.5, -0.5 }));
}

/// Bounds (VTK's six numbers) of a box in corner coordinates of level 0.
inline void BoundsOf(
  const Matrix4& datasetFromVoxel, const Double3& low, const Double3& high, double bounds[6])
{
  for (int corner = 0; corner < 8; ++corner)
  {
    Double3 p{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      p[a] = (corner >> a & 1) != 0 ? high[a] : low[a];
    }
    p = ApplyToPoint(datasetFromVoxel, p);
    for (std::size_t a = 0; a < 3; ++a)
    {
      bounds[2 * a] = corner == 0 || p[a] < bounds[2 * a] ? p[a] : bounds[2 * a];
      bounds[2 * a + 1] = corner == 0 || p[a] > bounds[2 * a + 1] ? p[a] : bounds[2 * a + 1];
    }
  }
}

} // namespace teravox
