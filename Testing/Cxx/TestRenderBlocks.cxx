// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Sort-last rendering: pictures of blocks, blended front to back as floats, are the picture of the
// whole volume; each rank loads what its block needs.
#include "ImageMetrics.h"
#include "RankVolumes.h"
#include "Ranks.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <functional>
#include <gtest/gtest.h>
#include <ostream>
#include <random>
#include <string>
#include <vtkCamera.h>
#include <vtkContourValues.h>
#include <vtkLight.h>
#include <vtkPiecewiseFunction.h>
#include <vtkPlane.h>
#include <vtkPlaneCollection.h>
#include <vtkRenderer.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

/// From one rank that casts a ray for each pixel, too. What differs is where rays end: a quarter of
/// the tolerance of what is behind may be left out, by the ray of one rank, by those of blocks.
constexpr double Close = 2 * 0.25 / 255;

struct Scenario
{
  const char* Name;
  std::function<std::shared_ptr<BrickSource>()> Source; ///< null: not installed
  std::function<void(Stage&)> Set;
};

void PrintTo(const Scenario& scenario, std::ostream* out)
{
  *out << scenario.Name;
}

std::shared_ptr<BrickSource> Brain()
{
  const auto image = LoadBrain(3, { 96, 80, 100 });
  return image ? SourceOfImage(image, BrickEdge, false) : nullptr;
}

const Scenario Scenarios[] = {
  { "Brain", Brain,
    [](Stage& s)
    {
      s.SetTransfer(BrainTransfer());
      s.Look({ 0.4, 1, -0.3 }, 0.9);
      s.Mapper->SetMaximumLevel(0);
    } },
  { "BrainShadedParallel", Brain,
    [](Stage& s)
    {
      s.SetTransfer(BrainTransfer());
      s.SetShade(true);
      s.Look({ -0.8, 0.5, -0.3 }, 0.7, true);
    } },
  { "BrainShadedInLevels", Brain,
    [](Stage& s)
    {
      s.SetTransfer(BrainTransfer());
      s.SetShade(true);
      s.LookFrom({ 30, -12, 40 }, { 50, 60, 60 }, 0.5, 400, 65);
      s.Mapper->SetLevelOfDetailBias(1);
    } },
  { "BrainInsideOffAxis", Brain,
    [](Stage& s)
    {
      s.SetTransfer(BrainTransfer());
      s.LookFrom({ 40, 20, 50 }, { 60, 70, 60 }, 0.05, 300, 60);
      s.Renderer->GetActiveCamera()->SetWindowCenter(0.3, -0.2);
    } },
  { "Constant", [] { return SourceOf([](double, double, double) { return 0.5; }); },
    [](Stage& s)
    {
      s.SetTransfer(
        { { { 0, 0.02 }, { 255, 0.02 } }, { { 0, 0.2, 0.5, 0.9 }, { 255, 0.2, 0.5, 0.9 } } });
      s.Look({ 0.35, 1, 0.2 }, 0.8);
    } },
  // Of one value with voxels to march through, not a segment per brick.
  { "NearlyConstantShaded",
    [] {
      return SourceOf([](double x, double, double) { return 0.5 + 0.01 * x; }, ScalarType::Float32);
    },
    [](Stage& s)
    {
      s.SetTransfer(
        { { { 0, 0.02 }, { 255, 0.02 } }, { { 0, 0.2, 0.5, 0.9 }, { 255, 0.2, 0.5, 0.9 } } });
      s.SetShade(true);
      LookInside(s);
    } },
  { "Noise", [] { return Noise(); },
    [](Stage& s)
    {
      s.SetTransfer(MakeTransfer(OpacityShape::Peak, 0, 255, 8));
      s.Look({ 0.3, -1, 0.4 }, 0.7);
    } },
  { "NoiseShadedInside", [] { return Noise(ScalarType::Int16); },
    [](Stage& s)
    {
      s.SetTransfer(MakeTransfer(OpacityShape::Ramp, 0, 255, 20));
      s.SetShade(true);
      LookInside(s);
    } },
  { "NoiseOfCellsNearest",
    []
    {
      auto random = std::make_shared<std::mt19937>(4);
      return SourceOf([random](double, double, double)
        { return std::uniform_real_distribution<double>(0, 1)(*random); },
        ScalarType::UInt16, true);
    },
    [](Stage& s)
    {
      s.SetTransfer(MakeTransfer(OpacityShape::Box, 0, 255, 8));
      s.Property->SetInterpolationTypeToNearest();
      s.Look({ -0.3, 0.8, 0.4 }, 0.7, true);
    } },
  { "BlobsWithoutValues", [] { return SourceOf(BlobField, ScalarType::Float64, false, 0.1); },
    [](Stage& s)
    {
      s.SetTransfer(MakeTransfer(OpacityShape::Ramp));
      s.SetShade(true);
      s.Look({ 0.5, 0.6, -0.9 }, 0.8);
    } },
  { "BlobsInFixedSteps", [] { return SourceOf(BlobField); },
    [](Stage& s)
    {
      s.SetTransfer(MakeTransfer(OpacityShape::Ramp));
      s.Mapper->SetImageErrorTolerance(0);
      s.Mapper->SetSampleDistance(0.7f);
      s.Look({ 0.5, 0.6, -0.9 }, 0.8);
    } },
  { "BlobsWithSceneLightsCropped", [] { return SourceOf(BlobField); },
    [](Stage& s)
    {
      s.SetTransfer(MakeTransfer(OpacityShape::Wall));
      s.SetShade(true);
      s.Look({ 0.5, 0.6, -0.9 }, 0.8);
      vtkNew<vtkLight> light;
      light->SetLightTypeToSceneLight();
      light->SetPositional(1);
      light->SetPosition(40, -200, 90);
      light->SetFocalPoint(40, 40, 40);
      light->SetConeAngle(60);
      s.Renderer->AddLight(light);
      double b[6];
      s.Mapper->GetBounds(b);
      s.Mapper->SetCropping(1);
      s.Mapper->SetCroppingRegionFlagsToFence();
      s.Mapper->SetCroppingRegionPlanes(0.7 * b[0] + 0.3 * b[1], 0.3 * b[0] + 0.7 * b[1],
        0.7 * b[2] + 0.3 * b[3], 0.3 * b[2] + 0.7 * b[3], 0.7 * b[4] + 0.3 * b[5],
        0.3 * b[4] + 0.7 * b[5]);
      vtkNew<vtkPlane> plane;
      plane->SetOrigin(0.5 * (b[0] + b[1]), 0.5 * (b[2] + b[3]), 0.4 * b[4] + 0.6 * b[5]);
      plane->SetNormal(0.2, 0.1, -1);
      vtkNew<vtkPlaneCollection> planes;
      planes->AddItem(plane);
      s.Mapper->SetClippingPlanes(planes);
    } },
  { "Surfaces", [] { return SourceOf(BlobField); },
    [](Stage& s)
    {
      s.SetTransfer(MakeTransfer(OpacityShape::Fog));
      s.SetShade(true);
      s.Opacity->AddPoint(0, 0.4);
      s.Opacity->AddPoint(255, 0.4);
      s.Mapper->SetBlendModeToIsoSurface();
      s.Property->GetIsoSurfaceValues()->SetValue(0, 90.3);
      s.Property->GetIsoSurfaceValues()->SetValue(1, 160.7);
      s.Look({ 0.5, 0.6, -0.9 }, 0.8);
    } },
};

