// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "VolumeDescription.h"

namespace teravox
{

/// OME-NGFF's metadata in HDF5: a group with the attribute `multiscales`, or `ome` with it inside
/// (0.5), as JSON text: axes, datasets with their scales and translations; and `omero`, from which
/// channels have names, colours and windows. Source: ngff.openmicroscopy.org, 0.1 to 0.5.
extern const VolumeFormat NGFFFormat;

} // namespace teravox
