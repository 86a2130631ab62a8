// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// More than one volume in one window: viewports, eyes, render passes, several props. A viewport
// shows what a window of its size shows, bit by bit; the rest beside VTK's mapper.
#include "BesideVTK.h"
#include "ExpectTruth.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <gtest/gtest.h>
#include <string>
#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkCubeSource.h>
#include <vtkGaussianBlurPass.h>
#include <vtkImageData.h>
#include <vtkOpenGLFXAAPass.h>
#include <vtkOpenGLRenderer.h>
#include <vtkPlane.h>
#include <vtkPolyDataMapper.h>
#include <vtkRenderStepsPass.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkSSAAPass.h>
#include <vtkSmartPointer.h>
#include <vtkSobelGradientMagnitudePass.h>
#include <vtkTransform.h>
#include <vtkUnsignedCharArray.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

vtkSmartPointer<vtkActor> Plate(double low, double high)
{
  vtkNew<vtkCubeSource> cube;
  cube->SetBounds(low, high, -60, 100, -60, 100);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputConnection(cube->GetOutputPort());
  auto actor = vtkSmartPointer<vtkActor>::New();
  actor->SetMapper(mapper);
  return actor;
}

// The part of a window from (x, y) on.
std::vector<float> Part(vtkRenderWindow* window, int x, int y, int width, int height)
{
  vtkNew<vtkUnsignedCharArray> pixels;
  window->GetRGBACharPixelData(x, y, x + width - 1, y + height - 1, 0, pixels);
  std::vector<float> picture;
  for (vtkIdType i = 0; i < pixels->GetNumberOfValues(); ++i)
  {
    picture.push_back(static_cast<float>(pixels->GetValue(i)) / 255.0f);
  }
  return picture;
}

void Furnish(Stage& stage, vtkImageData* image)
{
  stage.Mapper->SetBrickSize(16);
  stage.SetImage(image);
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
}

// Both pictures of the window that the stage is shown in, and how far they are apart.
ImageDifference Compare(BesideVTK& both, int width, int height)
{
  std::array<std::vector<float>, 2> pictures;
  for (std::size_t i = 0; i < 2; ++i)
  {
    both.Shown.Volume->SetMapper(i == 0 ? static_cast<vtkVolumeMapper*>(both.Shown.Mapper)
                                        : static_cast<vtkVolumeMapper*>(both.Theirs));
    // VTK's mapper draws the first frame of two eyes, or of a pass, otherwise than those after it.
    both.Shown.Window->Render();
    both.Shown.Window->Render();
    pictures[i] = WithoutAlpha(Part(both.Shown.Window, 0, 0, width, height));
  }
  both.Shown.Volume->SetMapper(both.Shown.Mapper);
  // There has to be something to be compared.
  const auto bright =
    std::count_if(pictures[0].begin(), pictures[0].end(), [](float c) { return c > 0.04f; });
  EXPECT_GT(bright, width * height / 20);
  return CompareImages(pictures[0], pictures[1]);
}

} // namespace

// Four viewports of one window, one mapper in two of them: each is what a window of its own shows,
// bit by bit. Then each cut by geometry at another place. (A regression of VTK's history: depth
// that is read from another viewport.)
class Viewports : public testing::TestWithParam<bool>
{
};

