// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Label masks: against the reference integrator (within the image error tolerance of the envelope
// of truth) and VTK's own mapper (the tolerances of TestRenderVTK.cxx: VTK's samples lie 0.1 voxel
// apart, and a label ends for it where a sample happens to be), the same bits with any atlas, and
// edits of functions that load nothing.
#include "ArrayBrickSource.h"
#include "BesideVTK.h"
#include "BrickVoxels.h"
#include "EachWay.h"
#include "ExpectTruth.h"
#include "MaskImages.h"
#include "MessageRecorder.h"
#include "RecordingSource.h"
#include "vtkBrickSource.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <gtest/gtest.h>
#include <memory>
#include <vtkColorTransferFunction.h>
#include <vtkPiecewiseFunction.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr int BrickEdge = 16;

vtkSmartPointer<vtkPiecewiseFunction> Function(const std::vector<std::array<double, 2>>& nodes)
{
  auto function = vtkSmartPointer<vtkPiecewiseFunction>::New();
  for (const auto& node : nodes)
  {
    function->AddPoint(node[0], node[1]);
  }
  return function;
}

vtkSmartPointer<vtkColorTransferFunction> Colors(const std::vector<std::array<double, 4>>& nodes)
{
  auto colors = vtkSmartPointer<vtkColorTransferFunction>::New();
  for (const auto& node : nodes)
  {
    colors->AddRGBPoint(node[0], node[1], node[2], node[3]);
  }
  return colors;
}

// 1: other values in another colour; 2: its own colour only; 3: its own opacity only, a wall; 4:
// nothing. 5 has no functions, as 0.
void SetLabels(vtkVolumeProperty* property, double low, double high, bool walls = true)
{
  const auto at = [&](double t) { return low + t * (high - low); };
  property->SetLabelScalarOpacity(
    1, Function({ { at(0.05), 0 }, { at(0.2), 0.3 }, { at(0.3), 0 }, { at(0.6), 0.05 } }));
  property->SetLabelColor(1, Colors({ { at(0), 1, 0.1, 0.1 }, { at(1), 0.9, 0.8, 0 } }));
  property->SetLabelColor(2, Colors({ { at(0.3), 0.1, 1, 0.1 }, { at(0.8), 0, 0.2, 1 } }));
  property->SetLabelScalarOpacity(
    3, Function({ { at(0.5), 0 }, { at(0.52), walls ? 1 : 0.6 }, { at(1), walls ? 1 : 0.6 } }));
  property->SetLabelScalarOpacity(4, Function({ { at(0), 0 }, { at(1), 0 } }));
}

// Blocks, stairs and single voxels.
LabelOf Blocks(const std::array<int, 3>& n)
{
  return [n](std::int64_t i, std::int64_t j, std::int64_t k)
  {
    const std::int64_t hash = (i * 7919 + j * 104729 + k * 1299709) % 101;
    if (hash < 6)
    {
      return static_cast<int>(hash);
    }
    const bool stairs = i / 3 + k / 4 > j / 2 + 2;
    return (i < n[0] / 2 ? 0 : 1) + (j < n[1] / 2 ? 0 : 2) + (stairs ? 1 : 0);
  };
}

// The levels that a mask has; which label a coarser voxel gets is tested in TestDownsampling.cxx.
std::vector<TruthLevel> LevelsOfLabels(const PyramidLayout& layout, const LabelOf& labelOf)
{
  const Int3 n = layout.Dimensions(0);
  const auto mask =
    LabelImage({ static_cast<int>(n[0]), static_cast<int>(n[1]), static_cast<int>(n[2]) }, labelOf);
  ArrayDescription array;
  array.Data = mask->GetScalarPointer();
  array.Owner = std::shared_ptr<const void>(array.Data, [mask](const void*) {});
  array.Type = ScalarType::Int32;
  array.Dimensions = n;
  array.Layout = layout;
  array.Labels = true;
  const std::shared_ptr<BrickSource> source = ArrayBrickSource::Make(array).Value();
  std::vector<TruthLevel> levels;
  for (int l = 0; l < layout.NumberOfLevels(); ++l)
  {
    levels.push_back(TruthLevel::FromFunction(
      [source, voxels = std::make_shared<BrickVoxels>(*source, l)](
        std::int64_t i, std::int64_t j, std::int64_t k) { return voxels->Voxel(i, j, k); },
      layout.Dimensions(l), layout.Factor(l)));
  }
  return levels;
}

