// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Clipping planes and cropping: against the reference integrator (within the image error tolerance
// of the envelope of truth) and VTK's own mapper (the tolerances of TestRenderVTK.cxx, whose
// reasons hold here, too: VTK's samples lie 0.1 voxel apart, and its cuts where a sample happens to
// be), the same bits with any atlas, and nothing loaded of what is cut away.
#include "BesideVTK.h"
#include "EachWay.h"
#include "ExpectTruth.h"
#include "RecordingSource.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <gtest/gtest.h>
#include <set>
#include <vtkCamera.h>
#include <vtkImageData.h>
#include <vtkPlane.h>
#include <vtkPlaneCollection.h>
#include <vtkRenderer.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr int BrickEdge = 16;

void Crop(Stage& stage, int flags)
{
  stage.Mapper->SetCropping(1);
  stage.Mapper->SetCroppingRegionPlanes(11.3, 27.6, 9.2, 24.4, 14.7, 30.1);
  stage.Mapper->SetCroppingRegionFlags(flags);
}

const std::vector<std::pair<const char*, int>> Shapes = {
  { "sub-volume", VTK_CROP_SUBVOLUME },
  { "fence", VTK_CROP_FENCE },
  { "inverted fence", VTK_CROP_INVERTED_FENCE },
  { "cross", VTK_CROP_CROSS },
  { "inverted cross", VTK_CROP_INVERTED_CROSS },
  { "checkerboard", 0x5555555 },
};

// An image that isn't at the origin, and not as long along each axis.
ImageOptions Placed()
{
  ImageOptions options;
  options.Origin = { 3, -2, 5 };
  options.Spacing = { 1, 0.8, 1.3 };
  options.ExtentStart = { -4, 7, 2 };
  return options;
}

class Clipped : public testing::Test
{
protected:
  Clipped()
    : Source(SourceOfImage(Both.Image, BrickEdge, false))
  {
    this->Both.Shown.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    this->Both.Shown.Look({ 0.4, 1, -0.3 }, 0.8);
  }
  void Compare(const std::string& name)
  {
    this->Both.CopyCuts();
    this->Both.Expect(name + ", VTK");
    ExpectTruth(this->Both.Shown, *this->Source, name);
    if (const char* folder = std::getenv("TERAVOX_SAVE_PICTURES"))
    {
      std::string file = std::string(folder) + "/" + name + ".png";
      std::replace(file.begin(), file.end(), ' ', '-');
      this->Both.Save(file);
    }
  }
  BesideVTK Both{ {}, 40 };
  std::shared_ptr<BrickSource> Source;
};

} // namespace

TEST_F(Clipped, OnePlaneSlabAndCorner)
{
  Stage& stage = this->Both.Shown;
  Clip(stage, { 18, 17, 22 }, { 1, 0.3, -0.5 });
  ForEachWay(stage, [&](const std::string& way) { this->Compare("one plane" + way); });
  stage.Property->SetInterpolationTypeToLinear();
  stage.Look({ -1, 0.4, 0.2 }, 0.7, true);
  this->Compare("one plane, parallel, shaded");
  Clip(stage, { 28, 17, 22 }, { -1, -0.3, 0.5 });
  this->Compare("slab");
  Clip(stage, { 20, 18, 24 }, { 0, 1, 1 });
  Clip(stage, { 20, 18, 18 }, { 0.2, 0.1, 3 });
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
  this->Compare("corner of four planes");
}

TEST_F(Clipped, CameraInside)
{
  Stage& stage = this->Both.Shown;
  stage.LookFrom({ 14, 15, 16 }, { 30, 22, 25 }, 0.1, 100, 60);
  Clip(stage, { 22, 18, 22 }, { 1, 0.3, 0.2 });
  this->Compare("camera inside, behind the plane");
  stage.Mapper->RemoveAllClippingPlanes();
  Clip(stage, { 26, 18, 22 }, { -1, 0.3, 0.2 });
  this->Compare("camera inside, before the plane");
  stage.Mapper->RemoveAllClippingPlanes();
  Crop(stage, VTK_CROP_INVERTED_CROSS);
  this->Compare("camera inside, inverted cross");
}

