// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// UseClippedVoxelIntensity: gradients that find one given value where clipping planes cut away,
// against the reference integrator, VTK's own mapper and closed forms; the same bits with any
// atlas.
#include "BesideVTK.h"
#include "ComponentScene.h"
#include "EachWay.h"
#include "ExpectTruth.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <gtest/gtest.h>
#include <vtkContourValues.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPlane.h>
#include <vtkPointData.h>
#include <vtkRenderer.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr int BrickEdge = 16;
constexpr int Size = 32;

void FindBehindPlanes(Stage& stage, double value)
{
  stage.Property->UseClippedVoxelIntensityOn();
  stage.Property->SetClippedVoxelIntensity(value);
}

/// An image that is cut by two planes, neither along its faces.
struct CutImage
{
  explicit CutImage(const ImageOptions& options = {})
    : Image(MakeImage(options))
    , Source(SourceOfImage(Image, BrickEdge, false))
    , Shown(Size, Size)
  {
    this->Shown.Mapper->SetBrickSize(BrickEdge);
    this->Shown.SetImage(this->Image);
    this->Shown.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    this->Shown.Look({ 0.4, 1, -0.3 }, 0.8);
    Clip(this->Shown, { 18, 17, 22 }, { 1, -0.7, -0.5 });
    Clip(this->Shown, { 20, 12, 22 }, { 0.1, -1, 0.4 });
  }

  vtkSmartPointer<vtkImageData> Image;
  std::shared_ptr<BrickSource> Source;
  Stage Shown;
};

/// Draws with and without the value, and returns by how much the pictures differ at most.
double DifferenceMade(Stage& stage)
{
  const std::vector<float> with = stage.Draw();
  stage.Property->UseClippedVoxelIntensityOff();
  const std::vector<float> without = stage.Draw();
  stage.Property->UseClippedVoxelIntensityOn();
  double most = 0;
  for (std::size_t i = 0; i < with.size(); ++i)
  {
    most = std::max(most, std::abs(double{ with[i] } - double{ without[i] }));
  }
  return most;
}

} // namespace

TEST(ClippedGradient, IsThatOfTheTruth)
{
  CutImage cut;
  Stage& stage = cut.Shown;
  for (const double value : { 0.0, 180.0 })
  {
    FindBehindPlanes(stage, value);
    for (const bool nearest : { false, true })
    {
      stage.Property->SetInterpolationType(
        nearest ? VTK_NEAREST_INTERPOLATION : VTK_LINEAR_INTERPOLATION);
      const std::string way =
        (nearest ? ", nearest, " : ", linear, ") + std::to_string(static_cast<int>(value));
      stage.SetShade(true);
      ExpectTruth(stage, *cut.Source, "shaded" + way);
      EXPECT_GT(DifferenceMade(stage), 0.02) << way;
      stage.SetGradientOpacity({ { 0, 0 }, { 6, 0.2 }, { 30, 1 } });
      ExpectTruth(stage, *cut.Source, "shaded, gradient opacity" + way);
      stage.SetShade(false);
      ExpectTruth(stage, *cut.Source, "gradient opacity" + way);
      EXPECT_GT(DifferenceMade(stage), 0.02) << way;
      stage.SetGradientOpacity({});
    }
  }
}

TEST(ClippedGradient, OfTransferImages)
{
  CutImage cut;
  Stage& stage = cut.Shown;
  stage.SetTransferImage(8, 8,
    [](double x, double y) -> std::array<double, 4> {
      return { x, y, 1 - x, 0.6 * x * (0.3 + 0.7 * y) };
    });
  FindBehindPlanes(stage, 0);
  ExpectTruth(stage, *cut.Source, "transfer image");
  EXPECT_GT(DifferenceMade(stage), 0.02);
}

