# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""For pvbatch: pictures of pyramids and of an ordinary image as arrays, and what each process did as JSON:
parallel_scene.py <folder> [few | balance | hidden | seen]."""
import json
import os
import sys

import numpy as np

from support import fact, facts, look, new_view, pv, screenshot, show, path_of, tell

SHELLS = [(4000, 0.1, 0.2, 0.8, 0), (12000, 0.2, 0.8, 0.3, 0.02), (21000, 1, 0.4, 0.1, 0.5)]
BALL = [(6000, 0.1, 0.2, 0.8, 0), (7000, 0.9, 0.6, 0.3, 1), (40000, 1, 0.4, 0.1, 1)]
WAVELET = [(40, 0.1, 0.2, 0.8, 0), (150, 0.2, 0.8, 0.3, 0.02), (270, 1, 0.4, 0.1, 0.5)]

folder = sys.argv[1]
view = new_view()
told = {"blocks": {}, "converged": {}, "read": {}}


def picture(name, display):
    np.save(os.path.join(folder, name + ".npy"), screenshot(view))
    tell(view)
    told["blocks"][name] = fact(display, "DrawsBlock")
    told["converged"][name] = fact(display, "Converged")
    told["read"][name] = facts(display, "ReadMiBOfProcesses")


def few_pictures(reader, display):
    look(view)
    picture("pyramid", display)
    look(view, 215, -25)  # the processes in the opposite order
    picture("behind", display)
    look(view, 20, 80)
    picture("above", display)
    look(view)
    display.Shade = 1
    picture("shaded", display)
    display.Shade = 0


def more_pictures(reader, display):
    view.CameraParallelProjection = 1
    picture("parallel", display)
    view.CameraParallelProjection = 0
    look(view, zoom=1)
    view.CameraPosition = [0.4 * c + 0.6 * f for c, f in zip(view.CameraPosition, view.CameraFocalPoint)]
    picture("inside", display)
    look(view)
    reader.PresentedLevel = 0  # another image, the same volume
    display.UseCropping = 1
    display.CroppingScale = [0.5, 1, 0.7]
    picture("cropped", display)
    display.UseCropping = 0
    display.CroppingScale = [1, 1, 1]
    display.Scale = [1, 1.5, 0.7]
    display.Position = [40, -30, 20]
    display.Orientation = [0, 0, 90]
    look(view)
    picture("scaled", display)
    # What blocks can't be blended of.
    display.Orientation = [20, 0, 30]
    picture("turned", display)
    display.Orientation = display.Position = [0, 0, 0]
    display.Scale = [1, 1, 1]
    look(view)
    blend_mode(display, 1)  # vtkVolumeMapper::MAXIMUM_INTENSITY_BLEND, not in ParaView's list
    picture("maximum", display)
    blend_mode(display, 0)
    second = pv.OpenDataFile(path_of("shells.h5"))
    other = show(second, view, SHELLS, unit=2)
    other.Position = [60, 50, 40]
    picture("two", display)
    pv.Delete(second)
    picture("again", display)
    pv.Hide(reader, view)
    wavelet = pv.Wavelet()
    display = show(wavelet, view, WAVELET, unit=1)
    look(view)
    picture("wavelet", display)


def blend_mode(display, mode):
    display.SMProxy.GetProperty("BlendMode").SetElement(0, mode)
    display.SMProxy.UpdateVTKObjects()


def balanced_pictures():
    """Something to be seen in one corner only; each update of the view may move the blocks."""
    reader = pv.OpenDataFile(path_of("corner.h5"))
    reader.BrickSize = 16
    points = [(0, 0, 0, 0, 0), (50, 0.1, 0.2, 0.9, 0), (250, 1, 0.6, 0.3, 0.1)]
    display = show(reader, view, points, unit=2)
    display.MaximumLevel = 0
    look(view)
    pv.Render(view)
    tell(view)  # an update: what the frame before needed, and the blocks move
    told["read"]["even"] = facts(display, "ReadMiBOfProcesses")
    told["needed"] = {"even": facts(display, "NeededMiBOfProcesses")}
    for name in ("moved", "still"):
        picture(name, display)
        told["needed"][name] = facts(display, "NeededMiBOfProcesses")


def hidden_pictures(exchange):
    """An opaque ball, first coarsely, then as it is: what one process hides from the other needn't be read."""
    reader = pv.OpenDataFile(path_of("shells.h5"))
    reader.BrickSize = 16
    display = show(reader, view, BALL, unit=1)
    display.ExchangeOpacities = exchange
    display.MinimumLevel = display.MaximumLevel = 2
    look(view, 80, 5)
    picture("coarse", display)
    display.MinimumLevel = display.MaximumLevel = 0
    picture("hidden", display)
    for name, angle in (("near", 4), ("farther", 14)):
        camera = view.GetActiveCamera()
        camera.Azimuth(angle)
        view.CameraPosition, view.CameraViewUp = camera.GetPosition(), camera.GetViewUp()
        picture(name, display)


mode = sys.argv[2] if len(sys.argv) > 2 else "all"
if mode == "balance":
    balanced_pictures()
elif mode in ("hidden", "seen"):
    hidden_pictures(1 if mode == "hidden" else 0)
else:
    source = pv.OpenDataFile(path_of("shells.h5"))
    volume = show(source, view, SHELLS, unit=2)
    few_pictures(source, volume)
    if mode == "all":
        more_pictures(source, volume)
with open(os.path.join(folder, "facts.json"), "w") as f:
    json.dump(told, f)
