# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""The least value along each ray: minimum intensity projection.

After VTK's MinIntensityRendering.
"""
import vtk
import teravox
from common import show

field = teravox.vtkProceduralVolumeSource()
field.SetFunctionName("marschner-lobb")
field.SetDimensions(60, 60, 60)

opacity = vtk.vtkPiecewiseFunction()
opacity.AddPoint(0, 1.0)
opacity.AddPoint(255, 1.0)
color = vtk.vtkColorTransferFunction()
color.AddRGBPoint(0, 1.0, 0.9, 0.3)
color.AddRGBPoint(50, 0.9, 0.3, 0.2)
color.AddRGBPoint(150, 0.1, 0.1, 0.4)
properties = vtk.vtkVolumeProperty()
properties.SetColor(color)
properties.SetScalarOpacity(opacity)
properties.SetInterpolationTypeToLinear()

mapper = teravox.vtkOutOfCoreVolumeMapper()
mapper.SetInputConnection(field.GetOutputPort())
mapper.SetBlendModeToMinimumIntensity()
volume = vtk.vtkVolume()
volume.SetMapper(mapper)
volume.SetProperty(properties)

renderer = vtk.vtkRenderer()
renderer.AddVolume(volume)
show(renderer, zoom=1.1)