TEST(ClippedGradient, OfFloatsOfCoarseLevelsAndInAnyPlace)
{
  for (const int level : { 0, 1 })
  {
    ImageOptions options;
    options.Type = ScalarType::Float32;
    options.Spacing = { 1, 0.8, 1.3 };
    CutImage cut(options);
    Stage& stage = cut.Shown;
    stage.Mapper->SetMinimumLevel(level);
    stage.Mapper->SetMaximumLevel(level);
    stage.Volume->SetPosition(5, -3, 2);
    stage.Volume->RotateZ(10);
    stage.SetShade(true);
    stage.Look({ 0.4, 1, -0.3 }, 0.8);
    FindBehindPlanes(stage, 20);
    ExpectTruth(stage, *cut.Source, "floats of level " + std::to_string(level));
    EXPECT_GT(DifferenceMade(stage), 0.02);
  }
}

// VTK takes the value for that of a texture, before scale and bias: floats are as they are.
TEST(ClippedGradient, IsVTKs)
{
  ImageOptions options;
  options.Type = ScalarType::Float32;
  BesideVTK both(options, Size);
  Stage& stage = both.Shown;
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.Mapper->SetMaximumLevel(0);
  stage.SetShade(true);
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
  Clip(stage, { 18, 17, 22 }, { 1, -0.7, -0.5 });
  FindBehindPlanes(stage, 0);
  both.CopyCuts();
  both.Expect("one plane, shaded");
  if (const char* folder = std::getenv("TERAVOX_SAVE_PICTURES"))
  {
    both.Save(std::string(folder) + "/clipped-gradient.png");
  }
}

// Of a constant volume, whose bricks are none to load, only the cut has a normal: at a plane across
// an axis that of the plane, over one voxel.
TEST(ClippedGradient, LightsTheCutOfAConstantVolume)
{
  vtkNew<vtkImageData> image;
  image->SetDimensions(40, 40, 40);
  image->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
  image->GetPointData()->GetScalars()->Fill(100);
  Stage stage(Size, Size);
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.SetImage(image);
  TransferNodes nodes;
  nodes.Opacity = { { 0, 0.5 }, { 255, 0.5 } };
  nodes.Color = { { 0, 1, 1, 1 }, { 255, 1, 1, 1 } };
  stage.SetTransfer(nodes);
  stage.SetShade(true);
  stage.Property->SetAmbient(0.25);
  stage.Property->SetDiffuse(0.5);
  stage.Property->SetSpecular(0);
  stage.Mapper->SetMaximumLevel(0);
  stage.Look({ 1, 0, 0 }, 1, true);
  Clip(stage, { 10.3, 0, 0 }, { 1, 0, 0 });
  FindBehindPlanes(stage, 0);
  const std::vector<float> picture = stage.Draw();
  const std::size_t middle = 4 * (Size / 2 * Size + Size / 2);
  // The first voxel lets half of the light pass and is lit, all behind is ambient.
  const double behind = std::exp2(-(39 - 10.3));
  EXPECT_NEAR(picture[middle], 0.5 * 0.75 + (0.5 - behind) * 0.25, 1.0 / 255);
  stage.Property->UseClippedVoxelIntensityOff();
  EXPECT_NEAR(stage.Draw()[middle], (1 - behind) * 0.25, 1.0 / 255);
}

// VTK's default, which isn't a number in floats there, counts as far below all values.
TEST(ClippedGradient, OfTheDefaultValueIsFinite)
{
  CutImage cut;
  Stage& stage = cut.Shown;
  stage.SetShade(true);
  stage.Property->UseClippedVoxelIntensityOn();
  const std::vector<float> picture = stage.Draw();
  EXPECT_TRUE(std::all_of(
    picture.begin(), picture.end(), [](float v) { return std::isfinite(v) && v >= 0 && v <= 1; }));
  EXPECT_GT(DifferenceMade(stage), 0.02);
}

