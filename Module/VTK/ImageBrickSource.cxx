// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ImageBrickSource.h"

#include "VTKScalarType.h"

#include <cmath>
#include <exception>
#include <string>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkMatrix3x3.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>

namespace teravox
{

vtkDataArray* FindScalars(vtkImageData* image, bool& cellData)
{
  vtkDataSetAttributes* const both[2] = { image->GetPointData(), image->GetCellData() };
  for (const int which : { 0, 1 })
  {
    if (vtkDataArray* array = both[which]->GetScalars())
    {
      cellData = which == 1;
      return array;
    }
  }
  for (const int which : { 0, 1 })
  {
    if (both[which]->GetNumberOfArrays() == 1 && both[which]->GetArray(0))
    {
      cellData = which == 1;
      return both[which]->GetArray(0);
    }
  }
  return nullptr;
}

Result<std::shared_ptr<ArrayBrickSource>> MakeImageBrickSource(
  vtkImageData* image, vtkDataArray* array, bool cellData, int brickSize)
{
  const std::string name =
    array->GetName() ? "\"" + std::string(array->GetName()) + "\"" : "without a name";
  const auto type = FromVTK(array->GetDataType());
  if (!type)
  {
    return Status(StatusCode::Unsupported,
      "The array " + name + " has the type " + array->GetDataTypeAsString() +
        "; volumes have integers of 8, 16 and 32 bits and floats of 32 and 64 bits.");
  }
  const vtkIdType tuples = cellData ? image->GetNumberOfCells() : image->GetNumberOfPoints();
  if (array->GetNumberOfTuples() != tuples || tuples < 1)
  {
    return Status(StatusCode::InvalidArgument,
      "The array " + name + " has " + std::to_string(array->GetNumberOfTuples()) +
        " values for an image of " + std::to_string(tuples) + " voxels.");
  }
  vtkSmartPointer<vtkDataArray> kept = array;
  if (!array->HasStandardMemoryLayout())
  {
    try
    {
      kept.TakeReference(vtkDataArray::CreateDataArray(array->GetDataType()));
      kept->DeepCopy(array);
    }
    catch (const std::exception&)
    {
      return Status(StatusCode::ResourceExhausted,
        "The memory for a copy of the array " + name + " can't be had.");
    }
  }
  ArrayDescription description;
  description.Data = kept->GetVoidPointer(0);
  description.Owner =
    std::shared_ptr<const void>(description.Data, [kept](const void*) { static_cast<void>(kept); });
  description.Type = *type;
  description.Components = array->GetNumberOfComponents();
  description.BrickSize = brickSize;
  description.CellData = cellData;
  description.Name = "the array " + name;
  if (array->GetName())
  {
    description.ArrayName = array->GetName();
  }
  const int* extent = image->GetExtent();
  vtkMatrix3x3* direction = image->GetDirectionMatrix();
  if (!(std::abs(direction->Determinant()) > 1e-12))
  {
    return Status(StatusCode::InvalidArgument, "The direction matrix of the image is singular.");
  }
  for (std::size_t a = 0; a < 3; ++a)
  {
    description.Dimensions[a] =
      std::int64_t{ extent[2 * a + 1] } - extent[2 * a] + (cellData ? 0 : 1);
    description.ExtentStart[a] = extent[2 * a];
    description.Spacing[a] = image->GetSpacing()[a];
    if (!(description.Spacing[a] > 0.0) || !std::isfinite(description.Spacing[a]))
    {
      return Status(StatusCode::InvalidArgument,
        "The spacing of the image is " + std::to_string(description.Spacing[a]) + " along axis " +
          std::to_string(a) + "; it must be above 0.");
    }
  }
  for (std::size_t row = 0; row < 3; ++row)
  {
    description.Origin[row] = image->GetOrigin()[row];
    for (std::size_t a = 0; a < 3; ++a)
    {
      const double d = direction->GetElement(static_cast<int>(row), static_cast<int>(a));
      description.Direction[3 * row + a] = d;
      description.Origin[row] +=
        d * description.Spacing[a] * (extent[2 * a] + (cellData ? 0.5 : 0.0));
    }
  }
  return ArrayBrickSource::Make(description);
}

} // namespace teravox
