// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "VTKTestSupport.h"
#include "vtkBrickSource.h"
#include "vtkOutOfCoreTransferFunction.h"

#include <cmath>
#include <fstream>
#include <gtest/gtest.h>
#include <limits>
#include <string>
#include <vtkColorTransferFunction.h>
#include <vtkNew.h>
#include <vtkPiecewiseFunction.h>
#include <vtkVolumeProperty.h>

namespace
{

using teravox::test::FreshFileName;
using teravox::test::IndexBrickSource;

/// Fills a property for a volume with the given range and histogram.
void Fill(vtkVolumeProperty* property, const teravox::ValueRange& range,
  const std::vector<double>& histogram, bool labels = false)
{
  const auto source = IndexBrickSource::Make({ 10, 10, 10 }, 16);
  source->Info_.Range = range;
  source->Info_.Histogram = histogram;
  source->Info_.Labels = labels;
  source->Info_.Spacing = { 0.5, 1.0, 1.5 };
  vtkNew<vtkBrickSource> holder;
  holder->SetBrickSource(source);
  vtkOutOfCoreTransferFunction::MakeAutomatic(holder, property);
}

TEST(VTKTransferFunction, BackgroundIsInvisibleAndForegroundIsNot)
{
  // Two normal distributions, background around 40, foreground around 160 of 0...256.
  std::vector<double> histogram(256);
  for (int i = 0; i < 256; ++i)
  {
    histogram[static_cast<std::size_t>(i)] = 1e6 * std::exp(-0.5 * std::pow((i - 40) / 10.0, 2)) +
      2e5 * std::exp(-0.5 * std::pow((i - 160) / 15.0, 2));
  }
  vtkNew<vtkVolumeProperty> property;
  Fill(property, { 0, 256 }, histogram);
  vtkPiecewiseFunction* opacity = property->GetScalarOpacity();
  EXPECT_EQ(opacity->GetValue(0), 0.0);
  EXPECT_EQ(opacity->GetValue(70), 0.0);
  EXPECT_GT(opacity->GetValue(160), 0.02);
  EXPECT_GT(opacity->GetValue(200), opacity->GetValue(140));
  EXPECT_EQ(property->GetScalarOpacityUnitDistance(), 1.0);
  EXPECT_EQ(property->GetInterpolationType(), VTK_LINEAR_INTERPOLATION);
  EXPECT_EQ(property->GetShade(), 1);
}

TEST(VTKTransferFunction, DegenerateVolumesStillGetUsableFunctions)
{
  const double inf = std::numeric_limits<double>::infinity();
  for (const teravox::ValueRange range :
    { teravox::ValueRange{ 0, 1 }, teravox::ValueRange{ -1e30, 1e30 }, teravox::ValueRange{ 7, 7 },
      teravox::ValueRange{ inf, -inf }, teravox::ValueRange::Unknown() })
  {
    for (const std::vector<double>& histogram :
      { std::vector<double>{}, std::vector<double>(256, 0.0), std::vector<double>{ 5 },
        std::vector<double>{ 0, 0, 0, 9 }, std::vector<double>{ 9, 0, 0, 0 } })
    {
      vtkNew<vtkVolumeProperty> property;
      Fill(property, range, histogram);
      vtkPiecewiseFunction* opacity = property->GetScalarOpacity();
      ASSERT_GE(opacity->GetSize(), 2);
      double visible = 0.0;
      for (int i = 0; i < opacity->GetSize(); ++i)
      {
        double node[4];
        opacity->GetNodeValue(i, node);
        EXPECT_TRUE(std::isfinite(node[0]));
        EXPECT_GE(node[1], 0.0);
        EXPECT_LE(node[1], 1.0);
        visible = std::max(visible, node[1]);
      }
      EXPECT_GT(visible, 0.0);
    }
  }
  vtkNew<vtkVolumeProperty> property;
  vtkOutOfCoreTransferFunction::MakeAutomatic(nullptr, property);
  EXPECT_GT(property->GetScalarOpacity()->GetValue(1.0), 0.0);
}

TEST(VTKTransferFunction, LabelsGetColoursOfTheirOwnAndNearestInterpolation)
{
  vtkNew<vtkVolumeProperty> property;
  Fill(property, { 0, 20 }, {}, true);
  EXPECT_EQ(property->GetInterpolationType(), VTK_NEAREST_INTERPOLATION);
  EXPECT_EQ(property->GetScalarOpacity()->GetValue(0), 0.0);
  for (int label = 1; label < 20; ++label)
  {
    EXPECT_GT(property->GetScalarOpacity()->GetValue(label), 0.1);
    double a[3];
    double b[3];
    property->GetRGBTransferFunction()->GetColor(label, a);
    property->GetRGBTransferFunction()->GetColor(label + 1, b);
    EXPECT_GT(std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]), 0.2);
  }
}