void ExpectLabels(
  Stage& stage, BrickSource& source, const LabelOf& labelOf, const std::string& name)
{
  StageTruth truth(stage, source);
  truth.SetLabels(stage, source.Info(), LevelsOfLabels(source.Info().Layout, labelOf));
  ExpectTruth(stage, truth, name);
}

} // namespace

TEST(TruthOfLabels, EachWayAndType)
{
  for (const ScalarType type : { ScalarType::UInt8, ScalarType::Float64 })
  {
    const ImageOptions options = OptionsOfType(type);
    const LabelOf labelOf = Blocks(options.Dimensions);
    const auto image = MakeImage(options);
    const auto source = SourceOfImage(image, BrickEdge, false);
    Stage stage(36, 36);
    PrepareForMask(stage, BrickEdge, image, options);
    SetLabels(stage.Property, options.Low, options.High);
    SetLabelMask(stage.Mapper,
      LabelImage(options.Dimensions, labelOf, type == ScalarType::UInt8 ? VTK_FLOAT : VTK_SHORT));
    ForEachWay(stage,
      [&](const std::string& way)
      { ExpectLabels(stage, *source, labelOf, std::string("labels, ") + ToString(type) + way); });
  }
}

TEST(TruthOfLabels, CoarserLevelsInAFewSlots)
{
  ImageOptions options;
  options.Dimensions = { 96, 80, 112 };
  const LabelOf labelOf = Blocks(options.Dimensions);
  const auto image = MakeImage(options);
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(36, 36);
  PrepareForMask(stage, BrickEdge, image);
  stage.Mapper->SetMaximumNumberOfSlots(12);
  stage.Mapper->SetLevelOfDetailBias(1);
  stage.LookFrom({ 30, -12, 40 }, { 50, 60, 60 }, 0.5, 400, 65);
  SetLabels(stage.Property, 0, 255);
  SetLabelMask(stage.Mapper, LabelImage(options.Dimensions, labelOf));
  StageTruth truth(stage, *source);
  EXPECT_TRUE(HasCoarserLevels(truth, 36));
  ExpectLabels(stage, *source, labelOf, "labels, levels, 12 slots");
}

// Labels far apart, and more of them than a byte tells apart; of a volume of bytes.
TEST(TruthOfLabels, Hundreds)
{
  const ImageOptions options;
  const auto number = [](std::int64_t i, std::int64_t j, std::int64_t k)
  { return static_cast<int>((i / 3 * 131 + j / 2 * 37 + k / 3 * 11) % 400); };
  const LabelOf labelOf = [number](auto i, auto j, auto k)
  { return 1000 * number(i, j, k) - 9000; };
  const auto image = MakeImage(options);
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(36, 36);
  PrepareForMask(stage, BrickEdge, image);
  for (int i = 0; i < 400; ++i)
  {
    if (i % 4 != 3 && i != 9)
    {
      stage.Property->SetLabelScalarOpacity(1000 * i - 9000,
        Function({ { 20.0 + i % 50, 0 }, { 80.0 + i % 60, 0.0004 * i }, { 255, 0.02 } }));
      stage.Property->SetLabelColor(1000 * i - 9000,
        Colors({ { 0, 0.0025 * i, 0.5, 1 }, { 255, 1, 1 - 0.0025 * i, 0.01 * (i % 100) } }));
    }
  }
  EXPECT_EQ(stage.Property->GetNumberOfLabels(), 299);
  SetLabelMask(stage.Mapper, LabelImage(options.Dimensions, labelOf));
  ExpectLabels(stage, *source, labelOf, "300 labels");
}