TEST_P(Viewports, AreWindowsOfTheirOwn)
{
  const bool plates = GetParam();
  constexpr int width = 44;
  constexpr int height = 36;
  const auto image = MakeImage({});
  const std::array<std::array<double, 3>, 4> directions{ { { 0.4, 1, -0.3 }, { -1, 0.3, 0.3 },
    { 0.1, -1, 0.5 }, { 0.2, 0.3, -1 } } };
  // Each alone.
  std::vector<std::vector<float>> accumulators;
  std::vector<std::vector<float>> pictures;
  for (std::size_t i = 0; i < 4; ++i)
  {
    Stage stage(width, height);
    Furnish(stage, image);
    stage.Look(directions[i], 0.8);
    stage.Renderer->SetBackground(0.1 * static_cast<double>(i), 0.2, 0.3);
    const double x = 8.0 * static_cast<double>(i) + 5;
    if (plates)
    {
      stage.Renderer->AddActor(Plate(x, x + 1));
    }
    accumulators.push_back(stage.Draw());
    pictures.push_back(Part(stage.Window, 0, 0, width, height));
  }
  EXPECT_GT(CompareImages(accumulators[0], accumulators[3]).Max, 0.2);

  // All in one window. The volumes of the first two share a mapper.
  Stage first(2 * width, 2 * height);
  Stage third(8, 8);
  Stage fourth(8, 8);
  for (Stage* stage : { &first, &third, &fourth })
  {
    Furnish(*stage, image);
  }
  first.Window->RemoveRenderer(first.Renderer);
  const std::array<vtkVolume*, 4> volumes{ first.Volume, first.Volume, third.Volume,
    fourth.Volume };
  std::vector<vtkSmartPointer<vtkRenderer>> renderers;
  for (std::size_t i = 0; i < 4; ++i)
  {
    renderers.push_back(vtkSmartPointer<vtkRenderer>::New());
    vtkRenderer* renderer = renderers[i];
    const double left = i % 2 == 0 ? 0 : 0.5;
    const double bottom = i < 2 ? 0 : 0.5;
    renderer->SetViewport(left, bottom, left + 0.5, bottom + 0.5);
    renderer->SetBackground(0.1 * static_cast<double>(i), 0.2, 0.3);
    const double x = 8.0 * static_cast<double>(i) + 5;
    if (plates)
    {
      renderer->AddActor(Plate(x, x + 1));
    }
    renderer->AddVolume(volumes[i]);
    first.Look(directions[i], 0.8);
    renderer->GetActiveCamera()->DeepCopy(first.Renderer->GetActiveCamera());
    first.Window->AddRenderer(renderer);
  }
  // The driver computes the depth of the same geometry from other coordinates there: its last bit
  // may be another one, and with it the end of a ray.
  const double least = plates ? 1e-3 : 0;
  for (int frame = 0; frame < 3; ++frame)
  {
    first.Window->Render();
    for (int i = 0; i < 4; ++i)
    {
      const std::size_t at = static_cast<std::size_t>(i);
      const std::vector<float> part =
        Part(first.Window, i % 2 * width, i / 2 * height, width, height);
      EXPECT_LE(CompareImages(part, pictures[at]).Max, plates ? 1.01 / 255 : 0.0)
        << "viewport " << i << ", frame " << frame;
    }
    EXPECT_LE(CompareImages(first.Accumulator(), accumulators[1]).Max, least);
    EXPECT_TRUE(plates || AreImagesIdentical(first.Accumulator(), accumulators[1]));
    EXPECT_LE(CompareImages(third.Accumulator(), accumulators[2]).Max, least);
    EXPECT_TRUE(plates || AreImagesIdentical(third.Accumulator(), accumulators[2]));
    EXPECT_LE(CompareImages(fourth.Accumulator(), accumulators[3]).Max, least);
    EXPECT_TRUE(plates || AreImagesIdentical(fourth.Accumulator(), accumulators[3]));
    // Each viewport has a state of its own: nothing is drawn twice.
    EXPECT_EQ(first.Mapper->GetNumberOfPasses() > 0, frame == 0);
    EXPECT_EQ(fourth.Mapper->GetNumberOfPasses() > 0, frame == 0);
  }
  EXPECT_EQ(first.Mapper->CheckInvariants(), "");
  EXPECT_LE(first.Mapper->GetPeakGPUMemoryUsed(), first.Mapper->GetEffectiveGPUMemoryBudget());
  // What was picked in a viewport.
  EXPECT_TRUE(first.Mapper->Pick(renderers[1], width + width / 2 + 0.5, height / 2, 0.05));
  EXPECT_FALSE(first.Mapper->Pick(renderers[0], width + width / 2 + 0.5, height / 2, 0.05));
}

INSTANTIATE_TEST_SUITE_P(Scene, Viewports, testing::Bool(),
  [](const auto& test) { return std::string(test.param ? "Geometry" : "VolumesOnly"); });

// Rays and feedback of all viewports count against the one budget of their mapper.
TEST(Scene, ViewportsShareABudget)
{
  ImageOptions options;
  options.Dimensions = { 96, 96, 96 };
  Stage stage(120, 120);
  Furnish(stage, MakeImage(options));
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
  constexpr std::uint64_t budget = std::uint64_t{ 7 } << 19;
  stage.Mapper->SetGPUMemoryBudget(budget);
  stage.Window->RemoveRenderer(stage.Renderer);
  for (int i = 0; i < 9; ++i)
  {
    vtkNew<vtkRenderer> renderer;
    const double left = i % 3 / 3.0;
    const double bottom = i / 3 / 3.0;
    renderer->SetViewport(left, bottom, left + 1 / 3.0, bottom + 1 / 3.0);
    renderer->AddVolume(stage.Volume);
    renderer->GetActiveCamera()->DeepCopy(stage.Renderer->GetActiveCamera());
    renderer->GetActiveCamera()->Azimuth(40 * i);
    stage.Window->AddRenderer(renderer);
  }
  for (int frame = 0; frame < 2; ++frame)
  {
    stage.Window->Render();
    EXPECT_TRUE(stage.Mapper->IsConverged());
    EXPECT_LE(stage.Mapper->GetPeakGPUMemoryUsed(), budget);
    EXPECT_EQ(stage.Mapper->CheckInvariants(), "");
  }
  EXPECT_GT(stage.Mapper->GetPeakGPUMemoryUsed(), budget / 2) << "the budget has to matter";
}

