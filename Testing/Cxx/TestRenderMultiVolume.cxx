// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// vtkMultiVolume: several volumes that fill the same places. The truth are closed forms, and many
// small steps along rays of the reference's own fields, whose extinctions add up.
#include "BesideVTK.h"
#include "MessageRecorder.h"
#include "RayOfTruth.h"
#include "vtkOutOfCoreVolumeMapper.h"
#include "vtkProceduralVolumeSource.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>
#include <memory>
#include <string>
#include <vector>
#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkCommand.h>
#include <vtkImageData.h>
#include <vtkMatrix4x4.h>
#include <vtkMultiVolume.h>
#include <vtkPlane.h>
#include <vtkPlaneSource.h>
#include <vtkPolyDataMapper.h>
#include <vtkPropPicker.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkTrivialProducer.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

double RippleField(double x, double y, double z)
{
  return 0.5 + 0.5 * std::sin(11 * x + 3 * y) * std::cos(9 * z - 4 * y);
}

ImageOptions SecondOptions()
{
  ImageOptions options;
  options.Dimensions = { 30, 42, 26 };
  options.Spacing = { 1.1, 0.8, 1.3 };
  options.Origin = { 6, 2, 5 };
  return options;
}

// One mapper, two inputs. Each volume has a stage that holds its property and matrix, and of which
// the truth is made; the first one's shows both.
class Pair
{
public:
  explicit Pair(int size)
    : First(size, size)
    , Second(size, size)
  {
    this->Set({}, BlobField, SecondOptions(), RippleField);
    this->First.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    this->Second.SetTransfer({ { { 0, 0 }, { 140, 0 }, { 190, 0.12 }, { 255, 0.3 } },
      { { 0, 0, 0.2, 1 }, { 255, 1, 0.9, 0.1 } }, 1 });
    this->Second.Volume->SetPosition(3, -2, 4);
    this->Second.Volume->RotateY(20);
    this->Both->SetVolume(this->First.Volume, 0);
    this->Both->SetVolume(this->Second.Volume, 1);
    this->Both->SetMapper(this->First.Mapper);
    this->First.Renderer->RemoveVolume(this->First.Volume);
    this->First.Renderer->AddVolume(this->Both);
    this->First.Mapper->SetBrickSize(16);
    this->First.Look({ 0.4, 1, -0.3 }, 0.8);
    this->Second.Renderer->SetActiveCamera(this->First.Renderer->GetActiveCamera());
  }
  ~Pair()
  {
    this->First.Renderer->RemoveVolume(this->Both);
    this->Both->SetMapper(nullptr);
  }
  Pair(const Pair&) = delete;
  Pair& operator=(const Pair&) = delete;
  Pair(Pair&&) = delete;
  Pair& operator=(Pair&&) = delete;

  void Set(const ImageOptions& one, const UnitField& oneField, const ImageOptions& other,
    const UnitField& otherField)
  {
    this->Images = { MakeImage(one, oneField), MakeImage(other, otherField) };
    this->First.SetImage(this->Images[0]);
    this->Second.SetImage(this->Images[1]);
    this->Connect(this->First.Mapper, this->Images);
  }
  void Connect(vtkGPUVolumeRayCastMapper* mapper,
    const std::array<vtkSmartPointer<vtkImageData>, 2>& images) const
  {
    for (int port = 0; port < 2; ++port)
    {
      vtkNew<vtkTrivialProducer> producer;
      producer->SetOutput(images[static_cast<std::size_t>(port)]);
      mapper->SetInputConnection(port, producer->GetOutputPort());
    }
  }
  std::vector<float> Draw() { return this->First.Draw(); }
  vtkOutOfCoreVolumeMapper* Mapper() const { return this->First.Mapper; }

  Stage First;
  Stage Second;
  vtkNew<vtkMultiVolume> Both;
  std::array<vtkSmartPointer<vtkImageData>, 2> Images;
};

