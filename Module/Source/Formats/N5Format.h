// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "VolumeDescription.h"

namespace teravox
{

/// N5 in HDF5, with and without Paintera's groups: a group with `multiScale`, `painteraData` or
/// only the children s0, s1, ...; BigDataViewer's N5 layout /setupS/timepointT/sL, set-ups as
/// channels. Attributes are HDF5's own or JSON texts, vectors are x, y, z. Sources: n5-hdf5;
/// Paintera, N5Helpers; bdv-core, "BDV N5 format".
extern const VolumeFormat N5Format;

} // namespace teravox
