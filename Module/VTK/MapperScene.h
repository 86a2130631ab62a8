// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"
#include "VolumeEngine.h"

#include <string>
#include <vector>

class vtkOutOfCoreVolumeMapper;
class vtkRenderer;
class vtkVolume;
class vtkVolumeProperty;

namespace teravox
{
// What VTK's classes say about a picture, as plain values of a FrameRequest; and what of that isn't
// done. Thread: render thread.

/// The stages of the lattice of rays, from MaximumImageSampleDistance; 0: each pixel has a ray.
int LatticeStagesOf(vtkOutOfCoreVolumeMapper* m);

/// Whether the mapper has a label mask that counts.
bool HasLabelMask(vtkOutOfCoreVolumeMapper* m, vtkVolumeProperty* p);

/// Whether a mask decides what is drawn of a volume with so many components.
bool IsMasked(vtkOutOfCoreVolumeMapper* m, vtkVolumeProperty* p, int components);

/// The blend mode, with the values that belong to it.
Projection MakeProjection(vtkOutOfCoreVolumeMapper* m, vtkVolumeProperty* p);

/// Whether a function over value and gradient decides what is drawn.
bool IsImageDrawn(vtkOutOfCoreVolumeMapper* m, vtkVolumeProperty* p, const VolumeInfo& info);

/// Settings of VTK that this mapper doesn't do, by name. `data`: the values of the volume;
/// `together`: it is one of several that are drawn by one mapper.
std::vector<std::string> FindUnsupported(vtkOutOfCoreVolumeMapper* m, vtkVolumeProperty* p,
  vtkVolume* v, int components, const ValueRange& data, bool together);

/// Where the picture goes, and what is made of its colours on the way.
void SetOutput(vtkOutOfCoreVolumeMapper* m, FrameRequest& request);

/// Clipping planes, cropping and the block that is drawn.
void SetCuts(vtkOutOfCoreVolumeMapper* mapper, ViewInput& view);

/// Material and lights. One headlight of full intensity is a case of its own, as in VTK: there the
/// ambient part of the material is that of the colour, else of the lights.
void SetMaterial(
  vtkRenderer* ren, vtkVolumeProperty* property, int component, FrameRequest& request);

/// Whether the depth buffer may hold anything when this volume is drawn. No only where that is
/// certain: what else passes, other renderers and an application of its own draw isn't known here.
bool MayMeetGeometry(vtkRenderer* ren, vtkVolume* vol);

} // namespace teravox
