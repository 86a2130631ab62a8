# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of volumes, off-screen and converged."""
from __future__ import annotations

import ctypes
import ctypes.util
import os
import sys
import time
import warnings
from typing import Any, Sequence

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOImage import vtkJPEGWriter, vtkPNGWriter, vtkTIFFWriter
from vtkmodules.vtkRenderingCore import (
    vtkRenderer,
    vtkRenderWindow,
    vtkVolume,
    vtkWindowToImageFilter,
)

from . import _interrupt, _levels, _look, _pipeline, _vtk
from .vtkRenderingOutOfCore import vtkOutOfCoreVolumeMapper

_WRITERS = {
    ".png": vtkPNGWriter,
    ".jpg": vtkJPEGWriter,
    ".jpeg": vtkJPEGWriter,
    ".tif": vtkTIFFWriter,
    ".tiff": vtkTIFFWriter,
}


def _check_display():
    """VTK ends the program where it finds no X server."""
    if not sys.platform.startswith("linux"):
        return
    name = ctypes.util.find_library("X11")
    if name is None:
        return  # another kind of window
    x11 = ctypes.CDLL(name)
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XOpenDisplay.argtypes = [ctypes.c_char_p]
    x11.XCloseDisplay.argtypes = [ctypes.c_void_p]
    display = x11.XOpenDisplay(None)
    if not display:
        raise RuntimeError(
            f"There is no X server ({os.environ.get('DISPLAY') or 'DISPLAY is not set'}): set "
            "DISPLAY, or run the program under xvfb-run."
        )
    x11.XCloseDisplay(display)


def _volume_of(data, arguments):
    if not isinstance(data, vtkVolume):
        return _pipeline.volume(data, **arguments)
    if arguments:
        raise TypeError(f"A vtkVolume is drawn as it is: {', '.join(arguments)} can't be given.")
    if not isinstance(data.GetMapper(), vtkOutOfCoreVolumeMapper):
        raise TypeError("The volume's mapper isn't a vtkOutOfCoreVolumeMapper.")
    return data


def _place_camera(renderer, camera, zoom):
    view = renderer.GetActiveCamera()
    if camera is None:
        renderer.ResetCamera()
        view.Azimuth(30)
        view.Elevation(20)
        renderer.ResetCamera()
    else:
        position, focal_point, *view_up = camera
        view.SetPosition(*position)
        view.SetFocalPoint(*focal_point)
        if view_up:
            view.SetViewUp(*view_up[0])
    if zoom is not None:
        view.Zoom(zoom)
    renderer.ResetCameraClippingRange()


def screenshot(
    data: Any,
    file: str | os.PathLike | None = None,
    *,
    size: tuple[int, int] = (800, 600),
    timeout: float = 300.0,
    camera: Sequence[Sequence[float]] | None = None,
    zoom: float | None = None,
    background: str | Sequence[float] = "black",
    **arguments: Any,
) -> np.ndarray:
    """Draws a volume off-screen, waits until the picture is complete, and writes it to a file.

    data: what volume() takes, with its other arguments; or a vtkVolume that it made.
    file: PNG, JPEG or TIFF by its extension; None: no file.
    size: width and height in pixels.
    timeout: seconds until TimeoutError.
    camera: (position, focal point[, view up]) in world units; default: all of it, from a corner.
    zoom: above 1: nearer.
    background: a colour: name, "#rrggbb", or (r, g, b) in 0...1.

    Returns the picture as a numpy array (height, width, 3) of uint8, the top row first.
    Raises TimeoutError, KeyboardInterrupt, what volume() raises, RuntimeError where it can't be
    drawn. Bricks that can't be read are a RuntimeWarning with the reason of the first one.
    """
    writer = None
    if file is not None:
        extension = os.path.splitext(os.fspath(file))[1].lower()
        if extension not in _WRITERS:
            raise ValueError(f"{file}: pictures are written as {', '.join(_WRITERS)}.")
        writer = _WRITERS[extension]()
    _check_display()
    volume = _volume_of(data, arguments)
    mapper = volume.GetMapper()
    renderer = vtkRenderer()
    renderer.SetBackground(*_look._rgb(background))
    renderer.AddVolume(volume)
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(*size)
    window.AddRenderer(renderer)
    try:
        _draw(window, mapper, timeout, lambda: _place_camera(renderer, camera, zoom))
        pixels = _grab(window)
    finally:
        renderer.RemoveVolume(volume)
        window.Finalize()
    if writer is not None:
        with _vtk.errors_raised(writer):
            writer.SetInputData(pixels)
            writer.SetFileName(os.fspath(file))
            writer.Write()
    width, height, _ = pixels.GetDimensions()
    return vtk_to_numpy(pixels.GetPointData().GetScalars()).reshape(height, width, 3)[::-1].copy()


def _draw(window, mapper, timeout, prepare):
    """Renders a complete picture, or raises what keeps it from being one."""
    until = time.monotonic() + timeout
    failures = []

    def on_failure(_, __, text):
        failures.append(text)

    on_failure.CallDataType = "string0"
    budget = mapper.GetFrameTimeBudget()
    patience = mapper.GetConvergeTimeout()
    pipeline = mapper.GetInputAlgorithm()
    with _interrupt.noted() as interrupt:

        def is_over():
            return interrupt.pressed or time.monotonic() > until

        def on_check(_, __):
            if is_over():
                window.SetAbortRender(1)
                _levels.cancel(pipeline)

        def on_progress(_, __):
            if is_over():
                pipeline.SetAbortExecute(1)
                _levels.cancel(pipeline)

        tags = [
            (window, window.AddObserver("AbortCheckEvent", on_check)),
            (mapper, mapper.AddObserver(mapper.BrickFailedEvent, on_failure)),
            (pipeline, pipeline.AddObserver("ProgressEvent", on_progress)),
        ]
        mapper.SetFrameTimeBudget(0)
        mapper.SetConvergeTimeout(0)  # there is one limit, and it's the caller's
        try:
            with _vtk.errors_raised(mapper, pipeline) as messages:
                prepare()  # bounds need the pipeline's image
                if not is_over():
                    window.Render()
                over = is_over() and not mapper.IsConverged()
                if failures or over:
                    messages.clear()  # the first of them is reported as an error, too
        finally:
            mapper.SetFrameTimeBudget(budget)
            mapper.SetConvergeTimeout(patience)
            for o, tag in tags:
                o.RemoveObserver(tag)
            if is_over():
                pipeline.SetAbortExecute(0)
                pipeline.Modified()  # what it has is a part
                mapper.RetryFailedBricks()
            _levels.cancel(pipeline, False)
    if failures and not over:
        warnings.warn(
            f"{len(failures)} bricks can't be read. {failures[0]}", RuntimeWarning, stacklevel=3
        )
    elif over or not mapper.IsConverged():
        raise TimeoutError(
            f"The picture wasn't complete after {timeout} s; "
            f"{mapper.GetNumberOfMissingBricks()} bricks are missing."
        )


def _grab(window):
    picture = vtkWindowToImageFilter()
    picture.SetInput(window)
    picture.SetInputBufferTypeToRGB()
    picture.ReadFrontBufferOff()
    picture.ShouldRerenderOff()
    picture.Update()
    return picture.GetOutput()
