// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Which array of an image is drawn, and how: by name and number, of points and cells; changes
// between two frames; inputs with nothing to draw; and functions over VTK's two ranges.
#include "BesideVTK.h"
#include "MessageRecorder.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <functional>
#include <gtest/gtest.h>
#include <string>
#include <vector>
#include <vtkCellData.h>
#include <vtkCommand.h>
#include <vtkDataArray.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkRectilinearGrid.h>
#include <vtkTrivialProducer.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

// Fields that a picture tells apart.
double Field(int which, double x, double y, double z)
{
  switch (which)
  {
    case 0:
      return BlobField(x, y, z);
    case 1:
      return 1 - BlobField(x, y, z);
    case 2:
      return BlobField(z, x, y);
    default:
      return BlobField(y, 1 - z, x);
  }
}

vtkSmartPointer<vtkDataArray> ArrayOf(int which, bool cells, ScalarType type)
{
  ImageOptions options;
  options.Type = type;
  options.CellData = cells;
  options.Dimensions = { 24 - (cells ? 1 : 0), 20 - (cells ? 1 : 0), 22 - (cells ? 1 : 0) };
  vtkSmartPointer<vtkImageData> image =
    MakeImage(options, [which](double x, double y, double z) { return Field(which, x, y, z); });
  vtkSmartPointer<vtkDataArray> array =
    cells ? image->GetCellData()->GetScalars() : image->GetPointData()->GetScalars();
  array->SetName(
    (cells ? "cells " + std::to_string(which) : "points " + std::to_string(which)).c_str());
  return array;
}

// 24 x 20 x 22 points, on which nothing lies.
vtkSmartPointer<vtkImageData> BareImage()
{
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetExtent(3, 26, -4, 15, 100, 121);
  image->SetOrigin(-30, 2, 1);
  return image;
}

// Two arrays of points and two of cells, none of them active.
vtkSmartPointer<vtkImageData> FourArrays()
{
  vtkSmartPointer<vtkImageData> image = BareImage();
  image->GetPointData()->AddArray(ArrayOf(0, false, ScalarType::UInt8));
  image->GetPointData()->AddArray(ArrayOf(1, false, ScalarType::Float32));
  image->GetCellData()->AddArray(ArrayOf(2, true, ScalarType::UInt8));
  image->GetCellData()->AddArray(ArrayOf(3, true, ScalarType::UInt16));
  return image;
}

class Scalars : public testing::Test
{
protected:
  Scalars()
    : Shown(48, 48)
    , Image(FourArrays())
  {
    this->Shown.Mapper->SetBrickSize(8);
    this->Shown.Mapper->SetInputData(this->Image);
    this->Shown.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    this->Shown.Look({ 0.4, 1, -0.3 }, 0.8);
    this->Shown.Mapper->AddObserver(vtkCommand::ErrorEvent, this->Errors);
    this->Shown.Mapper->AddObserver(vtkCommand::WarningEvent, this->Warnings);
  }

  // The picture of an array that is the only one of its image.
  static std::vector<float> Alone(int which, bool cells, ScalarType type)
  {
    Stage stage(48, 48);
    stage.Mapper->SetBrickSize(8);
    vtkSmartPointer<vtkImageData> image = BareImage();
    (cells ? static_cast<vtkDataSetAttributes*>(image->GetCellData()) : image->GetPointData())
      ->SetScalars(ArrayOf(which, cells, type));
    stage.SetImage(image);
    stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    stage.Look({ 0.4, 1, -0.3 }, 0.8);
    return stage.Draw();
  }

  Stage Shown;
  vtkSmartPointer<vtkImageData> Image;
  vtkNew<MessageRecorder> Errors;
  vtkNew<MessageRecorder> Warnings;
};

} // namespace