TEST(ClippedGradient, OfComponentsIsThatOfEach)
{
  // Two components with one value each are lit as one is.
  CutImage cut;
  Stage& one = cut.Shown;
  one.SetShade(true);
  FindBehindPlanes(one, 0);
  ImageOptions options;
  const auto image = MakeComponentImage(options, 2);
  for (vtkIdType i = 0; i < image->GetNumberOfPoints(); ++i)
  {
    const double v = cut.Image->GetPointData()->GetScalars()->GetTuple1(i);
    image->GetPointData()->GetScalars()->SetTuple2(i, v, v);
  }
  Stage two(Size, Size);
  two.Mapper->SetBrickSize(BrickEdge);
  two.SetImage(image);
  SetComponentTransfer(two, { OpacityShape::Ramp, OpacityShape::Ramp }, 0, 255, 1);
  two.SetShade(true);
  two.Look({ 0.4, 1, -0.3 }, 0.8);
  Clip(two, { 18, 17, 22 }, { 1, -0.7, -0.5 });
  Clip(two, { 20, 12, 22 }, { 0.1, -1, 0.4 });
  FindBehindPlanes(two, 0);
  EXPECT_GT(DifferenceMade(two), 0.02);
  // The second one counts for nothing: what is left is the first.
  two.Property->SetComponentWeight(1, 0);
  two.Property->SetColor(0, one.Color);
  two.Property->SetScalarOpacity(0, one.Opacity);
  const ImageDifference difference = CompareImages(one.Draw(), two.Draw());
  std::printf("  a component beside a volume of one: %.4f / 255\n", 255 * difference.Max);
  EXPECT_LT(255 * difference.Max, 2);
}

TEST(ClippedGradient, OfIsosurfacesAndSlices)
{
  CutImage cut;
  Stage& stage = cut.Shown;
  stage.SetShade(true);
  FindBehindPlanes(stage, 0);
  stage.Mapper->SetBlendModeToIsoSurface();
  stage.Property->GetIsoSurfaceValues()->SetValue(0, 120);
  EXPECT_GT(DifferenceMade(stage), 0.02);
  stage.Mapper->SetBlendModeToSlice();
  vtkNew<vtkPlane> slice;
  slice->SetOrigin(19, 18, 22);
  slice->SetNormal(1, -0.7, -0.5);
  stage.Property->SetSliceFunction(slice);
  EXPECT_GT(DifferenceMade(stage), 0.02);
}

TEST(ClippedGradient, SameBitsWithAnyAtlasAndWithoutSkipping)
{
  CutImage cut;
  Stage& stage = cut.Shown;
  FindBehindPlanes(stage, 0);
  ForEachWay(stage,
    [&](const std::string& way)
    {
      for (const bool gradient : { false, true })
      {
        stage.SetGradientOpacity(gradient
            ? std::vector<std::array<double, 2>>{ { 0, 0.1 }, { 20, 1 } }
            : std::vector<std::array<double, 2>>{});
        std::vector<float> reference;
        ExpectSamePicture(stage, reference, "large" + way);
        stage.Mapper->SetMaximumNumberOfSlots(5);
        const std::uint64_t loaded = ExpectSamePicture(stage, reference, "five slots" + way);
        EXPECT_GT(loaded, 5u);
        stage.Mapper->EmptySpaceSkippingOff();
        ExpectSamePicture(stage, reference, "without skipping" + way);
        stage.Mapper->EmptySpaceSkippingOn();
        stage.Mapper->SetMaximumNumberOfSlots(0);
      }
    });
}

// Neither without planes nor without gradients does it change a bit.
TEST(ClippedGradient, ChangesNothingElse)
{
  CutImage cut;
  Stage& stage = cut.Shown;
  FindBehindPlanes(stage, 0);
  EXPECT_EQ(DifferenceMade(stage), 0);
  stage.SetShade(true);
  stage.Mapper->RemoveAllClippingPlanes();
  EXPECT_EQ(DifferenceMade(stage), 0);
}
