// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Pixels that are interpolated between rays: within the tolerance of the picture whose rays are
// all cast, fewer rays where the picture is smooth, and nothing lost between them.
#include "FaultyBrickSource.h"
#include "Scene.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>
#include <memory>
#include <random>
#include <string>
#include <vector>
#include <vtkActor.h>
#include <vtkCallbackCommand.h>
#include <vtkCamera.h>
#include <vtkCommand.h>
#include <vtkCylinderSource.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPlane.h>
#include <vtkPolyDataMapper.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>

using namespace teravox;
using namespace teravox::test;

namespace
{
constexpr double Tolerance = 1.0 / 255;

class Lattice : public ::testing::Test
{
protected:
  void SetUp() override
  {
    if (TestedMarcher() != vtkOutOfCoreVolumeMapper::MARCHER_NATIVE)
    {
      GTEST_SKIP() << "Only the native marcher interpolates between rays.";
    }
  }
};

std::vector<float> DrawCast(Stage& stage)
{
  stage.Mapper->AutoAdjustSampleDistancesOff();
  std::vector<float> picture = stage.Draw();
  stage.Mapper->AutoAdjustSampleDistancesOn();
  return picture;
}

struct Comparison
{
  double Difference = 0; // from all rays cast, with an eighth of the tolerance
  double Effort = 0;     // samples over those of all rays, at the same tolerance
};

Comparison Compare(Stage& stage, const std::string& name, double tolerance = Tolerance)
{
  stage.Mapper->SetImageErrorTolerance(tolerance);
  stage.Mapper->CountSamplesOn();
  DrawCast(stage);
  const auto all = static_cast<double>(stage.Mapper->GetNumberOfSamples());
  stage.Mapper->SetImageErrorTolerance(tolerance / 8);
  const std::vector<float> fine = DrawCast(stage);
  stage.Mapper->SetImageErrorTolerance(tolerance);
  const std::vector<float> picture = stage.Draw();
  Comparison c;
  c.Effort = static_cast<double>(stage.Mapper->GetNumberOfSamples()) / all;
  EXPECT_TRUE(stage.Mapper->IsConverged());
  for (std::size_t i = 0; i < fine.size(); ++i)
  {
    c.Difference = std::max(c.Difference, static_cast<double>(std::abs(fine[i] - picture[i])));
  }
  std::printf(
    "%s: at most %.3f/255 off, %.2f of the samples\n", name.c_str(), c.Difference * 255, c.Effort);
  EXPECT_LE(c.Difference, tolerance) << name;
  EXPECT_GT(*std::max_element(fine.begin(), fine.end()), 0.02f) << name << " shows nothing";
  return c;
}

// Spheres that are 1.5 voxels thick, in 64^3 voxels.
double Spheres(double x, double y, double z)
{
  const double r = std::hypot(x - 0.5, y - 0.5, z - 0.5);
  double value = 0;
  for (const double radius : { 0.15, 0.25, 0.35, 0.45 })
  {
    value = std::max(value, 1 - std::abs(r - radius) / 0.025);
  }
  return value;
}

// Values up to 50, and voxels of 255 one by one.
vtkSmartPointer<vtkImageData> Spots(int count, unsigned seed)
{
  ImageOptions options;
  options.Dimensions = { 64, 64, 64 };
  options.High = 50;
  auto image = MakeImage(options);
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> place(2, 61);
  for (int i = 0; i < count; ++i)
  {
    image->SetScalarComponentFromDouble(place(random), place(random), place(random), 0, 255);
  }
  return image;
}

} // namespace

// Whatever the field and the function: off by no more than rays themselves may be, and fewer
// samples where the picture is smooth.
TEST_F(Lattice, SmoothAndUnsmooth)
{
  for (const bool smooth : { false, true })
  {
    for (const bool shade : { false, true })
    {
      for (const OpacityShape shape : { OpacityShape::Ramp, OpacityShape::Peak, OpacityShape::Box,
             OpacityShape::Wall, OpacityShape::Fog })
      {
        Stage stage(280, 260);
        ImageOptions options;
        options.Dimensions = { 64, 64, 64 };
        stage.SetImage(MakeImage(options, smooth ? BlobField : Spheres));
        stage.SetTransfer(MakeTransfer(shape));
        stage.SetShade(shade);
        stage.Look({ 0.5, 0.8, 1 }, 1.2);
        const Comparison c = Compare(stage,
          std::string(smooth ? "blobs" : "spheres") + (shade ? ", shaded, " : ", ") +
            ToString(shape));
        if (smooth && shape == OpacityShape::Fog)
        {
          EXPECT_LT(c.Effort, 0.8);
        }
      }
    }
  }
}

