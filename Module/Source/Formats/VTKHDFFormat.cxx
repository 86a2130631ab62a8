// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "VTKHDFFormat.h"

#include "AMRFormat.h"
#include "FormatText.h"
#include "PyramidFormat.h"
#include "PyramidMetadata.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace teravox
{

namespace
{
using namespace formats;

const std::string Group = PyramidFormat::ImageGroup;

std::optional<std::string> Recognise(const HDF5File& file, const std::string& path)
{
  const auto type = path.empty() ? file.Text(Group, "Type") : std::nullopt;
  return type ? std::optional<std::string>(
                  "the group '" + Group + "' with the attribute Type \"" + *type + "\"")
              : std::nullopt;
}

std::string ShapeText(const std::vector<std::int64_t>& shape)
{
  std::string text;
  for (const std::int64_t n : shape)
  {
    text += (text.empty() ? "" : ", ") + std::to_string(n);
  }
  return "(" + text + ")";
}

/// Finds the axes of an array. False if its shape isn't that of the image.
bool MatchAxes(
  const std::vector<std::int64_t>& shape, const Int3& size, bool temporal, HDF5View& view)
{
  for (const bool dropped : { false, true })
  {
    std::size_t at = temporal ? 1 : 0;
    HDF5View match;
    match.Automatic = false;
    bool fits = shape.size() >= at;
    for (std::size_t a = 3; a-- > 0 && fits;)
    {
      if (dropped && size[a] == 1)
      {
        continue;
      }
      fits = at < shape.size() && shape[at] == size[a];
      match.Spatial[a] = static_cast<int>(at++);
    }
    if (fits && at < shape.size())
    {
      match.Component = static_cast<int>(at++);
    }
    if (fits && at == shape.size())
    {
      view = match;
      return true;
    }
  }
  return false;
}

/// Attributes of the group into geometry; the number of voxels of an array of points or cells.
Status ReadGeometry(const HDF5File& file, VolumeDescription& d, Int3& size)
{
  const auto extent = file.Integers(Group, "WholeExtent");
  const auto origin = file.Numbers(Group, "Origin");
  const auto spacing = file.Numbers(Group, "Spacing");
  const auto direction = file.Numbers(Group, "Direction");
  if (!extent || extent->size() != 6 || !origin || origin->size() != 3 || !spacing ||
    spacing->size() != 3 || (direction && direction->size() != 9))
  {
    return Corrupt(
      file, "WholeExtent, Origin, Spacing or Direction of " + Group + " is missing or malformed");
  }
  std::copy(spacing->begin(), spacing->end(), d.Spacing.begin());
  if (direction)
  {
    std::copy(direction->begin(), direction->end(), d.Direction.begin());
  }
  const Double3 corner{ (*origin)[0], (*origin)[1], (*origin)[2] };
  const Status geometry = PyramidMetadata::CheckGeometry(corner, d.Spacing, d.Direction);
  if (!geometry.Ok())
  {
    return Corrupt(file, "in " + Group + ", " + geometry.Message());
  }
  Double3 start{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    const std::int64_t first = (*extent)[2 * a];
    const std::int64_t last = (*extent)[2 * a + 1];
    constexpr std::int64_t most = std::int64_t{ 1 } << 31;
    if (first < -most || last > most || last < first)
    {
      return Corrupt(file, "WholeExtent of " + Group + " is empty or too large");
    }
    d.ExtentStart[a] = first;
    size[a] = d.CellData ? std::max<std::int64_t>(last - first, 1) : last - first + 1;
    start[a] = static_cast<double>(first) + (d.CellData ? 0.5 : 0.0);
  }
  const Double3 offset = PyramidMetadata::Offset(d.Direction, d.Spacing, start);
  for (std::size_t a = 0; a < 3; ++a)
  {
    d.Origin[a] = corner[a] + offset[a];
  }
  return {};
}

/// Where the steps of an array lie along its first axis.
Status ReadSteps(const HDF5File& file, const std::string& array, const VolumeRequest& request,
  VolumeDescription& d, std::int64_t& index)
{
  Status status = ReadVTKHDFTimes(file, d);
  if (status.Ok())
  {
    status = CheckRequest(file, request, d.Channels.size(), d.Times.size());
  }
  if (!status.Ok())
  {
    return status;
  }
  const std::string offsets =
    Group + "/Steps" + (d.CellData ? "/CellDataOffsets/" : "/PointDataOffsets/") + array;
  const auto step = static_cast<std::size_t>(request.TimePoint);
  index = request.TimePoint;
  status = ReadVTKHDFStep(file, offsets, d.Times.size(), step, index);
  d.Seen.push_back(Counted(d.Times.size(), "step") + ".");
  return status;
}

} // namespace

Status ReadVTKHDFTimes(const HDF5File& file, VolumeDescription& d)
{
  const std::string steps = Group + "/Steps";
  const auto count = file.Integers(steps, "NSteps");
  if (!count || count->size() != 1 || (*count)[0] < 1 || (*count)[0] > (1 << 24))
  {
    return Corrupt(file, "the attribute NSteps of '" + steps + "' is missing or malformed");
  }
  const auto n = static_cast<std::size_t>((*count)[0]);
  d.Times.resize(n);
  for (std::size_t t = 0; t < n; ++t)
  {
    d.Times[t] = static_cast<double>(t);
  }
  const auto values = file.DatasetNumbers(steps + "/Values", n);
  if (values && values->size() == n &&
    std::all_of(values->begin(), values->end(), [](double v) { return std::isfinite(v); }))
  {
    d.Times = *values;
  }
  return {};
}

Status ReadVTKHDFStep(const HDF5File& file, const std::string& list, std::size_t steps,
  std::size_t step, std::int64_t& entry)
{
  const auto at = file.DatasetNumbers(list, steps);
  if (!at || at->size() != steps)
  {
    return {};
  }
  constexpr double most = 9007199254740992.0; // the whole numbers that a double can tell apart
  if (!((*at)[step] >= 0) || !((*at)[step] < most))
  {
    return Corrupt(file, "'" + list + "' has no possible entry for step " + std::to_string(step));
  }
  entry = static_cast<std::int64_t>((*at)[step]);
  return {};
}

std::vector<std::string> VTKHDFArrays(const HDF5File& file, const std::string& group)
{
  std::vector<std::string> names;
  std::string active = file.Text(group, "Scalars").value_or("");
  for (const std::string& name : file.Children(group, 4096))
  {
    if (file.DatasetShape(group + "/" + name))
    {
      names.push_back(name);
      if (file.Text(group + "/" + name, "Attribute").value_or("") == "Scalars" && active.empty())
      {
        active = name;
      }
    }
  }
  std::stable_partition(
    names.begin(), names.end(), [&](const std::string& name) { return name == active; });
  return names;
}

namespace
{
Result<VolumeDescription> Describe(const HDF5File& file, const VolumeRequest& request)
{
  const std::string type = file.Text(Group, "Type").value_or("");
  if (type == "OverlappingAMR")
  {
    return DescribeAMR(file, request);
  }
  if (type != "ImageData")
  {
    return Status(StatusCode::Unsupported,
      "The file '" + file.Name() + "' holds VTKHDF of the type " + type +
        "; a volume is of the type ImageData or OverlappingAMR.");
  }
  VolumeDescription d;
  std::string group = Group + "/PointData";
  std::vector<std::string> arrays = VTKHDFArrays(file, group);
  if (arrays.empty())
  {
    group = Group + "/CellData";
    arrays = VTKHDFArrays(file, group);
    d.CellData = true;
  }
  if (arrays.empty())
  {
    return Status(StatusCode::NotFound,
      "The file '" + file.Name() + "' has no volume: its image has neither point nor cell data.");
  }
  Int3 size{};
  Status status = ReadGeometry(file, d, size);
  if (!status.Ok())
  {
    return status;
  }
  const bool temporal = file.Has(Group + "/Steps");
  // One array of many components: they are the channels.
  const auto shape = file.DatasetShape(group + "/" + arrays.front());
  if (!MatchAxes(*shape, size, temporal, d.View) && !MatchAxes(*shape, size, false, d.View))
  {
    return Corrupt(file,
      "'" + group + "/" + arrays.front() + "' has the shape " + ShapeText(*shape) +
        ", but WholeExtent asks for " + Text(size) + " voxels");
  }
  const std::int64_t components =
    d.View.Component < 0 ? 1 : (*shape)[static_cast<std::size_t>(d.View.Component)];
  const bool split = arrays.size() == 1 && components > 4 && components <= 4096;
  d.Channels.assign(split ? static_cast<std::size_t>(components) : arrays.size(), {});
  for (std::size_t c = 0; c < d.Channels.size(); ++c)
  {
    d.Channels[c].Name = split ? arrays.front() + " " + std::to_string(c) : arrays[c];
  }
  status = temporal ? Status() : CheckRequest(file, request, d.Channels.size(), 1);
  LevelDescription level;
  for (const std::size_t c :
    status.Ok() ? ChannelsOf(request, d.Channels.size()) : std::vector<std::size_t>())
  {
    const std::string& array = split ? arrays.front() : arrays[c];
    const auto own = file.DatasetShape(group + "/" + array);
    HDF5View view;
    const bool moving = own && temporal && MatchAxes(*own, size, true, view);
    if (!moving && !(own && MatchAxes(*own, size, false, view)))
    {
      return Corrupt(
        file, "'" + group + "/" + array + "' doesn't have the shape that WholeExtent asks for");
    }
    d.View = view;
    std::int64_t index = 0;
    if (temporal)
    {
      status = ReadSteps(file, array, request, d, index);
      if (!status.Ok())
      {
        return status;
      }
      d.View.Index[0] = moving ? index : 0;
    }
    if (split)
    {
      d.View.Index.at(static_cast<std::size_t>(view.Component)) = static_cast<std::int64_t>(c);
      d.View.Component = -1;
    }
    d.ArrayName = d.Channels[c].Name;
    level.Paths.push_back(group + "/" + array);
  }
  if (!status.Ok())
  {
    return status;
  }
  if (temporal && level.Paths.empty())
  {
    std::int64_t index = 0;
    status = ReadSteps(file, arrays.front(), request, d, index);
    return status.Ok() ? CheckRequest(file, request, d.Channels.size(), d.Times.size()) : status;
  }
  d.Levels.push_back(std::move(level));
  d.Seen.push_back("An image of " + Text(size) + (d.CellData ? " cells, " : " points, ") +
    Counted(arrays.size(), "array") + "; one level, no pyramid.");
  return d;
}
} // namespace

const VolumeFormat VTKHDFFormat{ "VTKHDF", &Recognise, &Describe };

} // namespace teravox
