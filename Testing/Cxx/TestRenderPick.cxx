// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Pick() against the truth; vtkVolumePicker and hardware selection against what they find with
// vtkGPUVolumeRayCastMapper.
#include "BesideVTK.h"
#include "vtkOutOfCoreVolumeMapper.h"
#include "vtkProceduralVolumeSource.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <gtest/gtest.h>
#include <vtkActor.h>
#include <vtkCallbackCommand.h>
#include <vtkCamera.h>
#include <vtkCellData.h>
#include <vtkCommand.h>
#include <vtkCubeSource.h>
#include <vtkDataArray.h>
#include <vtkDataObject.h>
#include <vtkHardwareSelector.h>
#include <vtkImageData.h>
#include <vtkMatrix4x4.h>
#include <vtkPointData.h>
#include <vtkPolyDataMapper.h>
#include <vtkPropPicker.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkTransform.h>
#include <vtkVolume.h>
#include <vtkVolumePicker.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

double OpacityBefore(const TruthScene& scene, int x, int y, double viewDepth)
{
  return IntegratePixel(scene, x, y, 0, 0, viewDepth)[3];
}

double ViewDepthOf(vtkCamera* camera, const double world[3])
{
  const double p[4] = { world[0], world[1], world[2], 1 };
  double view[4];
  camera->GetModelViewTransformMatrix()->MultiplyPoint(p, view);
  return -view[2];
}

// Trilinear, or that of the voxel; `index` in voxels, centres at whole numbers. Cells: of voxels.
double ImageValue(const std::vector<double>& voxels, const std::array<int, 3>& dims,
  std::array<double, 3> index, bool nearest)
{
  double value = 0;
  for (int corner = 0; corner < 8; ++corner)
  {
    double weight = 1;
    std::array<std::size_t, 3> at{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      const double place = std::clamp(index[a], 0.0, dims[a] - 1.0);
      const double first = nearest ? std::floor(place + 0.5) : std::floor(place);
      const double share = nearest ? 0 : place - first;
      const bool second = (corner >> a & 1) != 0;
      weight *= second ? share : 1 - share;
      at[a] = static_cast<std::size_t>(std::min(first + (second ? 1 : 0), dims[a] - 1.0));
    }
    const auto nx = static_cast<std::size_t>(dims[0]);
    const auto ny = static_cast<std::size_t>(dims[1]);
    value += weight * voxels[at[0] + nx * (at[1] + ny * at[2])];
  }
  return value;
}

// Full of matter, its surface a little beyond the middle of its axes.
double BallField(double x, double y, double z)
{
  const double r = std::hypot(x - 0.5, y - 0.5, z - 0.5);
  return std::clamp(1.2 - 1.5 * r, 0.0, 1.0);
}

int CountWarnings(vtkObject* object, const std::function<void()>& action)
{
  int warnings = 0;
  vtkNew<vtkCallbackCommand> counter;
  counter->SetClientData(&warnings);
  counter->SetCallback(
    [](vtkObject*, unsigned long, void* count, void*) { ++*static_cast<int*>(count); });
  const unsigned long tag = object->AddObserver(vtkCommand::WarningEvent, counter);
  action();
  object->RemoveObserver(tag);
  return warnings;
}

} // namespace

