// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "MarchParameters.h"
#include "TransferTable.h"
#include "ViewGeometry.h"

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace teravox
{

/// Opacity and colour over the data value and the magnitude of the gradient, or over the values of
/// two components (ComponentMode::Plane), as the user set them: bilinear between nodes, constant
/// beyond the outermost ones. Thread: immutable value.
struct TransferImage
{
  int Columns = 0; ///< nodes along the value, at least 1
  int Rows = 0;    ///< nodes along the magnitude or the second value, at least 1
  /// Red, green, blue, opacity (per TransferFunction::UnitDistance), 0..1; row after row.
  std::vector<std::array<float, 4>> Nodes;
  ValueRange Values;       ///< of the first and the last column
  double LastGradient = 1; ///< of the last row, > 0; measured as TransferFunction::GradientOpacity
  /// Of the second component: of the first and the last row. Nothing: rows are magnitudes.
  std::optional<ValueRange> Second;
};

/// Makes `image` a function: TransferFunction::Image, and an Opacity that is nowhere below that of
/// the image in any row, though far enough above it that a table of Opacity is so, too. By it
/// values are skipped. `image`: any numbers; what isn't one is 0. An axis with more than
/// MostPlaneNodes nodes is sampled at so many places.
TransferFunction MakeImageFunction(TransferImage image, double unitDistance);
constexpr int MostPlaneNodes = 1024;

/// TransferFunction::Image as the marchers sample it. Read by Shaders/Library/TransferPlane.glsl.
/// Thread: immutable value.
struct TransferPlane
{
  int Columns = 0; ///< at least 2; 0: there is none
  int Rows = 0;    ///< at least 2
  std::vector<std::array<float, 4>> Nodes;

  /// What pieces of a ray may meet between their ends, level after level. Element x + y Width(l) of
  /// level l is about the nodes from (x, y) 2^l on, 2^(l+1) intervals along both axes, so that any
  /// rectangle of at most 2^l intervals lies in one: the largest extinction; the largest change of
  /// the extinction from column to column, and from row to row; the largest of a channel of the
  /// colour, either way.
  std::vector<std::array<float, 4>> Bounds;
  static constexpr int MostLevels = 12;
  int Levels = 0;
  std::array<std::int32_t, MostLevels> First{}; ///< of each level

  bool IsNone() const { return this->Columns == 0; }
  int Width(int level) const { return ((this->Columns - 2) >> level) + 1; }
  int Height(int level) const { return ((this->Rows - 2) >> level) + 1; }
  std::uint64_t SizeInBytes() const { return 16 * (this->Nodes.size() + this->Bounds.size()); }
};

/// `largestExtinction`: of the table of the same function, above which none is told.
TransferPlane BuildTransferPlane(const TransferFunction& function, double largestExtinction);

/// Sets MarchParameters::Gradient and Plane. See GradientParameters(); `table`: of the function. Of
/// a second component there is no measure of gradients: its position is in rows, RowParameters().
void SetPlaneParameters(MarchParameters& parameters, const TransferPlane& plane,
  const TransferFunction& function, const TransferTable& table, const Matrix4& datasetFromVoxel,
  int exponent);

/// MarchParameters::ComponentTransfer of TransferImage::Second: from values, which are the user's
/// times 2^-exponent, to rows.
MarchParameters::Vec RowParameters(const TransferImage& image, int exponent);

} // namespace teravox
