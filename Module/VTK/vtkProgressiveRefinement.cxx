// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "vtkProgressiveRefinement.h"

#include "RefinementBoard.h"

#include <algorithm>
#include <chrono>
#include <vector>
#include <vtkCallbackCommand.h>
#include <vtkCommand.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkRenderWindow.h>
#include <vtkRenderWindowInteractor.h>
#include <vtkWeakPointer.h>

vtkStandardNewMacro(vtkProgressiveRefinement);

namespace
{

constexpr float BeforeOthers = 1000; // priority of the observers
constexpr int LongestPause = 20;     // times Interval
// A mapper halves what it had loosened in each frame, by at most a factor of 4096; this many
// frames without a missing brick are exact.
constexpr int FramesUntilExact = 14;

double Now()
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

} // namespace

class vtkProgressiveRefinement::vtkInternals
{
public:
  vtkWeakPointer<vtkRenderWindowInteractor> Interactor;
  vtkWeakPointer<vtkRenderWindow> Window;
  const void* Board = nullptr; // the window's name, also after its end
  std::vector<unsigned long> OfInteractor;
  std::vector<unsigned long> OfWindow;
  int Timer = 0; // 0: none
  // Fired, and known to the interactor still: destroying it in its own event isn't safe.
  int Spent = 0;
  int Held = 0;           // buttons that are down
  bool Drawing = false;   // a frame of this helper
  double Began = 0;       // the last frame that was another's
  int Pause = 0;          // times Interval
  int WithoutMissing = 0; // frames in a row
  std::uint64_t Loaded = 0;
};

vtkProgressiveRefinement::vtkProgressiveRefinement()
  : Internals(std::make_unique<vtkInternals>())
{
}

vtkProgressiveRefinement::~vtkProgressiveRefinement()
{
  this->Detach();
}

void vtkProgressiveRefinement::Detach()
{
  vtkInternals& in = *this->Internals;
  this->DropTimer();
  if (in.Interactor)
  {
    if (in.Spent != 0)
    {
      in.Interactor->DestroyTimer(in.Spent);
    }
    for (const unsigned long tag : in.OfInteractor)
    {
      in.Interactor->RemoveObserver(tag);
    }
  }
  if (in.Window)
  {
    for (const unsigned long tag : in.OfWindow)
    {
      in.Window->RemoveObserver(tag);
    }
  }
  if (in.Board)
  {
    teravox::RefinementBoard::Close(in.Board);
  }
  in = {};
  this->State = IDLE;
}

