// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// An opaque sheet, one voxel thick: what levels of averages lose first. Magnified it is seen
// whatever the budget; while its bricks are missing the estimate of the error tells of it; minified
// the picture is that of the pyramid.
#include "ExpectTruth.h"
#include "FaultyBrickSource.h"
#include "Scene.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>
#include <memory>
#include <ostream>
#include <vtkImageData.h>
#include <vtkRenderWindow.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr int BrickEdge = 16;

/// Voxels between two planes as far apart as the plane needs to have no holes.
struct Sheet
{
  const char* Name;
  std::array<double, 3> Normal; ///< of integers
  double Offset;                ///< of the plane, in voxels times the normal
};

void PrintTo(const Sheet& sheet, std::ostream* out)
{
  *out << sheet.Name;
}

constexpr Sheet Sheets[] = { { "InsideABrick", { 1, 0, 0 }, 21 },
  { "BesideTheFaceOfABrick", { 0, 1, 0 }, 16 }, { "BeforeTheFaceOfABrick", { 0, 0, 1 }, 15 },
  { "Oblique", { 3, 4, -5 }, 31 } };

vtkSmartPointer<vtkImageData> MakeSheet(const Sheet& sheet, int edge)
{
  ImageOptions options;
  options.Dimensions = { edge, edge, edge };
  const double voxels = edge - 1;
  const auto& n = sheet.Normal;
  // The largest component: one voxel on each line along that axis.
  const double half = 0.5 * std::max({ std::abs(n[0]), std::abs(n[1]), std::abs(n[2]) });
  return MakeImage(options,
    [=](double x, double y, double z)
    {
      const double distance = voxels * (n[0] * x + n[1] * y + n[2] * z) - sheet.Offset;
      return distance > -half - 1e-6 && distance <= half - 1e-6 ? 1.0 : 0.0;
    });
}

TransferNodes OpaqueAboveHalf()
{
  return { { { 0, 0 }, { 110, 0 }, { 140, 1 }, { 255, 1 } },
    { { 0, 0.9, 0.3, 0.1 }, { 255, 0.9, 0.8, 0.3 } }, 1 };
}

// In units of the tolerance, over all pixels: what the estimate leaves out, at most. Rays that
// graze the sheet are ill-conditioned: what the envelope of 9 rays holds is no error.
double LargestShortage(Stage& stage, const std::vector<float>& picture, const StageTruth& truth)
{
  vtkNew<vtkImageData> image;
  if (!stage.Mapper->GetErrorEstimateImage(image))
  {
    ADD_FAILURE() << "there is no estimate";
    return 0;
  }
  const auto* estimate = static_cast<const float*>(image->GetScalarPointer());
  double largest = -1;
  for (int i = 0; i < stage.Width() * stage.Height(); ++i)
  {
    const TruthPixel pixel{ i % stage.Width(), i / stage.Width() };
    const std::vector<float> taken = TakePixels(picture, stage.Width(), { pixel });
    const auto estimated = static_cast<double>(estimate[i]);
    const TruthBounds bounds = truth.Bounds({ pixel }, { taken }, estimated);
    const double error = ExcessOverEnvelope(taken, bounds.Low, bounds.High).Max;
    largest = std::max(largest, error - estimated);
  }
  return largest / stage.Mapper->GetImageErrorTolerance();
}

double LargestOpacity(const std::vector<float>& picture)
{
  double largest = 0;
  for (std::size_t i = 3; i < picture.size(); i += 4)
  {
    largest = std::max(largest, static_cast<double>(picture[i]));
  }
  return largest;
}

} // namespace

class MagnifiedSheet : public testing::TestWithParam<Sheet>
{
protected:
  /// From so near that a voxel is about two pixels wide in a picture of 48.
  static void Show(Stage& stage)
  {
    stage.SetTransfer(OpaqueAboveHalf());
    stage.Look({ 0.8, 0.7, 0.6 }, 0.5);
  }
};

// Where the truth is opaque so is the picture, with as few slots as there can be.
TEST_P(MagnifiedSheet, IsSeenWithAnyBudget)
{
  const auto image = MakeSheet(GetParam(), 40);
  const auto source = SourceOfImage(image, BrickEdge, false);
  std::vector<float> first;
  for (const unsigned slots : { 0u, 8u, 2u })
  {
    Stage stage(48, 48);
    stage.Mapper->SetBrickSize(BrickEdge);
    stage.SetImage(image);
    Show(stage);
    if (slots != 0)
    {
      stage.Mapper->SetMaximumNumberOfSlots(slots);
      const std::vector<float> picture = stage.Draw();
      EXPECT_TRUE(stage.Mapper->IsConverged());
      EXPECT_LE(stage.Mapper->GetNumberOfSlots(), slots);
      EXPECT_GT(stage.Mapper->GetNumberOfEvictions(), 0u);
      EXPECT_TRUE(AreImagesIdentical(picture, first)) << slots << " slots";
      continue;
    }
    const StageTruth truth(stage, *source);
    ExpectTruth(stage, truth, GetParam().Name);
    first = stage.Accumulator();
    const std::vector<TruthPixel> pixels =
      PixelBox(truth.Scene().Camera, 0, 0, stage.Width(), stage.Height());
    const TruthBounds bounds = truth.Bounds(pixels, { first }, 0);
    int opaque = 0;
    int lost = 0;
    for (std::size_t i = 3; i < first.size(); i += 4)
    {
      const bool isOpaque = bounds.Low[i] > 0.99f;
      opaque += isOpaque ? 1 : 0;
      lost += isOpaque && first[i] < 0.98f ? 1 : 0;
    }
    EXPECT_GT(opaque, 500);
    EXPECT_EQ(lost, 0);
  }
}

