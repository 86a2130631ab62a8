// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Debug views: what they show is what is counted elsewhere, or known in closed form. The level of
// the first contribution: TestRenderTruth.cxx.
#include "BrickFrames.h"
#include "BricksMet.h"
#include "RecordingSource.h"
#include "Scene.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <gtest/gtest.h>
#include <memory>
#include <string>
#include <vector>
#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkCubeSource.h>
#include <vtkImageData.h>
#include <vtkMatrix4x4.h>
#include <vtkPolyDataMapper.h>
#include <vtkRenderer.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr int BrickEdge = 16;
using Picture = std::vector<float>;

std::shared_ptr<BrickSource> SourceOf(const std::array<int, 3>& dimensions, const UnitField& field)
{
  ImageOptions options;
  options.Dimensions = dimensions;
  return SourceOfImage(MakeImage(options, field), BrickEdge, false);
}

// How many samples a gray of SAMPLES_PER_PIXEL stands for, by the formula of the documentation.
double SamplesOf(float gray)
{
  const double octaves = 16.0 * static_cast<double>(gray);
  const double whole = std::floor(octaves);
  return std::exp2(whole) * (1 + octaves - whole) - 1;
}

std::vector<double> SamplesOf(const Picture& picture)
{
  std::vector<double> samples;
  for (std::size_t i = 0; i < picture.size(); i += 4)
  {
    samples.push_back(SamplesOf(picture[i]));
    // Whole numbers, in all channels; where none was taken nothing is drawn.
    EXPECT_NEAR(samples.back(), std::round(samples.back()), 1e-6);
    EXPECT_EQ(picture[i], picture[i + 1]);
    EXPECT_EQ(picture[i], picture[i + 2]);
    EXPECT_EQ(picture[i + 3], picture[i] > 0 ? 1.0f : 0.0f);
  }
  return samples;
}

double Sum(const std::vector<double>& values)
{
  double sum = 0;
  for (const double value : values)
  {
    sum += value;
  }
  return sum;
}

} // namespace

TEST(DebugViews, SamplesOfPixelsAddUpToThoseOfThePicture)
{
  const auto source = SourceOf({ 96, 80, 72 }, BlobField);
  for (const bool nearest : { false, true })
  {
    Stage stage(40, 36);
    stage.SetSource(source);
    stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    stage.SetShade(nearest);
    stage.Property->SetInterpolationType(
      nearest ? VTK_NEAREST_INTERPOLATION : VTK_LINEAR_INTERPOLATION);
    stage.Look({ 0.4, 1, -0.3 }, 1.2);
    stage.Mapper->PictureReuseOff();
    stage.Mapper->SetAutoAdjustSampleDistances(0); // a ray for each pixel, as the debug view has it
    const Picture plain = stage.Draw();
    const vtkTypeUInt64 memory = stage.Mapper->GetGPUMemoryUsed();
    stage.Mapper->CountSamplesOn();
    stage.Draw();
    const auto counted = static_cast<double>(stage.Mapper->GetNumberOfSamples());
    stage.Mapper->CountSamplesOff();

    stage.Mapper->SetDebugViewToSamplesPerPixel();
    const Picture shown = stage.Draw();
    EXPECT_TRUE(stage.Mapper->IsConverged());
    const std::vector<double> samples = SamplesOf(shown);
    std::printf("  %s: %.0f samples, at most %.0f of a pixel\n", nearest ? "nearest" : "linear",
      Sum(samples), *std::max_element(samples.begin(), samples.end()));
    EXPECT_GT(counted, 1000);
    EXPECT_EQ(static_cast<double>(stage.Mapper->GetNumberOfSamples()), counted);
    EXPECT_NEAR(Sum(samples), counted, 1e-3);

    // The same in passes that end at missing bricks, of an atlas of eight slots.
    Stage tiny(40, 36);
    tiny.SetSource(source);
    tiny.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    tiny.SetShade(nearest);
    tiny.Property->SetInterpolationType(stage.Property->GetInterpolationType());
    tiny.Look({ 0.4, 1, -0.3 }, 1.2);
    tiny.Mapper->SetMaximumNumberOfSlots(8);
    tiny.Mapper->SetDebugViewToSamplesPerPixel();
    EXPECT_TRUE(AreImagesIdentical(tiny.Draw(), shown));
    EXPECT_GT(tiny.Mapper->GetNumberOfPasses(), 2u);

    // Afterwards nothing is left of it.
    stage.Mapper->SetDebugViewToNone();
    EXPECT_TRUE(AreImagesIdentical(stage.Draw(), plain));
    EXPECT_EQ(stage.Mapper->GetGPUMemoryUsed(), memory);
  }
}

