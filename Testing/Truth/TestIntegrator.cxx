// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TestSupport.h"

#include <algorithm>
#include <gtest/gtest.h>
#include <limits>
#include <random>

namespace teravox
{
namespace
{

double RandomVoxel(std::int64_t i, std::int64_t j, std::int64_t k)
{
  return 100 * Hash01(i, j, k);
}

TruthTransfer Lively()
{
  return TruthTransfer::PiecewiseLinear(
    { { 20, 0 }, { 30, 0.3 }, { 45, 0.02 }, { 55, 0.02 }, { 55, 0.5 }, { 60, 0.1 }, { 90, 0 } },
    { { 10, { 1, 0, 0 } }, { 50, { 0.2, 1, 0.1 } }, { 70, { 0.2, 1, 0.8 } }, { 70, { 0, 0, 1 } } },
    0.8);
}

/// A second opinion that shares nothing but the field: midpoint steps, without any cut.
TruthColor Riemann(const TruthScene& scene, int x, int y, int steps)
{
  const TruthRay ray = scene.Camera.Ray(x, y);
  const double step = ray.Length / steps;
  TruthColor color{};
  double transmittance = 1;
  for (int i = 0; i < steps; ++i)
  {
    const Double3 p = TransformPoint(scene.Volume.VoxelFromWorld(), ray.At((i + 0.5) * step));
    bool inside = true;
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      inside = inside && p[axis] >= scene.Volume.BoundsMin()[axis] &&
        p[axis] <= scene.Volume.BoundsMax()[axis];
    }
    if (inside)
    {
      const double v = scene.Volume.Field(0, p);
      const double alpha =
        1 - std::pow(1 - scene.Transfer.GetAlpha(v), step / scene.Transfer.UnitDistance());
      const Double3 c = scene.Transfer.GetColor(v);
      for (std::size_t channel = 0; channel < 3; ++channel)
      {
        color[channel] += transmittance * alpha * c[channel];
      }
      transmittance *= 1 - alpha;
    }
  }
  color[3] = 1 - transmittance;
  return color;
}

TEST(TruthIntegrator, AgreesWithManySmallSteps)
{
  Matrix4 matrix = TruthVolume::WorldFromVoxel({ -4, -3, -2 }, { 1, 0.8, 1.3 },
    { std::cos(0.4), -std::sin(0.4), 0, std::sin(0.4), std::cos(0.4), 0, 0, 0, 1 });
  const TruthTransfer transfer = Lively();
  const TruthCamera camera(TruthCamera::LookAt({ 9, 7, 11 }, { 0, 0, 1 }, { 0, 1, 0 }),
    TruthCamera::Frustum(-0.4, 0.4, -0.4, 0.4, 1, 30), 16, 16);
  for (const auto interpolation : { TruthInterpolation::Linear, TruthInterpolation::Nearest })
  {
    const auto volume = OneLevel(RandomVoxel, { 9, 8, 7 }, interpolation, true, matrix);
    const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
    double most = 0;
    for (int pixel = 3; pixel < 13; pixel += 3)
    {
      const TruthColor truth = IntegratePixel(scene, pixel, 15 - pixel);
      const TruthColor steps = Riemann(scene, pixel, 15 - pixel, 400000);
      for (std::size_t c = 0; c < 4; ++c)
      {
        EXPECT_NEAR(truth[c], steps[c], 3e-5) << "pixel " << pixel << ", channel " << c;
      }
      most = std::max(most, truth[3]);
    }
    EXPECT_GT(most, 0.3); // something was seen
  }
}

TEST(TruthIntegrator, ToleranceIsKept)
{
  const TruthTransfer transfer = Lively();
  const auto volume = OneLevel(RandomVoxel, { 40, 40, 40 });
  const TruthCamera camera(TruthCamera::LookAt({ 60, 50, 70 }, { 20, 20, 20 }, { 0, 1, 0 }),
    TruthCamera::Frustum(-0.4, 0.4, -0.4, 0.4, 1, 200), 8, 8);
  TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  const std::vector<TruthColor> usual = RenderTruth(scene, AllPixels(camera));
  scene.Tolerance = 1e-13;
  const std::vector<TruthColor> fine = RenderTruth(scene, AllPixels(camera));
  for (std::size_t i = 0; i < usual.size(); ++i)
  {
    for (std::size_t c = 0; c < 4; ++c)
    {
      EXPECT_NEAR(usual[i][c], fine[i][c], 1e-9);
    }
  }
}

TEST(TruthIntegrator, NearestIsTheExactSumOverVoxels)
{
  const TruthTransfer transfer = Lively();
  const auto volume = OneLevel(RandomVoxel, { 10, 9, 8 }, TruthInterpolation::Nearest, true);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int trial = 0; trial < 50; ++trial)
  {
    const Double3 from{ -1 - uniform(random), 9 * uniform(random), 8 * uniform(random) };
    const Double3 to{ 11 + uniform(random), 9 * uniform(random), 8 * uniform(random) };
    // Every face of every voxel, sorted; no traversal.
    std::vector<double> cuts;
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      for (int plane = 0; plane <= 10; ++plane)
      {
        const double cut = (plane - from[axis]) / (to[axis] - from[axis]);
        if (cut > 0 && cut < 1)
        {
          cuts.push_back(cut);
        }
      }
    }
    std::sort(cuts.begin(), cuts.end());
    double transmittance = 1;
    Double3 expected{};
    for (std::size_t i = 0; i + 1 < cuts.size(); ++i)
    {
      const Double3 p = from + 0.5 * (cuts[i] + cuts[i + 1]) * (to - from);
      if (p[0] < 0 || p[1] < 0 || p[2] < 0 || p[0] > 10 || p[1] > 9 || p[2] > 8)
      {
        continue;
      }
      const double v = RandomVoxel(static_cast<std::int64_t>(p[0]), static_cast<std::int64_t>(p[1]),
        static_cast<std::int64_t>(p[2]));
      const double length = (cuts[i + 1] - cuts[i]) * Length(to - from);
      const double alpha = 1 - std::pow(1 - transfer.GetAlpha(v), length / 0.8);
      expected = expected + transmittance * alpha * transfer.GetColor(v);
      transmittance *= 1 - alpha;
    }
    const TruthCamera camera = CameraBetween(from, to);
    const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
    const TruthColor truth = IntegratePixel(scene, 0, 0);
    for (std::size_t c = 0; c < 3; ++c)
    {
      EXPECT_NEAR(truth[c], expected[c], 1e-11);
    }
    EXPECT_NEAR(truth[3], 1 - transmittance, 1e-11);
  }
}