// Emission and absorption of all scenes together, by small steps in each of which they are
// constant.
TruthColor IntegrateTogether(
  const std::vector<const TruthScene*>& scenes, int x, int y, double dx, double dy)
{
  struct Sample
  {
    double Begin;
    double End;
    double Extinction;
    Double3 Color;
  };
  std::vector<std::vector<Sample>> samples;
  std::vector<double> cuts;
  double perDepth = 1;
  for (const TruthScene* scene : scenes)
  {
    const RayOfTruth ray(*scene, x, y, dx, dy);
    perDepth = 1 / ray.Ray.DepthPerLength;
    std::vector<Sample>& own = samples.emplace_back();
    ray.Sample(48,
      [&](int level, double depth, double step)
      {
        const double value = ray.Field(level, depth);
        own.push_back({ depth - step / 2, depth + step / 2,
          scene->Transfer.Extinction(scene->Transfer.GetAlpha(value)),
          scene->Transfer.GetColor(value) });
        cuts.push_back(depth - step / 2);
        cuts.push_back(depth + step / 2);
      });
  }
  std::sort(cuts.begin(), cuts.end());
  std::vector<std::size_t> at(samples.size(), 0);
  TruthColor sum{};
  for (std::size_t i = 1; i < cuts.size(); ++i)
  {
    const double middle = 0.5 * (cuts[i - 1] + cuts[i]);
    double extinction = 0;
    Double3 light{};
    for (std::size_t v = 0; v < samples.size(); ++v)
    {
      while (at[v] < samples[v].size() && samples[v][at[v]].End <= middle)
      {
        ++at[v];
      }
      if (at[v] < samples[v].size() && samples[v][at[v]].Begin <= middle)
      {
        const Sample& s = samples[v][at[v]];
        extinction += s.Extinction;
        light = light + s.Extinction * s.Color;
      }
    }
    if (extinction > 0)
    {
      const double opacity =
        -std::expm1(-extinction * (cuts[i] - cuts[i - 1]) * perDepth) * (1 - sum[3]);
      for (std::size_t c = 0; c < 3; ++c)
      {
        sum[c] += light[c] / extinction * opacity;
      }
      sum[3] += opacity;
    }
  }
  return sum;
}

// How far a picture lies beyond the truth of nine rays per pixel: largest, and that of 99.9 %.
struct Excess
{
  double Max = 0;
  double Most = 0;
};
Excess ExcessOf(Pair& pair, const std::vector<float>& picture, int every)
{
  const auto one = SourceOfImage(pair.Images[0], 16, false);
  const auto other = SourceOfImage(pair.Images[1], 16, false);
  const StageTruth first(pair.First, *one);
  const StageTruth second(pair.Second, *other);
  const int width = pair.First.Width();
  std::vector<double> beyond;
  for (int y = 0; y < pair.First.Height(); y += every)
  {
    for (int x = 0; x < width; x += every)
    {
      beyond.push_back(ExcessOfPixel(&picture[4 * static_cast<std::size_t>(y * width + x)],
        [&](double dx, double dy) {
          return IntegrateTogether({ &first.Scene(), &second.Scene() }, x, y, dx, dy);
        }).Beyond);
    }
  }
  std::sort(beyond.begin(), beyond.end());
  return { beyond.back(), beyond[beyond.size() - 1 - beyond.size() / 1000] };
}

// A plane without an end.
vtkSmartPointer<vtkActor> Sheet(const double place[3], const double normal[3])
{
  vtkNew<vtkPlaneSource> source;
  source->SetOrigin(-300, -300, 0);
  source->SetPoint1(300, -300, 0);
  source->SetPoint2(-300, 300, 0);
  source->SetCenter(place[0], place[1], place[2]);
  source->SetNormal(normal[0], normal[1], normal[2]);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputConnection(source->GetOutputPort());
  auto actor = vtkSmartPointer<vtkActor>::New();
  actor->SetMapper(mapper);
  return actor;
}

float LargestOpacity(const std::vector<float>& picture)
{
  float largest = 0;
  for (std::size_t i = 3; i < picture.size(); i += 4)
  {
    largest = std::max(largest, picture[i]);
  }
  return largest;
}

} // namespace

