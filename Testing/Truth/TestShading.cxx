// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TestSupport.h"

#include <gtest/gtest.h>
#include <limits>

namespace teravox
{
namespace
{

/// The test signal of Marschner and Lobb (1994) on [-1, 1]^3, f_M = 6, alpha = 0.25.
double MarschnerLobb(const Double3& p)
{
  const double pi = std::acos(-1.0);
  const double r = std::sqrt(p[0] * p[0] + p[1] * p[1]);
  const double rho = std::cos(2 * pi * 6 * std::cos(pi * r / 2));
  return (1 - std::sin(pi * p[2] / 2) + 0.25 * (1 + rho)) / (2 * (1 + 0.25));
}

/// Its gradient, by hand.
Double3 MarschnerLobbGradient(const Double3& p)
{
  const double pi = std::acos(-1.0);
  const double r = std::sqrt(p[0] * p[0] + p[1] * p[1]);
  const double perRadius =
    0.25 * std::sin(12 * pi * std::cos(pi * r / 2)) * 12 * pi * std::sin(pi * r / 2) * pi / 2;
  return { perRadius * p[0] / r / 2.5, perRadius * p[1] / r / 2.5,
    -std::cos(pi * p[2] / 2) * pi / 2 / 2.5 };
}

TEST(TruthShading, MarschnerLobbNormals)
{
  // Central differences are second order: doubling the grid divides the angle by four.
  std::array<double, 2> worst{};
  for (std::size_t grid = 0; grid < 2; ++grid)
  {
    const std::int64_t n = grid == 0 ? 256 : 512;
    const double h = 2.0 / static_cast<double>(n);
    const auto at = [=](std::int64_t i) { return -1 + h * (static_cast<double>(i) + 0.5); };
    const auto volume = OneLevel(
      [=](auto i, auto j, auto k) {
        return MarschnerLobb({ at(i), at(j), at(k) });
      },
      { n, n, n });
    TruthHeadlight::Geometry geometry;
    geometry.Spacing = { h, h, h };
    const TruthHeadlight headlight({}, geometry);
    for (int i = 0; i < 400; ++i)
    {
      const Double3 p{ 1.6 * Hash01(i, 0, 0) - 0.8, 1.6 * Hash01(i, 1, 0) - 0.8,
        1.6 * Hash01(i, 2, 0) - 0.8 };
      const Double3 pVoxel = (1 / h) * (p + Double3{ 1, 1, 1 });
      const Double3 normal =
        headlight.Normal(volume, 0, volume.CentralDifference(0, pVoxel, { 1, 1, 1 }));
      const Double3 exact = Normalize(MarschnerLobbGradient(p));
      worst[grid] = std::max(worst[grid], Length(normal - exact));
    }
  }
  EXPECT_LT(worst[1], 0.03);
  EXPECT_NEAR(worst[0] / worst[1], 4, 0.8);
}

struct ShadedRamp
{
  // Value = 3 x + 2 y - z in dataset coordinates of a turned, anisotropic image.
  Matrix3 Direction{ 0.6, -0.8, 0, 0.8, 0.6, 0, 0, 0, 1 };
  Double3 Spacing{ 0.5, 1, 2 };
  Double3 Origin{ 1, 2, 3 };
  Double3 Slope{ 3, 2, -1 };
  Matrix4 Prop = IdentityMatrix();
  Int3 Dimensions{ 20, 12, 8 };

