// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// 2-D transfer functions: closed forms in VTK's terms, the truth, VTK's own mapper, and that the
// picture depends on no budget and on no skipping.
#include "BesideVTK.h"
#include "ExpectTruth.h"
#include "MessageRecorder.h"
#include "Scene.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <string>
#include <vtkCommand.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr int BrickEdge = 16;
constexpr double UnitDistance = 1;

using Node = std::array<double, 4>;
using NodeFunction = std::function<Node(double, double)>;

// Two islands of values and gradients that overlap in the values, and fog.
Node Islands(double value, double gradient)
{
  const auto island = [&](double v, double g, double wide, double tall)
  { return std::max(0.0, 1 - std::hypot((value - v) / wide, (gradient - g) / tall)); };
  const double fog = value > 0.6 && gradient < 0.1 ? 0.02 : 0;
  const double opacity =
    std::max({ fog, 0.5 * island(0.5, 0.06, 0.12, 0.05), 0.8 * island(0.55, 0.2, 0.25, 0.08) });
  return { value, 1 - gradient, std::min(1.0, 4 * gradient), opacity };
}

// Walls of high gradients.
Node Walls(double value, double gradient)
{
  const double opacity = gradient > 0.12 && value > 0.45 ? 1 : value > 0.45 ? 0.02 : 0;
  return { 1 - value, value, 0.5, opacity };
}

Node Linear(double value, double gradient)
{
  return { gradient, value, 1 - value, 0.4 * value * (1 - gradient) };
}

// The same for magnitudes of noise.
NodeFunction Wider(Node (*function)(double, double))
{
  return [=](double value, double gradient) { return function(value, 0.25 * gradient); };
}

// Bilinear between nodes of a function.
Node Between(Node (*function)(double, double), int nodes, double value, double gradient)
{
  const double last = nodes - 1.0;
  const double x = std::floor(std::min(value * last, last - 1));
  const double y = std::floor(std::min(gradient * last, last - 1));
  Node node{};
  for (const double i : { 0.0, 1.0 })
  {
    for (const double j : { 0.0, 1.0 })
    {
      const Node at = function((x + i) / last, (y + j) / last);
      const double weight =
        (1 - std::abs(value * last - x - i)) * (1 - std::abs(gradient * last - y - j));
      for (std::size_t c = 0; c < 4; ++c)
      {
        node[c] += weight * at[c];
      }
    }
  }
  return node;
}

void SetImage(Stage& stage, vtkImageData* image)
{
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.SetImage(image);
  stage.Property->SetScalarOpacityUnitDistance(UnitDistance);
}

} // namespace

// 2 per world length, of which a mean spacing is 4/3: the one row of this gradient is an ordinary
// function of the value, over the range of the data; rows end at a quarter of that range.
TEST(TransferPlane, OfARampIsAFunctionOfTheValue)
{
  ImageOptions options;
  options.Type = ScalarType::UInt16;
  options.Dimensions = { 40, 20, 24 };
  options.Spacing = { 2, 1, 1 };
  options.Low = 1000;
  options.High = 9190;
  const auto image = MakeImage(options, [](double x, double, double) { return x; });
  double range[2];
  image->GetScalarRange(range);
  const double width = range[1] - range[0];
  const double row = width / 39 / 2 * (4.0 / 3) / (0.25 * width);
  Stage stage(32, 32);
  SetImage(stage, image);
  const auto at = [&](double share) { return range[0] + share * width; };
  stage.SetTransfer({ { { at(0.25), 0 }, { at(0.5), 0.2 }, { at(0.75), 0 } },
    { { at(0), 0, 0.5, 1 }, { at(1), 1, 0.5, 0 } }, 1.5 });
  for (const bool shade : { false, true })
  {
    stage.SetShade(shade);
    stage.Look({ 0.4, 1, -0.3 }, 0.8);
    stage.SetTransferImage(0, 0);
    const std::vector<float> plain = stage.Draw();
    // Opacity proportional to the row, which is as much as above at this gradient.
    stage.SetTransferImage(5, 2,
      [&](double value, double gradient) -> Node {
        return { value, 0.5, 1 - value, value == 0.5 ? 0.2 * gradient / row * 0.25 : 0 };
      });
    stage.Property->SetScalarOpacityUnitDistance(1.5);
    // As a quarter of the opacity at the middle, which is that of another function.
    const std::vector<float> drawn = stage.Draw();
    ASSERT_TRUE(stage.Mapper->IsConverged());
    stage.SetTransferImage(0, 0);
    stage.SetTransfer({ { { at(0.25), 0 }, { at(0.5), 0.05 }, { at(0.75), 0 } },
      { { at(0), 0, 0.5, 1 }, { at(1), 1, 0.5, 0 } }, 1.5 });
    EXPECT_LT(CompareImages(drawn, stage.Draw()).Max, 4e-3f) << shade;
    EXPECT_GT(CompareImages(drawn, plain).Max, 0.1f) << shade;
    stage.SetTransfer({ { { at(0.25), 0 }, { at(0.5), 0.2 }, { at(0.75), 0 } },
      { { at(0), 0, 0.5, 1 }, { at(1), 1, 0.5, 0 } }, 1.5 });
  }
}