// The label's own opacity of gradients, none where it has none, the volume's for those without
// functions; and the volume's within a binary mask.
TEST(TruthOfLabels, GradientOpacity)
{
  ImageOptions options;
  options.Type = ScalarType::UInt16;
  const LabelOf labelOf = Blocks(options.Dimensions);
  const auto image = MakeImage(options);
  const auto source = SourceOfImage(image, BrickEdge, false);
  Stage stage(36, 36);
  PrepareForMask(stage, BrickEdge, image);
  SetLabels(stage.Property, 0, 255, false);
  stage.Property->SetLabelGradientOpacity(1, Function({ { 2, 0 }, { 14, 1 } }));
  stage.Property->SetLabelGradientOpacity(3, Function({ { 8, 0.1 }, { 10, 1 }, { 12, 0.2 } }));
  stage.SetGradientOpacity({ { 3, 1 }, { 20, 0.1 } });
  for (const bool shade : { false, true })
  {
    stage.SetShade(shade);
    SetLabelMask(stage.Mapper, LabelImage(options.Dimensions, labelOf));
    ExpectLabels(
      stage, *source, labelOf, shade ? "gradients of labels, shaded" : "gradients of labels");
    const InMask isIn = Sponge(options.Dimensions);
    SetMask(stage.Mapper, MaskImage(options.Dimensions, isIn));
    StageTruth truth(stage, *source);
    truth.SetMask(MaskLevels(source->Info().Layout, isIn));
    ExpectTruth(stage, truth, shade ? "gradients in a mask, shaded" : "gradients in a mask");
  }
}

// VTK 9.1 takes a label's opacity for that of a step, whatever its length: so the unit distance is
// the step here.
TEST(Labels, AsVTK)
{
  const ImageOptions options;
  BesideVTK both(options, 40);
  TransferNodes nodes = MakeTransfer(OpacityShape::Ramp);
  const double step = 0.1;
  for (auto& node : nodes.Opacity)
  {
    node[1] = 1 - std::pow(1 - std::min(node[1], 0.9999), step);
  }
  nodes.UnitDistance = step;
  both.Shown.SetTransfer(nodes);
  both.Shown.Look({ 0.4, 1, -0.3 }, 0.8);
  vtkVolumeProperty* property = both.Shown.Property;
  property->SetLabelScalarOpacity(
    1, Function({ { 12, 0 }, { 50, 0.03 }, { 80, 0 }, { 150, 0.005 } }));
  property->SetLabelColor(1, Colors({ { 0, 1, 0.1, 0.1 }, { 255, 0.9, 0.8, 0 } }));
  property->SetLabelColor(2, Colors({ { 70, 0.1, 1, 0.1 }, { 200, 0, 0.2, 1 } }));
  property->SetLabelScalarOpacity(3, Function({ { 120, 0 }, { 140, 0.05 }, { 255, 0.05 } }));
  property->SetLabelScalarOpacity(4, Function({ { 0, 0 }, { 255, 0 } }));
  const LabelOf labelOf = [blocks = Blocks(options.Dimensions)](auto i, auto j, auto k)
  { return std::min(blocks(i, j, k), 4); };
  const auto mask = LabelImage(options.Dimensions, labelOf, VTK_UNSIGNED_CHAR);
  SetLabelMask(both.Shown.Mapper, mask);
  SetLabelMask(both.Theirs, mask);
  for (const bool shade : { false, true })
  {
    both.Shown.SetShade(shade);
    both.Expect(shade ? "labels, shaded" : "labels");
    if (const char* folder = std::getenv("TERAVOX_SAVE_PICTURES"))
    {
      both.Save(std::string(folder) + (shade ? "/labels-shaded.png" : "/labels.png"));
    }
  }
  both.Shown.SetShade(false);
  for (const float factor : { 0.0f, 0.4f })
  {
    both.Shown.Mapper->SetMaskBlendFactor(factor);
    both.Theirs->SetMaskBlendFactor(factor);
    both.Expect("labels, a share of " + std::to_string(factor));
  }
}

