// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Sort-last rendering: what ranks know of each other. What is hidden by others is loaded last, and
// not at all where this very view shows that it is; sums and extremes of blocks are those of the
// volume; blocks follow the camera.
#include "ComponentScene.h"
#include "ImageMetrics.h"
#include "MessageRecorder.h"
#include "RankVolumes.h"
#include "Ranks.h"
#include "vtkBlockSplit.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <gtest/gtest.h>
#include <ostream>
#include <string>
#include <vtkCamera.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkPiecewiseFunction.h>
#include <vtkRenderer.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{
constexpr int Edge = 144; // pixels: 18 tiles

// A ball that lets nothing pass and has another value at each voxel, inside too.
std::shared_ptr<BrickSource> Ball()
{
  return SourceOf(
    [](double x, double y, double z)
    {
      const double r =
        std::sqrt((x - 0.5) * (x - 0.5) + (y - 0.5) * (y - 0.5) + (z - 0.5) * (z - 0.5));
      return r < 0.48 ? 0.7 + 0.3 * NoiseField(x, y, z) : 0.0;
    });
}

void LookAtBall(Stage& s)
{
  s.SetTransfer(MakeTransfer(OpacityShape::Wall));
  s.Look({ 0.4, 1, -0.3 }, 0.9);
  s.Mapper->SetMaximumLevel(0);
}

// A coarse picture first, of which ranks know where it is worth to begin.
void LookCoarsely(Ranks& ranks, const std::function<void(Stage&)>& set)
{
  for (int r = 0; r < ranks.Count(); ++r)
  {
    ranks.At(r).Mapper->SetMaximumLevel(31);
    ranks.At(r).Mapper->SetMinimumLevel(2);
  }
  ranks.DrawKnowingOthers();
  for (int r = 0; r < ranks.Count(); ++r)
  {
    ranks.At(r).Mapper->SetMinimumLevel(0);
    set(ranks.At(r));
  }
}

std::vector<float> PictureOfOne(const std::shared_ptr<BrickSource>& source,
  const std::function<void(Stage&)>& set, int edge = Edge)
{
  Stage one(edge, edge);
  one.SetSource(source);
  set(one);
  one.Mapper->AutoAdjustSampleDistancesOff();
  std::vector<float> picture = one.Draw();
  EXPECT_GT(*std::max_element(picture.begin(), picture.end()), 0.1f);
  return picture;
}
} // namespace

TEST(HiddenBlocks, AreLoadedLastOrNotAtAll)
{
  const auto source = Ball();
  const auto record = std::make_shared<RecordingSource>(source);
  const std::vector<float> reference = PictureOfOne(record, LookAtBall);
  const auto whole = static_cast<double>(record->BytesRead());
  for (const int count : { 2, 4 })
  {
    Ranks blind(
      count, Edge, Edge, [&](int) { return source; }, LookAtBall);
    EXPECT_LE(CompareImages(blind.Draw(), reference).Max, Tolerance);
    Ranks ranks(
      count, Edge, Edge, [&](int) { return source; }, LookAtBall);
    LookCoarsely(ranks, LookAtBall);
    const auto coarse = static_cast<double>(ranks.BytesRead());
    std::vector<float> seen;
    const std::vector<float> picture = ranks.DrawKnowingOthers(&seen);
    EXPECT_TRUE(ranks.AreConverged());
    EXPECT_LE(CompareImages(picture, reference).Max, Tolerance) << count << " ranks";
    // What is seen is there before the rest is asked for.
    const ImageDifference early = CompareImages(seen, reference);
    const auto all = static_cast<double>(ranks.BytesRead());
    const auto needed = static_cast<double>(ranks.BytesReadForSeen());
    std::printf("  %d ranks, bytes over one rank's: %.3f without knowing of each other; knowing "
                "%.3f until what is seen is right (%.5f off on average), %.3f when converged, %.3f "
                "of them for the coarse picture\n",
      count, static_cast<double>(blind.BytesRead()) / whole, needed / whole, early.Mean,
      all / whole, coarse / whole);
    EXPECT_LE(early.Mean, 1e-3);
    // Most of what was read in vain isn't. Of a volume of so few bricks a coarse picture is a large
    // part, of a large one it is a sixty-fourth.
    EXPECT_LT(all - coarse - whole, 0.5 * (static_cast<double>(blind.BytesRead()) - whole))
      << count << " ranks";
    // The next picture of the same view reads nothing; of another one it is right as well.
    EXPECT_LE(CompareImages(ranks.DrawKnowingOthers(), reference).Max, Tolerance);
    EXPECT_EQ(static_cast<double>(ranks.BytesRead()), all);
  }
}

