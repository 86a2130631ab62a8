// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkOutOfCoreTransferFunction
 * @brief fills a vtkVolumeProperty: from the histogram of a volume, or from a file
 *
 * The file is JSON:
 *
 *     {
 *       "opacity": [[value, alpha], [value, alpha, midpoint, sharpness], ...],
 *       "color": [[value, red, green, blue], ...],
 *       "unitDistance": 1.0,
 *       "shade": true,
 *       "interpolation": "linear"
 *     }
 *
 * Alpha and colours lie in 0...1, `unitDistance` is ScalarOpacityUnitDistance in world units;
 * `opacity` and `color` are required, `interpolation` is linear or nearest.
 */
#pragma once

#include "vtkObject.h"
#include "vtkRenderingOutOfCoreModule.h" // for the export macro

#include <string> // for the reason of a failure

class vtkBrickSource;
class vtkDataArray;
class vtkVolumeProperty;

class VTKRENDERINGOUTOFCORE_EXPORT vtkOutOfCoreTransferFunction : public vtkObject
{
public:
  static vtkOutOfCoreTransferFunction* New();
  vtkTypeMacro(vtkOutOfCoreTransferFunction, vtkObject);

  /**
   * Opacity, colour, unit distance, shading and interpolation for a volume of which nothing else is
   * known. The background is told from the rest by the threshold that separates the histogram best
   * (Otsu 1979); labels get one colour each, 0 is invisible. A file's own wish (a window, a colour)
   * comes first. Components are independent channels with functions of their own; by default the
   * first to fourth are red, green, blue and white. Where neither the source nor the file knows a
   * range, up to 27 bricks of the coarsest level are read; without a histogram the ramp spans the
   * range, without a range 0...1.
   */
  static void MakeAutomatic(vtkBrickSource* source, vtkVolumeProperty* property);
  /**
   * The same with a histogram from elsewhere, for a source that knows none: counts of values in
   * equal bins from `minimum` to `maximum`; null: the ramp spans the range.
   */
  static void MakeAutomatic(vtkBrickSource* source, double minimum, double maximum,
    vtkDataArray* histogram, vtkVolumeProperty* property);

  /**
   * Reads a file as above. Returns an empty string, or one sentence that says what is wrong; the
   * property is unchanged then. What the file doesn't say is left as it is.
   */
  static std::string Read(const std::string& fileName, vtkVolumeProperty* property);

protected:
  vtkOutOfCoreTransferFunction() = default;
  ~vtkOutOfCoreTransferFunction() override = default;

private:
  vtkOutOfCoreTransferFunction(const vtkOutOfCoreTransferFunction&) = delete;
  void operator=(const vtkOutOfCoreTransferFunction&) = delete;
};