TEST(Labels, GradientOpacityAsVTK)
{
  ImageOptions options;
  options.Type = ScalarType::UInt16;
  BesideVTK both(options, 40);
  TransferNodes nodes = MakeTransfer(OpacityShape::Fog);
  const double step = 0.1;
  for (auto& node : nodes.Opacity)
  {
    node[1] = 1 - std::pow(1 - node[1], step);
  }
  nodes.UnitDistance = step;
  both.Shown.SetTransfer(nodes);
  both.Shown.Look({ 0.4, 1, -0.3 }, 0.8);
  both.Shown.SetGradientOpacity({ { 3, 1 }, { 20, 0.1 } });
  vtkVolumeProperty* property = both.Shown.Property;
  property->SetLabelScalarOpacity(1, Function({ { 12, 0 }, { 80, 0.03 }, { 255, 0.01 } }));
  property->SetLabelGradientOpacity(1, Function({ { 2, 0 }, { 14, 1 } }));
  property->SetLabelScalarOpacity(2, Function({ { 50, 0 }, { 255, 0.02 } }));
  const LabelOf labelOf = [blocks = Blocks(options.Dimensions)](auto i, auto j, auto k)
  { return std::min(blocks(i, j, k), 2); };
  const auto mask = LabelImage(options.Dimensions, labelOf, VTK_UNSIGNED_CHAR);
  SetLabelMask(both.Shown.Mapper, mask);
  SetLabelMask(both.Theirs, mask);
  both.Expect("gradients of labels");
}

TEST(Labels, SameBitsAndEditsLoadNothing)
{
  ImageOptions options;
  options.Dimensions = { 96, 80, 112 };
  const auto mask = LabelImage(options.Dimensions, Blocks(options.Dimensions), VTK_UNSIGNED_CHAR);
  const auto inner = SourceOfImage(MakeImage(options), BrickEdge, false);
  for (const bool nearest : { false, true })
  {
    std::vector<float> first;
    std::vector<float> edited;
    for (const vtkTypeUInt32 limit : { 0u, 16u, 5u })
    {
      const auto source = std::make_shared<RecordingSource>(inner);
      Stage stage(40, 40);
      stage.SetSource(source);
      stage.SetTransfer(MakeTransfer(OpacityShape::Fog));
      stage.SetShade(!nearest);
      stage.Property->SetInterpolationType(
        nearest ? VTK_NEAREST_INTERPOLATION : VTK_LINEAR_INTERPOLATION);
      stage.Mapper->SetMaximumNumberOfSlots(limit);
      stage.Mapper->SetArrivalShuffleSeed(limit);
      SetLabels(stage.Property, 0, 255);
      SetLabelMask(stage.Mapper, mask);
      stage.Look({ 0.4, 1, -0.3 }, 0.8);
      const std::vector<float> picture = stage.Draw();
      ASSERT_TRUE(stage.Mapper->IsConverged());
      EXPECT_GT(*std::max_element(picture.begin(), picture.end()), 0.1f);
      EXPECT_GT(source->Read().size(), 20u);
      first = first.empty() ? picture : first;
      EXPECT_TRUE(AreImagesIdentical(first, picture)) << limit << " slots";
      if (limit == 0)
      {
        stage.Mapper->SetEmptySpaceSkipping(false);
        EXPECT_TRUE(AreImagesIdentical(first, stage.Draw())) << "nothing skipped";
        stage.Mapper->SetEmptySpaceSkipping(true);
      }
      // The function itself, another one for the label, another colour.
      const std::size_t read = source->Read().size();
      const std::uint64_t loaded = stage.Mapper->GetNumberOfBricksLoaded();
      stage.Property->GetLabelScalarOpacity(1)->AddPoint(200, 0.4);
      EXPECT_FALSE(AreImagesIdentical(first, stage.Draw()));
      stage.Property->SetLabelScalarOpacity(1, Function({ { 0, 0.1 }, { 255, 0.3 } }));
      stage.Property->SetLabelColor(3, Colors({ { 0, 0.3, 0.2, 0.9 } }));
      const std::vector<float> after = stage.Draw();
      edited = edited.empty() ? after : edited;
      EXPECT_TRUE(AreImagesIdentical(edited, after)) << limit << " slots, edited";
      if (limit == 0)
      {
        EXPECT_EQ(source->Read().size(), read);
        EXPECT_EQ(stage.Mapper->GetNumberOfBricksLoaded(), loaded);
      }
    }
  }
}

