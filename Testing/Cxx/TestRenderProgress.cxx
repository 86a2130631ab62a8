// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Contracts 4 to 6: cost follows the picture and not the volume, budgets are hard, never a hole and
// never a lie.
#include "FaultyBrickSource.h"
#include "FormulaBrickSource.h"
#include "ProcessMemory.h"
#include "RepeatBrickSource.h"
#include "Scene.h"
#include "VTKTestSupport.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <gtest/gtest.h>
#include <map>
#include <random>
#include <string>
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

// Ranges of page blocks can't be read, bricks can.
class RangelessSource : public BrickSource
{
public:
  explicit RangelessSource(std::shared_ptr<BrickSource> inner)
    : Inner(std::move(inner))
  {
  }
  const VolumeInfo& Info() const override { return this->Inner->Info(); }
  Result<BrickPointer> ReadBrick(const BrickKey& key) override
  {
    return this->Inner->ReadBrick(key);
  }
  Result<std::vector<ValueRange>> ReadRanges(const BrickKey& first, const Int3& count) override
  {
    if (first.PageLevel == 0 && !this->Readable)
    {
      return Status(StatusCode::InputOutput, "The ranges are lost.");
    }
    return this->Inner->ReadRanges(first, count);
  }

  std::atomic<bool> Readable{ false };

private:
  const std::shared_ptr<BrickSource> Inner;
};

// What a picture costs, from nothing.
struct Cost
{
  double Addressing = 0; ///< bytes
  double Operations = 0;
  double Passes = 0;
  double Bricks = 0;
  double Bytes = 0;     ///< to the GPU
  double Following = 0; ///< operations of frames that follow

  std::string Text() const
  {
    std::array<char, 256> text{};
    std::snprintf(text.data(), text.size(),
      "addressing %.0f bytes, %.0f operations, %.0f passes, %.0f bricks, %.0f bytes uploaded, "
      "%.0f operations in frames that follow",
      this->Addressing, this->Operations, this->Passes, this->Bricks, this->Bytes, this->Following);
    return text.data();
  }
};

Cost DrawAndCount(Stage& stage)
{
  const std::vector<float> picture = stage.Draw();
  EXPECT_TRUE(stage.Mapper->IsConverged());
  EXPECT_GT(*std::max_element(picture.begin(), picture.end()), 0.1f);
  vtkOutOfCoreVolumeMapper* mapper = stage.Mapper;
  Cost cost;
  cost.Addressing = static_cast<double>(mapper->GetAddressingMemoryUsed());
  cost.Operations = static_cast<double>(mapper->GetNumberOfOperations());
  cost.Passes = static_cast<double>(mapper->GetNumberOfPasses());
  cost.Bricks = static_cast<double>(mapper->GetNumberOfBricksLoaded());
  cost.Bytes =
    static_cast<double>(mapper->GetBytesUploaded() + mapper->GetPageTableBytesUploaded());
  return cost;
}

// Bricks that come later are wished for once more, and a little later: the least of a few tries is
// what a picture costs. How many bricks a pass finds is a matter of time alone, so of passes the
// mean is taken.
Cost LeastOfTries(int tries, const std::function<Cost()>& measure)
{
  Cost least = measure();
  for (int i = 1; i < tries; ++i)
  {
    const Cost again = measure();
    least.Operations = std::min(least.Operations, again.Operations);
    least.Passes += again.Passes;
    least.Bytes = std::min(least.Bytes, again.Bytes);
    least.Following = std::min(least.Following, again.Following);
  }
  least.Passes /= tries;
  return least;
}

void ExpectSameCost(const Cost& small, const Cost& large)
{
  EXPECT_LE(large.Addressing, 1.2 * small.Addressing);
  EXPECT_LE(large.Operations, 1.2 * small.Operations);
  EXPECT_LE(large.Following, 1.2 * small.Following);
  EXPECT_LE(large.Bytes, 1.2 * small.Bytes);
  // Two more for the luck of the loader's threads.
  EXPECT_LE(large.Passes, 1.2 * small.Passes + 2);
  EXPECT_LE(large.Bricks, 1.2 * small.Bricks);
}

} // namespace

