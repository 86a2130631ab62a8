// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "VTKTestSupport.h"
#include "vtkBrickSource.h"

#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <vtkArrayCalculator.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkExtractVOI.h>
#include <vtkImageChangeInformation.h>
#include <vtkImageData.h>
#include <vtkImageShiftScale.h>
#include <vtkInformation.h>
#include <vtkMath.h>
#include <vtkNew.h>
#include <vtkPassThrough.h>
#include <vtkPointData.h>
#include <vtkStreamingDemandDrivenPipeline.h>

namespace
{

using teravox::BrickKey;
using teravox::Int3;
using teravox::test::AnySourceAlgorithm;
using teravox::test::ErrorRecorder;
using teravox::test::IndexBrickSource;

/// An algorithm over an index volume.
struct Fixture
{
  explicit Fixture(const Int3& dimensions, int brickSize = 16, int components = 1)
    : Source(IndexBrickSource::Make(dimensions, brickSize, components))
  {
    this->Algorithm->Source = this->Source;
    this->Recorder->Observe(this->Algorithm);
    this->Recorder->Observe(this->Algorithm->GetExecutive());
  }

  std::shared_ptr<IndexBrickSource> Source;
  vtkNew<AnySourceAlgorithm> Algorithm;
  vtkNew<ErrorRecorder> Recorder;
};

/// Compares every voxel of an image with the index volume. `first`: VTK's index of voxel 0.
void ExpectIndexValues(vtkImageData* image, vtkDataArray* array, int level, const Int3& first)
{
  ASSERT_NE(array, nullptr);
  const int* extent = image->GetExtent();
  const int more = array == image->GetCellData()->GetScalars() ? 0 : 1;
  vtkIdType i = 0;
  vtkIdType wrong = 0;
  for (int z = extent[4]; z < extent[5] + more; ++z)
  {
    for (int y = extent[2]; y < extent[3] + more; ++y)
    {
      for (int x = extent[0]; x < extent[1] + more; ++x, ++i)
      {
        for (int c = 0; c < array->GetNumberOfComponents(); ++c)
        {
          const double expected =
            IndexBrickSource::ValueAt(level, x - first[0], y - first[1], z - first[2], c);
          wrong += array->GetComponent(i, c) == expected ? 0 : 1;
        }
      }
    }
  }
  EXPECT_EQ(i, array->GetNumberOfTuples());
  EXPECT_EQ(wrong, 0);
}

TEST(VTKLazyImage, InformationPassReadsNoVoxel)
{
  Fixture f({ 70, 50, 30 });
  f.Algorithm->SetLevel(0);
  f.Algorithm->UpdateInformation();
  int extent[6];
  vtkInformation* info = f.Algorithm->GetOutputInformation(0);
  info->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), extent);
  EXPECT_EQ(extent[1], 69);
  EXPECT_EQ(extent[3], 49);
  EXPECT_EQ(extent[5], 29);
  EXPECT_EQ(vtkImageData::GetScalarType(info), VTK_DOUBLE);
  EXPECT_EQ(vtkImageData::GetNumberOfScalarComponents(info), 1);
  EXPECT_EQ(info->Get(vtkAlgorithm::CAN_PRODUCE_SUB_EXTENT()), 1);
  EXPECT_TRUE(f.Source->Reads().empty());
}

TEST(VTKLazyImage, WholeLevelsAreTheVolume)
{
  for (const int components : { 1, 3 })
  {
    Fixture f({ 37, 50, 21 }, 16, components);
    for (int level = 0; level < f.Algorithm->GetNumberOfLevels(); ++level)
    {
      f.Algorithm->SetLevel(level);
      f.Algorithm->Update();
      vtkImageData* image = f.Algorithm->GetOutput();
      ExpectIndexValues(image, image->GetPointData()->GetScalars(), level, { 0, 0, 0 });
    }
    EXPECT_TRUE(f.Recorder->Errors.empty());
  }
}