// Position and level as the truth has them: before the place the opacity is below the threshold,
// behind it above, by no more than the tolerance of the picture. The value is that of the data.
TEST(Pick, IsWhereTheTruthPassesTheThreshold)
{
  struct Case
  {
    const char* Name;
    bool Cells;
    bool Nearest;
    bool Shade;
    double LevelBias;
    bool Moved;
  };
  int levels = 0;
  for (const Case& c : { Case{ "points", false, false, false, 0, false },
         Case{ "cells, shaded, moved", true, false, true, 0, true },
         Case{ "nearest", false, true, false, 0, false },
         Case{ "coarser levels", false, false, false, 1.6, false } })
  {
    ImageOptions options;
    options.CellData = c.Cells;
    options.Spacing = { 1, 1.25, 0.8 };
    options.Origin = { 3, -4, 5 };
    options.ExtentStart = { 0, 2, -3 };
    const auto image = MakeImage(options);
    Stage stage(40, 40);
    stage.Mapper->SetBrickSize(16);
    stage.Mapper->SetLevelOfDetailBias(c.LevelBias);
    stage.SetImage(image);
    stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    stage.SetShade(c.Shade);
    if (c.Moved)
    {
      vtkNew<vtkTransform> place;
      place->RotateWXYZ(30, 1, 2, 3);
      place->Translate(5, 6, 7);
      stage.Volume->SetUserTransform(place);
    }
    c.Nearest ? stage.Property->SetInterpolationTypeToNearest()
              : stage.Property->SetInterpolationTypeToLinear();
    stage.Look({ 0.4, 1, -0.3 }, 0.55);
    const std::vector<float> picture = stage.Draw();
    const auto source = SourceOfImage(image, 16, c.Cells);
    const StageTruth truth(stage, *source);
    vtkCamera* camera = stage.Renderer->GetActiveCamera();
    vtkDataArray* scalars =
      c.Cells ? image->GetCellData()->GetScalars() : image->GetPointData()->GetScalars();
    std::vector<double> voxels;
    for (vtkIdType i = 0; i < scalars->GetNumberOfTuples(); ++i)
    {
      voxels.push_back(scalars->GetComponent(i, 0));
    }
    vtkNew<vtkMatrix4x4> datasetFromWorld;
    vtkMatrix4x4::Invert(stage.Volume->GetMatrix(), datasetFromWorld);
    int found = 0;
    int compared = 0;
    for (const double threshold : { 0.1, 0.5, 0.9 })
    {
      for (int y = 2; y < 40; y += 4)
      {
        for (int x = 1; x < 40; x += 4)
        {
          const double total = IntegratePixel(truth.Scene(), x, y)[3];
          constexpr double epsilon = 1.0 / 255;
          const bool picked = stage.Mapper->Pick(stage.Renderer, x + 0.3, y + 0.9, threshold);
          if (std::abs(total - threshold) > epsilon)
          {
            ASSERT_EQ(picked, total > threshold) << c.Name << ", " << x << ", " << y;
          }
          if (!picked)
          {
            continue;
          }
          ++found;
          double world[4] = { 0, 0, 0, 1 };
          stage.Mapper->GetPickPosition(world);
          const double depth = ViewDepthOf(camera, world);
          // On the ray of the pixel.
          const TruthRay ray = truth.Scene().Camera.Ray(x, y);
          const Double3 on = ray.At(ray.LengthAtDepth(depth));
          for (std::size_t a = 0; a < 3; ++a)
          {
            ASSERT_NEAR(world[a], on[a], 1e-4);
          }
          // A picture's opacity may be off by epsilon, and so may be its depth.
          EXPECT_LE(OpacityBefore(truth.Scene(), x, y, depth - 1e-3), threshold + epsilon);
          EXPECT_GE(OpacityBefore(truth.Scene(), x, y, depth + 1e-3), threshold - epsilon);
          bool levelFound = false;
          for (const TruthLevelSpan& span : LevelSpans(truth.Scene(), x, y))
          {
            levelFound = levelFound ||
              (span.Level == stage.Mapper->GetPickLevel() && depth >= span.DepthBegin - 1e-3 &&
                depth <= span.DepthEnd + 1e-3);
          }
          EXPECT_TRUE(levelFound) << c.Name << ": level " << stage.Mapper->GetPickLevel();
          levels |= 1 << stage.Mapper->GetPickLevel();
          double place[4];
          datasetFromWorld->MultiplyPoint(world, place);
          std::array<double, 3> index{};
          for (std::size_t a = 0; a < 3; ++a)
          {
            index[a] = (place[a] - options.Origin[a]) / options.Spacing[a] -
              options.ExtentStart[a] - (c.Cells ? 0.5 : 0.0);
          }
          const double value = ImageValue(voxels, options.Dimensions, index, c.Nearest);
          // In the face between two voxels either counts.
          const bool between = c.Nearest &&
            std::any_of(index.begin(), index.end(),
              [](double i) { return std::abs(i + 0.5 - std::round(i + 0.5)) < 1e-3; });
          if (!between)
          {
            EXPECT_NEAR(stage.Mapper->GetPickValue(), value, 1e-6) << c.Name;
            ++compared;
          }
        }
      }
    }
    std::printf("  %s: %d found, %d values\n", c.Name, found, compared);
    EXPECT_GT(found, 25) << c.Name;
    EXPECT_GT(compared, 25) << c.Name;
    // Nothing of the frame has changed.
    EXPECT_TRUE(AreImagesIdentical(picture, stage.Accumulator()));
    EXPECT_TRUE(stage.Mapper->IsConverged());
    EXPECT_GT(stage.Mapper->GetNumberOfPasses(), 0u);
    EXPECT_TRUE(AreImagesIdentical(picture, stage.Draw()));
    EXPECT_EQ(stage.Mapper->GetNumberOfPasses(), 0u) << "the picture is still there";
  }
  EXPECT_GE(levels, 3) << "level 0 and a coarser one have been picked";
}