TEST(Scene, ViewportsBesideVTK)
{
  BesideVTK both({}, 64);
  Furnish(both.Shown, both.Image);
  both.Shown.Renderer->SetViewport(0.5, 0, 1, 1);
  both.Shown.Renderer->AddActor(Plate(18, 19));
  vtkNew<vtkRenderer> other;
  other->SetViewport(0, 0, 0.5, 1);
  other->SetBackground(0.3, 0.1, 0);
  other->AddActor(Plate(2, 3));
  other->AddVolume(both.Shown.Volume);
  other->GetActiveCamera()->DeepCopy(both.Shown.Renderer->GetActiveCamera());
  other->GetActiveCamera()->Azimuth(40);
  both.Shown.Window->AddRenderer(other);
  EXPECT_LE(Compare(both, 64, 64).Mean, 1.0 / 255);
}

// A renderer in a second layer draws over the first one's colours and has a depth of its own.
TEST(Scene, LayersBesideVTK)
{
  BesideVTK both({}, 64);
  Furnish(both.Shown, both.Image);
  both.Shown.Window->SetNumberOfLayers(2);
  both.Shown.Renderer->SetLayer(1);
  vtkNew<vtkRenderer> below;
  below->SetBackground(0.3, 0.1, 0);
  below->AddActor(Plate(2, 3));
  below->GetActiveCamera()->DeepCopy(both.Shown.Renderer->GetActiveCamera());
  both.Shown.Window->AddRenderer(below);
  EXPECT_LE(Compare(both, 64, 64).Mean, 1.0 / 255);
}

// Each eye against the truth, and all kinds of stereo beside VTK's mapper, which takes rays from
// between the eyes.
TEST(Scene, StereoIsTrueAndBesideVTK)
{
  for (const int type :
    { VTK_STEREO_LEFT, VTK_STEREO_RIGHT, VTK_STEREO_RED_BLUE, VTK_STEREO_ANAGLYPH,
      VTK_STEREO_INTERLACED, VTK_STEREO_SPLITVIEWPORT_HORIZONTAL, VTK_STEREO_CHECKERBOARD })
  {
    BesideVTK both({}, 64);
    Furnish(both.Shown, both.Image);
    both.Shown.Renderer->GetActiveCamera()->SetEyeAngle(4);
    both.Shown.Window->Render();
    const std::vector<float> mono = Part(both.Shown.Window, 0, 0, 64, 64);
    both.Shown.Window->SetStereoType(type);
    both.Shown.Window->StereoRenderOn();
    if (type == VTK_STEREO_LEFT || type == VTK_STEREO_RIGHT)
    {
      // The camera has the eye's matrices after a frame.
      both.Shown.Draw();
      ExpectTruth(both.Shown, *SourceOfImage(both.Image, 16, false),
        type == VTK_STEREO_LEFT ? "left eye" : "right eye");
    }
    both.Shown.Renderer->AddActor(Plate(18, 19));
    const ImageDifference d = Compare(both, 64, 64);
    std::printf("  %s: mean %.3f/255\n", both.Shown.Window->GetStereoTypeAsString(), 255 * d.Mean);
    EXPECT_LE(d.Mean, 1.5 / 255) << both.Shown.Window->GetStereoTypeAsString();
    both.Shown.Window->Render();
    both.Shown.Window->Render();
    const std::vector<float> stereo = Part(both.Shown.Window, 0, 0, 64, 64);
    EXPECT_GT(CompareImages(mono, stereo).Mean, 1.5 / 255) << "the eyes have to differ";
  }
}

