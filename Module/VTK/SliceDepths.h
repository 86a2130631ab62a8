// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "ViewGeometry.h"

#include <array>
#include <memory>
#include <vector>
#include <vtkType.h>

class vtkImplicitFunction;

namespace teravox
{

/// Where the rays of a picture first meet the surface on which an implicit function is 0: per
/// pixel, rows from the bottom, the view depth, NaN where there is none. Kept until camera,
/// function or bounds change. Thread: used by the render thread only.
class SliceDepths
{
public:
  /// `bounds`: of the volume in the world; what lies outside isn't looked for. A plane is met
  /// where it is, any other function where its sign changes between two of 256 places along the
  /// ray in the bounds: what it does between them can't be known. Errors: InvalidArgument (singular
  /// matrices).
  Result<std::shared_ptr<const std::vector<double>>> Find(
    const ViewInput& camera, vtkImplicitFunction* function, const std::array<double, 6>& bounds);

private:
  std::shared_ptr<const std::vector<double>> Depths;
  vtkImplicitFunction* Function = nullptr;
  vtkMTimeType FunctionTime = 0;
  std::array<double, 6> Bounds{};
  Matrix4 ViewFromWorld{};
  Matrix4 ClipFromView{};
  int Width = 0;
  int Height = 0;
};

} // namespace teravox