// Two blocks of fog that overlap along the view: in front the one, then both, then the other.
TEST(MultiVolume, HomogeneousMediaAreExact)
{
  Pair pair(24);
  ImageOptions one;
  one.Dimensions = { 21, 21, 21 };
  ImageOptions other = one;
  other.Origin = { 0, 0, 8 };
  const auto constant = [](double, double, double) { return 0.5; };
  pair.Set(one, constant, other, constant);
  pair.Second.Volume->SetOrientation(0, 0, 0);
  pair.Second.Volume->SetPosition(0, 0, 0);
  const std::array<double, 2> opacity{ 0.06, 0.11 };
  const TransferNodes red{ { { 0, opacity[0] }, { 255, opacity[0] } },
    { { 0, 1, 0.2, 0 }, { 255, 1, 0.2, 0 } }, 1 };
  const TransferNodes blue{ { { 0, opacity[1] }, { 255, opacity[1] } },
    { { 0, 0, 0.4, 1 }, { 255, 0, 0.4, 1 } }, 1 };
  pair.First.SetTransfer(red);
  pair.Second.SetTransfer(blue);
  for (const bool behind : { false, true })
  {
    pair.First.Look({ 0, 0, behind ? -1.0 : 1.0 }, 3, true);
    const std::vector<float> picture = pair.Draw();
    // 8 of the first (or the second), 12 of both, 8 of the other.
    const std::array<double, 2> tau{ -std::log1p(-opacity[0]), -std::log1p(-opacity[1]) };
    const std::array<std::array<double, 3>, 2> color{ { { 1, 0.2, 0 }, { 0, 0.4, 1 } } };
    TruthColor truth{};
    const auto add = [&](bool isFirst, bool isSecond, double length)
    {
      const double sum = (isFirst ? tau[0] : 0) + (isSecond ? tau[1] : 0);
      const double a = -std::expm1(-sum * length) * (1 - truth[3]);
      for (std::size_t c = 0; c < 3; ++c)
      {
        truth[c] +=
          a * ((isFirst ? tau[0] * color[0][c] : 0) + (isSecond ? tau[1] * color[1][c] : 0)) / sum;
      }
      truth[3] += a;
    };
    // Seen along +z the first volume comes first; Look() looks along the direction.
    const bool firstInFront = !behind;
    add(firstInFront, !firstInFront, 8);
    add(true, true, 12);
    add(!firstInFront, firstInFront, 8);
    const std::size_t middle = 4 * (12 * 24 + 12);
    for (std::size_t c = 0; c < 4; ++c)
    {
      EXPECT_NEAR(picture[middle + c], truth[c], 0.5 / 255) << c << ", " << behind;
    }
  }
}

TEST(MultiVolume, TruthOfTwoVolumes)
{
  Pair pair(48);
  for (const bool parallel : { false, true })
  {
    if (parallel && !TakesAll())
    {
      continue;
    }
    pair.First.Look({ 0.4, 1, -0.3 }, 0.8, parallel);
    const std::vector<float> picture = pair.Draw();
    EXPECT_TRUE(pair.Mapper()->IsConverged());
    EXPECT_GT(LargestOpacity(picture), 0.5f);
    const Excess excess = ExcessOf(pair, picture, 1);
    std::printf("  beyond the truth: %.2f/255 at most, %.2f/255 in 99.9 %%\n", 255 * excess.Max,
      255 * excess.Most);
    EXPECT_LE(excess.Max, 1.0 / 255);
  }
  // Thin shells: surfaces of both that pass through each other.
  pair.First.SetTransfer(MakeTransfer(OpacityShape::Box));
  pair.Second.SetTransfer(MakeTransfer(OpacityShape::Peak));
  const Excess excess = ExcessOf(pair, pair.Draw(), 2);
  std::printf(
    "  shells: %.2f/255 at most, %.2f/255 in 99.9 %%\n", 255 * excess.Max, 255 * excess.Most);
  EXPECT_LE(excess.Max, 1.0 / 255);
}

// VTK's mapper steps through all volumes, one after the other at each place.
TEST(MultiVolume, BesideVTK)
{
  Pair pair(64);
  // Cell data: of the outer half voxels of point data VTK 9.1 takes account for the first input
  // only, and stretches the others over their bounds.
  ImageOptions one;
  ImageOptions other = SecondOptions();
  one.CellData = other.CellData = true;
  pair.Set(one, BlobField, other, RippleField);
  const std::vector<float> ours = WithoutAlpha(pair.First.DrawPicture());
  vtkNew<vtkOpenGLGPUVolumeRayCastMapper> theirs;
  theirs->SetScalarModeToUseCellData();
  theirs->SetAutoAdjustSampleDistances(0);
  theirs->UseJitteringOff();
  theirs->SetSampleDistance(0.1f);
  pair.Connect(theirs, { WithWideScalars(pair.Images[0]), WithWideScalars(pair.Images[1]) });
  pair.Both->SetMapper(theirs);
  const std::vector<float> picture = WithoutAlpha(pair.First.DrawPicture());
  pair.Both->SetMapper(pair.First.Mapper);
  const ImageDifference d = CompareImages(ours, picture);
  std::printf("  mean %.3f/255, p99 %.2f/255, max %.2f/255\n", 255 * d.Mean, 255 * d.Percentile99,
    255 * d.Max);
  EXPECT_GT(*std::max_element(picture.begin(), picture.end()), 0.3f);
  EXPECT_LE(d.Mean, 1.0 / 255);
  EXPECT_LE(d.Percentile99, 6.0 / 255);
}