// A brick of one value is one segment: a pixel's samples are the bricks that its ray crosses, one
// more than the faces between.
TEST(DebugViews, SamplesOfAConstantVolumeAreBricksCrossed)
{
  const std::array<int, 3> dimensions{ 96, 80, 64 };
  Stage stage(48, 40);
  stage.SetSource(SourceOf(dimensions, [](double, double, double) { return 0.5; }));
  stage.SetTransfer(MakeTransfer(OpacityShape::Fog));
  stage.Mapper->SetMaximumLevel(0);
  stage.Mapper->SetDebugViewToSamplesPerPixel();
  const std::array<double, 3> eye{ -61.3, -140.7, 150.9 };
  stage.LookFrom(eye, { 47, 40, 32 }, 1, 1000, 40);
  const std::vector<double> samples = SamplesOf(stage.Draw());
  vtkNew<vtkMatrix4x4> worldFromClip;
  worldFromClip->DeepCopy(stage.Renderer->GetActiveCamera()->GetCompositeProjectionTransformMatrix(
    stage.Renderer->GetTiledAspectRatio(), -1, 1));
  worldFromClip->Invert();
  int compared = 0;
  double most = 0;
  for (std::size_t i = 0; i < samples.size(); ++i)
  {
    const auto width = static_cast<std::size_t>(stage.Width());
    double far[4] = { 2 * (static_cast<double>(i % width) + 0.5) / stage.Width() - 1,
      2 * (static_cast<double>(i / width) + 0.5) / stage.Height() - 1, 0.5, 1 };
    worldFromClip->MultiplyPoint(far, far);
    // The part of the ray in the box of voxel centres, in multiples of eye to `far`.
    double begin = 0;
    double end = 1e30;
    std::array<double, 3> step{};
    for (std::size_t a = 0; a < 3; ++a)
    {
      step[a] = far[a] / far[3] - eye[a];
      const double low = -eye[a] / step[a];
      const double high = (dimensions[a] - 1 - eye[a]) / step[a];
      begin = std::max(begin, std::min(low, high));
      end = std::min(end, std::max(low, high));
    }
    double bricks = begin < end ? 1 : 0;
    double gap = std::abs(end - begin);
    std::vector<double> faces;
    for (std::size_t a = 0; a < 3 && begin < end; ++a)
    {
      for (double face = BrickEdge - 0.5; face < dimensions[a] - 1; face += BrickEdge)
      {
        const double t = (face - eye[a]) / step[a];
        gap = std::min({ gap, std::abs(t - begin), std::abs(t - end) });
        faces.push_back(t);
        bricks += begin < t && t < end ? 1 : 0;
      }
    }
    std::sort(faces.begin(), faces.end());
    for (std::size_t f = 1; f < faces.size(); ++f)
    {
      gap = std::min(gap, faces[f] - faces[f - 1]);
    }
    // Through an edge, to a thousandth of a voxel: either neighbour may be left out.
    const double scale = std::hypot(step[0], step[1], step[2]);
    if (gap * scale < 1e-3)
    {
      continue;
    }
    ++compared;
    most = std::max(most, bricks);
    EXPECT_EQ(std::round(samples[i]), bricks) << "pixel " << i;
  }
  std::printf("  %d of %zu pixels compared, up to %.0f bricks\n", compared, samples.size(), most);
  EXPECT_GT(compared, 0.9 * static_cast<double>(samples.size()));
  EXPECT_GT(most, 9);
}