TEST(Contract4, CostFollowsThePicture)
{
  const auto measure = [](int exponent)
  {
    const double edge = std::ldexp(1.0, exponent);
    Stage stage(96, 96);
    stage.SetSource(CubeOf(FormulaKind::Shells, std::int64_t{ 1 } << exponent, 32));
    stage.SetTransfer(MakeTransfer(OpacityShape::Wall, 0, 255, edge / 512));
    stage.Mapper->SetMaximumNumberOfSlots(512);
    stage.Look({ 0.3, 1, -0.2 }, 0.7);
    Cost cost = DrawAndCount(stage);
    std::printf("  2^%d per axis: %s\n", exponent, cost.Text().c_str());
    // The next frame, with everything there.
    stage.Draw();
    EXPECT_EQ(stage.Mapper->GetNumberOfOperations(), 0u);
    EXPECT_EQ(stage.Mapper->GetNumberOfBricksLoaded(), cost.Bricks);
    return cost;
  };
  ExpectSameCost(
    LeastOfTries(5, [&] { return measure(9); }), LeastOfTries(5, [&] { return measure(30); }));
}

// The same picture from inside of a cube of 512 voxels, alone and somewhere in 2^30 per axis, and
// of a flight that follows.
TEST(Contract4, CostOfNearViewsFollowsThePicture)
{
  ImageOptions options;
  options.Dimensions = { 64, 64, 64 };
  RepeatDescription repeat;
  repeat.Inner = SourceOfImage(MakeImage(options), 32, false);
  std::array<std::vector<float>, 2> pictures;
  const auto measure = [&](int exponent)
  {
    const std::int64_t copies = std::int64_t{ 1 } << (exponent - 6);
    // Faces of page blocks lie in the same places.
    const double offset = exponent == 9 ? 0.0 : 8192.0 * 54321;
    repeat.Repetitions = { copies, copies, copies };
    Stage stage(96, 96);
    stage.SetSource(RepeatBrickSource::Make(repeat).Value());
    stage.SetTransfer(MakeTransfer(OpacityShape::Peak, 0, 255, 4));
    stage.Mapper->SetMaximumNumberOfSlots(1024);
    const auto look = [&](double forward)
    {
      const double x = offset + 250.3;
      stage.LookFrom({ x, x, offset + 10.6 + forward }, { x, x, offset + 500 }, 1, 400);
    };
    look(0);
    Cost cost = DrawAndCount(stage);
    pictures[exponent == 9 ? 0 : 1] = stage.Accumulator();
    for (int frame = 1; frame <= 8; ++frame)
    {
      look(10.0 * frame);
      stage.Draw();
      EXPECT_TRUE(stage.Mapper->IsConverged());
      cost.Following += static_cast<double>(stage.Mapper->GetNumberOfOperations());
    }
    std::printf("  2^%d per axis: %s\n", exponent, cost.Text().c_str());
    return cost;
  };
  ExpectSameCost(
    LeastOfTries(2, [&] { return measure(9); }), LeastOfTries(2, [&] { return measure(30); }));
  const ImageDifference difference = CompareImages(pictures[0], pictures[1]);
  std::printf("  pictures differ by %.2g/255 at most\n", 255 * difference.Max);
  EXPECT_LE(difference.Max, 2.0 / 255) << "each within the tolerance of the same truth";
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
  std::uint64_t residentBefore = 0;
  std::uint64_t allocatedBefore = 0;
  std::uint64_t usedBefore = 0;
  double worst = 0;
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
    // A software renderer keeps textures in main memory; shader variants and the frame buffers of
    // larger windows are the rest. Freed memory may stay with the process.
    const std::uint64_t used = stage.Mapper->GetHostMemoryUsed() + stage.Mapper->GetGPUMemoryUsed();
    if (step == 0)
    {
      residentBefore = ResidentBytes();
      allocatedBefore = AllocatedBytes();
      usedBefore = used;
      continue;
    }
    const auto grown = [&](std::uint64_t now, std::uint64_t before)
    { return (static_cast<double>(now) - static_cast<double>(before)) / mebibyte; };
    const double resident = grown(ResidentBytes(), residentBefore);
    const double allocated = grown(AllocatedBytes(), allocatedBefore);
    const double counted = grown(used, usedBefore);
    worst = std::max(worst, allocated - counted);
    if (residentBefore > 0)
    {
      EXPECT_LE(resident, grown(largestGPU + largestHost, 0) + 96) << "step " << step;
    }
    if (allocatedBefore > 0)
    {
      EXPECT_LE(allocated, counted + 64) << "step " << step << ": not all is counted";
      EXPECT_GE(allocated, grown(stage.Mapper->GetHostMemoryUsed(), usedBefore) - 16)
        << "step " << step << ": more is counted than there is";
    }
  }
  std::printf(
    "  allocated beyond what is counted: at most %.1f MiB since the first picture\n", worst);
}