TEST(VTKLazyImage, EverySubExtentEqualsThatPartOfTheWhole)
{
  Fixture f({ 61, 43, 35 });
  f.Source->Info_.ExtentStart = { -7, 3, 100 };
  f.Algorithm->SetLevel(0);
  std::mt19937 random(7);
  for (int n = 0; n < 60; ++n)
  {
    int extent[6];
    for (std::size_t a = 0; a < 3; ++a)
    {
      const auto size = static_cast<int>(f.Source->Info().Layout.Dimensions(0)[a]);
      const int low = static_cast<int>(random() % static_cast<unsigned>(size));
      const int high = low + static_cast<int>(random() % static_cast<unsigned>(size - low));
      extent[2 * a] = static_cast<int>(f.Source->Info().ExtentStart[a]) + low;
      extent[2 * a + 1] = static_cast<int>(f.Source->Info().ExtentStart[a]) + high;
    }
    f.Algorithm->Modified(); // else an extent inside the last one is answered with that
    f.Algorithm->UpdateExtent(extent);
    vtkImageData* image = f.Algorithm->GetOutput();
    for (int i = 0; i < 6; ++i)
    {
      ASSERT_EQ(image->GetExtent()[i], extent[i]);
    }
    ExpectIndexValues(image, image->GetPointData()->GetScalars(), 0, f.Source->Info().ExtentStart);
    vtkBrickSource* holder = vtkBrickSource::Get(image->GetPointData()->GetScalars());
    ASSERT_NE(holder, nullptr);
    long long first[3];
    long long size[3];
    holder->GetPresentedFirstVoxel(first);
    holder->GetPresentedDimensions(size);
    for (std::size_t a = 0; a < 3; ++a)
    {
      EXPECT_EQ(first[a], extent[2 * a] - f.Source->Info().ExtentStart[a]);
      EXPECT_EQ(size[a], extent[2 * a + 1] - extent[2 * a] + 1);
    }
  }
  EXPECT_TRUE(f.Recorder->Errors.empty());
}

TEST(VTKLazyImage, ReadsOnlyTheBricksOfTheExtent)
{
  Fixture f({ 64, 64, 64 });
  f.Algorithm->SetLevel(0);
  int extent[6] = { 20, 30, 33, 40, 0, 15 };
  f.Algorithm->UpdateExtent(extent);
  ASSERT_EQ(f.Source->Reads().size(), 1u);
  EXPECT_EQ(f.Source->Reads()[0].ToString(), BrickKey({ 0, 0, 0, 0, 0, 1, 2, 0 }).ToString());
}

TEST(VTKLazyImage, GeometryOfALevelPutsItsVoxelsInTheMiddleOfTheirGroups)
{
  Fixture f({ 90, 41, 77 });
  teravox::VolumeInfo& info = f.Source->Info_;
  const double angle = vtkMath::RadiansFromDegrees(25.0);
  info.Direction = { std::cos(angle), -std::sin(angle), 0, std::sin(angle), std::cos(angle), 0, 0,
    0, 1 };
  info.Spacing = { 0.5, 0.7, 3.0 };
  info.Origin = { 10, -20, 5 };
  info.ExtentStart = { 4, -5, 6 };
  for (const bool cells : { false, true })
  {
    info.CellData = cells;
    for (int level = 0; level < info.Layout.NumberOfLevels(); ++level)
    {
      f.Algorithm->SetLevel(level);
      f.Algorithm->SourceModified();
      f.Algorithm->Update();
      vtkImageData* image = f.Algorithm->GetOutput();
      const Int3& factor = info.Layout.Factor(level);
      const int* extent = image->GetExtent();
      // Voxel (1,2,1) of this level, in level-0 voxel indices from the first.
      double index[3] = { extent[0] + 1.0, extent[2] + 2.0, extent[4] + 1.0 };
      double world[3] = { info.Origin[0], info.Origin[1], info.Origin[2] };
      const double steps[3] = { 1, 2, 1 };
      for (std::size_t a = 0; a < 3; ++a)
      {
        index[a] += cells ? 0.5 : 0.0;
        const double f0 = static_cast<double>(factor[a]);
        const double x0 = f0 * steps[a] + (f0 - 1) / 2;
        for (std::size_t row = 0; row < 3; ++row)
        {
          world[row] += info.Direction[3 * row + a] * info.Spacing[a] * x0;
        }
      }
      double placed[3];
      image->TransformContinuousIndexToPhysicalPoint(index, placed);
      for (std::size_t a = 0; a < 3; ++a)
      {
        EXPECT_NEAR(placed[a], world[a], 1e-9) << "level " << level << " cells " << cells;
        const auto size = static_cast<int>(info.Layout.Dimensions(level)[a]);
        EXPECT_EQ(extent[2 * a + 1] - extent[2 * a] + (cells ? 0 : 1), size);
        EXPECT_EQ(extent[2 * a], level == 0 ? info.ExtentStart[a] : 0);
      }
      ExpectIndexValues(image,
        cells ? image->GetCellData()->GetScalars() : image->GetPointData()->GetScalars(), level,
        level == 0 ? info.ExtentStart : Int3{ 0, 0, 0 });
    }
  }
}