TEST(Pick, SameBitsAtAnyBudget)
{
  std::vector<double> reference;
  for (int run = 0; run < 3; ++run)
  {
    Stage stage(48, 48);
    stage.Mapper->SetBrickSize(8);
    stage.Mapper->SetMaximumNumberOfSlots(run == 1 ? 2 : run == 2 ? 12 : 0);
    stage.SetImage(MakeImage({}, BallField));
    stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    stage.Look({ 0.4, 1, -0.3 }, 0.8);
    stage.Draw();
    std::vector<double> places;
    for (int i = 0; i < 48; i += 6)
    {
      if (stage.Mapper->Pick(stage.Renderer, i, 20))
      {
        places.insert(
          places.end(), stage.Mapper->GetPickPosition(), stage.Mapper->GetPickPosition() + 3);
        places.push_back(stage.Mapper->GetPickValue());
      }
    }
    EXPECT_EQ(stage.Mapper->CheckInvariants(), "");
    EXPECT_GE(places.size(), 12u);
    reference = run == 0 ? places : reference;
    EXPECT_EQ(places, reference) << run;
  }
}

TEST(Pick, EndsAtOpaqueGeometryAndAtCuts)
{
  Stage stage(60, 40);
  stage.SetImage(MakeImage({}, BallField));
  stage.SetTransfer(MakeTransfer(OpacityShape::Wall));
  stage.LookFrom({ 19.5, 17.5, 110 }, { 19.5, 17.5, 0 }, 20, 200);
  stage.Draw();
  ASSERT_TRUE(stage.Mapper->Pick(stage.Renderer, 30, 20));
  const double z = stage.Mapper->GetPickPosition()[2];
  // A plate in front of the left half.
  vtkNew<vtkCubeSource> cube;
  cube->SetBounds(-50, 19.5, -50, 90, z + 1, z + 2);
  vtkNew<vtkPolyDataMapper> cubeMapper;
  cubeMapper->SetInputConnection(cube->GetOutputPort());
  vtkNew<vtkActor> actor;
  actor->SetMapper(cubeMapper);
  stage.Renderer->AddActor(actor);
  stage.Draw();
  EXPECT_FALSE(stage.Mapper->Pick(stage.Renderer, 28, 20));
  ASSERT_TRUE(stage.Mapper->Pick(stage.Renderer, 31, 20));
  EXPECT_NEAR(stage.Mapper->GetPickPosition()[2], z, 1.5);
  // Far behind the surface the plate is no obstacle.
  cube->SetBounds(-50, 19.5, -50, 90, z - 12, z - 11);
  stage.Draw();
  EXPECT_TRUE(stage.Mapper->Pick(stage.Renderer, 28, 20));
  stage.Renderer->RemoveActor(actor);

  // Cropped away but for what lies below z - 5.
  stage.Mapper->SetCropping(1);
  stage.Mapper->SetCroppingRegionPlanes(-100, 100, -100, 100, -100, z - 5);
  stage.Mapper->SetCroppingRegionFlagsToSubVolume();
  stage.Draw();
  ASSERT_TRUE(stage.Mapper->Pick(stage.Renderer, 30, 20));
  EXPECT_LE(stage.Mapper->GetPickPosition()[2], z - 5 + 1e-3);
}

TEST(Pick, NothingThere)
{
  Stage stage(40, 40);
  stage.SetImage(MakeImage({}));
  stage.SetTransfer(MakeTransfer(OpacityShape::Fog));
  stage.Look({ 0.4, 1, -0.3 }, 1.5);
  bool picked = true;
  const auto pick = [&] { picked = stage.Mapper->Pick(stage.Renderer, 20, 20, 0.01); };
  EXPECT_EQ(CountWarnings(stage.Mapper, pick), 1) << "nothing has been drawn";
  EXPECT_FALSE(picked);
  stage.Draw();
  EXPECT_EQ(CountWarnings(stage.Mapper, pick), 0);
  EXPECT_TRUE(picked);
  EXPECT_FALSE(stage.Mapper->Pick(stage.Renderer, 20, 20, 0.999)) << "fog";
  EXPECT_FALSE(stage.Mapper->Pick(stage.Renderer, 0, 0, 0)) << "beside the volume";
  EXPECT_FALSE(stage.Mapper->Pick(stage.Renderer, -3, 20)) << "outside of the window";
  EXPECT_FALSE(stage.Mapper->Pick(stage.Renderer, 20, 40));
  stage.Mapper->SetBlendModeToMaximumIntensity();
  stage.Draw();
  EXPECT_FALSE(stage.Mapper->Pick(stage.Renderer, 20, 20, 0.01)) << "no opacity is accumulated";
}

