// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "BrickSource.h"
#include "Scene.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <array>
#include <memory>
#include <random>
#include <vtkImageData.h>

namespace teravox::test
{

/// What the tests of sort-last rendering draw: volumes of several bricks that are turned and
/// stretched, small pictures.
inline constexpr int BrickEdge = 16;
inline constexpr int Size = 72;
inline constexpr double Tolerance = 1.0 / 255;

inline std::shared_ptr<BrickSource> SourceOf(const UnitField& field,
  ScalarType type = ScalarType::UInt8, bool cellData = false, double shareOfNaN = 0)
{
  ImageOptions options;
  options.Type = type;
  options.Dimensions = { 96, 80, 112 };
  options.CellData = cellData;
  options.ShareOfNaN = shareOfNaN;
  // What is turned and stretched: rays in the image's space aren't those of the world.
  options.Spacing = { 1, 1.25, 0.75 };
  options.Direction = { 0.8, -0.6, 0, 0.6, 0.8, 0, 0, 0, 1 };
  return SourceOfImage(MakeImage(options, field), BrickEdge, cellData);
}

inline std::shared_ptr<BrickSource> Noise(ScalarType type = ScalarType::UInt8)
{
  auto random = std::make_shared<std::mt19937>(3);
  return SourceOf([random](double, double, double)
    { return std::uniform_real_distribution<double>(0, 1)(*random); },
    type);
}

inline void LookInside(Stage& s)
{
  double b[6];
  s.Mapper->GetBounds(b);
  const std::array<double, 3> eye{ 0.45 * b[0] + 0.55 * b[1], 0.7 * b[2] + 0.3 * b[3],
    0.4 * b[4] + 0.6 * b[5] };
  s.LookFrom(eye, { 0.5 * (b[0] + b[1]), b[3], 0.5 * (b[4] + b[5]) }, 0.05, 500, 70);
}

} // namespace teravox::test