// Alone in its vtkMultiVolume a volume is what it is in a vtkVolume, to the bit; so are places
// where there is but one.
TEST(MultiVolume, OneVolumeAloneIsItsPicture)
{
  Pair pair(48);
  const std::vector<float> both = pair.Draw();
  pair.Second.Volume->SetVisibility(0);
  const std::vector<float> first = pair.Draw();
  pair.First.Renderer->RemoveVolume(pair.Both);
  pair.First.Renderer->AddVolume(pair.First.Volume);
  pair.First.Mapper->RemoveInputConnection(1, 0);
  EXPECT_TRUE(AreImagesIdentical(first, pair.Draw()));
  pair.Second.Mapper->SetBrickSize(16);
  pair.Second.Volume->SetVisibility(1);
  const std::vector<float> second = pair.Second.Draw();
  pair.First.Renderer->RemoveVolume(pair.First.Volume);
  int alone = 0;
  for (std::size_t i = 0; i < both.size(); i += 4)
  {
    const bool isFirst = first[i + 3] > 0;
    const bool isSecond = second[i + 3] > 0;
    for (std::size_t c = 0; c < 4 && isFirst != isSecond; ++c)
    {
      ASSERT_EQ(both[i + c], isFirst ? first[i + c] : second[i + c]);
      ++alone;
    }
    // The opacity is that of both, whatever their order.
    EXPECT_NEAR(1 - both[i + 3], (1 - first[i + 3]) * (1 - second[i + 3]), 1.0 / 255);
  }
  EXPECT_GT(alone, 400);
}

// Small atlases, shuffled arrivals and skipping change no bit; which port a volume has doesn't
// matter but for rounding.
TEST(MultiVolume, SameBits)
{
  Pair pair(48);
  const std::vector<float> before = pair.Draw();
  pair.Mapper()->SetMaximumNumberOfSlots(3);
  pair.Mapper()->SetArrivalShuffleSeed(5);
  EXPECT_TRUE(AreImagesIdentical(before, pair.Draw()));
  EXPECT_TRUE(pair.Mapper()->IsConverged());
  EXPECT_EQ(pair.Mapper()->GetNumberOfSlots(), 6u);
  EXPECT_GT(pair.Mapper()->GetNumberOfEvictions(), 0u);
  EXPECT_EQ(pair.Mapper()->CheckInvariants(), "");
  pair.Mapper()->SetMaximumNumberOfSlots(0);
  pair.Mapper()->EmptySpaceSkippingOff();
  EXPECT_TRUE(AreImagesIdentical(before, pair.Draw()));
  pair.Mapper()->EmptySpaceSkippingOn();
  std::swap(pair.Images[0], pair.Images[1]);
  pair.Connect(pair.Mapper(), pair.Images);
  pair.Both->SetVolume(pair.Second.Volume, 0);
  pair.Both->SetVolume(pair.First.Volume, 1);
  EXPECT_LE(CompareImages(before, pair.Draw()).Max, 1e-5);
}

// Inputs that nobody has updated yet have bounds: cameras are reset to them.
TEST(MultiVolume, BoundsOfInputsThatWereNeverUpdated)
{
  Pair pair(24);
  for (const int port : { 0, 1 })
  {
    vtkNew<vtkProceduralVolumeSource> source;
    source->SetDimensions(33, 33, 33);
    pair.Mapper()->SetInputConnection(port, source->GetOutputPort());
  }
  pair.First.Volume->SetPosition(-5, 0, 0);
  pair.Second.Volume->SetOrientation(0, 0, 0);
  pair.Second.Volume->SetPosition(10, 0, 0);
  const double* bounds = pair.Both->GetBounds();
  const std::array<double, 6> expected{ -5, 42, 0, 32, 0, 32 };
  for (std::size_t i = 0; i < 6; ++i)
  {
    EXPECT_NEAR(bounds[i], expected[i], 1e-9) << i;
  }
}

// Nothing is drawn again of an unchanged scene.
TEST(MultiVolume, UnchangedScenesCostNothing)
{
  Pair pair(40);
  const std::vector<float> before = pair.Draw();
  EXPECT_GT(pair.Mapper()->GetNumberOfPasses(), 2u);
  EXPECT_TRUE(AreImagesIdentical(before, pair.Draw()));
  EXPECT_EQ(pair.Mapper()->GetNumberOfPasses(), 0u);
  EXPECT_TRUE(pair.Mapper()->IsConverged());
  pair.Second.Volume->SetPosition(3, -1, 4);
  EXPECT_FALSE(AreImagesIdentical(before, pair.Draw()));
}