TEST_F(Scalars, ByNameAndNumberOfPointsAndCells)
{
  const std::vector<float> alone[4] = { Alone(0, false, ScalarType::UInt8),
    Alone(1, false, ScalarType::Float32), Alone(2, true, ScalarType::UInt8),
    Alone(3, true, ScalarType::UInt16) };
  for (int a = 0; a < 4; ++a)
  {
    for (int b = 0; b < a; ++b)
    {
      ASSERT_FALSE(AreImagesIdentical(alone[a], alone[b]));
    }
  }
  vtkOutOfCoreVolumeMapper* mapper = this->Shown.Mapper;
  for (const bool byName : { true, false })
  {
    for (const int which : { 0, 3, 1, 2, 0 })
    {
      if (which < 2)
      {
        mapper->SetScalarModeToUsePointFieldData();
      }
      else
      {
        mapper->SetScalarModeToUseCellFieldData();
      }
      const std::string name = (which < 2 ? "points " : "cells ") + std::to_string(which);
      if (byName)
      {
        mapper->SelectScalarArray(name.c_str());
      }
      else
      {
        mapper->SelectScalarArray(which % 2);
      }
      EXPECT_EQ(mapper->GetArrayAccessMode(), byName ? VTK_GET_ARRAY_BY_NAME : VTK_GET_ARRAY_BY_ID);
      EXPECT_TRUE(AreImagesIdentical(this->Shown.Draw(), alone[which])) << name << byName;
    }
  }
  // What is active in the image.
  mapper->SetScalarModeToUsePointData();
  this->Image->GetPointData()->SetActiveScalars("points 1");
  EXPECT_TRUE(AreImagesIdentical(this->Shown.Draw(), alone[1]));
  this->Image->GetPointData()->SetActiveScalars("points 0");
  EXPECT_TRUE(AreImagesIdentical(this->Shown.Draw(), alone[0]));
  mapper->SetScalarModeToUseCellData();
  this->Image->GetCellData()->SetActiveScalars("cells 3");
  EXPECT_TRUE(AreImagesIdentical(this->Shown.Draw(), alone[3]));
  // By default that of the points, without one that of the cells.
  mapper->SetScalarModeToDefault();
  EXPECT_TRUE(AreImagesIdentical(this->Shown.Draw(), alone[0]));
  this->Image->GetPointData()->SetActiveScalars(nullptr);
  EXPECT_TRUE(AreImagesIdentical(this->Shown.Draw(), alone[3]));
  EXPECT_TRUE(this->Errors->Messages.empty()) << this->Errors->Messages[0];
  EXPECT_TRUE(this->Warnings->Messages.empty()) << this->Warnings->Messages[0];
}

// No stale picture, and nothing is read again but what has changed.
TEST_F(Scalars, ChangesBetweenFrames)
{
  vtkOutOfCoreVolumeMapper* mapper = this->Shown.Mapper;
  mapper->SetPictureReuse(0);
  mapper->SetScalarModeToUsePointFieldData();
  mapper->SelectScalarArray("points 0");
  const std::vector<float> first = this->Shown.Draw();
  const std::uint64_t loaded = mapper->GetNumberOfBricksLoaded();
  ASSERT_GT(loaded, 0u);
  // Another array changes, one is added, one is taken away; another becomes active.
  vtkDataArray* drawn = this->Image->GetPointData()->GetArray("points 0");
  vtkDataArray* other = this->Image->GetPointData()->GetArray("points 1");
  other->SetComponent(0, 0, 77);
  other->Modified();
  this->Image->GetPointData()->AddArray(ArrayOf(2, false, ScalarType::Int16));
  this->Image->GetPointData()->SetActiveScalars("points 2");
  this->Image->GetCellData()->RemoveArray("cells 2");
  this->Image->Modified();
  EXPECT_TRUE(AreImagesIdentical(this->Shown.Draw(), first));
  EXPECT_EQ(mapper->GetNumberOfBricksLoaded(), loaded);
  // The image moves: the same voxels elsewhere.
  this->Image->SetOrigin(-28, 2, 1);
  EXPECT_FALSE(AreImagesIdentical(this->Shown.Draw(), first));
  this->Image->SetOrigin(-30, 2, 1);
  EXPECT_TRUE(AreImagesIdentical(this->Shown.Draw(), first));
  EXPECT_EQ(mapper->GetNumberOfBricksLoaded(), loaded);
  // The same array with other values.
  for (vtkIdType i = 0; i < drawn->GetNumberOfTuples(); ++i)
  {
    drawn->SetComponent(i, 0, 255 - drawn->GetComponent(i, 0));
  }
  drawn->Modified();
  const std::vector<float> inverted = this->Shown.Draw();
  EXPECT_FALSE(AreImagesIdentical(inverted, first));
  EXPECT_GT(mapper->GetNumberOfBricksLoaded(), loaded);
  // Another array of the same name: with the first values.
  this->Image->GetPointData()->RemoveArray("points 0");
  this->Image->GetPointData()->AddArray(ArrayOf(0, false, ScalarType::UInt8));
  EXPECT_TRUE(AreImagesIdentical(this->Shown.Draw(), first));
  // Another spacing is another pyramid.
  this->Image->SetSpacing(1, 1, 3);
  this->Shown.Look({ 0.4, 1, -0.3 }, 0.8);
  const std::vector<float> stretched = this->Shown.Draw();
  Stage fresh(48, 48);
  fresh.Mapper->SetBrickSize(8);
  fresh.Mapper->SetInputData(this->Image);
  fresh.Mapper->SetScalarModeToUsePointFieldData();
  fresh.Mapper->SelectScalarArray("points 0");
  fresh.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  fresh.Look({ 0.4, 1, -0.3 }, 0.8);
  const std::vector<float> again = fresh.Draw();
  ASSERT_FALSE(again.empty());
  EXPECT_TRUE(AreImagesIdentical(stretched, again));
  EXPECT_TRUE(this->Errors->Messages.empty()) << this->Errors->Messages[0];
}

