// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// FinalColorWindow and FinalColorLevel, RenderToImage with its colour and depth image: against
// closed forms, the truth, and vtkGPUVolumeRayCastMapper on the same image.
#include "BesideVTK.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>
#include <limits>
#include <vtkActor.h>
#include <vtkCallbackCommand.h>
#include <vtkCamera.h>
#include <vtkCommand.h>
#include <vtkContourValues.h>
#include <vtkCubeSource.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkPlane.h>
#include <vtkPointData.h>
#include <vtkPolyDataMapper.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

// The scalars of an image, unscaled.
std::vector<double> ValuesOf(vtkImageData* image)
{
  vtkDataArray* scalars = image->GetPointData()->GetScalars();
  std::vector<double> values;
  for (vtkIdType i = 0; scalars && i < scalars->GetNumberOfTuples(); ++i)
  {
    for (int c = 0; c < scalars->GetNumberOfComponents(); ++c)
    {
      values.push_back(scalars->GetComponent(i, c));
    }
  }
  return values;
}

struct Images
{
  vtkNew<vtkImageData> Color;
  vtkNew<vtkImageData> Depth;
};

// Of one frame, by whatever mapper: all that is called is the base class's.
void DrawImages(Stage& stage, vtkGPUVolumeRayCastMapper* mapper, Images& images)
{
  mapper->RenderToImageOn();
  stage.DrawPictureWith(mapper);
  mapper->GetColorImage(images.Color);
  mapper->GetDepthImage(images.Depth);
}

// View depth of a depth of the buffer.
double ViewDepth(vtkCamera* camera, double depth)
{
  const double near = camera->GetClippingRange()[0];
  const double far = camera->GetClippingRange()[1];
  return camera->GetParallelProjection() ? near + depth * (far - near)
                                         : near * far / (far - depth * (far - near));
}

// View depth at which the truth's opacity passes a threshold; infinite if it doesn't.
double TrueDepth(const TruthScene& scene, int x, int y, double opacity, double from, double to)
{
  if (!(IntegratePixel(scene, x, y)[3] > opacity))
  {
    return std::numeric_limits<double>::infinity();
  }
  for (int i = 0; i < 40; ++i)
  {
    const double middle = 0.5 * (from + to);
    (IntegratePixel(scene, x, y, 0, 0, middle)[3] > opacity ? to : from) = middle;
  }
  return to;
}

} // namespace

// What reaches the window is the window and level of what was accumulated, blended once.
TEST(FinalColor, IsAppliedToTheFinalColour)
{
  Stage stage(48, 40);
  stage.SetImage(MakeImage({}));
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.Renderer->SetBackground(0.2, 0.4, 0.6);
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
  const std::vector<float> plain = stage.Draw();
  const std::array<std::array<float, 2>, 4> settings{ { { 1, 0.5f }, { 0.5f, 0.3f }, { -1, 0.5f },
    { 3, 0.9f } } };
  for (const auto& [window, level] : settings)
  {
    stage.Mapper->SetFinalColorWindow(window);
    stage.Mapper->SetFinalColorLevel(level);
    const std::vector<float> picture = WithoutAlpha(stage.DrawPicture());
    // The accumulators stay what they are, and are drawn once only.
    EXPECT_TRUE(AreImagesIdentical(plain, stage.Accumulator()));
    EXPECT_EQ(stage.Mapper->GetNumberOfPasses(), 0u) << window;
    std::vector<float> expected = plain;
    for (std::size_t i = 0; i < plain.size(); i += 4)
    {
      const std::array<float, 3> background{ 0.2f, 0.4f, 0.6f };
      const float alpha = plain[i + 3];
      for (std::size_t c = 0; c < 3; ++c)
      {
        const float wanted = (plain[i + c] - alpha * level) / window + 0.5f * alpha;
        expected[i + c] =
          std::min(std::clamp(wanted, 0.0f, 1.0f) + background[c] * (1 - alpha), 1.0f);
      }
      expected[i + 3] = 0;
    }
    // Eight bits: of the background, of the colour before it is blended, and of the sum.
    EXPECT_LE(CompareImages(picture, expected).Max, 1.51 / 255) << window << ", " << level;
  }
}

