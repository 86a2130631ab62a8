// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// The pictures of README.md and of the demo against the reference integrator, at their own views:
// what the mapper draws, and the committed files. Volumes, transfer functions and cameras are those
// of the program; the truth reads voxels from bricks, and shares nothing else with the marchers.
#include "Commands.h"
#include "Scene.h"
#include "VTKTestSupport.h"
#include "View.h"
#include "VolumeInput.h"
#include "vtkBrickSource.h"
#include "vtkHDF5PyramidWriter.h"
#include "vtkOutOfCoreTransferFunction.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <gtest/gtest.h>
#include <string>
#include <vector>
#include <vtkImageData.h>
#include <vtkNIFTIImageReader.h>
#include <vtkNew.h>
#include <vtkPNGReader.h>
#include <vtkRenderer.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr const char* BrainFile = "/usr/share/mricron/templates/ch2better.nii.gz";
constexpr std::array<int, 2> Size{ 400, 300 };

/// The truth is integrated for every n-th pixel of each row and column.
constexpr int Every = 12;

/// RGB in 0...1 with the alpha 0, rows from the bottom; empty if the file can't be read.
std::vector<float> ReadBaseline(const std::string& name)
{
  const std::string fileName = std::string(TERAVOX_BASELINES) + "/" + name + ".png";
  vtkNew<vtkPNGReader> reader;
  if (!std::filesystem::exists(fileName) || reader->CanReadFile(fileName.c_str()) == 0)
  {
    return {};
  }
  reader->SetFileName(fileName.c_str());
  reader->Update();
  vtkImageData* image = reader->GetOutput();
  if (image->GetDimensions()[0] != Size[0] || image->GetDimensions()[1] != Size[1])
  {
    return {};
  }
  const auto* bytes = static_cast<const unsigned char*>(image->GetScalarPointer());
  const auto components = static_cast<std::size_t>(image->GetNumberOfScalarComponents());
  std::vector<float> picture(4 * static_cast<std::size_t>(image->GetNumberOfPoints()));
  for (std::size_t i = 0; i < picture.size() / 4; ++i)
  {
    for (std::size_t c = 0; c < 3; ++c)
    {
      picture[4 * i + c] = static_cast<float>(bytes[i * components + c]) / 255.0F;
    }
  }
  return picture;
}

std::vector<TruthPixel> SampledPixels()
{
  std::vector<TruthPixel> pixels;
  for (int y = Every / 2; y < Size[1]; y += Every)
  {
    for (int x = Every / 2; x < Size[0]; x += Every)
    {
      pixels.push_back({ x, y });
    }
  }
  return pixels;
}

/// The pyramid of the brain, made once. Empty if it can't be written.
std::string Brain()
{
  static const std::string file = []
  {
    std::string name = FreshFileName("demo-brain.h5");
    vtkNew<vtkNIFTIImageReader> reader;
    reader->SetFileName(BrainFile);
    vtkNew<vtkHDF5PyramidWriter> writer;
    writer->SetFileName(name.c_str());
    writer->SetInputConnection(reader->GetOutputPort());
    return writer->Write() != 0 ? name : std::string();
  }();
  return file;
}

/// The worst of the three colours of each pixel, in ascending order.
std::vector<double> ByPixel(
  const std::vector<float>& picture, const std::vector<float>& low, const std::vector<float>& high)
{
  std::vector<double> excess;
  for (std::size_t i = 0; i < picture.size(); i += 4)
  {
    double worst = 0;
    for (std::size_t c = i; c < i + 3; ++c)
    {
      worst = std::max({ worst, static_cast<double>(low[c]) - static_cast<double>(picture[c]),
        static_cast<double>(picture[c]) - static_cast<double>(high[c]) });
    }
    excess.push_back(worst);
  }
  std::sort(excess.begin(), excess.end());
  return excess;
}

std::string ColorsAt(
  const std::vector<float>& picture, const TruthBounds& bounds, std::size_t i, TruthPixel pixel)
{
  std::string text = "pixel " + std::to_string(pixel.X) + ", " + std::to_string(pixel.Y) + ":";
  for (std::size_t c = 4 * i; c < 4 * i + 4; ++c)
  {
    text += " " + std::to_string(picture[c]) + " (" + std::to_string(bounds.Low[c]) + " ... " +
      std::to_string(bounds.High[c]) + ")";
  }
  return text;
}

