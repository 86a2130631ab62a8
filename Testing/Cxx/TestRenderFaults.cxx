// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// Disks that stall or fail, and drivers that refuse, while pictures are drawn: docs/faults.md.
#include "DiskFaults.h"
#include "FaultyBrickSource.h"
#include "GLApi.h"
#include "HDF5BrickSource.h"
#include "Scene.h"
#include "TestPyramidSupport.h"
#include "VTKTestSupport.h"
#include "vtkBrickSource.h"
#include "vtkHDF5PyramidReader.h"
#include "vtkOutOfCoreVolumeMapper.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gtest/gtest.h>
#include <map>
#include <string>
#include <thread>
#include <vtkCallbackCommand.h>
#include <vtkImageData.h>
#include <vtkPiecewiseFunction.h>
#include <vtkRenderWindow.h>
#include <vtkVolume.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

constexpr int Many = 3000;

std::shared_ptr<BrickSource> Blobs()
{
  ImageOptions options;
  options.Dimensions = { 96, 80, 112 };
  return SourceOfImage(MakeImage(options), 16, false);
}

void Furnish(Stage& stage)
{
  stage.SetTransfer(MakeTransfer(OpacityShape::Ramp));
  stage.Look({ 1, 0.4, 0.3 });
}

const std::vector<float>& Reference()
{
  static const std::vector<float> picture = []
  {
    Stage stage(64, 64);
    stage.SetSource(Blobs());
    Furnish(stage);
    return stage.Draw();
  }();
  return picture;
}

bool IsEmpty(const std::vector<float>& picture)
{
  return std::all_of(picture.begin(), picture.end(), [](float v) { return v == 0; });
}

/// Opens a source's gate if nobody else has for a minute, so that a test that waits for it fails
/// and ends. Late() tells whether it had to.
class Rescue
{
public:
  explicit Rescue(std::function<void()> open)
    : Open(std::move(open))
    , Thread(
        [this]
        {
          for (int i = 0; i < 6000 && !this->Over; ++i)
          {
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
          }
          this->Late_ = !this->Over;
          this->Open();
        })
  {
  }
  ~Rescue()
  {
    this->Over = true;
    this->Thread.join();
  }
  Rescue(const Rescue&) = delete;
  Rescue& operator=(const Rescue&) = delete;
  Rescue(Rescue&&) = delete;
  Rescue& operator=(Rescue&&) = delete;
  bool Late() const { return this->Late_; }

private:
  const std::function<void()> Open;
  std::atomic<bool> Over{ false };
  std::atomic<bool> Late_{ false };
  std::thread Thread;
};

/// Counts failures that the mapper tells of, by text.
class FailureCounter
{
public:
  explicit FailureCounter(vtkOutOfCoreVolumeMapper* mapper)
  {
    this->Command->SetClientData(this);
    this->Command->SetCallback([](vtkObject*, unsigned long, void* client, void* data)
      { ++static_cast<FailureCounter*>(client)->Events[static_cast<const char*>(data)]; });
    mapper->AddObserver(vtkOutOfCoreVolumeMapper::BrickFailedEvent, this->Command);
  }
  std::map<std::string, int> Events;

private:
  vtkNew<vtkCallbackCommand> Command;
};