TEST(FinalColor, IsThatOfVTK)
{
  for (const int blend :
    { vtkVolumeMapper::COMPOSITE_BLEND, vtkVolumeMapper::MAXIMUM_INTENSITY_BLEND })
  {
    BesideVTK both({}, 48);
    both.Shown.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    both.Shown.Look({ 0.4, 1, -0.3 }, 0.8);
    both.Shown.Mapper->SetBlendMode(blend);
    both.Theirs->SetBlendMode(blend);
    const std::vector<float> plain = WithoutAlpha(both.Shown.DrawPicture());
    for (const auto& [window, level] :
      { std::array<float, 2>{ 0.6f, 0.4f }, std::array<float, 2>{ -1.0f, 0.5f } })
    {
      for (vtkGPUVolumeRayCastMapper* mapper :
        { static_cast<vtkGPUVolumeRayCastMapper*>(both.Theirs),
          static_cast<vtkGPUVolumeRayCastMapper*>(both.Shown.Mapper) })
      {
        mapper->SetFinalColorWindow(window);
        mapper->SetFinalColorLevel(level);
      }
      const std::vector<float> ours = WithoutAlpha(both.Shown.DrawPicture());
      const ImageDifference d =
        CompareImages(ours, WithoutAlpha(both.Shown.DrawPictureWith(both.Theirs)));
      EXPECT_GT(CompareImages(ours, plain).Max, 20.0 / 255) << "the window must show";
      // Differences (see TestRenderVTK.cxx) grow with the contrast.
      const double contrast = 1 / std::abs(static_cast<double>(window));
      EXPECT_LE(d.Mean, contrast / 255) << window << ", blend " << blend;
      EXPECT_LE(d.Percentile99, 6 * contrast / 255) << window << ", blend " << blend;
    }
  }
}

TEST(RenderToImage, ShowsNothingAndGivesTheColours)
{
  Stage stage(50, 44);
  // A ray for each pixel, as where depths are looked for.
  stage.Mapper->SetAutoAdjustSampleDistances(0);
  stage.SetImage(MakeImage({}));
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.Look({ 0.4, 1, -0.3 }, 1.3);
  const std::vector<float> plain = stage.Draw();
  const std::vector<float> shown = stage.DrawPicture();
  stage.Volume->SetVisibility(0);
  const std::vector<float> background = stage.DrawPicture();
  stage.Volume->SetVisibility(1);

  Images images;
  stage.Mapper->RenderToImageOn();
  EXPECT_TRUE(AreImagesIdentical(background, stage.DrawPicture()));
  EXPECT_TRUE(AreImagesIdentical(plain, stage.Accumulator())) << "looking for depths changes bits";
  stage.Mapper->GetColorImage(images.Color);
  ASSERT_EQ(images.Color->GetScalarType(), VTK_UNSIGNED_CHAR);
  ASSERT_EQ(images.Color->GetNumberOfScalarComponents(), 4);
  EXPECT_EQ(images.Color->GetDimensions()[0], 50);
  EXPECT_EQ(images.Color->GetDimensions()[1], 44);
  const std::vector<double> colors = ValuesOf(images.Color);
  int outside = 0;
  int clear = 0;
  for (std::size_t i = 0; i < plain.size(); i += 4)
  {
    const bool white =
      colors[i] == 255 && colors[i + 1] == 255 && colors[i + 2] == 255 && colors[i + 3] == 0;
    outside += white ? 1 : 0;
    clear += !white && plain[i + 3] == 0 ? 1 : 0;
    for (std::size_t c = 0; c < 4; ++c)
    {
      const double wanted = white && c < 3 ? 255 : 255 * static_cast<double>(plain[i + c]);
      ASSERT_NEAR(colors[i + c], wanted, 0.51) << "pixel " << i / 4;
    }
  }
  EXPECT_GT(outside, 100);
  EXPECT_GT(clear, 100);
  stage.Mapper->RenderToImageOff();
  EXPECT_TRUE(AreImagesIdentical(shown, stage.DrawPicture()));
}

