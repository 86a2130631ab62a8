// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Voxels of two to four components: closed forms, the reference integrator, VTK's own mapper, equal
// bits at any budget and with skipping on and off; and the scalars that vector modes make of them.
#include "BesideVTK.h"
#include "ComponentScene.h"
#include "ScalarBrickSource.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <gtest/gtest.h>
#include <random>
#include <vtkColorTransferFunction.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkPiecewiseFunction.h>
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
using Shapes = std::vector<OpacityShape>;
const Shapes Mixed = { OpacityShape::Ramp, OpacityShape::Peak, OpacityShape::Box,
  OpacityShape::Fog };

void Show(Stage& stage, vtkImageData* image, const Shapes& shapes, int components,
  const ImageOptions& options = {})
{
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.SetImage(image);
  SetComponentTransfer(
    stage, Shapes(shapes.begin(), shapes.begin() + components), options.Low, options.High, 1);
  stage.Look({ 0.3, 1, -0.4 }, 0.8);
}

ImageOptions UnitOptions()
{
  ImageOptions options;
  options.Type = ScalarType::Float32;
  options.Low = 0;
  options.High = 1;
  return options;
}

// Each component from 0 to 1.
vtkSmartPointer<vtkImageData> MakeUnitImage(vtkImageData* image)
{
  vtkDataArray* from = image->GetPointData()->GetScalars();
  const int components = from->GetNumberOfComponents();
  auto unit = MakeComponentImage(UnitOptions(), components);
  vtkDataArray* to = unit->GetPointData()->GetScalars();
  for (int c = 0; c < components; ++c)
  {
    double range[2];
    from->GetRange(range, c);
    for (vtkIdType i = 0; i < from->GetNumberOfTuples(); ++i)
    {
      to->SetComponent(i, c, (from->GetComponent(i, c) - range[0]) / (range[1] - range[0]));
    }
  }
  return unit;
}

void SetMaterials(Stage& stage)
{
  stage.SetShade(true);
  for (int c = 1; c < 4; ++c)
  {
    stage.Property->SetShade(c, 1);
    stage.Property->SetAmbient(c, 0.1 * c);
    stage.Property->SetDiffuse(c, 0.8 - 0.1 * c);
    stage.Property->SetSpecular(c, 0.15 * c);
    stage.Property->SetSpecularPower(c, 5.0 * c);
  }
}

} // namespace

TEST(Components, IndependentOnesWithinTheTolerance)
{
  for (const int n : { 2, 3, 4 })
  {
    Stage stage(32, 32);
    const auto image = MakeComponentImage({}, n);
    const auto source = SourceOfImage(image, BrickEdge, false);
    Show(stage, image, Mixed, n);
    const std::string name = std::to_string(n) + " independent";
    if (n == 2)
    {
      stage.Mapper->SetImageErrorTolerance(1.0 / 1020);
      ExpectComponentTruth(stage, source, name + ", 1/1020");
      stage.Mapper->SetImageErrorTolerance(1.0 / 255);
    }
    ExpectComponentTruth(stage, source, name + ", 1/255");
    stage.Property->SetComponentWeight(0, 0.7);
    stage.Property->SetComponentWeight(1, n == 3 ? 0 : 0.4);
    SetMaterials(stage);
    ExpectComponentTruth(stage, source, name + ", weights, shaded");
  }
}

TEST(Components, DependentOnesWithinTheTolerance)
{
  for (const int n : { 2, 4 })
  {
    for (const OpacityShape shape : { OpacityShape::Ramp, OpacityShape::Peak, OpacityShape::Wall })
    {
      Stage stage(32, 32);
      const auto image = MakeComponentImage({}, n);
      const auto source = SourceOfImage(image, BrickEdge, false);
      Show(stage, image, { shape }, 1);
      stage.Property->IndependentComponentsOff();
      const bool shaded = shape != OpacityShape::Ramp;
      if (shaded)
      {
        SetMaterials(stage);
      }
      ExpectComponentTruth(stage, source,
        std::to_string(n) + " dependent, " + ToString(shape) + (shaded ? ", shaded" : ""));
    }
  }
}

TEST(Components, WallsNearestAndTypes)
{
  struct Case
  {
    ScalarType Type;
    bool Nearest;
    double ShareOfNaN;
  };
  for (const Case& c : { Case{ ScalarType::UInt8, true, 0 }, Case{ ScalarType::Int16, false, 0 },
         Case{ ScalarType::UInt32, false, 0 }, Case{ ScalarType::Float32, false, 0.05 },
         Case{ ScalarType::Float32, true, 0.05 } })
  {
    ImageOptions options = OptionsOfType(c.Type);
    options.ShareOfNaN = c.ShareOfNaN;
    Stage stage(28, 28);
    const auto image = MakeComponentImage(options, 3);
    const auto source = SourceOfImage(image, BrickEdge, false);
    Show(stage, image, { OpacityShape::Wall, OpacityShape::Ramp, OpacityShape::Wall }, 3, options);
    if (c.Nearest)
    {
      stage.Property->SetInterpolationTypeToNearest();
    }
    ExpectComponentTruth(stage, source,
      std::string("walls, ") + ToString(c.Type) + (c.Nearest ? ", nearest" : ", linear"));
  }
}

// A wall that is reached slowly, half a voxel to an entry of its table, in another one's fog: what
// shines in front of it isn't hidden by where the table puts it.
TEST(Components, ASlowlyReachedWallBeginsWhereItIs)
{
  ImageOptions options;
  options.Type = ScalarType::Float32;
  options.Low = 0;
  options.High = 1;
  const auto image = MakeComponentImage(options, 2,
    [](int c, double x, double y, double) { return c == 0 ? 0.49 + 0.018 * y + 0.001 * x : 0.8; });
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(24, 24);
  Show(stage, image, { OpacityShape::Wall, OpacityShape::Fog }, 2, options);
  vtkNew<vtkPiecewiseFunction> wall;
  wall->AddPoint(0, 0);
  wall->AddPoint(0.5, 0);
  wall->AddPoint(0.501, 1);
  wall->AddPoint(1, 1);
  stage.Property->SetScalarOpacity(0, wall);
  vtkNew<vtkPiecewiseFunction> fog;
  fog->AddPoint(0, 0.3);
  stage.Property->SetScalarOpacity(1, fog);
  // Of a table that lets the wall begin an entry early: 0.48.
  ExpectComponentTruth(stage, source, "a slowly reached wall", { 0.3, 0.3 });
}

// A ray through constant components: e / k (1 - exp(-k L)).
TEST(Components, ConstantOnesHaveAClosedForm)
{
  ImageOptions options;
  options.Dimensions = { 33, 33, 33 };
  const auto image = MakeComponentImage(
    options, 2, [](int c, double, double, double) { return c == 0 ? 0.4 : 0.8; });
  Stage stage(9, 9);
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.SetImage(image);
  constexpr std::array<double, 2> alpha{ 0.02, 0.05 };
  constexpr std::array<double, 2> weight{ 1, 0.5 };
  constexpr std::array<std::array<double, 3>, 2> color{ { { 1, 0.25, 0 }, { 0, 0.5, 1 } } };
  for (int c = 0; c < 2; ++c)
  {
    const auto i = static_cast<std::size_t>(c);
    vtkNew<vtkPiecewiseFunction> opacity;
    opacity->AddPoint(0, alpha[i]);
    opacity->AddPoint(255, alpha[i]);
    vtkNew<vtkColorTransferFunction> colors;
    colors->AddRGBPoint(0, color[i][0], color[i][1], color[i][2]);
    colors->AddRGBPoint(255, color[i][0], color[i][1], color[i][2]);
    stage.Property->SetScalarOpacity(c, opacity);
    stage.Property->SetColor(c, colors);
    stage.Property->SetComponentWeight(c, weight[i]);
  }
  stage.Look({ 0, 1, 0 }, 1, true);
  const std::vector<float> picture = stage.Draw();
  double total = 0;
  double squares = 0;
  std::array<double, 3> emission{};
  for (std::size_t c = 0; c < 2; ++c)
  {
    const double s = -std::log1p(-alpha[c]);
    total += weight[c] * s;
    squares += s * s;
    for (std::size_t k = 0; k < 3; ++k)
    {
      emission[k] += weight[c] * s * color[c][k];
    }
  }
  const double kappa = squares / total;
  const double opacity = -std::expm1(-kappa * 32);
  const std::size_t middle = 4 * (4 * 9 + 4);
  for (std::size_t k = 0; k < 3; ++k)
  {
    EXPECT_NEAR(picture[middle + k], emission[k] / kappa * opacity, 1e-4); // tables of 16 bits
  }
  EXPECT_NEAR(picture[middle + 3], opacity, 1e-4);
}

