// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TestSupport.h"

#include <gtest/gtest.h>

namespace teravox
{
namespace
{

template <typename F>
TruthVolume MaskOf(const F& isIn, const Int3& dimensions)
{
  return OneLevel([=](auto i, auto j, auto k) { return isIn(i, j, k) ? 1.0 : 0.0; }, dimensions,
    TruthInterpolation::Nearest);
}

// What lies in the mask ends half way between voxels.
TEST(TruthMask, HalfOfAConstantMedium)
{
  const Int3 dimensions{ 11, 12, 21 };
  const auto volume = OneLevel([](auto, auto, auto) { return 5.0; }, dimensions);
  const auto mask = MaskOf([](auto, auto, auto k) { return k < 8; }, dimensions);
  const Double3 color{ 0.25, 0.5, 1 };
  const TruthTransfer transfer = Uniform(0.125, color, 2.5);
  const TruthCamera camera = CameraAlongZ(3.7, 4.1, -10, 100);
  TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  scene.Mask = &mask;
  const double alpha = 1 - std::pow(1 - 0.125, 7.5 / 2.5);
  const TruthColor found = IntegratePixel(scene, 0, 0);
  EXPECT_NEAR(found[0], alpha * color[0], 1e-14);
  EXPECT_NEAR(found[3], alpha, 1e-14);
}

TEST(TruthMask, TheFieldIsThatOfAllVoxels)
{
  // sigma = z / 20 between z = 2.5 and 5.5: interpolated from voxels that the mask leaves out, too.
  const Int3 dimensions{ 5, 5, 11 };
  const auto volume =
    OneLevel([](auto, auto, auto k) { return static_cast<double>(k); }, dimensions);
  const auto mask = MaskOf([](auto, auto, auto k) { return k >= 3 && k <= 5; }, dimensions);
  const TruthTransfer transfer =
    FromExtinction([](double v) { return 0.05 * v; }, { 1, 1, 1 }, { 0 });
  const TruthCamera camera = CameraAlongZ(2.2, 2.9, -1, 50);
  TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  scene.Mask = &mask;
  const double tau = 0.05 / 2 * (5.5 * 5.5 - 2.5 * 2.5);
  EXPECT_NEAR(IntegratePixel(scene, 0, 0)[3], -std::expm1(-tau), 1e-10);
}

TEST(TruthMask, OneVoxelIsACubeAroundItsCenter)
{
  const Int3 dimensions{ 7, 7, 7 };
  const auto volume = OneLevel([](auto, auto, auto) { return 1.0; }, dimensions);
  const auto mask =
    MaskOf([](auto i, auto j, auto k) { return i == 3 && j == 3 && k == 3; }, dimensions);
  const TruthTransfer transfer = Uniform(0.5, { 1, 1, 1 });
  // Voxel 3 covers 3 to 4: corner to corner, along an axis, and past it.
  const TruthCamera diagonal = CameraBetween({ -1, -1, -1 }, { 7, 7, 7 });
  TruthScene scene{ volume, transfer, diagonal, TruthLevelOfDetail(0) };
  scene.Mask = &mask;
  EXPECT_NEAR(IntegratePixel(scene, 0, 0)[3], 1 - std::pow(0.5, std::sqrt(3.0)), 1e-9);
  const TruthCamera beside = CameraBetween({ 3.25, 3.75, -1 }, { 3.25, 3.75, 7 });
  TruthScene straight{ volume, transfer, beside, TruthLevelOfDetail(0) };
  straight.Mask = &mask;
  EXPECT_NEAR(IntegratePixel(straight, 0, 0)[3], 0.5, 1e-12);
  const TruthCamera outside = CameraBetween({ 3.75, 2.75, -1 }, { 3.75, 2.75, 7 });
  TruthScene missed{ volume, transfer, outside, TruthLevelOfDetail(0) };
  missed.Mask = &mask;
  EXPECT_EQ(IntegratePixel(missed, 0, 0)[3], 0);
}

// A coarser level has a mask of its own voxels.
TEST(TruthMask, LevelsHaveTheirOwn)
{
  const auto value = [](auto, auto, auto) { return 1.0; };
  const auto in = [](auto, auto, auto k) { return k == 2 ? 1.0 : 0.0; };
  const TruthVolume volume({ TruthLevel::FromFunction(value, { 8, 8, 16 }),
                             TruthLevel::FromFunction(value, { 4, 4, 8 }, { 2, 2, 2 }) },
    IdentityMatrix(), TruthInterpolation::Nearest, false);
  const TruthVolume mask({ TruthLevel::FromFunction(in, { 8, 8, 16 }),
                           TruthLevel::FromFunction(in, { 4, 4, 8 }, { 2, 2, 2 }) },
    IdentityMatrix(), TruthInterpolation::Nearest, false);
  const TruthTransfer transfer = Uniform(0.5, { 1, 1, 1 });
  const TruthCamera camera = CameraAlongZ(3.7, 4.1, -10, 100);
  for (const int level : { 0, 1 })
  {
    TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(level) };
    scene.Mask = &mask;
    EXPECT_NEAR(IntegratePixel(scene, 0, 0)[3], 1 - std::pow(0.5, level == 0 ? 1 : 2), 1e-12);
  }
}

// Layers of a constant medium, each with the functions of its label; what has none, and what has no
// name, has those of the volume.
TEST(TruthLabels, EachHasItsOwnFunctions)
{
  const Int3 dimensions{ 7, 7, 24 };
  const auto volume = OneLevel([](auto, auto, auto) { return 5.0; }, dimensions);
  const auto mask = OneLevel(
    [](auto, auto, auto k) {
      return k < 6 ? -2.0 : k < 12 ? 0.0 : k < 18 ? 300.7 : 9.0;
    },
    dimensions, TruthInterpolation::Nearest);
  const TruthTransfer transfer = Uniform(0.1, { 0, 0, 1 });
  const std::map<std::int64_t, TruthLabel> labels{ { -2, { Uniform(0.2, { 1, 0, 0 }), nullptr } },
    { 300, { Uniform(0.3, { 0, 1, 0 }), nullptr } } };
  const TruthCamera camera = CameraAlongZ(3.7, 4.1, -10, 100);
  TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  scene.Mask = &mask;
  scene.Labels = &labels;
  // The box begins and ends at the outer voxels' centres.
  const double red = 1 - std::pow(0.8, 5.5);
  const double before = std::pow(0.8, 5.5) * std::pow(0.9, 6);
  const double green = before * (1 - std::pow(0.7, 6));
  const double behind = before * std::pow(0.7, 6);
  const double blue = (1 - red) * (1 - std::pow(0.9, 6)) + behind * (1 - std::pow(0.9, 5.5));
  const TruthColor found = IntegratePixel(scene, 0, 0);
  EXPECT_NEAR(found[0], red, 1e-13);
  EXPECT_NEAR(found[1], green, 1e-13);
  EXPECT_NEAR(found[2], blue, 1e-13);
  EXPECT_NEAR(found[3], 1 - behind * std::pow(0.9, 5.5), 1e-13);
}

TEST(TruthLabels, GradientOpacityIsTheLabels)
{
  // A field with a gradient of 2 per voxel.
  const Int3 dimensions{ 7, 7, 17 };
  const auto volume =
    OneLevel([](auto, auto, auto k) { return 2.0 * static_cast<double>(k); }, dimensions);
  const auto mask = OneLevel(
    [](auto, auto, auto k) { return k < 8 ? 1.0 : 2.0; }, dimensions, TruthInterpolation::Nearest);
  const TruthTransfer transfer = Uniform(0.5, { 1, 1, 1 });
  const auto quarter = std::make_shared<TruthGradientOpacity>(
    [](double m) { return m > 1 ? 0.25 : 1.0; }, std::vector<double>{ 1 }, Double3{ 1, 1, 1 });
  const std::map<std::int64_t, TruthLabel> labels{ { 1, { Uniform(0.5, { 1, 1, 1 }), quarter } },
    { 2, { Uniform(0.5, { 1, 1, 1 }), nullptr } } };
  // One voxel along z, away from the ends, whose differences reach over one voxel only.
  const TruthCamera camera = CameraAlongZ(3.7, 4.1, -10, 100);
  TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  scene.Mask = &mask;
  scene.Labels = &labels;
  const double tau = std::log(2.0) * (0.25 * 7.5 + 8.5);
  // At the first voxel the difference is 2 over two voxels: a magnitude of 1, where the opacity is
  // 1, and more from there on.
  EXPECT_NEAR(IntegratePixel(scene, 0, 0)[3], -std::expm1(-tau), 1e-6);
}

} // namespace
} // namespace teravox
