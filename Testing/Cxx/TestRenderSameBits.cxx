// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Contracts 1 to 3: the picture is a function of data, camera and properties only, any budget
// works, skipping is conservative. Accumulators are compared bit for bit.
#include "FaultyBrickSource.h"
#include "FormulaBrickSource.h"
#include "Scene.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <mutex>
#include <ostream>
#include <random>
#include <thread>
#include <vtkCamera.h>
#include <vtkImageData.h>
#include <vtkRenderer.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr int BrickEdge = 16;
constexpr int Size = 64;

std::shared_ptr<BrickSource> SourceOfFormula(
  FormulaKind kind, const Int3& dimensions, int brickSize, ScalarType type = ScalarType::UInt8)
{
  FormulaDescription formula;
  formula.Field = MakeFormula(kind, dimensions);
  formula.Dimensions = dimensions;
  formula.Type = type;
  formula.BrickSize = brickSize;
  auto source = FormulaBrickSource::Make(formula);
  EXPECT_TRUE(source.Ok()) << source.GetStatus().Message();
  return source ? std::shared_ptr<BrickSource>(source.Value()) : nullptr;
}

// A volume, a transfer function and a view.
struct Scenario
{
  const char* Name;
  std::function<std::shared_ptr<BrickSource>()> Source; ///< null: not installed
  std::function<void(Stage&)> Set;
};

void PrintTo(const Scenario& scenario, std::ostream* out)
{
  *out << scenario.Name;
}

std::shared_ptr<BrickSource> Brain()
{
  const auto image = LoadBrain(3, { 96, 80, 100 });
  return image ? SourceOfImage(image, BrickEdge, false) : nullptr;
}

std::shared_ptr<BrickSource> Blobs(ScalarType type, double low, double high)
{
  ImageOptions options;
  options.Type = type;
  options.Dimensions = { 96, 80, 112 };
  options.Low = low;
  options.High = high;
  const auto image = MakeImage(options);
  return SourceOfImage(image, BrickEdge, false);
}

const Scenario Scenarios[] = {
  { "BrainOutside", Brain,
    [](Stage& s)
    {
      s.SetTransfer(BrainTransfer());
      s.Look({ 0.4, 1, -0.3 }, 0.9);
      s.Mapper->SetMaximumLevel(0);
    } },
  { "BrainShadedParallel", Brain,
    [](Stage& s)
    {
      s.SetTransfer(BrainTransfer());
      s.SetShade(true);
      s.Look({ -0.8, 0.5, -0.3 }, 0.7, true);
    } },
  { "BrainInsideOffAxis", Brain,
    [](Stage& s)
    {
      s.SetTransfer(BrainTransfer());
      s.LookFrom({ 40, 20, 50 }, { 60, 70, 60 }, 0.05, 300, 60);
      s.Renderer->GetActiveCamera()->SetWindowCenter(0.3, -0.2);
    } },
  { "BlobsNearest", [] { return Blobs(ScalarType::UInt16, 100, 40000); },
    [](Stage& s)
    {
      s.SetTransfer(MakeTransfer(OpacityShape::Ramp, 100, 40000));
      s.Property->SetInterpolationTypeToNearest();
      s.Look({ 0.4, 1, -0.3 }, 0.9);
    } },
  { "BlobsOfWideValuesInLevels", [] { return Blobs(ScalarType::Float64, 1.0e12, 1.0e12 + 7); },
    [](Stage& s)
    {
      s.SetTransfer(MakeTransfer(OpacityShape::Ramp, 1.0e12, 1.0e12 + 7));
      s.SetShade(true);
      s.LookFrom({ 30, -12, 40 }, { 50, 60, 60 }, 0.5, 400, 65);
    } },
  { "BlobsFogInLevels", [] { return Blobs(ScalarType::UInt8, 0, 255); },
    [](Stage& s)
    {
      s.SetTransfer(MakeTransfer(OpacityShape::Fog));
      s.LookFrom({ 30, -12, 40 }, { 50, 60, 60 }, 0.5, 400, 65);
    } },
  { "SpongeFarAndNear",
    [] {
      return SourceOfFormula(FormulaKind::Sponge, { 729, 729, 729 }, BrickEdge);
    },
    [](Stage& s)
    {
      s.SetTransfer(MakeTransfer(OpacityShape::Wall));
      s.LookFrom({ 330, -40, 350 }, { 380, 400, 380 }, 1, 2000, 60);
    } },
};

