// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "VolumeDescription.h"

namespace teravox
{

/// The project's own pyramid (PyramidFormat.h).
extern const VolumeFormat PyramidFileFormat;

} // namespace teravox