// Depth where anything is seen first: between where the truth's opacity is a little less and a
// little more than what a float of transmittance resolves.
TEST(RenderToImage, DepthIsThatOfTheTruth)
{
  struct Case
  {
    const char* Name;
    OpacityShape Shape;
    bool Parallel;
    bool Nearest;
    double Tolerance;
  };
  for (const Case& c : { Case{ "ramp", OpacityShape::Ramp, false, false, 1.0 / 255 },
         Case{ "wall, parallel", OpacityShape::Wall, true, false, 1.0 / 255 },
         Case{ "box, nearest", OpacityShape::Box, false, true, 1.0 / 255 },
         Case{ "box, fixed steps", OpacityShape::Box, false, false, 0 } })
  {
    ImageOptions options;
    const auto image = MakeImage(options);
    Stage stage(40, 40);
    stage.Mapper->SetBrickSize(16);
    stage.Mapper->SetImageErrorTolerance(c.Tolerance);
    stage.Mapper->SetSampleDistance(0.02f);
    stage.Mapper->WarnOfSamplingOff();
    stage.SetImage(image);
    stage.SetTransfer(MakeTransfer(c.Shape));
    c.Nearest ? stage.Property->SetInterpolationTypeToNearest()
              : stage.Property->SetInterpolationTypeToLinear();
    stage.Look({ 0.4, 1, -0.3 }, 0.8, c.Parallel);
    Images images;
    DrawImages(stage, stage.Mapper, images);
    ASSERT_TRUE(stage.Mapper->IsConverged());
    const std::vector<double> depths = ValuesOf(images.Depth);
    const auto source = SourceOfImage(image, 16, false);
    const StageTruth truth(stage, *source);
    vtkCamera* camera = stage.Renderer->GetActiveCamera();
    const double* range = camera->GetClippingRange();
    int hits = 0;
    int wrong = 0;
    double worst = 0;
    for (int y = 1; y < 40; y += 3)
    {
      for (int x = 0; x < 40; x += 3)
      {
        const double depth = depths[static_cast<std::size_t>(y * 40 + x)];
        const double early = TrueDepth(truth.Scene(), x, y, 1e-8, range[0], range[1]);
        const double late = TrueDepth(truth.Scene(), x, y, 4e-7, range[0], range[1]);
        if (depth >= 1)
        {
          wrong += std::isfinite(late) ? 1 : 0;
          continue;
        }
        ++hits;
        const double view = ViewDepth(camera, depth);
        const double excess = std::max(early - view, view - late);
        worst = std::max(worst, excess);
      }
    }
    // A ten-thousandth of a brick's diagonal, the depth's float, and where steps are given half of
    // one; rays at a thin edge may miss it, or meet it, because their positions are floats.
    const double allowed = c.Tolerance > 0 ? 0.02 : 0.04;
    std::printf("  %s: %d hits, worst %.4f voxels off, %d misses\n", c.Name, hits, worst, wrong);
    EXPECT_GT(hits, 50) << c.Name;
    EXPECT_LE(worst, allowed) << c.Name;
    EXPECT_EQ(wrong, 0) << c.Name;
  }
}