// The planes lie in the world, cropping in the space of the image.
TEST(ClippedVolumes, MovedTurnedAndStretched)
{
  for (const bool shade : { false, true })
  {
    BesideVTK both(Placed(), 40);
    const auto source = SourceOfImage(both.Image, BrickEdge, false);
    Stage& stage = both.Shown;
    stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    stage.SetShade(shade);
    stage.Volume->SetPosition(5, -20, 8);
    stage.Volume->RotateX(25);
    stage.Volume->RotateZ(-40);
    if (!shade)
    {
      stage.Volume->SetScale(1.6, 0.7, 1.1);
    }
    stage.Look({ 0.4, 1, -0.3 }, 0.8);
    const double* center = stage.Volume->GetCenter();
    Clip(stage, { center[0] - 3, center[1], center[2] }, { 1, 0.3, -0.5 });
    both.CopyCuts();
    // VTK's own shading of this volume, whole, is up to 21/255 off: differences over n / (n - 1)
    // voxels, of another share on each axis.
    if (!shade)
    {
      both.Expect("transformed, plane, VTK");
    }
    ExpectTruth(stage, *source, shade ? "transformed, plane, shaded" : "transformed, plane");
    double b[6];
    both.Image->GetBounds(b);
    stage.Mapper->SetCropping(1);
    stage.Mapper->SetCroppingRegionPlanes(0.7 * b[0] + 0.3 * b[1], 0.35 * b[0] + 0.65 * b[1],
      0.7 * b[2] + 0.3 * b[3], 0.3 * b[2] + 0.7 * b[3], 0.6 * b[4] + 0.4 * b[5],
      0.35 * b[4] + 0.65 * b[5]);
    stage.Mapper->SetCroppingRegionFlags(VTK_CROP_INVERTED_CROSS);
    both.CopyCuts();
    if (!shade)
    {
      both.Expect("transformed, both, VTK");
    }
    ExpectTruth(stage, *source, shade ? "transformed, both, shaded" : "transformed, both");
  }
}

// What VTK 9.1 doesn't crop as documented: under a direction matrix.
TEST(ClippedVolumes, DirectionMatrix)
{
  ImageOptions options = Placed();
  const double c = std::cos(0.6);
  const double s = std::sin(0.6);
  options.Direction = { c, -s, 0, s, c, 0, 0, 0, -1 };
  const auto image = MakeImage(options);
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(40, 40);
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.SetImage(image);
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
  double b[6];
  stage.Volume->GetBounds(b);
  stage.Mapper->SetCropping(1);
  stage.Mapper->SetCroppingRegionPlanes(0.6 * b[0] + 0.4 * b[1], 0.35 * b[0] + 0.65 * b[1],
    0.6 * b[2] + 0.4 * b[3], 0.4 * b[2] + 0.6 * b[3], 0.6 * b[4] + 0.4 * b[5],
    0.35 * b[4] + 0.65 * b[5]);
  stage.Mapper->SetCroppingRegionFlags(VTK_CROP_FENCE);
  ExpectTruth(stage, *source, "direction matrix, fence");
}

TEST_F(Clipped, AllShapesOfCropping)
{
  for (const auto& shape : Shapes)
  {
    Crop(this->Both.Shown, shape.second);
    this->Compare(shape.first);
  }
  Crop(this->Both.Shown, VTK_CROP_FENCE);
  ForEachWay(this->Both.Shown, [&](const std::string& way) { this->Compare("fence" + way); });
}

TEST(ClippedVolumes, CellDataCropped)
{
  ImageOptions options = Placed();
  options.CellData = true;
  BesideVTK both(options, 40);
  both.Shown.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  both.Shown.Look({ 0.4, 1, -0.3 }, 0.8);
  double b[6];
  both.Image->GetBounds(b);
  both.Shown.Mapper->SetCropping(1);
  both.Shown.Mapper->SetCroppingRegionPlanes(0.7 * b[0] + 0.3 * b[1], 0.35 * b[0] + 0.65 * b[1],
    0.7 * b[2] + 0.3 * b[3], 0.3 * b[2] + 0.7 * b[3], 0.6 * b[4] + 0.4 * b[5],
    0.35 * b[4] + 0.65 * b[5]);
  both.Shown.Mapper->SetCroppingRegionFlags(VTK_CROP_INVERTED_CROSS);
  both.CopyCuts();
  both.Expect("cells, inverted cross, VTK");
  ExpectTruth(both.Shown, *SourceOfImage(both.Image, BrickEdge, true), "cells, inverted cross");
}