// While only coarse bricks are there, which show less of the sheet or none: no pixel is off by more
// than its estimate, and the sheet comes when its bricks do.
TEST_P(MagnifiedSheet, IsToldOfWhileItIsMissing)
{
  const auto image = MakeSheet(GetParam(), 40);
  const auto source = SourceOfImage(image, BrickEdge, false);
  const auto gated = std::make_shared<FaultyBrickSource>(source);
  Stage stage(16, 16);
  stage.SetSource(gated);
  Show(stage);
  stage.Mapper->ErrorEstimateOn();
  const StageTruth truth(stage, *source);
  stage.Mapper->SetMinimumLevel(1);
  const double coarse = LargestOpacity(stage.Draw());
  ASSERT_TRUE(stage.Mapper->IsConverged());
  stage.Mapper->SetMinimumLevel(0);
  stage.Mapper->SetFrameTimeBudget(0.05);
  gated->CloseGate();
  stage.Window->Render();
  EXPECT_FALSE(stage.Mapper->IsConverged());
  EXPECT_GT(stage.Mapper->GetNumberOfMissingBricks(), 0);
  const std::vector<float> meanwhile = stage.Accumulator();
  const double shortage = LargestShortage(stage, meanwhile, truth);
  std::printf("  %-24s opacity of level 1: %.3f, of the frame meanwhile: %.3f; beyond the estimate "
              "by %.3f tolerances\n",
    GetParam().Name, coarse, LargestOpacity(meanwhile), shortage);
  EXPECT_LE(shortage, 1);
  gated->OpenGate();
  stage.Mapper->SetFrameTimeBudget(0);
  ExpectTruth(stage, truth, std::string(GetParam().Name) + " when it is there");
  EXPECT_LE(LargestShortage(stage, stage.Accumulator(), truth), 1);
}

// A brick of the finest level that can't be read is replaced for good, and told of likewise.
TEST_P(MagnifiedSheet, IsToldOfWhereItCannotBeRead)
{
  const auto image = MakeSheet(GetParam(), 40);
  const auto source = SourceOfImage(image, BrickEdge, false);
  const auto faulty = std::make_shared<FaultyBrickSource>(source);
  faulty->SetFaults([](const BrickKey& key)
    { return key.Level == 0 && (key.X + key.Y + key.Z) % 2 == 1 ? Fault::Status : Fault::None; });
  Stage stage(16, 16);
  stage.SetSource(faulty);
  Show(stage);
  stage.Mapper->ErrorEstimateOn();
  const StageTruth truth(stage, *source);
  const std::vector<float> picture = stage.Draw();
  EXPECT_GT(stage.Mapper->GetNumberOfFailedBricks(), 0u);
  EXPECT_LE(LargestShortage(stage, picture, truth), 1);
}

INSTANTIATE_TEST_SUITE_P(
  Contract, MagnifiedSheet, testing::ValuesIn(Sheets), [](const auto& p) { return p.param.Name; });

// Minified: the truth of the pyramid; what averaging itself loses is printed beside.
TEST(MinifiedSheet, IsThePyramids)
{
  for (const Sheet& sheet : Sheets)
  {
    const auto image = MakeSheet(sheet, 96);
    const auto source = SourceOfImage(image, BrickEdge, false);
    Stage stage(32, 32);
    stage.Mapper->SetBrickSize(BrickEdge);
    stage.SetImage(image);
    stage.SetTransfer(OpaqueAboveHalf());
    stage.Mapper->SetImageErrorTolerance(1.0 / 255);
    // A soft function, too, which shows thinner sheets of coarser levels.
    for (const bool soft : { false, true })
    {
      if (soft)
      {
        TransferNodes nodes = OpaqueAboveHalf();
        nodes.Opacity = { { 0, 0 }, { 255, 1 } };
        stage.SetTransfer(nodes);
      }
      stage.Mapper->SetMaximumLevel(31);
      stage.Look({ 0.8, 0.7, 0.6 }, 1.5);
      const std::string name = std::string(sheet.Name) + (soft ? ", soft" : "");
      const StageTruth pyramid(stage, *source);
      if (soft) // else there may be nothing left to see
      {
        ExpectTruth(stage, pyramid, name + ", minified");
      }
      const std::vector<float> levels = stage.Draw();
      ASSERT_TRUE(stage.Mapper->IsConverged());
      const double tolerance = stage.Mapper->GetImageErrorTolerance();
      EXPECT_LE(pyramid.Excess(levels, 0.5 * tolerance).Max, tolerance) << name;
      stage.Mapper->SetMaximumLevel(0);
      ExpectTruth(stage, *source, name + ", level 0");
      const std::vector<float> finest = stage.Accumulator();
      const ImageDifference own = CompareImages(levels, finest);
      std::printf("  %-24s the pyramid's own error: max %.1f, mean %.2f in 1/255\n", name.c_str(),
        255 * own.Max, 255 * own.Mean);
      EXPECT_GT(own.Max, tolerance) << "no coarser level was drawn";
    }
  }
}