// The same picture and depth from VTK's mapper, which looks at samples a tenth of a voxel apart.
TEST(RenderToImage, IsThatOfVTK)
{
  for (const int blend : { vtkVolumeMapper::COMPOSITE_BLEND, vtkVolumeMapper::ISOSURFACE_BLEND,
         vtkVolumeMapper::MAXIMUM_INTENSITY_BLEND, vtkVolumeMapper::AVERAGE_INTENSITY_BLEND })
  {
    ImageOptions options;
    // Of points VTK 9.1 counts the depth of texture coordinates, up to half a voxel off.
    options.CellData = true;
    BesideVTK both(options, 64);
    both.Shown.SetTransfer(MakeTransfer(OpacityShape::Box));
    both.Shown.Look({ 0.4, 1, -0.3 }, 1.2);
    both.Shown.Mapper->SetBlendMode(blend);
    both.Theirs->SetBlendMode(blend);
    both.Shown.Property->GetIsoSurfaceValues()->SetValue(0, 120);
    // Opaque geometry cuts the volume in two.
    vtkNew<vtkCubeSource> cube;
    cube->SetBounds(-50, 90, -50, 90, 20, 21);
    vtkNew<vtkPolyDataMapper> cubeMapper;
    cubeMapper->SetInputConnection(cube->GetOutputPort());
    vtkNew<vtkActor> actor;
    actor->SetMapper(cubeMapper);
    both.Shown.Renderer->AddActor(actor);
    Images ours;
    Images theirs;
    DrawImages(both.Shown, both.Shown.Mapper, ours);
    DrawImages(both.Shown, both.Theirs, theirs);
    for (int a = 0; a < 3; ++a)
    {
      EXPECT_EQ(ours.Color->GetDimensions()[a], theirs.Color->GetDimensions()[a]);
      EXPECT_EQ(ours.Depth->GetDimensions()[a], theirs.Depth->GetDimensions()[a]);
      EXPECT_EQ(ours.Depth->GetSpacing()[a], theirs.Depth->GetSpacing()[a]);
    }
    EXPECT_EQ(ours.Color->GetScalarType(), theirs.Color->GetScalarType());
    EXPECT_EQ(ours.Depth->GetScalarType(), theirs.Depth->GetScalarType());
    const std::vector<double> ourColors = ValuesOf(ours.Color);
    const std::vector<double> theirColors = ValuesOf(theirs.Color);
    const std::vector<double> ourDepths = ValuesOf(ours.Depth);
    const std::vector<double> theirDepths = ValuesOf(theirs.Depth);
    ASSERT_EQ(ourDepths.size(), theirDepths.size());
    double sum = 0;
    int seen = 0;
    int seenByOne = 0;
    int far = 0;
    vtkCamera* camera = both.Shown.Renderer->GetActiveCamera();
    for (std::size_t i = 0; i < ourDepths.size(); ++i)
    {
      for (std::size_t c = 0; c < 4; ++c)
      {
        sum += std::abs(ourColors[4 * i + c] - theirColors[4 * i + c]);
      }
      seenByOne += (ourDepths[i] < 1) != (theirDepths[i] < 1) ? 1 : 0;
      if (ourDepths[i] < 1 && theirDepths[i] < 1)
      {
        ++seen;
        // VTK is up to a sample late; where it is earlier, its table of 1024 entries rounds.
        const double late = ViewDepth(camera, theirDepths[i]) - ViewDepth(camera, ourDepths[i]);
        far += late < -0.1 || late > 0.3 ? 1 : 0;
      }
    }
    std::printf("  blend %d: colours differ by %.3f, %d depths, %d seen by one only, %d far off\n",
      blend, sum / static_cast<double>(ourColors.size()), seen, seenByOne, far);
    EXPECT_LE(sum / static_cast<double>(ourColors.size()), 1.5) << blend;
    if (blend == vtkVolumeMapper::COMPOSITE_BLEND || blend == vtkVolumeMapper::ISOSURFACE_BLEND)
    {
      EXPECT_GT(seen, 200) << blend;
      // Rays that graze what is visible.
      EXPECT_LE(seenByOne, seen / 25) << blend;
      EXPECT_LE(far, seen / 50) << blend;
    }
    else
    {
      EXPECT_EQ(seen + seenByOne, 0) << blend;
    }
  }
}

