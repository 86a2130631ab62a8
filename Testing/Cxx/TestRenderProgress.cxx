// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Contracts 4 to 6: cost follows the picture and not the volume, budgets are hard, never a hole and
// never a lie.
#include "FaultyBrickSource.h"
#include "FormulaBrickSource.h"
#include "Scene.h"
#include "VTKTestSupport.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <gtest/gtest.h>
#include <map>
#include <random>
#include <thread>
#include <vtkCallbackCommand.h>
#include <vtkCamera.h>
#include <vtkImageData.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkVolumeProperty.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

std::shared_ptr<BrickSource> CubeOf(FormulaKind kind, std::int64_t edge, int brickSize)
{
  FormulaDescription formula;
  formula.Dimensions = { edge, edge, edge };
  formula.Field = MakeFormula(kind, formula.Dimensions);
  formula.BrickSize = brickSize;
  auto source = FormulaBrickSource::Make(formula);
  EXPECT_TRUE(source.Ok()) << source.GetStatus().Message();
  return source ? std::shared_ptr<BrickSource>(source.Value()) : nullptr;
}

std::shared_ptr<BrickSource> Blobs(int brickSize = 16)
{
  ImageOptions options;
  options.Dimensions = { 96, 80, 112 };
  return SourceOfImage(MakeImage(options), brickSize, false);
}

// Bytes of main memory that the process holds; 0 where the system doesn't tell.
std::uint64_t ResidentBytes()
{
  std::ifstream status("/proc/self/status");
  std::string word;
  while (status >> word)
  {
    if (word == "VmRSS:")
    {
      std::uint64_t kibibytes = 0;
      status >> kibibytes;
      return kibibytes * 1024;
    }
  }
  return 0;
}

// Reads of bricks finer than the coarsest level don't end until the source is opened.
class StallingSource : public BrickSource
{
public:
  StallingSource(std::shared_ptr<BrickSource> inner, int coarsest)
    : Inner(std::move(inner))
    , Coarsest(coarsest)
  {
  }
  const VolumeInfo& Info() const override { return this->Inner->Info(); }
  Result<BrickPointer> ReadBrick(const BrickKey& key) override
  {
    while (!this->Open && key.Level < this->Coarsest)
    {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    this->CoarsestReads += key.Level == this->Coarsest ? 1 : 0;
    return this->Inner->ReadBrick(key);
  }
  Result<std::vector<ValueRange>> ReadRanges(const BrickKey& first, const Int3& count) override
  {
    return this->Inner->ReadRanges(first, count);
  }

  std::atomic<bool> Open{ false };
  std::atomic<int> CoarsestReads{ 0 };

private:
  const std::shared_ptr<BrickSource> Inner;
  const int Coarsest;
};

} // namespace

TEST(Contract4, CostFollowsThePicture)
{
  struct Cost
  {
    double Addressing;
    double Operations;
    double Passes;
    double Bricks;
  };
  std::vector<Cost> costs;
  for (const int exponent : { 9, 30 })
  {
    const double edge = std::ldexp(1.0, exponent);
    Stage stage(96, 96);
    stage.SetSource(CubeOf(FormulaKind::Shells, std::int64_t{ 1 } << exponent, 32));
    stage.SetTransfer(MakeTransfer(OpacityShape::Wall, 0, 255, edge / 512));
    stage.Mapper->SetMaximumNumberOfSlots(512);
    stage.Look({ 0.3, 1, -0.2 }, 0.7);
    const std::vector<float> picture = stage.Draw();
    ASSERT_TRUE(stage.Mapper->IsConverged());
    EXPECT_GT(*std::max_element(picture.begin(), picture.end()), 0.1f);
    costs.push_back({ static_cast<double>(stage.Mapper->GetAddressingMemoryUsed()),
      static_cast<double>(stage.Mapper->GetNumberOfOperations()),
      static_cast<double>(stage.Mapper->GetNumberOfPasses()),
      static_cast<double>(stage.Mapper->GetNumberOfBricksLoaded()) });
    std::printf(
      "  2^%d per axis: addressing %.0f bytes, %.0f operations, %.0f passes, %.0f bricks, "
      "GPU %llu bytes\n",
      exponent, costs.back().Addressing, costs.back().Operations, costs.back().Passes,
      costs.back().Bricks, static_cast<unsigned long long>(stage.Mapper->GetGPUMemoryUsed()));
    // The next frame, with everything there.
    stage.Draw();
    EXPECT_EQ(stage.Mapper->GetNumberOfBricksLoaded(), costs.back().Bricks);
  }
  EXPECT_LE(costs[1].Addressing, 1.2 * costs[0].Addressing);
  // Every page level below the directory adds one block of 512 entries to each way to a brick: nine
  // levels instead of one here, which few bricks don't outweigh. Printed above; what a brick costs
  // beyond its chain must not grow.
  EXPECT_LE(costs[1].Operations, 2.5 * costs[0].Operations);
  EXPECT_LE(costs[1].Passes, 1.2 * costs[0].Passes);
  EXPECT_LE(costs[1].Bricks, 1.2 * costs[0].Bricks);
}