// What arrives faster than it finds a place counts as well, and a budget that holds two bricks
// draws the same picture.
TEST(Contract5, TheLeastHostBudgetWorks)
{
  Stage stage(64, 64);
  stage.SetSource(Blobs());
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.Look({ 0.3, 1, 0.2 }, 1);
  const std::vector<float> reference = stage.Draw();
  ASSERT_TRUE(stage.Mapper->IsConverged());
  vtkNew<ErrorRecorder> recorder;
  Stage poor(64, 64);
  poor.SetSource(Blobs());
  poor.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  poor.Look({ 0.3, 1, 0.2 }, 1);
  recorder->Observe(poor.Mapper);
  poor.Mapper->SetHostMemoryBudget(1000);
  poor.Window->Render();
  poor.Window->Render();
  ASSERT_EQ(recorder->Errors.size(), 1u);
  const std::string text = recorder->Errors[0];
  EXPECT_NE(text.find("host memory budget of 1000"), std::string::npos) << text;
  const std::size_t at = text.find("works here is ");
  ASSERT_NE(at, std::string::npos) << text;
  const std::uint64_t least = std::stoull(text.substr(at + 14));
  poor.Mapper->SetHostMemoryBudget(least);
  const std::vector<float> picture = poor.Draw();
  EXPECT_EQ(recorder->Errors.size(), 1u) << recorder->Errors.back();
  EXPECT_TRUE(poor.Mapper->IsConverged());
  EXPECT_TRUE(AreImagesIdentical(picture, reference));
  EXPECT_LE(poor.Mapper->GetHostMemoryUsed(), least);
  EXPECT_LE(poor.Mapper->GetPeakHostMemoryUsed(), least);
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

// All bricks can be read and are drawn, but nobody knows whether more should have been: neither
// mode calls that complete.
TEST_F(Contract6, FailedPageBlocksAreNeverComplete)
{
  const auto source = std::make_shared<RangelessSource>(this->Inner);
  Stage stage(64, 64);
  Set(stage, source);
  vtkNew<ErrorRecorder> recorder;
  recorder->Observe(stage.Mapper);
  stage.Mapper->SetFrameTimeBudget(1e3);
  for (int frame = 0; frame < 500 && stage.Mapper->GetNumberOfMissingBricks() + (frame < 50) > 0;
       ++frame)
  {
    stage.Draw();
    EXPECT_FALSE(stage.Mapper->IsConverged()) << "frame " << frame;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  EXPECT_EQ(stage.Mapper->GetNumberOfMissingBricks(), 0);
  EXPECT_EQ(stage.Mapper->GetNumberOfFailedBricks(), 0u);
  EXPECT_GT(stage.Mapper->GetNumberOfFailedPageBlocks(), 0u);
  EXPECT_EQ(recorder->Errors.size(), 1u);
  const auto began = std::chrono::steady_clock::now();
  EXPECT_FALSE(stage.Mapper->Converge(stage.Window, 600));
  EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(300)) << "it gives up";
  source->Readable = true;
  stage.Mapper->RetryFailedBricks();
  EXPECT_TRUE(stage.Mapper->Converge(stage.Window, 600));
  EXPECT_EQ(stage.Mapper->GetNumberOfFailedPageBlocks(), 0u);
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), this->Reference));
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
  EXPECT_GT(stage.Mapper->GetNumberOfFailedPageBlocks(), 0u);
  *broken = false;
  stage.Mapper->RetryFailedBricks();
  const std::vector<float> mended = stage.Draw();
  EXPECT_TRUE(stage.Mapper->IsConverged());
  EXPECT_EQ(stage.Mapper->GetNumberOfFailedPageBlocks(), 0u);
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
