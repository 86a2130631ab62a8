// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "PyramidMetadata.h"

#include "JsonDocument.h"
#include "PyramidFormat.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace teravox
{

namespace
{
using nlohmann::json;

Status Corrupt(const HDF5File& file, const std::string& what)
{
  return { StatusCode::Corrupt, "The file '" + file.Name() + "' is damaged: " + what + "." };
}

// OME-NGFF lists axes as z, y, x.
json ReversedAxes(const Double3& v)
{
  return json::array({ v[2], v[1], v[0] });
}

Status ReadImage(const HDF5File& file, PyramidMetadata& m)
{
  const std::string group = PyramidFormat::ImageGroup;
  const auto extent = file.Integers(group, "WholeExtent");
  const auto origin = file.Numbers(group, "Origin");
  const auto spacing = file.Numbers(group, "Spacing");
  const auto direction = file.Numbers(group, "Direction");
  if (!extent || extent->size() != 6 || !origin || origin->size() != 3 || !spacing ||
    spacing->size() != 3 || (direction && direction->size() != 9))
  {
    return Corrupt(
      file, "WholeExtent, Origin, Spacing or Direction of " + group + " is missing or malformed");
  }
  std::copy(spacing->begin(), spacing->end(), m.Spacing.begin());
  if (direction)
  {
    std::copy(direction->begin(), direction->end(), m.Direction.begin());
  }
  const Double3 corner{ (*origin)[0], (*origin)[1], (*origin)[2] };
  const Status geometry = PyramidMetadata::CheckGeometry(corner, m.Spacing, m.Direction);
  if (!geometry.Ok())
  {
    return Corrupt(file, "in " + group + ", " + geometry.Message());
  }
  for (const char* kind : { "PointData", "CellData" })
  {
    const std::string path = group + "/" + kind;
    const std::vector<std::string> names = file.Children(path, 1);
    const auto scalars = file.Text(path, "Scalars");
    if (!names.empty())
    {
      m.CellData = kind == std::string("CellData");
      m.ArrayName = scalars && file.Has(path + "/" + *scalars) ? *scalars : names[0];
      m.LevelPaths = { path + "/" + m.ArrayName };
      break;
    }
  }
  if (m.LevelPaths.empty())
  {
    return { StatusCode::NotFound,
      "The file '" + file.Name() + "' has no volume: its image has neither point nor cell data." };
  }
  m.Factors = { Int3{ 1, 1, 1 } };
  Double3 start{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    m.ExtentStart[a] = (*extent)[2 * a];
    start[a] = static_cast<double>(m.ExtentStart[a]) + (m.CellData ? 0.5 : 0.0);
  }
  const Double3 offset = PyramidMetadata::Offset(m.Direction, m.Spacing, start);
  for (std::size_t a = 0; a < 3; ++a)
  {
    m.Origin[a] = corner[a] + offset[a];
  }
  return {};
}

// Throws json::exception where the text isn't as expected.
Status ReadLevels(const HDF5File& file, const std::string& text, PyramidMetadata& m)
{
  const JsonDocument document(text);
  const json& datasets = document.Root().at(0).at("datasets");
  std::vector<std::string> paths;
  std::vector<Int3> factors;
  Double3 finest{};
  for (const json& dataset : datasets)
  {
    const std::string path = dataset.at("path").get<std::string>();
    const json& scale = dataset.at("coordinateTransformations").at(0).at("scale");
    Int3 factor{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      const double s = scale.at(scale.size() - 1 - a).get<double>();
      finest[a] = paths.empty() ? s : finest[a];
      const double ratio = s / finest[a];
      if (!(ratio >= 1) || !(ratio <= 2147483648.0) ||
        std::abs(ratio - std::round(ratio)) > 1e-6 * ratio)
      {
        return Corrupt(file,
          "level " + std::to_string(paths.size()) +
            " isn't a whole number of times coarser than "
            "level 0");
      }
      factor[a] = std::llround(ratio);
    }
    paths.push_back(std::string(PyramidFormat::PyramidGroup) + "/" + path);
    factors.push_back(factor);
    if (paths.size() > 32)
    {
      break;
    }
  }
  if (paths.empty())
  {
    return Corrupt(file, "its pyramid has no levels");
  }
  m.LevelPaths = std::move(paths);
  m.Factors = std::move(factors);
  return {};
}

Status ReadPyramid(const HDF5File& file, PyramidMetadata& m)
{
  const std::string group = PyramidFormat::PyramidGroup;
  const auto version = file.Integers(group, "Version");
  if (!version || version->size() != 1)
  {
    return Corrupt(file, "its pyramid has no version, writing it was interrupted");
  }
  if ((*version)[0] != PyramidFormat::Version)
  {
    return { StatusCode::Unsupported,
      "The pyramid in file '" + file.Name() + "' has layout version " +
        std::to_string((*version)[0]) + "; this program reads version " +
        std::to_string(PyramidFormat::Version) + "." };
  }
  const auto text = file.Text(group, PyramidFormat::MultiscalesName);
  if (!text)
  {
    return Corrupt(file, "the list of levels (" + group + ", attribute multiscales) is missing");
  }
  try
  {
    Status status = ReadLevels(file, *text, m);
    if (!status.Ok())
    {
      return status;
    }
  }
  catch (const json::exception& e)
  {
    return Corrupt(file, std::string("its list of levels doesn't parse: ") + e.what());
  }
  const auto start = file.Integers(group, "ExtentStart");
  if (start && start->size() == 3)
  {
    std::copy(start->begin(), start->end(), m.ExtentStart.begin());
  }
  m.Labels = file.Text(group, "Downsampling").value_or("average") == "mode";
  if (file.Has(PyramidFormat::StatisticsGroup))
  {
    m.StatisticsPath = PyramidFormat::StatisticsGroup;
    const auto range = file.Numbers(m.StatisticsPath, "Range");
    if (range && range->size() == 2)
    {
      m.Range = { (*range)[0], (*range)[1] };
    }
    m.Histogram = file.Numbers(m.StatisticsPath, "Histogram").value_or(std::vector<double>());
  }
  return {};
}
} // namespace

Result<PyramidMetadata> PyramidMetadata::Read(const HDF5File& file)
{
  PyramidMetadata m;
  if (!file.Has(PyramidFormat::ImageGroup) || !file.Has(PyramidFormat::PyramidGroup))
  {
    return Status(
      StatusCode::NotFound, "The HDF5 file '" + file.Name() + "' has no pyramid of this layout.");
  }
  Status status = ReadImage(file, m);
  if (status.Ok())
  {
    status = ReadPyramid(file, m);
  }
  if (!status.Ok())
  {
    return status;
  }
  return m;
}

std::string PyramidMetadata::MultiscalesText() const
{
  json datasets = json::array();
  for (std::size_t l = 0; l < this->Factors.size(); ++l)
  {
    Double3 scale{};
    Double3 translation{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      const auto f = static_cast<double>(this->Factors[l][a]);
      scale[a] = this->Spacing[a] * f;
      translation[a] = this->Spacing[a] * (f - 1) / 2;
    }
    const json transformations =
      json::array({ { { "type", "scale" }, { "scale", ReversedAxes(scale) } },
        { { "type", "translation" }, { "translation", ReversedAxes(translation) } } });
    datasets.push_back(
      { { "path", std::to_string(l) }, { "coordinateTransformations", transformations } });
  }
  json axes = json::array();
  for (const char* name : { "z", "y", "x" })
  {
    axes.push_back({ { "name", name }, { "type", "space" } });
  }
  const json multiscale = { { "version", "0.4" }, { "name", this->ArrayName }, { "axes", axes },
    { "datasets", datasets }, { "type", this->Labels ? "mode" : "average" } };
  // Names that aren't UTF-8 must not fail a conversion.
  return json::array({ multiscale }).dump(-1, ' ', false, json::error_handler_t::replace);
}

Status PyramidMetadata::CheckGeometry(
  const Double3& origin, const Double3& spacing, const std::array<double, 9>& d)
{
  for (std::size_t a = 0; a < 3; ++a)
  {
    if (!std::isfinite(origin[a]))
    {
      return { StatusCode::InvalidArgument, "the origin isn't finite" };
    }
    if (!std::isfinite(spacing[a]) || !(spacing[a] > 0))
    {
      return { StatusCode::InvalidArgument,
        "the spacing is " + std::to_string(spacing[a]) + " along axis " + "xyz"[a] +
          "; it must be positive" };
    }
  }
  const double determinant = d[0] * (d[4] * d[8] - d[5] * d[7]) -
    d[1] * (d[3] * d[8] - d[5] * d[6]) + d[2] * (d[3] * d[7] - d[4] * d[6]);
  double size = 1;
  for (std::size_t r = 0; r < 3; ++r)
  {
    size *=
      std::sqrt(d[3 * r] * d[3 * r] + d[3 * r + 1] * d[3 * r + 1] + d[3 * r + 2] * d[3 * r + 2]);
  }
  if (!std::isfinite(determinant) || !(std::abs(determinant) > 1e-12 * size))
  {
    return { StatusCode::InvalidArgument, "the direction matrix is singular" };
  }
  return {};
}

Double3 PyramidMetadata::Offset(
  const std::array<double, 9>& direction, const Double3& spacing, const Double3& index)
{
  Double3 offset{ 0, 0, 0 };
  for (std::size_t r = 0; r < 3; ++r)
  {
    for (std::size_t c = 0; c < 3; ++c)
    {
      offset[r] += direction[3 * r + c] * spacing[c] * index[c];
    }
  }
  return offset;
}

} // namespace teravox
