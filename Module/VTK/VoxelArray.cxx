// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "VoxelArray.h"

#include "VTKScalarType.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <vtkAbstractArray.h>

namespace teravox
{

vtkSmartPointer<vtkDataArray> NewVoxelArray(const VolumeInfo& info, const Int3& size)
{
  vtkSmartPointer<vtkDataArray> array;
  array.TakeReference(vtkDataArray::CreateDataArray(ToVTK(info.Type)));
  array->SetName(info.ArrayName.c_str());
  array->SetNumberOfComponents(info.Components);
  double values = info.Components;
  std::int64_t exact = info.Components;
  for (const std::int64_t n : size)
  {
    values *= static_cast<double>(n);
    if (values * array->GetDataTypeSize() >
      static_cast<double>(std::numeric_limits<std::int64_t>::max() / 2))
    {
      return nullptr;
    }
    exact *= n;
  }
  const auto bytes =
    static_cast<std::size_t>(exact) * static_cast<std::size_t>(array->GetDataTypeSize());
  void* const memory = std::malloc(std::max<std::size_t>(bytes, 1));
  if (!memory)
  {
    return nullptr;
  }
  array->SetVoidArray(memory, exact, 0, vtkAbstractArray::VTK_DATA_ARRAY_FREE);
  return array;
}

} // namespace teravox
