// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Status.h"

#include <cstdint>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>

class vtkDataArray;
class vtkImageData;

namespace teravox
{

/// The ghost arrays (vtkGhostType) of an image that hide something: null where no value is above 0.
/// As VTK 9.1's GPU mapper takes them: whatever the bits say, hidden, duplicate or refined.
struct Blanking
{
  vtkSmartPointer<vtkUnsignedCharArray> Points;
  vtkSmartPointer<vtkUnsignedCharArray> Cells;

  bool Any() const { return this->Points || this->Cells; }
};
Blanking FindBlanking(vtkImageData* image);

/// A copy of an array in which what is hidden has no value (NaN).
struct BlankedArray
{
  vtkSmartPointer<vtkDataArray> Array; ///< float, double for types of 32 and 64 bits but float
  /// Cells that nothing hides but that have lost a corner to a hidden cell beside them.
  std::int64_t LostCells = 0;
};

/// The field between voxels has no value where one of them has none. So of point data all cells
/// around a hidden point are blanked, and of cell data what is interpolated from a hidden cell.
///
/// Hidden cells of point data: a point is taken away where all cells around it are hidden, so that
/// any part of the image that is at least two cells thick, or that lies along the border, is hidden
/// exactly. A cell in thinner parts loses the corner that fewest other cells have; those are lost.
/// Errors: a number of ghosts that isn't the image's, no memory for the copy.
Result<BlankedArray> MakeBlankedArray(
  vtkImageData* image, vtkDataArray* array, bool cellData, const Blanking& blanking);

} // namespace teravox