// Frames of little time become the converged picture, and say so not before.
TEST(MultiVolume, InteractiveFramesConverge)
{
  Pair pair(40);
  const std::vector<float> truth = pair.Draw();
  pair.Second.Volume->SetPosition(2, -2, 4);
  pair.Draw();
  pair.Second.Volume->SetPosition(3, -2, 4);
  double budget = 0.005;
  int frames = 0;
  std::vector<float> picture;
  do
  {
    // However slow a machine is, there is enough in the end.
    pair.Mapper()->SetFrameTimeBudget(budget);
    picture = pair.Draw();
    budget *= 1.1;
    ++frames;
  } while (!pair.Mapper()->IsConverged() && frames < 200);
  EXPECT_TRUE(pair.Mapper()->IsConverged());
  EXPECT_GT(frames, 1);
  EXPECT_TRUE(AreImagesIdentical(truth, picture)) << frames;
}

// One budget for all: what the engines take together stays inside it, and a tiny one is an error.
TEST(MultiVolume, BudgetsHold)
{
  Pair pair(40);
  constexpr vtkTypeUInt64 budget = 24 << 20;
  pair.Mapper()->SetGPUMemoryBudget(budget);
  pair.Mapper()->SetHostMemoryBudget(16 << 20);
  const std::vector<float> picture = pair.Draw();
  EXPECT_TRUE(pair.Mapper()->IsConverged());
  EXPECT_GT(LargestOpacity(picture), 0.5f);
  EXPECT_LE(pair.Mapper()->GetPeakGPUMemoryUsed(), budget);
  EXPECT_LE(pair.Mapper()->GetPeakHostMemoryUsed(), vtkTypeUInt64{ 16 << 20 });
  vtkNew<MessageRecorder> messages;
  pair.Mapper()->AddObserver(vtkCommand::ErrorEvent, messages);
  pair.Mapper()->SetGPUMemoryBudget(1 << 16);
  pair.Draw();
  EXPECT_FALSE(pair.Mapper()->IsConverged());
  EXPECT_EQ(messages->Messages.size(), 1u);
  pair.Mapper()->SetGPUMemoryBudget(budget);
  EXPECT_TRUE(AreImagesIdentical(picture, pair.Draw()));
}

// What one volume can't use of the budget is the other's: beside a tiny one a large one has all
// its bricks in a budget whose half isn't enough.
TEST(MultiVolume, BudgetsByNeed)
{
  Pair pair(12);
  vtkNew<vtkProceduralVolumeSource> source;
  source->SetFunctionName("shells");
  source->SetDimensions(160, 160, 160);
  source->SetSpacing(0.06, 0.06, 0.06);
  pair.Mapper()->SetInputConnection(1, source->GetOutputPort());
  pair.Second.SetTransfer(MakeTransfer(OpacityShape::Fog));
  const auto evictions = [&](vtkTypeUInt64 budget)
  {
    pair.Mapper()->SetGPUMemoryBudget(budget);
    const vtkTypeUInt64 before = pair.Mapper()->GetNumberOfEvictions();
    pair.Draw();
    EXPECT_TRUE(pair.Mapper()->IsConverged());
    EXPECT_LE(pair.Mapper()->GetPeakGPUMemoryUsed(), budget);
    return pair.Mapper()->GetNumberOfEvictions() - before;
  };
  pair.Mapper()->SetMaximumLevel(0);
  EXPECT_GT(evictions(10 << 20), 0u);
  EXPECT_EQ(evictions(16 << 20), 0u);
}

