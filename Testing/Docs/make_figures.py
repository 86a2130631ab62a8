# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Draws the figures of docs/how-it-works.md: make_figures.py FOLDER [FOLDER OF OTHERS]

With a second folder the figures are compared with those there.
"""
import os
import sys

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

import teravox

SIZE = 300


def formula(name, edge):
    source = teravox.vtkProceduralVolumeSource()
    source.SetFunctionName(name)
    source.SetDimensions(edge, edge, edge)
    source.SetSpacing(1 / edge, 1 / edge, 1 / edge)
    return source


class Scene:
    """One volume, drawn off-screen; panels are float arrays (height, width, 3), the top row first."""

    def __init__(self, source, position, focal_point, angle):
        self.mapper = teravox.vtkOutOfCoreVolumeMapper()
        self.mapper.SetInputConnection(source.GetOutputPort())
        self.mapper.SetGPUMemoryBudget(256 << 20)
        self.volume = vtk.vtkVolume()
        self.volume.SetMapper(self.mapper)
        teravox.vtkOutOfCoreTransferFunction.MakeAutomatic(source.GetBrickSource(), self.volume.GetProperty())
        renderer = vtk.vtkRenderer()
        renderer.AddVolume(self.volume)
        camera = renderer.GetActiveCamera()
        camera.SetPosition(*position)
        camera.SetFocalPoint(*focal_point)
        camera.SetViewUp(0, 0, 1)
        camera.SetViewAngle(angle)
        renderer.ResetCameraClippingRange()
        self.window = vtk.vtkRenderWindow()
        self.window.SetOffScreenRendering(1)
        self.window.SetMultiSamples(0)
        self.window.SetSize(SIZE, SIZE)
        self.window.AddRenderer(renderer)

    def color(self):
        """Premultiplied RGBA."""
        self.window.Render()
        assert self.mapper.IsConverged()
        return self._array(self.mapper.GetColorAccumulator)

    def estimate(self):
        return self._array(self.mapper.GetErrorEstimateImage)

    @staticmethod
    def _array(get):
        image = vtk.vtkImageData()
        assert get(image)
        values = vtk_to_numpy(image.GetPointData().GetScalars())
        return values.reshape(SIZE, SIZE, -1)[::-1].astype(float)


def palette(values, low, high):
    """Dark blue to yellow; what isn't above `low` is black."""
    stops = np.array([(0.2, 0.1, 0.45), (0.15, 0.45, 0.55), (0.45, 0.75, 0.35), (1.0, 0.9, 0.2)])
    t = np.clip((values - low) / (high - low), 0, 1) * (len(stops) - 1)
    i = np.minimum(t.astype(int), len(stops) - 2)
    f = (t - i)[..., None]
    return np.where((values > low)[..., None], stops[i] * (1 - f) + stops[i + 1] * f, 0)


def levels():
    """A volume of 2^20 voxels per axis along its face: colours, and the level of what is seen first."""
    scene = Scene(formula("sponge", 1 << 20), (0.5, -0.02, 1.01), (0.5, 0.3, 0.98), 50)
    picture = scene.color()[..., :3]
    scene.mapper.SetDebugViewToLevels()
    shown = scene.color()
    visible = shown[..., 3] > 0
    level = np.where(visible, shown[..., 0] * 32 - 1, 0)
    low, high = level[visible].min(), level[visible].max()
    print(f"levels {low:.0f} to {high:.0f}")
    # A figure that shows nothing is as wrong as one that shows something else.
    assert high - low >= 3, "the figure shows hardly any levels"
    return [picture, np.where(visible[..., None], palette(level + 1, low, high + 1), 0)]


def errors():
    """A loose tolerance: the picture, what it errs by, and what it says that it may err by (4/255 is yellow)."""
    scene = Scene(formula("shells", 128), (1.9, -1.3, 1.3), (0.5, 0.5, 0.5), 30)
    scene.mapper.SetImageErrorTolerance(0.25 / 255)
    exact = scene.color()
    scene.mapper.ErrorEstimateOn()
    scene.mapper.SetImageErrorTolerance(4 / 255)
    loose = scene.color()
    error = np.abs(loose - exact)[..., :3].max(-1)
    estimate = scene.estimate()[..., 0]
    print(f"largest error {error.max() * 255:.2f}/255, estimated {estimate.max() * 255:.2f}/255")
    assert 0.2 / 255 < error.max() < 4 / 255
    return [loose[..., :3], palette(error, 0.05 / 255, 4 / 255), palette(estimate, 0.05 / 255, 4 / 255)]


def write(panels, name):
    pixels = np.concatenate(panels, 1)[::-1]
    scalars = numpy_to_vtk((np.clip(pixels, 0, 1) * 255 + 0.5).astype("u1").reshape(-1, 3), deep=True)
    image = vtk.vtkImageData()
    image.SetDimensions(pixels.shape[1], pixels.shape[0], 1)
    image.GetPointData().SetScalars(scalars)
    writer = vtk.vtkPNGWriter()
    writer.SetFileName(name)
    writer.SetInputData(image)
    writer.Write()


def read(name):
    reader = vtk.vtkPNGReader()
    reader.SetFileName(name)
    reader.Update()
    return vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars()).astype(int)


for figure in (levels, errors):
    file = os.path.join(sys.argv[1], figure.__name__ + ".png")
    write(figure(), file)
    if len(sys.argv) > 2:
        difference = np.abs(read(file) - read(os.path.join(sys.argv[2], figure.__name__ + ".png")))
        print(f"{figure.__name__}: mean difference {difference.mean():.3f}, largest {difference.max()}")
        if difference.mean() > 1:
            sys.exit(f"{figure.__name__}.png isn't what the documentation shows.")