TEST(Contract5, BudgetsAreHard)
{
  std::mt19937 random(3);
  const auto pick = [&](std::uint64_t low, std::uint64_t high)
  { return std::uniform_int_distribution<std::uint64_t>(low, high)(random); };
  Stage stage(64, 64);
  const auto source = CubeOf(FormulaKind::Sponge, 2187, 32);
  stage.SetSource(source);
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  constexpr std::uint64_t mebibyte = 1 << 20;
  std::uint64_t largestGPU = 0;
  std::uint64_t largestHost = 0;
  std::uint64_t before = 0;
  for (int step = 0; step < 14; ++step)
  {
    const std::uint64_t gpu = pick(10, 48) * mebibyte;
    const std::uint64_t host = pick(8, 40) * mebibyte;
    largestGPU = std::max(largestGPU, gpu);
    largestHost = std::max(largestHost, host);
    stage.Mapper->SetGPUMemoryBudget(gpu);
    stage.Mapper->SetHostMemoryBudget(host);
    stage.Window->SetSize(static_cast<int>(pick(20, 160)), static_cast<int>(pick(20, 160)));
    const double turn = static_cast<double>(pick(0, 100)) / 50 - 1;
    stage.Look({ turn, 1, 0.3 * turn }, static_cast<double>(pick(2, 12)) / 10, step % 3 == 0);
    stage.SetShade(step % 4 == 1);
    stage.Window->Render();
    EXPECT_TRUE(stage.Mapper->IsConverged()) << "step " << step;
    EXPECT_LE(stage.Mapper->GetGPUMemoryUsed(), gpu) << "step " << step;
    EXPECT_LE(stage.Mapper->GetPeakGPUMemoryUsed(), largestGPU) << "step " << step;
    EXPECT_LE(stage.Mapper->GetHostMemoryUsed(), host) << "step " << step;
    EXPECT_EQ(stage.Mapper->CheckInvariants(), "") << "step " << step;
    if (step == 0)
    {
      before = ResidentBytes();
    }
  }
  const std::uint64_t after = ResidentBytes();
  const double growth = static_cast<double>(after) - static_cast<double>(before);
  std::printf("  main memory grew by %.1f MiB; budgets up to %.0f + %.0f MiB\n", growth / mebibyte,
    static_cast<double>(largestGPU) / mebibyte, static_cast<double>(largestHost) / mebibyte);
  // A software renderer keeps textures in main memory; shader variants and the frame buffers of
  // larger windows are the rest.
  if (before > 0)
  {
    EXPECT_LE(growth, static_cast<double>(largestGPU + largestHost + 96 * mebibyte));
  }
}

TEST(Contract5, TooSmallABudgetIsOneClearError)
{
  Stage stage(64, 64);
  stage.SetSource(Blobs());
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.Look({ 0.3, 1, 0.2 }, 1);
  vtkNew<ErrorRecorder> recorder;
  recorder->Observe(stage.Mapper);
  stage.Mapper->SetGPUMemoryBudget(100000);
  stage.Window->Render();
  stage.Window->Render();
  ASSERT_EQ(recorder->Errors.size(), 1u);
  EXPECT_NE(recorder->Errors[0].find("100000"), std::string::npos) << recorder->Errors[0];
  EXPECT_NE(recorder->Errors[0].find("the least that works"), std::string::npos)
    << recorder->Errors[0];
  EXPECT_FALSE(stage.Mapper->IsConverged());
  // What it says is true: that budget does work.
  const std::string text = recorder->Errors[0];
  const std::size_t at = text.find("works here is ");
  ASSERT_NE(at, std::string::npos) << text;
  const std::uint64_t least = std::stoull(text.substr(at + 14));
  stage.Mapper->SetGPUMemoryBudget(least);
  stage.Window->Render();
  EXPECT_EQ(recorder->Errors.size(), 1u) << recorder->Errors.back();
  EXPECT_TRUE(stage.Mapper->IsConverged());
  EXPECT_LE(stage.Mapper->GetPeakGPUMemoryUsed(), least);
}

