// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
//
// vtkProgressiveRefinement, with an interactor whose events and timers the test fires itself.
#include "FaultyBrickSource.h"
#include "Scene.h"
#include "vtkOutOfCoreVolumeMapper.h"
#include "vtkProgressiveRefinement.h"

#include <atomic>
#include <chrono>
#include <gtest/gtest.h>
#include <map>
#include <thread>
#include <vector>
#include <vtkCallbackCommand.h>
#include <vtkCommand.h>
#include <vtkGenericRenderWindowInteractor.h>
#include <vtkImageData.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>

using namespace teravox;
using namespace teravox::test;

namespace
{

// Timers that are set and not destroyed, and how often each event came.
class Script
{
public:
  explicit Script(vtkRenderWindow* window)
  {
    this->Interactor->SetInteractorStyle(nullptr);
    this->Interactor->SetRenderWindow(window);
    this->Interactor->SetEnableRender(true);
    this->Interactor->AddObserver(vtkCommand::CreateTimerEvent, this, &Script::OnCreate);
    this->Interactor->AddObserver(vtkCommand::DestroyTimerEvent, this, &Script::OnDestroy);
    this->Interactor->AddObserver(vtkCommand::TimerEvent, this, &Script::OnForeignTimer, -1.0f);
    this->Interactor->Initialize();
    for (const unsigned long event :
      { vtkProgressiveRefinement::CompleteEvent, vtkProgressiveRefinement::CancelledEvent,
        vtkProgressiveRefinement::TimedOutEvent, vtkProgressiveRefinement::IncompleteEvent })
    {
      this->Refinement->AddObserver(event, this, &Script::OnEvent);
    }
    this->Refinement->SetInteractor(this->Interactor);
  }
  ~Script() { this->Refinement->SetInteractor(nullptr); }
  Script(const Script&) = delete;
  Script& operator=(const Script&) = delete;