// Any number of components with any functions, weights, unit distances, types and views.
TEST(Components, RandomScenesWithinTheTolerance)
{
  RandomNumbers random(20261);
  // Each of the shaders is compiled.
  const bool native = TestedMarcher() == vtkOutOfCoreVolumeMapper::MARCHER_NATIVE;
  for (int scene = 0; scene < (native ? 24 : 10); ++scene)
  {
    const RandomComponents chosen(random, 0.05);
    const int n = chosen.Count;
    const bool dependent = chosen.Dependent;
    const ImageOptions& options = chosen.Options;
    const auto image = MakeComponentImage(options, n);
    const auto source = SourceOfImage(image, BrickEdge, false);
    Stage stage(14, 14);
    Shapes shapes;
    std::string name = std::to_string(scene) + ": " + ToString(options.Type) +
      (dependent ? ", dependent" : ", independent");
    for (int c = 0; c < n; ++c)
    {
      shapes.push_back(random.Chosen(OpacityShape::Ramp, OpacityShape::Peak, OpacityShape::Box,
        OpacityShape::Wall, OpacityShape::Fog));
      name += std::string(c < 1 || !dependent ? ", " : "") +
        (c < 1 || !dependent ? ToString(shapes.back()) : "");
    }
    Show(stage, image, shapes, n, options);
    stage.Property->SetIndependentComponents(dependent ? 0 : 1);
    for (int c = 0; c < n; ++c)
    {
      stage.Property->SetComponentWeight(c, random.Chosen(1.0, 1.0, 0.8, 0.3, c == 0 ? 1.0 : 0.0));
      stage.Property->SetScalarOpacityUnitDistance(c, std::exp(random.Uniform(-1.5, 1.5)));
    }
    if (random.Uniform(0, 1) < 0.4)
    {
      SetMaterials(stage);
      name += ", shaded";
    }
    if (random.Uniform(0, 1) < 0.2)
    {
      stage.Property->SetInterpolationTypeToNearest();
      name += ", nearest";
    }
    stage.Look({ random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(0.1, 1) },
      random.Uniform(0.3, 1.2), random.Uniform(0, 1) < 0.3);
    ExpectComponentTruth(stage, source, name);
  }
}

// A pyramid's levels, cropping and a clipping plane.
TEST(Components, LevelsAndCutsWithinTheTolerance)
{
  Stage stage(32, 32);
  ImageOptions options;
  options.Dimensions = { 72, 64, 80 };
  const auto image = MakeComponentImage(options, 4);
  const auto source = SourceOfImage(image, BrickEdge, false);
  Show(stage, image, Mixed, 4);
  vtkNew<vtkPlane> plane;
  plane->SetOrigin(36, 32, 40);
  plane->SetNormal(0.4, 1, 0.2);
  stage.Mapper->AddClippingPlane(plane);
  stage.Mapper->SetCropping(1);
  stage.Mapper->SetCroppingRegionPlanes(20, 50, 10, 50, 25, 60);
  stage.Mapper->SetCroppingRegionFlagsToFence();
  for (const int level : { 0, 1 })
  {
    stage.Mapper->SetMinimumLevel(level);
    stage.Mapper->SetMaximumLevel(level);
    ExpectComponentTruth(stage, source, "cut, level " + std::to_string(level));
  }
}

