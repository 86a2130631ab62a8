// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "GradientTable.h"

#include <algorithm>
#include <cmath>

namespace teravox
{

namespace
{
constexpr int Intervals = GradientTable::Nodes - 1;

// Returns whether it is 1 everywhere.
bool AddNodes(const TransferFunction& function, double last, GradientTable& table)
{
  std::vector<float> opacity;
  for (int i = 0; i < GradientTable::Nodes; ++i)
  {
    const double value =
      function.GradientOpacity ? function.GradientOpacity(last * i / Intervals) : 1;
    // Comparisons with NaN are false.
    opacity.push_back(value > 0 ? static_cast<float>(std::min(value, 1.0)) : 0.0f);
  }
  float moved = 0;
  for (std::size_t i = 0; i < opacity.size(); ++i)
  {
    const std::size_t next = std::min(i + 1, opacity.size() - 1);
    const float then = moved + std::abs(opacity[next] - opacity[i]);
    table.Values.push_back({ opacity[i], moved, opacity[next], then });
    moved = then;
  }
  return std::all_of(opacity.begin(), opacity.end(), [](float v) { return v == 1.0f; });
}
} // namespace

double LastGradientOf(const TransferFunction& function)
{
  double last = 0;
  const auto include = [&last](const TransferFunction& one)
  { last = one.GradientOpacity ? std::max(last, one.LastGradient) : last; };
  include(function);
  std::for_each(function.Labels.begin(), function.Labels.end(), include);
  return last > 0 ? last : 1;
}

GradientTable BuildGradientTable(const TransferFunction& function)
{
  const bool any = std::any_of(function.Labels.begin(), function.Labels.end(),
    [](const TransferFunction& label) { return static_cast<bool>(label.GradientOpacity); });
  GradientTable table;
  if (!function.GradientOpacity && !any)
  {
    return table;
  }
  const double last = LastGradientOf(function);
  bool isOne = AddNodes(function, last, table);
  if (!function.Labels.empty())
  {
    // In the place of all together, too, which nobody asks for.
    AddNodes(function, last, table);
  }
  for (const TransferFunction& label : function.Labels)
  {
    isOne = AddNodes(label, last, table) && isOne;
  }
  return isOne ? GradientTable() : table;
}

GradientTable BuildGradientTables(const std::vector<TransferFunction>& functions)
{
  GradientTable table;
  bool isOne = true;
  for (const TransferFunction& function : functions)
  {
    isOne = AddNodes(function, LastGradientOf(function), table) && isOne;
  }
  return isOne ? GradientTable() : table;
}

MarchParameters::Vec GradientScale(double nodes, const Matrix4& datasetFromVoxel, int exponent)
{
  Double3 spacing{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    const double x = datasetFromVoxel[a];
    const double y = datasetFromVoxel[4 + a];
    const double z = datasetFromVoxel[8 + a];
    spacing[a] = std::sqrt(x * x + y * y + z * z);
  }
  const double mean = (spacing[0] + spacing[1] + spacing[2]) / 3;
  nodes = std::ldexp(nodes, exponent);
  MarchParameters::Vec parameters{};
  for (std::size_t a = 0; a < 3; ++a)
  {
    // Differences reach over two voxels.
    parameters[a] = static_cast<float>(nodes * mean / (2 * spacing[a]));
  }
  return parameters;
}

MarchParameters::Vec GradientParameters(
  const TransferFunction& function, const Matrix4& datasetFromVoxel, int exponent)
{
  MarchParameters::Vec parameters =
    GradientScale(Intervals / LastGradientOf(function), datasetFromVoxel, exponent);
  parameters[3] = static_cast<float>(Intervals);
  return parameters;
}

} // namespace teravox
