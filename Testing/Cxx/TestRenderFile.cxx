// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// From a pyramid on disk to a picture: a sparse tebibyte costs what a gibibyte does, and picking
// reads no more than the level that the pipeline presents.
#include "CornersReader.h"
#include "PyramidWriter.h"
#include "Scene.h"
#include "VTKTestSupport.h"
#include "vtkBrickSource.h"
#include "vtkHDF5PyramidReader.h"
#include "vtkHDF5PyramidWriter.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <string>
#include <vector>
#include <vtkCamera.h>
#include <vtkImageData.h>
#include <vtkMath.h>
#include <vtkNew.h>
#include <vtkPiecewiseFunction.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkVolumePicker.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

// Bytes that the process has read from files; 0 where the system doesn't tell. Not the source's own
// counter.
std::uint64_t BytesReadByProcess()
{
  std::ifstream io("/proc/self/io");
  std::string word;
  std::uint64_t bytes = 0;
  while (io >> word)
  {
    if (word == "rchar:")
    {
      io >> bytes;
      break;
    }
  }
  return bytes;
}

// A cube 1024 wide in the world, of any number of voxels, with data in two opposite corners of 1/32
// of its edge. What lies there depends on the place in the cube, and is constant over an eighth of
// a corner: all cubes are one picture, up to the level at which that is a voxel.
constexpr double WorldEdge = 1024;
constexpr std::int64_t CornerShare = 32;

std::string WriteCorners(const std::string& name, std::int64_t edge, ScalarType type)
{
  VoxelReader::Description volume;
  volume.Dimensions = { edge, edge, edge };
  volume.Type = type;
  volume.CellData = true; // so that the bounds are those of the cube, whatever the voxels
  const double spacing = WorldEdge / static_cast<double>(edge);
  volume.Spacing = { spacing, spacing, spacing };
  volume.Origin = { 0.5 * spacing, 0.5 * spacing, 0.5 * spacing };
  const std::int64_t corner = edge / CornerShare;
  CornersReader reader(volume, corner,
    [part = corner / 8](bool high, std::int64_t x, std::int64_t y, std::int64_t z)
    { return static_cast<int>((high ? 180 : 80) + 10 * ((x + 2 * y + 3 * z) / part % 5)); });
  const std::string file = FreshFileName(name);
  PyramidWriterOptions options;
  options.MemoryLimit = 256 << 20;
  const auto report = PyramidWriter::Write(file, reader, options);
  EXPECT_TRUE(report.Ok()) << report.GetStatus().Message();
  return report.Ok() ? file : std::string();
}

struct Cost
{
  std::vector<float> Picture;
  double Addressing = 0;
  double GPU = 0;
  double Host = 0;
  double Passes = 0;
  double Operations = 0;
  double Bricks = 0;
  double BytesRead = 0;
  double BytesUploaded = 0;
};

std::size_t PixelOf(Stage& stage, double x, double y, double z)
{
  stage.Renderer->SetWorldPoint(x, y, z, 1);
  stage.Renderer->WorldToDisplay();
  const double* at = stage.Renderer->GetDisplayPoint();
  const int column = static_cast<int>(std::floor(at[0]));
  const int row = static_cast<int>(std::floor(at[1]));
  EXPECT_TRUE(column >= 0 && column < stage.Width() && row >= 0 && row < stage.Height());
  return 4 * static_cast<std::size_t>(row * stage.Width() + column);
}

void SetCornerTransfer(Stage& stage)
{
  TransferNodes nodes;
  nodes.Opacity = { { 0, 0 }, { 40, 0 }, { 70, 0.2 }, { 255, 0.2 } };
  nodes.Color = { { 0, 1, 0, 0 }, { 140, 1, 0, 0 }, { 160, 0, 0, 1 }, { 255, 0, 0, 1 } };
  nodes.UnitDistance = WorldEdge / 128;
  stage.SetTransfer(nodes);
}

