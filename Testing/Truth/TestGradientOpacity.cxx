// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TestSupport.h"

#include <algorithm>
#include <gtest/gtest.h>
#include <limits>

namespace teravox
{
namespace
{

constexpr double Infinite = std::numeric_limits<double>::infinity();

TEST(TruthGradientOpacity, PolynomialRoots)
{
  // (x - 1/4) (x - 1/2)^2 (x - 2): the double root comes to 0 without changing the sign.
  const std::vector<double> roots = PolynomialRoots({ 0.125, -1.0625, 3, -3.25, 1 }, 0, 1);
  ASSERT_FALSE(roots.empty());
  EXPECT_NEAR(roots[0], 0.25, 1e-12);
  for (std::size_t i = 1; i < roots.size(); ++i)
  {
    EXPECT_NEAR(roots[i], 0.5, 1e-7);
  }
  EXPECT_TRUE(PolynomialRoots({ 3 }, 0, 1).empty());
  EXPECT_TRUE(PolynomialRoots({ 1, 0, 1 }, 0, 1).empty());
  // Chebyshev's T6, all of whose roots lie in (-1, 1).
  const std::vector<double> six = PolynomialRoots({ -1, 0, 18, 0, -48, 0, 32 }, -1, 1);
  ASSERT_EQ(six.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i)
  {
    EXPECT_NEAR(
      six[i], -std::cos((2.0 * static_cast<double>(i) + 1) * std::acos(-1.0) / 12), 1e-12);
  }
}

TEST(TruthGradientOpacity, MagnitudeInTermsOfVTK)
{
  // 3 units per world length along x, 2 along y, -1 along z; voxels 0.5 x 1 x 2 apart.
  const TruthGradientOpacity opacity([](double m) { return m; }, {}, { 0.5, 1, 2 });
  const double expected = std::sqrt(14.0) * 3.5 / 3;
  EXPECT_NEAR(opacity.Magnitude({ 3, 4, -4 }, { 1, 1, 1 }), expected, 1e-13);
  // Voxels of a coarser level lie farther apart.
  EXPECT_NEAR(opacity.Magnitude({ 6, 8, -4 }, { 2, 2, 1 }), expected, 1e-13);
  EXPECT_EQ(opacity.Magnitude({ 1, std::nan(""), 0 }, { 1, 1, 1 }), 0);
  EXPECT_EQ(opacity.Magnitude({ 1, Infinite, 0 }, { 1, 1, 1 }), Infinite);
}

// A linear field has one gradient: its opacity is as if the unit distance were longer.
TEST(TruthGradientOpacity, ConstantGradientScalesTheExtinction)
{
  const Double3 spacing{ 0.5, 1, 2 };
  const auto volume = OneLevel(
    [=](auto i, auto j, auto k)
    {
      return 3 * spacing[0] * static_cast<double>(i) + 2 * static_cast<double>(j) -
        spacing[2] * static_cast<double>(k);
    },
    { 20, 12, 8 }, TruthInterpolation::Linear, false,
    TruthVolume::WorldFromVoxel({ 0, 0, 0 }, spacing));
  const double middle = volume.Field(0, { 10, 6, 4 });
  // The ends of the box, where the clamped field bends, are kept out by the transfer function.
  const auto transfer = [&](double unitDistance)
  {
    return TruthTransfer::PiecewiseLinear(
      { { middle - 1, 0 }, { middle - 0.5, 0.4 }, { middle + 0.5, 0.2 }, { middle + 1, 0 } },
      { { middle - 1, { 1, 0.5, 0 } }, { middle + 1, { 0, 0.5, 1 } } }, unitDistance);
  };
  const Double3 target = TransformPoint(volume.WorldFromVoxel(), { 10, 6, 4 });
  const TruthCamera camera =
    CameraBetween(target - Double3{ 2, 1, 3 }, target + Double3{ 2, 1, 3 });
  const double magnitude = std::sqrt(14.0) * 3.5 / 3;
  const TruthGradientOpacity opacity(
    [](double m) { return std::min(m / 10, 1.0); }, { 0, 10 }, spacing);
  for (const bool shade : { false, true })
  {
    TruthHeadlight::Geometry geometry;
    geometry.Spacing = spacing;
    const TruthHeadlight headlight({}, geometry);
    const TruthTransfer plain = transfer(0.3);
    const TruthTransfer longer = transfer(0.3 * 10 / magnitude);
    TruthScene scene{ volume, plain, camera, TruthLevelOfDetail(0) };
    TruthScene scaled{ volume, longer, camera, TruthLevelOfDetail(0) };
    scene.Shading = scaled.Shading = shade ? &headlight : nullptr;
    scene.GradientOpacity = &opacity;
    const TruthColor a = IntegratePixel(scene, 0, 0);
    const TruthColor b = IntegratePixel(scaled, 0, 0);
    ASSERT_GT(b[3], 0.2);
    for (std::size_t c = 0; c < 4; ++c)
    {
      EXPECT_NEAR(a[c], b[c], 1e-10) << shade;
    }
  }
}

// The square of the index along z: central differences are 4 k, magnitudes 2 k, linear in between.
class Parabola : public testing::Test
{
protected:
  TruthVolume Volume =
    OneLevel([](auto, auto, auto k) { return static_cast<double>(k * k); }, { 6, 6, 30 });
  TruthCamera Camera = CameraAlongZ(2.6, 3.1, 5.8, 18.2); // indices 5.3 to 17.7
};

TEST_F(Parabola, LinearOpacityOfTheGradient)
{
  const TruthTransfer transfer = FromExtinction([](double) { return 0.05; }, { 1, 0.5, 0.25 });
  const TruthGradientOpacity opacity(
    [](double m) { return std::clamp((m - 14) / 12, 0.0, 1.0); }, { 14, 26 }, { 1, 1, 1 });
  TruthScene scene{ this->Volume, transfer, this->Camera, TruthLevelOfDetail(0) };
  scene.GradientOpacity = &opacity;
  // 0 up to index 7, rising up to index 13, 1 from there on.
  const double tau = 0.05 * (0.5 * 6 + 4.7);
  const TruthColor color = IntegratePixel(scene, 0, 0);
  EXPECT_NEAR(color[3], -std::expm1(-tau), 1e-11);
  EXPECT_NEAR(color[0], color[3], 1e-11);
  EXPECT_NEAR(color[2], 0.25 * color[3], 1e-11);
}

TEST_F(Parabola, WallsStandWhereTheGradientLetsThem)
{
  const TruthTransfer wall([](double) { return 1.0; },
    [](double v) {
      return Double3{ v / 1000, 0, 0 };
    },
    {}, 1);
  const auto from = [](double least)
  {
    return TruthGradientOpacity(
      [=](double m) { return m > least ? 0.01 : 0.0; }, { least }, { 1, 1, 1 });
  };
  TruthScene scene{ this->Volume, wall, this->Camera, TruthLevelOfDetail(0) };
  const TruthGradientOpacity some = from(23); // index 11.5, between 11^2 and 12^2
  scene.GradientOpacity = &some;
  const TruthColor color = IntegratePixel(scene, 0, 0);
  EXPECT_EQ(color[3], 1);
  EXPECT_NEAR(color[0], 0.5 * (121 + 144) / 1000, 1e-9);
  const TruthGradientOpacity none = from(36);
  scene.GradientOpacity = &none;
  EXPECT_EQ(IntegratePixel(scene, 0, 0)[3], 0);
}

TEST_F(Parabola, OneValueAndNearestInterpolation)
{
  const auto plain = OneLevel([](auto, auto, auto) { return 7.0; }, { 6, 6, 30 });
  const TruthTransfer transfer = Uniform(0.1, { 1, 1, 1 });
  const TruthGradientOpacity opacity(
    [](double m) { return m == 0 ? 0.5
                     : m < 20    ? 0.0
                                 : 1.0; }, { 0, 20 }, { 1, 1, 1 });
  TruthScene constant{ plain, transfer, this->Camera, TruthLevelOfDetail(0) };
  constant.GradientOpacity = &opacity;
  EXPECT_NEAR(IntegratePixel(constant, 0, 0)[3], 1 - std::pow(0.9, 0.5 * 12.4), 1e-12);
  // Voxel 10 is the first whose own magnitude is 20.
  const auto voxels = OneLevel([](auto, auto, auto k) { return static_cast<double>(k * k); },
    { 6, 6, 30 }, TruthInterpolation::Nearest);
  TruthScene nearest{ voxels, transfer, this->Camera, TruthLevelOfDetail(0) };
  nearest.GradientOpacity = &opacity;
  EXPECT_NEAR(IntegratePixel(nearest, 0, 0)[3], 1 - std::pow(0.9, 8.2), 1e-12);
}

// A second opinion: many small steps through noise, which share only field and magnitude.
TEST(TruthGradientOpacity, NoiseBesideSmallSteps)
{
  const auto volume =
    OneLevel([](auto i, auto j, auto k) { return 100 * Hash01(i, j, k); }, { 12, 12, 12 });
  const auto transfer = TruthTransfer::PiecewiseLinear(
    { { 20, 0 }, { 50, 0.3 }, { 80, 0.1 } }, { { 0, { 1, 0.2, 0 } }, { 100, { 0, 0.4, 1 } } }, 1);
  const auto function = [](double m) { return std::clamp(1 - std::fabs(m - 25) / 6, 0.0, 1.0); };
  const TruthGradientOpacity opacity(function, { 19, 25, 31 }, { 1, 1, 1 });
  const Double3 from{ 2, 3, 1 };
  const Double3 to{ 9, 8, 11 };
  const TruthCamera camera = CameraBetween(from, to);
  TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  scene.GradientOpacity = &opacity;
  const TruthColor truth = IntegratePixel(scene, 0, 0);
  const TruthRay ray = camera.Ray(0, 0);
  constexpr int steps = 400000;
  const double length = ray.Length / steps;
  double tau = 0;
  Double3 color{};
  for (int i = 0; i < steps; ++i)
  {
    const Double3 p = TransformPoint(volume.VoxelFromWorld(), ray.At((i + 0.5) * length));
    const double value = volume.Field(0, p);
    const double magnitude =
      opacity.Magnitude(volume.CentralDifference(0, p, { 1, 1, 1 }), { 1, 1, 1 });
    const double depth =
      transfer.Extinction(transfer.GetAlpha(value)) * function(magnitude) * length;
    color = color + (std::exp(-tau) * -std::expm1(-depth)) * transfer.GetColor(value);
    tau += depth;
  }
  ASSERT_GT(truth[3], 0.1);
  EXPECT_NEAR(truth[3], -std::expm1(-tau), 1e-7);
  for (std::size_t c = 0; c < 3; ++c)
  {
    EXPECT_NEAR(truth[c], color[c], 1e-7);
  }
}

} // namespace
} // namespace teravox
