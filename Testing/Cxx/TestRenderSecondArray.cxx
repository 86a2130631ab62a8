// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// 2-D transfer functions over two arrays: the truth, VTK's own mapper, pyramids, and that the
// picture depends on no budget and on no skipping.
#include "BesideVTK.h"
#include "ComponentScene.h"
#include "ExpectTruth.h"
#include "JoinedBrickSource.h"
#include "MessageRecorder.h"
#include "Scene.h"
#include "vtkBrickSource.h"
#include "vtkOutOfCoreVolumeMapper.h"
#include "vtkProceduralVolumeSource.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <string>
#include <vtkCellData.h>
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

using Node = std::array<double, 4>;
using NodeFunction = std::function<Node(double, double)>;

// Two islands, which neither value alone tells apart, and fog.
Node Islands(double value, double second)
{
  const auto island = [&](double v, double w, double wide, double tall)
  { return std::max(0.0, 1 - std::hypot((value - v) / wide, (second - w) / tall)); };
  const double fog = value > 0.6 && second < 0.3 ? 0.02 : 0;
  const double opacity =
    std::max({ fog, 0.5 * island(0.5, 0.3, 0.15, 0.2), 0.8 * island(0.55, 0.7, 0.2, 0.15) });
  return { value, 1 - second, std::min(1.0, 2 * second), opacity };
}

// Opaque where both are high.
Node Walls(double value, double second)
{
  const double opacity = second > 0.5 && value > 0.45 ? 1 : value > 0.45 ? 0.02 : 0;
  return { 1 - value, value, 0.5 * second, opacity };
}

Node Linear(double value, double second)
{
  return { second, value, 1 - value, 0.4 * value * (1 - second) };
}

vtkDataArray* ScalarsOf(vtkImageData* image, bool cells)
{
  return cells ? image->GetCellData()->GetScalars() : image->GetPointData()->GetScalars();
}

// One component as an array of its own, with the values that its type makes of them.
vtkSmartPointer<vtkDataArray> ArrayOf(vtkDataArray* all, int component, int type, const char* name)
{
  auto array = vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(type));
  array->SetNumberOfTuples(all->GetNumberOfTuples());
  array->CopyComponent(0, all, component);
  array->SetName(name);
  return array;
}

// An image with two arrays, "first" and "second", and a source of both for the truth.
struct TwoArrays
{
  explicit TwoArrays(const ImageOptions& options, int secondType = VTK_VOID, bool noisy = false)
    : Cells(options.CellData)
  {
    const auto noise = [](int c, double x, double y, double z)
    { return c == 0 ? NoiseField(x, y, z) : NoiseField(z, x, y); };
    this->Image = noisy ? MakeComponentImage(options, 2, noise) : MakeComponentImage(options, 2);
    const vtkSmartPointer<vtkDataArray> all = ScalarsOf(this->Image, this->Cells);
    const int type = all->GetDataType();
    vtkDataSetAttributes* fields = this->Cells
      ? static_cast<vtkDataSetAttributes*>(this->Image->GetCellData())
      : this->Image->GetPointData();
    const auto first = ArrayOf(all, 0, type, "first");
    const auto second = ArrayOf(all, 1, secondType == VTK_VOID ? type : secondType, "second");
    vtkNew<vtkImageData> both;
    both->CopyStructure(this->Image);
    vtkSmartPointer<vtkDataArray> values = all;
    if (second->GetDataType() != type)
    {
      values.TakeReference(vtkDataArray::CreateDataArray(VTK_DOUBLE));
      values->SetNumberOfComponents(2);
      values->SetNumberOfTuples(all->GetNumberOfTuples());
      values->CopyComponent(0, first, 0);
      values->CopyComponent(1, second, 0);
    }
    (this->Cells ? static_cast<vtkDataSetAttributes*>(both->GetCellData()) : both->GetPointData())
      ->SetScalars(values);
    this->Source = SourceOfImage(both, BrickEdge, this->Cells);
    fields->Initialize();
    fields->AddArray(second);
    fields->SetScalars(first);
  }

  vtkSmartPointer<vtkImageData> Image;
  std::shared_ptr<BrickSource> Source;
  bool Cells;
};

void Furnish(Stage& stage, vtkImageData* image, const NodeFunction& nodes = Islands)
{
  stage.Mapper->SetBrickSize(BrickEdge);
  stage.SetImage(image);
  stage.Mapper->SetTransfer2DYAxisArray("second");
  stage.Property->SetScalarOpacityUnitDistance(1);
  stage.SetTransferImage(33, 65, nodes);
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
}

} // namespace