// Interactive frames go on where they were.
TEST(Pick, WhileRefining)
{
  Stage stage(64, 64);
  stage.Mapper->SetBrickSize(8);
  stage.SetImage(MakeImage({}, BallField));
  stage.SetTransfer(MakeTransfer(OpacityShape::Wall));
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
  const std::vector<float> complete = stage.Draw();
  ASSERT_TRUE(stage.Mapper->Pick(stage.Renderer, 32, 32));
  const std::array<double, 3> expected{ stage.Mapper->GetPickPosition()[0],
    stage.Mapper->GetPickPosition()[1], stage.Mapper->GetPickPosition()[2] };
  Stage live(64, 64);
  live.Mapper->SetBrickSize(8);
  live.Mapper->SetFrameTimeBudget(1);
  live.SetImage(MakeImage({}, BallField));
  live.SetTransfer(MakeTransfer(OpacityShape::Wall));
  live.Look({ 0.4, 1, -0.3 }, 0.8);
  live.Draw();
  ASSERT_TRUE(live.Mapper->Pick(live.Renderer, 32, 32));
  for (std::size_t a = 0; a < 3; ++a)
  {
    EXPECT_EQ(live.Mapper->GetPickPosition()[a], expected[a]);
  }
  ASSERT_TRUE(live.Mapper->Converge(live.Window, 60));
  EXPECT_TRUE(AreImagesIdentical(complete, live.Accumulator()));
}

TEST(VolumePicker, FindsWhatItFindsWithVTK)
{
  int found = 0;
  for (const bool lazy : { false, true })
  {
    vtkNew<vtkProceduralVolumeSource> formula;
    formula->SetFunctionName("marschner-lobb");
    formula->SetDimensions(48, 48, 48);
    formula->Update();
    const auto image = MakeImage({}, BallField);
    Stage stage(48, 48);
    stage.SetTransfer(
      lazy ? MakeTransfer(OpacityShape::Wall, 0, 1) : MakeTransfer(OpacityShape::Wall));
    vtkNew<vtkOpenGLGPUVolumeRayCastMapper> theirs;
    if (lazy)
    {
      stage.Mapper->SetInputConnection(formula->GetOutputPort());
      theirs->SetInputConnection(formula->GetOutputPort());
      stage.Volume->SetMapper(stage.Mapper);
    }
    else
    {
      stage.SetImage(image);
      theirs->SetInputData(image);
    }
    stage.Look({ 0.4, 1, -0.3 }, 0.9);
    stage.DrawPicture();
    for (int y = 2; y < 48; y += 9)
    {
      for (int x = 1; x < 48; x += 9)
      {
        std::array<std::array<double, 9>, 2> picks{};
        for (std::size_t i = 0; i < 2; ++i)
        {
          stage.Volume->SetMapper(i == 0 ? static_cast<vtkVolumeMapper*>(stage.Mapper)
                                         : static_cast<vtkVolumeMapper*>(theirs));
          vtkNew<vtkVolumePicker> picker;
          picker->SetVolumeOpacityIsovalue(0.2);
          picks[i][0] = picker->Pick(x, y, 0, stage.Renderer);
          std::copy_n(picker->GetPickPosition(), 3, &picks[i][1]);
          std::copy_n(picker->GetPickNormal(), 3, &picks[i][4]);
          picks[i][7] = static_cast<double>(picker->GetPointId());
          picks[i][8] = picker->GetVolume() == stage.Volume ? 1 : 0;
        }
        found += picks[0][8] == 1 ? 1 : 0;
        for (std::size_t v = 0; v < 9; ++v)
        {
          EXPECT_EQ(picks[0][v], picks[1][v])
            << (lazy ? "lazy" : "array") << " at " << x << ", " << y;
        }
      }
    }
    stage.Volume->SetMapper(stage.Mapper);
  }
  EXPECT_GT(found, 20);
}