/// Frames until the picture is complete.
void DrawUntilComplete(Stage& stage)
{
  for (int i = 0; i < Many && !stage.Mapper->IsConverged(); ++i)
  {
    stage.Window->Render();
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

} // namespace

// Nothing can be read, not even the ranges of the directory: interactive frames end all the same,
// show nothing, and say so.
TEST(Faults, InteractiveFramesNeverWaitForAStalledDisk)
{
  const std::vector<float>& reference = Reference();
  const auto source = std::make_shared<FaultyBrickSource>(Blobs());
  source->CloseGate();
  const Rescue rescue([source] { source->OpenGate(); });
  Stage stage(64, 64);
  stage.SetSource(source);
  Furnish(stage);
  stage.Mapper->SetFrameTimeBudget(1e3);
  for (int frame = 0; frame < 5; ++frame)
  {
    EXPECT_TRUE(IsEmpty(stage.Draw()));
    EXPECT_FALSE(stage.Mapper->IsConverged());
    EXPECT_GT(stage.Mapper->GetNumberOfMissingBricks(), 0);
    EXPECT_EQ(stage.Mapper->CheckInvariants(), "");
    stage.Look({ 1, 0.4 + 0.1 * frame, 0.3 });
  }
  // Nor do changes of what reads.
  stage.Mapper->SetNumberOfLoaderThreads(stage.Mapper->GetNumberOfLoaderThreads() % 8 + 1);
  EXPECT_TRUE(IsEmpty(stage.Draw()));
  EXPECT_FALSE(rescue.Late());
  source->OpenGate();
  stage.Look({ 1, 0.4, 0.3 });
  DrawUntilComplete(stage);
  EXPECT_TRUE(stage.Mapper->IsConverged());
  EXPECT_TRUE(AreImagesIdentical(stage.Accumulator(), reference))
    << CountDifferentBits(stage.Accumulator(), reference) << " channels differ";
}

// Of bricks that can't be read the ancestors are asked for; those don't come.
TEST(Faults, InteractiveFramesNeverWaitForAncestors)
{
  const auto source = std::make_shared<FaultyBrickSource>(Blobs());
  std::atomic<bool> stalls{ true };
  source->SetFaults(
    [&stalls](const BrickKey& key)
    {
      while (stalls && key.PageLevel == 0 && key.Level > 0)
      {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      return stalls && key.PageLevel == 0 && key.X + key.Y + key.Z > 0 ? Fault::Status
                                                                       : Fault::None;
    });
  {
    const Rescue rescue([&stalls] { stalls = false; });
    Stage stage(64, 64);
    stage.SetSource(source);
    Furnish(stage);
    stage.Mapper->SetNumberOfLoaderThreads(8);
    stage.Mapper->SetMaximumLevel(0);
    stage.Mapper->SetFrameTimeBudget(1e3);
    vtkNew<ErrorRecorder> recorder;
    recorder->Observe(stage.Mapper);
    for (int i = 0; i < Many && stage.Mapper->GetNumberOfFailedBricks() == 0; ++i)
    {
      stage.Draw();
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    EXPECT_GT(stage.Mapper->GetNumberOfFailedBricks(), 0u);
    for (int i = 0; i < 3; ++i)
    {
      stage.Draw();
      EXPECT_FALSE(stage.Mapper->IsConverged());
    }
    EXPECT_FALSE(rescue.Late());
    stalls = false;
  }
}

TEST(Faults, ConvergingFramesTimeOutAndSaySo)
{
  const std::vector<float>& reference = Reference();
  for (const bool all : { true, false })
  {
    const auto inner = Blobs();
    const auto source = std::make_shared<FaultyBrickSource>(inner);
    Stage stage(64, 64);
    const Rescue rescue([source] { source->OpenGate(); });
    stage.SetSource(source);
    Furnish(stage);
    EXPECT_EQ(stage.Mapper->GetConvergeTimeout(), 60);
    stage.Mapper->SetConvergeTimeout(0.2);
    if (!all)
    {
      // What is known already isn't lost.
      stage.Draw();
      stage.Mapper->SetMaximumNumberOfSlots(4); // a new page table
    }
    source->CloseGate();
    vtkNew<ErrorRecorder> recorder;
    recorder->Observe(stage.Mapper);
    vtkNew<vtkCallbackCommand> warned;
    int warnings = 0;
    warned->SetClientData(&warnings);
    warned->SetCallback(
      [](vtkObject*, unsigned long, void* client, void* data)
      {
        const std::string text = static_cast<const char*>(data);
        *static_cast<int*>(client) += text.find("isn't complete") != std::string::npos ? 1 : 0;
      });
    stage.Mapper->AddObserver(vtkCommand::WarningEvent, warned);
    stage.Look({ 1, 0.4, 0.31 });
    stage.Window->Render();
    EXPECT_FALSE(stage.Mapper->IsConverged());
    EXPECT_EQ(warnings, 1);
    EXPECT_FALSE(rescue.Late());
    source->OpenGate();
    stage.Mapper->SetConvergeTimeout(60);
    stage.Look({ 1, 0.4, 0.3 });
    EXPECT_TRUE(AreImagesIdentical(stage.Draw(), reference));
    EXPECT_TRUE(stage.Mapper->IsConverged());
    EXPECT_TRUE(recorder->Errors.empty());
  }
}

// A mount that is dead: whoever closes the volume, or draws another one, goes on.
TEST(Faults, AReadThatNeverEndsIsLeftBehind)
{
  const std::vector<float>& reference = Reference();
  const auto source = std::make_shared<FaultyBrickSource>(Blobs());
  source->CloseGate();
  const Rescue rescue([source] { source->OpenGate(); });
  {
    Stage stage(64, 64);
    stage.SetSource(source);
    Furnish(stage);
    stage.Mapper->SetFrameTimeBudget(1e3);
    for (int i = 0; i < Many && source->Reads() < 2; ++i)
    {
      stage.Draw();
    }
    ASSERT_GE(source->Reads(), 2);
    stage.SetSource(Blobs());
    stage.Mapper->SetFrameTimeBudget(0);
    // Threads that hang are no threads any more.
    stage.Mapper->SetNumberOfLoaderThreads(stage.Mapper->GetNumberOfLoaderThreads() % 8 + 1);
    EXPECT_TRUE(AreImagesIdentical(stage.Draw(), reference));
    stage.SetSource(source);
    stage.Mapper->SetFrameTimeBudget(1e3);
    stage.Draw();
  }
  EXPECT_FALSE(rescue.Late());
  EXPECT_GT(source.use_count(), 2) << "nothing reads any more, so nothing was tested";
  source->OpenGate();
  for (int i = 0; i < Many && source.use_count() > 2; ++i)
  {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_EQ(source.use_count(), 2) << "what was left behind ends when the read does";
}

// Whatever a source throws, for bricks, page blocks or the directory.
TEST(Faults, SourcesMayThrowAnything)
{
  const std::vector<float>& reference = Reference();
  for (const Fault kind : { Fault::Throw, Fault::ThrowOdd, Fault::OutOfMemory, Fault::ShortData })
  {
    const auto source = std::make_shared<FaultyBrickSource>(Blobs());
    std::atomic<bool> broken{ true };
    source->SetFaults([&broken, kind](const BrickKey&) { return broken ? kind : Fault::None; });
    Stage stage(64, 64);
    stage.SetSource(source);
    Furnish(stage);
    vtkNew<ErrorRecorder> recorder;
    recorder->Observe(stage.Mapper);
    EXPECT_TRUE(IsEmpty(stage.Draw()));
    EXPECT_FALSE(stage.Mapper->IsConverged());
    EXPECT_EQ(recorder->Errors.size(), 1u);
    broken = false;
    stage.Mapper->RetryFailedBricks();
    EXPECT_TRUE(AreImagesIdentical(stage.Draw(), reference));
    EXPECT_TRUE(stage.Mapper->IsConverged());
  }
}

// Nobody has to do anything when a fault has passed.
TEST(Faults, WhatFailedIsAskedForAgain)
{
  const std::vector<float>& reference = Reference();
  for (const double budget : { 0.0, 1e3 })
  {
    const auto source = std::make_shared<FaultyBrickSource>(Blobs());
    std::atomic<bool> broken{ true };
    source->SetFaults(
      [&broken](const BrickKey& key)
      {
        const bool fails = broken && key.PageLevel == 0 && (key.X + key.Y) % 2 == 1;
        return fails ? Fault::Status : Fault::None;
      });
    Stage stage(64, 64);
    stage.SetSource(source);
    Furnish(stage);
    stage.Mapper->SetFrameTimeBudget(budget);
    EXPECT_EQ(stage.Mapper->GetFailureRetryInterval(), 10);
    stage.Mapper->SetFailureRetryInterval(0.01);
    vtkNew<ErrorRecorder> recorder;
    recorder->Observe(stage.Mapper);
    FailureCounter failures(stage.Mapper);
    const int before = source->Reads();
    for (int frame = 0; frame < 30; ++frame)
    {
      stage.Draw();
      EXPECT_FALSE(stage.Mapper->IsConverged());
      std::this_thread::sleep_for(std::chrono::milliseconds(11));
    }
    EXPECT_GT(source->Reads() - before, 2 * static_cast<int>(failures.Events.size()));
    ASSERT_GT(failures.Events.size(), 3u);
    for (const auto& event : failures.Events)
    {
      EXPECT_EQ(event.second, 1) << event.first;
    }
    EXPECT_EQ(recorder->Errors.size(), 1u);
    broken = false;
    DrawUntilComplete(stage);
    EXPECT_TRUE(stage.Mapper->IsConverged());
    EXPECT_EQ(stage.Mapper->GetNumberOfFailedBricks(), 0u);
    EXPECT_TRUE(AreImagesIdentical(stage.Accumulator(), reference));
  }
}

namespace
{

/// A pyramid file, and a stage that draws it through the reader and the pipeline.
class FileScene
{
public:
  FileScene()
  {
    teravox::testing::ArrayVoxelReader voxels(
      teravox::testing::Describe({ 96, 80, 112 }, ScalarType::UInt16));
    voxels.GenerateMixed(5);
    PyramidWriterOptions options;
    options.BrickSize = 16;
    const auto report = PyramidWriter::Write(this->Name(), voxels, options);
    EXPECT_TRUE(report.Ok()) << report.GetStatus().Message();
  }

  std::string Name() const { return this->Folder.File("faulty.h5"); }

  /// The reader has opened the file; no brick has been read.
  void Show(Stage& stage)
  {
    this->Reader = vtkSmartPointer<vtkHDF5PyramidReader>::New();
    this->Reader->SetFileName(this->Name().c_str());
    this->Reader->SetBrickSize(16);
    this->Reader->Update();
    stage.Mapper->SetInputConnection(this->Reader->GetOutputPort());
    stage.SetTransfer(MakeTransfer(OpacityShape::Ramp, 0, 110));
    stage.Look({ 1, 0.4, 0.3 });
  }

  std::vector<float> Reference()
  {
    Stage stage(64, 64);
    this->Show(stage);
    const std::vector<float> picture = stage.Draw();
    EXPECT_TRUE(stage.Mapper->IsConverged());
    EXPECT_FALSE(IsEmpty(picture));
    return picture;
  }

  DiskRule Rule(DiskRule::Fault kind) const
  {
    DiskRule rule;
    rule.File = "faulty.h5";
    rule.Kind = kind;
    rule.Errno = EIO;
    return rule;
  }

private:
  teravox::testing::TemporaryFolder Folder;
  vtkSmartPointer<vtkHDF5PyramidReader> Reader;
};

struct Faultless
{
  ~Faultless() { EndDiskFaults(); }
};

} // namespace

TEST(Faults, ADiskThatFailsWhileItIsDrawnFrom)
{
  FileScene scene;
  const std::vector<float> reference = scene.Reference();
  for (const int skip : { 0, 3, 20 })
  {
    Stage stage(64, 64);
    scene.Show(stage);
    const Faultless faultless;
    vtkNew<ErrorRecorder> recorder;
    recorder->Observe(stage.Mapper);
    FailureCounter failures(stage.Mapper);
    DiskRule rule = scene.Rule(DiskRule::Fault::Error);
    rule.Skip = skip;
    BeginDiskFaults(rule);
    stage.Draw();
    EXPECT_GT(DiskOperationsMet(), skip);
    EXPECT_FALSE(stage.Mapper->IsConverged()) << skip;
    EXPECT_EQ(recorder->Errors.size(), 1u);
    EXPECT_GT(failures.Events.size(), 0u);
    for (const auto& event : failures.Events)
    {
      EXPECT_EQ(event.second, 1) << event.first;
      EXPECT_NE(event.first.find("faulty.h5"), std::string::npos) << event.first;
    }
    EndDiskFaults();
    stage.Mapper->SetFailureRetryInterval(1e-6);
    EXPECT_TRUE(AreImagesIdentical(stage.Draw(), reference)) << skip;
    EXPECT_TRUE(stage.Mapper->IsConverged());
  }
}

TEST(Faults, ADiskThatStallsWhileItIsDrawnFrom)
{
  FileScene scene;
  const std::vector<float> reference = scene.Reference();
  const Faultless faultless;
  {
    Stage stage(64, 64);
    scene.Show(stage);
    DiskRule rule = scene.Rule(DiskRule::Fault::Stall);
    rule.Milliseconds = 2000;
    rule.Skip = 4;
    rule.Count = 1;
    BeginDiskFaults(rule);
    EXPECT_TRUE(AreImagesIdentical(stage.Draw(), reference));
    EXPECT_TRUE(stage.Mapper->IsConverged());
    EXPECT_GT(DiskOperationsMet(), 5);
  }
  Stage stage(64, 64);
  scene.Show(stage);
  BeginDiskFaults(scene.Rule(DiskRule::Fault::Stall));
  const Rescue rescue([] { EndDiskFaults(); });
  stage.Mapper->SetFrameTimeBudget(1e3);
  for (int frame = 0; frame < 10; ++frame)
  {
    EXPECT_TRUE(IsEmpty(stage.Draw()));
    EXPECT_FALSE(stage.Mapper->IsConverged());
  }
  EXPECT_GT(DiskOperationsStalled(), 0);
  EXPECT_FALSE(rescue.Late());
  EndDiskFaults();
  DrawUntilComplete(stage);
  EXPECT_TRUE(AreImagesIdentical(stage.Accumulator(), reference));
}

TEST(Faults, AFileThatIsTruncatedWhileItIsDrawnFrom)
{
  FileScene scene;
  const std::vector<float> reference = scene.Reference();
  std::ifstream in(scene.Name(), std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  Stage stage(64, 64);
  scene.Show(stage);
  vtkNew<ErrorRecorder> recorder;
  recorder->Observe(stage.Mapper);
  std::filesystem::resize_file(scene.Name(), bytes.size() / 3);
  stage.Draw();
  EXPECT_FALSE(stage.Mapper->IsConverged());
  EXPECT_EQ(recorder->Errors.size(), 1u);
  std::ofstream(scene.Name(), std::ios::binary) << bytes;
  stage.Mapper->RetryFailedBricks();
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), reference));
  EXPECT_TRUE(stage.Mapper->IsConverged());
}

namespace
{

PFNGLSHADERSOURCEPROC GoodShaderSource = nullptr;
PFNGLTEXSTORAGE3DPROC GoodTexStorage3D = nullptr;
double LargestTexture = 0; // in texels

void BreakShaderSource(
  GLuint shader, GLsizei count, const GLchar* const* texts, const GLint* lengths)
{
  const std::string text = texts[0];
  if (text.find("TERAVOX") == std::string::npos)
  {
    GoodShaderSource(shader, count, texts, lengths);
    return;
  }
  const std::string broken = text + "\n#error injected\n";
  const GLchar* start = broken.c_str();
  GoodShaderSource(shader, 1, &start, nullptr);
}

// A texture of a negative size is an error that allocates nothing, as one that is too large is.
void LimitTexStorage3D(
  GLenum target, GLsizei levels, GLenum format, GLsizei width, GLsizei height, GLsizei depth)
{
  const bool fits = double(width) * double(height) * double(depth) <= LargestTexture;
  GoodTexStorage3D(target, levels, format, fits ? width : -1, height, depth);
}

} // namespace

TEST(Faults, AShaderThatDoesNotCompile)
{
  const std::vector<float>& reference = Reference();
  Stage stage(64, 64);
  stage.SetSource(Blobs());
  Furnish(stage);
  vtkNew<ErrorRecorder> recorder;
  recorder->Observe(stage.Mapper);
  stage.Volume->VisibilityOff();
  stage.Window->Render(); // the loader of OpenGL's functions is there
  stage.Volume->VisibilityOn();
  GoodShaderSource = glShaderSource;
  glShaderSource = &BreakShaderSource;
  for (int frame = 0; frame < 3; ++frame)
  {
    stage.Window->Render();
    EXPECT_FALSE(stage.Mapper->IsConverged());
  }
  glShaderSource = GoodShaderSource;
  ASSERT_EQ(recorder->Errors.size(), 1u);
  EXPECT_NE(recorder->Errors[0].find("injected"), std::string::npos) << recorder->Errors[0];
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), reference));
  EXPECT_EQ(recorder->Errors.size(), 1u);
}

