// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// The integrator for several components: against the one for a single component, a closed form, and
// many small steps of the formula that VTK's shader has per sample.
#include "TruthComponents.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <memory>

using namespace teravox;

namespace
{

TruthTransfer Function(double low, double high, double alpha, const Double3& color)
{
  return TruthTransfer::PiecewiseLinear(
    { { low, 0 }, { 0.5 * (low + high), alpha }, { high, 0.3 * alpha } },
    { { low, color }, { high, { color[2], color[0], color[1] } } }, 1.3);
}

// Components of a small volume, looked at from outside.
struct Fixture
{
  explicit Fixture(int components, TruthInterpolation interpolation = TruthInterpolation::Linear)
    : Camera(TruthCamera::LookAt({ 22, 17, 26 }, { 4.5, 4.5, 4.5 }, { 0, 0, 1 }),
        TruthCamera::Frustum(-0.2, 0.2, -0.2, 0.2, 1, 100), 8, 8)
  {
    for (int c = 0; c < components; ++c)
    {
      const auto field = [c](std::int64_t i, std::int64_t j, std::int64_t k)
      {
        const auto x = static_cast<double>(i);
        const auto y = static_cast<double>(j);
        const auto z = static_cast<double>(k);
        return std::sin(0.9 * x + c) + std::cos(1.1 * y - 0.5 * c) * std::sin(0.7 * z + 2 * c);
      };
      this->Volumes.push_back(std::make_unique<TruthVolume>(
        std::vector<TruthLevel>{ TruthLevel::FromFunction(field, { 10, 10, 10 }) },
        TruthVolume::WorldFromVoxel({ 0, 0, 0 }, { 1, 1, 1 }), interpolation, false));
      this->Transfers.push_back(std::make_unique<TruthTransfer>(
        Function(-0.8 + 0.2 * c, 1.2, 0.15 + 0.1 * c, { 1.0 - 0.3 * c, 0.2 + 0.2 * c, 0.5 })));
      this->Scenes.push_back(
        std::make_unique<TruthScene>(TruthScene{ *this->Volumes.back(), *this->Transfers.back(),
          this->Camera, TruthLevelOfDetail(*this->Volumes.back(), this->Camera, 0, 0, 0) }));
      this->All.Parts.push_back(this->Scenes.back().get());
      this->All.Weights.push_back(1.0 - 0.25 * c);
    }
  }
  /// Of each component another function of the gradient, with bends.
  void SetGradients()
  {
    for (std::size_t c = 0; c < this->Scenes.size(); ++c)
    {
      const double steep = 1.5 + 0.5 * static_cast<double>(c);
      this->Opacities.push_back(std::make_unique<TruthGradientOpacity>([=](double m)
        { return std::clamp(m * steep - 0.3, 0.0, 1.0); },
        std::vector<double>{ 0.3 / steep, 1.3 / steep }, Double3{ 1, 1, 1 }));
      this->Scenes[c]->GradientOpacity = this->Opacities.back().get();
    }
  }
  TruthCamera Camera;
  std::vector<std::unique_ptr<TruthGradientOpacity>> Opacities;
  std::vector<std::unique_ptr<TruthVolume>> Volumes;
  std::vector<std::unique_ptr<TruthTransfer>> Transfers;
  std::vector<std::unique_ptr<TruthScene>> Scenes;
  TruthComponents All;
};

// VTK's formula per sample, with a step so small that its limit is reached.
TruthColor SmallSteps(const Fixture& f, int x, int y, int steps)
{
  const TruthRay ray = f.Camera.Ray(x, y);
  TruthColor sum{};
  for (const TruthLevelSpan& span : LevelSpans(*f.All.Parts[0], x, y))
  {
    const double begin = ray.LengthAtDepth(span.DepthBegin);
    const double step = (ray.LengthAtDepth(span.DepthEnd) - begin) / steps;
    for (int i = 0; i < steps; ++i)
    {
      const Double3 at = ray.At(begin + (i + 0.5) * step);
      double total = 0;
      double squares = 0;
      Double3 light{};
      for (std::size_t c = 0; c < f.All.Parts.size(); ++c)
      {
        const TruthVolume& volume = *f.Volumes[c];
        const Double3 place = TransformPoint(volume.VoxelFromWorld(), at);
        const double v = volume.Field(0, place);
        const TruthTransfer& function = *f.Transfers[c];
        double a = 1 - std::pow(1 - function.GetAlpha(v), step / function.UnitDistance());
        if (!f.Opacities.empty())
        {
          const Double3 d = volume.CentralDifference(0, place, { 1, 1, 1 });
          a *= (*f.Opacities[c])(0.5 * Length(d));
        }
        total += f.All.Weights[c] * a;
        squares += a * a;
        light = light + f.All.Weights[c] * a * function.GetColor(v);
      }
      const double left = 1 - sum[3];
      for (std::size_t k = 0; k < 3; ++k)
      {
        sum[k] += left * light[k];
      }
      sum[3] += total > 0 ? left * squares / total : 0;
    }
  }
  return sum;
}
} // namespace