TEST(TransferPlane, TruthSmoothAndNoisyShadedAndNot)
{
  struct Case
  {
    const char* Name;
    int Columns;
    int Rows;
    Node (*Function)(double, double);
  };
  const Case cases[] = { { "islands", 33, 65, Islands }, { "fine islands", 300, 200, Islands },
    { "linear", 2, 2, Linear }, { "walls", 40, 50, Walls } };
  for (const bool noisy : { false, true })
  {
    const auto image = noisy ? MakeImage({}, NoiseField) : MakeImage({});
    const auto source = SourceOfImage(image, BrickEdge, false);
    Stage stage(16, 16);
    SetImage(stage, image);
    for (const Case& c : cases)
    {
      stage.SetTransferImage(
        c.Columns, c.Rows, noisy ? Wider(c.Function) : NodeFunction(c.Function));
      for (const bool shade : { false, true })
      {
        stage.SetShade(shade);
        const std::string name =
          std::string(c.Name) + (noisy ? ", noisy" : "") + (shade ? ", shaded" : "");
        stage.Look({ 0.3, 1, -0.4 }, 0.8);
        ExpectTruth(stage, *source, name);
        if (shade && noisy)
        {
          stage.LookFrom({ 14, 15, 16 }, { 30, 22, 25 }, 0.01, 100, 60);
          ExpectTruth(stage, *source, name + ", inside");
        }
      }
    }
  }
}

TEST(TransferPlane, TruthOfAllTypesLinearAndNearest)
{
  for (const ScalarType type : AllScalarTypes)
  {
    ImageOptions options = OptionsOfType(type);
    options.ShareOfNaN = IsFloat(type) ? 0.02 : 0;
    options.CellData = type == ScalarType::Int16;
    const auto image = MakeImage(options);
    const auto source = SourceOfImage(image, BrickEdge, options.CellData);
    Stage stage(32, 32);
    SetImage(stage, image);
    stage.SetTransferImage(33, 65, Islands);
    stage.Look({ 0.5, 1, -0.3 }, 0.8);
    ExpectTruth(stage, *source, std::string(ToString(type)) + ", linear");
    stage.Property->SetInterpolationTypeToNearest();
    ExpectTruth(stage, *source, std::string(ToString(type)) + ", nearest");
  }
}

// The magnitude is measured before the prop's matrix.
TEST(TransferPlane, TruthStretchedTurnedScaledAndInLevels)
{
  ImageOptions options;
  options.Dimensions = { 60, 64, 40 };
  options.Spacing = { 1, 0.8, 2.5 };
  const double c = std::cos(0.6);
  const double s = std::sin(0.6);
  options.Direction = { c, -s, 0, s, c, 0, 0, 0, 1 };
  const auto image = MakeImage(options);
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(40, 40);
  SetImage(stage, image);
  stage.SetTransferImage(33, 65, Islands);
  stage.Volume->RotateX(25);
  stage.Volume->SetScale(1.5, 0.8, 1.2);
  stage.Volume->SetPosition(10, 4, -2);
  for (const double distance : { 0.8, 4.0 })
  {
    stage.SetShade(distance < 1);
    stage.Look({ 0.5, 1, -0.6 }, distance);
    ExpectTruth(stage, *source, distance > 1 ? "levels" : "turned and scaled, shaded");
  }
}