// Both eyes' pictures stay: a frame of an unchanged scene draws nothing.
TEST(Scene, EachEyeKeepsItsPicture)
{
  Stage stage(48, 48);
  Furnish(stage, MakeImage({}));
  stage.Window->SetStereoType(VTK_STEREO_SPLITVIEWPORT_HORIZONTAL);
  stage.Window->StereoRenderOn();
  stage.Window->Render();
  EXPECT_GT(stage.Mapper->GetNumberOfPasses(), 0u);
  const std::vector<float> right = stage.Accumulator();
  stage.Window->Render();
  EXPECT_EQ(stage.Mapper->GetNumberOfPasses(), 0u);
  EXPECT_TRUE(AreImagesIdentical(right, stage.Accumulator()));
  stage.Window->SetStereoTypeToLeft();
  const std::vector<float> left = stage.Draw();
  EXPECT_EQ(stage.Mapper->GetNumberOfPasses(), 0u);
  EXPECT_GT(CompareImages(left, right).Mean, 0.3 / 255);
}

namespace
{
vtkSmartPointer<vtkRenderPass> MakePass(const std::string& name)
{
  vtkNew<vtkRenderStepsPass> steps;
  if (name == "steps")
  {
    return steps.Get();
  }
  if (name == "SSAA")
  {
    vtkNew<vtkSSAAPass> supersampling;
    supersampling->SetDelegatePass(steps);
    return supersampling.Get();
  }
  vtkSmartPointer<vtkImageProcessingPass> filter;
  if (name == "blur")
  {
    filter = vtkSmartPointer<vtkGaussianBlurPass>::New();
  }
  else if (name == "FXAA")
  {
    filter = vtkSmartPointer<vtkOpenGLFXAAPass>::New();
  }
  else
  {
    filter = vtkSmartPointer<vtkSobelGradientMagnitudePass>::New();
  }
  filter->SetDelegatePass(steps);
  return filter;
}

// Binomial, five pixels wide, as vtkGaussianBlurPass.
std::vector<float> Blurred(const std::vector<float>& picture, int width, int height)
{
  const std::array<float, 5> weights{ 1 / 16.0f, 4 / 16.0f, 6 / 16.0f, 4 / 16.0f, 1 / 16.0f };
  std::vector<float> result(picture.size(), 0.0f);
  for (int y = 0; y < height; ++y)
  {
    for (int x = 0; x < width; ++x)
    {
      for (int k = 0; k < 25; ++k)
      {
        const int i = std::clamp(x + k % 5 - 2, 0, width - 1);
        const int j = std::clamp(y + k / 5 - 2, 0, height - 1);
        const float weight =
          weights[static_cast<std::size_t>(k % 5)] * weights[static_cast<std::size_t>(k / 5)];
        for (std::size_t c = 0; c < 3; ++c)
        {
          result[static_cast<std::size_t>(4 * (y * width + x)) + c] +=
            weight * picture[static_cast<std::size_t>(4 * (j * width + i)) + c];
        }
      }
    }
  }
  return result;
}
} // namespace

// Pipelines of render passes that draw into frame buffers of the window's size; VTK's mapper reads
// depth at other pixels where they are larger.
TEST(Scene, RenderPassesBesideVTK)
{
  for (const std::string name : { "steps", "FXAA" })
  {
    BesideVTK both({}, 64);
    Furnish(both.Shown, both.Image);
    both.Shown.Window->Render();
    const auto pass = MakePass(name);
    vtkOpenGLRenderer::SafeDownCast(both.Shown.Renderer)->SetPass(pass);
    const ImageDifference d = Compare(both, 64, 64);
    std::printf(
      "  %s: mean %.3f/255, p99 %.2f/255\n", name.c_str(), 255 * d.Mean, 255 * d.Percentile99);
    EXPECT_LE(d.Mean, 1.0 / 255) << name;
    vtkOpenGLRenderer::SafeDownCast(both.Shown.Renderer)->SetPass(nullptr);
    pass->ReleaseGraphicsResources(both.Shown.Window);
  }
}

// What passes make of the picture without them, also those with larger frame buffers.
class Passes : public testing::TestWithParam<bool>
{
};

