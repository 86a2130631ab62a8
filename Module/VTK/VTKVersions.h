// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vtkGPUVolumeRayCastMapper.h>
#include <vtkVersionMacros.h>
#include <vtkVolumeProperty.h>

/// All that differs between the versions of VTK that this is built with: 9.1, and the 9.2 inside
/// ParaView 5.11.
namespace teravox
{

/// Calls check(differs, name) for each setting that VTK 9.1 doesn't have and that isn't supported.
template <typename Check>
void CheckNewerSettings(
  vtkGPUVolumeRayCastMapper* mapper, vtkVolumeProperty* property, const Check& check)
{
#if VTK_VERSION_NUMBER >= VTK_VERSION_CHECK(9, 2, 0)
  check(mapper->GetComputeNormalFromOpacity(), "ComputeNormalFromOpacity");
  check(mapper->GetGlobalIlluminationReach() != 0, "GlobalIlluminationReach");
  check(mapper->GetVolumetricScatteringBlending() != 0, "VolumetricScatteringBlending");
  check(property->GetScatteringAnisotropy() != 0, "ScatteringAnisotropy");
#else
  static_cast<void>(mapper);
  static_cast<void>(property);
  static_cast<void>(check);
#endif
}

} // namespace teravox