// Steps of a given length come to the truth.
TEST(TransferPlane, FixedStepsConverge)
{
  const auto image = MakeImage({});
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(32, 32);
  SetImage(stage, image);
  stage.SetTransferImage(33, 65, Islands);
  stage.Look({ 0.3, 1, -0.4 }, 0.8);
  ExpectFixedStepsConverge(stage, *source, 0.2);
}

// VTK takes the opacity for that of a step, however long; its step of the gradient is n / (n - 1)
// voxels long and taken as one; and it looks up images, which it stretches to 1024 nodes, half a
// node aside. It is given the image of 1024 nodes for which that is what is meant. Where the field
// bends within its longer step (the middle of a small blob, a silhouette) its magnitudes aren't
// just larger: a few pixels differ by up to 17/255, where ours are those of the truth.
TEST(TransferPlane, BesideVTK)
{
  for (const bool shade : { false, true })
  {
    ImageOptions options;
    constexpr int edge = 60;
    options.Dimensions = { edge, edge, edge };
    options.Type = ScalarType::UInt16;
    BesideVTK comparison(options, 28);
    Stage& stage = comparison.Shown;
    stage.Mapper->SetMaximumLevel(0);
    const auto source = SourceOfImage(comparison.Image, BrickEdge, false);
    stage.SetShade(shade);
    stage.Property->SetScalarOpacityUnitDistance(UnitDistance);
    for (const bool walls : { false, true })
    {
      const auto function = walls ? Walls : Islands;
      const std::string name = std::string(walls ? "walls" : "islands") + (shade ? ", shaded" : "");
      stage.SetTransferImage(256, 256, function);
      stage.Look({ 0.4, 1, -0.3 }, 0.8);
      ExpectTruth(stage, *source, name);
      const std::vector<float> ours = WithoutAlpha(stage.DrawPicture());
      ASSERT_TRUE(stage.Mapper->IsConverged()) << name;
      stage.SetTransferImage(1024, 1024,
        [&](double value, double gradient)
        {
          const auto meant = [](double at) { return (1023 * at + 0.5) / 1024; };
          Node node = Between(function, 256, meant(value), meant(gradient) * (edge - 1) / edge);
          node[3] = 1 - std::pow(1 - node[3], 0.1 / UnitDistance);
          return node;
        });
      const PictureEnvelope theirs = EnvelopeOf(stage, comparison.Theirs);
      const ImageDifference plain = CompareImages(ours, theirs.Middle);
      const ImageDifference excess = ExcessOverEnvelope(ours, theirs.Low, theirs.High);
      std::printf("  %-24s mean %.3f/255, max %.2f/255 beyond the envelope, plain max %.2f/255\n",
        name.c_str(), 255 * plain.Mean, 255 * excess.Max, 255 * plain.Max);
      EXPECT_GT(*std::max_element(theirs.Middle.begin(), theirs.Middle.end()), 0.1f) << name;
      EXPECT_LE(plain.Mean, 1.0 / 255) << name;
      EXPECT_LE(excess.Percentile99, 6.0 / 255) << name;
      EXPECT_LE(excess.Max, 20.0 / 255) << name;
    }
  }
}

