// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Numerical stability against the reference integrator: scales and places of the volume, rays along
// axes and through faces, edges and corners, places of the eye, matrices.
#include "ExpectTruth.h"
#include "Scene.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <vtkCamera.h>
#include <vtkImageData.h>
#include <vtkMatrix4x4.h>
#include <vtkRenderer.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr int BrickEdge = 16;

// A stage with an image, its truth, and a camera in voxels of the image.
struct DrawnImage
{
  explicit DrawnImage(const ImageOptions& options, int size = 32)
    : Shown(size, size)
    , Options(options)
    , Image(MakeImage(options))
    , Source(SourceOfImage(Image, BrickEdge, false))
  {
    this->Shown.Mapper->SetBrickSize(BrickEdge);
    this->Shown.SetImage(this->Image);
    // A voxel of any size weighs as much as one of size 1.
    this->UnitDistance = *std::min_element(options.Spacing.begin(), options.Spacing.end());
    this->SetShape(OpacityShape::Ramp);
  }
  void SetShape(OpacityShape shape)
  {
    this->Shown.SetTransfer(
      MakeTransfer(shape, this->Options.Low, this->Options.High, this->UnitDistance));
  }
  void Expect(const std::string& name, const Bounds& bounds = {})
  {
    ExpectTruth(this->Shown, *this->Source, name, bounds);
  }

  Stage Shown;
  ImageOptions Options;
  vtkSmartPointer<vtkImageData> Image;
  std::shared_ptr<BrickSource> Source;
  double UnitDistance = 1;
};

// Perspective and parallel, shaded and not, ramp and wall.
void ExpectFromOutside(DrawnImage& drawn, const std::string& name)
{
  for (const bool shade : { false, true })
  {
    drawn.Shown.SetShade(shade);
    for (const OpacityShape shape : { OpacityShape::Ramp, OpacityShape::Wall })
    {
      drawn.SetShape(shape);
      for (const bool parallel : { false, true })
      {
        drawn.Shown.Look({ 0.5, 1, -0.6 }, 0.8, parallel);
        drawn.Expect(name + ", " + ToString(shape) + (parallel ? ", parallel" : ", perspective") +
          (shade ? ", shaded" : ""));
      }
    }
  }
}

// Parallel rays along an axis, `pitch` voxels apart; one of them goes through `through`.
void LookAlong(
  Stage& stage, int axis, double sign, const std::array<double, 3>& through, double pitch)
{
  vtkCamera* camera = stage.Renderer->GetActiveCamera();
  std::array<double, 3> focus = through;
  for (int a = 0; a < 3; ++a)
  {
    if (a != axis && stage.Width() % 2 == 0)
    {
      focus[static_cast<std::size_t>(a)] += 0.5 * pitch; // pixel centres lie beside the middle
    }
  }
  std::array<double, 3> eye = focus;
  eye[static_cast<std::size_t>(axis)] -= 100 * sign;
  camera->SetParallelProjection(1);
  camera->SetFocalPoint(focus.data());
  camera->SetPosition(eye.data());
  camera->SetViewUp(axis == 2 ? 1 : 0, 0, axis == 2 ? 0 : 1);
  camera->SetParallelScale(0.5 * stage.Height() * pitch);
  camera->SetClippingRange(1, 300);
}

} // namespace

TEST(Stability, TinySpacing)
{
  ImageOptions options;
  options.Spacing = { 1e-9, 1.2e-9, 0.9e-9 };
  DrawnImage drawn(options);
  ExpectFromOutside(drawn, "1e-9");
}

TEST(Stability, HugeSpacing)
{
  ImageOptions options;
  options.Spacing = { 1e20, 1.2e20, 0.9e20 };
  DrawnImage drawn(options);
  ExpectFromOutside(drawn, "1e20");
}

