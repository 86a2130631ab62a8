// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "vtkCallbackVolumeSource.h"

#include "LevelsBrickSource.h"
#include "VTKScalarType.h"
#include "WaitScope.h"

#include <algorithm>
#include <utility>
#include <vtkObjectFactory.h>

vtkStandardNewMacro(vtkCallbackVolumeSource);

template <typename T>
void vtkCallbackVolumeSource::Set(T& member, const T& value)
{
  if (member != value)
  {
    member = value;
    this->BrickSourceModified();
  }
}

void vtkCallbackVolumeSource::SetReadFunction(ReadFunction function)
{
  this->Function = std::move(function);
  this->BrickSourceModified();
}

void vtkCallbackVolumeSource::SetWaitFunctions(void* (*begin)(), void (*end)(void*))
{
  teravox::SetWaitHooks({ begin, end });
}

void vtkCallbackVolumeSource::ClearLevels()
{
  this->Levels.clear();
  this->BrickSourceModified();
}

void vtkCallbackVolumeSource::AddLevel(const long long dimensions[3], const long long factor[3])
{
  GivenLevel level{};
  std::copy_n(dimensions, 3, level.Dimensions);
  std::copy_n(factor, 3, level.Factor);
  this->Levels.push_back(level);
  this->BrickSourceModified();
}

void vtkCallbackVolumeSource::SetScalarType(int type)
{
  this->Set(this->ScalarType, type);
}

void vtkCallbackVolumeSource::SetNumberOfComponents(int components)
{
  this->Set(this->NumberOfComponents, components);
}

void vtkCallbackVolumeSource::SetLabels(bool labels)
{
  this->Set(this->Labels, labels);
}

void vtkCallbackVolumeSource::SetScalarRange(double minimum, double maximum)
{
  this->Set(this->ScalarRange[0], minimum);
  this->Set(this->ScalarRange[1], maximum);
}

void vtkCallbackVolumeSource::SetOrigin(double x, double y, double z)
{
  this->Set(this->Origin[0], x);
  this->Set(this->Origin[1], y);
  this->Set(this->Origin[2], z);
}

void vtkCallbackVolumeSource::SetSpacing(double x, double y, double z)
{
  this->Set(this->Spacing[0], x);
  this->Set(this->Spacing[1], y);
  this->Set(this->Spacing[2], z);
}

void vtkCallbackVolumeSource::SetBrickSize(int size)
{
  this->Set(this->BrickSize, std::clamp(size, 2, 1024));
}

void vtkCallbackVolumeSource::SetArrayName(const char* name)
{
  this->Set(this->ArrayName, std::string(name ? name : ""));
}

void vtkCallbackVolumeSource::SetName(const char* name)
{
  this->Set(this->Name, std::string(name ? name : ""));
}

std::shared_ptr<teravox::BrickSource> vtkCallbackVolumeSource::MakeBrickSource(std::string& reason)
{
  const auto type = teravox::FromVTK(this->ScalarType);
  if (!type)
  {
    reason = std::string("The scalar type ") + vtkImageScalarTypeNameMacro(this->ScalarType) +
      " isn't one that volumes have.";
    return nullptr;
  }
  teravox::LevelsDescription description;
  if (this->Function)
  {
    description.Read = [read = this->Function](int level, const teravox::Int3& first,
                         const teravox::Int3& size, void* out) -> teravox::Status
    {
      const long long low[3] = { first[0], first[1], first[2] };
      const long long count[3] = { size[0], size[1], size[2] };
      const std::string why = read(level, low, count, out);
      return why.empty() ? teravox::Status()
                         : teravox::Status(teravox::StatusCode::InputOutput, why);
    };
  }
  for (const GivenLevel& given : this->Levels)
  {
    teravox::GivenLevel level;
    std::copy_n(given.Dimensions, 3, level.Dimensions.begin());
    std::copy_n(given.Factor, 3, level.Factor.begin());
    description.Levels.push_back(level);
  }
  description.Type = *type;
  description.Components = this->NumberOfComponents;
  description.BrickSize = this->BrickSize;
  description.Labels = this->Labels;
  if (this->ScalarRange[0] <= this->ScalarRange[1])
  {
    description.Range = { this->ScalarRange[0], this->ScalarRange[1] };
  }
  std::copy_n(this->Origin, 3, description.Origin.begin());
  std::copy_n(this->Spacing, 3, description.Spacing.begin());
  description.ArrayName = this->ArrayName;
  description.Name = this->Name;
  auto source = teravox::LevelsBrickSource::Make(description);
  if (!source.Ok())
  {
    reason = source.GetStatus().Message();
    return nullptr;
  }
  return source.Value();
}

void vtkCallbackVolumeSource::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Name: " << this->Name << "\n";
  os << indent << "ArrayName: " << this->ArrayName << "\n";
  os << indent << "NumberOfGivenLevels: " << this->Levels.size() << "\n";
  os << indent << "ReadFunction: " << (this->Function ? "set" : "(none)") << "\n";
  os << indent << "ScalarType: " << vtkImageScalarTypeNameMacro(this->ScalarType) << "\n";
  os << indent << "NumberOfComponents: " << this->NumberOfComponents << "\n";
  os << indent << "Labels: " << this->Labels << "\n";
  os << indent << "ScalarRange: " << this->ScalarRange[0] << " " << this->ScalarRange[1] << "\n";
  os << indent << "Origin: " << this->Origin[0] << " " << this->Origin[1] << " " << this->Origin[2]
     << "\n";
  os << indent << "Spacing: " << this->Spacing[0] << " " << this->Spacing[1] << " "
     << this->Spacing[2] << "\n";
  os << indent << "BrickSize: " << this->BrickSize << "\n";
}