TEST(VTKLazyImage, PresentsTheFinestLevelWithAtMostTwoMebivoxels)
{
  Fixture f({ 512, 512, 512 }, 64);
  EXPECT_EQ(f.Algorithm->GetPresentedLevel(), 2); // 128^3 = 2 Mi
  Fixture odd({ 513, 512, 512 }, 64);
  EXPECT_EQ(odd.Algorithm->GetPresentedLevel(), 3);
  Fixture small({ 20, 20, 20 }, 64);
  EXPECT_EQ(small.Algorithm->GetPresentedLevel(), 0);
  EXPECT_TRUE(odd.Source->Reads().empty());
}

TEST(VTKLazyImage, TheArrayKeepsItsSourceThroughFiltersThatPassIt)
{
  Fixture f({ 40, 40, 40 });
  f.Algorithm->SetLevel(1);
  vtkNew<vtkImageChangeInformation> moved;
  moved->SetInputConnection(f.Algorithm->GetOutputPort());
  moved->SetSpacingScale(2, 2, 2);
  vtkNew<vtkPassThrough> passed;
  passed->SetInputConnection(moved->GetOutputPort());
  vtkNew<vtkArrayCalculator> calculator;
  calculator->SetInputConnection(passed->GetOutputPort());
  calculator->AddScalarArrayName("scalars");
  calculator->SetFunction("scalars * 2");
  calculator->SetResultArrayName("twice");
  calculator->Update();
  auto* image = vtkImageData::SafeDownCast(calculator->GetOutput());
  ASSERT_NE(image, nullptr);
  vtkBrickSource* holder = vtkBrickSource::Get(image->GetPointData()->GetArray("scalars"));
  ASSERT_NE(holder, nullptr);
  EXPECT_EQ(holder->GetBrickSource(), f.Source);
  EXPECT_EQ(holder->GetPresentedLevel(), 1);
  EXPECT_EQ(vtkBrickSource::Get(image->GetPointData()->GetArray("twice")), nullptr);
}

TEST(VTKLazyImage, FiltersThatComputeHaveNoSource)
{
  Fixture f({ 40, 40, 40 });
  f.Algorithm->SetLevel(0);
  vtkNew<vtkImageShiftScale> scaled;
  scaled->SetInputConnection(f.Algorithm->GetOutputPort());
  scaled->SetScale(2.0);
  scaled->Update();
  EXPECT_EQ(vtkBrickSource::Get(scaled->GetOutput()->GetPointData()->GetScalars()), nullptr);
  vtkNew<vtkExtractVOI> cut;
  cut->SetInputConnection(f.Algorithm->GetOutputPort());
  cut->SetVOI(5, 20, 5, 20, 5, 20);
  cut->Update();
  EXPECT_EQ(vtkBrickSource::Get(cut->GetOutput()->GetPointData()->GetScalars()), nullptr);
  ExpectIndexValues(cut->GetOutput(), cut->GetOutput()->GetPointData()->GetScalars(), 0, {});
}

