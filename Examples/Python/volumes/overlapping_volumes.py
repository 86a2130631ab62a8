# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Two volumes that fill the same places, each with a matrix and functions of its own.

As VTK's vtkMultiVolume has them: one mapper, an input and a volume per port.
"""
import vtk
import teravox
from common import show


def shown(points, colors):
    properties = vtk.vtkVolumeProperty()
    opacity = vtk.vtkPiecewiseFunction()
    color = vtk.vtkColorTransferFunction()
    for value, alpha in points:
        opacity.AddPoint(value, alpha)
    for value, red, green, blue in colors:
        color.AddRGBPoint(value, red, green, blue)
    properties.SetScalarOpacity(opacity)
    properties.SetColor(color)
    properties.SetInterpolationTypeToLinear()
    volume = vtk.vtkVolume()
    volume.SetProperty(properties)
    return volume


def source(name, size):
    made = teravox.vtkProceduralVolumeSource()
    made.SetFunctionName(name)
    made.SetDimensions(size, size, size)
    made.Update()  # VTK's own mapper asks for bounds before it does so
    return made


mapper = teravox.vtkOutOfCoreVolumeMapper()
volumes = vtk.vtkMultiVolume()
volumes.SetMapper(mapper)

waves = source("marschner-lobb", 72)
mapper.SetInputConnection(0, waves.GetOutputPort())
volumes.SetVolume(shown([(90, 0), (200, 0.06)], [(90, 0.1, 0.3, 0.9), (200, 0.6, 0.9, 1.0)]), 0)

shells = source("shells", 48)
mapper.SetInputConnection(1, shells.GetOutputPort())
inside = shown([(0, 0), (150, 0), (255, 0.25)], [(150, 0.9, 0.3, 0.1), (255, 1.0, 0.8, 0.3)])
inside.RotateZ(30)
inside.SetPosition(44, -2, 20)
volumes.SetVolume(inside, 1)

renderer = vtk.vtkRenderer()
renderer.AddVolume(volumes)
show(renderer)