void vtkProgressiveRefinement::SetInteractor(vtkRenderWindowInteractor* interactor)
{
  vtkInternals& in = *this->Internals;
  if (in.Interactor == interactor &&
    in.Window == (interactor ? interactor->GetRenderWindow() : nullptr))
  {
    return;
  }
  this->Detach();
  this->Modified();
  if (!interactor)
  {
    return;
  }
  vtkRenderWindow* window = interactor->GetRenderWindow();
  if (!window)
  {
    vtkErrorMacro("The interactor has no render window yet; give it one first.");
    return;
  }
  in.Interactor = interactor;
  in.Window = window;
  in.Board = window;
  teravox::RefinementBoard::Open(in.Board);
  using Self = vtkProgressiveRefinement;
  // Passive: told of events also while an interactor style keeps them to itself (GrabFocus).
  vtkNew<vtkCallbackCommand> pressed;
  pressed->SetClientData(this);
  pressed->SetPassiveObserver(1);
  pressed->SetCallback([](vtkObject* caller, unsigned long event, void* self, void* data)
    { static_cast<Self*>(self)->OnInteraction(caller, event, data); });
  vtkNew<vtkCallbackCommand> released;
  released->SetClientData(this);
  released->SetPassiveObserver(1);
  released->SetCallback([](vtkObject* caller, unsigned long event, void* self, void* data)
    { static_cast<Self*>(self)->OnRelease(caller, event, data); });
  for (const unsigned long event :
    { vtkCommand::LeftButtonPressEvent, vtkCommand::MiddleButtonPressEvent,
      vtkCommand::RightButtonPressEvent, vtkCommand::MouseWheelForwardEvent,
      vtkCommand::MouseWheelBackwardEvent, vtkCommand::MouseWheelLeftEvent,
      vtkCommand::MouseWheelRightEvent, vtkCommand::KeyPressEvent, vtkCommand::StartPinchEvent,
      vtkCommand::StartRotateEvent, vtkCommand::StartPanEvent })
  {
    in.OfInteractor.push_back(interactor->AddObserver(event, pressed, BeforeOthers));
  }
  for (const unsigned long event : { vtkCommand::LeftButtonReleaseEvent,
         vtkCommand::MiddleButtonReleaseEvent, vtkCommand::RightButtonReleaseEvent })
  {
    in.OfInteractor.push_back(interactor->AddObserver(event, released, BeforeOthers));
  }
  in.OfInteractor.push_back(
    interactor->AddObserver(vtkCommand::TimerEvent, this, &Self::OnTimer, BeforeOthers));
  in.OfWindow.push_back(
    window->AddObserver(vtkCommand::StartEvent, this, &Self::OnFrameStart, BeforeOthers));
  in.OfWindow.push_back(window->AddObserver(vtkCommand::EndEvent, this, &Self::OnFrameEnd));
  in.OfWindow.push_back(
    window->AddObserver(vtkCommand::AbortCheckEvent, this, &Self::OnAbortCheck));
}

vtkRenderWindowInteractor* vtkProgressiveRefinement::GetInteractor()
{
  return this->Internals->Interactor;
}

void vtkProgressiveRefinement::SetEnabled(vtkTypeBool enabled)
{
  enabled = enabled ? 1 : 0;
  if (this->Enabled == enabled)
  {
    return;
  }
  this->Enabled = enabled;
  this->Modified();
  if (enabled)
  {
    this->Restart();
  }
  else
  {
    this->Cancel();
  }
}

void vtkProgressiveRefinement::DropTimer()
{
  vtkInternals& in = *this->Internals;
  if (in.Timer != 0 && in.Interactor)
  {
    in.Interactor->DestroyTimer(in.Timer);
  }
  in.Timer = 0;
}

void vtkProgressiveRefinement::Finish(int state, unsigned long event)
{
  const bool news = this->State != state;
  this->State = state;
  if (news)
  {
    this->InvokeEvent(event, nullptr);
  }
}

void vtkProgressiveRefinement::Cancel()
{
  this->DropTimer();
  const bool refining = this->State == REFINING;
  this->State = IDLE;
  if (refining)
  {
    this->InvokeEvent(CancelledEvent, nullptr);
  }
}

void vtkProgressiveRefinement::OnFrameStart(vtkObject*, unsigned long, void*)
{
  teravox::RefinementBoard::Clear(this->Internals->Board);
}

void vtkProgressiveRefinement::OnFrameEnd(vtkObject*, unsigned long, void*)
{
  vtkInternals& in = *this->Internals;
  if (!in.Drawing)
  {
    in.Began = Now();
    in.Pause = 1;
    in.WithoutMissing = 0;
  }
  std::uint64_t missing = 0;
  std::uint64_t loaded = 0;
  for (const teravox::DrawnPicture& picture : teravox::RefinementBoard::Read(in.Board))
  {
    missing += picture.Missing;
    loaded += picture.BricksLoaded;
  }
  in.WithoutMissing = missing == 0 ? in.WithoutMissing + 1 : 0;
  in.Pause = missing == 0 || loaded != in.Loaded ? 1 : std::min(2 * in.Pause, LongestPause);
  in.Loaded = loaded;
  this->Consider();
}

