// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "vtkOutOfCoreTransferFunction.h"

#include "BrickSource.h"
#include "HDF5BrickSource.h"
#include "vtkBrickSource.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <exception>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>
#include <utility>
#include <vector>
#include <vtkColorTransferFunction.h>
#include <vtkDataArray.h>
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

bool IsUsable(const teravox::ValueRange& range)
{
  return range.IsKnown() && !range.IsVoid() && std::isfinite(range.Max - range.Min);
}

/// Range and histogram of values; nothing where there are none, or they have no range.
void Describe(const std::vector<double>& values, teravox::ChannelDescription& hint)
{
  constexpr std::size_t bins = 256;
  const auto ends = std::minmax_element(values.begin(), values.end());
  if (values.empty() || !IsUsable({ *ends.first, *ends.second }))
  {
    return;
  }
  hint.Range = { *ends.first, *ends.second };
  hint.Histogram.assign(bins, 0.0);
  const double width = hint.Range.Max - hint.Range.Min;
  for (const double v : values)
  {
    const double bin = width > 0.0 ? (v - hint.Range.Min) / width * bins : 0.0;
    hint.Histogram[std::min(static_cast<std::size_t>(bin), bins - 1)] += 1.0;
  }
}

/// Range and histogram of each component in at most 27 bricks of the coarsest level, spread evenly.
/// Bricks that can't be read are left out.
void Sample(teravox::BrickSource& source, std::vector<teravox::ChannelDescription>& hints)
{
  constexpr std::int64_t perAxis = 3;
  const teravox::PyramidLayout& layout = source.Info().Layout;
  const int level = layout.NumberOfLevels() - 1;
  const teravox::Int3& bricks = layout.Bricks(level);
  std::vector<std::vector<double>> values(hints.size());
  for (std::int64_t i = 0; i < perAxis * perAxis * perAxis; ++i)
  {
    const std::int64_t at[3] = { i % perAxis, i / perAxis % perAxis, i / (perAxis * perAxis) };
    teravox::Int3 index{};
    bool isThere = true;
    for (std::size_t a = 0; a < 3; ++a)
    {
      isThere = isThere && at[a] < bricks[a];
      index[a] = bricks[a] <= perAxis ? at[a] : (2 * at[a] + 1) * bricks[a] / (2 * perAxis);
    }
    const auto brick = isThere ? source.ReadBrick(teravox::BrickKey::Of(level, index))
                               : teravox::Result<teravox::BrickPointer>(teravox::BrickPointer());
    if (!brick.Ok() || !brick.Value())
    {
      continue;
    }
    teravox::DispatchScalarType(brick.Value()->Type,
      [&](auto example)
      {
        const std::vector<std::byte>& voxels = brick.Value()->Voxels;
        const std::size_t voxel = sizeof(example) * hints.size();
        // Every seventh voxel tells as much: 27 bricks of 64 are millions.
        for (std::size_t k = 0; k + voxel <= voxels.size(); k += 7 * voxel)
        {
          for (std::size_t c = 0; c < hints.size(); ++c)
          {
            std::memcpy(&example, voxels.data() + k + c * sizeof(example), sizeof(example));
            if (std::isfinite(static_cast<double>(example)))
            {
              values[c].push_back(static_cast<double>(example));
            }
          }
        }
      });
  }
  for (std::size_t c = 0; c < hints.size(); ++c)
  {
    Describe(values[c], hints[c]);
  }
}

Ramp MakeRamp(const teravox::ValueRange& range, const std::vector<double>& histogram)
{
  if (!IsUsable(range))
  {
    return {};
  }
  const double width = range.Max - range.Min;
  if (width <= 0.0)
  {
    return { range.Min - 0.5, range.Min };
  }
  const double counted = std::accumulate(histogram.begin(), histogram.end(), 0.0);
  if (histogram.size() < 3 || !(counted > 0.0))
  {
    return { range.Min + 0.1 * width, range.Max };
  }
  const double bin = width / static_cast<double>(histogram.size());
  const std::size_t cut = OtsuBin(histogram);
  const std::size_t high = QuantileBin(histogram, cut + 1, 0.995);
  const double low = range.Min + bin * static_cast<double>(cut + 1);
  return { low, std::max(range.Min + bin * static_cast<double>(high + 1), low + bin) };
}

