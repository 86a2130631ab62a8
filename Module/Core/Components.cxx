// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Components.h"

#include "GradientTable.h"
#include "MarchSetup.h"
#include "ScaledBrickSource.h"
#include "TransferPlane.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

namespace teravox
{

namespace
{
// The value of full red, green or blue: the largest of an integer type, 1 of floats.
double FullColor(ScalarType type)
{
  return DispatchScalarType(type,
    [](auto zero)
    {
      using T = decltype(zero);
      return std::is_integral_v<T> ? static_cast<double>(std::numeric_limits<T>::max()) : 1.0;
    });
}
} // namespace

bool IsOfComponents(BlendKind kind, ComponentMode mode)
{
  switch (kind)
  {
    case BlendKind::Composite:
      return true;
    case BlendKind::Maximum:
    case BlendKind::Minimum:
      return mode != ComponentMode::Plane;
    case BlendKind::Average:
    case BlendKind::Additive:
      return mode == ComponentMode::Independent;
    default:
      return false;
  }
}

bool HasOpacity(const ComponentFunctions& functions, std::size_t component, std::size_t components)
{
  switch (functions.Mode)
  {
    case ComponentMode::Dependent:
      return component + 1 == components;
    case ComponentMode::Plane:
      return component == 0;
    default:
      return functions.Weight[component] > 0;
  }
}

const ValueRange& ComponentRange(const VolumeInfo& info, int component)
{
  const auto c = static_cast<std::size_t>(component);
  return c < info.ComponentRanges.size() ? info.ComponentRanges[c] : info.Range;
}

double LargestLight(const ComponentFunctions& functions, int components)
{
  double sum = 0;
  for (std::size_t c = 0; c < static_cast<std::size_t>(components); ++c)
  {
    sum += functions.Weight[c] * functions.Weight[c];
  }
  return functions.Mode == ComponentMode::Independent ? std::max(sum, 1.0) : 1;
}

std::vector<TransferTable> BuildComponentTables(const ComponentFunctions& functions,
  const VolumeInfo& info, int exponent, double smallestStep, BlendKind kind)
{
  const auto count = static_cast<std::size_t>(info.Components);
  std::vector<TransferTable> tables(count);
  const auto build = [&](TransferFunction function, std::size_t component)
  {
    // One component may shine in front of another's wall.
    function.SharpWalls = functions.Mode != ComponentMode::Plane;
    const ValueRange& own = ComponentRange(info, static_cast<int>(component));
    return BuildTransferTable(
      ProjectedFunction(ScaleTransferFunction(std::move(function), exponent), kind, own),
      functions.Mode == ComponentMode::Plane ? own : info.Range, !IsFloat(info.Type), smallestStep);
  };
  if (functions.Mode == ComponentMode::Independent)
  {
    for (std::size_t c = 0; c < count; ++c)
    {
      tables[c] = build(functions.Functions[c], c);
    }
    return tables;
  }
  if (functions.Mode == ComponentMode::Plane)
  {
    tables[0] = build(functions.Functions.front(), 0);
    return tables;
  }
  TransferFunction opacity = functions.Functions.front();
  opacity.Color = [](double, double* rgb) { rgb[0] = rgb[1] = rgb[2] = 0; };
  tables[count - 1] = build(std::move(opacity), count - 1);
  if (count == 2)
  {
    TransferFunction color = functions.Functions.front();
    color.Opacity = [](double) { return 0.0; };
    tables[0] = build(std::move(color), 0);
  }
  return tables;
}

void SetComponents(MarchParameters& parameters, const ComponentFunctions& functions,
  const VolumeInfo& info, int exponent, const std::vector<TransferTable>& tables)
{
  const bool independent = functions.Mode == ComponentMode::Independent;
  const std::size_t count = tables.size();
  parameters.Components = { static_cast<std::uint32_t>(count),
    static_cast<std::uint32_t>(functions.Mode), 0, 0 };
  std::size_t nodes = 0;
  std::size_t occupied = 0;
  for (std::size_t c = 0; c < count; ++c)
  {
    parameters.ComponentTransfer[c] = tables[c].Nodes != 0 ? TransferParameters(tables[c])
      : functions.Mode == ComponentMode::Plane
      ? RowParameters(*functions.Functions.front().Image, exponent)
      : MarchParameters::Vec{ 0, 0,
          static_cast<float>(std::ldexp(1.0, exponent) / FullColor(info.Type)), 0 };
    const double weight = !HasOpacity(functions, c, count) ? 0
      : independent                                        ? functions.Weight[c]
                                                           : 1;
    parameters.ComponentTable[c] = { static_cast<float>(nodes), static_cast<float>(occupied),
      static_cast<float>(weight), static_cast<float>(LargestLight(functions, info.Components)) };
    parameters.ComponentMaterial[c] = functions.Material[independent ? c : 0];
    nodes += tables[c].Integrals.size();
    occupied += tables[c].Occupied.size();
  }
}

void SetComponentGradients(MarchParameters& parameters, const ComponentFunctions& functions,
  int components, const Matrix4& datasetFromVoxel, int exponent)
{
  const bool independent = functions.Mode == ComponentMode::Independent;
  for (std::size_t c = 0; c < static_cast<std::size_t>(components); ++c)
  {
    const std::size_t f = independent ? c : 0;
    MarchParameters::Vec& gradient = parameters.ComponentGradient[c];
    gradient = GradientParameters(functions.Functions[f], datasetFromVoxel, exponent);
    parameters.Gradient = { 0, 0, 0, gradient[3] };
    gradient[3] = static_cast<float>(f * GradientTable::Nodes);
  }
}

void SetComponentProjection(MarchParameters& parameters, const Projection& projection,
  const ComponentFunctions& functions, const std::vector<TransferTable>& tables, bool relative)
{
  const bool independent = functions.Mode == ComponentMode::Independent;
  for (std::size_t c = independent ? 0 : tables.size() - 1; c < tables.size(); ++c)
  {
    MarchParameters one;
    const TransferFunction& function = functions.Functions[independent ? c : 0];
    const double unit = function.UnitDistance;
    SetProjection(one, projection, function, tables[c], unit, relative);
    if (!independent)
    {
      // Where the opacity doesn't change any more colours still do: no value is the last.
      constexpr float never = 3.0e38f;
      one.Projection[2] = one.Projection[0] * never;
    }
    parameters.Projection = { one.Projection[0], 0, 0, 0 };
    parameters.ComponentProjection[c] = { one.Projection[1], one.Projection[2], one.Projection[3],
      static_cast<float>(functions.Weight[c] / unit) };
  }
}

} // namespace teravox
