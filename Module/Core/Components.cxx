// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Components.h"

#include "GradientTable.h"
#include "MarchSetup.h"
#include "ScaledBrickSource.h"

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
  return kind == BlendKind::Composite ||
    (mode == ComponentMode::Independent && kind != BlendKind::Isosurface &&
      kind != BlendKind::Slice);
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
    function.SharpWalls = true; // one component may shine in front of another's wall
    const ValueRange& own = ComponentRange(info, static_cast<int>(component));
    return BuildTransferTable(
      ProjectedFunction(ScaleTransferFunction(std::move(function), exponent), kind, own),
      info.Range, !IsFloat(info.Type), smallestStep);
  };
  if (functions.Mode == ComponentMode::Independent)
  {
    for (std::size_t c = 0; c < count; ++c)
    {
      tables[c] = build(functions.Functions[c], c);
    }
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
    const bool emits = independent ? functions.Weight[c] > 0 : c + 1 == count;
    parameters.ComponentTransfer[c] = tables[c].Nodes != 0
      ? TransferParameters(tables[c])
      : MarchParameters::Vec{ 0, 0,
          static_cast<float>(std::ldexp(1.0, exponent) / FullColor(info.Type)), 0 };
    const double weight = !emits ? 0 : independent ? functions.Weight[c] : 1;
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
  for (std::size_t c = 0; c < tables.size(); ++c)
  {
    MarchParameters one;
    const double unit = functions.Functions[c].UnitDistance;
    SetProjection(one, projection, functions.Functions[c], tables[c], unit, relative);
    parameters.Projection = { one.Projection[0], 0, 0, 0 };
    parameters.ComponentProjection[c] = { one.Projection[1], one.Projection[2], one.Projection[3],
      static_cast<float>(functions.Weight[c] / unit) };
  }
}

} // namespace teravox