Cost DrawCorners(const std::string& file)
{
  Cost cost;
  const std::uint64_t readBefore = BytesReadByProcess();
  const auto start = std::chrono::steady_clock::now();
  vtkNew<vtkHDF5PyramidReader> reader;
  reader->SetFileName(file.c_str());
  reader->SetBrickSize(8);
  reader->UpdateInformation();
  vtkBrickSource* holder = reader->GetBrickSource();
  EXPECT_TRUE(holder && holder->GetBrickSource());
  if (!holder || !holder->GetBrickSource())
  {
    return cost;
  }
  BrickSource& source = *holder->GetBrickSource();
  std::printf("  opened in %.4f s, %llu bytes read by the process\n",
    std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
    static_cast<unsigned long long>(BytesReadByProcess() - readBefore));
  EXPECT_EQ(source.BytesRead(), 0u) << "opening reads no chunk";
  EXPECT_LT(BytesReadByProcess() - readBefore, 1u << 20);

  Stage stage(480, 480);
  stage.Mapper->SetBrickSource(holder);
  stage.Mapper->SetGPUMemoryBudget(32 << 20);
  stage.Mapper->SetHostMemoryBudget(32 << 20);
  stage.Mapper->SetMaximumNumberOfSlots(256);
  SetCornerTransfer(stage);
  stage.Look({ 0.3, 1, -0.2 }, 1);
  EXPECT_EQ(source.BytesRead(), 0u) << "placing the camera reads no chunk";
  cost.Picture = stage.Draw();
  EXPECT_TRUE(stage.Mapper->IsConverged());
  EXPECT_LE(stage.Mapper->GetPeakGPUMemoryUsed(), std::uint64_t{ 32 } << 20);
  EXPECT_LE(stage.Mapper->GetHostMemoryUsed(), std::uint64_t{ 32 } << 20);
  EXPECT_EQ(cost.Picture.size(), std::size_t{ 4 } * 480 * 480);
  if (cost.Picture.size() != std::size_t{ 4 } * 480 * 480)
  {
    return cost;
  }

  // Both corners where they belong, each in its colour, and nothing between them.
  constexpr double half = 0.5 * WorldEdge / CornerShare;
  const float* low = &cost.Picture[PixelOf(stage, half, half, half)];
  EXPECT_GT(low[0], 0.3f);
  EXPECT_EQ(low[2], 0.0f);
  EXPECT_GT(low[3], 0.3f);
  constexpr double other = WorldEdge - half;
  const float* high = &cost.Picture[PixelOf(stage, other, other, other)];
  EXPECT_GT(high[2], 0.3f);
  EXPECT_LT(high[0], 0.2f * high[2]); // the flank of the block is red
  EXPECT_GT(high[3], 0.3f);
  constexpr double middle = 0.5 * WorldEdge;
  EXPECT_EQ(cost.Picture[PixelOf(stage, middle, middle, middle) + 3], 0.0f);
  std::size_t seen = 0;
  for (std::size_t i = 3; i < cost.Picture.size(); i += 4)
  {
    seen += cost.Picture[i] > 0 ? 1 : 0;
  }
  EXPECT_LT(seen, 480u * 480 / 100);

  cost.Addressing = static_cast<double>(stage.Mapper->GetAddressingMemoryUsed());
  cost.GPU = static_cast<double>(stage.Mapper->GetGPUMemoryUsed());
  cost.Host = static_cast<double>(stage.Mapper->GetHostMemoryUsed());
  cost.Passes = static_cast<double>(stage.Mapper->GetNumberOfPasses());
  cost.Operations = static_cast<double>(stage.Mapper->GetNumberOfOperations());
  cost.Bricks = static_cast<double>(stage.Mapper->GetNumberOfBricksLoaded());
  cost.BytesRead = static_cast<double>(stage.Mapper->GetBytesRead());
  cost.BytesUploaded = static_cast<double>(stage.Mapper->GetBytesUploaded());
  std::printf("  %.0f operations, %.0f passes, %.0f bricks, %.0f bytes read, %.0f uploaded, "
              "addressing %.0f, host %.0f bytes\n",
    cost.Operations, cost.Passes, cost.Bricks, cost.BytesRead, cost.BytesUploaded, cost.Addressing,
    cost.Host);
  // The same picture computed again costs nothing but its one pass.
  stage.Mapper->PictureReuseOff();
  stage.Draw();
  EXPECT_EQ(stage.Mapper->GetNumberOfPasses(), 1u);
  EXPECT_EQ(stage.Mapper->GetNumberOfOperations(), 0u);
  EXPECT_EQ(static_cast<double>(stage.Mapper->GetBytesRead()), cost.BytesRead);
  return cost;
}

} // namespace

