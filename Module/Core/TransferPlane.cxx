// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TransferPlane.h"

#include "GradientTable.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

namespace teravox
{

namespace
{
using Node = std::array<float, 4>;

// Between tables that aren't finer than this over the values (BuildTransferTable).
constexpr double FewestIntervals = 2048;

std::size_t IndexOf(int column, int row, int columns)
{
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
    static_cast<std::size_t>(column);
}

// Linear between nodes along an axis, at `count` places from the first node to the last.
TransferImage Resampled(const TransferImage& image, int columns, int rows)
{
  TransferImage result = image;
  result.Columns = columns;
  result.Rows = rows;
  result.Nodes.clear();
  const auto place = [](int i, int count, int nodes, int& first, float& share)
  {
    const double at =
      count < 2 ? 0.0 : static_cast<double>(i) * (nodes - 1) / static_cast<double>(count - 1);
    first = std::min(static_cast<int>(at), std::max(nodes - 2, 0));
    share = static_cast<float>(at - first);
  };
  for (int row = 0; row < rows; ++row)
  {
    for (int column = 0; column < columns; ++column)
    {
      int x = 0;
      int y = 0;
      float u = 0;
      float v = 0;
      place(column, columns, image.Columns, x, u);
      place(row, rows, image.Rows, y, v);
      const auto at = [&](int i, int j) -> const Node&
      {
        return image.Nodes[IndexOf(
          std::min(i, image.Columns - 1), std::min(j, image.Rows - 1), image.Columns)];
      };
      Node node{};
      for (std::size_t c = 0; c < 4; ++c)
      {
        const float near = at(x, y)[c] + u * (at(x + 1, y)[c] - at(x, y)[c]);
        const float far = at(x, y + 1)[c] + u * (at(x + 1, y + 1)[c] - at(x, y + 1)[c]);
        node[c] = near + v * (far - near);
      }
      result.Nodes.push_back(node);
    }
  }
  return result;
}

// The largest opacity of a column, linear between columns: no magnitude has more, as along a line
// of one magnitude the opacity is linear between columns.
class ColumnBound
{
public:
  explicit ColumnBound(const TransferImage& image)
    : Low(image.Values.Min)
    , Width(image.Values.Max - image.Values.Min)
  {
    for (int column = 0; column < image.Columns; ++column)
    {
      float most = 0;
      for (int row = 0; row < image.Rows; ++row)
      {
        most = std::max(most, image.Nodes[IndexOf(column, row, image.Columns)][3]);
      }
      this->Most.push_back(most);
    }
  }

  // Over all values within one interval of a table, so that its nodes bound what lies between them.
  double operator()(double value) const
  {
    const double last = static_cast<double>(this->Most.size() - 1);
    const double perValue = this->Width > 0 ? last / this->Width : 0;
    const double at = (value - this->Low) * perValue;
    const double reach = last / FewestIntervals;
    const double from = std::clamp(at - reach, 0.0, last);
    const double to = std::clamp(at + reach, 0.0, last);
    double most = std::max(this->At(from), this->At(to));
    const auto end = static_cast<std::size_t>(to) + 1;
    for (auto column = static_cast<std::size_t>(std::ceil(from)); column < end; ++column)
    {
      most = std::max(most, this->Most[column]);
    }
    return most;
  }

private:
  double At(double column) const
  {
    const auto i = static_cast<std::size_t>(column);
    const std::size_t next = std::min(i + 1, this->Most.size() - 1);
    return this->Most[i] + (column - static_cast<double>(i)) * (this->Most[next] - this->Most[i]);
  }

  double Low;
  double Width;
  std::vector<double> Most;
};

float Change(const Node& a, const Node& b)
{
  return std::max({ std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2]) });
}

Node Largest(const Node& a, const Node& b)
{
  return { std::max(a[0], b[0]), std::max(a[1], b[1]), std::max(a[2], b[2]), std::max(a[3], b[3]) };
}

// The bounds of single intervals.
std::vector<Node> BoundsOfIntervals(const TransferPlane& plane, const std::vector<float>& s)
{
  std::vector<Node> bounds;
  for (int y = 0; y + 1 < plane.Rows; ++y)
  {
    for (int x = 0; x + 1 < plane.Columns; ++x)
    {
      const std::size_t a = IndexOf(x, y, plane.Columns);
      const std::size_t b = a + 1;
      const std::size_t c = IndexOf(x, y + 1, plane.Columns);
      const std::size_t d = c + 1;
      const std::vector<Node>& n = plane.Nodes;
      bounds.push_back({ std::max({ s[a], s[b], s[c], s[d] }),
        std::max(std::abs(s[b] - s[a]), std::abs(s[d] - s[c])),
        std::max(std::abs(s[c] - s[a]), std::abs(s[d] - s[b])),
        std::max(
          { Change(n[a], n[b]), Change(n[c], n[d]), Change(n[a], n[c]), Change(n[b], n[d]) }) });
    }
  }
  return bounds;
}

