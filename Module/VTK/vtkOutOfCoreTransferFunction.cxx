// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "vtkOutOfCoreTransferFunction.h"

#include "BrickSource.h"
#include "vtkBrickSource.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <exception>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>
#include <vector>
#include <vtkColorTransferFunction.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPiecewiseFunction.h>
#include <vtkVolumeProperty.h>

vtkStandardNewMacro(vtkOutOfCoreTransferFunction);

namespace
{

/// Where the visible values begin and where they are fully visible.
struct Ramp
{
  double Low = 0.0;
  double High = 1.0;
};

/// The bin after which to cut, so that the variance between both classes is largest (Otsu 1979).
std::size_t OtsuBin(const std::vector<double>& histogram)
{
  const double total = std::accumulate(histogram.begin(), histogram.end(), 0.0);
  double moment = 0.0;
  for (std::size_t i = 0; i < histogram.size(); ++i)
  {
    moment += static_cast<double>(i) * histogram[i];
  }
  double below = 0.0;
  double momentBelow = 0.0;
  double best = -1.0;
  std::size_t cut = 0;
  for (std::size_t i = 0; i + 1 < histogram.size(); ++i)
  {
    below += histogram[i];
    momentBelow += static_cast<double>(i) * histogram[i];
    if (below <= 0.0 || below >= total)
    {
      continue;
    }
    const double difference = momentBelow / below - (moment - momentBelow) / (total - below);
    const double variance = below * (total - below) * difference * difference;
    if (variance > best)
    {
      best = variance;
      cut = i;
    }
  }
  return cut;
}

/// The bin below which lies `fraction` of what is counted from `first` on.
std::size_t QuantileBin(const std::vector<double>& histogram, std::size_t first, double fraction)
{
  const double total =
    std::accumulate(histogram.begin() + static_cast<std::ptrdiff_t>(first), histogram.end(), 0.0);
  double sum = 0.0;
  for (std::size_t i = first; i < histogram.size(); ++i)
  {
    sum += histogram[i];
    if (sum >= fraction * total)
    {
      return i;
    }
  }
  return histogram.size() - 1;
}

Ramp MakeRamp(const teravox::VolumeInfo& info)
{
  if (!info.Range.IsKnown() || info.Range.IsVoid())
  {
    return {};
  }
  const double width = info.Range.Max - info.Range.Min;
  if (width <= 0.0)
  {
    return { info.Range.Min - 0.5, info.Range.Min };
  }
  const std::vector<double>& histogram = info.Histogram;
  const double counted = std::accumulate(histogram.begin(), histogram.end(), 0.0);
  if (histogram.size() < 3 || !(counted > 0.0))
  {
    return { info.Range.Min + 0.1 * width, info.Range.Max };
  }
  const double bin = width / static_cast<double>(histogram.size());
  const std::size_t cut = OtsuBin(histogram);
  const std::size_t high = QuantileBin(histogram, cut + 1, 0.995);
  const double low = info.Range.Min + bin * static_cast<double>(cut + 1);
  return { low, std::max(info.Range.Min + bin * static_cast<double>(high + 1), low + bin) };
}

void FillScalars(
  const teravox::VolumeInfo& info, vtkPiecewiseFunction* opacity, vtkColorTransferFunction* color)
{
  const Ramp ramp = MakeRamp(info);
  const double width = ramp.High - ramp.Low;
  opacity->AddPoint(ramp.Low, 0.0);
  opacity->AddPoint(ramp.Low + 0.2 * width, 0.04);
  opacity->AddPoint(ramp.High, 0.5);
  color->AddRGBPoint(ramp.Low, 0.30, 0.10, 0.08);
  color->AddRGBPoint(ramp.Low + 0.4 * width, 0.85, 0.45, 0.32);
  color->AddRGBPoint(ramp.Low + 0.75 * width, 0.96, 0.82, 0.66);
  color->AddRGBPoint(ramp.High, 1.0, 0.98, 0.94);
}

/// One colour per label, at neighbouring hues far apart; a label without a neighbour in the table
/// can't be blended into another, because interpolation is nearest.
void FillLabels(
  const teravox::VolumeInfo& info, vtkPiecewiseFunction* opacity, vtkColorTransferFunction* color)
{
  constexpr double mostLabels = 1024.0;
  const bool known = info.Range.IsKnown() && !info.Range.IsVoid();
  const double first = known ? std::max(info.Range.Min, 0.0) : 0.0;
  const double last = known ? std::min(info.Range.Max, first + mostLabels) : 255.0;
  opacity->AddPoint(0.0, 0.0);
  opacity->AddPoint(0.5, 0.0);
  opacity->AddPoint(1.0, 0.6);
  const int count = static_cast<int>(last - first) + 1;
  for (int i = 0; i < count; ++i)
  {
    const double label = first + i;
    constexpr double goldenRatio = 0.6180339887498949;
    double whole = 0.0;
    color->AddHSVPoint(label, std::modf(label * goldenRatio, &whole), 0.65, 0.95);
  }
}

/// A list of rows of numbers under `name`, each row with one of the given lengths.
std::vector<std::vector<double>> RowsOf(
  const nlohmann::json& json, const char* name, std::size_t length, std::size_t longer)
{
  auto rows = json.at(name).get<std::vector<std::vector<double>>>();
  if (rows.empty())
  {
    throw std::invalid_argument(std::string("\"") + name + "\" has no point");
  }
  for (const std::vector<double>& row : rows)
  {
    if (row.size() != length && row.size() != longer)
    {
      throw std::invalid_argument(std::string("a point of \"") + name + "\" has " +
        std::to_string(row.size()) + " numbers instead of " + std::to_string(length) +
        (longer != length ? " or " + std::to_string(longer) : ""));
    }
    if (std::any_of(row.begin() + 1, row.end(), [](double v) { return !(v >= 0.0 && v <= 1.0); }))
    {
      throw std::invalid_argument(
        std::string("a point of \"") + name + "\" has a number outside 0...1");
    }
  }
  return rows;
}

struct TransferFile
{
  std::vector<std::vector<double>> Opacity;
  std::vector<std::vector<double>> Color;
  double UnitDistance = 0.0; // 0: not given
  int Shade = -1;            // -1: not given
  int Interpolation = -1;    // -1: not given
};

TransferFile Parse(std::istream& stream)
{
  const nlohmann::json json = nlohmann::json::parse(stream);
  TransferFile file;
  file.Opacity = RowsOf(json, "opacity", 2, 4);
  file.Color = RowsOf(json, "color", 4, 4);
  if (json.contains("unitDistance"))
  {
    file.UnitDistance = json["unitDistance"].get<double>();
    if (!(file.UnitDistance > 0.0))
    {
      throw std::invalid_argument("\"unitDistance\" isn't above 0");
    }
  }
  if (json.contains("shade"))
  {
    file.Shade = json["shade"].get<bool>() ? 1 : 0;
  }
  if (json.contains("interpolation"))
  {
    const auto name = json["interpolation"].get<std::string>();
    if (name != "linear" && name != "nearest")
    {
      throw std::invalid_argument("\"interpolation\" is neither linear nor nearest");
    }
    file.Interpolation = name == "linear" ? VTK_LINEAR_INTERPOLATION : VTK_NEAREST_INTERPOLATION;
  }
  return file;
}

} // namespace

