// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Numerical stability of large volumes and long sequences: the largest volume seen from its surface
// is the truth, and frames leave nothing behind.
#include "Effort.h"
#include "ExpectTruth.h"
#include "FormulaBrickSource.h"
#include "Scene.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <vtkCamera.h>
#include <vtkImageData.h>
#include <vtkRenderer.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

// Waves that look alike everywhere, with values between 0.25 and 1: rays end after some hundred
// voxels.
class WaveFormula : public Formula
{
public:
  double Value(const Int3& place, const Int3& /*factor*/) const override
  {
    // In 128ths of a turn, so that a table gives the cosines.
    return 0.625 +
      0.375 * this->Cosine(2 * place[0] + 6) * this->Cosine(3 * place[1] + place[2]) *
      this->Cosine(place[2] - 10);
  }
  ValueRange Bound(const Int3& /*low*/, const Int3& /*high*/, const Int3& /*factor*/) const override
  {
    return { 0.25, 1 };
  }

private:
  double Cosine(std::int64_t turn) const
  {
    return this->Cosines[static_cast<std::size_t>(turn & 127)];
  }

  const std::vector<double> Cosines = []
  {
    std::vector<double> cosines(128);
    for (std::size_t i = 0; i < 128; ++i)
    {
      cosines[i] = std::cos(2 * M_PI * static_cast<double>(i) / 128);
    }
    return cosines;
  }();
};

std::vector<TruthLevel> LevelsOf(const WaveFormula& formula, const PyramidLayout& layout)
{
  std::vector<TruthLevel> levels;
  for (int l = 0; l < layout.NumberOfLevels(); ++l)
  {
    const Int3 f = layout.Factor(l);
    levels.push_back(TruthLevel::FromFunction(
      [&formula, f](std::int64_t i, std::int64_t j, std::int64_t k)
      {
        const Int3 place{ f[0] * (2 * i + 1) - 1, f[1] * (2 * j + 1) - 1, f[2] * (2 * k + 1) - 1 };
        return static_cast<double>(static_cast<float>(formula.Value(place, f)));
      },
      layout.Dimensions(l), f));
  }
  return levels;
}

} // namespace

// 2^30 voxels per axis, the eye three voxels before the surface.
TEST(Stability, BesideAHugeVolume)
{
  const std::int64_t edge = std::int64_t{ 1 } << 30;
  const auto wave = std::make_shared<WaveFormula>();
  FormulaDescription formula;
  formula.Field = wave;
  formula.Dimensions = { edge, edge, edge };
  formula.Type = ScalarType::Float32;
  formula.BrickSize = 32;
  const auto source = FormulaBrickSource::Make(formula);
  ASSERT_TRUE(source.Ok()) << source.GetStatus().Message();
  const VolumeInfo& info = source.Value()->Info();
  const double last = static_cast<double>(edge) - 1;
  const double middle = static_cast<double>(edge) / 2 + 11.3;
  struct Place
  {
    const char* Name;
    std::array<double, 3> Eye;
    std::array<double, 3> Towards;
  };
  for (const Place& place : { Place{ "near corner", { -3, 20.2, 30.7 }, { 1, 0.3, 0.2 } },
         Place{ "middle of a face", { last + 3, middle, middle - 77 }, { -1, 0.2, 0.3 } },
         Place{ "far corner", { last - 20.2, last + 3, last - 30.7 }, { -0.2, -1, -0.3 } },
         Place{ "grazing", { middle, last + 3, middle }, { 1, -0.02, 0.1 } } })
  {
    for (const bool shade : { false, true })
    {
      Stage stage(16, 16);
      stage.SetSource(source.Value());
      stage.SetTransfer({ { { 0.25, 0.03 }, { 0.6, 0.04 }, { 1, 0.25 } },
        { { 0.25, 0.1, 0.2, 0.9 }, { 1, 0.9, 0.8, 0.1 } }, 1 });
      stage.SetShade(shade);
      const auto& e = place.Eye;
      const auto& d = place.Towards;
      stage.LookFrom(e, { e[0] + 64 * d[0], e[1] + 64 * d[1], e[2] + 64 * d[2] }, 0.5, 3000, 50);
      const StageTruth truth(stage, info, LevelsOf(*wave, info.Layout));
      ExpectTruth(stage, truth, std::string(place.Name) + (shade ? ", shaded" : ""));
    }
  }
}

// After a walk through cameras, functions and shading, with an atlas that holds a fraction of what
// is seen, the first picture comes again with the same bits.
// The same thing, however many voxels: floats round the ends of volumes of more than 2^24 voxels to
// beyond their bricks, and rays that begin there must find the outermost ones all the same.
TEST(Stability, LargeVolumesLookLikeSmallOnes)
{
  constexpr int size = 72;
  std::vector<float> small;
  for (const int bits : { 20, 27, 28, 30 })
  {
    FormulaDescription formula;
    const std::int64_t edge = std::int64_t{ 1 } << bits;
    formula.Dimensions = { edge, edge, edge };
    formula.Field = MakeFormula(FormulaKind::Sponge, formula.Dimensions);
    formula.Type = ScalarType::UInt8;
    formula.BrickSize = 16;
    Stage stage(size, size);
    stage.SetSource(FormulaBrickSource::Make(formula).Value());
    stage.SetTransfer(MakeTransfer(OpacityShape::Ramp, 0, 255, std::ldexp(0.1, bits)));
    stage.Look({ 0.3, 1, 0.4 }, 0.8);
    // Of 16 bricks per axis.
    stage.Mapper->SetMinimumLevel(bits - 8);
    stage.Mapper->SetMaximumLevel(bits - 8);
    const std::vector<float> picture = stage.Draw();
    EXPECT_TRUE(stage.Mapper->IsConverged());
    EXPECT_GT(*std::max_element(picture.begin(), picture.end()), 0.5f);
    small = small.empty() ? picture : small;
    EXPECT_LE(CompareImages(picture, small).Max, 1.0 / 255) << "2^" << bits;
  }
}

