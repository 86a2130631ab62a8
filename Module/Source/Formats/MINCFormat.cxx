// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "MINCFormat.h"

#include "FormatText.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace teravox
{

namespace
{
using namespace formats;

const std::string Image = "/minc-2.0/image/0";
const std::string Voxels = Image + "/image";
constexpr std::array<const char*, 5> Known{ "xspace", "yspace", "zspace", "time",
  "vector_dimension" };
constexpr std::size_t MostSlices = 1 << 16; // whose ranges are looked at

std::optional<std::string> Recognise(const HDF5File& file, const std::string& path)
{
  return path.empty() && file.DatasetShape(Voxels) && file.HasAttribute(Voxels, "dimorder")
    ? std::optional<std::string>("the dataset '" + Voxels + "' and its dimorder")
    : std::nullopt;
}

std::vector<std::string> Names(std::string text)
{
  std::vector<std::string> names{ "" };
  text.erase(std::find(text.begin(), text.end(), '\0'), text.end());
  for (const char c : text)
  {
    if (c == ',')
    {
      names.emplace_back();
    }
    else if (c != ' ')
    {
      names.back() += c;
    }
  }
  return names;
}

std::optional<double> Number(
  const HDF5File& file, const std::string& path, const std::string& attribute)
{
  const auto numbers = file.Numbers(path, attribute);
  return numbers && numbers->size() == 1 && std::isfinite((*numbers)[0])
    ? std::optional<double>((*numbers)[0])
    : std::nullopt;
}

/// Where an axis of space, 0 to 2, lies. A step backwards turns its direction round.
Status TakeAxis(
  const HDF5File& file, const std::string& name, std::size_t axis, VolumeDescription& d)
{
  const std::string path = "/minc-2.0/dimensions/" + name;
  const double step = Number(file, path, "step").value_or(1.0);
  const double start = Number(file, path, "start").value_or(0.0);
  Double3 cosines{ 0, 0, 0 };
  cosines.at(axis) = 1.0;
  const auto given = file.Numbers(path, "direction_cosines");
  if (given && given->size() == 3)
  {
    std::copy(given->begin(), given->end(), cosines.begin());
  }
  const double length =
    std::sqrt(cosines[0] * cosines[0] + cosines[1] * cosines[1] + cosines[2] * cosines[2]);
  if (step == 0.0 || !(length > 0.0) || !std::isfinite(length))
  {
    return Corrupt(file, "'" + path + "' has a step or direction_cosines without a length");
  }
  d.Spacing.at(axis) = std::abs(step);
  for (std::size_t row = 0; row < 3; ++row)
  {
    const double cosine = cosines.at(row) / length;
    d.Direction.at(3 * row + axis) = step < 0.0 ? -cosine : cosine;
    d.Origin.at(row) += start * cosine;
  }
  const std::string unit = file.Text(path, "units").value_or("");
  d.Unit = unit.empty() ? d.Unit : unit;
  return {};
}

/// How real values follow from voxels, for people.
std::string RealValues(const HDF5File& file)
{
  const auto least = file.DatasetNumbers(Image + "/image-min", MostSlices);
  const auto most = file.DatasetNumbers(Image + "/image-max", MostSlices);
  if (!least || !most || least->empty() || most->empty())
  {
    return "Voxels are as stored; the file says nothing of real values.";
  }
  const auto same = [](const std::vector<double>& v)
  { return std::all_of(v.begin(), v.end(), [&](double x) { return x == v.front(); }); };
  const auto valid = file.Numbers(Voxels, "valid_range");
  const std::string range = valid && valid->size() == 2
    ? std::to_string((*valid)[0]) + " to " + std::to_string((*valid)[1])
    : "those of the type";
  return "Voxels are as stored (" + range + ")" +
    (same(*least) && same(*most)
        ? ", which are the real values " + std::to_string(least->front()) + " to " +
          std::to_string(most->front()) + "."
        : "; their real values, image-min to image-max, differ between slices.");
}

/// The axes of the dataset by their names; 0 to 2: x, y, z, 3: time, 4: of vectors.
Status TakeAxes(
  const HDF5File& file, const std::vector<std::string>& names, std::array<int, 5>& axes)
{
  for (std::size_t i = 0; i < names.size(); ++i)
  {
    const auto* found = std::find(Known.begin(), Known.end(), names[i]);
    const auto axis = static_cast<std::size_t>(found - Known.begin());
    if (found == Known.end())
    {
      return { StatusCode::Unsupported,
        "The file '" + file.Name() + "' has the axis '" + names[i] +
          "'; xspace, yspace, zspace, time and vector_dimension are read." };
    }
    if (axes.at(axis) >= 0)
    {
      return Corrupt(file, "its dimorder names '" + names[i] + "' twice");
    }
    axes.at(axis) = static_cast<int>(i);
  }
  return {};
}

Result<VolumeDescription> Describe(const HDF5File& file, const VolumeRequest& request)
{
  const auto shape = file.DatasetShape(Voxels);
  const std::vector<std::string> names = Names(file.Text(Voxels, "dimorder").value_or(""));
  if (!shape || names.size() != shape->size())
  {
    return Corrupt(file, "the dimorder of '" + Voxels + "' isn't that of its axes");
  }
  std::array<int, 5> axes{ -1, -1, -1, -1, -1 };
  Status status = TakeAxes(file, names, axes);
  VolumeDescription d;
  d.View.Automatic = false;
  for (std::size_t a = 0; a < 3 && status.Ok(); ++a)
  {
    d.View.Spatial.at(a) = axes.at(a);
    status = axes.at(a) < 0 ? Status() : TakeAxis(file, Known.at(a), a, d);
  }
  const auto lengthOf = [&](int axis)
  {
    const std::int64_t n = axis < 0 ? 1 : (*shape)[static_cast<std::size_t>(axis)];
    return static_cast<std::size_t>(std::max<std::int64_t>(n, 0));
  };
  const std::size_t times = lengthOf(axes[3]);
  const std::size_t channels = lengthOf(axes[4]);
  // Up to four values of a vector are what a voxel has; of more, one is chosen.
  const bool inVoxel = axes[4] >= 0 && channels <= 4;
  constexpr std::size_t most = std::size_t{ 1 } << 24;
  if (status.Ok())
  {
    status = times > most || channels > most
      ? Corrupt(file, "it has too many time points or values of a vector")
      : CheckRequest(file, request, inVoxel ? 1 : channels, times);
  }
  const std::array<double, 9>& m = d.Direction;
  const double determinant = m[0] * (m[4] * m[8] - m[5] * m[7]) -
    m[1] * (m[3] * m[8] - m[5] * m[6]) + m[2] * (m[3] * m[7] - m[4] * m[6]);
  if (status.Ok() && !(std::abs(determinant) > 1e-6))
  {
    status = Corrupt(file, "its direction_cosines lie in one plane");
  }
  if (!status.Ok())
  {
    return status;
  }
  if (axes[3] >= 0)
  {
    d.View.Index.at(static_cast<std::size_t>(axes[3])) = request.TimePoint;
    const double step = Number(file, "/minc-2.0/dimensions/time", "step").value_or(1.0);
    const double start = Number(file, "/minc-2.0/dimensions/time", "start").value_or(0.0);
    d.Times.resize(times);
    for (std::size_t t = 0; t < times; ++t)
    {
      d.Times[t] = start + step * static_cast<double>(t);
    }
  }
  if (inVoxel || request.Channel == VolumeRequest::AllChannels)
  {
    d.View.Component = axes[4];
  }
  else if (axes[4] >= 0)
  {
    d.View.Index.at(static_cast<std::size_t>(axes[4])) = request.Channel;
  }
  d.Channels.assign(inVoxel ? 1 : std::max<std::size_t>(channels, 1), {});
  for (std::size_t c = 0; c < d.Channels.size(); ++c)
  {
    d.Channels[c].Name = d.Channels.size() == 1 ? "image" : "channel " + std::to_string(c);
  }
  LevelDescription level;
  level.Paths = { Voxels };
  d.Levels.push_back(std::move(level));
  d.ArrayName = "image";
  d.Seen.push_back("Its axes are " + file.Text(Voxels, "dimorder").value_or("") + "; voxels of " +
    Text(d.Spacing) + (d.Unit.empty() ? "" : " " + d.Unit) + "; one level, no pyramid.");
  d.Seen.push_back(RealValues(file));
  return d;
}
} // namespace

const VolumeFormat MINCFormat{ "MINC 2", &Recognise, &Describe };

} // namespace teravox
