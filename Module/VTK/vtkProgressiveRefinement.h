// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class vtkProgressiveRefinement
 * @brief renders a window again until the pictures of out-of-core mappers are complete
 *
 * A frame of an interactive window shows the best that is at hand (vtkOutOfCoreVolumeMapper), and
 * each frame that follows refines it. This helper asks for those frames: attached to an interactor
 * it waits for the end of each frame and, while a mapper that drew into it hasn't converged, sets a
 * one-shot timer of the interactor and renders when that fires. Nothing waits, nothing polls: with
 * a complete picture no timer is left. Without this helper a window refines with each render.
 *
 * A button, a wheel or a key cancels it at once (a frame under way is aborted, where the window
 * knows that events are pending); while a button is held nothing is refined. The first frame after
 * that begins anew.
 *
 * It finds mappers wherever they are, also inside vtkSmartVolumeMapper.
 *
 * Thread: like the interactor, used by the render thread only.
 */
#pragma once

#include "vtkObject.h"
#include "vtkRenderingOutOfCoreModule.h" // for the export macro

#include <memory> // for std::unique_ptr

class vtkRenderWindowInteractor;

class VTKRENDERINGOUTOFCORE_EXPORT vtkProgressiveRefinement : public vtkObject
{
public:
  static vtkProgressiveRefinement* New();
  vtkTypeMacro(vtkProgressiveRefinement, vtkObject);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum Events
  {
    CompleteEvent = 72320, ///< each mapper has converged
    CancelledEvent,        ///< an interaction came before that
    TimedOutEvent,         ///< Timeout has passed before that
    IncompleteEvent        ///< nothing is missing any more, but some bricks couldn't be read
  };

  enum StateType
  {
    IDLE = 0,      ///< no frame with such mappers was drawn, or an interaction goes on
    REFINING = 1,  ///< a timer is set, or its frame is being drawn
    COMPLETE = 2,  ///< the last frame is complete
    TIMED_OUT = 3, ///< see SetTimeout()
    INCOMPLETE = 4 ///< as good as the readable bricks allow
  };

  ///@{
  /**
   * Whose window is refined; it needs a render window by then. Not owned. Null (default) detaches.
   */
  void SetInteractor(vtkRenderWindowInteractor* interactor);
  vtkRenderWindowInteractor* GetInteractor();
  ///@}

  ///@{
  /**
   * Off: nothing is rendered, the state is IDLE. Default on.
   */
  void SetEnabled(vtkTypeBool enabled);
  vtkGetMacro(Enabled, vtkTypeBool);
  void EnabledOn() { this->SetEnabled(1); }
  void EnabledOff() { this->SetEnabled(0); }
  ///@}

  ///@{
  /**
   * Milliseconds from the end of a frame to the next one, 1...60000. Default 10. Where no brick has
   * come meanwhile the pause doubles, up to 20 times as long.
   */
  vtkSetClampMacro(Interval, int, 1, 60000);
  vtkGetMacro(Interval, int);
  ///@}

  ///@{
  /**
   * Seconds, from the last frame that wasn't drawn by this helper, after which no more frames are
   * drawn. Default 0: none.
   */
  vtkSetClampMacro(Timeout, double, 0.0, 1.0e9);
  vtkGetMacro(Timeout, double);
  ///@}

  /** A StateType. */
  vtkGetMacro(State, int);
  /** Frames that this helper has drawn, since it was made. */
  vtkGetMacro(NumberOfFrames, vtkIdType);

protected:
  vtkProgressiveRefinement();
  ~vtkProgressiveRefinement() override;

  vtkTypeBool Enabled = 1;
  int Interval = 10;
  double Timeout = 0;
  int State = IDLE;
  vtkIdType NumberOfFrames = 0;

private:
  vtkProgressiveRefinement(const vtkProgressiveRefinement&) = delete;
  void operator=(const vtkProgressiveRefinement&) = delete;

  void Detach();
  void DropTimer();
  void Cancel();
  void Finish(int state, unsigned long event);
  void OnFrameStart(vtkObject*, unsigned long, void*);
  void OnFrameEnd(vtkObject*, unsigned long, void*);
  void OnAbortCheck(vtkObject*, unsigned long, void*);
  void OnInteraction(vtkObject*, unsigned long, void*);
  void OnRelease(vtkObject*, unsigned long, void*);
  bool OnTimer(vtkObject*, unsigned long, void*);
  void Consider();
  void Restart();

  class vtkInternals;
  std::unique_ptr<vtkInternals> Internals;
};