class SameBits : public testing::TestWithParam<Scenario>
{
protected:
  void SetUp() override
  {
    this->Source = GetParam().Source();
    if (!this->Source)
    {
      GTEST_SKIP() << "the brain scan of Debian's package mricron-data isn't installed";
    }
    this->Unlimited = this->MakeStage();
    this->Reference = this->Unlimited->Draw();
    ASSERT_FALSE(this->Reference.empty());
    ASSERT_TRUE(this->Unlimited->Mapper->IsConverged());
    this->WorkingSet = this->Unlimited->Mapper->GetNumberOfBricksLoaded();
    ASSERT_EQ(this->Unlimited->Mapper->GetNumberOfEvictions(), 0u);
    ASSERT_GT(this->WorkingSet, 32u) << "too small to say anything";
    EXPECT_GT(*std::max_element(this->Reference.begin(), this->Reference.end()), 0.1f);
  }

  std::unique_ptr<Stage> MakeStage(std::shared_ptr<BrickSource> other = nullptr) const
  {
    auto stage = std::make_unique<Stage>(Size, Size);
    stage->SetSource(other ? other : this->Source);
    GetParam().Set(*stage);
    return stage;
  }

  void ExpectSame(Stage& stage, const std::string& what) const
  {
    const std::vector<float> picture = stage.Draw();
    EXPECT_TRUE(stage.Mapper->IsConverged()) << what;
    EXPECT_EQ(stage.Mapper->CheckInvariants(), "") << what;
    ASSERT_EQ(picture.size(), this->Reference.size()) << what;
    if (!AreImagesIdentical(picture, this->Reference))
    {
      const ImageDifference d = CompareImages(picture, this->Reference);
      ADD_FAILURE() << what << ": " << CountDifferentBits(picture, this->Reference)
                    << " channels differ, by " << d.Max << " at most (pixel " << d.WorstPixel % Size
                    << ", " << d.WorstPixel / Size << ")";
    }
  }

  std::shared_ptr<BrickSource> Source;
  std::unique_ptr<Stage> Unlimited;
  std::vector<float> Reference;
  std::uint64_t WorkingSet = 0;
};

} // namespace

// Contracts 1 and 2.
TEST_P(SameBits, SixteenSlots)
{
  const auto stage = this->MakeStage();
  stage->Mapper->SetMaximumNumberOfSlots(16);
  this->ExpectSame(*stage, "16 slots");
  EXPECT_EQ(stage->Mapper->GetNumberOfSlots(), 16u);
  EXPECT_GT(stage->Mapper->GetNumberOfEvictions(), 0u);
  const double ratio = static_cast<double>(stage->Mapper->GetNumberOfBricksLoaded()) /
    static_cast<double>(this->WorkingSet);
  std::printf("  %s: %llu bricks, %.2f x with 16 slots, %llu passes\n", GetParam().Name,
    static_cast<unsigned long long>(this->WorkingSet), ratio,
    static_cast<unsigned long long>(stage->Mapper->GetNumberOfPasses()));
  EXPECT_LE(ratio, 1.5);
}