TEST(VTKLazyImage, FailedBrickIsReplacedByItsAncestorAndReportedOnce)
{
  Fixture f({ 64, 64, 64 });
  f.Source->Fails = [](const BrickKey& key) { return key.Level == 0 && key.X == 1; };
  f.Algorithm->SetLevel(0);
  f.Algorithm->Update();
  ASSERT_EQ(f.Recorder->Errors.size(), 1u);
  EXPECT_NE(f.Recorder->Errors[0].find("level 0, brick (1,"), std::string::npos)
    << f.Recorder->Errors[0];
  EXPECT_NE(f.Recorder->Errors[0].find("16 of the bricks"), std::string::npos);
  vtkDataArray* array = f.Algorithm->GetOutput()->GetPointData()->GetScalars();
  const auto at = [&](int x, int y, int z)
  { return array->GetComponent((z * 64 + y) * 64 + x, 0); };
  EXPECT_EQ(at(15, 3, 40), IndexBrickSource::ValueAt(0, 15, 3, 40, 0));
  EXPECT_EQ(at(16, 3, 40), IndexBrickSource::ValueAt(1, 8, 1, 20, 0));
  EXPECT_EQ(at(31, 63, 63), IndexBrickSource::ValueAt(1, 15, 31, 31, 0));
  EXPECT_EQ(at(32, 3, 40), IndexBrickSource::ValueAt(0, 32, 3, 40, 0));
}

TEST(VTKLazyImage, FailedAncestorsAreReplacedByTheNextAndZeroIsTheLastResort)
{
  Fixture f({ 64, 64, 64 });
  f.Source->Fails = [](const BrickKey& key) { return key.Level < 2 && key.X == 0; };
  f.Algorithm->SetLevel(0);
  f.Algorithm->Update();
  vtkDataArray* array = f.Algorithm->GetOutput()->GetPointData()->GetScalars();
  EXPECT_EQ(array->GetComponent(5, 0), IndexBrickSource::ValueAt(2, 1, 0, 0, 0));
  f.Source->Fails = [](const BrickKey&) { return true; };
  f.Algorithm->Modified();
  f.Algorithm->Update();
  array = f.Algorithm->GetOutput()->GetPointData()->GetScalars();
  EXPECT_EQ(array->GetRange()[0], 0.0);
  EXPECT_EQ(array->GetRange()[1], 0.0);
  EXPECT_EQ(f.Recorder->Errors.size(), 2u);
}

TEST(VTKLazyImage, ErrorsAreReportedWithoutACrash)
{
  Fixture f({ 64, 64, 64 });
  f.Algorithm->SetLevel(17);
  f.Algorithm->Update();
  ASSERT_FALSE(f.Recorder->Errors.empty());
  EXPECT_NE(f.Recorder->Errors[0].find("Level 17"), std::string::npos) << f.Recorder->Errors[0];
  EXPECT_EQ(f.Algorithm->GetPresentedLevel(), -1);
  f.Recorder->Errors.clear();
  f.Algorithm->Source.reset();
  f.Algorithm->SourceModified();
  EXPECT_EQ(f.Algorithm->GetBrickSource(), nullptr);
  ASSERT_EQ(f.Recorder->Errors.size(), 1u);
  EXPECT_EQ(f.Recorder->Errors[0], "There is no test source.");
  EXPECT_EQ(f.Algorithm->GetNumberOfLevels(), 0);
}

TEST(VTKLazyImage, AnExtentBeyond32BitsIsAnErrorForThatLevelOnly)
{
  Fixture f({ 1000, 8, 8 });
  f.Source->Info_.ExtentStart = { 2147483647 - 500, 0, 0 };
  f.Algorithm->SetLevel(0);
  f.Algorithm->UpdateInformation();
  ASSERT_FALSE(f.Recorder->Errors.empty());
  EXPECT_NE(f.Recorder->Errors[0].find("32 bits"), std::string::npos) << f.Recorder->Errors[0];
  f.Recorder->Errors.clear();
  f.Algorithm->SetLevel(1);
  f.Algorithm->Update();
  EXPECT_TRUE(f.Recorder->Errors.empty());
}

TEST(VTKLazyImage, ChangingTheLevelKeepsTheSource)
{
  Fixture f({ 64, 64, 64 });
  f.Algorithm->Update();
  vtkBrickSource* before = f.Algorithm->GetBrickSource();
  f.Algorithm->SetLevel(1);
  f.Algorithm->Update();
  EXPECT_EQ(f.Algorithm->GetBrickSource(), before);
  EXPECT_EQ(before->GetBrickSource(), f.Source);
}

} // namespace
