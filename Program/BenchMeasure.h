// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BenchResults.h"

#include <string>
#include <vector>

namespace teravox::program
{

/// What one process measures: one mapper at several settings. VTK's GPU mapper is slower for the
/// rest of a process that has drawn shaded once.
struct BenchTask
{
  std::string Scene;
  std::string Mapper;
  std::vector<double> Settings; ///< coarse to fine
};

struct BenchTaskResult
{
  std::vector<BenchPoint> Points; ///< without errors
  std::vector<BenchLeftOut> LeftOut;
};

/// Measures in this process; volume, pictures and result are files of the folder options.Work.
Status Measure(const BenchErrorOptions& options, const BenchTask& task);

/// Measures in a process of its own.
Result<BenchTaskResult> MeasureApart(const BenchErrorOptions& options, const BenchTask& task);

/// The file of the volume in a work folder.
std::string VolumeFile(const std::string& work);

/// A picture that Measure() has left: red, green, blue, rows from the bottom.
Result<std::vector<float>> ReadPicture(const std::string& file, const std::array<int, 2>& size);

} // namespace teravox::program
