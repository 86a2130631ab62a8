// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Types.h"

#include <hdf5.h>

namespace teravox
{

/// HDF5's name of a scalar type in files and in memory. Requires: HDF5Lock held.
hid_t HDF5FileType(ScalarType type, bool bigEndian);
hid_t HDF5MemoryType(ScalarType type);

} // namespace teravox