void FillScalars(const teravox::VolumeInfo& info, const teravox::ChannelDescription& hint,
  vtkPiecewiseFunction* opacity, vtkColorTransferFunction* color)
{
  const bool known = IsUsable(info.Range);
  const Ramp ramp = IsUsable(hint.Display) && hint.Display.Min < hint.Display.Max
    ? Ramp{ hint.Display.Min, hint.Display.Max }
    : MakeRamp(known ? info.Range : hint.Range, known ? info.Histogram : hint.Histogram);
  const double width = ramp.High - ramp.Low;
  opacity->AddPoint(ramp.Low, 0.0);
  opacity->AddPoint(ramp.Low + 0.2 * width, 0.04);
  opacity->AddPoint(ramp.High, 0.5);
  if (hint.Color)
  {
    const teravox::Double3& full = *hint.Color;
    color->AddRGBPoint(ramp.Low, 0.25 * full[0], 0.25 * full[1], 0.25 * full[2]);
    color->AddRGBPoint(ramp.High, full[0], full[1], full[2]);
    return;
  }
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

namespace
{

teravox::VolumeInfo InfoOf(vtkBrickSource* source)
{
  const bool has = source && source->GetBrickSource();
  return has ? source->GetBrickSource()->Info() : teravox::VolumeInfo();
}

// What the file tells of the channels that are drawn, one for each component.
std::vector<teravox::ChannelDescription> HintsOf(
  vtkBrickSource* source, const teravox::VolumeInfo& info)
{
  std::vector<teravox::ChannelDescription> hints(
    static_cast<std::size_t>(std::max(info.Components, 1)));
  const auto* file = source
    ? dynamic_cast<const teravox::HDF5BrickSource*>(source->GetBrickSource().get())
    : nullptr;
  if (!file)
  {
    return hints;
  }
  const std::vector<teravox::ChannelDescription>& channels = file->Description().Channels;
  if (file->Channel())
  {
    std::fill(hints.begin(), hints.end(), *file->Channel());
  }
  else
  {
    std::copy_n(channels.begin(), std::min(channels.size(), hints.size()), hints.begin());
  }
  return hints;
}

// Colours of components of which nothing is known.
constexpr std::array<teravox::Double3, 4> ChannelColors{ { { 1.0, 0.25, 0.2 }, { 0.2, 1.0, 0.3 },
  { 0.3, 0.4, 1.0 }, { 0.95, 0.95, 0.95 } } };

void Fill(const teravox::VolumeInfo& info, std::vector<teravox::ChannelDescription> hints,
  vtkVolumeProperty* property)
{
  if (hints.size() > 1)
  {
    property->IndependentComponentsOn();
  }
  for (std::size_t c = 0; c < std::min(hints.size(), ChannelColors.size()); ++c)
  {
    vtkNew<vtkPiecewiseFunction> opacity;
    vtkNew<vtkColorTransferFunction> color;
    if (info.Labels)
    {
      FillLabels(info, opacity, color);
    }
    else
    {
      if (hints.size() > 1 && !hints[c].Color)
      {
        hints[c].Color = ChannelColors.at(c);
      }
      FillScalars(info, hints[c], opacity, color);
    }
    const int i = static_cast<int>(c);
    property->SetScalarOpacity(i, opacity);
    property->SetColor(i, color);
    property->SetScalarOpacityUnitDistance(
      i, (info.Spacing[0] + info.Spacing[1] + info.Spacing[2]) / 3.0);
    property->SetShade(i, info.Labels ? 0 : 1);
    property->SetAmbient(i, 0.3);
    property->SetDiffuse(i, 0.7);
    property->SetSpecular(i, 0.2);
    property->SetSpecularPower(i, 10.0);
  }
  property->SetInterpolationType(
    info.Labels ? VTK_NEAREST_INTERPOLATION : VTK_LINEAR_INTERPOLATION);
}

} // namespace

void vtkOutOfCoreTransferFunction::MakeAutomatic(
  vtkBrickSource* source, vtkVolumeProperty* property)
{
  const teravox::VolumeInfo info = InfoOf(source);
  std::vector<teravox::ChannelDescription> hints = HintsOf(source, info);
  const bool isTold = std::all_of(hints.begin(), hints.end(),
    [](const teravox::ChannelDescription& h) { return IsUsable(h.Range) || IsUsable(h.Display); });
  if (source && source->GetBrickSource() && !info.Labels && !IsUsable(info.Range) && !isTold)
  {
    Sample(*source->GetBrickSource(), hints);
  }
  Fill(info, std::move(hints), property);
}

void vtkOutOfCoreTransferFunction::MakeAutomatic(vtkBrickSource* source, double minimum,
  double maximum, vtkDataArray* histogram, vtkVolumeProperty* property)
{
  teravox::VolumeInfo info = InfoOf(source);
  info.Range = { minimum, maximum };
  info.Histogram.clear();
  const vtkIdType bins = histogram ? histogram->GetNumberOfTuples() : 0;
  for (vtkIdType i = 0; i < bins; ++i)
  {
    info.Histogram.push_back(histogram->GetTuple1(i));
  }
  std::vector<teravox::ChannelDescription> hints = HintsOf(source, info);
  for (teravox::ChannelDescription& hint : hints)
  {
    // The values are given, so it is the colour only that the file can tell.
    teravox::ChannelDescription color;
    color.Color = hint.Color;
    hint = color;
  }
  Fill(info, std::move(hints), property);
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