// What was hidden a frame ago may be seen now.
TEST(HiddenBlocks, ATurnedViewIsThatOfOneRank)
{
  const auto source = Ball();
  Ranks ranks(
    4, Edge, Edge, [&](int) { return source; }, LookAtBall);
  LookCoarsely(ranks, LookAtBall);
  for (const double turn : { 2.0, 180.0 })
  {
    const auto set = [turn](Stage& s)
    {
      LookAtBall(s);
      s.Renderer->GetActiveCamera()->Azimuth(turn);
      s.Renderer->ResetCameraClippingRange();
    };
    const std::vector<float> reference = PictureOfOne(source, set);
    for (int r = 0; r < ranks.Count(); ++r)
    {
      set(ranks.At(r));
    }
    EXPECT_LE(CompareImages(ranks.DrawKnowingOthers(), reference).Max, Tolerance) << turn;
    EXPECT_TRUE(ranks.AreConverged()) << turn;
  }
}

TEST(HiddenBlocks, SuspicionsAreNoProof)
{
  const auto source = Ball();
  const std::vector<float> reference = PictureOfOne(source, LookAtBall);
  Ranks ranks(
    4, Edge, Edge, [&](int) { return source; }, LookAtBall);
  constexpr int tiles = Edge / vtkOutOfCoreVolumeMapper::OpacityTileSize;
  vtkNew<vtkFloatArray> everything;
  everything->SetNumberOfTuples(vtkIdType{ tiles } * tiles);
  everything->FillValue(1);
  for (int r = 0; r < ranks.Count(); ++r)
  {
    ranks.At(r).Mapper->SuspectHidden(everything);
  }
  const std::vector<float> nothing = ranks.Draw();
  EXPECT_EQ(*std::max_element(nothing.begin(), nothing.end()), 0.0f);
  EXPECT_EQ(ranks.BytesRead(), 0u);
  for (int r = 0; r < ranks.Count(); ++r)
  {
    EXPECT_FALSE(ranks.At(r).Mapper->IsConverged()) << "rank " << r;
  }
  // In this view nobody has drawn anything that hides.
  vtkNew<vtkFloatArray> all;
  ranks.GatherTiles(all);
  for (int r = 0; r < ranks.Count(); ++r)
  {
    vtkNew<vtkFloatArray> inFront;
    ranks.InFrontOf(r, all, inFront);
    EXPECT_TRUE(ranks.At(r).Mapper->ConfirmHidden(inFront));
  }
  EXPECT_LE(CompareImages(ranks.Draw(), reference).Max, Tolerance);
  EXPECT_TRUE(ranks.AreConverged());
}

// Neither another view nor other functions are shown with what was hidden before.
TEST(HiddenBlocks, AConfirmationIsOfOneView)
{
  const auto source = Ball();
  Ranks ranks(
    4, Edge, Edge, [&](int) { return source; }, LookAtBall);
  const auto changes = {
    +[](Stage& s)
    {
      LookAtBall(s);
      s.Look({ -0.4, -1, 0.3 }, 0.9);
    },
    +[](Stage& s)
    {
      LookAtBall(s);
      s.SetTransfer(MakeTransfer(OpacityShape::Ramp, 0, 255, 40));
    },
  };
  for (const auto& change : changes)
  {
    for (int r = 0; r < ranks.Count(); ++r)
    {
      LookAtBall(ranks.At(r));
    }
    ranks.DrawKnowingOthers();
    ranks.DrawKnowingOthers();
    for (int r = 0; r < ranks.Count(); ++r)
    {
      change(ranks.At(r));
    }
    EXPECT_LE(CompareImages(ranks.Draw(), PictureOfOne(source, change)).Max, Tolerance);
    EXPECT_TRUE(ranks.AreConverged());
  }
}