// And of both instruction sets, where there are two.
TEST(Components, SameBitsAtAnyBudgetAndWithoutSkipping)
{
  struct Case
  {
    unsigned Slots;
    bool Skip;
    bool Baseline;
  };
  for (const bool dependent : { false, true })
  {
    ImageOptions options;
    options.Dimensions = { 56, 48, 64 };
    const auto image = MakeComponentImage(options, 4);
    std::vector<float> first;
    std::uint64_t samples = 0;
    for (const Case& c : { Case{ 0, true, false }, Case{ 0, false, false }, Case{ 3, true, true },
           Case{ 6, false, false } })
    {
      setenv("TERAVOX_NATIVE_ISA", c.Baseline ? "baseline" : "any", 1);
      Stage stage(28, 28);
      Show(stage, image,
        { OpacityShape::Peak, OpacityShape::Ramp, OpacityShape::Box, OpacityShape::Peak }, 4);
      stage.Property->SetIndependentComponents(dependent ? 0 : 1);
      SetMaterials(stage);
      stage.Mapper->SetMaximumNumberOfSlots(c.Slots);
      stage.Mapper->SetEmptySpaceSkipping(c.Skip ? 1 : 0);
      stage.Mapper->SetCountSamples(1);
      stage.Mapper->SetArrivalShuffleSeed(c.Slots);
      const std::vector<float> picture = stage.Draw();
      unsetenv("TERAVOX_NATIVE_ISA");
      ASSERT_TRUE(stage.Mapper->IsConverged());
      EXPECT_EQ(stage.Mapper->CheckInvariants(), "");
      if (first.empty())
      {
        first = picture;
        samples = stage.Mapper->GetNumberOfSamples();
      }
      EXPECT_TRUE(AreImagesIdentical(picture, first))
        << c.Slots << " slots, skipping " << c.Skip << ", baseline " << c.Baseline
        << ": largest difference " << CompareImages(picture, first).Max;
      if (!c.Skip && c.Slots == 0)
      {
        EXPECT_GT(stage.Mapper->GetNumberOfSamples(), samples + samples / 4);
      }
    }
  }
}

TEST(Components, TheErrorIsEstimated)
{
  Stage stage(32, 32);
  const auto image = MakeComponentImage({}, 3);
  const auto source = SourceOfImage(image, BrickEdge, false);
  Show(stage, image, Mixed, 3);
  stage.Mapper->ErrorEstimateOn();
  const std::vector<float> picture = stage.Draw();
  vtkNew<vtkImageData> errors;
  ASSERT_TRUE(stage.Mapper->GetErrorEstimateImage(errors));
  const auto* estimate = static_cast<const float*>(errors->GetScalarPointer());
  const ComponentTruth truth(stage, source);
  const std::vector<float> exact =
    ToFloat(RenderComponents(truth.Scene(), AllPixels(truth.Scene().Parts[0]->Camera)));
  std::size_t below = 0;
  double beyond = 0;
  for (std::size_t i = 0; i < exact.size() / 4; ++i)
  {
    double error = 0;
    for (std::size_t c = 4 * i; c < 4 * i + 4; ++c)
    {
      error = std::max(error, static_cast<double>(std::abs(picture[c] - exact[c])));
    }
    below += error > static_cast<double>(estimate[i]) ? 1 : 0;
    beyond = std::max(beyond, error - static_cast<double>(estimate[i]));
  }
  std::printf("  error above its estimate on %zu of %zu pixels, by %.4f/255 at most\n", below,
    exact.size() / 4, 255 * beyond);
  EXPECT_LE(below, exact.size() / 4 / 100);
  EXPECT_LE(beyond, 1.0 / 255);
}

TEST(Components, StepsOfAGivenLengthConverge)
{
  Stage stage(32, 32);
  const auto image = MakeComponentImage({}, 2);
  const auto source = SourceOfImage(image, BrickEdge, false);
  Show(stage, image, { OpacityShape::Ramp, OpacityShape::Fog }, 2);
  const ComponentTruth truth(stage, source);
  stage.Mapper->SetImageErrorTolerance(0);
  double before = 0;
  for (const float step : { 1.0f, 0.5f, 0.25f })
  {
    stage.Mapper->SetSampleDistance(step);
    const ImageDifference plain = truth.Excess(stage.Draw(), 1e9);
    std::printf("  steps of %.2f: mean %.5f/255\n", static_cast<double>(step), 255 * plain.Mean);
    EXPECT_TRUE(before == 0 || plain.Mean < 0.4 * before);
    before = plain.Mean;
  }
}

