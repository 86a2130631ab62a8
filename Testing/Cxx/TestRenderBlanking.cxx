// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Blanked points and cells (ghost arrays, uniform grids). Slabs of hidden points against VTK's own
// mapper: what it leaves out is the same, for shapes with edges it is half a voxel less around
// these. Hidden cells against cropping, which cuts along the same faces by other means: VTK 9.1
// itself hides them one cell off.
#include "BesideVTK.h"
#include "MessageRecorder.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <functional>
#include <gtest/gtest.h>
#include <vtkCellData.h>
#include <vtkCommand.h>
#include <vtkDataSetAttributes.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkUniformGrid.h>
#include <vtkUnsignedCharArray.h>
#include <vtkVolume.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

using Inside = std::function<bool(int, int, int)>;

vtkSmartPointer<vtkUnsignedCharArray> Ghosts(
  vtkImageData* image, bool cells, unsigned char value, const Inside& inside)
{
  int n[3];
  image->GetDimensions(n);
  auto ghosts = vtkSmartPointer<vtkUnsignedCharArray>::New();
  ghosts->SetName(vtkDataSetAttributes::GhostArrayName());
  const int less = cells ? 1 : 0;
  for (int k = 0; k < n[2] - less; ++k)
  {
    for (int j = 0; j < n[1] - less; ++j)
    {
      for (int i = 0; i < n[0] - less; ++i)
      {
        ghosts->InsertNextValue(inside(i, j, k) ? value : 0);
      }
    }
  }
  return ghosts;
}

void Hide(vtkImageData* image, bool cells, unsigned char value, const Inside& inside)
{
  (cells ? static_cast<vtkDataSetAttributes*>(image->GetCellData()) : image->GetPointData())
    ->AddArray(Ghosts(image, cells, value, inside));
}

// Both mappers' images.
void Hide(BesideVTK& both, bool cells, unsigned char value, const Inside& inside)
{
  Hide(both.Image, cells, value, inside);
  Hide(vtkImageData::SafeDownCast(both.Theirs->GetInputDataObject(0, 0)), cells, value, inside);
}

constexpr unsigned char HiddenPoint = vtkDataSetAttributes::HIDDENPOINT;
constexpr unsigned char DuplicatePoint = vtkDataSetAttributes::DUPLICATEPOINT;
constexpr unsigned char HiddenCell = vtkDataSetAttributes::HIDDENCELL;

} // namespace

TEST(BlankedPoints, SlabsAsVTK)
{
  for (const unsigned char value : { HiddenPoint, DuplicatePoint })
  {
    for (const int axis : { 0, 1, 2 })
    {
      BesideVTK both({}, 40);
      both.Shown.SetTransfer(MakeTransfer(OpacityShape::Ramp));
      both.Shown.Look({ 0.4, 1, -0.3 }, 0.8);
      const std::vector<float> whole = both.Shown.Draw();
      Hide(both, false, value,
        [axis](int i, int j, int k)
        {
          const int at[3] = { i, j, k };
          return at[axis] >= 17 && at[axis] <= 22;
        });
      both.Expect("slab of points " + std::to_string(axis));
      EXPECT_FALSE(AreImagesIdentical(both.Shown.Accumulator(), whole));
    }
  }
}

// A uniform grid hides points by its own functions; the type of the scalars doesn't matter.
TEST(BlankedPoints, UniformGridOfAnyType)
{
  for (const ScalarType type : AllScalarTypes)
  {
    const ImageOptions options = OptionsOfType(type);
    vtkSmartPointer<vtkImageData> image = MakeImage(options);
    vtkNew<vtkUniformGrid> grid;
    grid->ShallowCopy(image);
    int n[3];
    grid->GetDimensions(n);
    for (int k = 0; k < n[2]; ++k)
    {
      for (int j = 0; j < n[1]; ++j)
      {
        for (int i = 17; i < n[0]; ++i)
        {
          grid->BlankPoint((vtkIdType{ k } * n[1] + j) * n[0] + i);
        }
      }
    }
    Stage stage(40, 40);
    stage.Mapper->SetBrickSize(16);
    stage.SetImage(grid);
    stage.SetTransfer(MakeTransfer(OpacityShape::Ramp, options.Low, options.High));
    stage.Look({ 0.4, 1, -0.3 }, 0.8);
    const std::vector<float> blanked = stage.Draw();
    EXPECT_TRUE(stage.Mapper->IsConverged());
    // The same with a cut where the last visible points are.
    Stage cropped(40, 40);
    cropped.Mapper->SetBrickSize(16);
    cropped.SetImage(image);
    cropped.SetTransfer(MakeTransfer(OpacityShape::Ramp, options.Low, options.High));
    cropped.Look({ 0.4, 1, -0.3 }, 0.8);
    const std::vector<float> whole = cropped.Draw();
    cropped.Mapper->SetCropping(1);
    cropped.Mapper->SetCroppingRegionFlags(0x2000);
    cropped.Mapper->SetCroppingRegionPlanes(-1000, 16, -1000, 1000, -1000, 1000);
    const ImageDifference difference = CompareImages(blanked, cropped.Draw());
    EXPECT_LE(difference.Max, 2.0 / 255) << ToString(type); // each within 1/255 of the truth
    EXPECT_GT(CompareImages(blanked, whole).Max, 0.1) << ToString(type);
  }
}