TEST(HiddenBlocks, WrongUseIsAnError)
{
  Stage stage(Edge, Edge);
  vtkNew<MessageRecorder> errors;
  stage.Mapper->AddObserver(vtkCommand::ErrorEvent, errors);
  vtkNew<vtkFloatArray> few;
  few->SetNumberOfTuples(3);
  few->FillValue(1);
  EXPECT_FALSE(stage.Mapper->GetOpacityTiles(few));
  EXPECT_FALSE(stage.Mapper->ConfirmHidden(few));
  stage.SetSource(Ball());
  LookAtBall(stage);
  const std::vector<float> reference = stage.Draw();
  stage.Mapper->SuspectHidden(few); // of another picture: nothing is hidden
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), reference));
  EXPECT_TRUE(stage.Mapper->IsConverged());
  EXPECT_FALSE(stage.Mapper->ConfirmHidden(few));
  EXPECT_EQ(errors->Messages.size(), 2u);
  EXPECT_FALSE(stage.Mapper->GetGatheredImage(vtkNew<vtkImageData>()));
}

namespace
{
struct SumMode
{
  const char* Name;
  int Blend;
  int Components;
};

void PrintTo(const SumMode& mode, std::ostream* out)
{
  *out << mode.Name << mode.Components;
}

class Gathered : public testing::TestWithParam<SumMode>
{
};
} // namespace

// Maximum, minimum, average and additive blending: what blocks gather makes the picture of one
// rank.
TEST_P(Gathered, MakesThePictureOfOneRank)
{
  const SumMode& mode = GetParam();
  constexpr int edge = 64;
  ImageOptions options;
  options.Dimensions = { 36, 32, 40 };
  options.Spacing = { 1, 1.25, 0.75 };
  const bool least = mode.Blend == vtkVolumeMapper::MINIMUM_INTENSITY_BLEND;
  const auto field = [least](int c, double x, double y, double z)
  {
    const double v = c == 0 ? BlobField(x, y, z) : BlobField(y, 1 - z, c == 1 ? x : 1 - x);
    return least ? 1 - 0.8 * v : v;
  };
  const auto source = SourceOfImage(mode.Components == 1
      ? MakeImage(options, [&](double x, double y, double z) { return field(0, x, y, z); })
      : MakeComponentImage(options, mode.Components, field),
    BrickEdge, false);
  const auto set = [&](Stage& s)
  {
    if (mode.Components == 1)
    {
      s.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    }
    else
    {
      SetComponentTransfer(
        s, { OpacityShape::Ramp, OpacityShape::Fog, OpacityShape::Ramp }, 0, 255, 20);
      s.Property->SetIndependentComponents(1);
    }
    s.Property->SetScalarOpacityUnitDistance(20);
    s.Mapper->SetBlendMode(mode.Blend);
    s.Mapper->SetAverageIPScalarRange(20, 220);
    s.Look({ 0.5, 0.6, -0.9 }, 0.8);
  };
  const std::vector<float> reference = PictureOfOne(source, set, edge);
  constexpr int count = 3;
  Ranks ranks(
    count, edge, edge, [&](int) { return source; }, set);
  vtkNew<MessageRecorder> warnings;
  for (int r = 0; r < count; ++r)
  {
    ranks.At(r).Mapper->AddObserver(vtkCommand::WarningEvent, warnings);
  }
  ranks.Draw();
  ranks.Draw();
  // Each window shows a block alone.
  EXPECT_EQ(warnings->Messages.size(), static_cast<std::size_t>(count));
  vtkNew<vtkImageData> sum;
  ASSERT_TRUE(ranks.At(0).Mapper->GetGatheredImage(sum));
  for (int r = 1; r < count; ++r)
  {
    vtkNew<vtkImageData> more;
    ASSERT_TRUE(ranks.At(r).Mapper->GetGatheredImage(more));
    ASSERT_TRUE(ranks.At(0).Mapper->JoinGatheredImage(sum, more));
  }
  const std::vector<float> mine = ranks.At(0).Accumulator();
  vtkNew<vtkImageData> colors;
  ASSERT_TRUE(ranks.At(0).Mapper->ResolveGatheredImage(sum, colors));
  const auto* first = static_cast<const float*>(colors->GetScalarPointer());
  const ImageDifference off =
    CompareImages({ first, first + std::size_t{ 4 } * edge * edge }, reference);
  std::printf("  %s of %d components, %d ranks: %.6f from one rank\n", mode.Name, mode.Components,
    count, off.Max);
  EXPECT_LE(off.Max, 0.1 * Tolerance);
  EXPECT_GT(CompareImages(mine, reference).Max, 0.05); // a block alone isn't the volume
  EXPECT_TRUE(AreImagesIdentical(ranks.At(0).Accumulator(), mine));
}