TEST_P(SameBits, QuarterOfTheWorkingSet)
{
  const auto stage = this->MakeStage();
  const auto slots = static_cast<std::uint32_t>(this->WorkingSet / 4);
  stage->Mapper->SetMaximumNumberOfSlots(slots);
  this->ExpectSame(*stage, "a quarter of the working set");
  EXPECT_EQ(stage->Mapper->GetNumberOfSlots(), slots);
  EXPECT_GT(stage->Mapper->GetNumberOfEvictions(), 0u);
}

TEST_P(SameBits, TwoSlots)
{
  const auto stage = this->MakeStage();
  stage->Mapper->SetMaximumNumberOfSlots(2);
  this->ExpectSame(*stage, "two slots");
  EXPECT_EQ(stage->Mapper->GetNumberOfSlots(), 2u);
}

TEST_P(SameBits, ThreadsAndArrivalOrders)
{
  for (const int threads : { 1, 4 })
  {
    for (const std::uint64_t seed : { 0, 7, 1234567 })
    {
      const auto stage = this->MakeStage();
      stage->Mapper->SetNumberOfLoaderThreads(threads);
      stage->Mapper->SetArrivalShuffleSeed(seed);
      stage->Mapper->SetMaximumNumberOfSlots(seed == 7 ? 0 : 24);
      this->ExpectSame(*stage, std::to_string(threads) + " threads, seed " + std::to_string(seed));
    }
  }
}

TEST_P(SameBits, RandomDelays)
{
  const auto slow = std::make_shared<FaultyBrickSource>(this->Source);
  std::mt19937 random(5);
  std::mutex mutex;
  slow->SetFaults(
    [&](const BrickKey&)
    {
      std::uint64_t delay = 0;
      {
        const std::lock_guard<std::mutex> lock(mutex);
        delay = random() % 3000;
      }
      std::this_thread::sleep_for(std::chrono::microseconds(delay));
      return Fault::None;
    });
  const auto stage = this->MakeStage(slow);
  stage->Mapper->SetNumberOfLoaderThreads(4);
  stage->Mapper->SetMaximumNumberOfSlots(32);
  this->ExpectSame(*stage, "random delays");
}

// Contract 3: empty bricks are never loaded, and that changes no bit.
TEST_P(SameBits, SkippingOff)
{
  for (const std::uint32_t slots : { 0u, 16u })
  {
    const auto stage = this->MakeStage();
    stage->Mapper->EmptySpaceSkippingOff();
    stage->Mapper->SetMaximumNumberOfSlots(slots);
    this->ExpectSame(*stage, "no skipping, " + std::to_string(slots) + " slots");
    EXPECT_GE(stage->Mapper->GetNumberOfBricksLoaded(), this->WorkingSet);
  }
}

TEST_P(SameBits, CountingSamples)
{
  this->Unlimited->Mapper->CountSamplesOn();
  this->ExpectSame(*this->Unlimited, "counting");
  EXPECT_GT(this->Unlimited->Mapper->GetNumberOfSamples(), 0u);
  EXPECT_LE(this->Unlimited->Mapper->GetNumberOfContributingSamples(),
    this->Unlimited->Mapper->GetNumberOfSamples());
}

// Also the same picture again, with nothing left to load.
TEST_P(SameBits, WalkOfTheCameraAndBack)
{
  this->ExpectSame(*this->Unlimited, "the same frame again");
  EXPECT_EQ(this->Unlimited->Mapper->GetNumberOfBricksLoaded(), this->WorkingSet);
  for (const bool limited : { false, true })
  {
    const auto stage = this->MakeStage();
    stage->Mapper->SetMaximumNumberOfSlots(limited ? 24 : 0);
    vtkCamera* camera = stage->Renderer->GetActiveCamera();
    vtkNew<vtkCamera> home;
    home->DeepCopy(camera);
    std::mt19937 random(11);
    std::uniform_real_distribution<double> turn(-40, 40);
    for (int step = 0; step < 4; ++step)
    {
      camera->Azimuth(turn(random));
      camera->Elevation(turn(random) / 2);
      camera->OrthogonalizeViewUp();
      camera->Dolly(1 + turn(random) / 200);
      stage->Draw();
      EXPECT_EQ(stage->Mapper->CheckInvariants(), "");
    }
    camera->DeepCopy(home);
    this->ExpectSame(*stage, limited ? "walk with 24 slots" : "walk");
  }
}

