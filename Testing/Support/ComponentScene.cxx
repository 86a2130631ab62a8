// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "ComponentScene.h"

#include "ScalarBrickSource.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>
#include <limits>
#include <type_traits>
#include <vtkCellData.h>
#include <vtkColorTransferFunction.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkPiecewiseFunction.h>
#include <vtkPointData.h>
#include <vtkVolumeProperty.h>

namespace teravox::test
{

vtkSmartPointer<vtkImageData> MakeComponentImage(const ImageOptions& options, int components,
  const std::function<double(int, double, double, double)>& field)
{
  std::vector<vtkSmartPointer<vtkImageData>> images;
  const auto arrayOf = [&](vtkImageData* image)
  {
    return options.CellData ? image->GetCellData()->GetScalars()
                            : image->GetPointData()->GetScalars();
  };
  for (int c = 0; c < components; ++c)
  {
    images.push_back(
      MakeImage(options, [&](double x, double y, double z) { return field(c, x, y, z); }));
  }
  vtkDataArray* first = arrayOf(images[0]);
  auto all = vtkSmartPointer<vtkDataArray>::Take(first->NewInstance());
  all->SetName("scalars");
  all->SetNumberOfComponents(components);
  all->SetNumberOfTuples(first->GetNumberOfTuples());
  for (int c = 0; c < components; ++c)
  {
    all->CopyComponent(c, arrayOf(images[static_cast<std::size_t>(c)]), 0);
  }
  if (options.CellData)
  {
    images[0]->GetCellData()->SetScalars(all);
  }
  else
  {
    images[0]->GetPointData()->SetScalars(all);
  }
  return images[0];
}

vtkSmartPointer<vtkImageData> MakeComponentImage(const ImageOptions& options, int components)
{
  return MakeComponentImage(options, components,
    [](int c, double x, double y, double z)
    {
      switch (c)
      {
        case 0:
          return BlobField(x, y, z);
        case 1:
          return BlobField(1 - z, 1 - x, y);
        case 2:
          return BlobField(y, 1 - z, 1 - x);
        default:
          return BlobField(z, x, 1 - y);
      }
    });
}

RandomComponents::RandomComponents(RandomNumbers& random, double shareOfNaN)
  : Count(random.Chosen(2, 3, 4))
  , Dependent(this->Count != 3 && random.Uniform(0, 1) < 0.3)
  , Options(OptionsOfType(random.Chosen(ScalarType::UInt8, ScalarType::Int16, ScalarType::UInt32,
      ScalarType::Float32, ScalarType::Float64)))
{
  this->Options.ShareOfNaN = IsFloat(this->Options.Type) ? random.Chosen(0.0, shareOfNaN) : 0;
  this->Options.Dimensions = { random.Chosen(7, 20, 33), random.Chosen(5, 18, 24),
    random.Chosen(9, 17, 30) };
  this->Options.Spacing = { random.Uniform(0.5, 2), random.Uniform(0.5, 2),
    random.Uniform(0.5, 2) };
}

void SetComponentTransfer(Stage& stage, const std::vector<OpacityShape>& shapes, double low,
  double high, double unitDistance)
{
  constexpr std::array<std::array<double, 3>, 4> tints = { { { 1, 0.6, 0.3 }, { 0.2, 0.9, 0.5 },
    { 0.3, 0.4, 1 }, { 0.9, 0.8, 0.2 } } };
  for (std::size_t i = 0; i < shapes.size(); ++i)
  {
    const int c = static_cast<int>(i);
    const TransferNodes nodes = MakeTransfer(shapes[i], low, high, unitDistance);
    auto opacity = vtkSmartPointer<vtkPiecewiseFunction>::New();
    for (const auto& node : nodes.Opacity)
    {
      opacity->AddPoint(node[0], node[1]);
    }
    auto color = vtkSmartPointer<vtkColorTransferFunction>::New();
    for (const auto& node : nodes.Color)
    {
      color->AddRGBPoint(
        node[0], node[1] * tints[i][0], node[2] * tints[i][1], node[3] * tints[i][2]);
    }
    stage.Property->SetScalarOpacity(c, opacity);
    stage.Property->SetColor(c, color);
    stage.Property->SetScalarOpacityUnitDistance(c, unitDistance);
  }
}

ComponentTruth::ComponentTruth(Stage& stage, const std::shared_ptr<BrickSource>& source)
  : Width(stage.Width())
{
  const int components = source->Info().Components;
  const bool byImage =
    stage.Property->GetTransferFunctionMode() == vtkVolumeProperty::TF_2D && components == 2;
  this->Scene_.Dependent = !byImage && stage.Property->GetIndependentComponents() == 0;
  this->Scene_.FullColor = DispatchScalarType(source->Info().Type,
    [](auto zero)
    {
      using T = decltype(zero);
      return std::is_integral_v<T> ? static_cast<double>(std::numeric_limits<T>::max()) : 1.0;
    });
  for (int c = 0; c < components; ++c)
  {
    this->Scalars.push_back(std::make_shared<ScalarBrickSource>(source, c));
    this->Parts.push_back(std::make_unique<StageTruth>(stage, *this->Scalars.back(), 1,
      VoxelAccess::Whole, byImage || this->Scene_.Dependent ? 0 : c));
    this->Scene_.Parts.push_back(&this->Parts.back()->Scene());
    this->Scene_.Weights.push_back(stage.Property->GetComponentWeight(c));
  }
  if (byImage)
  {
    const ValueRange& rows = this->Scalars[1]->Info().Range;
    this->Image = ImageOf(stage.Property, this->Scalars[0]->Info(), rows.Max - rows.Min);
    this->Scene_.Image = this->Image.get();
    const int count = stage.Property->GetTransferFunction2D()->GetDimensions()[1];
    for (int row = 0; row < count; ++row)
    {
      this->Scene_.Rows.push_back(rows.Min + (rows.Max - rows.Min) * row / std::max(count - 1, 1));
    }
  }
}

void ComponentTruth::SetMask(const std::vector<TruthLevel>& levels)
{
  for (const auto& part : this->Parts)
  {
    part->SetMask(levels);
  }
}

ImageDifference ComponentTruth::Excess(
  const std::vector<float>& picture, double small, ImageDifference* plain) const
{
  const std::vector<TruthPixel> pixels = AllPixels(this->Scene_.Parts[0]->Camera);
  const std::vector<float> center = ToFloat(RenderComponents(this->Scene_, pixels));
  std::vector<float> low = center;
  std::vector<float> high = center;
  std::vector<TruthPixel> doubtful;
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < center.size(); i += 4)
  {
    bool far = false;
    for (std::size_t c = i; c < i + 4; ++c)
    {
      far = far || !(std::abs(picture[c] - center[c]) <= small);
    }
    if (far)
    {
      doubtful.push_back(pixels[i / 4]);
      places.push_back(i);
    }
  }
  const TruthEnvelope envelope = RenderComponentEnvelope(this->Scene_, doubtful);
  const std::vector<float> min = ToFloat(envelope.Min);
  const std::vector<float> max = ToFloat(envelope.Max);
  for (std::size_t i = 0; i < places.size(); ++i)
  {
    std::copy_n(&min[4 * i], 4, &low[places[i]]);
    std::copy_n(&max[4 * i], 4, &high[places[i]]);
  }
  if (plain)
  {
    *plain = CompareImages(picture, center);
  }
  return ExcessOverEnvelope(picture, low, high);
}

void ExpectComponentTruth(Stage& stage, const std::shared_ptr<BrickSource>& source,
  const std::string& name, const Bounds& bounds, const std::vector<TruthLevel>& mask)
{
  ComponentTruth truth(stage, source);
  if (!mask.empty())
  {
    truth.SetMask(mask);
  }
  ExpectExcess(
    stage,
    [&](const std::vector<float>& picture, double small, ImageDifference* plain)
    { return truth.Excess(picture, small, plain); },
    [&](const std::vector<float>&, const ImageDifference& excess)
    {
      const auto width = static_cast<std::size_t>(stage.Width());
      return ", pixel " + std::to_string(excess.WorstPixel % width) + ", " +
        std::to_string(excess.WorstPixel / width);
    },
    name, bounds);
}

} // namespace teravox::test
