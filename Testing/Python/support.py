# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""What the tests of the package share."""
import os
import subprocess
import sys
import textwrap
import threading

import numpy as np
import vtk
from vtkmodules.util.numpy_support import vtk_to_numpy

import teravox


def noise(shape, dtype, seed=1):
    """Any bits of an integer type, values in 0...1 of a float."""
    random = np.random.default_rng(seed)
    dtype = np.dtype(dtype)
    if dtype.kind == "f":
        return random.random(shape).astype(dtype)
    if dtype.kind == "b":
        return random.random(shape) < 0.5
    limits = np.iinfo(dtype)
    return random.integers(limits.min, limits.max, shape, dtype.newbyteorder("="), True).astype(dtype)


def shells(n=72):
    """A smooth ball with shells, uint8; no two axes alike."""
    z, y, x = np.mgrid[0:n, 0 : n + 6, 0 : n + 15].astype(float)
    r = np.sqrt((x - 40) ** 2 + 1.3 * (y - 37) ** 2 + 0.8 * (z - 30) ** 2)
    return (110 + 100 * np.cos(r / 4) * np.exp(-((r / 30) ** 2))).astype(np.uint8)


class Scene:
    """A volume in an off-screen window."""

    def __init__(self, volume, size=(120, 90), off_screen=True):
        self.volume = volume
        self.mapper = volume.GetMapper()
        self.renderer = vtk.vtkRenderer()
        self.renderer.AddVolume(volume)
        self.window = vtk.vtkRenderWindow()
        self.window.SetOffScreenRendering(int(off_screen))
        self.window.SetSize(*size)
        self.window.AddRenderer(self.renderer)
        camera = self.renderer.GetActiveCamera()
        self.renderer.ResetCamera()
        camera.Azimuth(35)
        camera.Elevation(25)
        self.renderer.ResetCamera()

    def accumulator(self):
        """Renders; the floats before the 8-bit frame buffer."""
        self.window.Render()
        image = vtk.vtkImageData()
        assert self.mapper.GetColorAccumulator(image)
        return vtk_to_numpy(image.GetPointData().GetScalars()).copy()


def picture_of(data, **arguments):
    """Accumulator of a converged picture with a fixed look.

    The range of the data is told: numpy's would be found, others' not, and the tables of the
    transfer function follow from it (within the tolerance they say the same).
    """
    look = {
        "opacity": [0.0, 0.03, 0.2],
        "cmap": "viridis",
        "clim": (0, 255),
        "value_range": (0, 255),
    }
    scene = Scene(teravox.volume(data, **{**look, **arguments}))
    pixels = scene.accumulator()
    assert scene.mapper.IsConverged()
    return pixels


class Recorded:
    """Looks like an array; notes what is asked for, and by which thread."""

    def __init__(self, array, before=None):
        self.array = array
        self.shape = array.shape
        self.dtype = array.dtype
        self.before = before
        self.boxes = []
        self.threads = set()

    def __getitem__(self, box):
        self.boxes.append(box)
        self.threads.add(threading.get_ident())
        if self.before:
            self.before(box)
        return self.array[box]


def run_script(text, timeout=60):
    """Runs a script in a process of its own; the finished process."""
    head = f"import sys\nsys.path.insert(0, {os.path.dirname(__file__)!r})\n"
    return subprocess.run(
        [sys.executable, "-X", "faulthandler", "-c", head + textwrap.dedent(text)],
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )
