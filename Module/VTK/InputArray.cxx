// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "InputArray.h"

#include "ArrayBrickSource.h"
#include "VTKScalarType.h"

#include <algorithm>
#include <vtkAbstractMapper.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkImageData.h>
#include <vtkPointData.h>

namespace teravox
{

namespace
{

// `"a", "b" and "c"`; of nothing an empty text.
std::string NamesOf(vtkFieldData* fields)
{
  std::string names;
  const int n = fields->GetNumberOfArrays();
  for (int i = 0; i < n; ++i)
  {
    const char* name = fields->GetArrayName(i);
    names += (i == 0          ? ""
                 : i + 1 == n ? " and "
                              : ", ") +
      (name ? "\"" + std::string(name) + "\"" : std::string("one without a name"));
  }
  return names;
}

std::string WhatThereIs(vtkFieldData* fields, const std::string& of)
{
  const std::string names = NamesOf(fields);
  return names.empty() ? " There are no " + of + " arrays."
                       : " The " + of + " arrays are " + names + ".";
}

} // namespace

std::string WhyNoArray(vtkDataObject* input, const ArrayChoice& choice)
{
  if (!input)
  {
    return "There is no image to draw.";
  }
  auto* image = vtkImageData::SafeDownCast(input);
  if (!image)
  {
    return std::string("The input is a ") + input->GetClassName() +
      "; only images (vtkImageData) can be drawn, others have to be resampled.";
  }
  if (image->GetNumberOfPoints() == 0)
  {
    return "The input image is empty: it has no points.";
  }
  vtkFieldData* fields = image->GetPointData();
  std::string of = "point";
  switch (choice.ScalarMode)
  {
    case VTK_SCALAR_MODE_USE_CELL_DATA:
      return "The cells of the input have no active scalars." +
        WhatThereIs(image->GetCellData(), "cell");
    case VTK_SCALAR_MODE_USE_POINT_DATA:
      return "The points of the input have no active scalars." +
        WhatThereIs(image->GetPointData(), "point");
    case VTK_SCALAR_MODE_USE_POINT_FIELD_DATA:
      break;
    case VTK_SCALAR_MODE_USE_CELL_FIELD_DATA:
      fields = image->GetCellData();
      of = "cell";
      break;
    case VTK_SCALAR_MODE_USE_FIELD_DATA:
      fields = image->GetFieldData();
      of = "field";
      break;
    default:
      return "Neither points nor cells of the input have active scalars." +
        WhatThereIs(image->GetPointData(), "point") + WhatThereIs(image->GetCellData(), "cell");
  }
  const std::string which = choice.AccessMode == VTK_GET_ARRAY_BY_ID
    ? "number " + std::to_string(choice.Id) + " of numbers"
    : "\"" + choice.Name + "\" of numbers";
  return "The input has no " + of + " array " + which + "." + WhatThereIs(fields, of);
}

bool InputArray::Key::operator==(const Key& o) const
{
  return this->Array == o.Array && this->ArrayTime == o.ArrayTime &&
    this->Hidden.Points == o.Hidden.Points && this->Hidden.Cells == o.Hidden.Cells &&
    this->PointsTime == o.PointsTime && this->CellsTime == o.CellsTime &&
    this->Dimensions == o.Dimensions && this->ExtentStart == o.ExtentStart &&
    this->Spacing == o.Spacing && this->BrickSize == o.BrickSize && this->CellData == o.CellData;
}

std::shared_ptr<BrickSource> InputArray::Find(vtkImageData* image, vtkDataArray* array,
  bool cellData, int brickSize, std::string& error, std::string& note)
{
  Key key;
  key.Array = array;
  key.ArrayTime = array->GetMTime();
  key.Hidden = FindBlanking(image);
  key.PointsTime = key.Hidden.Points ? key.Hidden.Points->GetMTime() : 0;
  key.CellsTime = key.Hidden.Cells ? key.Hidden.Cells->GetMTime() : 0;
  const int* extent = image->GetExtent();
  for (std::size_t a = 0; a < 3; ++a)
  {
    key.Dimensions[a] = std::int64_t{ extent[2 * a + 1] } - extent[2 * a] + 1;
    key.Dimensions[a] -= cellData ? 1 : 0;
    key.ExtentStart[a] = extent[2 * a];
    key.Spacing[a] = image->GetSpacing()[a];
  }
  key.BrickSize = brickSize;
  key.CellData = cellData;
  if (this->Source && this->Made == key)
  {
    return this->Source;
  }
  this->Source = nullptr;
  this->Made = {};
  if (extent[0] == extent[1] || extent[2] == extent[3] || extent[4] == extent[5])
  {
    int n[3];
    image->GetDimensions(n);
    error = "The input image has " + std::to_string(n[0]) + " x " + std::to_string(n[1]) + " x " +
      std::to_string(n[2]) + " points: a volume has two at least along each axis.";
    return nullptr;
  }
  if (!FromVTK(array->GetDataType()))
  {
    error = std::string("Scalars of type ") + array->GetDataTypeAsString() +
      " can't be drawn; signed and unsigned integers of 8, 16 and 32 bits, float and double can.";
    return nullptr;
  }
  if (array->GetNumberOfTuples() != key.Dimensions[0] * key.Dimensions[1] * key.Dimensions[2] ||
    !array->HasStandardMemoryLayout())
  {
    error = "The scalars don't have one value per voxel in VTK's standard memory layout.";
    return nullptr;
  }
  vtkSmartPointer<vtkDataArray> drawn = array;
  ArrayDescription description;
  if (key.Hidden.Any())
  {
    const Result<BlankedArray> blanked = MakeBlankedArray(image, array, cellData, key.Hidden);
    if (!blanked)
    {
      error = blanked.GetStatus().Message();
      return nullptr;
    }
    drawn = blanked.Value().Array;
    description.OwnBytes = static_cast<std::uint64_t>(drawn->GetNumberOfValues()) *
      static_cast<std::uint64_t>(drawn->GetDataTypeSize());
    if (blanked.Value().LostCells > 0)
    {
      note = "Hidden cells in parts that are one cell thick take " +
        std::to_string(blanked.Value().LostCells) +
        " of the cells beside them along: points have values, and cells are hidden through them.";
    }
  }
  description.Data = drawn->GetVoidPointer(0);
  description.Owner = std::shared_ptr<const void>(description.Data, [drawn](const void*) {});
  description.Type = *FromVTK(drawn->GetDataType());
  description.Components = drawn->GetNumberOfComponents();
  description.Dimensions = key.Dimensions;
  description.BrickSize = brickSize;
  description.CellData = cellData;
  double range[2];
  // With infinities: the function is sampled for all values.
  description.Range = ValueRange::Void();
  for (int c = 0; c < description.Components; ++c)
  {
    array->GetRange(range, c);
    description.ComponentRanges.push_back({ range[0], range[1] });
    description.Range.Include(description.ComponentRanges.back());
  }
  description.Spacing = key.Spacing;
  description.ExtentStart = key.ExtentStart;
  description.ArrayName = array->GetName() ? array->GetName() : "scalars";
  auto made = ArrayBrickSource::Make(description);
  if (!made)
  {
    error = made.GetStatus().Message();
    return nullptr;
  }
  this->Made = key;
  this->Source = made.Value();
  return this->Source;
}

} // namespace teravox
