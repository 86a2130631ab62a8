// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "BenchScenes.h"

#include "View.h"

#include <fmt/format.h>
#include <utility>
#include <vtkCamera.h>
#include <vtkColorTransferFunction.h>
#include <vtkNew.h>
#include <vtkPiecewiseFunction.h>
#include <vtkVolumeProperty.h>

namespace teravox::program
{
namespace
{

using OpacityNodes = std::vector<std::array<double, 2>>;
using ColorNodes = std::vector<std::array<double, 4>>;

constexpr double Max8 = 255;
constexpr double Max16 = 65535;

/// Dark red to white through flesh.
ColorNodes Warm(double low, double high)
{
  const auto at = [=](double t) { return low + t * (high - low); };
  return { { at(0), 0.3, 0.05, 0.02 }, { at(0.3), 0.6, 0.25, 0.15 }, { at(0.6), 0.95, 0.75, 0.6 },
    { at(1), 1, 1, 0.95 } };
}

/// Blue to red through green, so that neighbouring values differ in colour.
ColorNodes Spectrum(double low, double high)
{
  const auto at = [=](double t) { return low + t * (high - low); };
  return { { at(0), 0.1, 0.2, 0.9 }, { at(0.35), 0.1, 0.8, 0.7 }, { at(0.65), 0.9, 0.9, 0.2 },
    { at(1), 0.9, 0.15, 0.1 } };
}

OpacityNodes Scaled(OpacityNodes nodes, double high)
{
  for (auto& node : nodes)
  {
    node[0] *= high;
  }
  return nodes;
}

BenchScene MakeScene(const char* name, const char* description, BenchField field, int size,
  OpacityNodes opacity, ColorNodes color, double unitDistance = 1)
{
  BenchScene scene;
  scene.Name = name;
  scene.Description = description;
  scene.Field = field;
  scene.Size = size;
  scene.Opacity = std::move(opacity);
  scene.Color = std::move(color);
  scene.UnitDistance = unitDistance;
  return scene;
}

BenchScene Zoomed(BenchScene scene, const char* suffix, const char* description, double zoom)
{
  scene.Name += suffix;
  scene.Description += description;
  scene.Zoom = zoom;
  return scene;
}

void AddScans(std::vector<BenchScene>& scenes)
{
  scenes.push_back(MakeScene("brain-surface", "MRI head, its skin", BenchField::Brain, 0,
    { { 0, 0 }, { 60, 0 }, { 80, 0.6 }, { 255, 0.9 } }, Warm(40, 255)));
  scenes.push_back(Zoomed(scenes.back(), "-near", ", magnified", 5));
  scenes.push_back(MakeScene("brain-fog", "MRI head, translucent", BenchField::Brain, 0,
    { { 0, 0 }, { 30, 0 }, { 100, 0.01 }, { 180, 0.04 }, { 255, 0.1 } }, Spectrum(30, 255)));
  scenes.push_back(MakeScene("head-bone", "CT head, its bone", BenchField::Head, 0,
    { { -1024, 0 }, { 250, 0 }, { 450, 0.7 }, { 3071, 0.9 } }, Warm(0, 1500)));
  scenes.push_back(MakeScene("head-fog", "CT head, translucent", BenchField::Head, 0,
    { { -1024, 0 }, { -600, 0 }, { -250, 0.03 }, { 0, 0.008 }, { 150, 0.02 }, { 350, 0.08 },
      { 1500, 0.4 } },
    Spectrum(-500, 1200)));
}

void AddFormulas(std::vector<BenchScene>& scenes, int size)
{
  const auto name = [size](const char* base) { return fmt::format("{}-{}", base, size); };
  const double unit = size / 256.0;
  const OpacityNodes thin{ { 0, 0.002 }, { 1, 0.012 } };
  const OpacityNodes medium{ { 0, 0.004 }, { 0.5, 0.02 }, { 1, 0.08 } };
  const OpacityNodes kinks{ { 0, 0 }, { 0.45, 0 }, { 0.55, 0.1 }, { 0.6, 0.02 }, { 0.8, 0.3 },
    { 1, 0.3 } };
  const OpacityNodes peaks{ { 0, 0 }, { 0.3, 0 }, { 0.31, 0.5 }, { 0.32, 0 }, { 0.6, 0 },
    { 0.605, 0.7 }, { 0.61, 0 }, { 1, 0 } };
  scenes.push_back(MakeScene(name("shells").c_str(), "sparse, four shells", BenchField::Shells,
    size, Scaled({ { 0, 0 }, { 0.4, 0 }, { 0.65, 0.6 }, { 1, 0.6 } }, Max8), Warm(0, Max8)));
  scenes.push_back(MakeScene(name("sponge").c_str(), "sparse, Menger's sponge", BenchField::Sponge,
    size, Scaled({ { 0, 0 }, { 0.5, 0 }, { 0.8, 0.8 }, { 1, 0.8 } }, Max8), Spectrum(0, Max8)));
  scenes.push_back(MakeScene(name("dense").c_str(), "smooth waves, nothing empty",
    BenchField::Dense, size, Scaled(medium, Max16), Spectrum(0, Max16), unit));
  scenes.push_back(MakeScene(name("fog").c_str(), "translucent, Marschner-Lobb", BenchField::Fog,
    size, Scaled(thin, Max16), Spectrum(0, Max16), unit));
  scenes.push_back(MakeScene(name("noise").c_str(), "noise, an opacity with kinks",
    BenchField::Noise, size, Scaled(kinks, Max16), Spectrum(0, Max16), unit));
  scenes.push_back(MakeScene(name("peaks").c_str(), "Marschner-Lobb under two narrow peaks",
    BenchField::Fog, size, Scaled(peaks, Max16), Spectrum(0, Max16), unit));
  scenes.push_back(
    MakeScene(name("sheet").c_str(), "an opaque sheet, one voxel thick", BenchField::Sheet, size,
      Scaled({ { 0, 0 }, { 0.3, 0 }, { 0.6, 0.95 }, { 1, 0.95 } }, Max8), Warm(0, Max8)));
}

std::vector<BenchScene> MakeScenes()
{
  std::vector<BenchScene> unshaded;
  AddScans(unshaded);
  AddFormulas(unshaded, 256);
  AddFormulas(unshaded, 512);
  for (const char* name : { "shells-512", "noise-512" })
  {
    for (std::size_t i = 0, count = unshaded.size(); i < count; ++i)
    {
      if (unshaded[i].Name == name)
      {
        unshaded.push_back(Zoomed(unshaded[i], "-far", ", minified", 0.4));
      }
    }
  }
  std::vector<BenchScene> all;
  for (const BenchScene& scene : unshaded)
  {
    all.push_back(scene);
    all.push_back(scene);
    all.back().Name += "-shaded";
    all.back().Description += ", shaded";
    all.back().Shade = true;
  }
  return all;
}

} // namespace

const std::vector<BenchScene>& AllBenchScenes()
{
  static const std::vector<BenchScene> scenes = MakeScenes();
  return scenes;
}

Result<std::vector<BenchScene>> FindBenchScenes(const std::vector<std::string>& names)
{
  if (names.empty())
  {
    return AllBenchScenes();
  }
  std::vector<BenchScene> found;
  for (const std::string& name : names)
  {
    const bool open = !name.empty() && name.back() == '*';
    const std::string beginning = name.substr(0, name.size() - (open ? 1 : 0));
    const std::size_t before = found.size();
    for (const BenchScene& scene : AllBenchScenes())
    {
      if (open ? scene.Name.compare(0, beginning.size(), beginning) == 0 : scene.Name == name)
      {
        found.push_back(scene);
      }
    }
    if (found.size() == before)
    {
      return Status(StatusCode::InvalidArgument,
        fmt::format("'{}' is no scene; bench error --list names them.", name));
    }
  }
  return found;
}

void SetUp(const BenchScene& scene, const BenchVolume& volume, vtkVolumeProperty* property)
{
  vtkNew<vtkPiecewiseFunction> opacity;
  for (const auto& node : scene.Opacity)
  {
    opacity->AddPoint(node[0], node[1]);
  }
  vtkNew<vtkColorTransferFunction> color;
  for (const auto& node : scene.Color)
  {
    color->AddRGBPoint(node[0], node[1], node[2], node[3]);
  }
  property->SetScalarOpacity(opacity);
  property->SetColor(color);
  property->SetScalarOpacityUnitDistance(scene.UnitDistance * volume.SmallestSpacing());
  property->SetInterpolationTypeToLinear();
  const BenchMaterial material;
  property->SetShade(scene.Shade ? 1 : 0);
  property->SetAmbient(material.Ambient);
  property->SetDiffuse(material.Diffuse);
  property->SetSpecular(material.Specular);
  property->SetSpecularPower(material.SpecularPower);
}

Status SetUp(const BenchScene& scene, const BenchVolume& volume, double aspect, vtkCamera* camera)
{
  CameraOptions options;
  options.Azimuth = scene.Azimuth;
  options.Elevation = scene.Elevation;
  options.Zoom = scene.Zoom;
  double bounds[6];
  for (std::size_t a = 0; a < 3; ++a)
  {
    bounds[2 * a] = 0;
    bounds[2 * a + 1] = volume.Spacing[a] * static_cast<double>(volume.Dimensions[a] - 1);
  }
  return PlaceCamera(camera, options, bounds, aspect, volume.SmallestSpacing());
}

} // namespace teravox::program
