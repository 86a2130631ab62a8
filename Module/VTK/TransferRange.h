// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Types.h"

class vtkColorTransferFunction;
class vtkPiecewiseFunction;

namespace teravox
{

/// What VTK's GPU mapper does to a function before it draws with it, `data` being the range of the
/// scalars. An empty function becomes a ramp over that range: opacity 0 to 0.5, black to white.
/// `native` (vtkGPUVolumeRayCastMapper::NATIVE): the function is stretched from its own range over
/// that of the data. VTK's documentation says that values beyond the function's range are clamped
/// to it, which is what functions do by themselves; VTK 9.1 stretches. Without a finite range of
/// the data nothing is done. Requires: the caller's own copies.
void FitToRange(vtkPiecewiseFunction* function, const ValueRange& data, bool native);
void FitToRange(vtkColorTransferFunction* function, const ValueRange& data, bool native);

} // namespace teravox