INSTANTIATE_TEST_SUITE_P(Contract1to3, SameBits, testing::ValuesIn(Scenarios),
  [](const auto& test) { return std::string(test.param.Name); });

// Contract 1: more page blocks than their pool holds.
TEST(Contract2, PagePoolSmallerThanTheView)
{
  const auto source = SourceOfFormula(FormulaKind::Shells, { 300, 300, 300 }, 4);
  std::vector<float> reference;
  // The pool grows with the slots: 64 blocks for the few.
  for (const std::uint32_t slots : { 0u, 300u })
  {
    Stage stage(Size, Size);
    stage.SetSource(source);
    stage.SetTransfer(MakeTransfer(OpacityShape::Wall));
    stage.Look({ 0.3, 1, 0.2 }, 0.6, true);
    stage.Mapper->SetMaximumLevel(0);
    stage.Mapper->SetMaximumNumberOfSlots(slots);
    const std::vector<float> picture = stage.Draw();
    EXPECT_TRUE(stage.Mapper->IsConverged());
    EXPECT_EQ(stage.Mapper->CheckInvariants(), "");
    if (slots == 0)
    {
      reference = picture;
      continue;
    }
    EXPECT_GT(stage.Mapper->GetNumberOfEvictions(), 0u);
    EXPECT_GT(stage.Mapper->GetNumberOfPageBlockEvictions(), 0u);
    EXPECT_TRUE(AreImagesIdentical(picture, reference))
      << CountDifferentBits(picture, reference) << " channels differ";
  }
}

// Contract 3: the border holds what gradients need.
TEST(Contract3, ShadingReloadsNothing)
{
  Stage stage(Size, Size);
  stage.SetSource(Blobs(ScalarType::UInt8, 0, 255));
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.Look({ 0.4, 1, -0.3 }, 0.9);
  const std::vector<float> plain = stage.Draw();
  const auto loaded = stage.Mapper->GetNumberOfBricksLoaded();
  EXPECT_GT(loaded, 0u);
  stage.SetShade(true);
  const std::vector<float> shaded = stage.Draw();
  EXPECT_EQ(stage.Mapper->GetNumberOfBricksLoaded(), loaded);
  EXPECT_FALSE(AreImagesIdentical(plain, shaded));
  stage.SetShade(false);
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), plain));
  EXPECT_EQ(stage.Mapper->GetNumberOfBricksLoaded(), loaded);
}

// Contract 3: an edit of the transfer function touches neither page table nor bricks that are
// there.
TEST(Contract3, EditOfTheTransferFunctionLoadsOnlyWhatIsNew)
{
  Stage stage(Size, Size);
  const auto source = Blobs(ScalarType::UInt8, 0, 255);
  stage.SetSource(source);
  stage.SetTransfer(MakeTransfer(OpacityShape::Box));
  stage.Look({ 0.4, 1, -0.3 }, 0.9);
  const std::vector<float> box = stage.Draw();
  const auto loaded = stage.Mapper->GetNumberOfBricksLoaded();
  TransferNodes weaker = MakeTransfer(OpacityShape::Box);
  for (auto& node : weaker.Opacity)
  {
    node[1] *= 1.2; // thicker: nothing behind it becomes visible that wasn't
  }
  stage.SetTransfer(weaker);
  EXPECT_FALSE(AreImagesIdentical(stage.Draw(), box));
  EXPECT_EQ(stage.Mapper->GetNumberOfBricksLoaded(), loaded);
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.Draw();
  stage.SetTransfer(MakeTransfer(OpacityShape::Box));
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), box));
}
