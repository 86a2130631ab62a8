// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BlankedArray.h"
#include "BrickSource.h"

#include <memory>
#include <string>
#include <vtkSmartPointer.h>
#include <vtkType.h>

class vtkDataArray;
class vtkDataObject;
class vtkImageData;

namespace teravox
{

/// How a mapper is told what to draw of its input.
struct ArrayChoice
{
  int ScalarMode = 0; ///< VTK_SCALAR_MODE_DEFAULT and so on
  int AccessMode = 0; ///< VTK_GET_ARRAY_BY_ID or VTK_GET_ARRAY_BY_NAME
  int Id = -1;
  std::string Name;
};

/// Why nothing of an input can be drawn, in one sentence that says what there is: the input is
/// none, no image, or empty, or has no such array.
std::string WhyNoArray(vtkDataObject* input, const ArrayChoice& choice);

/// The brick source of the array that a mapper draws, kept as long as nothing of it changes: array,
/// extent, spacing, ghost arrays.
/// Thread: used by the render thread only.
class InputArray
{
public:
  /// Null and an error in one sentence where the array can't be drawn. `note` is set when what is
  /// drawn isn't quite what is asked for, once for each source that is made.
  std::shared_ptr<BrickSource> Find(vtkImageData* image, vtkDataArray* array, bool cellData,
    int brickSize, std::string& error, std::string& note);

private:
  struct Key
  {
    vtkSmartPointer<vtkDataArray> Array;
    vtkMTimeType ArrayTime = 0;
    Blanking Hidden;
    vtkMTimeType PointsTime = 0;
    vtkMTimeType CellsTime = 0;
    Int3 Dimensions{};
    Int3 ExtentStart{};
    Double3 Spacing{};
    int BrickSize = 0;
    bool CellData = false;

    bool operator==(const Key& o) const;
  };

  Key Made;
  std::shared_ptr<BrickSource> Source;
};

} // namespace teravox
