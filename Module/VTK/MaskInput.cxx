// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "MaskInput.h"

#include "ArrayBrickSource.h"
#include "ImageBrickSource.h"
#include "MaskedBrickSource.h"
#include "VTKScalarType.h"
#include "vtkBrickSource.h"

#include <vtkDataArray.h>
#include <vtkImageData.h>

namespace teravox
{

namespace
{
Result<std::shared_ptr<BrickSource>> MakeMaskSource(
  const VolumeInfo& volume, vtkImageData* image, vtkDataArray* array, bool cellData, bool labels)
{
  const auto type = FromVTK(array->GetDataType());
  if (!type || !array->HasStandardMemoryLayout())
  {
    return Status(StatusCode::Unsupported,
      std::string("A mask of type ") + array->GetDataTypeAsString() +
        " can't be used; integers of 8, 16 and 32 bits, float and double in VTK's standard memory "
        "layout can.");
  }
  const vtkSmartPointer<vtkDataArray> kept = array;
  ArrayDescription description;
  const int* extent = image->GetExtent();
  std::int64_t voxels = 1;
  for (std::size_t a = 0; a < 3; ++a)
  {
    description.Dimensions[a] =
      std::int64_t{ extent[2 * a + 1] } - extent[2 * a] + (cellData ? 0 : 1);
    voxels *= description.Dimensions[a];
  }
  if (array->GetNumberOfTuples() != voxels)
  {
    return Status(StatusCode::InvalidArgument,
      "The mask's scalars are " + std::to_string(array->GetNumberOfTuples()) +
        ", but its image has " + std::to_string(voxels) + " voxels.");
  }
  description.Data = array->GetVoidPointer(0);
  description.Owner = std::shared_ptr<const void>(description.Data, [kept](const void*) {});
  description.Type = *type;
  description.Components = array->GetNumberOfComponents();
  description.Mask = !labels;
  description.Labels = labels;
  description.Name =
    array->GetName() ? "\"" + std::string(array->GetName()) + "\"" : "without a name";
  if (description.Dimensions == volume.Layout.Dimensions(0))
  {
    description.Layout = volume.Layout;
  }
  auto made = ArrayBrickSource::Make(description);
  if (!made)
  {
    return made.GetStatus();
  }
  return std::shared_ptr<BrickSource>(made.Value());
}
} // namespace

bool MaskInput::Key::operator==(const Key& o) const
{
  return this->Source == o.Source && this->Image == o.Image && this->ImageTime == o.ImageTime &&
    this->Array == o.Array && this->ArrayTime == o.ArrayTime && this->Pyramid == o.Pyramid &&
    this->Labels == o.Labels;
}

std::shared_ptr<BrickSource> MaskInput::Find(const std::shared_ptr<BrickSource>& source,
  vtkImageData* mask, std::vector<std::int64_t> labels, std::string& error)
{
  bool cellData = false;
  vtkDataArray* array = FindScalars(mask, cellData);
  if (!array)
  {
    error = "The mask has no active scalars.";
    return nullptr;
  }
  Key key;
  key.Source = source;
  key.Image = mask;
  key.ImageTime = mask->GetMTime();
  key.Array = array;
  key.ArrayTime = array->GetMTime();
  const vtkBrickSource* holder = vtkBrickSource::Get(array);
  key.Pyramid = holder ? holder->GetBrickSource() : nullptr;
  key.Labels = std::move(labels);
  if (this->Masked && this->Made == key)
  {
    return this->Masked;
  }
  this->Masked = nullptr;
  this->Made = {};
  Result<std::shared_ptr<BrickSource>> voxels = key.Pyramid
    ? Result<std::shared_ptr<BrickSource>>(key.Pyramid)
    : MakeMaskSource(source->Info(), mask, array, cellData, !key.Labels.empty());
  if (!voxels)
  {
    error = voxels.GetStatus().Message();
    return nullptr;
  }
  auto masked = key.Labels.empty()
    ? MaskedBrickSource::Make(source, voxels.Value())
    : MaskedBrickSource::MakeLabels(source, voxels.Value(), key.Labels);
  if (!masked)
  {
    error = masked.GetStatus().Message();
    return nullptr;
  }
  this->Made = key;
  this->Masked = masked.Value();
  return this->Masked;
}

} // namespace teravox
