// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "vtkBrickSource.h"

#include "BrickSource.h"
#include "PresentedLevel.h"
#include "ReadBox.h"
#include "VTKScalarType.h"
#include "VoxelArray.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vtkAbstractArray.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkInformationObjectBaseKey.h>
#include <vtkMatrix3x3.h>
#include <vtkObjectFactory.h>
#include <vtkSmartPointer.h>
#include <vtkWeakPointer.h>

class vtkBrickSource::vtkInternals
{
public:
  std::shared_ptr<teravox::BrickSource> Source;
  std::shared_ptr<teravox::BrickSeries> Series;
  int Step = 0;
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

void vtkBrickSource::SetBrickSeries(std::shared_ptr<teravox::BrickSeries> series, int step)
{
  this->Internals->Series = std::move(series);
  this->Internals->Step = step;
  this->Modified();
}

const std::shared_ptr<teravox::BrickSeries>& vtkBrickSource::GetBrickSeries() const
{
  return this->Internals->Series;
}

int vtkBrickSource::GetStep() const
{
  return this->Internals->Step;
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

bool vtkBrickSource::IsInPlace(vtkImageData* image) const
{
  const vtkInternals& in = *this->Internals;
  if (!in.Source || !image)
  {
    return false;
  }
  const auto made = teravox::PresentedLevel::Make(in.Source->Info(), in.Level);
  if (!made.Ok())
  {
    return false;
  }
  const teravox::PresentedLevel& place = made.Value();
  const teravox::Int3 first = place.VoxelsOf(image->GetExtent()).First;
  return std::equal(first.begin(), first.end(), in.FirstVoxel.begin()) &&
    std::equal(place.Origin.begin(), place.Origin.end(), image->GetOrigin()) &&
    std::equal(place.Spacing.begin(), place.Spacing.end(), image->GetSpacing()) &&
    std::equal(
      place.Direction.begin(), place.Direction.end(), image->GetDirectionMatrix()->GetData());
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

void vtkBrickSource::GetOrigin(double origin[3]) const
{
  const auto& source = this->Internals->Source;
  const teravox::Double3 value = source ? source->Info().Origin : teravox::Double3{ 0, 0, 0 };
  std::copy_n(value.begin(), 3, origin);
}

void vtkBrickSource::GetSpacing(double spacing[3]) const
{
  const auto& source = this->Internals->Source;
  const teravox::Double3 value = source ? source->Info().Spacing : teravox::Double3{ 1, 1, 1 };
  std::copy_n(value.begin(), 3, spacing);
}

bool vtkBrickSource::HasLabels() const
{
  const auto& source = this->Internals->Source;
  return source && source->Info().Labels;
}

std::string vtkBrickSource::GetName() const
{
  const auto& source = this->Internals->Source;
  return source ? source->Info().Name : std::string();
}

vtkDataArray* vtkBrickSource::ReadVoxels(
  int level, const long long first[3], const long long size[3])
{
  const auto source = this->Internals->Source;
  bool inside = source && level >= 0 && level < this->GetNumberOfLevels();
  teravox::Int3 low{};
  teravox::Int3 count{};
  double voxels = 1;
  for (std::size_t a = 0; a < 3 && inside; ++a)
  {
    low[a] = first[a];
    count[a] = size[a];
    const std::int64_t all = source->Info().Layout.Dimensions(level)[a];
    inside = low[a] >= 0 && count[a] >= 1 && low[a] < all && count[a] <= all - low[a];
    voxels *= static_cast<double>(count[a]);
  }
  if (!inside)
  {
    vtkErrorMacro("There is no such box of voxels in level "
      << level << " of " << (source ? source->Info().Name : std::string("nothing")) << ".");
    return nullptr;
  }
  const teravox::VolumeInfo& info = source->Info();
  vtkSmartPointer<vtkDataArray> array = teravox::NewVoxelArray(info, count);
  if (!array)
  {
    vtkErrorMacro("The memory for " << voxels << " voxels of level " << level << " of " << info.Name
                                    << " can't be had.");
    return nullptr;
  }
  const teravox::ReadBoxReport report =
    teravox::ReadBox(*source, level, low, count, static_cast<std::byte*>(array->GetVoidPointer(0)));
  if (report.FailedBricks > 0)
  {
    vtkErrorMacro(<< report.FirstFailure.Message());
    return nullptr;
  }
  array->Register(nullptr);
  return array;
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
