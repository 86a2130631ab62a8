// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Binary masks: against the reference integrator (within the image error tolerance of the envelope
// of truth) and VTK's own mapper (the tolerances of TestRenderVTK.cxx: VTK's samples lie 0.1 voxel
// apart, and a mask ends for it where a sample happens to be), the same bits with any atlas, and
// nothing loaded of what lies outside.
#include "ArrayBrickSource.h"
#include "BesideVTK.h"
#include "EachWay.h"
#include "ExpectTruth.h"
#include "MaskImages.h"
#include "MessageRecorder.h"
#include "RecordingSource.h"
#include "vtkBrickSource.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <gtest/gtest.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkUnsignedCharArray.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr int BrickEdge = 16;

// What the shape of a picture depends on.
} // namespace

TEST(TruthOfMasks, EachWayAndType)
{
  for (const ScalarType type : { ScalarType::UInt8, ScalarType::Int16, ScalarType::Float64 })
  {
    const ImageOptions options = OptionsOfType(type);
    const InMask isIn = Sponge(options.Dimensions);
    const auto image = MakeImage(options);
    const auto source = SourceOfImage(image, BrickEdge, false);
    Stage stage(40, 40);
    PrepareForMask(stage, BrickEdge, image, options);
    SetMask(stage.Mapper, MaskImage(options.Dimensions, isIn));
    ForEachWay(stage,
      [&](const std::string& way)
      {
        StageTruth truth(stage, *source);
        truth.SetMask(MaskLevels(source->Info().Layout, isIn));
        ExpectTruth(stage, truth, std::string("mask, ") + ToString(type) + way);
      });
  }
}

TEST(TruthOfMasks, CoarserLevelsInAFewSlots)
{
  ImageOptions options;
  options.Dimensions = { 96, 80, 112 };
  const InMask isIn = Sponge(options.Dimensions);
  const auto image = MakeImage(options);
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(40, 40);
  PrepareForMask(stage, BrickEdge, image);
  stage.Mapper->SetMaximumNumberOfSlots(12);
  stage.Mapper->SetLevelOfDetailBias(1);
  stage.LookFrom({ 30, -12, 40 }, { 50, 60, 60 }, 0.5, 400, 65);
  SetMask(stage.Mapper, MaskImage(options.Dimensions, isIn));
  StageTruth truth(stage, *source);
  truth.SetMask(MaskLevels(source->Info().Layout, isIn));
  EXPECT_TRUE(HasCoarserLevels(truth, 40));
  ExpectTruth(stage, truth, "mask, levels, 12 slots");
}

TEST(Masks, AsVTK)
{
  const ImageOptions options;
  BesideVTK both(options, 40);
  both.Shown.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  both.Shown.Look({ 0.4, 1, -0.3 }, 0.8);
  const auto mask = MaskImage(options.Dimensions, Sponge(options.Dimensions));
  SetMask(both.Shown.Mapper, mask);
  SetMask(both.Theirs, mask);
  for (const bool shade : { false, true })
  {
    both.Shown.SetShade(shade);
    both.Expect(shade ? "mask, shaded" : "mask");
  }
  if (const char* folder = std::getenv("TERAVOX_SAVE_PICTURES"))
  {
    both.Save(std::string(folder) + "/mask.png");
  }
}

TEST(Masks, SameBitsAndNothingLoadedOutside)
{
  ImageOptions options;
  options.Dimensions = { 96, 80, 112 };
  const InMask isIn = [](std::int64_t i, std::int64_t j, std::int64_t k)
  { return k < 56 && (i * 31 + j * 57 + k * 91) % 7 != 0; };
  const auto mask = MaskImage(options.Dimensions, isIn);
  const auto inner = SourceOfImage(MakeImage(options), BrickEdge, false);
  for (const bool nearest : { false, true })
  {
    std::vector<float> first;
    for (const vtkTypeUInt32 limit : { 0u, 16u, 5u })
    {
      const auto source = std::make_shared<RecordingSource>(inner);
      Stage stage(48, 48);
      stage.SetSource(source);
      stage.SetTransfer(MakeTransfer(OpacityShape::Fog));
      stage.SetShade(!nearest);
      stage.Property->SetInterpolationType(
        nearest ? VTK_NEAREST_INTERPOLATION : VTK_LINEAR_INTERPOLATION);
      stage.Mapper->SetMaximumNumberOfSlots(limit);
      stage.Mapper->SetArrivalShuffleSeed(limit);
      stage.Mapper->SetMaximumLevel(0);
      SetMask(stage.Mapper, mask);
      stage.Look({ 0.4, 1, -0.3 }, 0.8);
      const std::vector<float> picture = stage.Draw();
      ASSERT_TRUE(stage.Mapper->IsConverged());
      EXPECT_GT(*std::max_element(picture.begin(), picture.end()), 0.1f);
      for (const BrickKey& key : source->Read())
      {
        // Brick 3 begins at voxel 48; brick 4 at 64, with a border of two voxels.
        EXPECT_TRUE(key.Level > 0 || key.Z <= 3) << key.ToString();
      }
      EXPECT_GT(source->Read().size(), 20u);
      first = first.empty() ? picture : first;
      EXPECT_TRUE(AreImagesIdentical(first, picture)) << limit << " slots";
      if (limit == 0)
      {
        stage.Mapper->SetEmptySpaceSkipping(false);
        EXPECT_TRUE(AreImagesIdentical(first, stage.Draw())) << "nothing skipped";
      }
    }
  }
}