// A budget is no promise of the driver: the atlas becomes smaller until it fits, and where nothing
// fits, that is said.
TEST(Faults, ADriverWithoutMemory)
{
  if (TestedMarcher() == vtkOutOfCoreVolumeMapper::MARCHER_NATIVE)
  {
    GTEST_SKIP() << "the native marcher's memory isn't the driver's";
  }
  const std::vector<float>& reference = Reference();
  Stage stage(64, 64);
  stage.SetSource(Blobs());
  Furnish(stage);
  stage.Mapper->SetGPUMemoryBudget(64 << 20);
  stage.Draw();
  const vtkTypeUInt64 slots = stage.Mapper->GetNumberOfSlots();
  vtkNew<ErrorRecorder> recorder;
  recorder->Observe(stage.Mapper);
  GoodTexStorage3D = glTexStorage3D;
  glTexStorage3D = &LimitTexStorage3D;
  LargestTexture = 1000000;
  stage.Mapper->SetGPUMemoryBudget(65 << 20);
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), reference));
  EXPECT_TRUE(stage.Mapper->IsConverged());
  EXPECT_TRUE(recorder->Errors.empty());
  EXPECT_LT(stage.Mapper->GetNumberOfSlots(), slots);
  LargestTexture = 0;
  stage.Mapper->SetGPUMemoryBudget(66 << 20);
  for (int frame = 0; frame < 3; ++frame)
  {
    stage.Window->Render();
    EXPECT_FALSE(stage.Mapper->IsConverged());
  }
  glTexStorage3D = GoodTexStorage3D;
  EXPECT_EQ(recorder->Errors.size(), 1u);
  EXPECT_TRUE(AreImagesIdentical(stage.Draw(), reference));
  EXPECT_EQ(stage.Mapper->GetNumberOfSlots(), slots);
}