// What the frame that has ended calls for.
void vtkProgressiveRefinement::Consider()
{
  vtkInternals& in = *this->Internals;
  this->DropTimer();
  if (!this->Enabled || !in.Interactor || in.Held > 0)
  {
    return;
  }
  const std::vector<teravox::DrawnPicture> pictures = teravox::RefinementBoard::Read(in.Board);
  if (pictures.empty())
  {
    this->State = IDLE;
    return;
  }
  bool converged = true;
  bool readable = true;
  for (const teravox::DrawnPicture& picture : pictures)
  {
    converged = converged && picture.Converged;
    readable = readable && (picture.Converged || !picture.Failed);
  }
  if (converged)
  {
    this->Finish(COMPLETE, CompleteEvent);
  }
  else if (!readable && in.WithoutMissing >= FramesUntilExact)
  {
    this->Finish(INCOMPLETE, IncompleteEvent);
  }
  else if (this->Timeout > 0 && Now() - in.Began > this->Timeout)
  {
    this->Finish(TIMED_OUT, TimedOutEvent);
  }
  else
  {
    this->State = REFINING;
    in.Timer = in.Interactor->CreateOneShotTimer(
      static_cast<unsigned long>(this->Interval) * static_cast<unsigned long>(in.Pause));
  }
}

// The same without a new frame: its time begins anew.
void vtkProgressiveRefinement::Restart()
{
  this->Internals->Began = Now();
  this->Consider();
}

// A frame under way gives way to what the user does.
void vtkProgressiveRefinement::OnAbortCheck(vtkObject*, unsigned long, void*)
{
  vtkInternals& in = *this->Internals;
  if (in.Drawing && in.Window && in.Window->GetEventPending() != 0)
  {
    in.Window->SetAbortRender(1);
  }
}

void vtkProgressiveRefinement::OnInteraction(vtkObject*, unsigned long event, void*)
{
  vtkInternals& in = *this->Internals;
  const bool held = event == vtkCommand::LeftButtonPressEvent ||
    event == vtkCommand::MiddleButtonPressEvent || event == vtkCommand::RightButtonPressEvent;
  in.Held += held ? 1 : 0;
  this->Cancel();
  if (!held)
  {
    // Wheels, keys and gestures needn't lead to a frame.
    this->Restart();
  }
}

void vtkProgressiveRefinement::OnRelease(vtkObject*, unsigned long, void*)
{
  vtkInternals& in = *this->Internals;
  if (in.Held > 0 && --in.Held == 0)
  {
    this->Restart();
  }
}

bool vtkProgressiveRefinement::OnTimer(vtkObject*, unsigned long, void* data)
{
  vtkInternals& in = *this->Internals;
  if (in.Timer == 0 || !data || *static_cast<int*>(data) != in.Timer)
  {
    return false;
  }
  if (in.Spent != 0)
  {
    in.Interactor->DestroyTimer(in.Spent);
  }
  in.Spent = in.Timer;
  in.Timer = 0;
  if (!this->Enabled || !in.Window || in.Held > 0)
  {
    return true;
  }
  // With all the time that a still picture has: a mapper that hurries never converges.
  const double rate = in.Window->GetDesiredUpdateRate();
  in.Window->SetDesiredUpdateRate(in.Interactor->GetStillUpdateRate());
  in.Drawing = true;
  ++this->NumberOfFrames;
  in.Interactor->Render();
  in.Drawing = false;
  if (in.Window)
  {
    in.Window->SetDesiredUpdateRate(rate);
  }
  return true; // interactor styles take any timer for their own
}

void vtkProgressiveRefinement::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Interactor: " << this->Internals->Interactor << "\n"
     << indent << "Enabled: " << this->Enabled << "\n"
     << indent << "Interval: " << this->Interval << "\n"
     << indent << "Timeout: " << this->Timeout << "\n"
     << indent << "State: " << this->State << "\n"
     << indent << "NumberOfFrames: " << this->NumberOfFrames << "\n";
}