// Edges of surfaces between rays, where a picture may be coarse.
TEST_F(Lattice, CoarseTolerances)
{
  for (const double tolerance : { 4.0 / 255, 16.0 / 255, 64.0 / 255 })
  {
    for (const OpacityShape shape : { OpacityShape::Ramp, OpacityShape::Peak, OpacityShape::Wall })
    {
      Stage stage(280, 260);
      ImageOptions options;
      options.Dimensions = { 64, 64, 64 };
      stage.SetImage(MakeImage(options, Spheres));
      stage.SetTransfer(MakeTransfer(shape));
      stage.Look({ 0.5, 0.8, 1 }, 0.9);
      Compare(
        stage, "tolerance " + std::to_string(255 * tolerance) + ", " + ToString(shape), tolerance);
    }
  }
}

// Stripes of one voxel on a face along which the rays run nearly: one row of pixels meets a stripe,
// the next one what lies between.
TEST_F(Lattice, StripesOnGrazingFaces)
{
  ImageOptions options;
  options.Dimensions = { 64, 64, 64 };
  const auto image = MakeImage(
    options, [](double x, double y, double) { return 0.4 + 0.2 * x + 0.2 * std::cos(126 * y); });
  for (const double height : { 70.0, 74.0, 80.0, 90.0 })
  {
    Stage stage(280, 260);
    stage.SetImage(image);
    stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    stage.LookFrom({ 33, -20, height }, { 31, 40, 55 }, 1, 200, 60);
    for (const double tolerance : { 1.0 / 255, 16.0 / 255 })
    {
      Compare(stage,
        "from " + std::to_string(height) + ", tolerance " + std::to_string(255 * tolerance),
        tolerance);
    }
  }
}

// Rays that graze a translucent surface within the volume: what lies between them may look smooth
// by chance. Beside such pixels are others where interpolation is seen to be wrong.
TEST_F(Lattice, GrazedSurfaces)
{
  constexpr int edge = 64;
  constexpr double pi = 3.14159265358979323846;
  vtkNew<vtkImageData> image;
  image->SetDimensions(edge, edge, edge);
  image->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
  auto* voxel = static_cast<unsigned char*>(image->GetScalarPointer());
  const auto at = [](int i) { return 2.0 * i / (edge - 1) - 1; };
  for (int k = 0; k < edge; ++k)
  {
    for (int j = 0; j < edge; ++j)
    {
      for (int i = 0; i < edge; ++i)
      {
        // Marschner, Lobb: An evaluation of reconstruction filters for volume rendering, 1994.
        const double ring = std::cos(12 * pi * std::cos(pi / 2 * std::hypot(at(i), at(j))));
        const double value = (1 - std::sin(pi / 2 * at(k)) + 0.25 * (1 + ring)) / 2.5;
        *voxel++ = static_cast<unsigned char>(255 * value);
      }
    }
  }
  TransferNodes nodes;
  nodes.Opacity = { { 0, 0 }, { 110, 0 }, { 127, 0.25 }, { 145, 0 }, { 255, 0 } };
  nodes.Color = { { 0, 0, 0, 1 }, { 110, 0.2, 0.4, 1 }, { 127, 1, 0.9, 0.3 }, { 145, 1, 0.2, 0.1 },
    { 255, 1, 1, 1 } };
  struct View
  {
    std::array<double, 3> Eye, At, Up;
  };
  const std::array<View, 2> views{
    View{ { -52.42, -45.3, 23.22 }, { 24.69, 32.99, 27.06 }, { -1.29, -0.05, 0.88 } },
    View{ { -69.36, 110.11, 10.77 }, { 29.59, 30.97, 35.59 }, { 0.05, 0.96, -0.91 } },
  };
  Stage stage(300, 300);
  stage.SetImage(image);
  stage.SetTransfer(nodes);
  for (const View& v : views)
  {
    stage.LookFrom(v.Eye, v.At, 1, 400, 30);
    stage.Renderer->GetActiveCamera()->SetViewUp(v.Up.data());
    const Comparison c =
      Compare(stage, "from " + std::to_string(v.Eye[0]) + ", tolerance 4", 4.0 / 255);
    EXPECT_LT(c.Effort, 0.97); // something was interpolated
  }
  // What is cast on account of that doesn't depend on what fits into the atlas.
  stage.SetSource(SourceOfImage(image, 16, false));
  stage.Mapper->PictureReuseOff();
  const std::vector<float> picture = stage.Draw();
  stage.Mapper->SetMaximumNumberOfSlots(12);
  EXPECT_EQ(stage.Draw(), picture);
  EXPECT_GT(stage.Mapper->GetNumberOfEvictions(), 12);
}