// The same of volumes with mappers of their own whose budgets nobody has set.
TEST(MultiVolume, OwnMappersShareByNeed)
{
  const auto make = [](std::int64_t edge)
  {
    auto stage = std::make_unique<Stage>(24, 24);
    vtkNew<vtkProceduralVolumeSource> source;
    source->SetFunctionName("shells");
    source->SetDimensions(edge, edge, edge);
    stage->Mapper->SetInputConnection(source->GetOutputPort());
    stage->SetTransfer(MakeTransfer(OpacityShape::Fog));
    stage->Mapper->SetGPUMemoryBudget(0);
    stage->Mapper->SetHostMemoryBudget(0);
    stage->Look({ 1, 0.2, 0.3 });
    return stage;
  };
  const auto small = make(32);
  small->Draw();
  const vtkTypeUInt64 gpu = small->Mapper->GetEffectiveGPUMemoryBudget();
  const vtkTypeUInt64 host = small->Mapper->GetEffectiveHostMemoryBudget();
  const auto large = make(std::int64_t{ 1 } << 20);
  large->Draw();
  const auto most = [](vtkTypeUInt64 bytes) { return bytes - bytes / 100; };
  EXPECT_GT(large->Mapper->GetEffectiveGPUMemoryBudget(), most(gpu));
  EXPECT_GT(large->Mapper->GetEffectiveHostMemoryBudget(), most(host));
  EXPECT_LE(
    large->Mapper->GetEffectiveGPUMemoryBudget() + small->Mapper->GetEffectiveGPUMemoryBudget(),
    gpu);
  EXPECT_LE(
    large->Mapper->GetEffectiveHostMemoryBudget() + small->Mapper->GetEffectiveHostMemoryBudget(),
    host);
  small->Draw();
  EXPECT_TRUE(small->Mapper->IsConverged());
  EXPECT_EQ(small->Mapper->GetNumberOfEvictions(), 0u);
  // Two that can use anything have equal shares; what is gone leaves its share.
  const auto other = make(std::int64_t{ 1 } << 20);
  other->Draw();
  EXPECT_EQ(
    large->Mapper->GetEffectiveGPUMemoryBudget(), other->Mapper->GetEffectiveGPUMemoryBudget());
  EXPECT_LT(other->Mapper->GetEffectiveGPUMemoryBudget(), gpu / 2);
  // One whose user has set a budget takes no more of the others'.
  large->Mapper->SetGPUMemoryBudget(std::uint64_t{ 64 } << 20);
  large->Draw();
  EXPECT_GT(other->Mapper->GetEffectiveGPUMemoryBudget(), gpu / 2);
}

// RenderToImage: nothing is shown, the colours are those of the mixed picture, and the depth is the
// first of those that the volumes have alone.
TEST(MultiVolume, RenderToImage)
{
  Pair pair(40);
  const std::vector<float> picture = pair.Draw();
  pair.Mapper()->RenderToImageOn();
  EXPECT_EQ(pair.Draw(), picture);
  EXPECT_TRUE(pair.Mapper()->IsConverged());
  const std::vector<float> shown = pair.First.DrawPicture();
  EXPECT_EQ(
    std::count(shown.begin(), shown.end(), shown[0]) + std::count(shown.begin(), shown.end(), 1.0f),
    static_cast<std::ptrdiff_t>(shown.size()))
    << "something is shown";
  vtkNew<vtkImageData> colors;
  vtkNew<vtkImageData> depths;
  pair.Mapper()->GetColorImage(colors);
  pair.Mapper()->GetDepthImage(depths);
  ASSERT_EQ(colors->GetNumberOfPoints(), 1600);
  ASSERT_EQ(depths->GetNumberOfPoints(), 1600);
  std::array<vtkNew<vtkImageData>, 2> alone;
  for (int v = 0; v < 2; ++v)
  {
    pair.Both->GetVolume(1 - v)->VisibilityOff();
    pair.Draw();
    pair.Mapper()->GetDepthImage(alone.at(static_cast<std::size_t>(v)));
    pair.Both->GetVolume(1 - v)->VisibilityOn();
  }
  int both = 0;
  for (int i = 0; i < 1600; ++i)
  {
    const int x = i % 40;
    const int y = i / 40;
    for (int c = 0; c < 4; ++c)
    {
      const double is = colors->GetScalarComponentAsDouble(x, y, 0, c);
      const float alpha = picture[static_cast<std::size_t>(4 * i + 3)];
      if (c == 3 || alpha > 0)
      {
        ASSERT_NEAR(is, 255 * std::min(picture[static_cast<std::size_t>(4 * i + c)], 1.0f), 0.51);
      }
    }
    const double one = alone[0]->GetScalarComponentAsDouble(x, y, 0, 0);
    const double other = alone[1]->GetScalarComponentAsDouble(x, y, 0, 0);
    ASSERT_EQ(depths->GetScalarComponentAsDouble(x, y, 0, 0), std::min(one, other));
    both += one < 1 && other < 1 ? 1 : 0;
  }
  EXPECT_GT(both, 100);
}

// Rays end at opaque geometry, and at clipping planes, of both volumes.
TEST(MultiVolume, GeometryAndClippingPlanes)
{
  Pair pair(40);
  const double place[3] = { 20, 18, 22 };
  const double normal[3] = { 0.2, 1, 0.1 };
  vtkNew<vtkPlane> plane; // keeps what lies in front
  plane->SetOrigin(place);
  plane->SetNormal(-normal[0], -normal[1], -normal[2]);
  pair.Mapper()->AddClippingPlane(plane);
  const std::vector<float> clipped = pair.Draw();
  pair.Mapper()->RemoveAllClippingPlanes();
  EXPECT_GT(CompareImages(clipped, pair.Draw()).Max, 0.05);
  const auto actor = Sheet(place, normal);
  pair.First.Renderer->AddActor(actor);
  // The depth buffer tells the plane's place to a few thousandths of a voxel.
  EXPECT_LE(CompareImages(clipped, pair.Draw()).Max, 2.0 / 255);
  EXPECT_TRUE(pair.Mapper()->IsConverged());
}