class Blocks : public testing::TestWithParam<Scenario>
{
protected:
  void SetUp() override
  {
    this->Source = GetParam().Source();
    if (!this->Source)
    {
      GTEST_SKIP() << "the brain scan of Debian's package mricron-data isn't installed";
    }
    this->Record = std::make_shared<RecordingSource>(this->Source);
    this->One = std::make_unique<Stage>(Size, Size);
    this->One->SetSource(this->Record);
    GetParam().Set(*this->One);
    this->Reference = this->One->Draw();
    ASSERT_TRUE(this->One->Mapper->IsConverged());
    EXPECT_GT(*std::max_element(this->Reference.begin(), this->Reference.end()), 0.1f);
    this->One->Mapper->AutoAdjustSampleDistancesOff();
    this->EachPixel = this->One->Draw();
  }

  std::shared_ptr<BrickSource> Source;
  std::shared_ptr<RecordingSource> Record;
  std::unique_ptr<Stage> One;
  std::vector<float> Reference;
  std::vector<float> EachPixel; ///< no pixel interpolated
};

// Bricks whose voxels don't meet the block; ancestors of those that can't be read aside, there must
// be none.
std::size_t BricksElsewhere(const RecordingSource& reads, const VoxelBox& block)
{
  const PyramidLayout& layout = reads.Info().Layout;
  std::size_t count = 0;
  for (const BrickKey& key : reads.Read())
  {
    const Int3 index{ key.X, key.Y, key.Z };
    bool met = true;
    for (std::size_t a = 0; a < 3; ++a)
    {
      const std::int64_t edge = layout.BrickSize() * layout.Factor(key.Level)[a];
      met = met && index[a] * edge < block.High[a] && (index[a] + 1) * edge > block.Low[a];
    }
    count += met ? 0 : 1;
  }
  return count;
}

} // namespace

TEST_P(Blocks, BlendedAreThePictureOfOneRank)
{
  for (const int count : { 1, 2, 3, 4, 8 })
  {
    Ranks ranks(
      count, Size, Size, [&](int) { return this->Source; }, GetParam().Set);
    const std::vector<float> picture = ranks.Draw();
    const ImageDifference off = CompareImages(picture, this->Reference);
    const ImageDifference close = CompareImages(picture, this->EachPixel);
    // Bricks of one value aren't read.
    const double more = this->Record->BytesRead() == 0 && ranks.BytesRead() == 0
      ? 1.0
      : static_cast<double>(ranks.BytesRead()) / static_cast<double>(this->Record->BytesRead());
    std::printf("  %s, %d ranks: %.5f from one rank (%.6f with a ray for each pixel), %.2f x its "
                "bytes\n",
      GetParam().Name, count, off.Max, close.Max, more);
    EXPECT_LE(off.Max, Tolerance) << count << " ranks, pixel " << off.WorstPixel % Size << ", "
                                  << off.WorstPixel / Size;
    EXPECT_LE(close.Max, Close) << count << " ranks, pixel " << close.WorstPixel % Size << ", "
                                << close.WorstPixel / Size;
    for (int r = 0; r < count; ++r)
    {
      EXPECT_TRUE(ranks.At(r).Mapper->IsConverged()) << "rank " << r;
      EXPECT_EQ(BricksElsewhere(ranks.ReadsOf(r), ranks.BlockOf(r)), 0u) << "rank " << r;
    }
    // What a rank doesn't know to lie behind another's opacity is read, too.
    if (count == 1)
    {
      EXPECT_EQ(more, 1.0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(SortLast, Blocks, testing::ValuesIn(Scenarios),
  [](const auto& test) { return std::string(test.param.Name); });
