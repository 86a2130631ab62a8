// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "VolumeDescription.h"

#include <string>
#include <vector>

namespace teravox
{

/// One dataset by path, of two to five axes. Their meaning, in this order: the attribute axistags
/// of vigra and ilastik; DIMENSION_LABELS of HDF5's dimension scales; the number of axes: (y,x),
/// (z,y,x), (z,y,x,component) where the last has at most four entries, else (t,z,y,x); (t,z,y,x,
/// component) or (t,c,z,y,x). Spacing: element_size_um (z,y,x), where there is that.
/// Source of axistags: vigra, "Axistags"; "keys" are the axes in the order of the dataset.
extern const VolumeFormat PlainFormat;

/// The same of a dataset that another layout leads to.
Result<VolumeDescription> DescribeDataset(
  const HDF5File& file, const std::string& path, const VolumeRequest& request);

/// Datasets of three to five axes with more than one voxel along three of them; for messages.
std::vector<std::string> ListVolumes(const HDF5File& file, std::size_t limit);

} // namespace teravox
