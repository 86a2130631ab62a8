# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""vtkProgressiveRefinement in the event loop of a window on the screen, with its own timers.

The first picture refines until it is complete, though a mouse drags meanwhile; then it drags again,
and the picture refines once more. No other call asks for a frame than the first Render().
"""
import sys

import vtk
import teravox

source = teravox.vtkProceduralVolumeSource()
source.SetDimensions(512, 512, 512)
source.SetBrickSize(16)  # many bricks, one after the other: more than a frame waits for
source.SetFunctionName("marschner-lobb")
mapper = teravox.vtkOutOfCoreVolumeMapper()
mapper.SetInputConnection(source.GetOutputPort())
mapper.SetNumberOfLoaderThreads(1)
mapper.SetGPUMemoryBudget(256 << 20)
mapper.SetHostMemoryBudget(256 << 20)
volume = vtk.vtkVolume()
volume.SetMapper(mapper)
teravox.vtkOutOfCoreTransferFunction.MakeAutomatic(source.GetBrickSource(), volume.GetProperty())
renderer = vtk.vtkRenderer()
renderer.AddVolume(volume)
window = vtk.vtkRenderWindow()
window.SetSize(160, 120)
window.AddRenderer(renderer)
interactor = vtk.vtkRenderWindowInteractor()
interactor.SetRenderWindow(window)
interactor.SetInteractorStyle(vtk.vtkInteractorStyleTrackballCamera())
interactor.Initialize()

log = []
refinement = teravox.vtkProgressiveRefinement()
refinement.SetInteractor(interactor)
names = {
    refinement.CompleteEvent: "complete",
    refinement.CancelledEvent: "cancelled",
    refinement.TimedOutEvent: "timed out",
    refinement.IncompleteEvent: "incomplete",
}


def drag():
    """A drag of the mouse, as the window would tell it."""
    interactor.SetEventInformation(60, 60, 0, 0)
    interactor.LeftButtonPressEvent()
    for step in range(3):
        interactor.SetEventInformation(70 + 10 * step, 62, 0, 0)
        interactor.MouseMoveEvent()
    renderer.GetActiveCamera().Zoom(2)  # finer bricks
    interactor.LeftButtonReleaseEvent()


def on_timer(_, __):
    # Mice move in the middle of refining, too. (A timer of its own: those of refinement aren't
    # seen here.)
    if "dragged early" not in log:
        log.append("dragged early")
        drag()
    elif "complete" in log and "dragged again" not in log:
        log.append("dragged again")
        drag()


def on_frame(_, __):
    log.append("frame")


def on_complete():
    assert mapper.IsConverged()
    if log.count("complete") == 1:
        frames_before.append(refinement.GetNumberOfFrames())
        interactor.CreateOneShotTimer(1)
    elif "dragged again" in log:
        interactor.TerminateApp()


def on_event(name):
    log.append(name)
    if name == "complete":
        on_complete()
    elif name == "timed out":
        interactor.TerminateApp()


frames_before = []
for number, name in names.items():
    refinement.AddObserver(number, lambda _, __, name=name: on_event(name))
refinement.SetTimeout(60)
window.AddObserver("EndEvent", on_frame)
interactor.AddObserver("TimerEvent", on_timer)
assert not window.GetOffScreenRendering()
renderer.ResetCamera()
window.Render()
assert not mapper.IsConverged(), "the first picture is complete: nothing to refine"
interactor.CreateOneShotTimer(1)
interactor.Start()

print(log, "frames:", refinement.GetNumberOfFrames())
assert log.count("complete") == 2 and "dragged again" in log
assert "dragged early" in log and "cancelled" in log
assert frames_before[0] > 0 and refinement.GetNumberOfFrames() > frames_before[0]
assert refinement.GetState() == refinement.COMPLETE and mapper.IsConverged()
sys.exit(0)