// Levels begin and end inside of what is kept.
TEST(ClippedVolumes, LevelsInOnePicture)
{
  ImageOptions options;
  options.Dimensions = { 96, 80, 112 };
  const auto image = MakeImage(options);
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(40, 40);
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.Mapper->SetMaximumNumberOfSlots(12);
  stage.SetSource(source);
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.Mapper->SetLevelOfDetailBias(1);
  stage.LookFrom({ 30, -12, 40 }, { 50, 60, 60 }, 0.5, 400, 65);
  stage.Mapper->SetCropping(1);
  stage.Mapper->SetCroppingRegionPlanes(30, 55, 25, 50, 40, 70);
  stage.Mapper->SetCroppingRegionFlags(VTK_CROP_INVERTED_CROSS);
  Clip(stage, { 48, 40, 40 }, { 0.2, 0.1, 1 });
  const StageTruth truth(stage, *source);
  std::set<int> levels;
  for (int i = 0; i < 1600; ++i)
  {
    for (const TruthLevelSpan& span : LevelSpans(truth.Scene(), i % 40, i / 40))
    {
      levels.insert(span.Level);
    }
  }
  EXPECT_GT(levels.size(), 1u);
  ExpectTruth(stage, truth, "levels, fence and plane, 12 slots");
}

// What is cut away completely, and planes that cut nothing.
TEST_F(Clipped, NothingLeftAndNothingCut)
{
  Stage& stage = this->Both.Shown;
  const std::vector<float> whole = stage.Draw();
  const vtkTypeUInt64 loaded = stage.Mapper->GetNumberOfBricksLoaded();
  EXPECT_GT(loaded, 5u);
  Clip(stage, { -50, 0, 0 }, { 1, 0, 0 });
  Clip(stage, { 0, 300, 0 }, { 0.1, -1, 0 });
  EXPECT_TRUE(AreImagesIdentical(whole, stage.Draw())) << "planes outside";
  Crop(stage, 0x7ffffff);
  EXPECT_TRUE(AreImagesIdentical(whole, stage.Draw())) << "all regions";
  stage.Mapper->SetCroppingRegionPlanes(-9, 900, -9, 900, -9, 900);
  stage.Mapper->SetCroppingRegionFlagsToSubVolume();
  EXPECT_TRUE(AreImagesIdentical(whole, stage.Draw())) << "planes of cropping outside";
  const auto expectEmpty = [&](const char* name)
  {
    for (const float value : stage.Draw())
    {
      ASSERT_EQ(value, 0.0f) << name;
    }
    EXPECT_TRUE(stage.Mapper->IsConverged()) << name;
  };
  stage.Mapper->SetCroppingRegionFlags(0);
  expectEmpty("no region");
  stage.Mapper->SetCroppingRegionFlagsToSubVolume();
  stage.Mapper->SetCroppingRegionPlanes(900, 910, 0, 10, 0, 10);
  expectEmpty("a region outside");
  stage.Mapper->SetCropping(0);
  Clip(stage, { 400, 0, 0 }, { 1, 0, 0 });
  expectEmpty("all clipped");
  EXPECT_EQ(stage.Mapper->GetNumberOfBricksLoaded(), loaded);
}