TEST(RenderToImage, BackfaceAndScalarTypes)
{
  Stage stage(40, 36);
  ImageOptions options;
  stage.SetImage(MakeImage(options));
  stage.SetTransfer(MakeTransfer(OpacityShape::Box));
  stage.LookFrom({ 19.5, 17.5, 90 }, { 19.5, 17.5, 0 }, 20, 200);
  Images images;
  DrawImages(stage, stage.Mapper, images);
  const std::vector<double> open = ValuesOf(images.Depth);
  stage.Mapper->ClampDepthToBackfaceOn();
  DrawImages(stage, stage.Mapper, images);
  const std::vector<double> clamped = ValuesOf(images.Depth);
  // The camera looks straight down: rays in the middle leave through the face z = 0.
  vtkCamera* camera = stage.Renderer->GetActiveCamera();
  int middle = 0;
  for (std::size_t i = 0; i < open.size(); ++i)
  {
    if (open[i] < 1)
    {
      EXPECT_EQ(open[i], clamped[i]);
    }
    else if (clamped[i] < 1)
    {
      const double z = 90 - ViewDepth(camera, clamped[i]);
      EXPECT_GT(z, -1e-3);
      EXPECT_LT(z, 43.0);
      middle += std::abs(z) < 1e-3 ? 1 : 0;
    }
  }
  EXPECT_GT(middle, 40);
  stage.Mapper->SetDepthImageScalarTypeToUnsignedShort();
  stage.Mapper->GetDepthImage(images.Depth);
  ASSERT_EQ(images.Depth->GetScalarType(), VTK_UNSIGNED_SHORT);
  std::vector<double> coarse = ValuesOf(images.Depth);
  stage.Mapper->SetDepthImageScalarTypeToUnsignedChar();
  stage.Mapper->GetDepthImage(images.Depth);
  ASSERT_EQ(images.Depth->GetScalarType(), VTK_UNSIGNED_CHAR);
  const std::vector<double> coarsest = ValuesOf(images.Depth);
  for (std::size_t i = 0; i < open.size(); ++i)
  {
    ASSERT_NEAR(coarse[i] / 65535, clamped[i], 0.51 / 65535);
    ASSERT_NEAR(coarsest[i] / 255, clamped[i], 0.51 / 255);
  }
}

// Depths are a part of the picture: the same for any atlas, arrival and skipping.
TEST(RenderToImage, SameBitsAtAnyBudget)
{
  for (const int blend : { vtkVolumeMapper::COMPOSITE_BLEND, vtkVolumeMapper::ISOSURFACE_BLEND,
         vtkVolumeMapper::SLICE_BLEND })
  {
    std::vector<double> reference;
    for (int run = 0; run < 4; ++run)
    {
      Stage stage(48, 48);
      stage.Mapper->SetBrickSize(8);
      stage.Mapper->SetMaximumNumberOfSlots(run == 1 ? 2 : run == 2 ? 12 : 0);
      stage.Mapper->SetArrivalShuffleSeed(run == 2 ? 7 : 0);
      stage.Mapper->SetEmptySpaceSkipping(run == 3 ? 0 : 1);
      stage.Mapper->SetBlendMode(blend);
      stage.SetImage(MakeImage({}));
      stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
      stage.Property->GetIsoSurfaceValues()->SetValue(0, 100);
      stage.Property->GetIsoSurfaceValues()->SetValue(1, 160);
      vtkNew<vtkPlane> plane;
      plane->SetOrigin(20, 18, 22);
      plane->SetNormal(0.3, 1, 0.1);
      stage.Property->SetSliceFunction(plane);
      stage.Look({ 0.4, 1, -0.3 }, 0.8);
      Images images;
      DrawImages(stage, stage.Mapper, images);
      ASSERT_TRUE(stage.Mapper->IsConverged());
      const std::vector<double> depths = ValuesOf(images.Depth);
      EXPECT_GT(std::count_if(depths.begin(), depths.end(), [](double d) { return d < 1; }), 200);
      reference = run == 0 ? depths : reference;
      EXPECT_EQ(depths, reference) << "blend " << blend << ", run " << run;
    }
  }
}

TEST(RenderToImage, WithoutAFrameWarns)
{
  Stage stage(16, 16);
  stage.SetImage(MakeImage({}));
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
  stage.DrawPicture();
  vtkNew<vtkCallbackCommand> counter;
  int warnings = 0;
  counter->SetClientData(&warnings);
  counter->SetCallback(
    [](vtkObject*, unsigned long, void* count, void*) { ++*static_cast<int*>(count); });
  stage.Mapper->AddObserver(vtkCommand::WarningEvent, counter);
  Images images;
  stage.Mapper->GetColorImage(images.Color);
  stage.Mapper->GetDepthImage(images.Depth);
  EXPECT_EQ(warnings, 2);
  EXPECT_EQ(images.Color->GetNumberOfPoints(), 0);
  DrawImages(stage, stage.Mapper, images);
  EXPECT_EQ(warnings, 2);
  EXPECT_EQ(images.Color->GetNumberOfPoints(), 256);
}