// With many pixels per voxel there is less and less to be cast.
TEST_F(Lattice, Magnified)
{
  for (const bool shade : { false, true })
  {
    Stage stage(280, 260);
    ImageOptions options;
    options.Dimensions = { 20, 20, 20 };
    stage.SetImage(MakeImage(options));
    stage.SetTransfer(MakeTransfer(OpacityShape::Fog));
    stage.SetShade(shade);
    stage.Look({ 0.5, 0.8, 1 }, 1.1);
    EXPECT_LT(Compare(stage, shade ? "magnified, shaded" : "magnified").Effort, 0.4);
  }
}

// A single voxel, of which only the tip can be seen, is never lost between rays: neither on an
// empty background nor in front of a smooth one.
TEST_F(Lattice, NoSpotIsLost)
{
  for (const bool empty : { true, false })
  {
    for (const int size : { 135, 150, 260 })
    {
      for (unsigned seed = 1; seed <= 4; ++seed)
      {
        Stage stage(size, size);
        stage.SetImage(Spots(60, seed));
        TransferNodes nodes;
        nodes.Opacity = { { 0, 0 }, { 60, empty ? 0 : 0.01 }, { 205, empty ? 0 : 0.01 },
          { 220, 0.9 }, { 255, 0.95 } };
        nodes.Color = { { 0, 0.3, 0.3, 0.3 }, { 60, 0.4, 0.4, 0.3 }, { 200, 0.4, 0.4, 0.3 },
          { 210, 1, 0.8, 0.2 }, { 255, 1, 0.9, 0.4 } };
        stage.SetTransfer(nodes);
        stage.Look({ 0.4 + 0.1 * seed, 1, -0.3 }, 1.1);
        const Comparison c = Compare(stage,
          std::string(empty ? "spots" : "spots in fog") + ", " + std::to_string(size) +
            " pixels, seed " + std::to_string(seed));
        EXPECT_LT(c.Effort, 1.0); // something was interpolated
      }
    }
  }
}

// Slabs between clipping planes that are thinner than a pixel, and wires thinner than that.
TEST_F(Lattice, CutsAndWires)
{
  Stage stage(240, 240);
  ImageOptions options;
  options.Dimensions = { 48, 48, 48 };
  stage.SetImage(MakeImage(options));
  stage.SetTransfer(MakeTransfer(OpacityShape::Fog, 0, 255, 0.05));
  stage.Look({ 0, 0, 1 }, 1.2);
  for (const double thickness : { 0.1, 0.4 })
  {
    for (const double turn : { 0.0, 0.3 })
    {
      stage.Mapper->RemoveAllClippingPlanes();
      for (const int side : { -1, 1 })
      {
        vtkNew<vtkPlane> plane;
        plane->SetNormal(-side * std::cos(turn), -side * std::sin(turn), 0);
        plane->SetOrigin(23.77 + side * std::cos(turn) * thickness / 2,
          21.3 + side * std::sin(turn) * thickness / 2, 0);
        stage.Mapper->AddClippingPlane(plane);
      }
      Compare(stage, "slab of " + std::to_string(thickness) + " at " + std::to_string(turn));
    }
  }
  stage.Mapper->RemoveAllClippingPlanes();
  stage.SetTransfer(MakeTransfer(OpacityShape::Fog));
  for (int i = 0; i < 7; ++i)
  {
    vtkNew<vtkCylinderSource> wire;
    wire->SetHeight(90);
    wire->SetRadius(0.12);
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputConnection(wire->GetOutputPort());
    vtkNew<vtkActor> actor;
    actor->SetMapper(mapper);
    actor->SetPosition(4 + 6.3 * i, 24, 20 + 3 * i);
    actor->RotateZ(7.0 * i);
    stage.Renderer->AddActor(actor);
  }
  const Comparison c = Compare(stage, "wires");
  EXPECT_LT(c.Effort, 0.9);
}