  // Lets the next timer pass; false if none is set.
  bool Tick()
  {
    if (this->Pending.empty())
    {
      return false;
    }
    const int platform = this->Pending.begin()->first;
    this->Durations.push_back(this->Pending.begin()->second);
    this->Pending.erase(this->Pending.begin());
    int id = this->Interactor->GetVTKTimerId(platform);
    this->Interactor->InvokeEvent(vtkCommand::TimerEvent, &id);
    return true;
  }
  // Ticks until no timer is left; the number of ticks. Frames are given time for bricks to come.
  int Run(int most)
  {
    int ticks = 0;
    while (ticks < most && this->Tick())
    {
      ++ticks;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return ticks;
  }
  int Count(unsigned long event) { return this->Events[event]; }

  vtkNew<vtkGenericRenderWindowInteractor> Interactor;
  vtkNew<vtkProgressiveRefinement> Refinement;
  std::map<int, int> Pending; // platform id, milliseconds
  std::vector<int> Durations;
  int ForeignTimers = 0;

private:
  void OnCreate(vtkObject*, unsigned long, void*)
  {
    ++this->Last;
    this->Pending[this->Last] = this->Interactor->GetTimerEventDuration();
    this->Interactor->SetTimerEventPlatformId(this->Last);
  }
  void OnDestroy(vtkObject*, unsigned long, void*)
  {
    this->Pending.erase(this->Interactor->GetTimerEventPlatformId());
  }
  void OnForeignTimer(vtkObject*, unsigned long, void*) { ++this->ForeignTimers; }
  void OnEvent(vtkObject*, unsigned long event, void*) { ++this->Events[event]; }

  int Last = 0;
  std::map<unsigned long, int> Events;
};

std::shared_ptr<BrickSource> Blobs()
{
  ImageOptions options;
  options.Dimensions = { 96, 80, 112 };
  return SourceOfImage(MakeImage(options), 16, false);
}

// While it is closed no read of a level finer than the coarsest ends: that one every frame waits
// for.
class GatedSource : public BrickSource
{
public:
  explicit GatedSource(std::shared_ptr<BrickSource> inner)
    : Inner(std::move(inner))
  {
  }
  const VolumeInfo& Info() const override { return this->Inner->Info(); }
  Result<BrickPointer> ReadBrick(const BrickKey& key) override
  {
    while (this->Closed && key.Level + 1 < this->Info().Layout.NumberOfLevels())
    {
      int passes = this->Passes;
      if (passes > 0 && this->Passes.compare_exchange_strong(passes, passes - 1))
      {
        break;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return this->Inner->ReadBrick(key);
  }
  Result<std::vector<ValueRange>> ReadRanges(const BrickKey& first, const Int3& count) override
  {
    return this->Inner->ReadRanges(first, count);
  }
  void CloseGate() { this->Closed = true; }
  /// One read ends all the same.
  void LetOneThrough() { ++this->Passes; }
  void OpenGate() { this->Closed = false; }

private:
  const std::shared_ptr<BrickSource> Inner;
  std::atomic<bool> Closed{ false };
  std::atomic<int> Passes{ 0 };
};

struct Scene
{
  Scene()
    : Shown(64, 64)
    , Faulty(std::make_shared<FaultyBrickSource>(Blobs()))
    , Source(std::make_shared<GatedSource>(this->Faulty))
  {
    this->Shown.SetSource(this->Source);
    this->Shown.SetTransfer(MakeTransfer(OpacityShape::Ramp));
    this->Shown.Look({ 1, 0.4, 0.3 });
    this->Shown.Mapper->SetFrameTimeBudget(1e5);
  }
  ~Scene() { this->Source->OpenGate(); }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  Stage Shown;
  std::shared_ptr<FaultyBrickSource> Faulty;
  std::shared_ptr<GatedSource> Source;
};

constexpr int Many = 3000;

} // namespace

TEST(Refinement, EndsWithTheConvergedPictureAndWithoutATimer)
{
  Scene reference;
  reference.Shown.Mapper->SetFrameTimeBudget(0);
  const std::vector<float> exact = reference.Shown.Draw();
  ASSERT_TRUE(reference.Shown.Mapper->IsConverged());

  Scene scene;
  Script script(scene.Shown.Window);
  EXPECT_TRUE(script.Pending.empty()) << "nothing has been drawn";
  EXPECT_EQ(script.Refinement->GetState(), vtkProgressiveRefinement::IDLE);
  scene.Shown.Window->Render();
  ASSERT_FALSE(scene.Shown.Mapper->IsConverged());
  EXPECT_EQ(script.Refinement->GetState(), vtkProgressiveRefinement::REFINING);
  EXPECT_EQ(script.Pending.size(), 1u);
  const int ticks = script.Run(Many);
  EXPECT_GT(ticks, 0);
  EXPECT_EQ(script.Refinement->GetNumberOfFrames(), ticks);
  EXPECT_TRUE(scene.Shown.Mapper->IsConverged());
  EXPECT_TRUE(script.Pending.empty());
  EXPECT_EQ(script.Refinement->GetState(), vtkProgressiveRefinement::COMPLETE);
  EXPECT_EQ(script.Count(vtkProgressiveRefinement::CompleteEvent), 1);
  EXPECT_EQ(script.Count(vtkProgressiveRefinement::CancelledEvent), 0);
  EXPECT_EQ(script.ForeignTimers, 0) << "its timers are nobody else's";
  EXPECT_TRUE(AreImagesIdentical(scene.Shown.Accumulator(), exact));

  // Complete once more, after a change, is told once more; other timers pass.
  scene.Shown.Look({ -1, 0.4, 0.3 });
  scene.Shown.Window->Render();
  script.Run(Many);
  EXPECT_EQ(script.Refinement->GetState(), vtkProgressiveRefinement::COMPLETE);
  int foreign = 123456;
  script.Interactor->InvokeEvent(vtkCommand::TimerEvent, &foreign);
  EXPECT_EQ(script.ForeignTimers, 1);
}

TEST(Refinement, WithoutItEachRenderRefines)
{
  Scene scene;
  int renders = 0;
  do
  {
    scene.Shown.Window->Render();
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    ++renders;
  } while (!scene.Shown.Mapper->IsConverged() && renders < Many);
  EXPECT_TRUE(scene.Shown.Mapper->IsConverged());
  EXPECT_GT(renders, 1);
}

TEST(Refinement, IsCancelledByTheNextInteraction)
{
  Scene scene;
  scene.Source->CloseGate();
  Script script(scene.Shown.Window);
  scene.Shown.Window->Render();
  EXPECT_EQ(script.Run(3), 3);
  script.Interactor->InvokeEvent(vtkCommand::LeftButtonPressEvent, nullptr);
  EXPECT_TRUE(script.Pending.empty());
  EXPECT_EQ(script.Refinement->GetState(), vtkProgressiveRefinement::IDLE);
  EXPECT_EQ(script.Count(vtkProgressiveRefinement::CancelledEvent), 1);
  // Frames of the interaction itself set no timer, nor does the release of another button.
  scene.Shown.Window->Render();
  script.Interactor->InvokeEvent(vtkCommand::RightButtonPressEvent, nullptr);
  script.Interactor->InvokeEvent(vtkCommand::RightButtonReleaseEvent, nullptr);
  EXPECT_TRUE(script.Pending.empty());
  script.Interactor->InvokeEvent(vtkCommand::LeftButtonReleaseEvent, nullptr);
  EXPECT_EQ(script.Pending.size(), 1u);
  script.Interactor->InvokeEvent(vtkCommand::MouseWheelForwardEvent, nullptr);
  EXPECT_EQ(script.Count(vtkProgressiveRefinement::CancelledEvent), 2);
  EXPECT_EQ(script.Pending.size(), 1u) << "a wheel has no end that is told";
  scene.Source->OpenGate();
  script.Run(Many);
  EXPECT_EQ(script.Refinement->GetState(), vtkProgressiveRefinement::COMPLETE);
}

TEST(Refinement, PausesGrowWhileNothingComes)
{
  Scene scene;
  scene.Source->CloseGate();
  Script script(scene.Shown.Window);
  script.Refinement->SetInterval(7);
  scene.Shown.Window->Render();
  script.Run(12);
  ASSERT_EQ(script.Durations.size(), 12u);
  EXPECT_EQ(script.Durations.back(), 7 * 20);
  // One brick comes, others are missing still: at once short again.
  const vtkTypeUInt64 loaded = scene.Shown.Mapper->GetNumberOfBricksLoaded();
  scene.Source->LetOneThrough();
  for (int i = 0; i < Many && scene.Shown.Mapper->GetNumberOfBricksLoaded() == loaded; ++i)
  {
    script.Run(1);
  }
  EXPECT_EQ(scene.Shown.Mapper->GetNumberOfBricksLoaded(), loaded + 1);
  ASSERT_EQ(script.Pending.size(), 1u);
  EXPECT_EQ(script.Pending.begin()->second, 7);
  scene.Source->OpenGate();
  script.Run(Many);
  EXPECT_TRUE(scene.Shown.Mapper->IsConverged());
}

TEST(Refinement, TimesOut)
{
  Scene scene;
  scene.Source->CloseGate();
  Script script(scene.Shown.Window);
  script.Refinement->SetTimeout(0.03);
  scene.Shown.Window->Render();
  const int ticks = script.Run(Many);
  EXPECT_LT(ticks, Many);
  EXPECT_EQ(script.Refinement->GetState(), vtkProgressiveRefinement::TIMED_OUT);
  EXPECT_EQ(script.Count(vtkProgressiveRefinement::TimedOutEvent), 1);
  EXPECT_TRUE(script.Pending.empty());
  // The next frame of the program begins anew.
  scene.Source->OpenGate();
  script.Refinement->SetTimeout(0);
  scene.Shown.Window->Render();
  script.Run(Many);
  EXPECT_EQ(script.Refinement->GetState(), vtkProgressiveRefinement::COMPLETE);
}

TEST(Refinement, EndsWithBricksThatCantBeRead)
{
  Scene scene;
  scene.Faulty->SetFaults([](const BrickKey& key)
    { return key.Level == 0 && key.X == 2 && key.Y == 2 ? Fault::Status : Fault::None; });
  scene.Shown.Mapper->SetMaximumLevel(0);
  vtkNew<vtkCallbackCommand> silence;
  scene.Shown.Mapper->AddObserver(vtkCommand::ErrorEvent, silence);
  Script script(scene.Shown.Window);
  scene.Shown.Window->Render();
  EXPECT_LT(script.Run(Many), Many);
  EXPECT_GT(scene.Shown.Mapper->GetNumberOfFailedBricks(), 0u);
  EXPECT_EQ(script.Refinement->GetState(), vtkProgressiveRefinement::INCOMPLETE);
  EXPECT_EQ(script.Count(vtkProgressiveRefinement::IncompleteEvent), 1);
  EXPECT_EQ(script.Count(vtkProgressiveRefinement::CompleteEvent), 0);
}

TEST(Refinement, OffDetachedAndDestroyedItDrawsNothing)
{
  Scene scene;
  scene.Source->CloseGate();
  Script script(scene.Shown.Window);
  scene.Shown.Window->Render();
  script.Refinement->EnabledOff();
  EXPECT_TRUE(script.Pending.empty());
  scene.Shown.Window->Render();
  EXPECT_TRUE(script.Pending.empty());
  script.Refinement->EnabledOn();
  EXPECT_EQ(script.Pending.size(), 1u);
  {
    vtkNew<vtkProgressiveRefinement> second;
    second->SetInteractor(script.Interactor);
    scene.Shown.Window->Render();
    EXPECT_EQ(script.Pending.size(), 2u);
  }
  EXPECT_EQ(script.Pending.size(), 1u);
  script.Refinement->SetInteractor(nullptr);
  EXPECT_TRUE(script.Pending.empty());
  scene.Shown.Window->Render();
  EXPECT_TRUE(script.Pending.empty());
  EXPECT_EQ(script.Refinement->GetState(), vtkProgressiveRefinement::IDLE);
  scene.Source->OpenGate();
}

// Windows without such mappers are left alone.
TEST(Refinement, IdleWithoutOutOfCoreMappers)
{
  Scene scene;
  Script script(scene.Shown.Window);
  scene.Shown.Renderer->RemoveVolume(scene.Shown.Volume);
  scene.Shown.Window->Render();
  EXPECT_TRUE(script.Pending.empty());
  EXPECT_EQ(script.Refinement->GetState(), vtkProgressiveRefinement::IDLE);
}