// What a lazy image holds as a pyramid of labels is a mask level by level; one of averages is none.
TEST(Labels, APyramid)
{
  ImageOptions options;
  options.Dimensions = { 96, 80, 112 };
  const auto image = MakeImage(options);
  Stage stage(40, 40);
  PrepareForMask(stage, BrickEdge, image);
  SetLabels(stage.Property, 0, 255);
  const auto mask = LabelImage(options.Dimensions, Blocks(options.Dimensions), VTK_UNSIGNED_SHORT);
  SetLabelMask(stage.Mapper, mask);
  stage.Mapper->SetLevelOfDetailBias(1.5);
  const std::vector<float> ofImage = stage.Draw();
  EXPECT_GT(*std::max_element(ofImage.begin(), ofImage.end()), 0.1f);
  for (const bool labels : { true, false })
  {
    ArrayDescription array;
    array.Data = mask->GetScalarPointer();
    array.Owner = std::shared_ptr<const void>(array.Data, [mask](const void*) {});
    array.Type = ScalarType::UInt16;
    array.Dimensions = { 96, 80, 112 };
    array.BrickSize = BrickEdge;
    array.Labels = labels;
    vtkNew<vtkBrickSource> holder;
    holder->SetBrickSource(ArrayBrickSource::Make(array).Value());
    // The voxels of this image aren't read.
    const auto lazy = LabelImage({ 3, 3, 3 }, [](auto, auto, auto) { return 0; });
    holder->Attach(lazy->GetPointData()->GetScalars());
    SetLabelMask(stage.Mapper, lazy);
    vtkNew<MessageRecorder> recorder;
    const unsigned long tag = stage.Mapper->AddObserver(vtkCommand::ErrorEvent, recorder);
    if (labels)
    {
      EXPECT_TRUE(AreImagesIdentical(ofImage, stage.Draw()));
      EXPECT_TRUE(recorder->Messages.empty());
    }
    else
    {
      stage.DrawPicture();
      ASSERT_EQ(recorder->Messages.size(), 1u);
      EXPECT_NE(recorder->Messages[0].find("averages"), std::string::npos) << recorder->Messages[0];
    }
    stage.Mapper->RemoveObserver(tag);
  }
}

// A share of 0 is no mask; mixing is continuous; warnings where something isn't done.
TEST(Labels, BlendFactorAndWarnings)
{
  const ImageOptions options;
  Stage stage(40, 40);
  PrepareForMask(stage, BrickEdge, MakeImage(options));
  stage.Mapper->SetAutoAdjustSampleDistances(0);
  const std::vector<float> plain = stage.Draw();
  SetLabels(stage.Property, 0, 255);
  SetLabelMask(stage.Mapper, LabelImage(options.Dimensions, Blocks(options.Dimensions)));
  const std::vector<float> labels = stage.Draw();
  EXPECT_FALSE(AreImagesIdentical(labels, plain));
  stage.Mapper->SetMaskBlendFactor(0);
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), plain));
  stage.Mapper->SetMaskBlendFactor(0.5f);
  const std::vector<float> half = stage.Draw();
  EXPECT_GT(CompareImages(half, plain).Mean, 0.2 * CompareImages(labels, plain).Mean);
  EXPECT_GT(CompareImages(half, labels).Mean, 0.2 * CompareImages(labels, plain).Mean);
  vtkNew<MessageRecorder> recorder;
  stage.Mapper->AddObserver(vtkCommand::WarningEvent, recorder);
  stage.Property->SetLabelGradientOpacity(2, Function({ { 0, 0 }, { 20, 1 } }));
  stage.DrawPicture();
  stage.Mapper->SetMaskBlendFactor(1);
  stage.DrawPicture();
  ASSERT_EQ(recorder->Messages.size(), 1u);
  EXPECT_NE(recorder->Messages[0].find("MaskBlendFactor"), std::string::npos);
  stage.Mapper->SetBlendModeToMaximumIntensity();
  stage.DrawPicture();
  stage.DrawPicture();
  ASSERT_EQ(recorder->Messages.size(), 2u);
  EXPECT_NE(recorder->Messages[1].find("LabelMap"), std::string::npos) << recorder->Messages[1];
}