class Contract6 : public testing::Test
{
protected:
  void SetUp() override
  {
    this->Inner = Blobs();
    Stage stage(64, 64);
    this->Set(stage, this->Inner);
    this->Reference = stage.Draw();
    ASSERT_TRUE(stage.Mapper->IsConverged());
  }
  static void Set(Stage& stage, const std::shared_ptr<BrickSource>& source)
  {
    stage.SetSource(source);
    TransferNodes nodes = MakeTransfer(OpacityShape::Ramp);
    nodes.Opacity[0][1] = nodes.Opacity[1][1] = 0.002; // nowhere invisible
    stage.SetTransfer(nodes);
    stage.Look({ 0.3, 1, -0.2 }, 0.8);
  }
  // Pixels where the reference shows something and the picture nothing.
  int Holes(const std::vector<float>& picture) const
  {
    int holes = 0;
    for (std::size_t i = 3; i < picture.size(); i += 4)
    {
      holes += this->Reference[i] > 0.004f && picture[i] < 0.25f * this->Reference[i] ? 1 : 0;
    }
    return holes;
  }

  std::shared_ptr<BrickSource> Inner;
  std::vector<float> Reference;
};

TEST_F(Contract6, InteractiveConvergesToTheSameBits)
{
  for (const std::uint32_t slots : { 0u, 300u })
  {
    Stage stage(64, 64);
    Set(stage, this->Inner);
    stage.Mapper->SetMaximumNumberOfSlots(slots);
    stage.Mapper->SetFrameTimeBudget(1e3);
    int frames = 0;
    std::vector<float> picture;
    do
    {
      picture = stage.Draw();
      EXPECT_EQ(stage.Mapper->CheckInvariants(), "");
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    } while (!stage.Mapper->IsConverged() && ++frames < 500);
    EXPECT_TRUE(stage.Mapper->IsConverged()) << slots << " slots";
    EXPECT_TRUE(AreImagesIdentical(picture, this->Reference))
      << slots << " slots: " << CountDifferentBits(picture, this->Reference)
      << " channels differ, by " << CompareImages(picture, this->Reference).Max << " at most";
    std::printf("  %u slots: %d frames\n", slots, frames + 1);
  }
}

