// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "Formats/VolumeDescription.h"
#include "HDF5Dataset.h"
#include "PyramidLayout.h"
#include "Status.h"
#include "Types.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace teravox
{

/// The datasets of a volume's levels, each one or one per component, and the layout they fit into.
/// Thread: immutable once it was opened.
class HDF5Levels
{
public:
  /// Opens what `d` names. Levels that don't fit are taken out of `d`, or are an error, as it says;
  /// a volume with one level of at least `previewsFrom` voxels gets previews (PreviewLevels.h),
  /// never with previews::Never. What was done is added to what was seen. Errors: those of
  /// HDF5Dataset::Open(); Corrupt (contradictions); Unsupported (components); InvalidArgument
  /// (brick size).
  Status Open(std::shared_ptr<HDF5File> file, VolumeDescription& d, int brickSize,
    std::uint64_t previewsFrom);

  std::size_t Count() const { return this->Datasets.size(); }
  /// Datasets of a level: one, or one per component.
  std::size_t Parts() const { return this->Datasets.front().size(); }
  const HDF5Dataset& At(std::size_t level, std::size_t part) const
  {
    return *this->Datasets[level][part];
  }
  /// Of a dataset, below Count() * Parts(); previews have level 0's.
  std::uint32_t NumberOf(std::size_t level, std::size_t part) const
  {
    const bool shared = this->Datasets[level] == this->Datasets.front();
    return static_cast<std::uint32_t>((shared ? 0 : level * this->Parts()) + part);
  }
  /// Voxels of a level that are there, of those that the layout has.
  const Int3& StoredSize(std::size_t level) const { return this->Sizes.at(level); }
  const PyramidLayout& Layout() const { return this->Layout_; }

private:
  Status OpenLevel(const VolumeDescription& d, const LevelDescription& level);
  Status DropLevel(VolumeDescription& d, std::size_t level, const std::string& reason);
  Status OpenLevels(VolumeDescription& d);
  Status AddPreviews(VolumeDescription& d, int brickSize, std::uint64_t previewsFrom);
  Status MakeLayout(VolumeDescription& d, int brickSize);

  std::shared_ptr<HDF5File> File;
  std::vector<std::vector<std::shared_ptr<HDF5Dataset>>> Datasets;
  std::vector<Int3> Sizes;
  PyramidLayout Layout_;
};

} // namespace teravox
