// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "Components.h"

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

double LargestLight(const ComponentFunctions& functions, int components)
{
  double sum = 0;
  for (std::size_t c = 0; c < static_cast<std::size_t>(components); ++c)
  {
    sum += functions.Weight[c] * functions.Weight[c];
  }
  return functions.Mode == ComponentMode::Independent ? std::max(sum, 1.0) : 1;
}

std::vector<TransferTable> BuildComponentTables(
  const ComponentFunctions& functions, const VolumeInfo& info, int exponent, double smallestStep)
{
  const auto count = static_cast<std::size_t>(info.Components);
  std::vector<TransferTable> tables(count);
  const auto build = [&](TransferFunction function)
  {
    function.SharpWalls = true; // one component may shine in front of another's wall
    return BuildTransferTable(ScaleTransferFunction(std::move(function), exponent), info.Range,
      !IsFloat(info.Type), smallestStep);
  };
  if (functions.Mode == ComponentMode::Independent)
  {
    for (std::size_t c = 0; c < count; ++c)
    {
      tables[c] = build(functions.Functions[c]);
    }
    return tables;
  }
  TransferFunction opacity = functions.Functions.front();
  opacity.Color = [](double, double* rgb) { rgb[0] = rgb[1] = rgb[2] = 0; };
  tables[count - 1] = build(std::move(opacity));
  if (count == 2)
  {
    TransferFunction color = functions.Functions.front();
    color.Opacity = [](double) { return 0.0; };
    tables[0] = build(std::move(color));
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

} // namespace teravox