void ExpectTruthOf(
  const std::string& name, const program::VolumeOptions& volume, const program::CameraOptions& view)
{
  const std::vector<float> baseline = ReadBaseline(name);
  ASSERT_FALSE(baseline.empty()) << "There is no usable baseline " << name;
  auto opened = program::OpenVolume(volume);
  ASSERT_TRUE(opened.Ok()) << opened.GetStatus().Message();
  vtkBrickSourceAlgorithm* algorithm = opened.Value().Last;
  ASSERT_TRUE(algorithm->GetBrickSource());
  BrickSource& source = *algorithm->GetBrickSource()->GetBrickSource();

  Stage stage(Size[0], Size[1]);
  vtkOutOfCoreTransferFunction::MakeAutomatic(algorithm->GetBrickSource(), stage.Property);
  stage.Mapper->SetInputConnection(algorithm->GetOutputPort());
  const Double3& spacing = source.Info().Spacing;
  const Status placed =
    program::PlaceCamera(stage.Renderer->GetActiveCamera(), view, stage.Volume->GetBounds(),
      static_cast<double>(Size[0]) / Size[1], *std::min_element(spacing.begin(), spacing.end()));
  ASSERT_TRUE(placed.Ok()) << placed.Message();
  const std::vector<float> drawn = stage.Draw();
  ASSERT_EQ(drawn.size(), baseline.size());
  EXPECT_TRUE(stage.Mapper->IsConverged());

  const std::vector<TruthPixel> pixels = SampledPixels();
  const std::vector<float> accumulators = TakePixels(drawn, Size[0], pixels);
  std::vector<float> file = TakePixels(baseline, Size[0], pixels);
  for (std::size_t i = 3; i < file.size(); i += 4)
  {
    file[i] = accumulators[i]; // a picture over a black background has no opacity of its own
  }
  const double tolerance = stage.Mapper->GetImageErrorTolerance();
  const StageTruth truth(stage, source, 1, VoxelAccess::ByBrick);
  const TruthBounds bounds = truth.Bounds(pixels, { accumulators, file }, 0.5 * tolerance);

  const ImageDifference excess = ExcessOverEnvelope(accumulators, bounds.Low, bounds.High);
  const ImageDifference plain = CompareImages(accumulators, bounds.Center);
  const ImageDifference ofFile = ExcessOverEnvelope(file, bounds.Low, bounds.High);
  const std::vector<double> fileByPixel = ByPixel(file, bounds.Low, bounds.High);
  const double file99 = fileByPixel[(fileByPixel.size() * 99 + 99) / 100 - 1];
  std::size_t visible = 0;
  for (std::size_t i = 3; i < bounds.Center.size(); i += 4)
  {
    visible += bounds.Center[i] > 0.01F ? 1 : 0;
  }
  std::printf("  %s: %zu rays, %zu of them visible; in 1/255\n"
              "    accumulators: max %.3f, p99 %.3f, mean %.4f beyond the envelope; from the "
              "centre: max %.3f\n"
              "    committed file: max %.3f, p99 of pixels %.3f, mean %.4f beyond the envelope\n",
    name.c_str(), pixels.size(), visible, 255 * excess.Max, 255 * excess.Percentile99,
    255 * excess.Mean, 255 * plain.Max, 255 * ofFile.Max, 255 * file99, 255 * ofFile.Mean);
  EXPECT_GT(visible, pixels.size() / 10) << "Hardly anything is seen.";
  EXPECT_LE(excess.Max, tolerance)
    << ColorsAt(accumulators, bounds, excess.WorstPixel, pixels[excess.WorstPixel]);
  EXPECT_LE(file99, tolerance + 0.5 / 255)
    << ColorsAt(file, bounds, ofFile.WorstPixel, pixels[ofFile.WorstPixel]);
}

program::VolumeOptions Brains(std::int64_t copies)
{
  program::VolumeOptions volume;
  volume.Name = Brain();
  volume.Repeat = { copies, copies, copies };
  if (copies > 1)
  {
    volume.Pitch = { 320, 384, 320 };
  }
  return volume;
}

} // namespace

TEST(TruthOfDemos, Brain)
{
  if (!std::filesystem::exists(BrainFile))
  {
    GTEST_SKIP() << "mricron-data isn't installed.";
  }
  ExpectTruthOf("DemoBrain", Brains(1), {});
}

TEST(TruthOfDemos, BrainsFromOutside)
{
  if (!std::filesystem::exists(BrainFile))
  {
    GTEST_SKIP() << "mricron-data isn't installed.";
  }
  ExpectTruthOf("DemoBrainsOutside", Brains(32), {});
}

TEST(TruthOfDemos, BrainsFromInside)
{
  if (!std::filesystem::exists(BrainFile))
  {
    GTEST_SKIP() << "mricron-data isn't installed.";
  }
  program::CameraOptions view;
  view.Given = true;
  view.Position = { 0.5, 0.4844, 0.5156 };
  view.FocalPoint = { 0.53, 0.75, 0.53 };
  view.ViewUp = { 0, 0, 1 };
  view.ViewAngle = 60;
  ExpectTruthOf("DemoBrainsInside", Brains(32), view);
}

TEST(TruthOfDemos, Sponge)
{
  program::VolumeOptions volume;
  volume.Name = "formula:sponge";
  volume.Dimensions = { 1 << 30, 1 << 30, 1 << 30 };
  ExpectTruthOf("DemoSponge", volume, {});
}