TEST(SecondArray, TruthSmoothAndNoisyShadedAndNot)
{
  struct Case
  {
    const char* Name;
    int Columns;
    int Rows;
    Node (*Function)(double, double);
  };
  const Case cases[] = { { "islands", 33, 65, Islands }, { "fine islands", 300, 200, Islands },
    { "linear", 2, 2, Linear }, { "walls", 40, 50, Walls }, { "one row", 20, 1, Linear } };
  for (const bool noisy : { false, true })
  {
    const TwoArrays two({}, VTK_VOID, noisy);
    Stage stage(16, 16);
    Furnish(stage, two.Image);
    for (const Case& c : cases)
    {
      if (!TakesAll() && c.Columns != 33 && c.Columns != 40)
      {
        continue;
      }
      stage.SetTransferImage(c.Columns, c.Rows, c.Function);
      for (const bool shade : { false, true })
      {
        stage.SetShade(shade);
        const std::string name =
          std::string(c.Name) + (noisy ? ", noisy" : "") + (shade ? ", shaded" : "");
        stage.Look({ 0.3, 1, -0.4 }, 0.8);
        ExpectComponentTruth(stage, two.Source, name);
        if (shade && noisy && TakesAll())
        {
          stage.LookFrom({ 14, 15, 16 }, { 30, 22, 25 }, 0.01, 100, 60);
          ExpectComponentTruth(stage, two.Source, name + ", inside");
        }
      }
    }
  }
}

// Each type beside another one.
TEST(SecondArray, TruthOfAllTypesLinearAndNearest)
{
  const int seconds[] = { VTK_FLOAT, VTK_UNSIGNED_SHORT, VTK_VOID, VTK_DOUBLE, VTK_INT };
  std::size_t next = 0;
  for (const ScalarType type : AllScalarTypes)
  {
    ImageOptions options = OptionsOfType(type);
    options.ShareOfNaN = IsFloat(type) ? 0.02 : 0;
    options.CellData = type == ScalarType::Int16;
    int second = seconds[next++ % std::size(seconds)];
    // What a narrow type makes of values that it doesn't hold isn't defined.
    second = options.Low < 0 || options.High > 65535 || IsFloat(type) ? VTK_DOUBLE : second;
    if (!TakesAll() && SizeOf(type) == (IsFloat(type) ? 8 : 4))
    {
      continue; // shaders know texels of 8 and 16 bits and floats
    }
    const TwoArrays two(options, second);
    Stage stage(24, 24);
    Furnish(stage, two.Image);
    stage.Mapper->SetScalarMode(
      options.CellData ? VTK_SCALAR_MODE_USE_CELL_DATA : VTK_SCALAR_MODE_DEFAULT);
    stage.Mapper->SetMaximumLevel(0);
    stage.SetShade(next % 2 == 0);
    ExpectComponentTruth(stage, two.Source, std::string(ToString(type)) + ", linear");
    stage.Property->SetInterpolationTypeToNearest();
    ExpectComponentTruth(stage, two.Source, std::string(ToString(type)) + ", nearest");
  }
}

TEST(SecondArray, TruthTurnedCutAndInLevels)
{
  ImageOptions options;
  options.Dimensions = { 60, 64, 40 };
  options.Spacing = { 1, 0.8, 2.5 };
  const TwoArrays two(options);
  Stage stage(40, 40);
  Furnish(stage, two.Image);
  stage.Volume->RotateX(25);
  stage.Volume->SetScale(1.5, 0.8, 1.2);
  stage.Volume->SetPosition(10, 4, -2);
  stage.Mapper->CroppingOn();
  stage.Mapper->SetCroppingRegionPlanes(12, 50, 8, 45, 10, 90);
  for (const double distance : { 0.8, 4.0 })
  {
    stage.SetShade(distance < 1);
    stage.Look({ 0.5, 1, -0.6 }, distance);
    ExpectComponentTruth(
      stage, two.Source, distance > 1 ? "levels" : "turned, scaled and cropped, shaded");
  }
}