// A pyramid without end beside an image: bricks of both are loaded as the view needs them.
TEST(MultiVolume, PyramidBesideAnImage)
{
  Pair pair(40);
  vtkNew<vtkProceduralVolumeSource> source;
  source->SetFunctionName("shells");
  source->SetDimensions(4096, 4096, 4096);
  source->SetSpacing(0.01, 0.01, 0.01);
  source->SetLevel(6);
  pair.Mapper()->SetInputConnection(1, source->GetOutputPort());
  pair.Second.SetTransfer(MakeTransfer(OpacityShape::Box));
  pair.Mapper()->SetGPUMemoryBudget(64 << 20);
  const std::vector<float> picture = pair.Draw();
  EXPECT_TRUE(pair.Mapper()->IsConverged());
  EXPECT_LT(pair.Mapper()->GetBytesRead(), vtkTypeUInt64{ 200 } << 20);
  pair.Mapper()->SetMaximumNumberOfSlots(12);
  EXPECT_TRUE(AreImagesIdentical(picture, pair.Draw()));
  EXPECT_GT(pair.Mapper()->GetNumberOfEvictions(), 0u);
}

// Each volume shaded, and by a gradient opacity of its own, where its property says so.
TEST(MultiVolume, PropertiesAreEachVolumesOwn)
{
  Pair pair(40);
  const std::vector<float> plain = pair.Draw();
  pair.Second.SetShade(true);
  const std::vector<float> shaded = pair.Draw();
  pair.Second.SetShade(false);
  pair.First.SetGradientOpacity({ { 0, 0 }, { 20, 1 } });
  const std::vector<float> gradient = pair.Draw();
  // Where only one of them shows anything the other's settings change nothing.
  pair.First.SetGradientOpacity({});
  EXPECT_TRUE(AreImagesIdentical(plain, pair.Draw()));
  EXPECT_GT(CompareImages(plain, shaded).Max, 0.02);
  EXPECT_GT(CompareImages(plain, gradient).Max, 0.02);
}

// What doesn't work is said, once; nothing else warns.
TEST(MultiVolume, WhatIsNotSupportedWarns)
{
  Pair pair(24);
  vtkNew<MessageRecorder> messages;
  pair.Mapper()->AddObserver(vtkCommand::WarningEvent, messages);
  pair.Mapper()->AddObserver(vtkCommand::ErrorEvent, messages);
  const std::vector<float> plain = pair.Draw();
  EXPECT_TRUE(messages->Messages.empty()) << messages->Messages[0];
  pair.Mapper()->SetBlendModeToMaximumIntensity();
  EXPECT_TRUE(AreImagesIdentical(plain, pair.Draw()));
  pair.Draw();
  ASSERT_EQ(messages->Messages.size(), 1u);
  EXPECT_NE(messages->Messages[0].find("BlendMode of vtkMultiVolume"), std::string::npos);
}