TEST(Stability, UnequalSpacing)
{
  ImageOptions options;
  options.Dimensions = { 40, 12, 44 };
  options.Spacing = { 1, 1000, 1 };
  DrawnImage drawn(options);
  for (const bool shade : { false, true })
  {
    drawn.Shown.SetShade(shade);
    for (const OpacityShape shape : { OpacityShape::Ramp, OpacityShape::Wall })
    {
      const std::string suffix = std::string(ToString(shape)) + (shade ? ", shaded" : "");
      // Seen as a whole: a pixel is some 300 voxels wide on two axes.
      drawn.UnitDistance = 1;
      drawn.SetShape(shape);
      drawn.Shown.Look({ 0.5, 0.2, -0.6 }, 0.8);
      drawn.Expect("1:1000:1, from far, " + suffix);
      // From near, voxels of the thin axes are seen.
      drawn.UnitDistance = 10;
      drawn.SetShape(shape);
      drawn.Shown.LookFrom({ -30, 4700, -40 }, { 20, 4800, 22 }, 1, 13000, 45);
      drawn.Expect("1:1000:1, across, " + suffix);
      drawn.UnitDistance = 1000;
      drawn.SetShape(shape);
      drawn.Shown.LookFrom({ 18, -6000, 20 }, { 20, 6000, 22 }, 1000, 20000, 0.5);
      drawn.Expect("1:1000:1, along, " + suffix);
      drawn.Shown.LookFrom({ 1, -60, 3 }, { 25, 12000, 26 }, 1, 20000, 0.5);
      drawn.Expect("1:1000:1, nearly along, " + suffix);
    }
  }
}

TEST(Stability, FarFromTheOrigin)
{
  ImageOptions options;
  options.Origin = { 6.2e6, -6.2e6, 6.2e6 };
  options.Spacing = { 0.5, 0.5, 0.5 };
  DrawnImage drawn(options);
  ExpectFromOutside(drawn, "origin 6.2e6");
}

TEST(Stability, NearlyParallelRays)
{
  for (const double angle : { 1.0, 0.01, 0.0001 })
  {
    DrawnImage drawn(ImageOptions{});
    for (const bool shade : { false, true })
    {
      drawn.Shown.SetShade(shade);
      for (const OpacityShape shape : { OpacityShape::Ramp, OpacityShape::Wall })
      {
        drawn.SetShape(shape);
        const double radius = 35;
        const double away = radius / std::sin(0.5 * angle * M_PI / 180);
        const double d = away / std::sqrt(0.5 * 0.5 + 1 + 0.6 * 0.6);
        drawn.Shown.LookFrom({ 20 - 0.5 * d, 18 - d, 22 + 0.6 * d }, { 20, 18, 22 }, away - radius,
          away + radius, angle);
        drawn.Expect("view angle " + std::to_string(angle) + ", " + ToString(shape) +
          (shade ? ", shaded" : ""));
      }
    }
  }
}

// Rays at multiples of half a voxel: along the faces of interpolation cells, the faces of bricks,
// and grazing those of the box, where the envelope holds both sides.
TEST(Stability, RaysAlongAxes)
{
  DrawnImage drawn({}, 48);
  for (int axis = 0; axis < 3; ++axis)
  {
    for (const double sign : { 1.0, -1.0 })
    {
      drawn.SetShape(OpacityShape::Ramp);
      LookAlong(drawn.Shown, axis, sign, { 16, 16, 16 }, 0.5);
      drawn.Expect(std::string(sign > 0 ? "+" : "-") + "xyz"[axis] + ", pitch 1/2");
      drawn.Shown.SetShade(true);
      LookAlong(drawn.Shown, axis, sign, { 15.5, 15.5, 15.5 }, 1);
      drawn.Expect(std::string(sign > 0 ? "+" : "-") + "xyz"[axis] + ", faces of bricks, shaded");
      drawn.Shown.SetShade(false);
      drawn.SetShape(OpacityShape::Fog);
      LookAlong(drawn.Shown, axis, sign, { 0, 0, 0 }, 1);
      drawn.Expect(std::string(sign > 0 ? "+" : "-") + "xyz"[axis] + ", grazing the box");
    }
  }
}