void vtkOutOfCoreTransferFunction::MakeAutomatic(
  vtkBrickSource* source, vtkVolumeProperty* property)
{
  vtkNew<vtkPiecewiseFunction> opacity;
  vtkNew<vtkColorTransferFunction> color;
  const bool has = source && source->GetBrickSource();
  const teravox::VolumeInfo info = has ? source->GetBrickSource()->Info() : teravox::VolumeInfo();
  if (info.Labels)
  {
    FillLabels(info, opacity, color);
  }
  else
  {
    FillScalars(info, opacity, color);
  }
  property->SetScalarOpacity(opacity);
  property->SetColor(color);
  property->SetScalarOpacityUnitDistance(
    (info.Spacing[0] + info.Spacing[1] + info.Spacing[2]) / 3.0);
  property->SetInterpolationType(
    info.Labels ? VTK_NEAREST_INTERPOLATION : VTK_LINEAR_INTERPOLATION);
  property->SetShade(info.Labels ? 0 : 1);
  property->SetAmbient(0.3);
  property->SetDiffuse(0.7);
  property->SetSpecular(0.2);
  property->SetSpecularPower(10.0);
}

std::string vtkOutOfCoreTransferFunction::Read(
  const std::string& fileName, vtkVolumeProperty* property)
{
  std::ifstream stream(fileName);
  if (!stream)
  {
    return "The transfer function " + fileName + " can't be opened.";
  }
  TransferFile file;
  try
  {
    file = Parse(stream);
  }
  catch (const std::exception& error)
  {
    return "The transfer function " + fileName + " can't be used: " + error.what() + ".";
  }
  vtkNew<vtkPiecewiseFunction> opacity;
  for (const std::vector<double>& row : file.Opacity)
  {
    opacity->AddPoint(
      row[0], row[1], row.size() == 4 ? row[2] : 0.5, row.size() == 4 ? row[3] : 0.0);
  }
  vtkNew<vtkColorTransferFunction> color;
  for (const std::vector<double>& row : file.Color)
  {
    color->AddRGBPoint(row[0], row[1], row[2], row[3]);
  }
  property->SetScalarOpacity(opacity);
  property->SetColor(color);
  if (file.UnitDistance > 0.0)
  {
    property->SetScalarOpacityUnitDistance(file.UnitDistance);
  }
  if (file.Shade >= 0)
  {
    property->SetShade(file.Shade);
  }
  if (file.Interpolation >= 0)
  {
    property->SetInterpolationType(file.Interpolation);
  }
  return {};
}