INSTANTIATE_TEST_SUITE_P(HiddenBlocks, Gathered,
  testing::Values(SumMode{ "Maximum", vtkVolumeMapper::MAXIMUM_INTENSITY_BLEND, 1 },
    SumMode{ "Minimum", vtkVolumeMapper::MINIMUM_INTENSITY_BLEND, 1 },
    SumMode{ "Average", vtkVolumeMapper::AVERAGE_INTENSITY_BLEND, 1 },
    SumMode{ "Additive", vtkVolumeMapper::ADDITIVE_BLEND, 1 },
    SumMode{ "Maximum", vtkVolumeMapper::MAXIMUM_INTENSITY_BLEND, 3 },
    SumMode{ "Minimum", vtkVolumeMapper::MINIMUM_INTENSITY_BLEND, 3 },
    SumMode{ "Average", vtkVolumeMapper::AVERAGE_INTENSITY_BLEND, 3 },
    SumMode{ "Additive", vtkVolumeMapper::ADDITIVE_BLEND, 3 }),
  [](const auto& test)
  { return std::string(test.param.Name) + "Of" + std::to_string(test.param.Components); });

// Blocks follow the camera, and stay where a little more wouldn't pay for reading bricks anew.
TEST(HiddenBlocks, BlocksFollowTheCamera)
{
  const auto source = Noise();
  const auto set = [](Stage& s)
  {
    s.SetTransfer(MakeTransfer(OpacityShape::Fog, 0, 255, 40));
    s.Mapper->SetMaximumLevel(0);
    s.Mapper->AutoAdjustSampleDistancesOff();
    s.Mapper->RecordBricksOn();
  };
  Ranks ranks(
    4, Size, Size, [&](int) { return source; }, set);
  ranks.Split->SetBricksPerBlock(64);
  Stage one(Size, Size);
  one.SetSource(source);
  set(one);
  double b[6];
  one.Mapper->GetBounds(b);
  int moves = 0;
  double worst = 0;
  constexpr int frames = 16;
  constexpr int unmoved = 3; // frames until the camera begins to move
  for (int frame = 0; frame < frames; ++frame)
  {
    // From one end of the volume to the other, close by: most of it is beside the picture.
    const double along = 0.1 + 0.8 * std::max(frame - unmoved, 0) / (frames - unmoved - 1);
    const double x = b[0] + along * (b[1] - b[0]);
    const auto look = [&](Stage& s)
    {
      s.LookFrom({ x, b[2] - 10, 0.5 * (b[4] + b[5]) },
        { x, 0.5 * (b[2] + b[3]), 0.5 * (b[4] + b[5]) }, 0.1, 400, 40);
    };
    for (int r = 0; r < ranks.Count(); ++r)
    {
      look(ranks.At(r));
    }
    const std::vector<float> picture = ranks.Draw();
    if (frame % 5 == 0)
    {
      look(one);
      EXPECT_LE(CompareImages(picture, one.Draw()).Max, Tolerance) << "frame " << frame;
    }
    if (frame > 0)
    {
      worst = std::max(worst, ranks.MostOverMean());
    }
    const bool moved = ranks.RebalanceIfWorthIt();
    EXPECT_TRUE(!moved || frame == 0 || frame >= unmoved) << "frame " << frame;
    moves += moved ? 1 : 0;
  }
  std::printf(
    "  %d frames along the volume: blocks moved %d times, the busiest rank needed at most "
    "%.2f times the mean\n",
    frames, moves, worst);
  EXPECT_GE(moves, 2);
  EXPECT_LE(moves, frames / 2);
  EXPECT_LE(worst, 2.2);
}