// Same bits: any atlas, any order, skipping or not, many passes.
TEST(ClippedVolumes, SameBits)
{
  ImageOptions options;
  options.Dimensions = { 96, 80, 112 };
  const auto source = SourceOfImage(MakeImage(options), BrickEdge, false);
  for (const bool nearest : { false, true })
  {
    std::vector<float> first;
    int slots = 0;
    for (const vtkTypeUInt32 limit : { 0u, 16u, 5u })
    {
      for (const bool skip : { true, false })
      {
        Stage stage(48, 48);
        stage.SetSource(source);
        stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
        stage.SetShade(!nearest);
        stage.Property->SetInterpolationType(
          nearest ? VTK_NEAREST_INTERPOLATION : VTK_LINEAR_INTERPOLATION);
        stage.Mapper->SetMaximumNumberOfSlots(limit);
        stage.Mapper->SetEmptySpaceSkipping(skip);
        stage.Mapper->SetArrivalShuffleSeed(limit);
        stage.LookFrom({ 30, -12, 40 }, { 50, 60, 60 }, 0.5, 400, 65);
        stage.Mapper->SetCropping(1);
        stage.Mapper->SetCroppingRegionPlanes(30, 55, 25, 50, 40, 70);
        stage.Mapper->SetCroppingRegionFlags(0x5555555);
        Clip(stage, { 48, 40, 50 }, { 0.2, 0.1, 1 });
        const std::vector<float> picture = stage.Draw();
        EXPECT_TRUE(stage.Mapper->IsConverged());
        EXPECT_EQ(stage.Mapper->CheckInvariants(), "");
        if (first.empty())
        {
          first = picture;
          EXPECT_GT(*std::max_element(first.begin(), first.end()), 0.1f);
          slots = static_cast<int>(stage.Mapper->GetNumberOfSlotsInUse());
          EXPECT_GT(slots, 20);
        }
        EXPECT_TRUE(AreImagesIdentical(first, picture)) << limit << " slots, skipping " << skip;
      }
    }
  }
}

// No brick is read that no kept place lies in.
TEST(ClippedVolumes, LoadsOnlyWhatIsKept)
{
  ImageOptions options;
  options.Dimensions = { 128, 128, 128 };
  const auto inner = SourceOfImage(MakeImage(options), BrickEdge, false);
  const auto readBricks = [&](const std::function<void(Stage&)>& cut)
  {
    const auto source = std::make_shared<RecordingSource>(inner);
    Stage stage(96, 96);
    stage.Mapper->SetMaximumLevel(0);
    stage.SetSource(source);
    stage.SetTransfer(MakeTransfer(OpacityShape::Fog));
    stage.Look({ 0.4, 1, -0.3 }, 0.6);
    cut(stage);
    stage.Draw();
    EXPECT_TRUE(stage.Mapper->IsConverged());
    return source->Read();
  };
  const std::size_t whole = readBricks([](Stage&) {}).size();
  const auto clipped = readBricks([](Stage& s) { Clip(s, { 66, 0, 0 }, { 1, 0, 0 }); });
  for (const BrickKey& key : clipped)
  {
    EXPECT_GE((key.X + 1) * BrickEdge, 66u) << key.ToString();
  }
  const auto cropped = readBricks(
    [](Stage& s)
    {
      s.Mapper->SetCropping(1);
      s.Mapper->SetCroppingRegionPlanes(34, 94, 34, 94, 34, 94);
      s.Mapper->SetCroppingRegionFlagsToFence();
    });
  // Whether a part of the brick lies in this place (0, 1, 2) along an axis.
  const auto lies = [](std::uint32_t index, int place)
  {
    const double low = index * BrickEdge;
    const double high = low + BrickEdge;
    return place == 0 ? low < 34.5 : place == 1 ? high > 34.5 && low < 94.5 : high > 94.5;
  };
  for (const BrickKey& key : cropped)
  {
    bool kept = false;
    for (int region = 0; region < 27; ++region)
    {
      kept = kept ||
        ((VTK_CROP_FENCE >> region & 1) != 0 && lies(key.X, region % 3) &&
          lies(key.Y, region / 3 % 3) && lies(key.Z, region / 9));
    }
    EXPECT_TRUE(kept) << key.ToString();
  }
  std::printf(
    "  bricks read: %zu, clipped %zu, cropped %zu\n", whole, clipped.size(), cropped.size());
  EXPECT_GT(whole, 300u);
  EXPECT_GT(clipped.size(), 60u);
  EXPECT_LT(clipped.size(), whole * 5 / 8);
  EXPECT_GT(cropped.size(), 60u);
  EXPECT_LT(cropped.size(), whole);
}
