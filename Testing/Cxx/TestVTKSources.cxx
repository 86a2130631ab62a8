// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "VTKScalarType.h"
#include "VTKTestSupport.h"
#include "vtkBrickSource.h"
#include "vtkHDF5PyramidReader.h"
#include "vtkHDF5PyramidWriter.h"
#include "vtkProceduralVolumeSource.h"
#include "vtkRepeatVolume.h"

#include <cmath>
#include <gtest/gtest.h>
#include <vtkDataArray.h>
#include <vtkExecutive.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkTrivialProducer.h>

namespace
{

using teravox::test::ErrorRecorder;
using teravox::test::FreshFileName;
using teravox::test::MakeRandomImage;

TEST(VTKProceduralVolume, RampIsTheFormulaAtEachLevel)
{
  vtkNew<vtkProceduralVolumeSource> source;
  source->SetFunction(vtkProceduralVolumeSource::RAMP);
  source->SetDimensions(96, 20, 30);
  source->SetScalarType(VTK_DOUBLE);
  source->SetBrickSize(16);
  ASSERT_GE(source->GetNumberOfLevels(), 3);
  for (int level = 0; level < 3; ++level)
  {
    source->SetLevel(level);
    source->Update();
    vtkImageData* image = source->GetOutput();
    vtkDataArray* array = image->GetPointData()->GetScalars();
    for (vtkIdType i = 0; i < array->GetNumberOfTuples(); ++i)
    {
      double p[3];
      image->GetPoint(i, p);
      ASSERT_NEAR(array->GetComponent(i, 0), (p[0] + 0.5) / 96.0, 1e-12) << level << " " << i;
    }
  }
}

TEST(VTKProceduralVolume, EveryFunctionAndTypeFillsItsOutputRange)
{
  vtkNew<vtkProceduralVolumeSource> source;
  vtkNew<ErrorRecorder> errors;
  errors->Observe(source);
  source->SetDimensions(54, 54, 54);
  source->SetLevel(0);
  for (const char* name : { "constant", "ramp", "shells", "marschner-lobb", "sponge" })
  {
    source->SetFunctionName(name);
    EXPECT_STREQ(source->GetFunctionName(), name);
    for (const teravox::ScalarType type : teravox::AllScalarTypes)
    {
      source->SetScalarType(teravox::ToVTK(type));
      source->SetOutputRange(10, 110);
      source->Update();
      vtkDataArray* array = source->GetOutput()->GetPointData()->GetScalars();
      ASSERT_EQ(array->GetDataType(), teravox::ToVTK(type));
      ASSERT_EQ(array->GetNumberOfTuples(), 54 * 54 * 54);
      EXPECT_GE(array->GetRange()[0], 10.0) << name;
      EXPECT_LE(array->GetRange()[1], 110.0) << name;
      if (std::string(name) != "constant")
      {
        EXPECT_GT(array->GetRange()[1] - array->GetRange()[0], 50.0) << name;
      }
    }
  }
  EXPECT_TRUE(errors->Errors.empty());
}

TEST(VTKProceduralVolume, TwoToTheThirtyPerAxisHasAPresentableLevel)
{
  vtkNew<vtkProceduralVolumeSource> source;
  source->SetFunction(vtkProceduralVolumeSource::SPONGE);
  const long long size = 1ll << 30;
  source->SetDimensions(size, size, size);
  source->Update();
  vtkImageData* image = source->GetOutput();
  EXPECT_EQ(image->GetDimensions()[0], 128);
  EXPECT_GT(image->GetPointData()->GetScalars()->GetRange()[1], 0.0);
  double bounds[6];
  image->GetBounds(bounds);
  EXPECT_NEAR(bounds[1] - bounds[0], static_cast<double>(size) * 127 / 128, 1.0);
  long long level[3];
  source->GetLevelDimensions(0, level);
  EXPECT_EQ(level[2], size);
}

TEST(VTKProceduralVolume, BadSettingsAreErrors)
{
  const auto expect = [](const char* text, const auto& setUp)
  {
    vtkNew<vtkProceduralVolumeSource> source;
    vtkNew<ErrorRecorder> errors;
    errors->Observe(source);
    errors->Observe(source->GetExecutive());
    setUp(source.Get());
    source->Update();
    ASSERT_FALSE(errors->Errors.empty()) << text;
    EXPECT_NE(errors->Errors[0].find(text), std::string::npos) << errors->Errors[0];
  };
  expect("axis 1", [](auto* s) { s->SetDimensions(10, 0, 10); });
  expect("each axis must have", [](auto* s) { s->SetDimensions(10, 10, 1ll << 31); });
  expect("spacing", [](auto* s) { s->SetSpacing(1, 1, -1); });
  expect("scalar type", [](auto* s) { s->SetScalarType(VTK_LONG_LONG); });
  expect("marschner-lobb", [](auto* s) { s->SetFunctionName("teapot"); });
  expect("output", [](auto* s) { s->SetOutputRange(0, 300); });
}

TEST(VTKRepeatVolume, RepeatsAnOrdinaryImageWithBackgroundBetween)
{
  const int extent[6] = { 5, 14, 0, 7, 0, 8 };
  const auto image = MakeRandomImage(VTK_SHORT, extent, 1, false, 21);
  vtkNew<vtkTrivialProducer> producer;
  producer->SetOutput(image);
  vtkNew<vtkRepeatVolume> repeat;
  repeat->SetInputConnection(producer->GetOutputPort());
  repeat->SetRepetitions(3, 2, 2);
  repeat->SetPitch(12, 8, 10);
  repeat->SetBackground(-5);
  repeat->SetLevel(0);
  repeat->Update();
  vtkImageData* output = repeat->GetOutput();
  vtkDataArray* in = image->GetPointData()->GetScalars();
  vtkDataArray* out = output->GetPointData()->GetScalars();
  const int* dims = output->GetDimensions();
  ASSERT_GE(dims[0], 34);
  ASSERT_GE(dims[1], 16);
  ASSERT_GE(dims[2], 19);
  vtkIdType wrong = 0;
  for (int z = 0; z < dims[2]; ++z)
  {
    for (int y = 0; y < dims[1]; ++y)
    {
      for (int x = 0; x < dims[0]; ++x)
      {
        const int at[3] = { x % 12, y % 8, z % 10 };
        const bool inside = at[0] < 10 && at[1] < 8 && at[2] < 9;
        const double expected =
          inside ? in->GetComponent((at[2] * 8 + at[1]) * 10 + at[0], 0) : -5.0;
        wrong +=
          out->GetComponent((static_cast<vtkIdType>(z) * dims[1] + y) * dims[0] + x, 0) == expected
          ? 0
          : 1;
      }
    }
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_NE(vtkBrickSource::Get(out), nullptr);
}

TEST(VTKRepeatVolume, FollowsTheInput)
{
  const int extent[6] = { 0, 9, 0, 9, 0, 9 };
  const auto image = MakeRandomImage(VTK_UNSIGNED_CHAR, extent, 1, false, 1);
  vtkNew<vtkTrivialProducer> producer;
  producer->SetOutput(image);
  vtkNew<vtkRepeatVolume> repeat;
  repeat->SetInputConnection(producer->GetOutputPort());
  repeat->SetRepetitions(2, 1, 1);
  repeat->SetLevel(0);
  repeat->Update();
  EXPECT_EQ(repeat->GetOutput()->GetDimensions()[0], 20);
  const auto first = repeat->GetBrickSource()->GetBrickSource();
  repeat->Update();
  EXPECT_EQ(repeat->GetBrickSource()->GetBrickSource(), first);
  const int larger[6] = { 0, 14, 0, 9, 0, 9 };
  producer->SetOutput(MakeRandomImage(VTK_UNSIGNED_CHAR, larger, 1, false, 2));
  repeat->Update();
  EXPECT_EQ(repeat->GetOutput()->GetDimensions()[0], 30);
  repeat->SetRepetitions(3, 1, 1);
  repeat->Update();
  EXPECT_EQ(repeat->GetOutput()->GetDimensions()[0], 45);
}

TEST(VTKRepeatVolume, RepeatsAllLevelsOfAFormula)
{
  vtkNew<vtkProceduralVolumeSource> source;
  source->SetDimensions(1 << 20, 1 << 20, 1 << 20);
  vtkNew<vtkRepeatVolume> repeat;
  repeat->SetInputConnection(source->GetOutputPort());
  repeat->SetRepetitions(2, 2, 2);
  repeat->Update();
  long long dims[3];
  repeat->GetLevelDimensions(0, dims);
  EXPECT_EQ(dims[0], 1ll << 21);
  vtkNew<vtkRepeatVolume> again;
  again->SetInputBrickSource(repeat->GetBrickSource());
  again->SetRepetitions(4, 1, 1);
  again->GetLevelDimensions(0, dims);
  EXPECT_EQ(dims[0], 1ll << 23);
}

TEST(VTKRepeatVolume, BadSettingsAreErrors)
{
  vtkNew<vtkRepeatVolume> repeat;
  vtkNew<ErrorRecorder> errors;
  errors->Observe(repeat);
  errors->Observe(repeat->GetExecutive());
  repeat->Update();
  ASSERT_FALSE(errors->Errors.empty());
  EXPECT_NE(errors->Errors[0].find("nothing to repeat"), std::string::npos) << errors->Errors[0];
  errors->Errors.clear();
  vtkNew<vtkProceduralVolumeSource> source;
  repeat->SetInputConnection(source->GetOutputPort());
  repeat->SetPitch(10, 10, 10);
  repeat->Update();
  ASSERT_FALSE(errors->Errors.empty());
  EXPECT_NE(errors->Errors[0].find("pitch"), std::string::npos) << errors->Errors[0];
  errors->Errors.clear();
  repeat->SetPitch(0, 0, 0);
  repeat->SetRepetitions(0, 1, 1);
  repeat->Update();
  EXPECT_FALSE(errors->Errors.empty());
}

} // namespace
