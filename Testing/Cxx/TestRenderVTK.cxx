// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Against vtkGPUVolumeRayCastMapper on the same image, property and camera: sample distance 0.1
// voxel, no automatic adjustment, no jitter, 8-bit data given to it as 16-bit (software drivers
// filter 8-bit textures with 8-bit weights). Mean difference at most 1/255, maximum at most 6/255
// beyond the envelope of nine of its pictures, shifted by up to 1/32 pixel.
//
// Not compared here but with the truth (TestRenderTruth.cxx): shading under a direction matrix,
// where VTK 9.1 doesn't turn the normals, and left-handed matrices, where it draws nothing.
#include "BesideVTK.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>
#include <vtkCamera.h>
#include <vtkImageData.h>
#include <vtkOpenGLGPUVolumeRayCastMapper.h>
#include <vtkRenderer.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

ImageOptions OptionsOf(ScalarType type)
{
  ImageOptions options;
  options.Type = type;
  // VTK stores 32 and 64 bits as float: ranges that a float resolves.
  switch (type)
  {
    case ScalarType::Int8:
      options.Low = -128;
      options.High = 127;
      break;
    case ScalarType::UInt16:
      options.High = 65000;
      break;
    case ScalarType::Int16:
      options.Low = -1000;
      options.High = 3000;
      break;
    case ScalarType::UInt32:
      options.High = 200000;
      break;
    case ScalarType::Int32:
      options.Low = -100000;
      options.High = 100000;
      break;
    case ScalarType::Float32:
      options.Low = -0.5;
      options.High = 2;
      break;
    case ScalarType::Float64:
      options.Low = 10;
      options.High = 12;
      break;
    default:
      break;
  }
  return options;
}

} // namespace

class AgainstVTK : public testing::TestWithParam<ScalarType>
{
};

TEST_P(AgainstVTK, PointsAndCellsShadedAndNot)
{
  for (const bool shade : { false, true })
  {
    for (const bool cells : { false, true })
    {
      if (shade != cells && GetParam() != ScalarType::UInt8)
      {
        continue; // each way once; all of them in TruthOfTypes
      }
      ImageOptions options = OptionsOf(GetParam());
      options.CellData = cells;
      BesideVTK comparison(options, 48);
      comparison.Shown.SetTransfer(MakeTransfer(OpacityShape::Ramp, options.Low, options.High));
      comparison.Shown.SetShade(shade);
      const std::string name = std::string(ToString(GetParam())) +
        (cells ? ", cells" : ", points") + (shade ? ", shaded" : ", unshaded");
      comparison.Shown.Look({ 0.4, 1, -0.3 }, 0.8);
      comparison.Expect(name + ", perspective");
      comparison.Shown.Look({ -1, 0.3, 0.3 }, 0.8, true);
      comparison.Expect(name + ", parallel");
    }
  }
}

INSTANTIATE_TEST_SUITE_P(AllTypes, AgainstVTK, testing::ValuesIn(AllScalarTypes),
  [](const auto& test) { return std::string(ToString(test.param)); });

TEST(AgainstVTKGeometry, StretchedRotatedInside)
{
  for (const bool shade : { false, true })
  {
    ImageOptions stretched;
    stretched.Dimensions = { 40, 44, 12 };
    stretched.Spacing = { 1, 1, 5 };
    BesideVTK first(stretched, 48);
    first.Shown.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    first.Shown.SetShade(shade);
    first.Shown.Look({ 0.4, 1, -0.3 }, 0.8);
    first.Expect(std::string("1:1:5") + (shade ? ", shaded" : ", unshaded"));

    BesideVTK inside({}, 48);
    inside.Shown.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    inside.Shown.SetShade(shade);
    inside.Shown.LookFrom({ 14, 15, 16 }, { 30, 22, 25 }, 0.1, 100, 60);
    inside.Expect(std::string("camera inside") + (shade ? ", shaded" : ", unshaded"));

    if (!shade)
    {
      ImageOptions rotated;
      const double c = std::cos(0.6);
      const double s = std::sin(0.6);
      rotated.Direction = { c, -s, 0, s, c, 0, 0, 0, 1 };
      rotated.ExtentStart = { -7, 5, 11 };
      BesideVTK turned(rotated, 48);
      turned.Shown.SetTransfer(MakeTransfer(OpacityShape::Ramp));
      turned.Shown.Look({ 0.4, 1, -0.3 }, 0.8);
      turned.Expect("rotated direction matrix, unshaded");
    }
  }
}

TEST(AgainstVTKBrain, OutsideShadedAndNot)
{
  const auto brain = LoadBrain(3, { 96, 80, 100 });
  if (!brain)
  {
    GTEST_SKIP() << "the brain scan of Debian's package mricron-data isn't installed";
  }
  const auto wide = WithWideScalars(brain);
  for (const bool shade : { false, true })
  {
    Stage stage(64, 64);
    stage.Mapper->SetBrickSize(32);
    stage.Mapper->SetMaximumLevel(0); // VTK has no other level
    stage.SetImage(brain);
    stage.SetTransfer(BrainTransfer());
    stage.SetShade(shade);
    stage.Look({ 0.4, 1, -0.3 }, 0.9);
    const std::vector<float> ours = WithoutAlpha(stage.Draw());
    vtkNew<vtkOpenGLGPUVolumeRayCastMapper> vtk;
    vtk->SetInputData(wide);
    vtk->SetAutoAdjustSampleDistances(0);
    vtk->SetSampleDistance(0.1f);
    const ImageDifference plain = CompareImages(ours, WithoutAlpha(stage.DrawPictureWith(vtk)));
    std::printf("  brain, %s: mean %.3f/255, p99 %.2f/255, plain max %.2f/255\n",
      shade ? "shaded" : "unshaded", 255 * plain.Mean, 255 * plain.Percentile99, 255 * plain.Max);
    EXPECT_LE(plain.Mean, 1.0 / 255);
  }
}
