// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "AMRFormat.h"

#include "AMRBoxes.h"
#include "FormatText.h"
#include "PyramidFormat.h"
#include "PyramidMetadata.h"
#include "VTKHDFFormat.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace teravox
{

namespace
{
using namespace formats;

constexpr std::size_t MostLevels = 31;
constexpr std::size_t MostBoxes = 1 << 18; // of a level
constexpr std::int64_t BoxCells = 1 << 16; // of an array without chunks, read at once
constexpr double FarthestCell = 2147483648.0;

std::string LevelPath(std::size_t level)
{
  return std::string(PyramidFormat::ImageGroup) + "/Level" + std::to_string(level);
}

/// Spacing of a level, which must divide that of level 0.
Status ReadRatio(const HDF5File& file, std::size_t level, Double3& coarsest, AMRBoxes::Level& out)
{
  const auto spacing = file.Numbers(LevelPath(level), "Spacing");
  if (!spacing || spacing->size() != 3 ||
    !IsSpacing({ (*spacing)[0], (*spacing)[1], (*spacing)[2] }))
  {
    return Corrupt(file, "Spacing of " + LevelPath(level) + " is missing or malformed");
  }
  if (level == 0)
  {
    std::copy(spacing->begin(), spacing->end(), coarsest.begin());
  }
  for (std::size_t a = 0; a < 3; ++a)
  {
    const double ratio = coarsest[a] / (*spacing)[a];
    const double whole = std::round(ratio);
    if (!(whole >= 1) || whole > FarthestCell || std::abs(ratio - whole) > 1e-6 * whole)
    {
      return { StatusCode::Unsupported,
        "In the file '" + file.Name() + "' the cells of " + LevelPath(level) +
          " aren't smaller than those of level 0 by a whole number along " + "xyz"[a] + "." };
    }
    out.Ratio[a] = static_cast<std::int64_t>(whole);
  }
  return {};
}

/// The boxes of a level as the file counts cells.
Status ReadBoxes(const HDF5File& file, std::size_t level, AMRBoxes::Level& out)
{
  const std::string path = LevelPath(level) + "/AMRBox";
  const auto shape = file.DatasetShape(path);
  const auto numbers = file.DatasetNumbers(path, 6 * MostBoxes);
  if (!shape || shape->size() != 2 || (*shape)[1] != 6 || !numbers)
  {
    return Corrupt(file,
      "'" + path + "' isn't a table of at most " + std::to_string(MostBoxes) +
        " boxes of six numbers");
  }
  std::int64_t first = 0;
  for (std::size_t b = 0; b < numbers->size() / 6; ++b)
  {
    AMRBoxes::Box box;
    box.First = first;
    std::int64_t cells = 1;
    for (std::size_t a = 0; a < 3; ++a)
    {
      const double low = (*numbers)[6 * b + 2 * a];
      const double high = (*numbers)[6 * b + 2 * a + 1];
      if (!(low >= -FarthestCell) || !(high <= FarthestCell) || !(high >= low))
      {
        return Corrupt(file, "box " + std::to_string(b) + " of '" + path + "' is empty or too far");
      }
      box.Low[a] = static_cast<std::int64_t>(low);
      box.Size[a] = static_cast<std::int64_t>(high) - box.Low[a] + 1;
      if (__builtin_mul_overflow(cells, box.Size[a], &cells))
      {
        return Corrupt(file, "box " + std::to_string(b) + " of '" + path + "' is too large");
      }
    }
    if (__builtin_add_overflow(first, cells, &first))
    {
      return Corrupt(file, "the boxes of '" + path + "' have too many cells");
    }
    out.Boxes.push_back(box);
  }
  return {};
}

/// The cell behind the last one that a level's boxes have in its arrays.
std::int64_t EndOf(const AMRBoxes::Level& level)
{
  if (level.Boxes.empty())
  {
    return 0;
  }
  const AMRBoxes::Box& last = level.Boxes.back();
  return last.First + last.Size[0] * last.Size[1] * last.Size[2];
}

std::int64_t CellsOf(const AMRBoxes::Level& level)
{
  return level.Boxes.empty() ? 0 : EndOf(level) - level.Boxes.front().First;
}

/// Makes boxes relative to the domain, which is what level 0 spans. Returns its size in cells of
/// level 0.
Status PlaceBoxes(const HDF5File& file, AMRBoxes& boxes, Int3& domainLow, Int3& domain)
{
  Int3 high{};
  if (boxes.Levels.front().Boxes.empty())
  {
    return Corrupt(file, "'" + LevelPath(0) + "/AMRBox' is empty");
  }
  for (std::size_t a = 0; a < 3; ++a)
  {
    domainLow[a] = std::numeric_limits<std::int64_t>::max();
    high[a] = std::numeric_limits<std::int64_t>::min();
    for (const AMRBoxes::Box& box : boxes.Levels.front().Boxes)
    {
      domainLow[a] = std::min(domainLow[a], box.Low[a]);
      high[a] = std::max(high[a], box.Low[a] + box.Size[a]);
    }
    domain[a] = high[a] - domainLow[a];
    // Hence no product below overflows.
    const auto finest = static_cast<double>(boxes.Levels.back().Ratio[a]);
    if (static_cast<double>(domainLow[a]) * finest < -FarthestCell ||
      static_cast<double>(high[a]) * finest > FarthestCell)
    {
      return Corrupt(
        file, std::string("its finest cells would be too many or too far along ") + "xyz"[a]);
    }
  }
  for (std::size_t l = 0; l < boxes.Levels.size(); ++l)
  {
    AMRBoxes::Level& level = boxes.Levels[l];
    for (AMRBoxes::Box& box : level.Boxes)
    {
      for (std::size_t a = 0; a < 3; ++a)
      {
        box.Low[a] -= domainLow[a] * level.Ratio[a];
        if (box.Low[a] < 0 || box.Low[a] + box.Size[a] > domain[a] * level.Ratio[a])
        {
          return Corrupt(file,
            "a box of '" + LevelPath(l) + "' reaches beyond those of level 0 along " + "xyz"[a]);
        }
      }
    }
  }
  return {};
}

/// A step's entry of a list of a level. Version 2.2 of the layout left out a letter of its name.
Status ReadEntry(const HDF5File& file, std::size_t level, const std::string& name,
  const std::string& older, const VolumeDescription& d, std::size_t step, std::int64_t& entry)
{
  const std::string group =
    std::string(PyramidFormat::ImageGroup) + "/Steps/Level" + std::to_string(level) + "/";
  entry = -1;
  Status status = ReadVTKHDFStep(file, group + older, d.Times.size(), step, entry);
  if (status.Ok() && entry < 0)
  {
    status = ReadVTKHDFStep(file, group + name, d.Times.size(), step, entry);
  }
  return status.Ok() && entry < 0
    ? Corrupt(
        file, "'" + group + name + "' doesn't have " + std::to_string(d.Times.size()) + " entries")
    : status;
}

/// Leaves the boxes of one step, and lets them begin where its cells do, in all of these arrays.
Status SelectStep(const HDF5File& file, const std::vector<std::string>& arrays,
  const VolumeDescription& d, std::size_t step, AMRBoxes& boxes)
{
  for (std::size_t l = 0; l < boxes.Levels.size(); ++l)
  {
    std::vector<AMRBoxes::Box>& all = boxes.Levels[l].Boxes;
    std::int64_t first = 0;
    std::int64_t count = 0;
    Status status = ReadEntry(file, l, "AMRBoxOffsets", "AMRBoxOffset", d, step, first);
    if (status.Ok())
    {
      status = ReadEntry(file, l, "NumberOfAMRBoxes", "NumberOfAMRBox", d, step, count);
    }
    const auto size = static_cast<std::int64_t>(all.size());
    if (status.Ok() && (count > size || first > size - count))
    {
      status =
        Corrupt(file, "'" + LevelPath(l) + "/AMRBox' lacks boxes of step " + std::to_string(step));
    }
    std::int64_t begin = -1;
    for (std::size_t a = 0; a < arrays.size() && status.Ok(); ++a)
    {
      std::int64_t own = 0;
      status = ReadEntry(
        file, l, "CellDataOffsets/" + arrays[a], "CellDataOffset/" + arrays[a], d, step, own);
      if (status.Ok() && a > 0 && own != begin)
      {
        status = { StatusCode::Unsupported,
          "In the file '" + file.Name() + "' the cells of step " + std::to_string(step) +
            " begin at different places of the arrays; choose one of them by its channel." };
      }
      begin = own;
    }
    if (!status.Ok())
    {
      return status;
    }
    all = std::vector<AMRBoxes::Box>(all.begin() + first, all.begin() + first + count);
    const std::int64_t before = all.empty() ? 0 : all.front().First;
    for (AMRBoxes::Box& box : all)
    {
      if (__builtin_add_overflow(box.First - before, begin, &box.First))
      {
        return Corrupt(file, "the boxes of '" + LevelPath(l) + "' have too many cells");
      }
    }
  }
  return {};
}

Status ReadAllBoxes(
  const HDF5File& file, AMRBoxes& boxes, Double3& coarsest, Int3& domainLow, Int3& domain)
{
  for (std::size_t l = 0; l < MostLevels && file.IsGroup(LevelPath(l)); ++l)
  {
    AMRBoxes::Level level;
    Status status = ReadRatio(file, l, coarsest, level);
    if (status.Ok())
    {
      status = ReadBoxes(file, l, level);
    }
    if (!status.Ok())
    {
      return status;
    }
    boxes.Levels.push_back(std::move(level));
  }
  if (boxes.Levels.empty())
  {
    return Corrupt(file, "it has no " + LevelPath(0));
  }
  return PlaceBoxes(file, boxes, domainLow, domain);
}

Status SetGeometry(const HDF5File& file, const Double3& coarsest, const Int3& ratio,
  const Int3& domainLow, VolumeDescription& d)
{
  const auto origin = file.Numbers(PyramidFormat::ImageGroup, "Origin");
  if (!origin || origin->size() != 3)
  {
    return Corrupt(
      file, std::string("Origin of ") + PyramidFormat::ImageGroup + " is missing or malformed");
  }
  const Double3 corner{ (*origin)[0], (*origin)[1], (*origin)[2] };
  Double3 start{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    d.Spacing[a] = coarsest[a] / static_cast<double>(ratio[a]);
    d.ExtentStart[a] = domainLow[a] * ratio[a];
    start[a] = static_cast<double>(d.ExtentStart[a]) + 0.5;
  }
  const Status geometry = PyramidMetadata::CheckGeometry(corner, d.Spacing, d.Direction);
  if (!geometry.Ok())
  {
    return Corrupt(file, geometry.Message());
  }
  const Double3 offset = PyramidMetadata::Offset(d.Direction, d.Spacing, start);
  for (std::size_t a = 0; a < 3; ++a)
  {
    d.Origin[a] = corner[a] + offset[a];
  }
  return {};
}

/// The arrays of the channels, level by level; checks their lengths and sets the view.
Status SetLevels(const HDF5File& file, const std::vector<std::string>& arrays, const Int3& domain,
  const VolumeRequest& request, VolumeDescription& d)
{
  const AMRBoxes& boxes = *d.Boxes;
  const Int3& finest = boxes.Levels.back().Ratio;
  d.View.Automatic = false;
  d.View.Spatial = { 0, -1, -1 };
  d.View.Box = { BoxCells, 1, 1 };
  d.ExactLevels = true;
  std::size_t rank = 0;
  for (std::size_t l = boxes.Levels.size(); l-- > 0;)
  {
    const AMRBoxes::Level& from = boxes.Levels[l];
    LevelDescription level;
    for (std::size_t a = 0; a < 3; ++a)
    {
      level.Factor[a] = finest[a] / from.Ratio[a];
      level.Size[a] = domain[a] * from.Ratio[a];
      if (finest[a] % from.Ratio[a] != 0)
      {
        return { StatusCode::Unsupported,
          "In the file '" + file.Name() + "' the cells of " + LevelPath(l) +
            " aren't larger than the finest ones by a whole number along " + "xyz"[a] + "." };
      }
    }
    for (const std::size_t c : ChannelsOf(request, arrays.size()))
    {
      const std::string path = LevelPath(l) + "/CellData/" + arrays[c];
      const auto shape = file.DatasetShape(path);
      const std::int64_t cells = EndOf(from);
      if (!shape || shape->empty() || shape->size() > 2 || (*shape)[0] < cells ||
        (d.Times.size() < 2 && (*shape)[0] != cells))
      {
        return Corrupt(file,
          "'" + path + "' doesn't have the " + std::to_string(cells) +
            " cells of the boxes of its level");
      }
      if (rank != 0 && rank != shape->size())
      {
        return Corrupt(file, "'" + path + "' has components, or none, unlike other arrays");
      }
      rank = shape->size();
      d.View.Component = rank == 2 ? 1 : -1;
      d.ArrayName = arrays[c];
      level.Paths.push_back(path);
    }
    d.Levels.push_back(std::move(level));
  }
  return {};
}

/// What level 0 leaves open must have a value that says so.
Status CheckCover(const HDF5File& file, const Int3& domain, VolumeDescription& d)
{
  const std::int64_t cells = CellsOf(d.Boxes->Levels.front());
  const double all = static_cast<double>(domain[0]) * static_cast<double>(domain[1]) *
    static_cast<double>(domain[2]);
  if (static_cast<double>(cells) == all)
  {
    return {};
  }
  const std::string type = file.DatasetType(d.Levels.back().Paths.front());
  if (static_cast<double>(cells) > all || type.empty() || type.front() != 'f')
  {
    return { StatusCode::Unsupported,
      "In the file '" + file.Name() + "' the boxes of level 0 have " + std::to_string(cells) +
        " cells, but span " + Text(domain) +
        "; that they overlap, or leave cells open whose values are integers, isn't supported." };
  }
  d.Seen.push_back("Cells that no box covers are NaN.");
  return {};
}
} // namespace

Result<VolumeDescription> DescribeAMR(const HDF5File& file, const VolumeRequest& request)
{
  VolumeDescription d;
  AMRBoxes boxes;
  Double3 coarsest{ 1, 1, 1 };
  Int3 domainLow{};
  Int3 domain{};
  Status status = ReadAllBoxes(file, boxes, coarsest, domainLow, domain);
  if (!status.Ok())
  {
    return status;
  }
  std::vector<std::string> arrays = VTKHDFArrays(file, LevelPath(0) + "/CellData");
  arrays.erase(std::remove(arrays.begin(), arrays.end(), "vtkGhostType"), arrays.end());
  std::vector<std::string> points = VTKHDFArrays(file, LevelPath(0) + "/PointData");
  points.erase(std::remove(points.begin(), points.end(), "vtkGhostType"), points.end());
  if (arrays.empty())
  {
    return points.empty()
      ? Status(StatusCode::NotFound,
          "The file '" + file.Name() + "' has no volume: its level 0 has no cell data.")
      : Status(StatusCode::Unsupported,
          "The file '" + file.Name() + "' has values at points ('" + points.front() +
            "'), whose levels share their positions; cell data are read (in VTK, "
            "vtkPointDataToCellData makes them).");
  }
  const bool temporal = file.Has(std::string(PyramidFormat::ImageGroup) + "/Steps");
  status = temporal ? ReadVTKHDFTimes(file, d) : Status();
  if (status.Ok())
  {
    status = CheckRequest(file, request, arrays.size(), temporal ? d.Times.size() : 1);
  }
  if (status.Ok() && temporal)
  {
    std::vector<std::string> chosen;
    for (const std::size_t c : ChannelsOf(request, arrays.size()))
    {
      chosen.push_back(arrays[c]);
    }
    status = SelectStep(file, chosen, d, static_cast<std::size_t>(request.TimePoint), boxes);
  }
  if (!status.Ok())
  {
    return status;
  }
  d.CellData = true;
  d.Channels.assign(arrays.size(), {});
  for (std::size_t c = 0; c < arrays.size(); ++c)
  {
    d.Channels[c].Name = arrays[c];
  }
  const Int3 finest = boxes.Levels.back().Ratio;
  d.Boxes = std::make_shared<const AMRBoxes>(std::move(boxes));
  status = SetGeometry(file, coarsest, finest, domainLow, d);
  if (status.Ok())
  {
    status = SetLevels(file, arrays, domain, request, d);
  }
  if (status.Ok())
  {
    status = CheckCover(file, domain, d);
  }
  if (!status.Ok())
  {
    return status;
  }
  if (!points.empty())
  {
    d.Seen.push_back(Counted(points.size(), "array") + " of points left out; cells are read.");
  }
  d.Seen.push_back(Counted(d.Levels.size(), "level") + " of refinement, " +
    std::to_string(d.Boxes->Levels.back().Boxes.size()) +
    (d.Boxes->Levels.back().Boxes.size() == 1 ? " box" : " boxes") + " at the finest of " +
    Text(d.Levels.front().Size) + " cells, " + Counted(arrays.size(), "array") +
    (temporal ? ", " + Counted(d.Times.size(), "step") : "") + ".");
  return d;
}

} // namespace teravox
