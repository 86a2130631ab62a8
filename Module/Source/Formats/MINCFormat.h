// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "VolumeDescription.h"

namespace teravox
{

/// MINC 2: /minc-2.0/image/0/image, whose attribute dimorder names its axes; start, step and
/// direction_cosines of /minc-2.0/dimensions/NAME put them in the world. Time and, as components or
/// channels, vector_dimension may be among them. Voxels are those stored: what makes real values of
/// them (valid_range, image-min, image-max) is told, not applied, because it may differ between
/// slices. Source: "MINC 2.0 File Format Reference", Montreal Neurological Institute.
extern const VolumeFormat MINCFormat;

} // namespace teravox
