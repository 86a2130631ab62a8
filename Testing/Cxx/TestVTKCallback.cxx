// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "VTKTestSupport.h"
#include "vtkBrickSource.h"
#include "vtkCallbackVolumeSource.h"
#include "vtkOutOfCoreTransferFunction.h"

#include <atomic>
#include <gtest/gtest.h>
#include <string>
#include <vtkDataArray.h>
#include <vtkDoubleArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPiecewiseFunction.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkVolumeProperty.h>

namespace
{

using teravox::test::ErrorRecorder;

double ValueAt(int level, long long x, long long y, long long z)
{
  return static_cast<double>(x + 100 * y + 10000 * z + 1000000 * level);
}

/// 20 x 12 x 16 doubles and their halves, whose values tell where they are.
vtkSmartPointer<vtkCallbackVolumeSource> MakeSource()
{
  auto source = vtkSmartPointer<vtkCallbackVolumeSource>::New();
  const long long fine[3] = { 20, 12, 16 };
  const long long coarse[3] = { 10, 6, 8 };
  const long long one[3] = { 1, 1, 1 };
  const long long two[3] = { 2, 2, 2 };
  source->AddLevel(fine, one);
  source->AddLevel(coarse, two);
  source->SetScalarType(VTK_DOUBLE);
  source->SetBrickSize(8);
  source->SetName("the archive");
  source->SetReadFunction(
    [](int level, const long long first[3], const long long size[3], void* voxels)
    {
      auto* out = static_cast<double*>(voxels);
      for (long long z = 0; z < size[2]; ++z)
      {
        for (long long y = 0; y < size[1]; ++y)
        {
          for (long long x = 0; x < size[0]; ++x)
          {
            *out++ = ValueAt(level, first[0] + x, first[1] + y, first[2] + z);
          }
        }
      }
      return std::string();
    });
  return source;
}

TEST(VTKCallbackVolume, PresentsWhatTheFunctionReads)
{
  const auto source = MakeSource();
  source->SetSpacing(1, 2, 3);
  source->SetOrigin(4, 5, 6);
  EXPECT_EQ(source->GetNumberOfLevels(), 3); // the third is made
  for (int level = 0; level < 2; ++level)
  {
    source->SetLevel(level);
    source->Update();
    vtkImageData* image = source->GetOutput();
    EXPECT_EQ(image->GetSpacing()[2], level == 0 ? 3 : 6);
    EXPECT_EQ(image->GetScalarComponentAsDouble(7, 5, 3, 0), ValueAt(level, 7, 5, 3));
    EXPECT_EQ(image->GetScalarComponentAsDouble(9, 5, 7, 0), ValueAt(level, 9, 5, 7));
  }
  vtkBrickSource* bricks = source->GetBrickSource();
  double vector[3];
  bricks->GetOrigin(vector);
  EXPECT_EQ(vector[2], 6);
  bricks->GetSpacing(vector);
  EXPECT_EQ(vector[1], 2);
  EXPECT_EQ(bricks->GetName(), "the archive");
  EXPECT_FALSE(bricks->HasLabels());
  double range[2];
  bricks->GetScalarRange(range);
  EXPECT_GT(range[0], range[1]); // nobody knows
  source->SetScalarRange(0, 2e6);
  source->GetBrickSource()->GetScalarRange(range);
  EXPECT_EQ(range[1], 2e6);
}

TEST(VTKCallbackVolume, ReadVoxelsReadsABoxOrSaysWhyNot)
{
  const auto source = MakeSource();
  vtkBrickSource* bricks = source->GetBrickSource();
  const long long first[3] = { 3, 6, 9 };
  const long long size[3] = { 11, 2, 5 };
  const auto array = vtkSmartPointer<vtkDataArray>::Take(bricks->ReadVoxels(0, first, size));
  ASSERT_TRUE(array);
  ASSERT_EQ(array->GetNumberOfTuples(), 11 * 2 * 5);
  for (vtkIdType i = 0; i < 11 * 2 * 5; ++i)
  {
    EXPECT_EQ(array->GetTuple1(i), ValueAt(0, 3 + i % 11, 6 + i / 11 % 2, 9 + i / 22));
  }
  vtkNew<ErrorRecorder> errors;
  errors->Observe(bricks);
  const long long outside[3] = { 10, 6, 9 };
  const long long huge[3] = { 1ll << 62, 1, 1 };
  EXPECT_FALSE(bricks->ReadVoxels(0, outside, size));
  EXPECT_FALSE(bricks->ReadVoxels(0, first, huge));
  EXPECT_FALSE(bricks->ReadVoxels(7, first, size));
  EXPECT_EQ(errors->Errors.size(), 3u);
  source->SetReadFunction([](int, const long long*, const long long*, void*)
    { return std::string("the archive is closed"); });
  bricks = source->GetBrickSource();
  errors->Observe(bricks);
  EXPECT_FALSE(bricks->ReadVoxels(0, first, size));
  ASSERT_EQ(errors->Errors.size(), 4u);
  EXPECT_NE(errors->Errors.back().find("the archive is closed"), std::string::npos);
}

TEST(VTKCallbackVolume, WhatIsMissingIsAnError)
{
  vtkNew<vtkCallbackVolumeSource> source;
  vtkNew<ErrorRecorder> errors;
  errors->Observe(source);
  EXPECT_FALSE(source->GetBrickSource());
  source->SetReadFunction(
    [](int, const long long*, const long long*, void*) { return std::string(); });
  EXPECT_FALSE(source->GetBrickSource());
  const long long one[3] = { 1, 1, 1 };
  source->AddLevel(one, one);
  source->SetScalarType(VTK_ID_TYPE);
  EXPECT_FALSE(source->GetBrickSource());
  EXPECT_EQ(errors->Errors.size(), 3u);
  source->SetScalarType(VTK_FLOAT);
  EXPECT_TRUE(source->GetBrickSource());
}

TEST(VTKCallbackVolume, ThreadsThatWaitCallTheWaitFunctions)
{
  static std::atomic<int> depth{ 0 };
  static std::atomic<int> waits{ 0 };
  vtkCallbackVolumeSource::SetWaitFunctions(
    []() -> void*
    {
      ++depth;
      ++waits;
      return nullptr;
    },
    [](void*) { --depth; });
  const auto source = MakeSource();
  source->SetLevel(0);
  source->Update();
  vtkCallbackVolumeSource::SetWaitFunctions(nullptr, nullptr);
  EXPECT_GT(waits.load(), 0);
  EXPECT_EQ(depth.load(), 0);
}

TEST(VTKTransferFunction, AHistogramFromElsewhereCounts)
{
  const auto source = MakeSource();
  vtkNew<vtkDoubleArray> histogram;
  for (const double count : { 900.0, 80.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 10.0, 20.0 })
  {
    histogram->InsertNextValue(count);
  }
  vtkNew<vtkVolumeProperty> property;
  vtkOutOfCoreTransferFunction::MakeAutomatic(
    source->GetBrickSource(), 100, 200, histogram, property);
  // Background ends where the histogram is cut best, which is inside of the gap or at its ends.
  EXPECT_EQ(property->GetScalarOpacity()->GetValue(115), 0);
  EXPECT_GT(property->GetScalarOpacity()->GetValue(195), 0.1);
  vtkOutOfCoreTransferFunction::MakeAutomatic(source->GetBrickSource(), 0, 10, nullptr, property);
  EXPECT_EQ(property->GetScalarOpacity()->GetValue(1), 0);
  EXPECT_EQ(property->GetScalarOpacity()->GetValue(10), 0.5);
}

} // namespace