TEST_F(Contract6, StalledSourceLeavesNoHole)
{
  const int coarsest = this->Inner->Info().Layout.NumberOfLevels() - 1;
  const auto source = std::make_shared<StallingSource>(this->Inner, coarsest);
  Stage stage(64, 64);
  Set(stage, source);
  stage.Mapper->SetNumberOfLoaderThreads(2);
  stage.Mapper->SetFrameTimeBudget(1e3);
  std::vector<float> picture;
  int holes = -1;
  for (int frame = 0; frame < 300 && holes != 0; ++frame)
  {
    picture = stage.Draw();
    holes = this->Holes(picture);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_EQ(holes, 0) << "the coarsest level was read " << source->CoarsestReads << " times";
  EXPECT_FALSE(stage.Mapper->IsConverged()) << "a coarse picture claims to be complete";
  EXPECT_GT(stage.Mapper->GetNumberOfMissingBricks(), 0);
  // From now on none may open again.
  source->Open = true;
  for (int frame = 0; frame < 500 && !stage.Mapper->IsConverged(); ++frame)
  {
    picture = stage.Draw();
    EXPECT_EQ(this->Holes(picture), 0) << "frame " << frame;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  EXPECT_TRUE(AreImagesIdentical(picture, this->Reference));
}

TEST_F(Contract6, FailedBricksAreReplacedAndReported)
{
  struct Injection
  {
    Fault Kind;
    int LevelsThatFail;
  };
  for (const Injection injection :
    { Injection{ Fault::Status, 1 }, Injection{ Fault::Throw, 1 }, Injection{ Fault::ThrowOdd, 1 },
      Injection{ Fault::ShortData, 1 }, Injection{ Fault::NullBrick, 1 },
      Injection{ Fault::OutOfMemory, 1 }, Injection{ Fault::Status, 2 } })
  {
    const std::string name = "fault " + std::to_string(static_cast<int>(injection.Kind)) + " in " +
      std::to_string(injection.LevelsThatFail) + " levels";
    const auto source = std::make_shared<FaultyBrickSource>(this->Inner);
    const auto broken = std::make_shared<std::atomic<bool>>(true);
    source->SetFaults(
      [broken, injection](const BrickKey& key)
      {
        // Ranges of whole page blocks begin at brick (0, 0, 0): they are spared here.
        const bool fails = key.PageLevel == 0 && key.Level < injection.LevelsThatFail &&
          (key.X + 2 * key.Y + 3 * key.Z) % 5 == 1;
        return fails && *broken ? injection.Kind : Fault::None;
      });
    Stage stage(64, 64);
    Set(stage, source);
    vtkNew<ErrorRecorder> recorder;
    recorder->Observe(stage.Mapper);
    std::map<std::string, int> events;
    vtkNew<vtkCallbackCommand> onFailure;
    onFailure->SetClientData(&events);
    onFailure->SetCallback([](vtkObject*, unsigned long, void* client, void* data)
      { ++(*static_cast<std::map<std::string, int>*>(client))[static_cast<const char*>(data)]; });
    stage.Mapper->AddObserver(vtkOutOfCoreVolumeMapper::BrickFailedEvent, onFailure);

    const std::vector<float> picture = stage.Draw();
    EXPECT_FALSE(stage.Mapper->IsConverged()) << name;
    EXPECT_EQ(this->Holes(picture), 0) << name;
    EXPECT_LE(CompareImages(picture, this->Reference).Mean, 0.05) << name;
    EXPECT_FALSE(AreImagesIdentical(picture, this->Reference)) << name;
    EXPECT_GT(events.size(), 3u) << name;
    EXPECT_EQ(stage.Mapper->GetNumberOfFailedBricks(), events.size()) << name;
    for (const auto& event : events)
    {
      EXPECT_EQ(event.second, 1) << name << ": " << event.first;
      EXPECT_NE(event.first.find("brick ("), std::string::npos) << event.first;
    }
    EXPECT_EQ(recorder->Errors.size(), 1u) << name;
    const std::size_t reported = events.size();
    const std::vector<float> again = stage.Draw();
    EXPECT_TRUE(AreImagesIdentical(again, picture)) << name;
    EXPECT_EQ(events.size(), reported) << name;
    EXPECT_FALSE(stage.Mapper->IsConverged()) << name;

    *broken = false;
    stage.Mapper->RetryFailedBricks();
    const std::vector<float> mended = stage.Draw();
    EXPECT_TRUE(stage.Mapper->IsConverged()) << name;
    EXPECT_EQ(stage.Mapper->GetNumberOfFailedBricks(), 0u) << name;
    EXPECT_TRUE(AreImagesIdentical(mended, this->Reference))
      << name << ": " << CountDifferentBits(mended, this->Reference) << " channels differ";
  }
}

// Ranges that can't be read: named as what they are, and asked for again like bricks.
TEST_F(Contract6, FailedPageBlocks)
{
  const auto source = std::make_shared<FaultyBrickSource>(this->Inner);
  const auto broken = std::make_shared<std::atomic<bool>>(true);
  source->SetFaults(
    [broken](const BrickKey& key)
    {
      const bool first = key.PageLevel == 0 && key.X == 0 && key.Y == 0 && key.Z == 0;
      return *broken && first && key.Level == 0 ? Fault::Status : Fault::None;
    });
  Stage stage(64, 64);
  Set(stage, source);
  vtkNew<ErrorRecorder> recorder;
  recorder->Observe(stage.Mapper);
  const std::vector<float> picture = stage.Draw();
  EXPECT_FALSE(stage.Mapper->IsConverged());
  EXPECT_EQ(this->Holes(picture), 0);
  EXPECT_EQ(recorder->Errors.size(), 1u);
  *broken = false;
  stage.Mapper->RetryFailedBricks();
  const std::vector<float> mended = stage.Draw();
  EXPECT_TRUE(stage.Mapper->IsConverged());
  EXPECT_TRUE(AreImagesIdentical(mended, this->Reference))
    << CountDifferentBits(mended, this->Reference) << " channels differ";
}

// Every brick fails: an empty picture that says so, and no hang.
TEST_F(Contract6, NothingReadable)
{
  const auto source = std::make_shared<FaultyBrickSource>(this->Inner);
  source->SetFaults(
    [](const BrickKey& key) { return key.PageLevel == 0 ? Fault::Status : Fault::None; });
  for (const double budget : { 0.0, 1e3 })
  {
    Stage stage(64, 64);
    Set(stage, source);
    stage.Mapper->SetFrameTimeBudget(budget);
    vtkNew<ErrorRecorder> recorder;
    recorder->Observe(stage.Mapper);
    for (int frame = 0; frame < 20; ++frame)
    {
      stage.Window->Render();
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    EXPECT_FALSE(stage.Mapper->IsConverged());
    EXPECT_GT(stage.Mapper->GetNumberOfFailedBricks(), 0u);
    EXPECT_EQ(recorder->Errors.size(), 1u);
  }
}
