# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""A volume with surfaces inside: rays end where something opaque lies.

After VTK's IntermixedUnstructuredGrid.
"""
import vtk
import teravox
from common import show

cloud = teravox.vtkProceduralVolumeSource()
cloud.SetFunctionName("marschner-lobb")
cloud.SetDimensions(60, 60, 60)

opacity = vtk.vtkPiecewiseFunction()
opacity.AddPoint(60, 0.0)
opacity.AddPoint(200, 0.08)
color = vtk.vtkColorTransferFunction()
color.AddRGBPoint(60, 0.2, 0.3, 0.9)
color.AddRGBPoint(200, 0.9, 0.95, 1.0)
properties = vtk.vtkVolumeProperty()
properties.SetColor(color)
properties.SetScalarOpacity(opacity)
properties.SetInterpolationTypeToLinear()

mapper = teravox.vtkOutOfCoreVolumeMapper()
mapper.SetInputConnection(cloud.GetOutputPort())
volume = vtk.vtkVolume()
volume.SetMapper(mapper)
volume.SetProperty(properties)

renderer = vtk.vtkRenderer()
renderer.AddVolume(volume)
for center, radius, paint in [((20, 24, 30), 9, (1.0, 0.5, 0.1)), ((42, 38, 34), 12, (0.3, 0.9, 0.3))]:
    ball = vtk.vtkSphereSource()
    ball.SetCenter(center)
    ball.SetRadius(radius)
    ball.SetThetaResolution(40)
    ball.SetPhiResolution(40)
    surface = vtk.vtkPolyDataMapper()
    surface.SetInputConnection(ball.GetOutputPort())
    actor = vtk.vtkActor()
    actor.SetMapper(surface)
    actor.GetProperty().SetColor(paint)
    renderer.AddActor(actor)
show(renderer)
