// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "TestSupport.h"

#include <gtest/gtest.h>

namespace teravox
{
namespace
{

constexpr double Tight = 1e-10; // the integrator promises 1e-9

void ExpectColor(const TruthColor& actual, const Double3& color, double alpha, double tolerance)
{
  for (std::size_t c = 0; c < 3; ++c)
  {
    EXPECT_NEAR(actual[c], color[c], tolerance) << "channel " << c;
  }
  EXPECT_NEAR(actual[3], alpha, tolerance);
}

TEST(TruthClosedForm, ConstantMedium)
{
  const auto volume = OneLevel([](auto, auto, auto) { return 5.0; }, { 11, 12, 21 });
  const Double3 color{ 0.25, 0.5, 1 };
  const TruthTransfer transfer = Uniform(0.125, color, 2.5);
  const TruthCamera camera = CameraAlongZ(3.7, 4.1, -10, 100);
  const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  const double alpha = 1 - std::pow(1 - 0.125, 20 / 2.5);
  ExpectColor(IntegratePixel(scene, 0, 0), alpha * color, alpha, 1e-14);
}

TEST(TruthClosedForm, DenseMediumKeepsItsColor)
{
  // tau is 1400 in each cell: all light comes from a thin skin.
  const auto volume = OneLevel(
    [](auto i, auto j, auto k) { return static_cast<double>(i + 2 * j + 3 * k); }, { 9, 9, 9 });
  const Double3 color{ 0.25, 0.5, 1 };
  const TruthTransfer transfer = Uniform(1 - 1e-6, color, 0.01);
  const TruthCamera camera = CameraAlongZ(3.7, 4.1, -10, 100);
  const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  ExpectColor(IntegratePixel(scene, 0, 0), color, 1, 1e-9);
}

TEST(TruthClosedForm, RampWithLinearOpacity)
{
  // alpha grows linearly from 0 to 0.8 over 10 voxels: tau = L / (a1 - a0) [(1-a) ln(1-a) - (1-a)].
  const auto volume =
    OneLevel([](auto, auto, auto k) { return static_cast<double>(k); }, { 5, 5, 11 });
  const Double3 color{ 1, 0.5, 0.25 };
  const auto transfer =
    TruthTransfer::PiecewiseLinear({ { 0, 0 }, { 10, 0.8 } }, { { 0, color } }, 3);
  const TruthCamera camera = CameraAlongZ(2.2, 2.9, -1, 50);
  const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  const double tau = 10 / 0.8 * (0.2 * std::log(0.2) - 0.2 + 1) / 3;
  const double alpha = -std::expm1(-tau);
  ExpectColor(IntegratePixel(scene, 0, 0), alpha * color, alpha, Tight);
}

TEST(TruthClosedForm, RampReachesOpacityOneAtOnePoint)
{
  // The logarithmic singularity at alpha = 1 is integrable: tau = L / unit, and no wall stands
  // there.
  const auto volume =
    OneLevel([](auto, auto, auto k) { return static_cast<double>(k); }, { 5, 5, 11 });
  const auto transfer =
    TruthTransfer::PiecewiseLinear({ { 0, 0 }, { 10, 1 } }, { { 0, { 1, 1, 1 } } }, 8);
  const TruthCamera camera = CameraAlongZ(2.2, 2.9, -1, 50);
  const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  const double alpha = -std::expm1(-10.0 / 8);
  ExpectColor(IntegratePixel(scene, 0, 0), { alpha, alpha, alpha }, alpha, 1e-9);
}

TEST(TruthClosedForm, ColorRampInAUniformMedium)
{
  // integral of (z/L) s exp(-s z) from 0 to L
  const auto volume =
    OneLevel([](auto, auto, auto k) { return static_cast<double>(k); }, { 5, 5, 11 });
  const TruthTransfer transfer([](double) { return 0.2; },
    [](double v) {
      return Double3{ v / 10, 1 - v / 10, 0.5 };
    },
    {}, 1);
  const TruthCamera camera = CameraAlongZ(2.2, 2.9, -1, 50);
  const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  const double s = -std::log(0.8);
  const double end = std::exp(-s * 10);
  const double ramp = ((1 - end) / s - 10 * end) / 10;
  ExpectColor(
    IntegratePixel(scene, 0, 0), { ramp, 1 - end - ramp, 0.5 * (1 - end) }, 1 - end, Tight);
}

TEST(TruthClosedForm, ColorRampWithGrowingExtinction)
{
  // sigma = k z and colour = z: integral of k z^2 exp(-k z^2 / 2), by parts, an error function.
  const auto volume =
    OneLevel([](auto, auto, auto k) { return static_cast<double>(k); }, { 4, 4, 9 });
  const double k = 0.05;
  const TruthTransfer transfer([=](double v) { return -std::expm1(-k * v); },
    [](double v) {
      return Double3{ v, v, v };
    },
    { 0 }, 1);
  const TruthCamera camera = CameraAlongZ(1.2, 1.9, -1, 50);
  const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  const double end = std::exp(-k * 64 / 2);
  const double light =
    std::sqrt(std::acos(-1.0) / (2 * k)) * std::erf(8 * std::sqrt(k / 2)) - 8 * end;
  ExpectColor(IntegratePixel(scene, 0, 0), { light, light, light }, 1 - end, 1e-9);
}

TEST(TruthClosedForm, BoxTransferFunctionMakesASlab)
{
  // Opaque-ish only for 3.25 <= v <= 6.5, on a slanted ray.
  const auto volume =
    OneLevel([](auto, auto, auto k) { return static_cast<double>(k); }, { 16, 16, 16 });
  const Double3 color{ 0.5, 0.75, 1 };
  const auto transfer = TruthTransfer::PiecewiseLinear(
    { { 3.25, 0 }, { 3.25, 0.3 }, { 6.5, 0.3 }, { 6.5, 0 } }, { { 0, color } }, 1);
  const Double3 from{ 2, 3, -2 };
  const Double3 to{ 12, 9, 20 };
  const TruthCamera camera = CameraBetween(from, to);
  const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  const double length = (6.5 - 3.25) * Length(to - from) / 22;
  const double alpha = 1 - std::pow(0.7, length);
  ExpectColor(IntegratePixel(scene, 0, 0), alpha * color, alpha, 1e-12);
}

TEST(TruthClosedForm, SlabsOfDifferentColorInOrder)
{
  const auto volume =
    OneLevel([](auto, auto, auto k) { return static_cast<double>(k); }, { 4, 4, 13 });
  const auto transfer = TruthTransfer::PiecewiseLinear(
    { { 2, 0 }, { 2, 0.4 }, { 5, 0.4 }, { 5, 0 }, { 8, 0 }, { 8, 0.7 }, { 9, 0.7 }, { 9, 0 } },
    { { 6, { 1, 0, 0 } }, { 6, { 0, 1, 0 } } }, 1);
  const double red = 1 - std::pow(0.6, 3);
  const TruthCamera camera = CameraAlongZ(1.2, 1.9, -1, 50);
  const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  const double green = (1 - red) * 0.7;
  ExpectColor(IntegratePixel(scene, 0, 0), { red, green, 0 }, red + green, 1e-12);
  // From behind the order is the other one.
  const TruthCamera back = CameraBetween({ 1.2, 1.9, 30 }, { 1.2, 1.9, -5 });
  const TruthScene mirrored{ volume, transfer, back, TruthLevelOfDetail(0) };
  ExpectColor(IntegratePixel(mirrored, 0, 0), { 0.3 * red, 0.7, 0 }, red + green, 1e-12);
}

TEST(TruthClosedForm, GaussianInDepth)
{
  // sigma(v) = exp(-v^2 / 2 w^2) over a linear field: tau is an error function.
  const auto volume =
    OneLevel([](auto, auto, auto k) { return static_cast<double>(k) - 20; }, { 4, 4, 41 });
  const double w = 2.5;
  const Double3 color{ 0.2, 0.4, 0.8 };
  const auto transfer =
    FromExtinction([=](double v) { return 0.3 * std::exp(-v * v / (2 * w * w)); }, color);
  const TruthCamera camera = CameraAlongZ(1.2, 1.9, -1, 50);
  const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  const double tau = 0.3 * w * std::sqrt(2 * std::acos(-1.0)) * std::erf(20 / (w * std::sqrt(2.0)));
  const double alpha = -std::expm1(-tau);
  ExpectColor(IntegratePixel(scene, 0, 0), alpha * color, alpha, Tight);
}

TEST(TruthClosedForm, GaussianBlobConvergesToErrorFunction)
{
  // A sampled Gaussian, at impact parameter b; the interpolation error goes like the voxel squared,
  // so the extrapolation from two grids meets the closed form.
  const double b = 0.75; // at the same place of a cell in both grids
  const double expected = -std::expm1(
    -0.4 * std::exp(-b * b / 2) * std::sqrt(2 * std::acos(-1.0)) * std::erf(6 / std::sqrt(2.0)));
  std::array<double, 2> alpha{};
  for (std::size_t grid = 0; grid < 2; ++grid)
  {
    const std::int64_t n = grid == 0 ? 192 : 384;
    const double h = 12.0 / static_cast<double>(n);
    const auto coordinate = [=](std::int64_t i) { return -6 + h * (static_cast<double>(i) + 0.5); };
    const auto volume = OneLevel(
      [=](auto i, auto j, auto k)
      {
        const Double3 p{ coordinate(i), coordinate(j), coordinate(k) };
        return std::exp(-Dot(p, p) / 2);
      },
      { n, n, n }, TruthInterpolation::Linear, true,
      TruthVolume::WorldFromVoxel({ -6 + h / 2, -6 + h / 2, -6 + h / 2 }, { h, h, h }));
    const auto transfer = FromExtinction([](double v) { return 0.4 * v; }, { 1, 1, 1 });
    const TruthCamera camera = CameraAlongZ(b, 0, -20, 20);
    const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
    alpha[grid] = IntegratePixel(scene, 0, 0)[3];
  }
  EXPECT_NEAR(alpha[1], expected, 1e-4);
  EXPECT_LT(std::fabs(alpha[1] - expected), 0.3 * std::fabs(alpha[0] - expected));
  EXPECT_NEAR((4 * alpha[1] - alpha[0]) / 3, expected, 1e-8);
}

TEST(TruthClosedForm, CubicFieldBetweenKnots)
{
  // F = x y z is trilinear; along the diagonal it is s^3 in each coordinate.
  const auto volume =
    OneLevel([](auto i, auto j, auto k) { return static_cast<double>(i * j * k); }, { 9, 9, 9 });
  const auto transfer = TruthTransfer::PiecewiseLinear(
    { { 20, 0 }, { 20, 0.25 }, { 300, 0.25 }, { 300, 0 } }, { { 0, { 1, 1, 1 } } }, 1);
  const TruthCamera camera = CameraBetween({ -1, -1, -1 }, { 10, 10, 10 });
  const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  const double length = std::sqrt(3.0) * (std::cbrt(300.0) - std::cbrt(20.0));
  const double alpha = 1 - std::pow(0.75, length);
  ExpectColor(IntegratePixel(scene, 0, 0), { alpha, alpha, alpha }, alpha, 1e-12);
}

TEST(TruthClosedForm, ParabolaThatTouchesAKnot)
{
  // F = x y along (1, -1, 0) is 16 - s^2, with its top exactly at, below and above a jump.
  const auto volume =
    OneLevel([](auto i, auto j, auto) { return static_cast<double>(i * j); }, { 9, 9, 3 });
  const TruthCamera camera = CameraBetween({ -0.5, 9.5, 1.5 }, { 9.5, -0.5, 1.5 });
  for (const double knot : { 15.0, 15.9999, 16 - 1e-8, 16.0, 16.5 })
  {
    const auto transfer =
      TruthTransfer::PiecewiseLinear({ { knot, 0 }, { knot, 0.5 } }, { { 0, { 1, 1, 1 } } }, 1);
    const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
    const double length = knot < 16 ? 2 * std::sqrt(2.0) * std::sqrt(16 - knot) : 0;
    EXPECT_NEAR(IntegratePixel(scene, 0, 0)[3], 1 - std::pow(0.5, length), 1e-9) << knot;
  }
}

TEST(TruthClosedForm, OpaqueWall)
{
  // Medium in front, then alpha = 1 from v = 7.5 on; behind it nothing counts.
  const auto volume =
    OneLevel([](auto, auto, auto k) { return static_cast<double>(k); }, { 4, 4, 13 });
  const TruthTransfer transfer = TruthTransfer::PiecewiseLinear(
    { { 2, 0 }, { 2, 0.4 }, { 5, 0.4 }, { 5, 0 }, { 7.5, 0 }, { 7.5, 1 } },
    { { 6, { 1, 0, 0 } }, { 6, { 0, 0.75, 0 } }, { 8, { 0, 0.25, 1 } } }, 1);
  const double red = 1 - std::pow(0.6, 3);
  const TruthCamera camera = CameraAlongZ(1.2, 1.9, -1, 50);
  const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  const double through = 1 - red;
  ExpectColor(IntegratePixel(scene, 0, 0),
    { red, through * (0.25 * 0.75 + 0.75 * 0.25), through * 0.75 }, 1, Tight);
}

TEST(TruthClosedForm, NothingOutsideTheBox)
{
  const auto volume = OneLevel([](auto, auto, auto) { return 1.0; }, { 4, 4, 4 });
  const TruthTransfer transfer = Uniform(0.5, { 1, 1, 1 });
  for (const double x : { -1.0, 0.49, 3.51, 7.0 })
  {
    const TruthCamera camera = CameraAlongZ(x, 2, -5, 10);
    const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
    EXPECT_EQ(IntegratePixel(scene, 0, 0), (TruthColor{ 0, 0, 0, 0 })) << x;
  }
}

TEST(TruthClosedForm, PointAndCellDataHaveDifferentBounds)
{
  const TruthTransfer transfer = Uniform(0.25, { 1, 1, 1 });
  const TruthCamera camera = CameraAlongZ(2, 2, -5, 20);
  for (const bool cellData : { false, true })
  {
    for (const auto interpolation : { TruthInterpolation::Linear, TruthInterpolation::Nearest })
    {
      const auto volume =
        OneLevel([](auto, auto, auto) { return 1.0; }, { 4, 4, 7 }, interpolation, cellData);
      const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
      const double alpha = 1 - std::pow(0.75, cellData ? 7 : 6);
      EXPECT_NEAR(IntegratePixel(scene, 0, 0)[3], alpha, 1e-13);
    }
  }
}

TEST(TruthClosedForm, AnisotropicRotatedMatrix)
{
  // Field = index along x; the ray runs along the turned x axis, so it sees the ramp over 9 * 0.5
  // units.
  const double c = std::cos(0.6);
  const double s = std::sin(0.6);
  const Matrix3 direction{ c, -s, 0, s, c, 0, 0, 0, 1 };
  Matrix4 prop = IdentityMatrix();
  prop[3] = 100; // shifted, and turned by 90 degrees about z
  prop[0] = 0;
  prop[1] = -1;
  prop[4] = 1;
  prop[5] = 0;
  const Double3 origin{ 3, -2, 7 };
  const Double3 spacing{ 0.5, 1, 5 };
  const auto volume = OneLevel([](auto i, auto, auto) { return static_cast<double>(i); },
    { 10, 6, 4 }, TruthInterpolation::Linear, false,
    TruthVolume::WorldFromVoxel(origin, spacing, direction, prop));
  const auto dataset = [&](const Double3& index)
  {
    return origin +
      TransformVector(
        direction, { index[0] * spacing[0], index[1] * spacing[1], index[2] * spacing[2] });
  };
  const TruthCamera camera = CameraBetween(TransformPoint(prop, dataset({ -5, 2.3, 1.6 })),
    TransformPoint(prop, dataset({ 20, 2.3, 1.6 })));
  const auto transfer =
    TruthTransfer::PiecewiseLinear({ { 0, 0 }, { 9, 0.8 } }, { { 0, { 1, 1, 1 } } }, 1);
  const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  const double tau = 9 * 0.5 / 0.8 * (0.2 * std::log(0.2) - 0.2 + 1);
  EXPECT_NEAR(IntegratePixel(scene, 0, 0)[3], -std::expm1(-tau), Tight);
}

TEST(TruthClosedForm, UnitDistanceInTheSpaceOfTheDataSet)
{
  // A prop twice as large along z: 5 voxels are 10 world units, and 5 units of the data set.
  Matrix4 prop = IdentityMatrix();
  prop[10] = 2;
  const auto volume = OneLevel([](auto, auto, auto k) { return static_cast<double>(k); },
    { 4, 4, 6 }, TruthInterpolation::Linear, false,
    TruthVolume::WorldFromVoxel(
      { 0.5, 0.5, 0.5 }, { 1, 1, 1 }, { 1, 0, 0, 0, 1, 0, 0, 0, 1 }, prop));
  const TruthTransfer transfer = Uniform(0.2, { 1, 1, 1 });
  const TruthCamera camera = CameraAlongZ(2.1, 2.2, -1, 20);
  TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  EXPECT_NEAR(IntegratePixel(scene, 0, 0)[3], 1 - std::pow(0.8, 10), 1e-13);
  scene.LengthFromWorld = Invert(prop);
  EXPECT_NEAR(IntegratePixel(scene, 0, 0)[3], 1 - std::pow(0.8, 5), 1e-13);
}

TEST(TruthClosedForm, OpaqueGeometryEndsTheRay)
{
  const auto volume = OneLevel([](auto, auto, auto) { return 1.0; }, { 8, 8, 21 });
  const TruthTransfer transfer = Uniform(0.25, { 1, 1, 1 });
  const TruthCamera camera = CameraAlongZ(2, 2, -5, 40); // its eye lies at z = -6
  const TruthScene scene{ volume, transfer, camera, TruthLevelOfDetail(0) };
  EXPECT_NEAR(IntegratePixel(scene, 0, 0, 0, 0, 6 + 8.5)[3], 1 - std::pow(0.75, 8), 1e-13);
  EXPECT_EQ(IntegratePixel(scene, 0, 0, 0, 0, 3)[3], 0);
  const std::vector<double> depth{ 14.5 };
  EXPECT_NEAR(RenderTruth(scene, AllPixels(camera), &depth)[0][3], 1 - std::pow(0.75, 8), 1e-13);
}

} // namespace
} // namespace teravox