// Blocks at (x, y) * stride of the finer ones, each with those `reach` farther along both axes.
std::vector<Node> Joined(
  const std::vector<Node>& fine, int width, int height, int stride, int reach)
{
  std::vector<Node> coarse;
  for (int y = 0; y < height; y += stride)
  {
    for (int x = 0; x < width; x += stride)
    {
      const int right = std::min(x + reach, width - 1);
      const int up = std::min(y + reach, height - 1);
      coarse.push_back(Largest(Largest(fine[IndexOf(x, y, width)], fine[IndexOf(right, y, width)]),
        Largest(fine[IndexOf(x, up, width)], fine[IndexOf(right, up, width)])));
    }
  }
  return coarse;
}
} // namespace

TransferFunction MakeImageFunction(TransferImage image, double unitDistance)
{
  for (Node& node : image.Nodes)
  {
    for (float& number : node)
    {
      // A comparison with NaN is false.
      number = number > 0 ? std::min(number, 1.0f) : 0.0f;
    }
  }
  if (image.Columns > MostPlaneNodes || image.Rows > MostPlaneNodes)
  {
    image = Resampled(
      image, std::min(image.Columns, MostPlaneNodes), std::min(image.Rows, MostPlaneNodes));
  }
  TransferFunction function;
  function.UnitDistance = unitDistance;
  function.Knots = { image.Values.Min, image.Values.Max };
  function.Opacity = ColumnBound(image);
  function.Color = [](double, double* rgb) { rgb[0] = rgb[1] = rgb[2] = 1; };
  function.Image = std::make_shared<const TransferImage>(std::move(image));
  return function;
}

TransferPlane BuildTransferPlane(const TransferFunction& function, double largestExtinction)
{
  TransferPlane plane;
  if (!function.Image || function.Image->Nodes.empty())
  {
    return plane;
  }
  const TransferImage& image = *function.Image;
  plane.Columns = std::max(image.Columns, 2);
  plane.Rows = std::max(image.Rows, 2);
  plane.Nodes = image.Columns < 2 || image.Rows < 2
    ? Resampled(image, plane.Columns, plane.Rows).Nodes
    : image.Nodes;
  std::vector<float> s;
  s.reserve(plane.Nodes.size());
  for (const Node& node : plane.Nodes)
  {
    const double opacity = static_cast<double>(node[3]);
    const double extinction = -std::log1p(-opacity) / function.UnitDistance;
    s.push_back(static_cast<float>(std::min(extinction, largestExtinction)));
  }
  std::vector<Node> blocks = BoundsOfIntervals(plane, s);
  int width = plane.Columns - 1;
  int height = plane.Rows - 1;
  // Blocks of level 0 are two intervals wide, and so on.
  blocks = Joined(blocks, width, height, 1, 1);
  const int intervals = std::max(width, height);
  for (int level = 0; level < TransferPlane::MostLevels; ++level)
  {
    plane.First[static_cast<std::size_t>(level)] = static_cast<std::int32_t>(plane.Bounds.size());
    plane.Bounds.insert(plane.Bounds.end(), blocks.begin(), blocks.end());
    plane.Levels = level + 1;
    if (1 << level >= intervals)
    {
      break;
    }
    // Of twice the width from every second one on: with the block that begins where it ends.
    blocks = Joined(blocks, width, height, 2, 2);
    width = plane.Width(level + 1);
    height = plane.Height(level + 1);
  }
  return plane;
}

void SetPlaneParameters(MarchParameters& parameters, const TransferPlane& plane,
  const TransferFunction& function, const TransferTable& table, const Matrix4& datasetFromVoxel,
  int exponent)
{
  const TransferImage& image = *function.Image;
  parameters.Gradient = image.Second
    ? MarchParameters::Vec{}
    : GradientScale((plane.Rows - 1) / image.LastGradient, datasetFromVoxel, exponent);
  parameters.Gradient[3] = static_cast<float>(plane.Rows - 1);
  const double width = image.Values.Max - image.Values.Min;
  const double perValue = width > 0 ? (plane.Columns - 1) / width : 0;
  parameters.Plane[0] = { static_cast<float>(std::ldexp(perValue / table.NodesPerUnit, exponent)),
    static_cast<float>((std::ldexp(table.Low, exponent) - image.Values.Min) * perValue),
    static_cast<float>(plane.Columns - 1), static_cast<float>(plane.Levels) };
  parameters.Plane[1] = { static_cast<float>(1 / function.UnitDistance),
    static_cast<float>(table.LargestExtinction), 0, 0 };
}

MarchParameters::Vec RowParameters(const TransferImage& image, int exponent)
{
  const double width = image.Second->Max - image.Second->Min;
  const double low = std::ldexp(image.Second->Min, -exponent);
  const auto rounded = static_cast<float>(low);
  const double rows = std::max(image.Rows, 2) - 1;
  return { rounded, static_cast<float>(low - static_cast<double>(rounded)),
    static_cast<float>(width > 0 ? std::ldexp(rows / width, exponent) : 0), 0 };
}

} // namespace teravox