TEST(SparseFile, TebibyteCostsWhatAGibibyteDoes)
{
  const std::string small = WriteCorners("gibibyte.h5", 1024, ScalarType::UInt8);
  const std::string large = WriteCorners("tebibyte.h5", 8192, ScalarType::UInt16);
  ASSERT_FALSE(small.empty() || large.empty());
  EXPECT_LT(std::filesystem::file_size(large), 64u << 20);
  const Cost gibibyte = DrawCorners(small);
  const Cost tebibyte = DrawCorners(large);
  ASSERT_EQ(gibibyte.Picture.size(), tebibyte.Picture.size());
  const ImageDifference difference = CompareImages(gibibyte.Picture, tebibyte.Picture);
  std::printf("  1 TiB against 1 GiB: operations %.2f, passes %.2f, bricks %.2f, bytes read %.2f, "
              "addressing %.2f; pictures differ by %.2g/255 at most, %.2g/255 on average\n",
    tebibyte.Operations / gibibyte.Operations, tebibyte.Passes / gibibyte.Passes,
    tebibyte.Bricks / gibibyte.Bricks, tebibyte.BytesRead / gibibyte.BytesRead,
    tebibyte.Addressing / gibibyte.Addressing, 255 * difference.Max, 255 * difference.Mean);
  // Each within the tolerance of one truth; rays that graze a block beyond it (they are
  // ill-conditioned).
  EXPECT_LE(difference.Max, 4.0 / 255);
  EXPECT_LE(difference.Mean, 0.01 / 255);
  EXPECT_LE(tebibyte.Addressing, 1.2 * gibibyte.Addressing);
  EXPECT_LE(tebibyte.GPU, 1.2 * gibibyte.GPU);
  EXPECT_LE(tebibyte.Bricks, 1.2 * gibibyte.Bricks);
  // How often bricks have come before a pass hangs on the loader's timing.
  EXPECT_LE(tebibyte.Passes, 1.2 * gibibyte.Passes + 4);
  EXPECT_LE(tebibyte.Operations, 1.2 * gibibyte.Operations);
}

