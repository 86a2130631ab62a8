// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TestSupport.h"

#include <algorithm>
#include <gtest/gtest.h>

namespace teravox
{
namespace
{

using Node = TruthImage::Node;

TEST(TruthImage, IsBilinearAndConstantBeyond)
{
  const TruthImage image(3,
    { { 0, 0, 0, 0.1 }, { 1, 0, 0, 0.3 }, { 0, 0, 1, 0.2 }, { 0, 1, 0, 0.5 }, { 0, 0, 0, 0.9 },
      { 0, 0, 0, 0.4 } },
    10, 30, 4, 1, { 1, 1, 1 });
  const auto expect = [&](double v, double m, const Node& expected)
  {
    const Node node = image.At(v, m);
    for (std::size_t c = 0; c < 4; ++c)
    {
      EXPECT_NEAR(node[c], expected[c], 1e-14) << v << ", " << m << ", " << c;
    }
  };
  expect(10, 0, { 0, 0, 0, 0.1 });
  expect(20, 0, { 1, 0, 0, 0.3 });
  expect(25, 0, { 0.5, 0, 0.5, 0.25 });
  expect(15, 1, { 0.375, 0.125, 0, 0.75 * 0.2 + 0.25 * 0.7 });
  expect(40, 9, { 0, 0, 0, 0.4 });
  expect(-5, -1, { 0, 0, 0, 0.1 });
  expect(12, 4, { 0, 0.8, 0, 0.58 });
  EXPECT_EQ(image.Envelope().GetAlpha(20), 0.9);
  EXPECT_EQ(image.Envelope().GetAlpha(10), 0.5);
}

// A linear field has one gradient, and a row of the image is an ordinary function.
TEST(TruthImage, AlongALinearFieldItIsAFunctionOfTheValue)
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
  const Double3 target = TransformPoint(volume.WorldFromVoxel(), { 10, 6, 4 });
  const TruthCamera camera =
    CameraBetween(target - Double3{ 2, 1, 3 }, target + Double3{ 2, 1, 3 });
  const double magnitude = std::sqrt(14.0) * 3.5 / 3;
  const TruthTransfer transfer =
    TruthTransfer::PiecewiseLinear({ { middle - 1, 0 }, { middle, 0.4 }, { middle + 1, 0 } },
      { { middle - 1, { 1, 0.5, 0 } }, { middle, { 0, 0, 0.5 } }, { middle + 1, { 0, 0.5, 1 } } },
      0.3);
  // Twice as much at twice the magnitude, nothing at 0.
  const TruthImage image(3,
    { { 1, 0.5, 0, 0 }, { 0, 0, 0.5, 0 }, { 0, 0.5, 1, 0 }, { 1, 0.5, 0, 0 }, { 0, 0, 0.5, 0.8 },
      { 0, 0.5, 1, 0 } },
    middle - 1, middle + 1, 2 * magnitude, 0.3, spacing);
  for (const bool shade : { false, true })
  {
    TruthHeadlight::Geometry geometry;
    geometry.Spacing = spacing;
    const TruthHeadlight headlight({}, geometry);
    TruthScene plain{ volume, transfer, camera, TruthLevelOfDetail(0) };
    plain.Shading = shade ? &headlight : nullptr;
    TruthScene scene = plain;
    scene.Image = &image;
    const TruthColor a = IntegratePixel(scene, 0, 0);
    const TruthColor b = IntegratePixel(plain, 0, 0);
    ASSERT_GT(b[3], 0.2);
    for (std::size_t c = 0; c < 4; ++c)
    {
      EXPECT_NEAR(a[c], b[c], 1e-10) << shade;
    }
  }
}

// The square of the index along z: magnitudes are twice the index, values its square between
// indices.
class ParabolaImage : public testing::Test
{
protected:
  TruthVolume Volume =
    OneLevel([](auto, auto, auto k) { return static_cast<double>(k * k); }, { 6, 6, 30 });
  TruthCamera Camera = CameraAlongZ(2.6, 3.1, 5.8, 18.2); // indices 5.3 to 17.7
};

TEST_F(ParabolaImage, OneValueOfOpacityPerMagnitude)
{
  const TruthTransfer none = Uniform(0, {});
  // Opacity of rows at magnitudes 0, 20, 40.
  const TruthImage image(
    1, { { 1, 1, 1, 0 }, { 1, 1, 1, 0.1 }, { 1, 1, 1, 0 } }, 0, 1, 40, 1, { 1, 1, 1 });
  TruthScene scene{ this->Volume, none, this->Camera, TruthLevelOfDetail(0) };
  scene.Image = &image;
  // The integral of -ln(1 - a) over a is (1 - a) ln(1 - a) + a; the opacity is index / 100 up to
  // index 10 and falls as slowly behind.
  const auto integral = [](double a) { return (1 - a) * std::log1p(-a) + a; };
  const double tau = 100 * (2 * integral(0.1) - integral(0.053) - integral(0.1 - 0.077));
  const TruthColor color = IntegratePixel(scene, 0, 0);
  EXPECT_NEAR(color[3], -std::expm1(-tau), 1e-10);
  EXPECT_NEAR(color[0], color[3], 1e-10);
}

TEST_F(ParabolaImage, WallsStandWhereAllNodesAroundAre)
{
  const TruthTransfer none = Uniform(0, {});
  // From magnitude 24 (index 12) to 26, all values: a wall whose colour is the value / 900.
  std::vector<Node> nodes;
  for (int row = 0; row < 21; ++row)
  {
    const double opacity = row == 12 || row == 13 ? 1 : 0;
    nodes.push_back({ 0, 0, 0, opacity });
    nodes.push_back({ 1, 0, 0, opacity });
  }
  const TruthImage image(2, nodes, 0, 900, 40, 1, { 1, 1, 1 });
  TruthScene scene{ this->Volume, none, this->Camera, TruthLevelOfDetail(0) };
  scene.Image = &image;
  const TruthColor color = IntegratePixel(scene, 0, 0);
  EXPECT_EQ(color[3], 1);
  // In front of it the opacity rises to 1 over an index: about two optical depths.
  EXPECT_GT(color[0], 0.13);
  EXPECT_LT(color[0], 144.0 / 900);
}

TEST_F(ParabolaImage, OneValueAndNearestInterpolation)
{
  const auto plain = OneLevel([](auto, auto, auto) { return 7.0; }, { 6, 6, 30 });
  const TruthTransfer none = Uniform(0, {});
  const TruthImage image(2,
    { { 1, 1, 1, 0 }, { 1, 1, 1, 0.1 }, { 1, 1, 1, 0.5 }, { 1, 1, 1, 0.5 } }, 0, 14, 20, 1,
    { 1, 1, 1 });
  TruthScene constant{ plain, none, this->Camera, TruthLevelOfDetail(0) };
  constant.Image = &image;
  EXPECT_NEAR(IntegratePixel(constant, 0, 0)[3], 1 - std::pow(0.95, 12.4), 1e-12);
  // Voxel 10 is the first whose own magnitude is 20.
  const auto voxels = OneLevel([](auto, auto, auto k) { return static_cast<double>(k * k); },
    { 6, 6, 30 }, TruthInterpolation::Nearest);
  const TruthImage steep(
    1, { { 1, 1, 1, 0 }, { 1, 1, 1, 0 }, { 1, 1, 1, 0.1 } }, 0, 1, 20, 1, { 1, 1, 1 });
  TruthScene nearest{ voxels, none, this->Camera, TruthLevelOfDetail(0) };
  nearest.Image = &steep;
  // Voxels 6 to 9 have 0.02 (index - 5).
  double left = std::pow(0.9, 8.2);
  for (const double opacity : { 0.02, 0.04, 0.06, 0.08 })
  {
    left *= 1 - opacity;
  }
  EXPECT_NEAR(IntegratePixel(nearest, 0, 0)[3], 1 - left, 1e-12);
}

// A second opinion: many small steps through noise, which share only field and magnitude.
TEST(TruthImage, NoiseBesideSmallSteps)
{
  const auto volume =
    OneLevel([](auto i, auto j, auto k) { return 100 * Hash01(i, j, k); }, { 12, 12, 12 });
  std::vector<Node> nodes;
  for (int i = 0; i < 9 * 7; ++i)
  {
    nodes.push_back({ Hash01(i, 0, 0), Hash01(i, 1, 0), Hash01(i, 2, 0),
      std::max(0.6 * Hash01(i, 3, 0) - 0.25, 0.0) });
  }
  const TruthImage image(9, nodes, 5, 95, 40, 0.8, { 1, 1, 1 });
  const TruthTransfer none = Uniform(0, {});
  const Double3 from{ 2, 3, 1 };
  const Double3 to{ 9, 8, 11 };
  const TruthCamera camera = CameraBetween(from, to);
  TruthScene scene{ volume, none, camera, TruthLevelOfDetail(0) };
  scene.Image = &image;
  const TruthColor truth = IntegratePixel(scene, 0, 0);
  const TruthRay ray = camera.Ray(0, 0);
  constexpr int steps = 400000;
  const double length = ray.Length / steps;
  double tau = 0;
  Double3 color{};
  for (int i = 0; i < steps; ++i)
  {
    const Double3 p = TransformPoint(volume.VoxelFromWorld(), ray.At((i + 0.5) * length));
    const double magnitude =
      image.Rows().Magnitude(volume.CentralDifference(0, p, { 1, 1, 1 }), { 1, 1, 1 });
    const Node node = image.At(volume.Field(0, p), magnitude);
    const double depth = -std::log1p(-node[3]) / 0.8 * length;
    color = color + (std::exp(-tau) * -std::expm1(-depth)) * Double3{ node[0], node[1], node[2] };
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
