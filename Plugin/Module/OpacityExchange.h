// SPDX-FileCopyrightText: Teravox contributors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "vtkType.h"

#include <array>
#include <optional>

class ProcessShare;
class vtkOutOfCoreVolumeMapper;
class vtkPVRenderView;
class vtkProp3D;

/// Processes that draw blocks of a volume learn from each other's opacity what isn't to be seen of
/// their own, before ParaView's compositing. Thread: used by one thread.
class OpacityExchange
{
public:
  /// Before a frame, on each process that renders the view, in the same order: collective over
  /// them. Where all are `willing` (this frame is to be complete, and the user wants it), blocks
  /// are suspected to be hidden by the pictures of the frame before, which are of any view; the
  /// view's window is rendered, each process its block; and by these pictures, all of the present
  /// view, the mapper is told what is hidden (vtkOutOfCoreVolumeMapper::ConfirmHidden()). All take
  /// the first process's camera. A process whose picture isn't complete, or is of another view,
  /// hides nothing. The mapper draws everything where the frame that follows is of another view.
  /// Else nothing is hidden, and nothing rendered. Nothing at all is done by a single process, or
  /// where no blocks are drawn.
  void Before(vtkPVRenderView* view, ProcessShare& share, vtkProp3D* prop,
    vtkOutOfCoreVolumeMapper* mapper, bool willing);

  /// Whether the last frame was drawn without what others hide.
  bool LeavesOut() const { return this->Confirmed && this->Proven; }

private:
  // The camera's matrices and the size of the window.
  using View = std::array<double, 34>;
  static View ViewOf(vtkPVRenderView* view);

  std::optional<View> Confirmed; // the view of the last exchange
  vtkMTimeType Changed = 0;      // when what was drawn then was changed last
  bool Proven = false;           // something was hidden in it
};