namespace
{

struct Segment
{
  std::array<double, 2> From{};
  std::array<double, 2> To{};
  int Level = 0;
};

double Distance(const Segment& s, double x, double y)
{
  const double dx = s.To[0] - s.From[0];
  const double dy = s.To[1] - s.From[1];
  const double length = dx * dx + dy * dy;
  const double t =
    length > 0 ? std::clamp(((x - s.From[0]) * dx + (y - s.From[1]) * dy) / length, 0.0, 1.0) : 0.0;
  return std::hypot(x - s.From[0] - t * dx, y - s.From[1] - t * dy);
}

// The edges of bricks in pixels, by VTK's own projection. Of an image with origin 0 and spacing 1.
std::vector<Segment> EdgesOf(Stage& stage, const PyramidLayout& layout, const BrickSet& bricks)
{
  std::vector<Segment> edges;
  for (const BrickKey& key : bricks)
  {
    const std::array<std::uint32_t, 3> index{ key.X, key.Y, key.Z };
    const auto corner = [&](unsigned which)
    {
      std::array<double, 3> p{};
      for (std::size_t a = 0; a < 3; ++a)
      {
        const double edge = static_cast<double>(layout.Factor(key.Level)[a] * BrickEdge);
        p[a] = std::clamp((index[a] + (which >> a & 1U)) * edge - 0.5, 0.0,
          static_cast<double>(layout.Dimensions(0)[a] - 1));
      }
      stage.Renderer->SetWorldPoint(p[0], p[1], p[2], 1);
      stage.Renderer->WorldToDisplay();
      const double* d = stage.Renderer->GetDisplayPoint();
      return std::array<double, 2>{ d[0], d[1] };
    };
    for (unsigned c = 0; c < 8; ++c)
    {
      for (unsigned a = 0; a < 3; ++a)
      {
        if ((c >> a & 1U) == 0)
        {
          edges.push_back({ corner(c), corner(c | 1U << a), key.Level });
        }
      }
    }
  }
  return edges;
}

// Frames lie on projected edges of bricks of `may`, in the colour of their level, and nowhere else;
// all edges of `must` are there. `plain`: the picture without them. Returns how many pixels they
// are.
int ExpectFrames(Stage& stage, const Picture& plain, const Picture& framed,
  const PyramidLayout& layout, const BrickSet& must, const BrickSet& may)
{
  const int width = stage.Width();
  const int height = stage.Height();
  const auto isFrame = [&](int x, int y)
  {
    const std::size_t i = 4 *
      (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
    return std::memcmp(&plain[i], &framed[i], 3 * sizeof(float)) != 0;
  };
  constexpr double reach = 0.8; // half a pixel along both axes, and the driver's subpixels
  const std::vector<Segment> allowed = EdgesOf(stage, layout, may);
  int frames = 0;
  int astray = 0;
  for (int y = 0; y < height; ++y)
  {
    for (int x = 0; x < width; ++x)
    {
      if (!isFrame(x, y))
      {
        continue;
      }
      ++frames;
      const float* color = &framed[4 *
        (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
          static_cast<std::size_t>(x))];
      astray += std::none_of(allowed.begin(), allowed.end(),
                  [&](const Segment& s)
                  {
                    const std::array<float, 3> of = FrameColor(s.Level);
                    return Distance(s, x + 0.5, y + 0.5) <= reach &&
                      std::abs(color[0] - of[0]) < 0.01f && std::abs(color[1] - of[1]) < 0.01f &&
                      std::abs(color[2] - of[2]) < 0.01f;
                  })
        ? 1
        : 0;
    }
  }
  EXPECT_EQ(astray, 0) << "pixels of frames aren't on an edge, or not of its level's colour";
  int missing = 0;
  for (const Segment& s : EdgesOf(stage, layout, must))
  {
    const double length = std::hypot(s.To[0] - s.From[0], s.To[1] - s.From[1]);
    for (double at = 1; at < length - 1; ++at)
    {
      const double x = s.From[0] + (s.To[0] - s.From[0]) * at / length;
      const double y = s.From[1] + (s.To[1] - s.From[1]) * at / length;
      const int column = static_cast<int>(std::floor(x));
      const int row = static_cast<int>(std::floor(y));
      if (column < 1 || row < 1 || column >= width - 1 || row >= height - 1)
      {
        continue;
      }
      bool found = false;
      for (int i = 0; i < 9; ++i)
      {
        const int px = column + i % 3 - 1;
        const int py = row + i / 3 - 1;
        found = found || (isFrame(px, py) && std::hypot(px + 0.5 - x, py + 0.5 - y) <= reach);
      }
      missing += found ? 0 : 1;
    }
  }
  EXPECT_EQ(missing, 0) << "places on edges have no frame";
  return frames;
}

BrickSet BricksOf(const PyramidLayout& layout, int level)
{
  BrickSet bricks;
  const Int3& n = layout.Bricks(level);
  for (std::int64_t i = 0; i < n[0] * n[1] * n[2]; ++i)
  {
    bricks.insert(BrickKey::Of(level, { i % n[0], i / n[0] % n[1], i / n[0] / n[1] }));
  }
  return bricks;
}

} // namespace

TEST(DebugViews, FramesLieOnProjectedEdgesOfTheBricksNeeded)
{
  const auto thin = [](double x, double y, double z) { return 0.2 + 0.1 * NoiseField(x, y, z); };
  const auto source = SourceOf({ 60, 44, 50 }, thin);
  const PyramidLayout& layout = source->Info().Layout;
  Stage stage(160, 128);
  stage.SetSource(source);
  TransferNodes nodes = MakeTransfer(OpacityShape::Fog);
  nodes.Opacity = { { 0, 0.004 }, { 255, 0.004 } }; // all is seen through
  nodes.Color = { { 0, 0.1, 0.2, 0.3 }, { 255, 0.1, 0.2, 0.3 } };
  stage.SetTransfer(nodes);
  for (const int level : { 0, 1 })
  {
    for (const bool parallel : { false, true })
    {
      stage.Mapper->SetMinimumLevel(level);
      stage.Mapper->SetMaximumLevel(level);
      stage.Look({ 0.4, 1, -0.3 }, parallel ? 0.8 : 1.1, parallel);
      stage.Mapper->SetDebugViewToNone();
      const Picture plain = stage.DrawPicture();
      const Picture before = stage.Accumulator();
      const vtkTypeUInt64 memory = stage.Mapper->GetGPUMemoryUsed();
      stage.Mapper->SetDebugViewToBrickFrames();
      const Picture framed = stage.DrawPicture();
      const BrickSet all = BricksOf(layout, level);
      const int frames = ExpectFrames(stage, plain, framed, layout, all, all);
      std::printf("  level %d, %s: %zu bricks, %d pixels of frames\n", level,
        parallel ? "parallel" : "perspective", all.size(), frames);
      EXPECT_GT(frames, 300);
      // Over the picture: the accumulators are the same. Once more from the picture that is there.
      EXPECT_TRUE(AreImagesIdentical(stage.Accumulator(), before));
      EXPECT_EQ(stage.DrawPicture(), framed);
      EXPECT_EQ(stage.Mapper->GetNumberOfPasses(), 0u);
      EXPECT_EQ(stage.Mapper->GetGPUMemoryUsed(), memory);
      stage.Mapper->SetDebugViewToNone();
      EXPECT_EQ(stage.DrawPicture(), plain);
    }
  }
}

// Bricks that nothing is seen of have no frame.
TEST(DebugViews, HiddenAndEmptyBricksHaveNoFrame)
{
  const auto source = SourceOf({ 96, 80, 112 }, BlobField);
  Stage stage(160, 160);
  stage.SetSource(source);
  TransferNodes nodes = MakeTransfer(OpacityShape::Wall);
  nodes.Color = { { 0, 0.1, 0.2, 0.3 }, { 255, 0.3, 0.2, 0.1 } };
  stage.SetTransfer(nodes);
  stage.Mapper->SetMaximumLevel(0);
  stage.Look({ 0.4, 1, -0.3 }, 0.9);
  const Picture plain = stage.DrawPicture();
  stage.Mapper->SetDebugViewToBrickFrames();
  const Picture framed = stage.DrawPicture();
  const Met met = BrickWalk(stage, source).Walk();
  const PyramidLayout& layout = source->Info().Layout;
  std::printf("  %zu bricks touched, %zu visible, of %lld\n", met.Touched.size(),
    met.Visible.size(), static_cast<long long>(layout.TotalBricks()));
  EXPECT_LT(
    static_cast<double>(met.Visible.size()), 0.8 * static_cast<double>(BricksOf(layout, 0).size()));
  EXPECT_GT(ExpectFrames(stage, plain, framed, layout, met.Touched, met.Visible), 300);
}

TEST(DebugViews, OpaqueGeometryHidesFrames)
{
  const auto source = SourceOf(
    { 48, 48, 48 }, [](double x, double y, double z) { return 0.2 + 0.1 * NoiseField(x, y, z); });
  Stage stage(120, 120);
  stage.SetSource(source);
  stage.SetTransfer(MakeTransfer(OpacityShape::Fog));
  stage.Look({ 0, 1, 0 }, 1.1);
  // In front of all of it, and smaller than the picture.
  vtkNew<vtkCubeSource> cube;
  cube->SetBounds(10, 36, -30, -20, 10, 36);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputConnection(cube->GetOutputPort());
  vtkNew<vtkActor> actor;
  actor->SetMapper(mapper);
  stage.Renderer->AddActor(actor);
  stage.Renderer->GetActiveCamera()->SetClippingRange(1, 500);
  const Picture plain = stage.DrawPicture();
  stage.Mapper->SetDebugViewToBrickFrames();
  const Picture framed = stage.DrawPicture();
  int inside = 0;
  int outside = 0;
  for (std::size_t i = 0; i < plain.size(); i += 4)
  {
    const bool differs = std::memcmp(&plain[i], &framed[i], 3 * sizeof(float)) != 0;
    const auto x = static_cast<double>(i / 4 % 120) - 59.5;
    const auto y = static_cast<double>(i / 4 / 120) - 59.5;
    const bool middle = std::max(std::abs(x), std::abs(y)) < 20;
    (middle ? inside : outside) += differs ? 1 : 0;
  }
  std::printf("  %d pixels of frames beside the cube, %d on it\n", outside, inside);
  EXPECT_EQ(inside, 0);
  EXPECT_GT(outside, 100);
}
