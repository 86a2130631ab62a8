// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "ArrayBrickSource.h"
#include "Status.h"

#include <memory>

class vtkDataArray;
class vtkImageData;

namespace teravox
{

/// Makes a brick source of one array of an image, so that an ordinary VTK pipeline can be drawn.
/// The source keeps the array alive and shares its memory; an array in a layout of its own is
/// copied. Requires: the array isn't changed while the source lives. Errors: a type that volumes
/// don't have, a number of tuples that isn't the image's, a spacing that isn't above 0, a singular
/// direction matrix, no memory for the copy.
Result<std::shared_ptr<ArrayBrickSource>> MakeImageBrickSource(
  vtkImageData* image, vtkDataArray* array, bool cellData, int brickSize);

/// The array that is drawn by default: the active scalars of the points, else of the cells, else
/// the only array there is. Null if there is none; `cellData` tells which it is.
vtkDataArray* FindScalars(vtkImageData* image, bool& cellData);

} // namespace teravox
