// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// How much of what is done for the sparse scenes of `teravox bench error` is for nothing: samples
// that don't contribute, gradients that nobody sees, bytes of bricks that don't touch the picture.
#include "BenchScenes.h"
#include "BenchVolumes.h"
#include "BricksMet.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <gtest/gtest.h>
#include <ostream>
#include <string>
#include <vtkImageData.h>
#include <vtkRenderer.h>
#include <vtkVolume.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

struct SparseScene
{
  const char* Name; ///< of the suite
  int Size;         ///< voxels along each axis of a formula; of scans each second voxel is taken
  /// What is reached of the 1.2 that are asked for: bytes read by those of bricks that touch the
  /// picture. Of a brick that isn't there only its range is known, two voxels around it included:
  /// whether a ray meets what is visible of it is found out by reading it.
  double Bytes;
};

void PrintTo(const SparseScene& scene, std::ostream* out)
{
  *out << scene.Name;
}

constexpr SparseScene Scenes[] = { { "shells-256", 128, 1.48 }, { "sponge-256", 128, 1.2 },
  { "sheet-256", 128, 1.42 }, { "brain-surface", 0, 1.58 }, { "head-bone", 0, 1.3 } };

// Of the samples evaluated, those that contribute. Those of the native marcher come eight at a
// time: lanes behind the end of a ray count where pieces are cut, and so do the seven of a span
// that was tried in vain.
constexpr double NativeShare = 0.8;
constexpr double ShaderShare = 0.99;

constexpr int BrickEdge = 16;

// Each second voxel along each axis.
program::BenchVolume Halved(const program::BenchVolume& volume)
{
  const std::size_t bytes = SizeOf(volume.Type);
  program::BenchVolume half;
  half.Type = volume.Type;
  for (std::size_t a = 0; a < 3; ++a)
  {
    half.Dimensions[a] = volume.Dimensions[a] / 2;
    half.Spacing[a] = volume.Spacing[a] * 2;
  }
  const Int3& n = half.Dimensions;
  half.Voxels.reserve(static_cast<std::size_t>(n[0] * n[1] * n[2]) * bytes);
  for (std::int64_t i = 0; i < n[0] * n[1] * n[2]; ++i)
  {
    const std::int64_t from = 2 *
      (i % n[0] +
        volume.Dimensions[0] * (i / n[0] % n[1] + volume.Dimensions[1] * (i / n[0] / n[1])));
    const auto voxel = volume.Voxels.begin() + from * static_cast<std::int64_t>(bytes);
    half.Voxels.insert(half.Voxels.end(), voxel, voxel + static_cast<std::int64_t>(bytes));
  }
  return half;
}

double Ratio(std::uint64_t a, std::uint64_t b)
{
  return static_cast<double>(a) / static_cast<double>(b);
}

} // namespace

class Sparse : public testing::TestWithParam<SparseScene>
{
};

TEST_P(Sparse, LittleIsDoneForNothing)
{
  const auto scenes = program::FindBenchScenes({ GetParam().Name });
  ASSERT_TRUE(scenes.Ok()) << scenes.GetStatus().Message();
  const program::BenchScene& scene = scenes.Value().front();
  const auto made = program::MakeBenchVolume(scene.Field, GetParam().Size);
  if (!made.Ok())
  {
    GTEST_SKIP() << made.GetStatus().Message();
  }
  const program::BenchVolume volume = scene.Size == 0 ? Halved(made.Value()) : made.Value();
  const auto source = SourceOfImage(program::ToImage(volume, false), BrickEdge, false);
  const auto recorded = std::make_shared<RecordingSource>(source);
  Stage stage(96, 96);
  stage.SetSource(recorded);
  program::SetUp(scene, volume, stage.Property);
  ASSERT_TRUE(program::SetUp(scene, volume, 1, stage.Renderer->GetActiveCamera()).Ok());
  stage.Mapper->SetMaximumLevel(0);
  stage.Mapper->CountSamplesOn();
  stage.Mapper->PictureReuseOff();
  stage.Draw();
  ASSERT_TRUE(stage.Mapper->IsConverged());
  const std::uint64_t bytes = recorded->BytesRead();
  const BrickSet read = recorded->Read();
  const std::vector<float> picture = stage.Draw();
  const std::uint64_t samples = stage.Mapper->GetNumberOfSamples();
  const std::uint64_t evaluated = stage.Mapper->GetNumberOfEvaluatedSamples();
  const std::uint64_t contributing = stage.Mapper->GetNumberOfContributingSamples();
  EXPECT_EQ(stage.Mapper->GetNumberOfGradients(), 0u) << "nobody asked for light";
  EXPECT_EQ(recorded->BytesRead(), bytes);

  stage.SetShade(true);
  stage.Draw();
  const std::uint64_t gradients = stage.Mapper->GetNumberOfGradients();
  const std::uint64_t lit = stage.Mapper->GetNumberOfContributingSamples();
  const double litRatio = Ratio(lit, stage.Mapper->GetNumberOfEvaluatedSamples());
  EXPECT_EQ(recorded->BytesRead(), bytes);
  stage.SetShade(false);

  const Met met = BrickWalk(stage, source).Walk();
  const std::uint64_t brickBytes = bytes / recorded->Reads();
  const double byteRatio = Ratio(bytes, brickBytes * met.Touched.size());

  // Without skipping: the same bits, for many times the work.
  stage.Mapper->EmptySpaceSkippingOff();
  const std::vector<float> whole = stage.Draw();
  stage.Draw();
  const std::uint64_t allSamples = stage.Mapper->GetNumberOfSamples();
  std::printf(
    "  %-14s looked at %llu (of %llu without skipping), evaluated %llu, contributed %llu: "
    "%.3f of those evaluated (lit %.3f), %.3f of all; %llu gradients for %llu; "
    "%zu bricks read, %zu touch the picture: %.3f\n",
    scene.Name.c_str(), static_cast<unsigned long long>(samples),
    static_cast<unsigned long long>(allSamples), static_cast<unsigned long long>(evaluated),
    static_cast<unsigned long long>(contributing), Ratio(contributing, evaluated), litRatio,
    Ratio(contributing, samples), static_cast<unsigned long long>(gradients),
    static_cast<unsigned long long>(lit), read.size(), met.Touched.size(), byteRatio);
  EXPECT_TRUE(AreImagesIdentical(picture, whole));
  const bool native = TestedMarcher() == vtkOutOfCoreVolumeMapper::MARCHER_NATIVE;
  const double share = native ? NativeShare : ShaderShare;
  EXPECT_GE(Ratio(contributing, evaluated), share);
  EXPECT_GE(litRatio, share);
  EXPECT_LE(Ratio(gradients, lit), 1 / share);
  // Of the cells whose corners are fetched to see whether anything is visible between them, most
  // see nothing: no finer ranges are known, and those of the corners say little of one line.
  EXPECT_GE(Ratio(contributing, samples), 0.1);
  EXPECT_LT(samples, allSamples);
  EXPECT_LE(byteRatio, GetParam().Bytes);
  ExpectWithin(met.Touched, read, scene.Name + ": touches the picture but wasn't read");
  ExpectWithin(read, met.Visible, scene.Name + ": read but met by no ray");
}

INSTANTIATE_TEST_SUITE_P(Skipping, Sparse, testing::ValuesIn(Scenes),
  [](const auto& test)
  {
    std::string name = test.param.Name;
    name.erase(std::remove(name.begin(), name.end(), '-'), name.end());
    return name;
  });