TEST(TruthIntegrator, DenseArraysOfEveryTypeEqualTheFunction)
{
  for (const ScalarType type : AllScalarTypes)
  {
    DispatchScalarType(type,
      [type](auto zero)
      {
        using T = decltype(zero);
        const Int3 dimensions{ 7, 6, 5 };
        std::vector<T> voxels;
        for (std::int64_t i = 0; i < dimensions[0] * dimensions[1] * dimensions[2]; ++i)
        {
          voxels.push_back(static_cast<T>(100 * Hash01(i, 0, 0)));
        }
        const auto byFunction = OneLevel(
          [&](auto i, auto j, auto k)
          {
            return static_cast<double>(
              voxels[static_cast<std::size_t>(i + dimensions[0] * (j + dimensions[1] * k))]);
          },
          dimensions);
        const TruthVolume byArray({ TruthLevel::FromArray(type, voxels.data(), dimensions) },
          IdentityMatrix(), TruthInterpolation::Linear, false);
        const TruthTransfer transfer = Lively();
        const TruthCamera camera = CameraBetween({ 1, 1, -1 }, { 5, 4, 8 });
        const TruthScene a{ byFunction, transfer, camera, TruthLevelOfDetail(0) };
        const TruthScene b{ byArray, transfer, camera, TruthLevelOfDetail(0) };
        EXPECT_EQ(IntegratePixel(a, 0, 0), IntegratePixel(b, 0, 0));
        EXPECT_GT(IntegratePixel(a, 0, 0)[3], 0.1);
      });
  }
}

