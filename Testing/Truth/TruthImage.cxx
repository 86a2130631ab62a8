// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TruthImage.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace teravox
{
namespace
{

std::vector<double> Places(int count, double low, double high)
{
  std::vector<double> places;
  for (int i = 0; i < count; ++i)
  {
    places.push_back(count > 1 ? low + (high - low) * i / (count - 1) : low);
  }
  return places;
}

TruthTransfer EnvelopeOf(int columns, const std::vector<TruthImage::Node>& nodes, double low,
  double high, double unitDistance)
{
  std::vector<TruthTransfer::AlphaNode> alpha;
  const std::vector<double> places = Places(columns, low, high);
  for (std::size_t column = 0; column < places.size(); ++column)
  {
    double most = 0;
    for (std::size_t i = column; i < nodes.size(); i += places.size())
    {
      most = std::max(most, nodes[i][3]);
    }
    alpha.push_back({ places[column], most });
  }
  return TruthTransfer::PiecewiseLinear(std::move(alpha), { { low, {} } }, unitDistance);
}

/// The node before a place in 0...count - 1, and the share of the next.
int NodeBefore(double at, int count, double& share)
{
  const double within = at > 0 ? std::min(at, count - 1.0) : 0;
  const int node = std::clamp(static_cast<int>(within), 0, std::max(count - 2, 0));
  share = within - node;
  return node;
}

} // namespace

TruthImage::TruthImage(int columns, std::vector<Node> nodes, double low, double high, double last,
  double unitDistance, const Double3& spacing)
  : Columns(columns)
  , NumberOfRows(static_cast<int>(nodes.size()) / columns)
  , Nodes(std::move(nodes))
  , Low(low)
  , High(high)
  , Last(last)
  , Envelope_(EnvelopeOf(columns, this->Nodes, low, high, unitDistance))
  , Rows_([](double) { return 1.0; }, Places(this->NumberOfRows, 0, last), spacing)
{
}

const TruthImage::Node& TruthImage::Of(int column, int row) const
{
  const int x = std::min(column, this->Columns - 1);
  const int y = std::min(row, this->NumberOfRows - 1);
  return this->Nodes[static_cast<std::size_t>(y) * static_cast<std::size_t>(this->Columns) +
    static_cast<std::size_t>(x)];
}

TruthImage::Node TruthImage::At(double value, double magnitude) const
{
  double u = 0;
  double v = 0;
  const int x = NodeBefore(
    (this->Columns - 1) * (value - this->Low) / (this->High - this->Low), this->Columns, u);
  const int y =
    NodeBefore((this->NumberOfRows - 1) * (magnitude / this->Last), this->NumberOfRows, v);
  Node node{};
  for (std::size_t c = 0; c < 4; ++c)
  {
    const double near = this->Of(x, y)[c] + u * (this->Of(x + 1, y)[c] - this->Of(x, y)[c]);
    const double far =
      this->Of(x, y + 1)[c] + u * (this->Of(x + 1, y + 1)[c] - this->Of(x, y + 1)[c]);
    node[c] = near + v * (far - near);
  }
  return node;
}

} // namespace teravox