TEST(Picking, ReadsNoMoreThanThePresentedLevel)
{
  ImageOptions options;
  options.Dimensions = { 192, 192, 192 };
  const std::string file = FreshFileName("pick.h5");
  vtkNew<vtkHDF5PyramidWriter> writer;
  writer->SetInputData(MakeImage(options));
  writer->SetFileName(file.c_str());
  writer->SetBrickSize(32);
  writer->SetCompressionToNone();
  ASSERT_EQ(writer->Write(), 1);

  constexpr int size = 64;
  const TransferNodes nodes = MakeTransfer(OpacityShape::Ramp);
  const auto open = [&](vtkHDF5PyramidReader* reader) -> BrickSource&
  {
    reader->SetFileName(file.c_str());
    reader->SetBrickSize(32);
    return *reader->GetBrickSource()->GetBrickSource();
  };

  // What the level alone costs, and the picture alone.
  vtkNew<vtkHDF5PyramidReader> leveller;
  const BrickSource& level = open(leveller);
  leveller->Update();
  const std::uint64_t levelBytes = level.BytesRead();
  const int* dims = leveller->GetOutput()->GetDimensions();
  ASSERT_EQ(dims[0], 96);
  EXPECT_GE(levelBytes, 96u * 96 * 96);
  EXPECT_LE(levelBytes, 96u * 96 * 96 * 5 / 4);
  vtkNew<vtkHDF5PyramidReader> painter;
  const BrickSource& painted = open(painter);
  std::uint64_t pictureBytes = 0;
  {
    Stage stage(size, size);
    stage.Mapper->SetBrickSource(painter->GetBrickSource());
    stage.SetTransfer(nodes);
    stage.Renderer->ResetCamera();
    stage.Draw();
    pictureBytes = painted.BytesRead();
    EXPECT_GT(pictureBytes, 0u);
  }

  vtkNew<vtkHDF5PyramidReader> reader;
  const BrickSource& source = open(reader);
  Stage stage(size, size);
  stage.Mapper->SetInputConnection(reader->GetOutputPort());
  stage.SetTransfer(nodes);
  stage.Renderer->ResetCamera();
  EXPECT_LE(source.BytesRead(), levelBytes);
  stage.Draw();
  EXPECT_TRUE(stage.Mapper->IsConverged());
  const std::uint64_t afterRender = source.BytesRead();
  vtkNew<vtkVolumePicker> picker;
  picker->SetVolumeOpacityIsovalue(0.05);
  ASSERT_EQ(picker->Pick(size * 0.4, size * 0.45, 0, stage.Renderer), 1);
  EXPECT_EQ(picker->GetVolume(), stage.Volume);
  std::printf(
    "  level %llu, picture %llu; after rendering %llu, after picking %llu of %llu bytes\n",
    static_cast<unsigned long long>(levelBytes), static_cast<unsigned long long>(pictureBytes),
    static_cast<unsigned long long>(afterRender),
    static_cast<unsigned long long>(source.BytesRead()),
    static_cast<unsigned long long>(std::filesystem::file_size(file)));
  EXPECT_LE(source.BytesRead(), levelBytes + pictureBytes);
  EXPECT_LT(source.BytesRead(), std::uint64_t{ 192 } * 192 * 192 / 2) << "level 0 was read";

  // Picking again, elsewhere, reads nothing.
  const std::uint64_t before = source.BytesRead();
  double position[3];
  picker->GetPickPosition(position);
  ASSERT_EQ(picker->Pick(size * 0.55, size * 0.5, 0, stage.Renderer), 1);
  EXPECT_EQ(source.BytesRead(), before);

  // Where the ray first meets that opacity, by the formula of the image itself.
  double eye[3];
  stage.Renderer->GetActiveCamera()->GetPosition(eye);
  double direction[3];
  vtkMath::Subtract(position, eye, direction);
  const double distance = vtkMath::Normalize(direction);
  double met = -1;
  double reference[3];
  stage.Renderer->SetDisplayPoint(size * 0.4, size * 0.45, 0.5);
  stage.Renderer->DisplayToWorld();
  const double* world = stage.Renderer->GetWorldPoint();
  for (std::size_t a = 0; a < 3; ++a)
  {
    reference[a] = world[a] / world[3] - eye[a];
  }
  vtkMath::Normalize(reference);
  EXPECT_GT(vtkMath::Dot(reference, direction), 1 - 1e-8) << "the pick lies off its ray";
  for (double t = 0; t < 2 * distance && met < 0; t += 0.1)
  {
    std::array<double, 3> p{};
    bool inside = true;
    for (std::size_t a = 0; a < 3; ++a)
    {
      p[a] = (eye[a] + t * direction[a] + 0.5) / 192;
      inside = inside && p[a] > 0 && p[a] < 1;
    }
    const double value = 255 * BlobField(p[0], p[1], p[2]);
    if (inside && stage.Opacity->GetValue(value) >= 0.05)
    {
      met = t;
    }
  }
  ASSERT_GT(met, 0);
  std::printf("  picked at %.2f, the surface is at %.2f voxels from the eye\n", distance, met);
  EXPECT_NEAR(distance, met, 2.0) << "more than one voxel of the presented level apart";
}