std::string WriteFile(const std::string& text)
{
  const std::string name = FreshFileName("transfer.json");
  std::ofstream(name) << text;
  return name;
}

TEST(VTKTransferFunction, FileIsReadAsWritten)
{
  const std::string name = WriteFile(R"({"opacity": [[10, 0], [20, 0.5, 0.25, 0.5], [30, 1]],
    "color": [[10, 1, 0, 0], [30, 0, 0, 1]], "unitDistance": 2.5, "shade": false,
    "interpolation": "nearest"})");
  vtkNew<vtkVolumeProperty> property;
  property->ShadeOn();
  EXPECT_EQ(vtkOutOfCoreTransferFunction::Read(name, property), "");
  EXPECT_EQ(property->GetScalarOpacity()->GetSize(), 3);
  double node[4];
  property->GetScalarOpacity()->GetNodeValue(1, node);
  EXPECT_EQ(node[0], 20.0);
  EXPECT_EQ(node[1], 0.5);
  EXPECT_EQ(node[2], 0.25);
  EXPECT_EQ(node[3], 0.5);
  EXPECT_EQ(property->GetRGBTransferFunction()->GetBlueValue(30), 1.0);
  EXPECT_EQ(property->GetScalarOpacityUnitDistance(), 2.5);
  EXPECT_EQ(property->GetShade(), 0);
  EXPECT_EQ(property->GetInterpolationType(), VTK_NEAREST_INTERPOLATION);
}

TEST(VTKTransferFunction, BadFilesAreNamedAndChangeNothing)
{
  for (const char* text :
    { "", "{", "[]", "{}", R"({"opacity": [[1, 2]], "color": [[1,0,0,0]]})",
      R"({"opacity": [], "color": [[1,0,0,0]]})", R"({"opacity": [[1, 1]], "color": [[1,0,0]]})",
      R"({"opacity": [[1]], "color": [[1,0,0,0]]})", R"({"opacity": [[]], "color": [[1,0,0,0]]})",
      R"({"opacity": [[0, 1]], "color": [[1,0,0,0]], "unitDistance": 0})",
      R"({"opacity": [[0, 1]], "color": [[1,0,0,0]], "interpolation": "cubic"})",
      R"({"opacity": [[0, 1]], "color": [[1,0,0,0]], "shade": "yes"})" })
  {
    const std::string name = WriteFile(text);
    vtkNew<vtkVolumeProperty> property;
    property->SetScalarOpacityUnitDistance(7.0);
    const std::string reason = vtkOutOfCoreTransferFunction::Read(name, property);
    EXPECT_NE(reason.find(name), std::string::npos) << text;
    EXPECT_EQ(reason.find('\n'), std::string::npos) << reason;
    EXPECT_EQ(property->GetScalarOpacityUnitDistance(), 7.0);
  }
  vtkNew<vtkVolumeProperty> property;
  EXPECT_NE(vtkOutOfCoreTransferFunction::Read("/nowhere/tf.json", property), "");
}

} // namespace