TEST(TruthIntegrator, NaNAddsNothing)
{
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto field = [=](auto i, auto, auto k) { return k == 5 && i >= 4 ? nan : 1.0; };
  const TruthTransfer transfer = Uniform(0.3, { 1, 1, 1 });
  const struct
  {
    TruthInterpolation Interpolation;
    double X;
    double Gap; // in voxels, of 10
  } cases[] = { { TruthInterpolation::Linear, 5.2, 2 }, { TruthInterpolation::Linear, 4.2, 2 },
    { TruthInterpolation::Linear, 2.2, 0 },
    { TruthInterpolation::Linear, 3.5,
      0 }, // exactly on the last good centres: weight 0 for the NaN
    { TruthInterpolation::Nearest, 5.2, 1 }, { TruthInterpolation::Nearest, 3.9, 0 } };
  for (const auto& it : cases)
  {
    const auto volume = OneLevel(field, { 9, 9, 11 }, it.Interpolation);
    const TruthCamera camera = CameraAlongZ(it.X, 4, -1, 20);
    const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
    EXPECT_NEAR(IntegratePixel(scene, 0, 0)[3], 1 - std::pow(0.7, 10 - it.Gap), 1e-12) << it.X;
  }
}

TEST(TruthIntegrator, ValuesThatLieExactlyOnAJump)
{
  // A constant field at the value of a jump has the opacity of the function there, not of a side.
  const auto transfer = TruthTransfer::PiecewiseLinear(
    { { 10, 0 }, { 10, 0.5 }, { 20, 0.5 }, { 20, 0 } }, { { 0, { 1, 1, 1 } } }, 1);
  for (const double value : { 10.0, 15.0, 20.0 })
  {
    const auto volume = OneLevel([=](auto, auto, auto) { return value; }, { 4, 4, 4 });
    const TruthCamera camera = CameraAlongZ(2.1, 2.2, -1, 20);
    const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
    const double expected = 1 - std::pow(1 - transfer.GetAlpha(value), 3);
    EXPECT_NEAR(IntegratePixel(scene, 0, 0)[3], expected, 1e-14) << value;
  }
}

TEST(TruthIntegrator, EnvelopeContainsTheTruth)
{
  const TruthTransfer transfer = Lively();
  const auto volume = OneLevel(RandomVoxel, { 10, 10, 10 });
  const TruthCamera camera(TruthCamera::LookAt({ 16, 15, 17 }, { 5, 5, 5 }, { 0, 1, 0 }),
    TruthCamera::Frustum(-0.5, 0.5, -0.5, 0.5, 1, 50), 12, 12);
  const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  const std::vector<TruthPixel> pixels = PixelBox(camera, 3, 4, 7, 5);
  ASSERT_EQ(pixels.size(), 35u);
  const TruthEnvelope envelope = RenderEnvelope(scene, pixels);
  const std::vector<TruthColor> truth = RenderTruth(scene, pixels);
  bool wide = false;
  for (std::size_t i = 0; i < pixels.size(); ++i)
  {
    EXPECT_EQ(envelope.Center[i], truth[i]);
    const TruthColor corner = IntegratePixel(scene, pixels[i].X, pixels[i].Y, -1 / 32.0, 1 / 32.0);
    for (std::size_t c = 0; c < 4; ++c)
    {
      EXPECT_LE(envelope.Min[i][c], std::min(truth[i][c], corner[c]));
      EXPECT_GE(envelope.Max[i][c], std::max(truth[i][c], corner[c]));
      wide = wide || envelope.Max[i][c] > envelope.Min[i][c] + 1e-4;
    }
  }
  EXPECT_TRUE(wide);
}

} // namespace
} // namespace teravox