TEST_P(Passes, GetThePicture)
{
  Stage stage(64, 64);
  Furnish(stage, MakeImage({}));
  if (GetParam())
  {
    stage.Renderer->AddActor(Plate(18, 19));
  }
  stage.Window->Render();
  const std::vector<float> plain = WithoutAlpha(Part(stage.Window, 0, 0, 64, 64));
  for (const std::string name : { "steps", "SSAA", "blur" })
  {
    const auto pass = MakePass(name);
    vtkOpenGLRenderer::SafeDownCast(stage.Renderer)->SetPass(pass);
    stage.Window->Render();
    const std::vector<float> picture = WithoutAlpha(Part(stage.Window, 0, 0, 64, 64));
    const ImageDifference d =
      CompareImages(picture, name == "blur" ? Blurred(plain, 64, 64) : plain);
    std::printf("  %s: mean %.3f/255\n", name.c_str(), 255 * d.Mean);
    // Supersampling smoothes edges; of what is blurred each pass rounds to eight bits.
    EXPECT_LE(d.Mean, (name == "SSAA" ? 2.0 : 1.0) / 255) << name;
    vtkOpenGLRenderer::SafeDownCast(stage.Renderer)->SetPass(nullptr);
    pass->ReleaseGraphicsResources(stage.Window);
  }
}

INSTANTIATE_TEST_SUITE_P(Scene, Passes, testing::Bool(),
  [](const auto& test) { return std::string(test.param ? "WithGeometry" : "VolumesOnly"); });

// Several props in one renderer, each with a mapper of its own, beside VTK's; and one mapper in two
// props.
TEST(Scene, SeveralVolumesBesideVTK)
{
  for (const bool shared : { false, true })
  {
    BesideVTK both({}, 64);
    BesideVTK second({}, 8);
    Furnish(both.Shown, both.Image);
    Furnish(second.Shown, second.Image);
    second.Shown.SetTransfer(MakeTransfer(OpacityShape::Box));
    both.Shown.Renderer->AddActor(Plate(18, 19));
    vtkNew<vtkVolume> beside;
    beside->SetProperty(shared ? both.Shown.Property : second.Shown.Property);
    vtkNew<vtkTransform> place;
    place->Translate(14, -9, 6);
    place->RotateZ(35);
    beside->SetUserTransform(place);
    both.Shown.Renderer->AddVolume(beside);
    std::array<std::vector<float>, 2> pictures;
    for (std::size_t i = 0; i < 2; ++i)
    {
      BesideVTK& of = shared ? both : second;
      both.Shown.Volume->SetMapper(i == 0 ? static_cast<vtkVolumeMapper*>(both.Shown.Mapper)
                                          : static_cast<vtkVolumeMapper*>(both.Theirs));
      beside->SetMapper(i == 0 ? static_cast<vtkVolumeMapper*>(of.Shown.Mapper)
                               : static_cast<vtkVolumeMapper*>(of.Theirs));
      both.Shown.Window->Render();
      both.Shown.Window->Render();
      pictures[i] = WithoutAlpha(Part(both.Shown.Window, 0, 0, 64, 64));
    }
    both.Shown.Volume->SetMapper(both.Shown.Mapper);
    const ImageDifference d = CompareImages(pictures[0], pictures[1]);
    std::printf("  %s: mean %.3f/255\n", shared ? "one mapper" : "two mappers", 255 * d.Mean);
    EXPECT_LE(d.Mean, 1.0 / 255);
    both.Shown.Renderer->RemoveVolume(beside);
    beside->SetMapper(nullptr);
  }
}

TEST(Scene, CameraInsideWithClipping)
{
  BesideVTK both({}, 64);
  Furnish(both.Shown, both.Image);
  const auto source = SourceOfImage(both.Image, 16, false);
  vtkNew<vtkTransform> stretch;
  stretch->Scale(1, 1.5, 0.7);
  for (const bool stretched : { false, true })
  {
    both.Shown.Volume->SetUserTransform(stretched ? stretch.Get() : nullptr);
    // The near plane cuts the volume, the eye is on the side that is cut away.
    both.Shown.LookFrom({ 14, 15, 16 }, { 30, 22, 25 }, 2, 100, 60);
    vtkNew<vtkPlane> plane;
    plane->SetOrigin(20, 18, 20);
    plane->SetNormal(1, 0.3, 0.5);
    both.Shown.Mapper->RemoveAllClippingPlanes();
    both.Shown.Mapper->AddClippingPlane(plane);
    both.CopyCuts();
    // So near, VTK's samples and table differ from the truth by as much as is allowed here.
    EXPECT_LE(Compare(both, 64, 64).Mean, 1.5 / 255) << stretched;
    ExpectTruth(both.Shown, *source, "camera inside, clipped");
    // On the side that is kept.
    plane->SetOrigin(14, 10, 16);
    plane->SetNormal(-0.3, 1, 0.2);
    EXPECT_LE(Compare(both, 64, 64).Mean, 1.5 / 255) << stretched;
    ExpectTruth(both.Shown, *source, "camera inside, before a plane");
  }
}