// Random images of few and of many nodes.
TEST(SecondArray, TruthOfRandomScenes)
{
  const unsigned scenes = TakesAll() ? 16 : 4;
  for (unsigned seed = 0; seed < scenes; ++seed)
  {
    RandomNumbers random(900 + seed);
    ImageOptions options;
    options.Type = random.Chosen(ScalarType::UInt8, ScalarType::Int16, ScalarType::Float32);
    options.Dimensions = { random.Chosen(7, 20, 33), random.Chosen(5, 18), random.Chosen(9, 30) };
    options.Spacing = { random.Uniform(0.5, 2), random.Uniform(0.5, 2), random.Uniform(0.5, 2) };
    const TwoArrays two(options, VTK_VOID, random.Uniform(0, 1) < 0.4);
    Stage stage(20, 20);
    Furnish(stage, two.Image);
    const double empty = random.Uniform(0.1, 0.8);
    const double most = random.Chosen(0.1, 0.6, 1.0);
    stage.SetTransferImage(random.Chosen(2, 7, 24), random.Chosen(2, 5, 40),
      [&](double, double) -> Node
      {
        return { random.Uniform(0, 1), random.Uniform(0, 1), random.Uniform(0, 1),
          random.Uniform(0, 1) < empty ? 0 : random.Uniform(0, most) };
      });
    stage.SetShade(random.Uniform(0, 1) < 0.5);
    stage.Look({ random.Uniform(-1, 1), random.Uniform(0.2, 1), random.Uniform(-1, 1) },
      random.Chosen(0.6, 1.5));
    ExpectComponentTruth(stage, two.Source, "seed " + std::to_string(900 + seed));
  }
}

// Steps of a given length come to the picture that tolerances do.
TEST(SecondArray, FixedStepsConverge)
{
  const TwoArrays two({});
  Stage stage(32, 32);
  Furnish(stage, two.Image);
  stage.SetShade(true);
  const std::vector<float> exact = stage.Draw();
  stage.Mapper->SetImageErrorTolerance(0);
  stage.Mapper->SetSampleDistance(0.4f);
  const double coarse = CompareImages(stage.Draw(), exact).Mean;
  stage.Mapper->SetSampleDistance(0.1f);
  const double fine = CompareImages(stage.Draw(), exact).Mean;
  EXPECT_GT(coarse, 1e-4);
  EXPECT_LT(fine, 0.25 * coarse);
}

// VTK takes the opacity for that of a step, and looks images up half a node aside: it is given the
// one for which that is what is meant.
TEST(SecondArray, BesideVTK)
{
  for (const bool shade : { false, true })
  {
    ImageOptions options;
    options.Dimensions = { 60, 60, 60 };
    options.Type = ScalarType::UInt16;
    BesideVTK comparison(options, 28);
    const TwoArrays two(options);
    comparison.Image = two.Image;
    Stage& stage = comparison.Shown;
    Furnish(stage, two.Image);
    comparison.Theirs->SetInputData(two.Image);
    comparison.Theirs->SetTransfer2DYAxisArray("second");
    stage.Mapper->SetMaximumLevel(0);
    stage.SetShade(shade);
    for (const bool walls : { false, true })
    {
      const auto function = walls ? Walls : Islands;
      constexpr int nodes = 1024;
      comparison.Prepare = [&](bool theirs)
      {
        stage.SetTransferImage(nodes, nodes,
          [&](double value, double second)
          {
            const auto meant = [&](double at)
            { return theirs ? ((nodes - 1) * at + 0.5) / nodes : at; };
            Node node = function(meant(value), meant(second));
            node[3] = theirs ? 1 - std::pow(1 - node[3], 0.1) : node[3];
            return node;
          });
      };
      comparison.Expect(
        std::string(walls ? "walls" : "islands") + (shade ? ", shaded" : ""), { 1, 6 });
    }
  }
}

// Contracts 1 to 3.
TEST(SecondArray, SameBitsInASmallAtlasAndWithoutSkipping)
{
  ImageOptions options;
  options.Dimensions = { 72, 66, 80 };
  for (const bool nearest : { false, true })
  {
    options.Type = nearest ? ScalarType::Float64 : ScalarType::UInt8;
    const TwoArrays two(options, nearest ? VTK_VOID : VTK_UNSIGNED_SHORT);
    vtkTypeUInt64 evictions = 0;
    std::vector<float> reference;
    const auto draw = [&](const std::string& name, const std::function<void(Stage&)>& change)
    {
      Stage stage(48, 48);
      Furnish(stage, two.Image);
      stage.SetShade(true);
      stage.Property->SetInterpolationType(
        nearest ? VTK_NEAREST_INTERPOLATION : VTK_LINEAR_INTERPOLATION);
      change(stage);
      ExpectSamePicture(stage, reference, name);
      evictions += stage.Mapper->GetNumberOfEvictions();
    };
    draw("whole", [](Stage&) {});
    draw("12 slots", [](Stage& s) { s.Mapper->SetMaximumNumberOfSlots(12); });
    draw("without skipping", [](Stage& s) { s.Mapper->EmptySpaceSkippingOff(); });
    EXPECT_GT(evictions, 10u);
  }
}

