// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vtkShaderProperty.h>
#include <vtkUniforms.h>
#include <vtkVolume.h>

namespace teravox
{

/// Whether a volume has shader code, replacements or uniforms of its own: written for the shaders
/// of VTK's mapper, and of no use for others.
inline bool HasShaderReplacements(vtkVolume* volume)
{
  vtkShaderProperty* property = volume->GetShaderProperty();
  return property &&
    (property->HasVertexShaderCode() || property->HasFragmentShaderCode() ||
      property->HasGeometryShaderCode() || property->GetNumberOfShaderReplacements() > 0 ||
      property->GetVertexCustomUniforms()->GetNumberOfUniforms() > 0 ||
      property->GetFragmentCustomUniforms()->GetNumberOfUniforms() > 0 ||
      property->GetGeometryCustomUniforms()->GetNumberOfUniforms() > 0);
}

} // namespace teravox
