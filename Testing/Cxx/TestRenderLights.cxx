// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Lights of all kinds: against the reference integrator with highlights, against VTK's own mapper
// without them. VTK 9.1 draws the highlight of the last directional light only, for a view that is
// mirrored, and that of positional lights for a view from behind (see TruthLights.h). The tolerance
// against VTK is that of TestRenderVTK.cxx.
#include "BesideVTK.h"
#include "ExpectTruth.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <gtest/gtest.h>
#include <vtkImageData.h>
#include <vtkLight.h>
#include <vtkLightCollection.h>
#include <vtkLightKit.h>
#include <vtkRenderer.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr int BrickEdge = 16;

vtkSmartPointer<vtkLight> AddLight(
  Stage& stage, const Double3& from, const Double3& color = { 1, 1, 1 }, double intensity = 1)
{
  auto light = vtkSmartPointer<vtkLight>::New();
  light->SetLightTypeToSceneLight();
  light->SetPosition(from[0], from[1], from[2]);
  light->SetFocalPoint(20, 18, 22);
  light->SetColor(color[0], color[1], color[2]);
  light->SetIntensity(intensity);
  stage.Renderer->AddLight(light);
  return light;
}

class Lit : public testing::Test
{
protected:
  Lit()
    : Source(SourceOfImage(Both.Image, BrickEdge, false))
  {
    Stage& stage = this->Both.Shown;
    stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    stage.SetShade(true);
    stage.Look({ 0.4, 1, -0.3 }, 0.8);
    stage.Renderer->AutomaticLightCreationOff();
    stage.Renderer->RemoveAllLights();
  }
  void CompareWithVTK(const std::string& name, double most = 6)
  {
    this->Both.Shown.Property->SetSpecular(0);
    this->Both.Expect(name + ", VTK", { 1, most });
    if (const char* folder = std::getenv("TERAVOX_SAVE_PICTURES"))
    {
      std::string file = std::string(folder) + "/" + name + ".png";
      std::replace(file.begin(), file.end(), ' ', '-');
      this->Both.Save(file);
    }
    this->Both.Shown.Property->SetSpecular(0.3);
  }
  void Compare(const std::string& name, double most = 6)
  {
    this->CompareWithVTK(name, most);
    ExpectTruth(this->Both.Shown, *this->Source, name);
  }
  BesideVTK Both{ {}, 40 };
  std::shared_ptr<BrickSource> Source;
};

} // namespace

TEST_F(Lit, OneSceneLight)
{
  Stage& stage = this->Both.Shown;
  const auto light = AddLight(stage, { 100, -40, 60 }, { 1, 0.8, 0.5 });
  this->Compare("scene light");
  stage.Renderer->TwoSidedLightingOff();
  this->Compare("scene light, one-sided");
  stage.Renderer->TwoSidedLightingOn();
  light->SetAmbientColor(0.5, 0.1, 0.9);
  light->SetIntensity(0.7);
  this->Compare("scene light with an ambient part");
  stage.Look({ -1, 0.4, 0.2 }, 0.7, true);
  this->Compare("scene light, parallel");
  stage.Property->SetInterpolationTypeToNearest();
  this->Compare("scene light, parallel, nearest");
}

TEST_F(Lit, CameraLightsAndKit)
{
  Stage& stage = this->Both.Shown;
  vtkNew<vtkLight> camera;
  camera->SetLightTypeToCameraLight();
  camera->SetPosition(1, 1, 0.5);
  camera->SetFocalPoint(0, 0, 0);
  stage.Renderer->AddLight(camera);
  this->Compare("camera light");
  stage.Renderer->RemoveAllLights();
  vtkNew<vtkLightKit> kit;
  kit->AddLightsToRenderer(stage.Renderer);
  this->Compare("light kit");
}

TEST_F(Lit, ManyLightsAndOneSwitchedOff)
{
  Stage& stage = this->Both.Shown;
  vtkNew<vtkLight> head;
  head->SetLightTypeToHeadlight();
  head->SetIntensity(0.4);
  stage.Renderer->AddLight(head);
  this->Compare("dim headlight");
  const std::vector<float> alone = stage.Draw();
  const auto off = AddLight(stage, { -100, -40, 60 }, { 0, 1, 0 });
  off->SwitchOff();
  EXPECT_TRUE(AreImagesIdentical(alone, stage.Draw())) << "a light that is off";
  AddLight(stage, { 100, -40, 60 }, { 1, 0.2, 0.1 }, 0.5);
  AddLight(stage, { 10, -90, -60 }, { 0.1, 0.2, 1 }, 0.5);
  this->Compare("three lights");
  AddLight(stage, { 10, 90, 60 }, { 0.1, 0.9, 0.3 }, 0.3);
  AddLight(stage, { -30, 20, 60 }, { 0.9, 0.9, 0.3 }, 0.3);
  AddLight(stage, { 30, -20, 90 }, { 0.1, 0.9, 0.9 }, 0.3);
  this->Compare("six lights");
  off->SwitchOn(); // VTK 9.1 has room for six
  for (int i = 0; i < 5; ++i)
  {
    AddLight(stage, { 30.0 * i - 60, -80, 20.0 * i }, { 1, 1, 1 }, 0.05);
  }
  ExpectTruth(stage, *this->Source, "twelve lights");
}