// The middle ray goes through corners of bricks, along diagonals of space and faces: all three, or
// two, faces at once.
TEST(Stability, RaysThroughEdgesAndCornersOfBricks)
{
  ImageOptions options;
  options.Dimensions = { 48, 48, 48 };
  DrawnImage drawn(options, 33);
  for (const OpacityShape shape : { OpacityShape::Ramp, OpacityShape::Fog })
  {
    drawn.SetShape(shape);
    for (const std::array<double, 3>& d : { std::array<double, 3>{ 1, 1, 1 },
           std::array<double, 3>{ -1, 1, 1 }, std::array<double, 3>{ 1, 1, 0 },
           std::array<double, 3>{ 0, -1, 1 }, std::array<double, 3>{ 2, 1, 0 } })
    {
      for (const double at : { 15.5, 16.0 }) // a corner of bricks; a voxel centre
      {
        const double c = at;
        const auto name = [&](const char* how)
        {
          return std::string(ToString(shape)) + ", corner " + std::to_string(c).substr(0, 4) +
            ", along " + std::to_string(int(d[0])) + std::to_string(int(d[1])) +
            std::to_string(int(d[2])) + how;
        };
        const double away = 64;
        drawn.Shown.LookFrom(
          { c - away * d[0], c - away * d[1], c - away * d[2] }, { c, c, c }, 1, 300, 30);
        drawn.Expect(name(", perspective"));
        vtkCamera* camera = drawn.Shown.Renderer->GetActiveCamera();
        camera->SetParallelProjection(1);
        camera->SetParallelScale(20);
        drawn.Expect(name(", parallel"));
      }
    }
  }
}

TEST(Stability, EyeOnFacesAndCentres)
{
  DrawnImage drawn({}, 21);
  struct Place
  {
    const char* Name;
    std::array<double, 3> Eye;
  };
  for (const Place& place : { Place{ "face of a brick", { 15.5, 20.25, 21.75 } },
         Place{ "edge of bricks", { 15.5, 15.5, 21.75 } },
         Place{ "corner of bricks", { 15.5, 15.5, 15.5 } }, Place{ "voxel centre", { 17, 14, 20 } },
         Place{ "face of a cell", { 17, 14.3, 20.6 } }, Place{ "inside", { 17.37, 14.21, 20.66 } },
         Place{ "face of the box", { 0, 17.3, 20.2 } }, Place{ "corner of the box", { 0, 0, 0 } },
         Place{ "far corner of the box", { 39, 35, 43 } } })
  {
    for (const bool along : { false, true })
    {
      std::array<double, 3> at{ 20.2, 18.1, 22.3 };
      if (along)
      {
        at = place.Eye; // straight along an axis, towards the middle
        at[0] += place.Eye[0] > 20 ? -10 : 10;
      }
      for (const bool shade : { false, true })
      {
        drawn.Shown.SetShade(shade);
        // The near plane is where a shader's samples begin: right at the eye, and a voxel off.
        for (const double near : { 1e-3, 1.0 })
        {
          drawn.Shown.LookFrom(place.Eye, at, near, 100, 60);
          drawn.Expect(std::string(place.Name) + (along ? ", along x" : ", oblique") +
            (near < 0.1 ? "" : ", near plane at 1") + (shade ? ", shaded" : ""));
        }
      }
    }
  }
}

// What vtkImageData's direction matrix can't hold: VTK's user matrix of the prop.
TEST(Stability, ShearedAndMirrored)
{
  struct Case
  {
    const char* Name;
    std::array<double, 16> Matrix;
  };
  for (const Case& c : { Case{ "sheared", { 1, 0.7, 0, 3, 0, 1, 0, 0, 0, -0.4, 1, 0, 0, 0, 0, 1 } },
         Case{ "mirrored", { -1, 0, 0, 50, 0, 1, 0, 2, 0, 0, 1, 0, 0, 0, 0, 1 } },
         Case{ "sheared, mirrored, stretched",
           { 1, 0.3, 0.2, 0, 0, -1.5, 0.6, 10, 0.5, 0, 0.7, -4, 0, 0, 0, 1 } },
         Case{ "strongly sheared", { 1, 5, 0, 0, 0, 1, 0, 0, 0, 3, 1, 0, 0, 0, 0, 1 } } })
  {
    ImageOptions options;
    options.Direction = { 0.8, -0.6, 0, 0.6, 0.8, 0, 0, 0, -1 }; // left-handed itself
    DrawnImage drawn(options);
    vtkNew<vtkMatrix4x4> matrix;
    matrix->DeepCopy(c.Matrix.data());
    drawn.Shown.Volume->SetUserMatrix(matrix);
    ExpectFromOutside(drawn, c.Name);
  }
}
