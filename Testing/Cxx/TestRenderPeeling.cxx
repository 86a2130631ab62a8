// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Volumes between translucent geometry, by dual depth peeling. The truth are closed forms, and the
// float accumulators of the volume cut at the geometry by clipping planes, blended with it here.
// The pass blends into targets of 8 bits: each of its peels rounds.
#include "BesideVTK.h"
#include "EachWay.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>
#include <string>
#include <vector>
#include <vtkActor.h>
#include <vtkCallbackCommand.h>
#include <vtkCamera.h>
#include <vtkCommand.h>
#include <vtkContourValues.h>
#include <vtkImageData.h>
#include <vtkMath.h>
#include <vtkPlane.h>
#include <vtkPlaneSource.h>
#include <vtkPointData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

using Point = std::array<double, 3>;

// A plane without an end, in one colour.
struct Sheet
{
  Point Place;
  Point Normal; ///< away from the eye
  std::array<double, 3> Color;
  double Opacity;

  vtkSmartPointer<vtkActor> Actor() const
  {
    vtkNew<vtkPlaneSource> source;
    source->SetOrigin(-300, -300, 0);
    source->SetPoint1(300, -300, 0);
    source->SetPoint2(-300, 300, 0);
    source->SetCenter(this->Place[0], this->Place[1], this->Place[2]);
    source->SetNormal(this->Normal[0], this->Normal[1], this->Normal[2]);
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputConnection(source->GetOutputPort());
    auto actor = vtkSmartPointer<vtkActor>::New();
    actor->SetMapper(mapper);
    actor->GetProperty()->LightingOff();
    actor->GetProperty()->SetColor(this->Color[0], this->Color[1], this->Color[2]);
    actor->GetProperty()->SetOpacity(this->Opacity);
    return actor;
  }
};

void SwitchPeelingOn(vtkRenderer* renderer)
{
  renderer->SetUseDepthPeeling(1);
  renderer->SetUseDepthPeelingForVolumes(true);
  renderer->SetMaximumNumberOfPeels(20);
  renderer->SetOcclusionRatio(0);
}

// Blends what lies behind, premultiplied and with its opacity, under a picture.
void BlendUnder(std::vector<float>& picture, const std::vector<float>& behind)
{
  for (std::size_t i = 0; i < picture.size(); i += 4)
  {
    const float left = 1 - picture[i + 3];
    for (std::size_t c = 0; c < 4; ++c)
    {
      picture[i + c] += left * behind[i + c];
    }
  }
}

std::vector<float> PictureOf(const Sheet& sheet, std::size_t pixels)
{
  std::vector<float> picture;
  for (std::size_t i = 0; i < pixels; ++i)
  {
    for (const double c : sheet.Color)
    {
      picture.push_back(static_cast<float>(c * sheet.Opacity));
    }
    picture.push_back(static_cast<float>(sheet.Opacity));
  }
  return picture;
}

// What the volumes of these stages show between sheets, front to back: each cut by clipping planes.
// The stages share a camera; volumes lie one behind the other where there are several.
std::vector<float> ShouldBe(std::vector<Stage*> stages, const std::vector<Sheet>& sheets)
{
  const std::size_t pixels =
    static_cast<std::size_t>(stages[0]->Width()) * static_cast<std::size_t>(stages[0]->Height());
  std::vector<float> picture(4 * pixels, 0.0f);
  for (std::size_t s = 0; s <= sheets.size(); ++s)
  {
    for (Stage* stage : stages)
    {
      stage->Mapper->RemoveAllClippingPlanes();
      if (s > 0)
      {
        vtkNew<vtkPlane> behind;
        behind->SetOrigin(sheets[s - 1].Place.data());
        behind->SetNormal(sheets[s - 1].Normal.data());
        stage->Mapper->AddClippingPlane(behind);
      }
      if (s < sheets.size())
      {
        vtkNew<vtkPlane> before;
        before->SetOrigin(sheets[s].Place.data());
        before->SetNormal(-sheets[s].Normal[0], -sheets[s].Normal[1], -sheets[s].Normal[2]);
        stage->Mapper->AddClippingPlane(before);
      }
      BlendUnder(picture, stage->Draw());
      stage->Mapper->RemoveAllClippingPlanes();
    }
    if (s < sheets.size())
    {
      BlendUnder(picture, PictureOf(sheets[s], pixels));
    }
  }
  return WithoutAlpha(std::move(picture));
}

