// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PyramidFileFormat.h"

#include "FormatText.h"
#include "PyramidFormat.h"
#include "PyramidMetadata.h"

#include <utility>

namespace teravox
{

namespace
{
std::optional<std::string> Recognise(const HDF5File& file, const std::string& path)
{
  if (!path.empty() || !file.Has(PyramidFormat::PyramidGroup) ||
    !file.Has(PyramidFormat::ImageGroup))
  {
    return std::nullopt;
  }
  return std::string("the groups '") + PyramidFormat::PyramidGroup + "' and '" +
    PyramidFormat::ImageGroup + "'";
}

Result<VolumeDescription> Describe(const HDF5File& file, const VolumeRequest& request)
{
  Status status = formats::CheckRequest(file, request, 1, 1);
  if (!status.Ok())
  {
    return status;
  }
  Result<PyramidMetadata> read = PyramidMetadata::Read(file);
  if (!read.Ok())
  {
    return read.GetStatus();
  }
  PyramidMetadata& m = read.Value();
  VolumeDescription d;
  for (std::size_t l = 0; l < m.LevelPaths.size(); ++l)
  {
    LevelDescription level;
    level.Paths = { m.LevelPaths[l] };
    level.Factor = m.Factors[l];
    d.Levels.push_back(std::move(level));
  }
  d.ExactLevels = true;
  d.ArrayName = m.ArrayName;
  d.Labels = m.Labels;
  d.CellData = m.CellData;
  d.Origin = m.Origin;
  d.Spacing = m.Spacing;
  d.Direction = m.Direction;
  d.ExtentStart = m.ExtentStart;
  d.Range = m.Range;
  d.Histogram = std::move(m.Histogram);
  d.StatisticsPath = m.StatisticsPath;
  d.Channels.front().Name = d.ArrayName;
  d.Seen.push_back(formats::Counted(d.Levels.size(), "level") + " by " +
    (d.Labels ? "the most frequent value" : "averages") +
    (d.StatisticsPath.empty() ? ", without statistics." : ", with statistics."));
  return d;
}
} // namespace

const VolumeFormat PyramidFileFormat{ "Teravox pyramid", &Recognise, &Describe };

} // namespace teravox
