// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "VolumeDescription.h"

namespace teravox
{

/// Layouts with one level: they say which dataset it is, what its axes are and how long.

/// Electron microscopy datasets, EMD 0.2: a group with emd_group_type, its `data`, and dim1 ...
/// dimN, of which dim1 is x although it varies slowest. Source: emdatasets.com; tomviz, EmdFormat.
extern const VolumeFormat EMDFormat;
/// APS Data Exchange: /exchange/data. Source: "Scientific Data Exchange", De Carlo et al. 2014.
extern const VolumeFormat DataExchangeFormat;
/// NeXus: the attributes `default` from the root to an NXdata, else the first NXdata; its `signal`,
/// `axes`. Source: NeXus manual, "Find the default plottable data".
extern const VolumeFormat NeXusFormat;

} // namespace teravox