// Which pixels are interpolated depends neither on what is skipped nor on what fits into the atlas
// nor on what is counted and estimated.
TEST_F(Lattice, SameBits)
{
  for (const OpacityShape shape : { OpacityShape::Wall, OpacityShape::Fog })
  {
    Stage stage(240, 220);
    ImageOptions options;
    options.Dimensions = { 64, 72, 60 };
    stage.SetSource(SourceOfImage(MakeImage(options), 8, false));
    stage.SetTransfer(MakeTransfer(shape));
    stage.Look({ 0.5, 0.8, 1 }, 1.1);
    stage.Mapper->PictureReuseOff();
    const std::vector<float> picture = stage.Draw();
    ASSERT_TRUE(stage.Mapper->IsConverged());
    EXPECT_NE(DrawCast(stage), picture) << "nothing is interpolated";
    stage.Mapper->EmptySpaceSkippingOff();
    EXPECT_EQ(stage.Draw(), picture) << "without skipping";
    stage.Mapper->EmptySpaceSkippingOn();
    stage.Mapper->ErrorEstimateOn();
    stage.Mapper->CountSamplesOn();
    EXPECT_EQ(stage.Draw(), picture) << "with an estimate";
    stage.Mapper->ErrorEstimateOff();
    const vtkTypeUInt64 before = stage.Mapper->GetNumberOfEvictions();
    stage.Mapper->SetMaximumNumberOfSlots(12);
    EXPECT_EQ(stage.Draw(), picture) << "with 12 slots";
    EXPECT_GT(stage.Mapper->GetNumberOfEvictions(), before + 12);
  }
}

// VTK's own properties rule it.
TEST_F(Lattice, PropertiesOfSampleDistances)
{
  Stage stage(260, 240);
  ImageOptions options;
  options.Dimensions = { 32, 32, 32 };
  stage.SetImage(MakeImage(options));
  stage.SetTransfer(MakeTransfer(OpacityShape::Fog));
  stage.Look({ 0.5, 0.8, 1 }, 1.1);
  stage.Mapper->CountSamplesOn();
  stage.Mapper->PictureReuseOff();
  const auto samplesAt = [&](float most)
  {
    stage.Mapper->SetMaximumImageSampleDistance(most);
    stage.Draw();
    return stage.Mapper->GetNumberOfSamples();
  };
  const std::vector<float> cast = DrawCast(stage);
  const vtkTypeUInt64 all = stage.Mapper->GetNumberOfSamples();
  EXPECT_EQ(samplesAt(1), all);
  EXPECT_EQ(stage.Accumulator(), cast);
  const vtkTypeUInt64 two = samplesAt(2);
  const vtkTypeUInt64 ten = samplesAt(10);
  EXPECT_LT(two, all * 6 / 10);
  EXPECT_LT(ten, two);
  EXPECT_EQ(samplesAt(4), ten);
  stage.Mapper->SetImageErrorTolerance(0);
  const std::vector<float> fixed = stage.Draw();
  EXPECT_EQ(DrawCast(stage), fixed) << "a tolerance of 0 is no tolerance";
}

// A picture that is broken off has no holes: pixels whose rays weren't cast look like the ray that
// was to be cast before them.
TEST_F(Lattice, NoHolesWhenAborted)
{
  Stage stage(256, 256);
  ImageOptions options;
  options.Dimensions = { 40, 40, 40 };
  const auto source =
    std::make_shared<FaultyBrickSource>(SourceOfImage(MakeImage(options), 8, false));
  // The first 24 bricks come, then no more.
  std::atomic<int> reads{ 0 };
  source->SetFaults(
    [&](const BrickKey&)
    {
      if (++reads == 24)
      {
        source->CloseGate();
      }
      return Fault();
    });
  stage.SetSource(source);
  stage.SetTransfer(MakeTransfer(OpacityShape::Fog));
  stage.Look({ 0.5, 0.8, 1 }, 1.1);
  vtkNew<vtkCallbackCommand> abort;
  int polls = 0;
  abort->SetClientData(&polls);
  abort->SetCallback(
    [](vtkObject* caller, unsigned long, void* data, void*)
    {
      if (++*static_cast<int*>(data) == 12)
      {
        static_cast<vtkRenderWindow*>(caller)->SetAbortRender(1);
      }
    });
  stage.Window->AddObserver(vtkCommand::AbortCheckEvent, abort);
  const std::vector<float> picture = stage.Draw();
  source->OpenGate();
  ASSERT_FALSE(stage.Mapper->IsConverged());
  int shown = 0;
  for (int y = 0; y < 256; ++y)
  {
    for (int x = 0; x < 256; ++x)
    {
      const float* here = &picture[4 * static_cast<std::size_t>(y * 256 + x)];
      const float* ray = &picture[4 * static_cast<std::size_t>((y & ~3) * 256 + (x & ~3))];
      ASSERT_TRUE(std::equal(here, here + 4, ray)) << x << " " << y;
      shown += here[3] > 0 ? 1 : 0;
    }
  }
  EXPECT_GT(shown, 1000);
}
