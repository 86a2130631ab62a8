// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "HDF5View.h"
#include "Status.h"
#include "Types.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace teravox
{

struct AMRBoxes;
class HDF5File;

/// Which volume of a file.
struct VolumeRequest
{
  /// A dataset or a group in the file; empty: what the file itself says.
  std::string Path;
  /// Counted from 0. AllChannels: all of them, at most 4, as components of one volume.
  int Channel = 0;
  int TimePoint = 0;
  /// An XML file that describes the HDF5 file; empty: one beside it, if there is one.
  std::string Companion;
  /// A file with one level is read from the pyramid beside it, if that was made of it (Sidecar.h).
  bool UseSidecar = true;

  static constexpr int AllChannels = -1;
};

/// A file's name for a channel, and how the file wants it to be shown.
struct ChannelDescription
{
  std::string Name;
  std::optional<Double3> Color;  ///< red, green, blue in 0...1
  ValueRange Display;            ///< from transparent to opaque; Unknown() where nothing is said
  ValueRange Range;              ///< of the voxels of level 0
  std::vector<double> Histogram; ///< equal bins over Range
};

/// One level of the chosen volume.
struct LevelDescription
{
  /// Absolute paths of the datasets; one, or one per component.
  std::vector<std::string> Paths;
  /// Cumulative, against level 0.
  Int3 Factor{ 1, 1, 1 };
  /// Voxels that count; the dataset may be padded. 0: those of the dataset.
  Int3 Size{ 0, 0, 0 };
  /// Made of level 0 while it is read (PreviewLevels.h); such levels come last.
  bool Preview = false;
};

/// What a file says about one volume: the same terms for all formats. Values, checked as far as
/// they can be without opening the datasets.
/// Thread: immutable once it was made.
struct VolumeDescription
{
  std::string Format; ///< "Imaris", ...
  /// What was seen and why it was taken so, a line each, for people.
  std::vector<std::string> Seen;

  std::vector<LevelDescription> Levels;
  /// Levels have exactly the voxels that their factors ask for, else the file is damaged. Otherwise
  /// a level may lack the outermost voxels, and one that doesn't fit at all is left out.
  bool ExactLevels = false;
  HDF5View View; ///< the same for all datasets
  /// Datasets hold the cells of boxes, one after another; level l is the l-th from its end.
  std::shared_ptr<const AMRBoxes> Boxes;
  std::vector<ChannelDescription> Channels{ ChannelDescription{} };
  std::vector<double> Times{ 0.0 };
  std::string TimeUnit;

  std::string ArrayName = "scalars";
  bool Labels = false;
  bool CellData = false;
  Double3 Origin{ 0, 0, 0 }; ///< centre of voxel (0,0,0)
  Double3 Spacing{ 1, 1, 1 };
  std::array<double, 9> Direction{ 1, 0, 0, 0, 1, 0, 0, 0, 1 };
  Int3 ExtentStart{ 0, 0, 0 };
  std::string Unit; ///< of lengths; empty: unknown
  ValueRange Range;
  std::vector<double> Histogram;
  std::string StatisticsPath; ///< PyramidFormat.h; empty: there are none
};

/// One layout of files: whether a file has it, and what it says.
struct VolumeFormat
{
  const char* Name;
  /// Cheap and certain enough to decide; says by what.
  std::optional<std::string> (*Recognise)(const HDF5File& file, const std::string& path);
  /// Errors: NotFound, Corrupt, Unsupported, InvalidArgument (no such channel or time point), each
  /// naming file and object.
  Result<VolumeDescription> (*Describe)(const HDF5File& file, const VolumeRequest& request);
};

/// Tries the known layouts, the most specific first.
/// Errors: those of the layout; NotFound, with the datasets that could be named.
Result<VolumeDescription> DescribeVolume(const HDF5File& file, const VolumeRequest& request);

/// Opens an HDF5 file, or the one that an XML file of BigDataViewer names, and describes the
/// volume.
struct OpenedVolume
{
  std::shared_ptr<HDF5File> File;
  VolumeDescription Description;
};
Result<OpenedVolume> OpenVolumeFile(const std::string& fileName, const VolumeRequest& request);

} // namespace teravox