std::vector<float> Shown(Stage& stage)
{
  return WithoutAlpha(stage.DrawPicture());
}

void Furnish(Stage& stage, vtkImageData* image)
{
  stage.Mapper->SetBrickSize(16);
  stage.SetImage(image);
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
}

// Three before one that is opaque, all of them through the volume of ImageOptions.
const std::vector<Sheet> Sheets{ { { 20, 9, 22 }, { 0.2, 1, 0.1 }, { 1, 0.2, 0 }, 0.4 },
  { { 20, 16, 22 }, { 0.2, 1, 0.1 }, { 0, 0.5, 1 }, 0.3 },
  { { 20, 22, 22 }, { 0.2, 1, 0.1 }, { 0.3, 1, 0.1 }, 0.5 },
  { { 20, 29, 22 }, { 0.2, 1, 0.1 }, { 0.8, 0.8, 1 }, 1 } };

void AddSheets(Stage& stage, const std::vector<Sheet>& sheets)
{
  for (const Sheet& sheet : sheets)
  {
    stage.Renderer->AddActor(sheet.Actor());
  }
}

// The accumulators of the last stretch of each part of a frame.
class Stretches
{
public:
  explicit Stretches(Stage& stage)
    : Of(stage)
  {
    this->Command->SetClientData(this);
    this->Command->SetCallback(
      [](vtkObject*, unsigned long, void* self, void*)
      {
        auto* s = static_cast<Stretches*>(self);
        s->Parts.push_back(s->Of.Accumulator());
      });
    this->Tag = stage.Mapper->AddObserver(vtkCommand::VolumeMapperRenderEndEvent, this->Command);
  }
  Stretches(const Stretches&) = delete;
  Stretches& operator=(const Stretches&) = delete;
  ~Stretches() { this->Of.Mapper->RemoveObserver(this->Tag); }

  std::vector<std::vector<float>> Parts;

private:
  Stage& Of;
  vtkNew<vtkCallbackCommand> Command;
  unsigned long Tag;
};

} // namespace

// A homogeneous medium with two sheets in it: every pixel has the same closed form.
TEST(Peeling, HomogeneousMediumIsExact)
{
  Stage stage(32, 32);
  vtkSmartPointer<vtkImageData> image = MakeImage({}, [](double, double, double) { return 0.5; });
  stage.Mapper->SetBrickSize(16);
  stage.SetImage(image);
  TransferNodes nodes;
  nodes.Opacity = { { 0, 0.03 }, { 255, 0.03 } };
  nodes.Color = { { 0, 0.9, 0.6, 0.3 }, { 255, 0.9, 0.6, 0.3 } };
  stage.SetTransfer(nodes);
  stage.Look({ 1, 0, 0 }, 0.3, true);
  const std::vector<Sheet> sheets{ { { 9.3, 0, 0 }, { 1, 0, 0 }, { 0, 0.2, 1 }, 0.4 },
    { { 27.6, 0, 0 }, { 1, 0, 0 }, { 1, 1, 1 }, 0.25 } };
  AddSheets(stage, sheets);
  SwitchPeelingOn(stage.Renderer);
  const std::vector<float> picture = Shown(stage);
  EXPECT_TRUE(stage.Mapper->IsConverged());
  const double lengths[3] = { 9.3, 27.6 - 9.3, 39 - 27.6 };
  for (std::size_t c = 0; c < 3; ++c)
  {
    double color = 0;
    double left = 1;
    for (std::size_t s = 0; s < 3; ++s)
    {
      const double through = std::pow(1 - 0.03, lengths[s]);
      color += left * (1 - through) * nodes.Color[0][c + 1];
      left *= through;
      if (s < 2)
      {
        color += left * sheets[s].Opacity * sheets[s].Color[c];
        left *= 1 - sheets[s].Opacity;
      }
    }
    for (std::size_t i = c; i < picture.size(); i += 4)
    {
      ASSERT_NEAR(picture[i], color, 2.5 / 255) << "channel " << c << ", pixel " << i / 4;
    }
  }
}

