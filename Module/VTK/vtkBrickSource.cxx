// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "vtkBrickSource.h"

#include "BrickSource.h"
#include "VTKScalarType.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vtkAbstractArray.h>
#include <vtkInformation.h>
#include <vtkInformationObjectBaseKey.h>
#include <vtkObjectFactory.h>
#include <vtkWeakPointer.h>

class vtkBrickSource::vtkInternals
{
public:
  std::shared_ptr<teravox::BrickSource> Source;
  vtkWeakPointer<vtkAbstractArray> Array;
  int Level = 0;
  std::array<long long, 3> FirstVoxel{ 0, 0, 0 };
  std::array<long long, 3> Dimensions{ 0, 0, 0 };
};

vtkStandardNewMacro(vtkBrickSource);
vtkInformationKeyMacro(vtkBrickSource, BRICK_SOURCE, ObjectBase);

vtkBrickSource::vtkBrickSource()
  : Internals(std::make_unique<vtkInternals>())
{
}

vtkBrickSource::~vtkBrickSource() = default;

void vtkBrickSource::SetBrickSource(std::shared_ptr<teravox::BrickSource> source)
{
  if (this->Internals->Source != source)
  {
    this->Internals->Source = std::move(source);
    this->Modified();
  }
}

const std::shared_ptr<teravox::BrickSource>& vtkBrickSource::GetBrickSource() const
{
  return this->Internals->Source;
}

void vtkBrickSource::SetPresentation(
  int level, const long long firstVoxel[3], const long long dimensions[3])
{
  this->Internals->Level = level;
  std::copy_n(firstVoxel, 3, this->Internals->FirstVoxel.begin());
  std::copy_n(dimensions, 3, this->Internals->Dimensions.begin());
  this->Modified();
}

int vtkBrickSource::GetPresentedLevel() const
{
  return this->Internals->Level;
}

void vtkBrickSource::GetPresentedFirstVoxel(long long firstVoxel[3]) const
{
  std::copy_n(this->Internals->FirstVoxel.begin(), 3, firstVoxel);
}

void vtkBrickSource::GetPresentedDimensions(long long dimensions[3]) const
{
  std::copy_n(this->Internals->Dimensions.begin(), 3, dimensions);
}

int vtkBrickSource::GetNumberOfLevels() const
{
  const auto& source = this->Internals->Source;
  return source ? source->Info().Layout.NumberOfLevels() : 0;
}

void vtkBrickSource::GetLevelDimensions(int level, long long dimensions[3]) const
{
  std::fill_n(dimensions, 3, 0);
  if (level >= 0 && level < this->GetNumberOfLevels())
  {
    const auto& size = this->Internals->Source->Info().Layout.Dimensions(level);
    std::copy_n(size.begin(), 3, dimensions);
  }
}

int vtkBrickSource::GetNumberOfComponents() const
{
  const auto& source = this->Internals->Source;
  return source ? source->Info().Components : 0;
}

int vtkBrickSource::GetScalarType() const
{
  const auto& source = this->Internals->Source;
  return source ? teravox::ToVTK(source->Info().Type) : VTK_VOID;
}

void vtkBrickSource::GetScalarRange(double range[2]) const
{
  range[0] = 0.0;
  range[1] = -1.0;
  const auto& source = this->Internals->Source;
  if (source && source->Info().Range.IsKnown() && !source->Info().Range.IsVoid())
  {
    range[0] = source->Info().Range.Min;
    range[1] = source->Info().Range.Max;
  }
}

void vtkBrickSource::Attach(vtkAbstractArray* array)
{
  vtkAbstractArray* previous = this->Internals->Array;
  if (previous && previous != array && vtkBrickSource::Get(previous) == this)
  {
    previous->GetInformation()->Remove(vtkBrickSource::BRICK_SOURCE());
  }
  this->Internals->Array = array;
  if (array)
  {
    array->GetInformation()->Set(vtkBrickSource::BRICK_SOURCE(), this);
  }
}

vtkBrickSource* vtkBrickSource::Get(vtkAbstractArray* array)
{
  if (!array || !array->HasInformation())
  {
    return nullptr;
  }
  auto* holder =
    vtkBrickSource::SafeDownCast(array->GetInformation()->Get(vtkBrickSource::BRICK_SOURCE()));
  return holder && holder->Internals->Array == array ? holder : nullptr;
}

void vtkBrickSource::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  const auto& source = this->Internals->Source;
  os << indent << "BrickSource: " << (source ? source->Info().Name.c_str() : "(none)") << "\n";
  os << indent << "NumberOfLevels: " << this->GetNumberOfLevels() << "\n";
  os << indent << "PresentedLevel: " << this->Internals->Level << "\n";
  os << indent << "PresentedFirstVoxel: " << this->Internals->FirstVoxel[0] << " "
     << this->Internals->FirstVoxel[1] << " " << this->Internals->FirstVoxel[2] << "\n";
  os << indent << "PresentedDimensions: " << this->Internals->Dimensions[0] << " "
     << this->Internals->Dimensions[1] << " " << this->Internals->Dimensions[2] << "\n";
}
