// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "vtkProceduralVolumeSource.h"

#include "FormulaBrickSource.h"
#include "VTKScalarType.h"

#include <algorithm>
#include <cmath>
#include <vtkObjectFactory.h>

vtkStandardNewMacro(vtkProceduralVolumeSource);

namespace
{

/// Formulas in the order of FunctionType.
teravox::FormulaKind KindOf(int function)
{
  return teravox::AllFormulaKinds.at(static_cast<std::size_t>(function));
}

/// Copies three numbers; true if any changed.
template <typename T>
bool Assign(T to[3], T x, T y, T z)
{
  const bool changed = to[0] != x || to[1] != y || to[2] != z;
  to[0] = x;
  to[1] = y;
  to[2] = z;
  return changed;
}

} // namespace

void vtkProceduralVolumeSource::SetFunction(int function)
{
  function = std::clamp(function, static_cast<int>(CONSTANT), static_cast<int>(SPONGE));
  if (this->Function != function)
  {
    this->Function = function;
    this->BrickSourceModified();
  }
}

void vtkProceduralVolumeSource::SetFunctionName(const char* name)
{
  auto kind = teravox::FormulaKindFromName(name ? name : "");
  if (!kind.Ok())
  {
    vtkErrorMacro(<< kind.GetStatus().Message());
    return;
  }
  const auto& all = teravox::AllFormulaKinds;
  this->SetFunction(
    static_cast<int>(std::find(all.begin(), all.end(), kind.Value()) - all.begin()));
}

const char* vtkProceduralVolumeSource::GetFunctionName()
{
  return teravox::ToString(KindOf(this->Function));
}

void vtkProceduralVolumeSource::SetDimensions(long long x, long long y, long long z)
{
  if (Assign(this->Dimensions, x, y, z))
  {
    this->BrickSourceModified();
  }
}

void vtkProceduralVolumeSource::SetDimensions(const long long dimensions[3])
{
  this->SetDimensions(dimensions[0], dimensions[1], dimensions[2]);
}

void vtkProceduralVolumeSource::GetDimensions(long long dimensions[3])
{
  std::copy_n(this->Dimensions, 3, dimensions);
}

void vtkProceduralVolumeSource::SetScalarType(int type)
{
  if (this->ScalarType != type)
  {
    this->ScalarType = type;
    this->BrickSourceModified();
  }
}

void vtkProceduralVolumeSource::SetOutputRange(double minimum, double maximum)
{
  if (this->OutputRange[0] != minimum || this->OutputRange[1] != maximum)
  {
    this->OutputRange[0] = minimum;
    this->OutputRange[1] = maximum;
    this->BrickSourceModified();
  }
}

void vtkProceduralVolumeSource::SetOrigin(double x, double y, double z)
{
  if (Assign(this->Origin, x, y, z))
  {
    this->BrickSourceModified();
  }
}

void vtkProceduralVolumeSource::SetSpacing(double x, double y, double z)
{
  if (Assign(this->Spacing, x, y, z))
  {
    this->BrickSourceModified();
  }
}

void vtkProceduralVolumeSource::SetBrickSize(int size)
{
  size = std::clamp(size, 2, 1024);
  if (this->BrickSize != size)
  {
    this->BrickSize = size;
    this->BrickSourceModified();
  }
}

std::shared_ptr<teravox::BrickSource> vtkProceduralVolumeSource::MakeBrickSource(
  std::string& reason)
{
  const auto type = teravox::FromVTK(this->ScalarType);
  if (!type)
  {
    reason = std::string("The scalar type ") + vtkImageScalarTypeNameMacro(this->ScalarType) +
      " isn't one that volumes have.";
    return nullptr;
  }
  teravox::FormulaDescription formula;
  for (std::size_t a = 0; a < 3; ++a)
  {
    formula.Dimensions[a] = this->Dimensions[a];
    formula.Origin[a] = this->Origin[a];
    formula.Spacing[a] = this->Spacing[a];
    if (this->Dimensions[a] < 1 || !(this->Spacing[a] > 0.0) || !std::isfinite(this->Spacing[a]))
    {
      reason = "A volume needs at least one voxel and a spacing above 0 along each axis; axis " +
        std::to_string(a) + " has " + std::to_string(this->Dimensions[a]) +
        " voxels and the spacing " + std::to_string(this->Spacing[a]) + ".";
      return nullptr;
    }
  }
  const teravox::FormulaKind kind = KindOf(this->Function);
  formula.Field = teravox::MakeFormula(kind, formula.Dimensions);
  formula.Type = *type;
  if (this->OutputRange[0] <= this->OutputRange[1])
  {
    formula.Output = { this->OutputRange[0], this->OutputRange[1] };
  }
  formula.BrickSize = this->BrickSize;
  formula.Name = std::string("formula:") + teravox::ToString(kind);
  auto source = teravox::FormulaBrickSource::Make(formula);
  if (!source.Ok())
  {
    reason = source.GetStatus().Message();
    return nullptr;
  }
  return source.Value();
}

void vtkProceduralVolumeSource::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Function: " << this->GetFunctionName() << "\n";
  os << indent << "Dimensions: " << this->Dimensions[0] << " " << this->Dimensions[1] << " "
     << this->Dimensions[2] << "\n";
  os << indent << "ScalarType: " << vtkImageScalarTypeNameMacro(this->ScalarType) << "\n";
  os << indent << "OutputRange: " << this->OutputRange[0] << " " << this->OutputRange[1] << "\n";
  os << indent << "Origin: " << this->Origin[0] << " " << this->Origin[1] << " " << this->Origin[2]
     << "\n";
  os << indent << "Spacing: " << this->Spacing[0] << " " << this->Spacing[1] << " "
     << this->Spacing[2] << "\n";
  os << indent << "BrickSize: " << this->BrickSize << "\n";
}