TEST(Stability, NoDriftOverFrames)
{
  ImageOptions options;
  options.Dimensions = { 64, 56, 72 };
  const auto image = MakeImage(options);
  Stage stage(24, 24);
  stage.Mapper->SetBrickSize(16);
  stage.SetImage(image);
  stage.Mapper->SetMaximumNumberOfSlots(12);
  std::mt19937 random(20240607);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto place = [&]
  {
    return std::array<double, 3>{ 80 * unit(random) - 8, 70 * unit(random) - 7,
      90 * unit(random) - 9 };
  };
  const auto first = [&]
  {
    stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    stage.SetShade(true);
    stage.LookFrom({ -20.3, -31.7, 60.1 }, { 30, 30, 33 }, 0.5, 200, 45);
    return stage.Draw();
  };
  const std::vector<float> before = first();
  ASSERT_TRUE(stage.Mapper->IsConverged());
  ASSERT_GT(*std::max_element(before.begin(), before.end()), 0.1f);
  std::size_t different = 0;
  std::vector<float> last = before;
  for (int frame = 0; frame < 30; ++frame)
  {
    stage.SetTransfer(MakeTransfer(static_cast<OpacityShape>(frame % 5)));
    stage.SetShade(unit(random) < 0.5);
    stage.Mapper->SetImageErrorTolerance(unit(random) < 0.3 ? 0 : 1.0 / 255);
    stage.LookFrom(place(), place(), 0.1, 300, 20 + 60 * unit(random));
    stage.Renderer->GetActiveCamera()->SetParallelProjection(unit(random) < 0.3 ? 1 : 0);
    const std::vector<float> picture = stage.Draw();
    EXPECT_TRUE(stage.Mapper->IsConverged()) << frame;
    different += AreImagesIdentical(picture, last) ? 0 : 1;
    last = picture;
    stage.Mapper->SetImageErrorTolerance(1.0 / 255);
    if (frame % 10 == 9)
    {
      const std::vector<float> again = first();
      EXPECT_TRUE(AreImagesIdentical(again, before))
        << "after " << frame + 1 << " frames " << CountDifferentBits(again, before)
        << " values differ";
    }
  }
  EXPECT_GT(different, 20u); // the walk moved
  EXPECT_GT(stage.Mapper->GetNumberOfEvictions(), 0u);
}

// Ten thousand small steps of a camera that wanders through the volume, with other bricks at each:
// the first picture comes again with the same bits.
TEST(Stability, NoDriftOverALongWalk)
{
  ImageOptions options;
  options.Dimensions = { 40, 36, 44 };
  const auto image = MakeImage(options);
  Stage stage(8, 8);
  stage.Mapper->SetBrickSize(8);
  stage.SetImage(image);
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.Mapper->SetMaximumNumberOfSlots(24);
  std::mt19937 random(7);
  std::normal_distribution<double> step(0, 0.7);
  std::array<double, 3> eye{ -12, -9, 15 };
  std::array<double, 3> towards{ 20, 18, 22 };
  const auto draw = [&]
  {
    stage.LookFrom(eye, towards, 0.1, 120, 60);
    return stage.Draw();
  };
  const std::array<double, 3> start = eye;
  const std::array<double, 3> ahead = towards;
  const std::vector<float> before = draw();
  ASSERT_TRUE(stage.Mapper->IsConverged());
  ASSERT_GT(*std::max_element(before.begin(), before.end()), 0.1f);
  const auto wander = [&](std::array<double, 3>& place)
  {
    for (std::size_t a = 0; a < 3; ++a)
    {
      // Reflected where it would leave the volume and what lies around it.
      const double high = options.Dimensions[a] + 6;
      const double next = place[a] + step(random);
      place[a] = next < -6 ? -12 - next : next > high ? 2 * high - next : next;
    }
  };
  const int frames = TakesAll() ? Effort(10000, 500) : 1500;
  std::size_t different = 0;
  std::vector<float> last = before;
  for (int frame = 0; frame < frames; ++frame)
  {
    wander(eye);
    wander(towards);
    const std::vector<float> picture = draw();
    ASSERT_TRUE(stage.Mapper->IsConverged()) << frame;
    different += AreImagesIdentical(picture, last) ? 0 : 1;
    last = picture;
  }
  eye = start;
  towards = ahead;
  const std::vector<float> again = draw();
  EXPECT_TRUE(AreImagesIdentical(again, before))
    << CountDifferentBits(again, before) << " values differ";
  // Outside, with the back to the volume, pictures are all empty.
  EXPECT_GT(different, static_cast<std::size_t>(frames) / 2); // the walk moved
  EXPECT_GT(stage.Mapper->GetNumberOfEvictions(), static_cast<vtkTypeUInt64>(frames));
}