TEST_F(Scalars, MissingOnesAreNamed)
{
  vtkOutOfCoreVolumeMapper* mapper = this->Shown.Mapper;
  struct Case
  {
    std::function<void()> Set;
    std::vector<std::string> Said;
  };
  vtkNew<vtkRectilinearGrid> grid;
  vtkNew<vtkFloatArray> coordinates;
  for (const float x : { -20.0f, 0.0f, 100.0f })
  {
    coordinates->InsertNextValue(x);
  }
  grid->SetDimensions(3, 3, 3);
  grid->SetXCoordinates(coordinates);
  grid->SetYCoordinates(coordinates);
  grid->SetZCoordinates(coordinates);
  vtkNew<vtkTrivialProducer> producer;
  const std::vector<Case> cases = {
    { [&] { mapper->SetScalarModeToUsePointData(); },
      { "points", "no active scalars", "\"points 0\" and \"points 1\"" } },
    { [&] { mapper->SetScalarModeToUseCellData(); }, { "cells", "no active", "\"cells 2\"" } },
    { [&] { mapper->SetScalarModeToDefault(); }, { "Neither points nor cells", "\"cells 3\"" } },
    { [&]
      {
        mapper->SetScalarModeToUsePointFieldData();
        mapper->SelectScalarArray("nowhere");
      },
      { "point array \"nowhere\"", "\"points 0\"" } },
    { [&]
      {
        mapper->SetScalarModeToUseCellFieldData();
        mapper->SelectScalarArray(7);
      },
      { "cell array number 7", "\"cells 2\" and \"cells 3\"" } },
    { [&]
      {
        producer->SetOutput(grid);
        mapper->SetInputConnection(producer->GetOutputPort());
      },
      { "vtkRectilinearGrid", "only images" } },
  };
  for (const Case& c : cases)
  {
    this->Errors->Messages.clear();
    c.Set();
    for (const std::vector<float>& picture :
      { this->Shown.DrawPicture(), this->Shown.DrawPicture() })
    {
      const auto drawn = WithoutAlpha(picture);
      EXPECT_EQ(*std::max_element(drawn.begin(), drawn.end()), 0.0f) << c.Said[0];
    }
    ASSERT_EQ(this->Errors->Messages.size(), 1u) << c.Said[0];
    for (const std::string& part : c.Said)
    {
      EXPECT_NE(this->Errors->Messages[0].find(part), std::string::npos)
        << part << ": " << this->Errors->Messages[0];
    }
  }
  // And then there is something to draw again.
  this->Errors->Messages.clear();
  producer->SetOutput(this->Image);
  mapper->SetScalarModeToUsePointFieldData();
  mapper->SelectScalarArray("points 0");
  const auto picture = WithoutAlpha(this->Shown.DrawPicture());
  EXPECT_GT(*std::max_element(picture.begin(), picture.end()), 0.1f);
  EXPECT_TRUE(this->Errors->Messages.empty()) << this->Errors->Messages[0];
}