TEST(HardwareSelection, FindsThePropThatVTKFinds)
{
  for (const int blend :
    { vtkVolumeMapper::COMPOSITE_BLEND, vtkVolumeMapper::MAXIMUM_INTENSITY_BLEND })
  {
    for (const bool propsOnly : { true, false })
    {
      BesideVTK both({}, 64);
      Stage& stage = both.Shown;
      stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
      stage.Look({ 0.4, 1, -0.3 }, 1.2);
      stage.Mapper->SetBlendMode(blend);
      both.Theirs->SetBlendMode(blend);
      vtkNew<vtkCubeSource> cube;
      cube->SetBounds(-50, 15, -50, 90, 20, 21);
      vtkNew<vtkPolyDataMapper> cubeMapper;
      cubeMapper->SetInputConnection(cube->GetOutputPort());
      vtkNew<vtkActor> actor;
      actor->SetMapper(cubeMapper);
      stage.Renderer->AddActor(actor);
      const std::vector<float> picture = stage.Draw();
      std::array<std::vector<int>, 2> props; // 0: none, 1: the volume, 2: the cube
      for (std::size_t i = 0; i < 2; ++i)
      {
        stage.Volume->SetMapper(i == 0 ? static_cast<vtkVolumeMapper*>(stage.Mapper)
                                       : static_cast<vtkVolumeMapper*>(both.Theirs));
        vtkNew<vtkHardwareSelector> selector;
        selector->SetRenderer(stage.Renderer);
        selector->SetArea(0, 0, 63, 63);
        // With points VTK's mapper writes colours where ids are expected.
        selector->SetFieldAssociation(vtkDataObject::FIELD_ASSOCIATION_CELLS);
        selector->SetActorPassOnly(propsOnly);
        ASSERT_TRUE(selector->CaptureBuffers());
        for (unsigned int y = 0; y < 64; ++y)
        {
          for (unsigned int x = 0; x < 64; ++x)
          {
            const unsigned int at[2] = { x, y };
            vtkProp* prop = selector->GetPixelInformation(at).Prop;
            props[i].push_back(prop == stage.Volume ? 1 : prop == actor ? 2 : 0);
          }
        }
        selector->ClearBuffers();
      }
      stage.Volume->SetMapper(stage.Mapper);
      int different = 0;
      std::array<int, 3> counts{};
      for (std::size_t i = 0; i < props[0].size(); ++i)
      {
        different += props[0][i] != props[1][i] ? 1 : 0;
        ++counts[static_cast<std::size_t>(props[0][i])];
      }
      std::printf("  blend %d: %d pixels none, %d volume, %d cube; %d differ\n", blend, counts[0],
        counts[1], counts[2], different);
      EXPECT_GT(counts[0], 100);
      EXPECT_GT(counts[1], 300);
      EXPECT_GT(counts[2], 100);
      // Pixels whose opacity is within a tolerance of 3/255, at the edge of what is visible.
      EXPECT_LE(different, 40);
      // Selection is no frame: statistics and picture are what they were.
      EXPECT_GT(stage.Mapper->GetNumberOfPasses(), 0u);
      EXPECT_TRUE(AreImagesIdentical(picture, stage.Draw()));
      EXPECT_EQ(stage.Mapper->GetNumberOfPasses(), 0u);
    }
  }
}

namespace
{
// The ids that hardware selection finds per pixel of a stage, -1 without one.
std::vector<vtkIdType> SelectedIds(Stage& stage, int association)
{
  vtkNew<vtkHardwareSelector> selector;
  selector->SetRenderer(stage.Renderer);
  selector->SetArea(0, 0, static_cast<unsigned int>(stage.Width() - 1),
    static_cast<unsigned int>(stage.Height() - 1));
  selector->SetFieldAssociation(association);
  EXPECT_TRUE(selector->CaptureBuffers());
  std::vector<vtkIdType> ids;
  for (unsigned int y = 0; y < static_cast<unsigned int>(stage.Height()); ++y)
  {
    for (unsigned int x = 0; x < static_cast<unsigned int>(stage.Width()); ++x)
    {
      const unsigned int at[2] = { x, y };
      const vtkHardwareSelector::PixelInformation pixel = selector->GetPixelInformation(at);
      ids.push_back(pixel.Valid && pixel.Prop == stage.Volume ? pixel.AttributeID : -1);
    }
  }
  return ids;
}
} // namespace