// Another image loads nothing; another array does.
TEST(SecondArray, EditsLoadNothing)
{
  const TwoArrays two({});
  Stage stage(40, 40);
  Furnish(stage, two.Image);
  const std::vector<float> first = stage.Draw();
  const vtkTypeUInt64 loaded = stage.Mapper->GetNumberOfBricksLoaded();
  EXPECT_GT(loaded, 0u);
  stage.SetTransferImage(33, 65,
    [](double value, double second)
    {
      Node node = Islands(value, second);
      node[3] *= 0.5;
      return node;
    });
  EXPECT_GT(CompareImages(first, stage.Draw()).Max, 0.02f);
  stage.SetTransferImage(33, 65, Islands);
  EXPECT_TRUE(AreImagesIdentical(first, stage.Draw()));
  EXPECT_EQ(stage.Mapper->GetNumberOfBricksLoaded(), loaded);
  stage.Mapper->SetTransfer2DYAxisArray("first");
  EXPECT_GT(CompareImages(first, stage.Draw()).Max, 0.02f);
  stage.Mapper->SetTransfer2DYAxisArray("second");
  EXPECT_TRUE(AreImagesIdentical(first, stage.Draw()));
}

// Arrays that stand for pyramids, with an atlas far smaller than these.
TEST(SecondArray, OfPyramids)
{
  vtkNew<vtkProceduralVolumeSource> volumes[2];
  vtkNew<vtkImageData> image;
  std::shared_ptr<BrickSource> sources[2];
  for (int i = 0; i < 2; ++i)
  {
    volumes[i]->SetFunctionName(i == 0 ? "marschner-lobb" : "ramp");
    volumes[i]->SetDimensions(96, 80, 72);
    volumes[i]->SetBrickSize(BrickEdge);
    volumes[i]->Update();
    vtkImageData* lazy = volumes[i]->GetOutput();
    vtkDataArray* array = lazy->GetPointData()->GetScalars();
    ASSERT_NE(vtkBrickSource::Get(array), nullptr);
    sources[i] = vtkBrickSource::Get(array)->GetBrickSource();
    array->SetName(i == 0 ? "first" : "second");
    if (i == 0)
    {
      image->ShallowCopy(lazy);
    }
    else
    {
      image->GetPointData()->AddArray(array);
    }
  }
  image->GetPointData()->SetActiveScalars("first");
  const auto joined = JoinedBrickSource::Make(sources[0], sources[1]);
  ASSERT_TRUE(joined) << joined.GetStatus().Message();
  Stage stage(24, 24);
  Furnish(stage, image);
  stage.Mapper->SetMaximumNumberOfSlots(8);
  stage.Mapper->SetMaximumLevel(0);
  stage.Look({ 0.3, 1, -0.4 }, 0.9);
  ExpectComponentTruth(stage, joined.Value(), "pyramids");
  EXPECT_GT(stage.Mapper->GetNumberOfEvictions(), 0u);
}

// What can't be joined warns once, and the gradient counts, as in VTK.
TEST(SecondArray, WithoutAFitGradientsCount)
{
  TwoArrays two({});
  vtkNew<vtkImageData> cells;
  cells->ShallowCopy(two.Image);
  cells->GetPointData()->RemoveArray("second");
  const auto values = ArrayOf(ScalarsOf(two.Image, false), 0, VTK_FLOAT, "second");
  values->SetNumberOfTuples(cells->GetNumberOfCells());
  cells->GetCellData()->AddArray(values);
  struct Case
  {
    vtkImageData* Image;
    const char* Name;
    const char* Says;
  };
  const Case cases[] = { { two.Image, "third", "no point array \"third\"" },
    { cells, "second", "no point array \"second\"" } };
  for (const Case& c : cases)
  {
    Stage stage(32, 32);
    Furnish(stage, c.Image);
    stage.Mapper->SetTransfer2DYAxisArray(nullptr);
    const std::vector<float> byGradient = stage.Draw();
    vtkNew<MessageRecorder> messages;
    stage.Mapper->AddObserver(vtkCommand::WarningEvent, messages);
    stage.Mapper->SetTransfer2DYAxisArray(c.Name);
    EXPECT_TRUE(AreImagesIdentical(stage.Draw(), byGradient)) << c.Says;
    stage.Draw();
    ASSERT_EQ(messages->Messages.size(), 1u) << c.Says;
    EXPECT_NE(messages->Messages[0].find(c.Says), std::string::npos) << messages->Messages[0];
  }
}