// Contracts 1 to 3.
TEST(TransferPlane, SameBitsInASmallAtlasAndWithoutSkipping)
{
  ImageOptions options;
  options.Dimensions = { 72, 66, 80 };
  for (const bool nearest : { false, true })
  {
    options.Type = nearest ? ScalarType::Float64 : ScalarType::UInt8;
    const auto image = MakeImage(options);
    vtkTypeUInt64 evictions = 0;
    const auto draw = [&](const std::function<void(Stage&)>& change)
    {
      Stage stage(48, 48);
      SetImage(stage, image);
      stage.SetTransferImage(33, 65, Islands);
      stage.SetShade(nearest);
      stage.Property->SetInterpolationType(
        nearest ? VTK_NEAREST_INTERPOLATION : VTK_LINEAR_INTERPOLATION);
      stage.Look({ 0.4, 1, -0.3 }, 0.8);
      change(stage);
      std::vector<float> picture = stage.Draw();
      EXPECT_TRUE(stage.Mapper->IsConverged());
      evictions += stage.Mapper->GetNumberOfEvictions();
      return picture;
    };
    const std::vector<float> whole = draw([](Stage&) {});
    ASSERT_GT(*std::max_element(whole.begin(), whole.end()), 0.1f);
    EXPECT_TRUE(
      AreImagesIdentical(whole, draw([](Stage& s) { s.Mapper->SetMaximumNumberOfSlots(12); })));
    EXPECT_TRUE(
      AreImagesIdentical(whole, draw([](Stage& s) { s.Mapper->EmptySpaceSkippingOff(); })));
    EXPECT_GT(evictions, 10u);
  }
}

// Another table, and changes of the one that there is, need no brick; back again the picture is
// the same.
TEST(TransferPlane, EditsLoadNothing)
{
  const auto image = MakeImage({});
  Stage stage(40, 40);
  SetImage(stage, image);
  const auto thin = [](double value, double gradient)
  {
    Node node = Islands(value, gradient);
    node[3] *= 0.5;
    return node;
  };
  stage.SetTransferImage(33, 65, thin);
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
  const std::vector<float> first = stage.Draw();
  const vtkTypeUInt64 loaded = stage.Mapper->GetNumberOfBricksLoaded();
  EXPECT_GT(loaded, 0u);
  vtkDataArray* nodes = stage.Property->GetTransferFunction2D()->GetPointData()->GetScalars();
  for (vtkIdType i = 0; i < nodes->GetNumberOfTuples(); ++i)
  {
    nodes->SetComponent(i, 3, 2 * nodes->GetComponent(i, 3));
  }
  stage.Property->GetTransferFunction2D()->Modified();
  EXPECT_GT(CompareImages(first, stage.Draw()).Max, 0.02f);
  stage.SetTransferImage(33, 65, thin);
  EXPECT_TRUE(AreImagesIdentical(first, stage.Draw()));
  EXPECT_EQ(stage.Mapper->GetNumberOfBricksLoaded(), loaded);
}

// What can't be drawn is drawn by the functions of one dimension, with one warning by name.
TEST(TransferPlane, UnsupportedWarnsOnceByName)
{
  ImageOptions options;
  const auto image = MakeImage(options);
  vtkNew<vtkImageData> mask;
  mask->CopyStructure(image);
  mask->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
  mask->GetPointData()->GetScalars()->Fill(1);
  struct Case
  {
    const char* Name;
    bool IsDrawn; // all the same
    std::function<void(Stage&)> Change;
  };
  const Case cases[] = {
    { "TransferFunction2D in this BlendMode", false,
      [](Stage& s) { s.Mapper->SetBlendModeToMaximumIntensity(); } },
    { "TransferFunction2D with MaskInput", false,
      [&](Stage& s)
      {
        s.Mapper->SetMaskInput(mask);
        s.Mapper->SetMaskTypeToBinary();
      } },
    { "Transfer2DYAxisArray", true, [](Stage& s) { s.Mapper->SetTransfer2DYAxisArray("other"); } },
  };
  for (const Case& c : cases)
  {
    Stage stage(32, 32);
    SetImage(stage, image);
    stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    stage.Look({ 0.4, 1, -0.3 }, 0.8);
    if (!c.IsDrawn)
    {
      c.Change(stage);
    }
    const std::vector<float> plain = stage.Draw();
    vtkNew<MessageRecorder> messages;
    stage.Mapper->AddObserver(vtkCommand::WarningEvent, messages);
    stage.SetTransferImage(33, 65, Islands);
    const std::vector<float> before = stage.Draw();
    c.Change(stage);
    EXPECT_TRUE(AreImagesIdentical(stage.Draw(), c.IsDrawn ? before : plain)) << c.Name;
    stage.Draw();
    ASSERT_EQ(messages->Messages.size(), 1u) << c.Name;
    EXPECT_NE(messages->Messages[0].find(c.Name), std::string::npos) << messages->Messages[0];
  }
}