  TruthVolume Make() const
  {
    return OneLevel(
      [this](auto i, auto j, auto k)
      {
        const Double3 index{ static_cast<double>(i) * this->Spacing[0],
          static_cast<double>(j) * this->Spacing[1], static_cast<double>(k) * this->Spacing[2] };
        return Dot(this->Slope, this->Origin + TransformVector(this->Direction, index));
      },
      this->Dimensions, TruthInterpolation::Linear, false,
      TruthVolume::WorldFromVoxel(this->Origin, this->Spacing, this->Direction, this->Prop));
  }
};

TEST(TruthShading, LinearFieldHasTheExactNormal)
{
  const ShadedRamp ramp;
  const TruthVolume volume = ramp.Make();
  TruthHeadlight::Geometry geometry;
  geometry.Spacing = ramp.Spacing;
  geometry.Direction = ramp.Direction;
  const Double3 exact = Normalize(ramp.Slope);
  const Double3 difference = volume.CentralDifference(0, { 9, 6, 4 }, { 1, 1, 1 });
  EXPECT_NEAR(Length(TruthHeadlight({}, geometry).Normal(volume, 0, difference) - exact), 0, 1e-13);
  // VTK 9.1 leaves the normal in the image's axes.
  geometry.TurnNormals = false;
  const Double3 unturned = TruthHeadlight({}, geometry).Normal(volume, 0, difference);
  EXPECT_NEAR(Length(TransformVector(ramp.Direction, unturned) - exact), 0, 1e-13);
  EXPECT_GT(Length(unturned - exact), 0.1);
}

TEST(TruthShading, HeadlightInClosedForm)
{
  // In the ramp the normal is the same everywhere, so shading multiplies by a constant of the ray.
  // The ends of the box are kept out by the transfer function: there the clamped field bends.
  ShadedRamp ramp;
  ramp.Prop[3] = 50; // shifted, and turned about x
  ramp.Prop[5] = ramp.Prop[10] = 0.8;
  ramp.Prop[6] = -0.6;
  ramp.Prop[9] = 0.6;
  const TruthVolume volume = ramp.Make();
  const double middle = volume.Field(0, { 10, 6, 4 });
  const Double3 color{ 0.5, 0.25, 0.125 };
  const auto transfer = TruthTransfer::PiecewiseLinear(
    { { middle - 1, 0 }, { middle - 1, 0.2 }, { middle + 1, 0.2 }, { middle + 1, 0 } },
    { { 0, color } }, 1);
  TruthHeadlight::Geometry geometry;
  geometry.Spacing = ramp.Spacing;
  geometry.Direction = ramp.Direction;
  geometry.WorldFromDataset = ramp.Prop;
  TruthHeadlight::Material material;
  material.LightDiffuse = { 1, 0.5, 0.75 };
  const Double3 target = TransformPoint(volume.WorldFromVoxel(), { 10, 6, 4 });
  const Matrix4 projections[] = { TruthCamera::Frustum(-0.02, 0.02, -0.02, 0.02, 1, 100),
    TruthCamera::Ortho(-0.5, 0.5, -0.5, 0.5, 1, 100) };
  for (const Matrix4& projection : projections)
  {
    for (const double side : { 1.0, -1.0 })
    {
      const Double3 eye = target + side * Double3{ 20, 13, 9 };
      const TruthCamera camera(TruthCamera::LookAt(eye, target, { 0, 1, 0 }), projection, 5, 5);
      for (const bool twoSided : { true, false })
      {
        material.TwoSided = twoSided;
        const TruthHeadlight headlight(material, geometry);
        const TruthScene plain{ volume, transfer, camera, TruthLevelOfDetail(0) };
        TruthScene shaded = plain;
        shaded.Shading = &headlight;
        const TruthColor a = IntegratePixel(plain, 3, 1);
        const TruthColor b = IntegratePixel(shaded, 3, 1);
        ASSERT_GT(a[3], 0.05);

        const TruthRay ray = camera.Ray(3, 1);
        double entry = 0;
        const Double3 from = TransformPoint(volume.VoxelFromWorld(), ray.Origin);
        const Double3 along = TransformVector(volume.VoxelFromWorld(), ray.Direction);
        for (std::size_t axis = 0; axis < 3; ++axis)
        {
          const double end = static_cast<double>(ramp.Dimensions[axis]) - 0.5;
          entry = std::max(
            entry, std::min((0.5 - from[axis]) / along[axis], (end - from[axis]) / along[axis]));
        }
        const Double3 normal = Normalize(TransformVector(ramp.Prop, ramp.Slope)); // world
        double cosine = Dot(normal, Normalize(eye - ray.At(entry)));
        cosine = cosine < 0 ? (twoSided ? -cosine : 0) : cosine;
        EXPECT_NEAR(b[3], a[3], 1e-12);
        for (std::size_t c = 0; c < 3; ++c)
        {
          const double expected = 0.1 * color[c] +
            0.7 * material.LightDiffuse[c] * cosine * color[c] + 0.2 * std::pow(cosine, 10);
          EXPECT_NEAR(b[c], a[3] * expected, 1e-11);
        }
      }
    }
  }
}

TEST(TruthShading, ZeroAndUndefinedGradientsLeaveTheAmbientPart)
{
  const auto volume = OneLevel([](auto, auto, auto) { return 1.0; }, { 6, 6, 6 });
  const TruthTransfer transfer = Uniform(0.4, { 1, 0.5, 0.25 });
  const TruthCamera camera = CameraAlongZ(2.2, 3.1, -1, 20);
  const TruthHeadlight headlight({}, {});
  TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  scene.Shading = &headlight;
  const TruthColor color = IntegratePixel(scene, 0, 0);
  const double alpha = 1 - std::pow(0.6, 5);
  EXPECT_NEAR(color[0], 0.1 * alpha, 1e-13);
  EXPECT_NEAR(color[2], 0.025 * alpha, 1e-13);
  EXPECT_NEAR(color[3], alpha, 1e-13);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(headlight.Normal(volume, 0, { 1, nan, 0 }), (Double3{ 0, 0, 0 }));
}

TEST(TruthShading, VoxelStepOfVTK)
{
  TruthHeadlight::Geometry geometry;
  geometry.ExactVoxelStep = false;
  const TruthHeadlight headlight({}, geometry);
  const auto volume =
    OneLevel([](auto i, auto, auto) { return static_cast<double>(i * i); }, { 11, 5, 1 });
  const Double3 step = headlight.GradientStep(volume, 0);
  EXPECT_DOUBLE_EQ(step[0], 1.1);
  EXPECT_DOUBLE_EQ(step[1], 1.25);
  EXPECT_DOUBLE_EQ(step[2], 1);
  // At a voxel centre: 6.1 -> 36 + 0.1 * 13, 3.9 -> 9 + 0.9 * 7.
  const Double3 difference = volume.CentralDifference(0, { 5.5, 2.5, 0.5 }, step);
  EXPECT_NEAR(difference[0], 37.3 - 15.3, 1e-12);
  EXPECT_EQ(difference[1], 0);
}

TEST(TruthShading, StepsOffTheGridAreIntegratedToTolerance)
{
  // The differences bend at planes of their own; with and without a closer look, the same picture.
  const auto volume =
    OneLevel([](auto i, auto j, auto k) { return 100 * Hash01(i, j, k); }, { 8, 8, 8 });
  const auto transfer = TruthTransfer::PiecewiseLinear(
    { { 20, 0 }, { 80, 0.4 } }, { { 0, { 1, 0.2, 0 } }, { 100, { 0, 0.4, 1 } } }, 1);
  TruthHeadlight::Geometry geometry;
  geometry.ExactVoxelStep = false;
  const TruthHeadlight headlight({}, geometry);
  const TruthCamera camera = CameraBetween({ 1, 2, -1 }, { 6, 5, 9 });
  TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  scene.Shading = &headlight;
  const TruthColor usual = IntegratePixel(scene, 0, 0);
  scene.Tolerance = 1e-13;
  const TruthColor fine = IntegratePixel(scene, 0, 0);
  for (std::size_t c = 0; c < 4; ++c)
  {
    EXPECT_NEAR(usual[c], fine[c], 1e-9);
  }
}

} // namespace
} // namespace teravox