TEST_F(Lit, PositionalWithConeAndAttenuation)
{
  Stage& stage = this->Both.Shown;
  const auto light = AddLight(stage, { 30, -10, 40 }, { 1, 1, 0.8 });
  light->SetPositional(1);
  light->SetConeAngle(180);
  this->Compare("positional");
  light->SetAttenuationValues(0.3, 0.02, 0.0005);
  this->Compare("positional with attenuation");
  // The edge of a cone is a jump, which VTK meets to a sample; and close to a light directions
  // change as fast as its normals are off. The truth is met as everywhere.
  light->SetConeAngle(25);
  light->SetExponent(4);
  this->Compare("spot", 10);
  stage.Property->SetInterpolationTypeToNearest();
  this->Compare("spot, nearest", 10);
  stage.Property->SetInterpolationTypeToLinear();
  AddLight(stage, { 100, -40, 60 }, { 0.2, 0.4, 1 }, 0.5);
  this->Compare("spot and scene light", 10);
  light->SetPosition(22, 20, 30);
  light->SetFocalPoint(5, 10, 20);
  this->Compare("spot inside", 20);
}

// Without any light a volume is black; before a blue background that can be seen.
TEST_F(Lit, NoLight)
{
  this->Both.Shown.Renderer->SetBackground(0.5, 0.7, 1);
  this->Both.Shown.Property->SetAmbient(0.5);
  this->CompareWithVTK("no light");
}

// Transformed and stretched: normals turn with the volume. VTK 9.1 is another matter there.
TEST(LitVolumes, MovedTurnedAndStretched)
{
  ImageOptions options;
  options.Origin = { 3, -2, 5 };
  options.Spacing = { 1, 0.8, 1.3 };
  const double c = std::cos(0.6);
  const double s = std::sin(0.6);
  options.Direction = { c, -s, 0, s, c, 0, 0, 0, 1 };
  const auto image = MakeImage(options);
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(40, 40);
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.SetImage(image);
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.SetShade(true);
  stage.Volume->SetPosition(5, -20, 8);
  stage.Volume->RotateX(25);
  stage.Volume->SetScale(1.6, 0.7, 1.1);
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
  stage.Renderer->RemoveAllLights();
  AddLight(stage, { 100, -40, 60 }, { 1, 0.8, 0.5 });
  const auto spot = AddLight(stage, { 30, -10, 40 }, { 0.2, 0.4, 1 });
  spot->SetPositional(1);
  spot->SetConeAngle(40);
  ExpectTruth(stage, *source, "transformed, scene light and spot");
}

TEST(LitVolumes, SameBits)
{
  ImageOptions options;
  options.Dimensions = { 96, 80, 112 };
  const auto source = SourceOfImage(MakeImage(options), BrickEdge, false);
  std::vector<float> first;
  for (const vtkTypeUInt32 limit : { 0u, 12u })
  {
    for (const bool skip : { true, false })
    {
      Stage stage(48, 48);
      stage.SetSource(source);
      stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
      stage.SetShade(true);
      stage.Renderer->RemoveAllLights();
      AddLight(stage, { 100, -40, 60 }, { 1, 0.8, 0.5 });
      const auto spot = AddLight(stage, { 70, -10, 90 }, { 0.2, 0.4, 1 });
      spot->SetPositional(1);
      spot->SetConeAngle(30);
      stage.Mapper->SetMaximumNumberOfSlots(limit);
      stage.Mapper->SetArrivalShuffleSeed(limit);
      stage.Mapper->SetEmptySpaceSkipping(skip);
      stage.LookFrom({ 30, -12, 40 }, { 50, 60, 60 }, 0.5, 400, 65);
      const std::vector<float> picture = stage.Draw();
      EXPECT_TRUE(stage.Mapper->IsConverged());
      first = first.empty() ? picture : first;
      EXPECT_GT(*std::max_element(first.begin(), first.end()), 0.1f);
      EXPECT_TRUE(AreImagesIdentical(first, picture)) << limit << " slots, skipping " << skip;
    }
  }
}
