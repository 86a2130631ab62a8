// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
// Opacity and colour over value and gradient without OpenGL: closed forms, and the same picture at
// any tolerance. Truth: Testing/Cxx/TestRenderPlane.cxx.
#include "Effort.h"
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

std::array<double, 4> ColorOf(double share)
{
  return { share, 1 - share, 0.5, 0 };
}
} // namespace

// Of a linear field one row counts: it is an ordinary function.
TEST(NativePlane, ARowOfTheTableIsAFunctionOfTheValue)
{
  const Double3 spacing{ 0.5, 1, 2.1 };
  const double mean = (spacing[0] + spacing[1] + spacing[2]) / 3;
  const std::vector<double> shares{ 0, 0.125, 0.25, 0.5, 0.625, 0.75, 1 };
  const std::vector<double> opacities{ 0, 0, 0.3, 0, 0.4, 0, 0 };
  const std::vector<double> row{ 0, 0, 0.3, 0.15, 0, 0.4, 0, 0, 0 };
  for (const ScalarType type : { ScalarType::UInt16, ScalarType::Float32, ScalarType::Float64 })
  {
    const Volume volume = Ramp(type, spacing);
    const double magnitude = (volume.High - volume.Low) / 33 / spacing[0] * mean;
    for (const bool shade : { false, true })
    {
      for (const double tolerance : { 1.0 / 255, 0.0 })
      {
        PictureScene plain;
        plain.Source = volume.Source;
        plain.Function = volume.Function(shares, opacities);
        plain.Function.Color = [volume](double v, double* rgb)
        {
          const auto color = ColorOf((v - volume.Low) / (volume.High - volume.Low));
          std::copy_n(color.begin(), 3, rgb);
        };
        plain.Camera = Outside(plain.Source->Info(), 40, 36);
        plain.Shade = shade;
        plain.Tolerance = tolerance;
        PictureScene scene = plain;
        // The same at the second of three rows, walls at the others.
        scene.Function = MakePlane(9, 3, { volume.Low, volume.High }, 2 * magnitude,
          [&](double v, double gradient) -> std::array<float, 4>
          {
            const auto color = ColorOf(v);
            const double opacity = gradient == 0 ? 0
              : gradient == 1                    ? 1
                              : row[static_cast<std::size_t>(std::lround(8 * v))];
            return { static_cast<float>(color[0]), static_cast<float>(color[1]),
              static_cast<float>(color[2]), static_cast<float>(opacity) };
          });
        const Picture a = Draw(scene);
        const Picture b = Draw(plain);
        const std::string what = std::string(ToString(type)) + (shade ? ", shaded" : "") +
          (tolerance > 0 ? "" : ", fixed steps");
        ExpectSound(a, what);
        EXPECT_GT(a.Strongest(), 0.1f) << what;
        EXPECT_LT(LargestDifference(a, b), 4e-3f) << what;
      }
    }
  }
}

// Where nothing changes the rays' integral is known: opacity per unit distance.
TEST(NativePlane, OneValueIsDrawnAtGradientZero)
{
  const Volume volume = MakeVolume(ScalarType::UInt16, { 20, 20, 20 }, 9,
    [](const Int3& at) { return at[0] == 0 && at[1] == 0 && at[2] == 0 ? 0.0 : 0.5; });
  PictureScene scene;
  scene.Source = volume.Source;
  scene.Function = MakePlane(
    3, 3, { volume.Low, volume.High }, 1000,
    [](double, double gradient) -> std::array<float, 4> {
      return { 0.25f, 0.5f, 1, gradient == 0 ? 0.02f : 0.9f };
    },
    0.5);
  for (const bool nearest : { false, true })
  {
    scene.Nearest = nearest;
    scene.Camera = MakeCamera(scene.Source->Info(), 9, 9,
      LookAt({ 10, 10, 60 }, { 10, 10, 0 }, { 0, 1, 0 }), Parallel(8, 1, 1, 100));
    const Picture picture = Draw(scene);
    ExpectSound(picture, "one value");
    const auto left = static_cast<float>(std::pow(0.98, 19 / 0.5));
    for (std::size_t pixel = 0; pixel < 81; ++pixel)
    {
      EXPECT_NEAR(picture.Colors[4 * pixel + 3], left, 2e-5f);
      EXPECT_NEAR(picture.Colors[4 * pixel], 0.25f * (1 - left), 2e-5f);
      EXPECT_NEAR(picture.Colors[4 * pixel + 2], 1 - left, 2e-5f);
    }
  }
}

// The estimate of what a piece may err keeps pictures within their tolerance.
TEST(NativePlane, EachToleranceIsKept)
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
    // Coarse and fine islands, a table of two values, columns as narrow as a node.
    const auto combs = [](double value, double gradient) -> std::array<float, 4>
    {
      const int tooth = static_cast<int>(value * 128 + 0.5);
      const float opacity = tooth % 16 == 0 && gradient < 0.5 ? 0.4f : 0.0f;
      return { static_cast<float>(value), tooth % 32 == 0 ? 1.0f : 0.0f, 0.5f, opacity };
    };
    const auto corner = [](double value, double gradient) -> std::array<float, 4>
    {
      return { static_cast<float>(gradient), static_cast<float>(value), 0,
        static_cast<float>(0.3 * value * (1 - gradient)) };
    };
    const double quarter = 0.25 * (volume.High - volume.Low);
    const std::array<TransferFunction, 4> functions{ volume.Plane(23, 17, Islands),
      volume.Plane(200, 150, Islands), volume.Plane(2, 2, corner),
      MakePlane(129, 5, { volume.Low, volume.High }, 0.3 * quarter, combs) };
    for (std::size_t i = 0; i < functions.size(); ++i)
    {
      PictureScene scene;
      scene.Source = volume.Source;
      scene.Function = functions[i];
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
            (shade ? ", shaded, " : ", ") + std::to_string(i) + ", " + std::to_string(tolerance);
          ExpectSound(usual, what);
          EXPECT_GT(usual.Strongest(), 0.1f) << what;
          EXPECT_LT(LargestDifference(usual, fine), tolerance) << what;
        }
      }
    }
  }
}

} // namespace teravox