// The same beside VTK's mapper, whose samples are 0.1 voxel apart.
TEST(Components, BesideVTKsMapper)
{
  struct Case
  {
    int Count;
    bool Dependent;
    bool Shade;
  };
  for (const Case& c : { Case{ 2, false, false }, Case{ 3, false, true }, Case{ 4, false, false },
         Case{ 2, true, false }, Case{ 4, true, false } })
  {
    ImageOptions options;
    const auto image = MakeComponentImage(options, c.Count);
    options.Type = ScalarType::UInt16;
    const auto wide = MakeComponentImage(options, c.Count);
    BesideVTK both({}, 24);
    Stage& stage = both.Shown;
    stage.Mapper->SetMaximumLevel(0);
    Show(stage, image,
      { OpacityShape::Ramp, OpacityShape::Ramp, OpacityShape::Fog, OpacityShape::Ramp },
      c.Dependent ? 1 : c.Count);
    // Software drivers filter 8-bit voxels with 8-bit weights. Colours as they are: of floats over
    // 0 to 1, the range that VTK maps to full colours where it isn't 8-bit.
    both.Theirs->SetInputData(wide);
    if (c.Dependent && c.Count == 4)
    {
      const auto floats = MakeUnitImage(image);
      both.Theirs->SetInputData(floats);
      Show(stage, floats, { OpacityShape::Ramp }, 1, UnitOptions());
    }
    stage.Property->SetIndependentComponents(c.Dependent ? 0 : 1);
    if (!c.Dependent)
    {
      stage.Property->SetComponentWeight(1, 0.6);
    }
    if (c.Shade)
    {
      SetMaterials(stage);
    }
    const std::string name = std::to_string(c.Count) +
      (c.Dependent ? " dependent" : " independent") + (c.Shade ? ", shaded" : "");
    both.Expect(name);
  }
}

// Vector modes, by both marchers: the very picture of the scalars alone.
TEST(VectorMode, DrawsThePictureOfTheScalars)
{
  const auto image = MakeComponentImage({}, 3);
  vtkDataArray* all = image->GetPointData()->GetScalars();
  const auto one = MakeImage({});
  ImageOptions floats;
  floats.Type = ScalarType::Float32;
  const auto magnitudes = MakeImage(floats);
  for (vtkIdType i = 0; i < all->GetNumberOfTuples(); ++i)
  {
    one->GetPointData()->GetScalars()->SetComponent(i, 0, all->GetComponent(i, 2));
    const double* v = all->GetTuple(i);
    magnitudes->GetPointData()->GetScalars()->SetComponent(
      i, 0, static_cast<float>(std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])));
  }
  // With nothing between them but levels: averages of magnitudes are others than magnitudes of
  // averages.
  const auto draw = [](vtkImageData* data, int mode, int component, int blend)
  {
    Stage stage(40, 40);
    stage.Mapper->SetBrickSize(BrickEdge);
    stage.Mapper->SetMaximumLevel(0);
    stage.SetImage(data);
    stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    stage.SetShade(true);
    stage.Mapper->SetBlendMode(blend);
    stage.Mapper->SetVectorMode(mode);
    stage.Mapper->SetVectorComponent(component);
    stage.Look({ 0.3, 1, -0.4 }, 0.8);
    std::vector<float> picture = stage.Draw();
    EXPECT_TRUE(stage.Mapper->IsConverged());
    EXPECT_GT(*std::max_element(picture.begin(), picture.end()), 0.1f);
    return picture;
  };
  const auto largest = [](const std::vector<float>& a, const std::vector<float>& b)
  { return CompareImages(a, b).Max; };
  for (const int blend :
    { vtkVolumeMapper::COMPOSITE_BLEND, vtkVolumeMapper::MAXIMUM_INTENSITY_BLEND })
  {
    // Tables are sampled over the range of all components, so not to the bit.
    const double tables = 2.0 / 65535 + 1.0 / 255;
    EXPECT_LE(largest(draw(image, vtkOutOfCoreVolumeMapper::COMPONENT, 2, blend),
                draw(one, vtkOutOfCoreVolumeMapper::DISABLED, 0, blend)),
      tables);
    EXPECT_LE(largest(draw(image, vtkOutOfCoreVolumeMapper::MAGNITUDE, 0, blend),
                draw(magnitudes, vtkOutOfCoreVolumeMapper::DISABLED, 0, blend)),
      tables);
  }
  EXPECT_GT(largest(draw(image, vtkOutOfCoreVolumeMapper::COMPONENT, 2, 0),
              draw(image, vtkOutOfCoreVolumeMapper::COMPONENT, 1, 0)),
    0.1);
}