// Any field, in all ways of integration and in blend modes, between sheets that lie askew.
TEST(Peeling, StretchesAreThoseThatPlanesCut)
{
  Stage stage(48, 48);
  Furnish(stage, MakeImage({}));
  Stage cut(48, 48);
  Furnish(cut, MakeImage({}));
  cut.Renderer->SetActiveCamera(stage.Renderer->GetActiveCamera());
  cut.Volume->SetProperty(stage.Property);
  stage.Property->GetIsoSurfaceValues()->SetValue(0, 90);
  stage.Property->GetIsoSurfaceValues()->SetValue(1, 150);
  AddSheets(stage, Sheets);
  SwitchPeelingOn(stage.Renderer);
  const auto expect = [&](const std::string& name)
  {
    // Behind the last of them, which is opaque, nothing is seen.
    const std::vector<float> should = ShouldBe({ &cut }, Sheets);
    const ImageDifference d = CompareImages(Shown(stage), should);
    std::printf("  %s: mean %.3f/255, max %.2f/255\n", name.c_str(), 255 * d.Mean, 255 * d.Max);
    // Three sheets and four stretches are blended in 8 bits, and the window: eight halves.
    EXPECT_LE(d.Max, 4.0 / 255) << name;
    EXPECT_TRUE(stage.Mapper->IsConverged()) << name;
  };
  ForEachWay(stage, [&](const std::string& way) { expect("perspective" + way); });
  stage.Property->SetInterpolationTypeToLinear();
  stage.SetShade(false);
  for (const int mode : { vtkVolumeMapper::MAXIMUM_INTENSITY_BLEND,
         vtkVolumeMapper::ISOSURFACE_BLEND, vtkVolumeMapper::AVERAGE_INTENSITY_BLEND })
  {
    stage.Mapper->SetBlendMode(mode);
    cut.Mapper->SetBlendMode(mode);
    expect("blend mode " + std::to_string(mode));
  }
  stage.Mapper->SetBlendModeToComposite();
  cut.Mapper->SetBlendModeToComposite();
  stage.Look({ 0.4, 1, -0.3 }, 0.8, true);
  expect("parallel");
}

TEST(Peeling, BesideVTK)
{
  BesideVTK both({}, 64);
  Furnish(both.Shown, both.Image);
  AddSheets(both.Shown, Sheets);
  // Sheets through each other.
  both.Shown.Renderer->AddActor(
    Sheet{ { 20, 18, 22 }, { 1, 0.4, 0.2 }, { 1, 1, 0 }, 0.35 }.Actor());
  SwitchPeelingOn(both.Shown.Renderer);
  std::array<std::vector<float>, 2> pictures;
  for (std::size_t i = 0; i < 2; ++i)
  {
    both.Shown.Volume->SetMapper(i == 0 ? static_cast<vtkVolumeMapper*>(both.Shown.Mapper)
                                        : static_cast<vtkVolumeMapper*>(both.Theirs));
    both.Shown.Window->Render();
    both.Shown.Window->Render();
    pictures[i] = Shown(both.Shown);
  }
  both.Shown.Volume->SetMapper(both.Shown.Mapper);
  const ImageDifference d = CompareImages(pictures[0], pictures[1]);
  // Where a sheet crosses another one within a pixel's depth, either may come first.
  std::printf("  mean %.3f/255, p99 %.2f/255\n", 255 * d.Mean, 255 * d.Percentile99);
  EXPECT_LE(d.Mean, 1.0 / 255);
}

// A viewport shows what a window of its size shows: VTK's mapper cuts volumes there, its rays look
// for their depths at the window's pixels.
TEST(Peeling, ViewportsAreWindowsOfTheirOwn)
{
  Stage alone(36, 42);
  Furnish(alone, MakeImage({}));
  AddSheets(alone, Sheets);
  SwitchPeelingOn(alone.Renderer);
  const std::vector<float> should = Shown(alone);
  Stage stage(48, 48);
  Furnish(stage, MakeImage({}));
  AddSheets(stage, Sheets);
  SwitchPeelingOn(stage.Renderer);
  stage.Renderer->SetViewport(0.25, 0.125, 1, 1);
  const std::vector<float> whole = Shown(stage);
  std::vector<float> picture;
  for (int y = 6; y < 48; ++y)
  {
    const auto row = whole.begin() + 4 * (y * 48 + 12);
    picture.insert(picture.end(), row, row + static_cast<std::ptrdiff_t>(4) * 36);
  }
  // The driver may compute the depths of geometry otherwise there, in their last bit.
  EXPECT_LE(CompareImages(picture, should).Max, 1.01 / 255);
}