// The numbers of the points and cells that Pick() finds at the pixels' centres, in images of points
// and of cells.
TEST(HardwareSelection, FindsPointsAndCells)
{
  for (const bool cellData : { false, true })
  {
    ImageOptions options;
    options.CellData = cellData;
    options.Spacing = { 1, 1.3, 0.8 };
    Stage stage(32, 32);
    const auto image = MakeImage(options);
    stage.SetImage(image);
    if (cellData)
    {
      stage.Mapper->SetScalarModeToUseCellData();
    }
    stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    stage.Look({ 0.4, 1, -0.3 }, 1);
    const std::vector<float> picture = stage.Draw();
    for (const bool points : { true, false })
    {
      const std::vector<vtkIdType> ids = SelectedIds(stage,
        points ? vtkDataObject::FIELD_ASSOCIATION_POINTS : vtkDataObject::FIELD_ASSOCIATION_CELLS);
      int found = 0;
      int others = 0;
      for (int i = 0; i < 32 * 32; i += 7)
      {
        const bool there =
          stage.Mapper->Pick(stage.Renderer, i % 32 + 0.5, i / 32 + 0.5, 3.0 / 255);
        const vtkIdType id = ids[static_cast<std::size_t>(i)];
        if (!there)
        {
          others += id >= 0 ? 1 : 0;
          continue;
        }
        ++found;
        double at[3];
        image->TransformPhysicalPointToContinuousIndex(stage.Mapper->GetPickPosition(), at);
        const int* n = image->GetDimensions();
        vtkIdType should = 0;
        for (int a = 2; a >= 0; --a)
        {
          const int count = points ? n[a] : n[a] - 1;
          const double place = std::floor(points ? at[a] + 0.5 : at[a]);
          should = should * count +
            static_cast<vtkIdType>(std::clamp(place, 0.0, static_cast<double>(count - 1)));
        }
        // Where a hit lies at a face, rounding may put it on the other side.
        others += id != should ? 1 : 0;
      }
      std::printf("  %s of %s data: %d found, %d others\n", points ? "points" : "cells",
        cellData ? "cell" : "point", found, others);
      EXPECT_GT(found, 15);
      EXPECT_LE(others, found / 50);
    }
    // Selection is no frame.
    EXPECT_TRUE(AreImagesIdentical(picture, stage.Draw()));
    EXPECT_EQ(stage.Mapper->GetNumberOfPasses(), 0u);
  }
}

// Numbers that don't fit into the 24 bits of one pass.
TEST(HardwareSelection, FindsCellsOfALargeVolume)
{
  Stage stage(24, 24);
  vtkNew<vtkProceduralVolumeSource> source;
  source->SetDimensions(700, 700, 700);
  stage.Mapper->SetInputConnection(source->GetOutputPort());
  stage.SetTransfer(MakeTransfer(OpacityShape::Fog));
  stage.LookFrom({ 690, 680, 950 }, { 660, 650, 600 }, 100, 900, 8);
  stage.Draw();
  const std::vector<vtkIdType> ids = SelectedIds(stage, vtkDataObject::FIELD_ASSOCIATION_CELLS);
  ASSERT_TRUE(stage.Mapper->Pick(stage.Renderer, 12.5, 12.5, 3.0 / 255));
  const double* at = stage.Mapper->GetPickPosition();
  const vtkIdType id = ids[12 * 24 + 12];
  EXPECT_GT(id, vtkIdType{ 1 } << 27);
  const std::array<vtkIdType, 3> cell{ id % 699, id / 699 % 699, id / 699 / 699 };
  for (std::size_t a = 0; a < 3; ++a)
  {
    EXPECT_NEAR(static_cast<double>(cell[a]) + 0.5, at[a], 0.501) << a;
  }
}

TEST(HardwareSelection, PropPickerFindsTheVolume)
{
  Stage stage(64, 64);
  stage.SetImage(MakeImage({}));
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.Look({ 0.4, 1, -0.3 }, 1.2);
  vtkNew<vtkPropPicker> picker;
  // Before any frame, too.
  ASSERT_EQ(picker->Pick(32, 32, 0, stage.Renderer), 1);
  EXPECT_EQ(picker->GetViewProp(), stage.Volume);
  EXPECT_EQ(picker->Pick(1, 1, 0, stage.Renderer), 0);
  stage.DrawPicture();
  EXPECT_EQ(picker->Pick(32, 32, 0, stage.Renderer), 1);
  EXPECT_EQ(picker->GetViewProp(), stage.Volume);
}