// The part that is hidden ends at the faces of its cells, however it lies: not one cell further.
TEST(BlankedCells, OfPointDataEndAtTheirFaces)
{
  const Int3 low{ 14, 11, 17 };
  for (const Int3& high : { Int3{ 22, 19, 30 }, Int3{ 16, 13, 19 } })
  {
    Stage stage(40, 40);
    stage.Mapper->SetBrickSize(16);
    vtkSmartPointer<vtkImageData> image = MakeImage({});
    stage.SetImage(image);
    TransferNodes nodes = MakeTransfer(OpacityShape::Ramp);
    nodes.Opacity = { { 0, 0.02 }, { 255, 0.05 } }; // from within, too
    stage.SetTransfer(nodes);
    stage.Look({ 0.4, 1, -0.3 }, 0.8);
    vtkNew<MessageRecorder> warnings;
    stage.Mapper->AddObserver(vtkCommand::WarningEvent, warnings);
    const std::vector<float> whole = stage.Draw();
    stage.Mapper->SetCropping(1);
    stage.Mapper->SetCroppingRegionFlags(0x7ffffff & ~0x2000);
    stage.Mapper->SetCroppingRegionPlanes(static_cast<double>(low[0]), static_cast<double>(high[0]),
      static_cast<double>(low[1]), static_cast<double>(high[1]), static_cast<double>(low[2]),
      static_cast<double>(high[2]));
    const std::vector<float> cropped = stage.Draw();
    stage.Mapper->SetCropping(0);
    Hide(image, true, HiddenCell,
      [&](int i, int j, int k) {
        return i >= low[0] && i < high[0] && j >= low[1] && j < high[1] && k >= low[2] &&
          k < high[2];
      });
    const std::vector<float> blanked = stage.Draw();
    EXPECT_LE(CompareImages(blanked, cropped).Max, 2.0 / 255); // each within 1/255 of the truth
    EXPECT_GT(CompareImages(blanked, whole).Max, 4.0 / 255);
    EXPECT_TRUE(warnings->Messages.empty()) << warnings->Messages[0];
    // The ghosts change in place; then they go.
    auto* ghosts = vtkUnsignedCharArray::SafeDownCast(
      image->GetCellData()->GetArray(vtkDataSetAttributes::GhostArrayName()));
    ghosts->Fill(0);
    ghosts->Modified();
    EXPECT_TRUE(AreImagesIdentical(stage.Draw(), whole));
  }
}

// One layer of cells at the border: nothing lies behind it. Of one value, which isn't to be taken
// for a part of the volume that has it everywhere.
TEST(BlankedCells, OneLayerAtTheBorder)
{
  Stage stage(40, 40);
  stage.Mapper->SetBrickSize(16);
  vtkSmartPointer<vtkImageData> image = MakeImage({}, [](double, double, double) { return 0.8; });
  stage.SetImage(image);
  stage.SetTransfer(MakeTransfer(OpacityShape::Fog, 0, 200));
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
  vtkNew<MessageRecorder> warnings;
  stage.Mapper->AddObserver(vtkCommand::WarningEvent, warnings);
  stage.Mapper->SetCropping(1);
  stage.Mapper->SetCroppingRegionFlags(0x2000);
  stage.Mapper->SetCroppingRegionPlanes(1, 39, 0, 34, 0, 43);
  const std::vector<float> cropped = stage.Draw();
  stage.Mapper->SetCropping(0);
  Hide(image, true, HiddenCell, [](int i, int j, int) { return i == 0 || j == 34; });
  EXPECT_LE(CompareImages(stage.Draw(), cropped).Max, 2.0 / 255);
  EXPECT_TRUE(warnings->Messages.empty()) << warnings->Messages[0];
}