// A brick that several stretches go through is read once where it may stay; and any atlas does.
TEST(Peeling, BricksAreReadOnceAndAnyAtlasDoes)
{
  const auto image = MakeImage({});
  Stage plain(48, 48);
  Furnish(plain, image);
  AddSheets(plain, { Sheets.back() });
  plain.Draw();
  Stage stage(48, 48);
  Furnish(stage, image);
  AddSheets(stage, Sheets);
  SwitchPeelingOn(stage.Renderer);
  Stretches all(stage);
  const std::vector<float> picture = stage.DrawPicture();
  EXPECT_EQ(stage.Mapper->GetNumberOfBricksLoaded(), plain.Mapper->GetNumberOfBricksLoaded());
  EXPECT_GT(all.Parts.size(), 2u);
  const auto read = stage.Mapper->GetNumberOfBricksLoaded();
  stage.Window->Render();
  EXPECT_EQ(stage.Mapper->GetNumberOfBricksLoaded(), read) << "nothing is read again";

  Stage tiny(48, 48);
  Furnish(tiny, image);
  AddSheets(tiny, Sheets);
  SwitchPeelingOn(tiny.Renderer);
  tiny.Mapper->SetMaximumNumberOfSlots(2);
  tiny.Mapper->SetArrivalShuffleSeed(3);
  Stretches few(tiny);
  EXPECT_TRUE(AreImagesIdentical(picture, tiny.DrawPicture()));
  EXPECT_TRUE(tiny.Mapper->IsConverged());
  EXPECT_EQ(tiny.Mapper->GetNumberOfSlots(), 2u);
  ASSERT_EQ(few.Parts.size(), tiny.Mapper->GetNumberOfSlots() == 2 ? few.Parts.size() : 0);
  for (std::size_t i = 0; i < few.Parts.size(); ++i)
  {
    EXPECT_TRUE(AreImagesIdentical(all.Parts[i], few.Parts[i])) << "part " << i;
  }
  std::printf("  bricks: %llu, without sheets %llu, with two slots %llu\n",
    static_cast<unsigned long long>(read),
    static_cast<unsigned long long>(plain.Mapper->GetNumberOfBricksLoaded()),
    static_cast<unsigned long long>(tiny.Mapper->GetNumberOfBricksLoaded()));
  EXPECT_EQ(tiny.Mapper->CheckInvariants(), "");
  EXPECT_LE(tiny.Mapper->GetPeakGPUMemoryUsed(), tiny.Mapper->GetEffectiveGPUMemoryBudget());
}

// Frames that don't wait: what all stretches miss is asked for, and the last frame is complete.
TEST(Peeling, InteractiveFramesConverge)
{
  const auto image = MakeImage({});
  Stage complete(48, 48);
  Furnish(complete, image);
  AddSheets(complete, Sheets);
  SwitchPeelingOn(complete.Renderer);
  const std::vector<float> picture = complete.DrawPicture();

  Stage stage(48, 48);
  Furnish(stage, image);
  AddSheets(stage, Sheets);
  SwitchPeelingOn(stage.Renderer);
  stage.Mapper->SetFrameTimeBudget(100);
  int told = 0;
  vtkNew<vtkCallbackCommand> converged;
  converged->SetClientData(&told);
  converged->SetCallback(
    [](vtkObject*, unsigned long, void* count, void*) { ++*static_cast<int*>(count); });
  stage.Mapper->AddObserver(vtkOutOfCoreVolumeMapper::ConvergedEvent, converged);
  stage.Window->Render();
  EXPECT_TRUE(stage.Mapper->Converge(stage.Window, 60));
  EXPECT_EQ(told, 1) << "once for the frame, not for each of its stretches";
  EXPECT_TRUE(AreImagesIdentical(picture, stage.DrawPicture()));
  // The coarsest brick, too, for what is missing.
  EXPECT_EQ(
    stage.Mapper->GetNumberOfBricksLoaded(), complete.Mapper->GetNumberOfBricksLoaded() + 1);
}

