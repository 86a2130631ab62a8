// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TestSupport.h"

#include <gtest/gtest.h>

namespace teravox
{
namespace
{

Matrix4 View()
{
  return TruthCamera::LookAt({ 30, -20, 45 }, { 5, 6, 7 }, { 0.1, 1, 0.2 });
}

/// Clip coordinates of a world point, by the two matrices alone.
Double3 Project(const Matrix4& projection, const Double3& world)
{
  return TransformPoint(projection, TransformPoint(View(), world));
}

TEST(TruthCamera, RaysProjectToTheirPixel)
{
  const Matrix4 projections[] = { TruthCamera::Frustum(-1, 1, -0.75, 0.75, 2, 200),
    TruthCamera::Frustum(-0.3, 1.6, -1.1, 0.2, 2, 200), TruthCamera::Ortho(-8, 8, -6, 6, 2, 200),
    TruthCamera::Ortho(-3, 13, -6, 1, 2, 200) };
  for (const Matrix4& projection : projections)
  {
    const TruthCamera camera(View(), projection, 64, 48);
    for (const TruthPixel pixel : { TruthPixel{ 0, 0 }, { 63, 0 }, { 17, 40 } })
    {
      const TruthRay ray = camera.Ray(pixel.X, pixel.Y, 0.25, -0.125);
      for (const double place : { 0.0, 0.3, 1.0 })
      {
        const Double3 clip = Project(projection, ray.At(place * ray.Length));
        EXPECT_NEAR(clip[0], 2 * (pixel.X + 0.75) / 64 - 1, 1e-11);
        EXPECT_NEAR(clip[1], 2 * (pixel.Y + 0.375) / 48 - 1, 1e-11);
        const double depth = -TransformPoint(View(), ray.At(place * ray.Length))[2];
        EXPECT_NEAR(ray.DepthAt(place * ray.Length), depth, 1e-11 * depth);
        EXPECT_NEAR(ray.LengthAtDepth(depth), place * ray.Length, 1e-9);
      }
      EXPECT_NEAR(Project(projection, ray.Origin)[2], -1, 1e-12);
      EXPECT_NEAR(Project(projection, ray.At(ray.Length))[2], 1, 1e-9);
      EXPECT_NEAR(Length(ray.Direction), 1, 1e-15);
      EXPECT_NEAR(Length(ray.Eye - Double3{ 30, -20, 45 }), 0, 1e-12);
    }
    // A pixel's width: the distance between neighbouring rays where they have the same depth.
    const TruthRay left = camera.Ray(20, 20);
    const TruthRay right = camera.Ray(21, 20);
    for (const double depth : { 3.0, 50.0, 150.0 })
    {
      const Double3 gap = left.At(left.LengthAtDepth(depth)) - right.At(right.LengthAtDepth(depth));
      EXPECT_NEAR(camera.PixelWidth(depth), Length(gap), 1e-11);
    }
  }
}

/// Chord of a line through a box, by slabs.
double Chord(const Double3& origin, const Double3& direction, const Double3& lower,
  const Double3& upper, double from, double to)
{
  for (std::size_t axis = 0; axis < 3; ++axis)
  {
    const double a = (lower[axis] - origin[axis]) / direction[axis];
    const double b = (upper[axis] - origin[axis]) / direction[axis];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  return std::max(0.0, to - from);
}

TEST(TruthCamera, ConstantMediumThroughEveryKindOfCamera)
{
  const auto volume = OneLevel([](auto, auto, auto) { return 1.0; }, { 12, 14, 16 });
  const TruthTransfer transfer = Uniform(0.06, { 0.5, 1, 0.25 });
  // The last two have the near plane inside the volume: the camera is close, or inside.
  const Matrix4 close = TruthCamera::LookAt({ 8, 7, 9 }, { 5, 6, 7 }, { 0.1, 1, 0.2 });
  const struct
  {
    Matrix4 View;
    Matrix4 Projection;
  } cases[] = { { View(), TruthCamera::Frustum(-1, 1, -0.75, 0.75, 4, 200) },
    { View(), TruthCamera::Frustum(-0.3, 1.6, -1.1, 0.2, 4, 200) },
    { View(), TruthCamera::Ortho(-8, 8, -6, 6, 4, 200) },
    { View(), TruthCamera::Ortho(-3, 13, -6, 1, 4, 51) },
    { View(), TruthCamera::Frustum(-8, 8, -6, 6, 52, 200) },
    { close, TruthCamera::Frustum(-0.1, 0.1, -0.075, 0.075, 0.1, 200) } };
  for (const auto& kind : cases)
  {
    const TruthCamera camera(kind.View, kind.Projection, 64, 48);
    const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
    int hits = 0;
    for (const TruthPixel& pixel : AllPixels(camera))
    {
      const TruthRay ray = camera.Ray(pixel.X, pixel.Y);
      const double length =
        Chord(ray.Origin, ray.Direction, { 0.5, 0.5, 0.5 }, { 11.5, 13.5, 15.5 }, 0, ray.Length);
      hits += length > 0 ? 1 : 0;
      const TruthColor color = IntegratePixel(scene, pixel.X, pixel.Y);
      const double alpha = 1 - std::pow(0.94, length);
      EXPECT_NEAR(color[3], alpha, 1e-10);
      EXPECT_NEAR(color[0], 0.5 * alpha, 1e-10);
    }
    EXPECT_GT(hits, 100);
  }
}

TruthVolume Pyramid(const std::vector<Int3>& factors, const Double3& spacing)
{
  std::vector<TruthLevel> levels;
  const Int3 dimensions{ 64, 64, 64 };
  for (std::size_t l = 0; l < factors.size(); ++l)
  {
    Int3 size{};
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      size[axis] = CeilDiv(dimensions[axis], factors[l][axis]);
    }
    levels.push_back(TruthLevel::FromFunction(
      [l](auto, auto, auto) { return static_cast<double>(l); }, size, factors[l]));
  }
  return TruthVolume(std::move(levels), TruthVolume::WorldFromVoxel({ 0.5, 0.5, 0.5 }, spacing),
    TruthInterpolation::Linear, true);
}

TEST(TruthLevelOfDetail, PerspectiveBoundariesInClosedForm)
{
  const TruthVolume volume = Pyramid({ { 1, 1, 1 }, { 2, 2, 2 }, { 4, 4, 4 } }, { 1, 1, 1 });
  // 100 pixels across 90 degrees: a pixel is z / 50 wide.
  const TruthCamera camera(IdentityMatrix(), TruthCamera::Frustum(-1, 1, -1, 1, 1, 1000), 100, 100);
  const TruthLevelOfDetail lambda(volume, camera);
  ASSERT_EQ(lambda.BoundaryDepths().size(), 2u);
  EXPECT_NEAR(lambda.BoundaryDepths()[0], 100, 1e-12);
  EXPECT_NEAR(lambda.BoundaryDepths()[1], 200, 1e-12);
  EXPECT_EQ(lambda.LevelAtDepth(1), 0);
  EXPECT_EQ(lambda.LevelAtDepth(99.99), 0);
  EXPECT_EQ(lambda.LevelAtDepth(100.01), 1);
  EXPECT_EQ(lambda.LevelAtDepth(199.99), 1);
  EXPECT_EQ(lambda.LevelAtDepth(1e9), 2);
  const TruthLevelOfDetail biased(volume, camera, 1);
  EXPECT_NEAR(biased.BoundaryDepths()[0], 50, 1e-12);
  const TruthLevelOfDetail limited(volume, camera, 0, 1, 1);
  EXPECT_TRUE(limited.BoundaryDepths().empty());
  EXPECT_EQ(limited.LevelAtDepth(1), 1);
  EXPECT_EQ(limited.LevelAtDepth(1e9), 1);
}

TEST(TruthLevelOfDetail, OnlyAveragedAxesCount)
{
  // z is five times as long, and averaged only by level 3.
  const TruthVolume volume =
    Pyramid({ { 1, 1, 1 }, { 2, 2, 1 }, { 4, 4, 1 }, { 8, 8, 2 } }, { 1, 1, 5 });
  const TruthCamera camera(IdentityMatrix(), TruthCamera::Frustum(-1, 1, -1, 1, 1, 1000), 100, 100);
  const TruthLevelOfDetail lambda(volume, camera);
  ASSERT_EQ(lambda.BoundaryDepths().size(), 3u);
  EXPECT_NEAR(lambda.BoundaryDepths()[0], 100, 1e-12);
  EXPECT_NEAR(lambda.BoundaryDepths()[1], 200, 1e-12);
  EXPECT_NEAR(lambda.BoundaryDepths()[2], 500, 1e-12);
}

TEST(TruthLevelOfDetail, ParallelHasOneLevel)
{
  const TruthVolume volume = Pyramid({ { 1, 1, 1 }, { 2, 2, 2 }, { 4, 4, 4 } }, { 1, 1, 1 });
  const int expected[] = { 0, 0, 1, 1, 2, 2 };
  const double widths[] = { 0.5, 1.9, 2.0, 3.9, 4.0, 400 };
  for (std::size_t i = 0; i < 6; ++i)
  {
    const double half = widths[i] * 10 / 2;
    const TruthCamera camera(
      IdentityMatrix(), TruthCamera::Ortho(-half, half, -half, half, 1, 1000), 10, 10);
    const TruthLevelOfDetail lambda(volume, camera);
    EXPECT_TRUE(lambda.BoundaryDepths().empty());
    EXPECT_EQ(lambda.LevelAtDepth(1), expected[i]);
    EXPECT_EQ(lambda.LevelAtDepth(900), expected[i]);
  }
}

TEST(TruthLevelOfDetail, RayIsCutWhereTheLevelChanges)
{
  // Level l holds the value l everywhere; each value has its own colour and extinction. The rays
  // meet the boundary planes at z = 100 and 200 at a slant.
  std::vector<TruthLevel> levels;
  for (std::int64_t l = 0; l < 3; ++l)
  {
    const std::int64_t f = std::int64_t{ 1 } << l;
    levels.push_back(
      TruthLevel::FromFunction([l](auto, auto, auto) { return static_cast<double>(l); },
        { 400 / f, 400 / f, 300 / f }, { f, f, f }));
  }
  const TruthVolume volume(std::move(levels),
    TruthVolume::WorldFromVoxel({ -200, -200, -299 }, { 1, 1, 1 }), TruthInterpolation::Linear,
    true);
  const auto transfer = TruthTransfer::PiecewiseLinear({ { 0, 0.01 }, { 1, 0.03 }, { 2, 0.02 } },
    { { 0, { 1, 0, 0 } }, { 1, { 0, 1, 0 } }, { 2, { 0, 0, 1 } } }, 1);
  const TruthCamera camera(IdentityMatrix(), TruthCamera::Frustum(-1, 1, -1, 1, 1, 1000), 100, 100);
  const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(volume, camera) };
  for (const TruthPixel pixel : { TruthPixel{ 50, 50 }, { 70, 31 } })
  {
    const TruthRay ray = camera.Ray(pixel.X, pixel.Y);
    const double slant = 1 / ray.DepthPerLength;
    const double red = 1 - std::pow(0.99, 99 * slant); // from the near plane on
    const double green = (1 - red) * (1 - std::pow(0.97, 100 * slant));
    const double end = Chord(ray.Origin, ray.Direction, { -200.5, -200.5, -299.5 },
                         { 199.5, 199.5, 0.5 }, 0, ray.Length) +
      1 * slant;
    const double blue = (1 - red - green) * (1 - std::pow(0.98, end - 200 * slant));
    const TruthColor color = IntegratePixel(scene, pixel.X, pixel.Y);
    const std::vector<TruthLevelSpan> spans = LevelSpans(scene, pixel.X, pixel.Y);
    ASSERT_EQ(spans.size(), 3u);
    const double depths[] = { 1, 100, 200, end / slant };
    for (int level = 0; level < 3; ++level)
    {
      EXPECT_EQ(spans[static_cast<std::size_t>(level)].Level, level);
      EXPECT_NEAR(spans[static_cast<std::size_t>(level)].DepthBegin, depths[level], 1e-10);
      EXPECT_NEAR(spans[static_cast<std::size_t>(level)].DepthEnd, depths[level + 1], 1e-10);
    }
    EXPECT_NEAR(color[0], red, 1e-12);
    EXPECT_NEAR(color[1], green, 1e-12);
    EXPECT_NEAR(color[2], blue, 1e-12);
  }
}

TEST(TruthLevelOfDetail, CoarseLevelsLieInPlace)
{
  // Box averages of x + 2 y + 3 z are the same function at the coarse centres, x0 = f x_l +
  // (f-1)/2.
  std::vector<TruthLevel> levels;
  const Int3 factors[] = { { 1, 1, 1 }, { 2, 2, 1 }, { 4, 4, 2 } };
  for (const Int3& f : factors)
  {
    levels.push_back(TruthLevel::FromFunction(
      [f](auto i, auto j, auto k)
      {
        const auto center = [](std::int64_t index, std::int64_t factor)
        { return static_cast<double>(factor * index) + 0.5 * static_cast<double>(factor - 1); };
        return center(i, f[0]) + 2 * center(j, f[1]) + 3 * center(k, f[2]);
      },
      { 32 / f[0], 32 / f[1], 16 / f[2] }, f));
  }
  const TruthVolume volume(std::move(levels), IdentityMatrix(), TruthInterpolation::Linear, false);
  for (int level = 0; level < 3; ++level)
  {
    EXPECT_NEAR(volume.Field(level, { 9.3, 20.1, 7.7 }), 8.8 + 2 * 19.6 + 3 * 7.2, 1e-12);
    const Double3 difference = volume.CentralDifference(level, { 9.3, 20.1, 7.7 }, { 1, 1, 1 });
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      const auto a = static_cast<double>(axis + 1);
      EXPECT_NEAR(
        difference[axis], 2 * a * static_cast<double>(volume.Level(level).Factor[axis]), 1e-12);
    }
  }
}

} // namespace
} // namespace teravox
