# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""What test_gui.py has ParaView's own program do: paraview --script=gui_scene.py.

The script opens a volume and ends; from then on only the program's event loop draws. A timer goes through the steps
of scenario(), each waiting for something that is to be seen. Pictures are taken from the X server's screen, and
the pointer is moved as a mouse does, by xdotool.

Environment: as support.py says; TERAVOX_SCREEN, the screen of Xvfb -fbdir.
"""
import os
import subprocess
import tempfile
import time
import traceback

import numpy as np
from paraview import simple as pv
from paraview.modules.vtkRemotingViews import vtkPVView
from support import REPRESENTATION, array_name, fact, path_of, pixels_of
from vtkmodules.vtkCommonCore import vtkOutputWindow

INTERACTIVE = 1  # frames per second: the view wishes more of interactive renders, less of still ones
PATIENCE = 45  # seconds for one step
OUTSIDE = (1275, 1015)  # of the program's window
started = time.monotonic()
messages = []  # errors and warnings of VTK's


def say(*words):
    print("%6.2f s" % (time.monotonic() - started), *words, flush=True)


def xdotool(*words):
    subprocess.run(["xdotool", *map(str, words)], check=True)


def screen():
    """The X server's screen, an XWD file of 32 bits per pixel: height x width x 3."""
    with open(os.environ["TERAVOX_SCREEN"], "rb") as file:
        data = file.read()
    header = np.frombuffer(data, ">u4", 25)
    start, height, stride, colors = header[0], header[5], header[12], header[19]
    assert header[11] == 32 and header[7] == 0, header
    pixels = np.frombuffer(data, "u1", stride * height, start + 12 * colors)
    return pixels.reshape(height, stride // 4, 4)[:, :, 2::-1].astype(int)


class View:
    """The 3-D view: its frames, and its place on the screen."""

    def __init__(self, view, display):
        self.view, self.display = view, display
        self.window, self.interactor = view.GetRenderWindow(), view.GetInteractor()
        self.frames = []
        self.corner = None  # of the view on the screen, by the last event of the pointer
        self.pointer = OUTSIDE
        self.pressed = False
        self.window.AddObserver("StartEvent", self.start)
        self.window.AddObserver("EndEvent", self.end)
        self.interactor.AddObserver("MouseMoveEvent", self.move)
        self.interactor.AddObserver("LeftButtonPressEvent", lambda *_: self.press(True))
        self.interactor.AddObserver("LeftButtonReleaseEvent", lambda *_: self.press(False))

    def start(self, *_):
        self.before = time.monotonic()

    def end(self, *_):
        frame = {"interactive": self.window.GetDesiredUpdateRate() >= INTERACTIVE,
                 "converged": fact(self.display, "Converged"), "seconds": time.monotonic() - self.before}
        self.frames.append(frame)

    def move(self, *_):
        x, y = self.interactor.GetEventPosition()
        self.corner = (self.pointer[0] - x, self.pointer[1] - (self.window.GetSize()[1] - 1 - y))
        self.moved = True

    def press(self, pressed):
        self.pressed = pressed

    def point(self, x, y):
        self.pointer, self.moved = (x, y), False
        xdotool("mousemove", x, y)

    def over(self, x, y):
        """Whether the pointer has come there. Where it enters a window, only its next motion is an event."""
        state = {"quiet": 0}

        def condition():
            state["quiet"] = state["quiet"] + 1 if self.moved else 0
            if not self.moved:
                self.point(x + (self.pointer == (x, y)), y)
            return state["quiet"] > 5  # ticks, in which all events came
        self.moved = False
        return condition

    def seen(self):
        """What the screen shows of the view."""
        (x, y), (width, height) = self.corner, self.window.GetSize()
        return screen()[y:y + height, x:x + width]

    def converged(self):
        return self.frames and self.frames[-1]["converged"] == 1

    def picture(self):
        """The pixels of SaveScreenshot: complete, whatever streams."""
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "picture.png")
            pv.SaveScreenshot(path, self.view, ImageResolution=self.window.GetSize())
            return pixels_of(path)[::-1]


def settled(view, steps=8):
    """Whether the screen shows a complete picture and has shown it for some ticks."""
    state = {"frames": -1, "ticks": 0, "seen": None}

    def condition():
        seen = view.seen()
        same = len(view.frames) == state["frames"] and np.array_equal(seen, state["seen"])
        state.update(frames=len(view.frames), seen=seen, ticks=state["ticks"] + 1 if same else 0)
        return view.converged() and state["ticks"] >= steps
    return condition


def assert_same(seen, picture, what):
    worst = np.abs(seen - picture).max()
    say("%s: the screen and the screenshot differ by %d/255" % (what, worst))
    assert seen.shape == picture.shape and worst <= 1, (seen.shape, picture.shape, worst)
    assert (np.abs(picture - picture[0, 0]).max(axis=2) > 8).mean() > 0.1, "There is nothing in the picture."