// Two media, one behind the other, with a sheet in each and one between them.
TEST(Peeling, TwoVolumes)
{
  Stage stage(48, 48);
  Furnish(stage, MakeImage({}));
  ImageOptions options;
  options.Origin = { 0, 40, 0 };
  Stage second(48, 48);
  Furnish(second, MakeImage(options));
  second.SetTransfer(MakeTransfer(OpacityShape::Box));
  Stage near(48, 48);
  Furnish(near, MakeImage({}));
  Stage far(48, 48);
  Furnish(far, MakeImage(options));
  far.SetTransfer(MakeTransfer(OpacityShape::Box));
  vtkCamera* camera = stage.Renderer->GetActiveCamera();
  stage.Look({ 0.1, 1, -0.1 }, 1);
  camera->SetClippingRange(1, 400);
  near.Renderer->SetActiveCamera(camera);
  far.Renderer->SetActiveCamera(camera);
  std::vector<Sheet> sheets = Sheets;
  sheets[2].Place[1] = 38;
  sheets[3].Place[1] = 60;
  sheets[3].Opacity = 0.6;
  AddSheets(stage, sheets);
  SwitchPeelingOn(stage.Renderer);
  // As without peels, of volumes in one stretch the later one covers the earlier one.
  stage.Renderer->RemoveVolume(stage.Volume);
  stage.Renderer->AddVolume(second.Volume);
  stage.Renderer->AddVolume(stage.Volume);
  const ImageDifference d = CompareImages(Shown(stage), ShouldBe({ &near, &far }, sheets));
  std::printf("  mean %.3f/255, max %.2f/255\n", 255 * d.Mean, 255 * d.Max);
  EXPECT_LE(d.Max, 4.5 / 255);
  stage.Renderer->RemoveVolume(second.Volume);
}

// Whole rays: picks and images to be kept are what they are without sheets that let light pass.
TEST(Peeling, PicksAndImagesAreOfWholeRays)
{
  Stage plain(48, 48);
  Stage stage(48, 48);
  for (Stage* s : { &plain, &stage })
  {
    Furnish(*s, MakeImage({}));
    s->Renderer->SetViewport(0.25, 0.25, 1, 1);
    AddSheets(*s, { Sheets.back() });
  }
  AddSheets(stage, { Sheets[0], Sheets[1] });
  SwitchPeelingOn(stage.Renderer);
  plain.Window->Render();
  stage.Window->Render();
  int found = 0;
  for (const double x : { 20.0, 30.0, 36.0 })
  {
    const bool there = plain.Mapper->Pick(plain.Renderer, x, 30, 0.1);
    ASSERT_EQ(there, stage.Mapper->Pick(stage.Renderer, x, 30, 0.1)) << x;
    found += there ? 1 : 0;
    for (int a = 0; there && a < 3; ++a)
    {
      EXPECT_NEAR(plain.Mapper->GetPickPosition()[a], stage.Mapper->GetPickPosition()[a], 1e-4);
    }
  }
  EXPECT_GT(found, 0);
  vtkNew<vtkImageData> should;
  vtkNew<vtkImageData> image;
  plain.Mapper->RenderToImageOn();
  stage.Mapper->RenderToImageOn();
  plain.Window->Render();
  stage.Window->Render();
  for (const bool color : { true, false })
  {
    color ? plain.Mapper->GetColorImage(should) : plain.Mapper->GetDepthImage(should);
    color ? stage.Mapper->GetColorImage(image) : stage.Mapper->GetDepthImage(image);
    ASSERT_EQ(image->GetNumberOfPoints(), 36 * 36);
    double range[2];
    should->GetScalarRange(range);
    EXPECT_LT(range[0], range[1]);
    for (vtkIdType i = 0; i < image->GetNumberOfPoints(); ++i)
    {
      for (int c = 0; c < image->GetNumberOfScalarComponents(); ++c)
      {
        ASSERT_NEAR(should->GetPointData()->GetScalars()->GetComponent(i, c),
          image->GetPointData()->GetScalars()->GetComponent(i, c), color ? 1 : 1e-5)
          << i;
      }
    }
  }
}