// Where the opacity of both together passes a threshold.
TEST(MultiVolume, PicksAreOfBothTogether)
{
  Pair pair(40);
  const std::vector<float> picture = pair.Draw();
  const auto one = SourceOfImage(pair.Images[0], 16, false);
  const auto other = SourceOfImage(pair.Images[1], 16, false);
  const StageTruth first(pair.First, *one);
  const StageTruth second(pair.Second, *other);
  vtkCamera* camera = pair.First.Renderer->GetActiveCamera();
  std::array<int, 2> owners{ 0, 0 };
  int picks = 0;
  for (int y = 1; y < 40; y += 5)
  {
    for (int x = 2; x < 40; x += 5)
    {
      const auto pixel = static_cast<std::size_t>(y * 40 + x);
      const double opacity = 0.2;
      const bool found = pair.Mapper()->Pick(pair.First.Renderer, x + 0.5, y + 0.5, opacity);
      const auto whole = static_cast<double>(picture[4 * pixel + 3]);
      if (std::fabs(whole - opacity) < 0.01)
      {
        continue;
      }
      ASSERT_EQ(found, whole > opacity) << x << " " << y;
      if (!found)
      {
        continue;
      }
      ++picks;
      double p[4] = { 0, 0, 0, 1 };
      pair.Mapper()->GetPickPosition(p);
      double view[4];
      camera->GetModelViewTransformMatrix()->MultiplyPoint(p, view);
      const auto before = [&](double depth)
      {
        return 1 -
          (1 - IntegratePixel(first.Scene(), x, y, 0, 0, depth)[3]) *
          (1 - IntegratePixel(second.Scene(), x, y, 0, 0, depth)[3]);
      };
      EXPECT_NEAR(before(-view[2]), opacity, 0.005) << x << " " << y;
      // The value is that of one of both images there.
      for (const int v : { 0, 1 })
      {
        const RayOfTruth ray(v == 0 ? first.Scene() : second.Scene(), x, y, 0, 0);
        if (std::fabs(ray.Field(0, -view[2]) - pair.Mapper()->GetPickValue()) < 0.1)
        {
          ++owners[static_cast<std::size_t>(v)];
          break;
        }
      }
    }
  }
  EXPECT_GT(picks, 15);
  EXPECT_EQ(owners[0] + owners[1], picks);
  EXPECT_GT(owners[0], 0);
  EXPECT_GT(owners[1], 0);
  EXPECT_TRUE(AreImagesIdentical(picture, pair.Draw()));
  EXPECT_EQ(pair.Mapper()->GetNumberOfPasses(), 0u) << "picks change no picture";
}

// Selection finds the prop where any of its volumes shows something, and leaves pictures alone.
TEST(MultiVolume, SelectionFindsTheProp)
{
  Pair pair(40);
  const std::vector<float> picture = pair.Draw();
  vtkNew<vtkPropPicker> picker;
  int found = 0;
  for (int x = 1; x < 40; x += 6)
  {
    const float opacity = picture[4 * static_cast<std::size_t>(20 * 40 + x) + 3];
    const bool hit = picker->Pick(x, 20, 0, pair.First.Renderer) != 0;
    if (opacity > 0.05f)
    {
      EXPECT_TRUE(hit) << x;
      EXPECT_EQ(picker->GetViewProp(), pair.Both) << x;
      ++found;
    }
    else if (opacity == 0)
    {
      EXPECT_FALSE(hit) << x;
    }
  }
  EXPECT_GT(found, 2);
  EXPECT_TRUE(AreImagesIdentical(picture, pair.Draw()));
}

// Between translucent geometry: what lies in front of a sheet and what lies behind it, cut there by
// clipping planes, blended with it.
TEST(MultiVolume, BetweenTranslucentGeometry)
{
  Pair pair(40);
  const double place[3] = { 20, 18, 22 };
  const double normal[3] = { 0.2, 1, 0.1 }; // away from the eye
  constexpr float opacity = 0.4f;
  const std::array<float, 3> color{ 1, 0.2f, 0 };
  std::vector<float> truth;
  for (const bool front : { true, false })
  {
    const double sign = front ? -1 : 1;
    vtkNew<vtkPlane> plane;
    plane->SetOrigin(place);
    plane->SetNormal(sign * normal[0], sign * normal[1], sign * normal[2]);
    pair.Mapper()->RemoveAllClippingPlanes();
    pair.Mapper()->AddClippingPlane(plane);
    const std::vector<float> part = pair.Draw();
    for (std::size_t i = 0; i < part.size(); ++i)
    {
      const std::size_t c = i % 4;
      if (front)
      {
        const float left = 1 - part[i - c + 3];
        truth.push_back(part[i] + left * opacity * (c < 3 ? color[c] : 1));
      }
      else
      {
        // In order of channels: the opacity of the first part comes last.
        truth[i] += (1 - truth[i - c + 3]) * (c < 3 ? part[i] : 0);
      }
    }
  }
  pair.Mapper()->RemoveAllClippingPlanes();
  const auto actor = Sheet(place, normal);
  actor->GetProperty()->LightingOff();
  actor->GetProperty()->SetColor(1, 0.2, 0);
  actor->GetProperty()->SetOpacity(opacity);
  pair.First.Renderer->AddActor(actor);
  pair.First.Renderer->SetUseDepthPeeling(1);
  pair.First.Renderer->SetUseDepthPeelingForVolumes(true);
  const ImageDifference d =
    CompareImages(WithoutAlpha(truth), WithoutAlpha(pair.First.DrawPicture()));
  std::printf("  mean %.3f/255, max %.2f/255\n", 255 * d.Mean, 255 * d.Max);
  EXPECT_TRUE(pair.Mapper()->IsConverged());
  EXPECT_LE(d.Max, 3.0 / 255); // each peel rounds to 8 bits
}