TEST_F(Scalars, OfTypesAndSizesThatDontFitAreErrors)
{
  vtkOutOfCoreVolumeMapper* mapper = this->Shown.Mapper;
  vtkNew<vtkFloatArray> few;
  few->SetName("few");
  few->SetNumberOfTuples(5);
  few->Fill(1);
  this->Image->GetPointData()->AddArray(few);
  vtkSmartPointer<vtkDataArray> longs =
    vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(VTK_BIT));
  longs->SetName("bits");
  longs->SetNumberOfTuples(this->Image->GetNumberOfPoints());
  this->Image->GetPointData()->AddArray(longs);
  mapper->SetScalarModeToUsePointFieldData();
  for (const char* name : { "few", "bits" })
  {
    this->Errors->Messages.clear();
    mapper->SelectScalarArray(name);
    const auto drawn = WithoutAlpha(this->Shown.DrawPicture());
    EXPECT_EQ(*std::max_element(drawn.begin(), drawn.end()), 0.0f) << name;
    EXPECT_EQ(this->Errors->Messages.size(), 1u) << name;
  }
}

// A sheet without thickness is no volume.
TEST(FlatImages, ShowNothingAndSayWhy)
{
  for (const bool cells : { false, true })
  {
    for (const std::array<int, 3> n : { std::array<int, 3>{ 1, 12, 15 },
           std::array<int, 3>{ 12, 1, 1 }, std::array<int, 3>{ 1, 1, 1 } })
    {
      vtkNew<vtkImageData> image;
      image->SetDimensions(n.data());
      vtkNew<vtkFloatArray> values;
      values->SetName("scalars");
      values->SetNumberOfTuples(cells ? image->GetNumberOfCells() : image->GetNumberOfPoints());
      values->Fill(200);
      (cells ? static_cast<vtkDataSetAttributes*>(image->GetCellData()) : image->GetPointData())
        ->SetScalars(values);
      Stage stage(32, 32);
      vtkNew<MessageRecorder> errors;
      stage.Mapper->AddObserver(vtkCommand::ErrorEvent, errors);
      stage.SetImage(image);
      stage.SetTransfer(MakeTransfer(OpacityShape::Wall));
      stage.LookFrom({ 30, 20, 25 }, { 3, 4, 5 }, 1, 100);
      const auto ours = WithoutAlpha(stage.DrawPicture());
      EXPECT_EQ(*std::max_element(ours.begin(), ours.end()), 0.0f) << n[0] << n[1] << n[2] << cells;
      ASSERT_EQ(errors->Messages.size(), 1u);
      EXPECT_NE(errors->Messages[0].find(std::to_string(n[0]) + " x " + std::to_string(n[1]) +
                  " x " + std::to_string(n[2]) + " points"),
        std::string::npos)
        << errors->Messages[0];
    }
  }
}

// ColorRangeType and ScalarOpacityRangeType: VTK 9.1 stretches a native function over the range of
// the data.
TEST(RangeTypes, ScalarAndNativeAsVTK)
{
  using M = vtkGPUVolumeRayCastMapper;
  ImageOptions options;
  options.Type = ScalarType::Int16;
  options.Low = -500;
  options.High = 1500;
  BesideVTK both(options, 40);
  // Functions that lie inside of that range.
  both.Shown.SetTransfer(MakeTransfer(OpacityShape::Ramp, 200, 900));
  both.Shown.Look({ 0.4, 1, -0.3 }, 0.8);
  std::vector<std::vector<float>> pictures;
  for (const int color : { M::SCALAR, M::NATIVE })
  {
    for (const int opacity : { M::SCALAR, M::NATIVE })
    {
      both.Shown.Mapper->SetColorRangeType(color);
      both.Shown.Mapper->SetScalarOpacityRangeType(opacity);
      both.Theirs->SetColorRangeType(color);
      both.Theirs->SetScalarOpacityRangeType(opacity);
      both.Expect("colour " + std::to_string(color) + ", opacity " + std::to_string(opacity));
      pictures.push_back(both.Shown.Accumulator());
      for (std::size_t i = 0; i + 1 < pictures.size(); ++i)
      {
        EXPECT_FALSE(AreImagesIdentical(pictures[i], pictures.back())) << i;
      }
    }
  }
}

// A function without points becomes a ramp over the range of the data.
TEST(RangeTypes, EmptyFunctionsAsVTK)
{
  ImageOptions options;
  options.Type = ScalarType::Float32;
  options.Low = 3;
  options.High = 5;
  BesideVTK both(options, 40);
  both.Shown.Look({ 0.4, 1, -0.3 }, 0.8);
  both.Shown.Property->SetScalarOpacityUnitDistance(8);
  both.Expect("no points at all"); // VTK draws after us and fills the functions
}
