// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "MarchParameters.h"
#include "TransferTable.h"
#include "ViewGeometry.h"

#include <array>
#include <cstdint>
#include <vector>

namespace teravox
{

/// TransferFunction::GradientOpacity as the marchers sample it: linear between equidistant nodes
/// from a magnitude of 0 to LastGradient, constant beyond. Read by
/// Shaders/Library/GradientOpacity.glsl. Thread: immutable value.
struct GradientTable
{
  /// Four times as many as VTK has.
  static constexpr int Nodes = 4096;
  /// Per node: opacity here, how far it has moved since the first node, and both at the next node.
  /// Empty: the opacity is 1 everywhere. With labels, one after the other as in BuildLabelTables();
  /// of several components one after the other.
  std::vector<std::array<float, 4>> Values;

  bool IsOne() const { return this->Values.empty(); }
  std::uint64_t SizeInBytes() const { return 16 * this->Values.size(); }
};

GradientTable BuildGradientTable(const TransferFunction& function);

/// Of components without labels, each up to its own LastGradient.
GradientTable BuildGradientTables(const std::vector<TransferFunction>& functions);

/// The largest magnitude that counts, of the function and its labels.
double LastGradientOf(const TransferFunction& function);

/// Nodes per central difference along each axis of voxels of level 0, for `nodes` per data value
/// and mean spacing. See GradientParameters().
MarchParameters::Vec GradientScale(double nodes, const Matrix4& datasetFromVoxel, int exponent);

/// MarchParameters::Gradient. `datasetFromVoxel`: its columns are as long as voxels are apart.
/// `exponent`: values that are drawn are the user's times 2^-exponent (see ScaleExponent).
MarchParameters::Vec GradientParameters(
  const TransferFunction& function, const Matrix4& datasetFromVoxel, int exponent);

} // namespace teravox