TEST(Masks, AChangedMaskChangesThePicture)
{
  const ImageOptions options;
  const auto image = MakeImage(options);
  Stage stage(40, 40);
  PrepareForMask(stage, BrickEdge, image);
  const std::vector<float> whole = stage.Draw();
  const auto mask = MaskImage(options.Dimensions, [](auto, auto, auto) { return true; });
  SetMask(stage.Mapper, mask);
  // Between rays nothing is interpolated behind a mask.
  stage.Mapper->SetAutoAdjustSampleDistances(0);
  const std::vector<float> all = stage.Draw();
  stage.Mapper->SetMaskInput(nullptr);
  EXPECT_TRUE(AreImagesIdentical(all, stage.Draw())) << "a mask of ones";
  SetMask(stage.Mapper, mask);
  auto* voxels = static_cast<unsigned char*>(mask->GetScalarPointer());
  std::fill(voxels, voxels + 40 * 36 * 22, static_cast<unsigned char>(0));
  mask->Modified();
  const std::vector<float> half = stage.Draw();
  EXPECT_FALSE(AreImagesIdentical(all, half));
  Stage fresh(40, 40);
  PrepareForMask(fresh, BrickEdge, image);
  SetMask(fresh.Mapper, MaskImage(options.Dimensions, [](auto, auto, auto k) { return k >= 22; }));
  EXPECT_TRUE(AreImagesIdentical(half, fresh.Draw()));
  std::fill(voxels, voxels + 40 * 36 * 44, static_cast<unsigned char>(0));
  mask->GetPointData()->GetScalars()->Modified();
  for (const float value : stage.Draw())
  {
    ASSERT_EQ(value, 0.0f);
  }
  // As in VTK a label mask without labels is none.
  stage.Mapper->SetMaskTypeToLabelMap();
  EXPECT_TRUE(AreImagesIdentical(all, stage.Draw()));
}

// What a lazy image holds as a pyramid is a mask level by level.
TEST(Masks, APyramid)
{
  ImageOptions options;
  options.Dimensions = { 96, 80, 112 };
  const InMask isIn = Sponge(options.Dimensions);
  const auto image = MakeImage(options);
  Stage stage(40, 40);
  PrepareForMask(stage, BrickEdge, image);
  stage.Mapper->SetMaximumLevel(0);
  const auto mask = MaskImage(options.Dimensions, isIn);
  SetMask(stage.Mapper, mask);
  const std::vector<float> ofImage = stage.Draw();
  vtkNew<vtkBrickSource> holder;
  holder->SetBrickSource(SourceOfImage(mask, BrickEdge, false));
  // The voxels of this image aren't read.
  const auto lazy = MaskImage({ 3, 3, 3 }, [](auto, auto, auto) { return false; });
  holder->Attach(lazy->GetPointData()->GetScalars());
  SetMask(stage.Mapper, lazy);
  EXPECT_TRUE(AreImagesIdentical(ofImage, stage.Draw()));
  EXPECT_GT(*std::max_element(ofImage.begin(), ofImage.end()), 0.1f);
}

TEST(Masks, WhatIsNoneIsAnErrorByName)
{
  const ImageOptions options;
  const auto tooSmall = MaskImage({ 40, 36, 43 }, [](auto, auto, auto) { return true; });
  const auto noScalars = vtkSmartPointer<vtkImageData>::New();
  const auto vectors = vtkSmartPointer<vtkImageData>::New();
  vectors->SetDimensions(options.Dimensions.data());
  vectors->AllocateScalars(VTK_UNSIGNED_CHAR, 2);
  const auto bits = vtkSmartPointer<vtkImageData>::New();
  bits->SetDimensions(options.Dimensions.data());
  bits->AllocateScalars(VTK_LONG_LONG, 1);
  const std::vector<std::pair<vtkImageData*, std::string>> cases = {
    { tooSmall, "40 x 36 x 43 voxels" },
    { noScalars, "no active scalars" },
    { vectors, "2 components" },
    { bits, "long long" },
  };
  for (const auto& one : cases)
  {
    Stage stage(40, 40);
    PrepareForMask(stage, BrickEdge, MakeImage(options));
    vtkNew<MessageRecorder> recorder;
    stage.Mapper->AddObserver(vtkCommand::ErrorEvent, recorder);
    SetMask(stage.Mapper, one.first);
    stage.DrawPicture();
    stage.DrawPicture();
    ASSERT_EQ(recorder->Messages.size(), 1u) << one.second;
    EXPECT_NE(recorder->Messages[0].find("MaskInput"), std::string::npos) << recorder->Messages[0];
    EXPECT_NE(recorder->Messages[0].find(one.second), std::string::npos) << recorder->Messages[0];
  }
}