TEST(TruthComponents, OneIsWhatTheIntegratorForOneGives)
{
  for (const bool gradients : { false, true })
  {
    for (const auto interpolation : { TruthInterpolation::Linear, TruthInterpolation::Nearest })
    {
      Fixture f(1, interpolation);
      if (gradients)
      {
        f.SetGradients();
      }
      double seen = 0;
      for (const TruthPixel& pixel : AllPixels(f.Camera))
      {
        const TruthColor one = IntegratePixel(*f.All.Parts[0], pixel.X, pixel.Y);
        const TruthColor all = IntegrateComponents(f.All, pixel.X, pixel.Y);
        for (std::size_t k = 0; k < 4; ++k)
        {
          EXPECT_NEAR(all[k], one[k], 1e-8) << pixel.X << ", " << pixel.Y;
        }
        seen = std::max(seen, one[3]);
      }
      EXPECT_GT(seen, gradients ? 0.1 : 0.3);
    }
  }
}

TEST(TruthComponents, SeveralAreTheLimitOfVTKsFormula)
{
  for (const int components : { 2, 3, 4 })
  {
    Fixture f(components);
    if (components == 3)
    {
      f.SetGradients();
    }
    for (const TruthPixel& pixel : PixelBox(f.Camera, 3, 3, 2, 2))
    {
      const TruthColor exact = IntegrateComponents(f.All, pixel.X, pixel.Y);
      const TruthColor steps = SmallSteps(f, pixel.X, pixel.Y, 100000);
      EXPECT_GT(exact[3], f.Opacities.empty() ? 0.3 : 0.1);
      for (std::size_t k = 0; k < 4; ++k)
      {
        EXPECT_NEAR(exact[k], steps[k], 1e-4) << components << " components"; // first order
      }
    }
  }
}

namespace
{
// A function over both components of a fixture, with walls of a share of its nodes.
struct OverBoth
{
  OverBoth(Fixture& f, bool rows, bool walls)
    : Image(5, Nodes(rows, walls), -1.2, 1.5, 2.5, f.Transfers[0]->UnitDistance(), { 1, 1, 1 })
  {
    f.All.Image = &this->Image;
    f.All.Rows = { -1, -0.375, 0.25, 0.875, 1.5 };
  }
  static std::vector<TruthImage::Node> Nodes(bool rows, bool walls)
  {
    std::vector<TruthImage::Node> nodes;
    for (int row = 0; row < 5; ++row)
    {
      const double y = rows ? row : 2;
      for (int column = 0; column < 5; ++column)
      {
        const double opacity = column == 0 ? 0 : 0.08 * column * (1 + y) * (column == 3 ? 0.1 : 1);
        nodes.push_back({ 0.2 * column, 1 - 0.2 * y, 0.1 * column * y / 2,
          walls && column > 2 && y > 1 ? 1 : std::min(opacity, 0.9) });
      }
    }
    return nodes;
  }
  TruthImage Image;
};
} // namespace

// Where all rows are alike, the second component makes no difference.
TEST(TruthComponents, AnImageOfEqualRowsIsAFunctionOfTheFirst)
{
  for (const auto interpolation : { TruthInterpolation::Linear, TruthInterpolation::Nearest })
  {
    Fixture f(2, interpolation);
    const OverBoth both(f, false, true);
    std::vector<TruthTransfer::AlphaNode> alpha;
    std::vector<TruthTransfer::ColorNode> color;
    for (int column = 0; column < 5; ++column)
    {
      const double value = -1.2 + 2.7 * column / 4;
      const TruthImage::Node node = both.Image.At(value, 0);
      alpha.push_back({ value, node[3] });
      color.push_back({ value, { node[0], node[1], node[2] } });
    }
    *f.Transfers[0] = TruthTransfer::PiecewiseLinear(alpha, color, f.Transfers[0]->UnitDistance());
    for (const TruthPixel& pixel : AllPixels(f.Camera))
    {
      const TruthColor one = IntegratePixel(*f.All.Parts[0], pixel.X, pixel.Y);
      const TruthColor all = IntegrateComponents(f.All, pixel.X, pixel.Y);
      for (std::size_t k = 0; k < 4; ++k)
      {
        EXPECT_NEAR(all[k], one[k], 1e-8) << pixel.X << ", " << pixel.Y;
      }
    }
  }
}

TEST(TruthComponents, AnImageIsTheLimitOfSmallSteps)
{
  Fixture f(2);
  const OverBoth both(f, true, false);
  for (const TruthPixel& pixel : PixelBox(f.Camera, 3, 3, 2, 2))
  {
    const TruthColor exact = IntegrateComponents(f.All, pixel.X, pixel.Y);
    const TruthRay ray = f.Camera.Ray(pixel.X, pixel.Y);
    TruthColor sum{};
    for (const TruthLevelSpan& span : LevelSpans(*f.All.Parts[0], pixel.X, pixel.Y))
    {
      const double begin = ray.LengthAtDepth(span.DepthBegin);
      const double step = (ray.LengthAtDepth(span.DepthEnd) - begin) / 100000;
      for (int i = 0; i < 100000; ++i)
      {
        const Double3 place =
          TransformPoint(f.Volumes[0]->VoxelFromWorld(), ray.At(begin + (i + 0.5) * step));
        const TruthImage::Node node =
          both.Image.At(f.Volumes[0]->Field(0, place), f.Volumes[1]->Field(0, place) + 1);
        const double a = 1 - std::pow(1 - node[3], step / f.Transfers[0]->UnitDistance());
        const double left = 1 - sum[3];
        for (std::size_t k = 0; k < 3; ++k)
        {
          sum[k] += left * a * node[k];
        }
        sum[3] += left * a;
      }
    }
    EXPECT_GT(exact[3], 0.3);
    for (std::size_t k = 0; k < 4; ++k)
    {
      EXPECT_NEAR(exact[k], sum[k], 1e-4); // first order
    }
  }
}
