// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Scene.h"

#include <functional>
#include <string>
#include <vtkVolumeProperty.h>

namespace teravox::test
{

/// Sets a stage, one after the other, in each of the ways in which rays are integrated, and calls f
/// with the way's name, a comma before it.
inline void ForEachWay(Stage& stage, const std::function<void(const std::string&)>& f)
{
  for (const bool nearest : { false, true })
  {
    for (const bool shade : { false, true })
    {
      stage.Property->SetInterpolationType(
        nearest ? VTK_NEAREST_INTERPOLATION : VTK_LINEAR_INTERPOLATION);
      stage.SetShade(shade);
      f(std::string(nearest ? ", nearest" : ", linear") + (shade ? ", shaded" : ""));
    }
  }
}

} // namespace teravox::test
