// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Components.h"
#include "TransferTable.h"
#include "Types.h"

#include <cstdint>
#include <optional>
#include <vector>
#include <vtkType.h>

class vtkVolumeProperty;

namespace teravox
{

/// How the functions of a property lie over the values of the data.
struct RangeChoice
{
  ValueRange Data = ValueRange::Unknown();
  bool NativeColor = false;
  bool NativeOpacity = false;
  bool NativeGradient = false;
  /// The one function over value and gradient counts, or over two components (HasTransferImage()).
  bool Image = false;

  bool operator==(const RangeChoice& o) const
  {
    return this->NativeColor == o.NativeColor && this->NativeOpacity == o.NativeOpacity &&
      this->NativeGradient == o.NativeGradient && this->Image == o.Image;
  }
};

/// Whether a component's gradient opacity counts.
bool HasGradientOpacity(vtkVolumeProperty* property, int component);

/// Whether the property has a function over value and gradient that counts, of one component: an
/// image of two dimensions with four floats per node.
bool HasTransferImage(vtkVolumeProperty* property);
/// Whether it can be drawn over values of this range.
bool IsImageRange(const ValueRange& range);
/// When it last changed.
vtkMTimeType ImageTime(vtkVolumeProperty* property);

/// The functions of a component as they are now. Copies: they are sampled later.
TransferFunction MakeTransferFunction(
  vtkVolumeProperty* property, int component, const RangeChoice& range);

/// Of so many components the one whose isosurfaces are drawn, as VTK 9.1 does: of independent ones
/// that with the largest weight, the first of several; nothing of dependent ones.
std::optional<int> SurfaceComponent(vtkVolumeProperty* property, int components);

/// Whether so many components are dependent: there is such a mode for two and for four.
bool AreDependent(vtkVolumeProperty* property, int components);

/// Whether so many components, as the property takes them, can be drawn in a blend mode.
bool CanBlendComponents(vtkVolumeProperty* property, int components, BlendKind kind);

/// Those of several components, each over the range of its own values. Of two, if the one function
/// counts, that is over both.
ComponentFunctions MakeComponentFunctions(
  vtkVolumeProperty* property, const VolumeInfo& info, const RangeChoice& range);

/// The labels for which the property has functions, ascending; without 0, which is that of voxels
/// that have none, as in VTK.
std::vector<std::int64_t> LabelsOf(vtkVolumeProperty* property);
/// Whether one of them has a gradient opacity that counts.
bool HasLabelGradientOpacity(vtkVolumeProperty* property);
/// When one of their functions last changed.
vtkMTimeType LabelTime(vtkVolumeProperty* property);

/// The functions of one component under a label mask, TransferFunction::Labels in the order of
/// LabelsOf(). A label without a colour or an opacity of its own has that of the volume; without a
/// gradient opacity it has none, as in VTK. `blendFactor`: see MixLabel().
TransferFunction MakeLabelFunctions(
  vtkVolumeProperty* property, const RangeChoice& range, double blendFactor);

} // namespace teravox