// Hidden cells are hidden in any case, and what goes with them is told.
TEST(BlankedCells, ThinPartsTakeOthersAlongAndWarn)
{
  Stage stage(40, 40);
  vtkSmartPointer<vtkImageData> image = MakeImage({}, [](double, double, double) { return 0.8; });
  stage.SetImage(image);
  stage.SetTransfer(MakeTransfer(OpacityShape::Fog, 0, 200));
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
  vtkNew<MessageRecorder> warnings;
  stage.Mapper->AddObserver(vtkCommand::WarningEvent, warnings);
  const auto opacity = [](const std::vector<float>& picture)
  {
    double sum = 0;
    for (std::size_t i = 3; i < picture.size(); i += 4)
    {
      sum += static_cast<double>(picture[i]);
    }
    return sum;
  };
  const double whole = opacity(stage.Draw());
  Hide(image, true, HiddenCell, [](int i, int, int) { return i == 20; });
  const double blanked = opacity(stage.Draw());
  stage.Draw();
  // One layer of 39 is hidden, the one beside it goes as well: 2/39, and no more.
  EXPECT_NEAR((whole - blanked) / whole, 2.0 / 39, 0.01);
  ASSERT_EQ(warnings->Messages.size(), 1u);
  EXPECT_NE(warnings->Messages[0].find("1505 of the cells"), std::string::npos) // 35 x 43
    << warnings->Messages[0];
}

// Of cell data a hidden cell, or one with a hidden point, has no value, nor what is interpolated
// from it: half a cell on each side.
TEST(BlankedCells, OfCellData)
{
  for (const bool byPoints : { false, true })
  {
    ImageOptions options;
    options.CellData = true;
    vtkSmartPointer<vtkImageData> image = MakeImage(options);
    Stage stage(40, 40);
    stage.Mapper->SetBrickSize(16);
    stage.SetImage(image);
    stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    stage.Look({ 0.4, 1, -0.3 }, 0.8);
    const std::vector<float> whole = stage.Draw();
    stage.Mapper->SetCropping(1);
    stage.Mapper->SetCroppingRegionFlags(0x2000);
    stage.Mapper->SetCroppingRegionPlanes(0, 16.5, 0, 100, 0, 100);
    const std::vector<float> cropped = stage.Draw();
    stage.Mapper->SetCropping(0);
    if (byPoints)
    {
      Hide(image, false, HiddenPoint, [](int i, int, int) { return i >= 18; });
    }
    else
    {
      Hide(image, true, HiddenCell, [](int i, int, int) { return i >= 17; });
    }
    const std::vector<float> blanked = stage.Draw();
    EXPECT_LE(CompareImages(blanked, cropped).Max, 2.0 / 255) << byPoints;
    EXPECT_GT(CompareImages(blanked, whole).Max, 0.1) << byPoints;
  }
}

// The same bits with few slots and without skipping; the copy counts against the host's budget.
TEST(BlankedCells, AnyAtlasTheSameBitsWithinTheBudget)
{
  Stage stage(40, 40);
  stage.Mapper->SetBrickSize(8);
  vtkSmartPointer<vtkImageData> image = MakeImage({});
  Hide(image, true, HiddenCell, [](int i, int j, int k) { return i + j > k && i < 25; });
  stage.SetImage(image);
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
  const std::vector<float> picture = stage.Draw();
  stage.Mapper->SetEmptySpaceSkipping(0);
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), picture));
  stage.Mapper->SetEmptySpaceSkipping(1);
  stage.Mapper->SetMaximumNumberOfSlots(16);
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), picture));
  const std::uint64_t copy = 40 * 36 * 44 * sizeof(float);
  EXPECT_GE(stage.Mapper->GetHostMemoryUsed(), copy);
  vtkNew<MessageRecorder> errors;
  stage.Mapper->AddObserver(vtkCommand::ErrorEvent, errors);
  stage.Mapper->SetHostMemoryBudget(copy);
  stage.Draw();
  ASSERT_EQ(errors->Messages.size(), 1u);
  EXPECT_NE(errors->Messages[0].find("budget"), std::string::npos) << errors->Messages[0];
}

// A ghost array of another size is an error, not a crash.
TEST(BlankedCells, GhostsOfAnotherSize)
{
  Stage stage(32, 32);
  vtkSmartPointer<vtkImageData> image = MakeImage({});
  vtkNew<vtkUnsignedCharArray> ghosts;
  ghosts->SetName(vtkDataSetAttributes::GhostArrayName());
  ghosts->InsertNextValue(1);
  image->GetPointData()->AddArray(ghosts);
  stage.SetImage(image);
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  vtkNew<MessageRecorder> errors;
  stage.Mapper->AddObserver(vtkCommand::ErrorEvent, errors);
  stage.Look({ 0.4, 1, -0.3 }, 0.8);
  stage.DrawPicture();
  ASSERT_EQ(errors->Messages.size(), 1u);
  EXPECT_NE(errors->Messages[0].find("ghost array"), std::string::npos) << errors->Messages[0];
}
