// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "VolumeDescription.h"

namespace teravox
{

/// BigDataViewer HDF5: /tTTTTT/sSS/L/cells with /sSS/resolutions and /sSS/subdivisions; set-ups are
/// channels. Geometry comes from the XML file alone. Without the attribute dataType, signed 16-bit
/// voxels are unsigned ones by their bits, as the format had them before it had that attribute.
/// Source: bdv-core, img/hdf5.
extern const VolumeFormat BigDataViewerFormat;

} // namespace teravox
