// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "VolumeDescription.h"

namespace teravox
{

/// Imaris 5.5 (.ims): /DataSet/ResolutionLevel R/TimePoint T/Channel C/Data, padded to whole
/// chunks; attributes are arrays of strings of one character. Source: "Imaris 5.5 File Format
/// Description", which comes with ImarisWriter.
extern const VolumeFormat ImarisFormat;

} // namespace teravox
