// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "LabelTables.h"

#include <algorithm>
#include <cmath>

namespace teravox
{

namespace
{
// Few tables have as many nodes as the closest knots of any of them need; many have fewer: together
// about as many as 256 tables of usual size.
constexpr std::size_t Few = 16;
constexpr std::size_t MostIntervals = std::size_t{ 1 } << 20;
constexpr std::size_t LeastIntervals = 256;
constexpr std::size_t UsualIntervals = 4096;

// What may be met of one table or the other.
void Include(TransferTable& all, const TransferTable& table)
{
  for (std::size_t i = 0; i < all.Occupied.size(); ++i)
  {
    all.Occupied[i] = std::min(all.Occupied[i], table.Occupied[i]);
  }
  for (std::size_t i = 0; i < all.Extremes.size(); ++i)
  {
    all.Extremes[i] = { std::min(all.Extremes[i][0], table.Extremes[i][0]),
      std::max(all.Extremes[i][1], table.Extremes[i][1]) };
  }
  all.LargestExtinction = std::max(all.LargestExtinction, table.LargestExtinction);
}
} // namespace

TransferFunction MixLabel(
  const TransferFunction& volume, const TransferFunction& label, double share)
{
  if (share >= 1)
  {
    return label;
  }
  TransferFunction mixed = volume;
  mixed.Labels.clear();
  mixed.GradientOpacity = nullptr;
  if (share <= 0)
  {
    mixed.GradientOpacity = volume.GradientOpacity;
    return mixed;
  }
  mixed.Knots.insert(mixed.Knots.end(), label.Knots.begin(), label.Knots.end());
  std::sort(mixed.Knots.begin(), mixed.Knots.end());
  mixed.IsConstantBeyond = volume.IsConstantBeyond && label.IsConstantBeyond;
  mixed.Opacity = [own = volume.Opacity, other = label.Opacity, share](double value)
  {
    const double through = std::pow(1 - std::clamp(own(value), 0.0, 1.0), 1 - share) *
      std::pow(1 - std::clamp(other(value), 0.0, 1.0), share);
    return 1 - through;
  };
  mixed.Color = [own = volume.Color, opacity = volume.Opacity, other = label.Color, share](
                  double value, double* rgb)
  {
    double mine[3] = { 0, 0, 0 };
    if (opacity(value) > 0)
    {
      own(value, mine);
    }
    other(value, rgb);
    for (int i = 0; i < 3; ++i)
    {
      rgb[i] = (1 - share) * mine[i] + share * rgb[i];
    }
  };
  return mixed;
}

std::vector<TransferTable> BuildLabelTables(
  const TransferFunction& function, const ValueRange& data, bool integers, double smallestStep)
{
  std::vector<TransferFunction> functions{ function };
  functions.insert(functions.end(), function.Labels.begin(), function.Labels.end());
  std::vector<double> knots;
  bool isConstantBeyond = true;
  for (const TransferFunction& one : functions)
  {
    knots.insert(knots.end(), one.Knots.begin(), one.Knots.end());
    isConstantBeyond = isConstantBeyond && one.IsConstantBeyond;
  }
  std::sort(knots.begin(), knots.end());
  knots.erase(std::unique(knots.begin(), knots.end()), knots.end());
  if (functions.size() > Few && knots.size() > 2)
  {
    knots = { knots.front(), knots.back() };
  }
  const auto fewest = static_cast<int>(
    std::max(LeastIntervals, std::min(UsualIntervals, MostIntervals / functions.size())));
  std::vector<TransferTable> tables(1);
  for (TransferFunction& one : functions)
  {
    one.DomainKnots = knots;
    one.IsConstantBeyond = isConstantBeyond;
    one.FewestIntervals = fewest;
    tables.push_back(BuildTransferTable(one, data, integers, smallestStep));
  }
  tables[0] = tables[1];
  for (const TransferTable& table : tables)
  {
    Include(tables[0], table);
  }
  return tables;
}

} // namespace teravox