def summary(frames):
    return "%d frames, %d of them incomplete, of %.0f to %.0f ms" % (
        len(frames), sum(f["converged"] == 0 for f in frames),
        1000 * min(f["seconds"] for f in frames), 1000 * max(f["seconds"] for f in frames))


def scenario(view):
    # The first picture, which nobody asks for but the program itself.
    yield "a frame", lambda: view.frames
    assert view.frames[0]["converged"] == 0, "The first frame isn't to wait."
    yield "the refined picture", view.converged
    still = list(view.frames)
    assert len(still) > 1 and not any(f["interactive"] for f in still), still
    say("still:", summary(still))

    # Where the view is on the screen.
    center = (780, 430)
    yield "the pointer over the view", view.over(*center)
    view.point(*OUTSIDE)
    yield "the picture on the screen", settled(view)
    first = view.seen()
    assert_same(first, view.picture(), "still")

    # The mouse turns the view.
    yield "the picture after the screenshot", settled(view)
    count = len(view.frames)
    x, y = center
    yield "the pointer back", view.over(x, y)
    xdotool("mousedown", 1)
    yield "the button pressed", lambda: view.pressed
    for step in range(12):
        before = len(view.frames)
        x, y = x + 9, y + 3
        view.point(x, y)
        yield "a frame while the mouse drags", lambda: len(view.frames) > before
    drag = view.frames[count:]
    assert view.pressed and len(drag) >= 12 and all(f["interactive"] for f in drag), drag
    assert any(f["converged"] == 0 for f in drag), "Frames are to show what is at hand."
    say("drag:", summary(drag))
    count = len(view.frames)
    xdotool("mouseup", 1)
    yield "the button released", lambda: not view.pressed
    view.point(*OUTSIDE)
    yield "the turned picture", settled(view)
    after = view.frames[count:]
    assert after and not after[-1]["interactive"], after
    say("released:", summary(after))
    turned = view.seen()
    assert np.abs(turned - first).max() > 30, "The drag didn't turn the volume."
    assert_same(turned, view.picture(), "turned")

    # To another representation and back; the panel follows.
    for name in ("Volume", "Outline", REPRESENTATION):
        count = len(view.frames)
        view.display.SetRepresentationType(name)
        pv.Render(view.view)  # as the box of representations does
        yield "a frame of " + name, lambda: len(view.frames) > count
    yield "the picture after switching", settled(view)
    assert_same(view.seen(), turned, "switched back")

    # The facts of the Information tab.
    data = pv.GetActiveSource().FieldData
    names = [data.GetArray(i).GetName() for i in range(data.GetNumberOfArrays())]
    assert "Bricks" in names and "Level 2" in names, names
    assert not messages, messages


class Steps:
    """Goes through a scenario in the program's event loop."""

    def __init__(self, view):
        self.steps, self.waits, self.busy, self.over = scenario(view), ("the start", lambda: True), False, False
        self.until = time.monotonic() + PATIENCE
        view.interactor.AddObserver("TimerEvent", self.tick)
        self.timer = view.interactor.CreateRepeatingTimer(30)

    def tick(self, *_):
        if self.busy or self.over:
            return
        self.busy = True
        try:
            what, condition = self.waits
            if condition():
                self.waits = next(self.steps)
                self.until = time.monotonic() + PATIENCE
            elif time.monotonic() > self.until:
                raise TimeoutError("waited in vain for " + what)
        except StopIteration:
            self.end("passed")
        except BaseException:
            traceback.print_exc()
            self.end("failed")
        self.busy = False

    def end(self, result):
        self.over = True
        say("RESULT:", result)
        xdotool("mouseup", 1)
        # There is no window manager that gives the keyboard to a window.
        xdotool("search", "--onlyvisible", "--name", "^ParaView 5", "windowfocus", "--sync")
        xdotool("key", "ctrl+q")


def begin():
    assert vtkPVView.GetEnableStreaming(), "The setting isn't the one of the settings file."
    for event in ("ErrorEvent", "WarningEvent"):
        vtkOutputWindow.GetInstance().AddObserver(event, lambda _, name: messages.append(name))
    reader = pv.OpenDataFile(path_of("shells.h5"))
    display = pv.Show(reader, pv.GetActiveViewOrCreate("RenderView"))
    display.SetRepresentationType(REPRESENTATION)
    pv.ColorBy(display, ("POINTS", array_name(reader)))
    # More than can be drawn in the shortest time for a frame.
    display.Shade = 1
    display.InteractiveFrameTime = 0.01
    pv.ResetCamera()
    return Steps(View(pv.GetActiveView(), display))


try:
    steps = begin()
except BaseException:
    os.write(2, traceback.format_exc().encode())
    os._exit(1)  # nothing would close the program
