// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Opacity by gradient without OpenGL: closed forms, and the same picture at any tolerance. Truth:
// Testing/Cxx/TestRenderGradient.cxx.
#include "Effort.h"
#include "GradientTable.h"
#include "NativeVolumes.h"

#include <algorithm>
#include <gtest/gtest.h>

namespace teravox
{

namespace
{
using namespace test;

// Rises along x only, so that the gradient is the same all over but at the ends along x.
Volume Ramp(ScalarType type, const Double3& spacing)
{
  const Int3 dimensions{ 33, 20, 24 };
  return MakeVolume(
    type, dimensions, 9,
    [=](const Int3& at) { return static_cast<double>(at[0]) / static_cast<double>(dimensions[0]); },
    spacing);
}
} // namespace

TEST(NativeGradient, TableSamplesTheFunction)
{
  TransferFunction function;
  EXPECT_TRUE(BuildGradientTable(function).IsOne());
  function.GradientOpacity = [](double) { return 1.0; };
  EXPECT_TRUE(BuildGradientTable(function).IsOne());
  // A triangle, too high and below 0.
  function.GradientOpacity = [](double m) { return m < 2 ? m : 4 - m; };
  function.LastGradient = 5;
  const GradientTable table = BuildGradientTable(function);
  ASSERT_EQ(table.Values.size(), static_cast<std::size_t>(GradientTable::Nodes));
  EXPECT_EQ(table.SizeInBytes(), 16u * GradientTable::Nodes);
  double moved = 0;
  for (std::size_t i = 0; i < table.Values.size(); ++i)
  {
    const std::array<float, 4>& node = table.Values[i];
    const double m = 5.0 * static_cast<double>(i) / (GradientTable::Nodes - 1);
    EXPECT_NEAR(node[0], std::clamp(function.GradientOpacity(m), 0.0, 1.0), 1e-6);
    EXPECT_NEAR(node[1], moved, 1e-4);
    const std::array<float, 4>& next = table.Values[std::min(i + 1, table.Values.size() - 1)];
    EXPECT_EQ(node[2], next[0]);
    EXPECT_EQ(node[3], i + 1 < table.Values.size() ? next[1] : node[1]);
    moved += std::abs(static_cast<double>(node[2]) - static_cast<double>(node[0]));
  }
  EXPECT_NEAR(moved, 2, 1e-6);
}

TEST(NativeGradient, ParametersAreInTermsOfVTK)
{
  TransferFunction function;
  function.LastGradient = 10; // of a function that there is
  function.GradientOpacity = [](double) { return 0.5; };
  // Voxels 2, 1 and 3 apart; a turn changes nothing.
  const Matrix4 matrix{ 0, -1, 0, 5, 2, 0, 0, 6, 0, 0, 3, 7, 0, 0, 0, 1 };
  const double nodes = (GradientTable::Nodes - 1) / 10.0;
  for (const int exponent : { 0, 40 })
  {
    const MarchParameters::Vec p = GradientParameters(function, matrix, exponent);
    EXPECT_FLOAT_EQ(p[0], static_cast<float>(std::ldexp(nodes * 0.5, exponent)));
    EXPECT_FLOAT_EQ(p[1], static_cast<float>(std::ldexp(nodes, exponent)));
    EXPECT_FLOAT_EQ(p[2], static_cast<float>(std::ldexp(nodes / 3, exponent)));
    EXPECT_EQ(p[3], GradientTable::Nodes - 1);
  }
}

// A linear field has one gradient: its opacity is as if the unit distance were longer.
TEST(NativeGradient, ConstantGradientScalesTheExtinction)
{
  const Double3 spacing{ 0.5, 1, 2.1 };
  const double mean = (spacing[0] + spacing[1] + spacing[2]) / 3;
  for (const ScalarType type : { ScalarType::UInt16, ScalarType::Float32, ScalarType::Float64 })
  {
    const Volume volume = Ramp(type, spacing);
    // Of what is seen: along x, in values per mean distance. Integers step a little unevenly.
    const double magnitude = (volume.High - volume.Low) / 33 / spacing[0] * mean;
    for (const bool shade : { false, true })
    {
      for (const double tolerance : { 1.0 / 255, 0.0 })
      {
        PictureScene scene;
        scene.Source = volume.Source;
        scene.Function =
          volume.Function({ 0.1, 0.2, 0.3, 0.5, 0.6, 0.8 }, { 0, 0.3, 0.1, 0, 0.3, 0 });
        scene.Camera = Outside(scene.Source->Info(), 40, 36);
        scene.Shade = shade;
        scene.Tolerance = tolerance;
        PictureScene longer = scene;
        longer.Function.UnitDistance = scene.Function.UnitDistance / 0.4;
        scene.Function =
          WithGradientOpacity(std::move(scene.Function), 0.8 * magnitude, 1.3 * magnitude);
        const Picture a = Draw(scene);
        const Picture b = Draw(longer);
        const std::string what = std::string(ToString(type)) + (shade ? ", shaded" : "") +
          (tolerance > 0 ? "" : ", fixed steps");
        ExpectSound(a, what);
        EXPECT_GT(a.Strongest(), 0.1f) << what;
        EXPECT_LT(LargestDifference(a, b), 2e-3f) << what;
        EXPECT_GT(LargestDifference(a, Draw({ scene.Source, longer.Function, scene.Camera })), 0)
          << what;
      }
    }
  }
}

// The estimate of what a piece may err keeps pictures within their tolerance.
TEST(NativeGradient, EachToleranceIsKept)
{
  const Int3 dimensions{ 45, 38, 41 };
  for (const bool noisy : { false, true })
  {
    const Volume volume = MakeVolume(ScalarType::UInt16, dimensions, 9,
      noisy ? Landscape(dimensions, 3)
            : VoxelField(
                [=](const Int3& at)
                {
                  const auto wave = [&](std::size_t a, double f)
                  { return std::sin(f * static_cast<double>(at[a]) / 40); };
                  return 0.5 + 0.4 * wave(0, 9) * wave(1, 5) * wave(2, 7);
                }));
    const double range = volume.High - volume.Low;
    for (const std::array<double, 2>& limits :
      { std::array<double, 2>{ 0.005, 0.03 }, { 0, 0.3 }, { 0.02, 0.0201 } })
    {
      for (const double opacity : { 0.1, 1.0 })
      {
        PictureScene scene;
        scene.Source = volume.Source;
        scene.Function =
          WithGradientOpacity(volume.Function({ 0.0, 0.3, 0.42, 0.5, 0.65, 0.7, 1.0 },
                                { 0, 0, 0.15, 0, 0, opacity, 0.3 }),
            limits[0] * range, limits[1] * range);
        scene.Camera = Outside(scene.Source->Info(), Effort(44, 20), Effort(36, 16));
        for (const bool shade : { false, true })
        {
          scene.Shade = shade;
          scene.Tolerance = 1e-5;
          const Picture fine = Draw(scene);
          for (const double tolerance : { 1.0 / 255, 1.0 / 1020 })
          {
            scene.Tolerance = tolerance;
            const Picture usual = Draw(scene);
            const std::string what = std::string(noisy ? "noisy" : "smooth") +
              (shade ? ", shaded, " : ", ") + std::to_string(limits[0]) + ", " +
              std::to_string(opacity) + ", " + std::to_string(tolerance);
            ExpectSound(usual, what);
            EXPECT_GT(usual.Strongest(), 0.1f) << what;
            EXPECT_LT(LargestDifference(usual, fine), tolerance) << what;
          }
        }
      }
    }
  }
}

} // namespace teravox
