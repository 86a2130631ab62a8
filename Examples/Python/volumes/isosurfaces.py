# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Two surfaces of a field, one seen through the other.

After VTK's RayCastIsosurface.
"""
import vtk
import teravox
from common import show

field = teravox.vtkProceduralVolumeSource()
field.SetFunctionName("marschner-lobb")
field.SetDimensions(70, 70, 70)
field.SetScalarType(vtk.VTK_FLOAT)

opacity = vtk.vtkPiecewiseFunction()
opacity.AddPoint(0.35, 0.3)
opacity.AddPoint(0.65, 1.0)
color = vtk.vtkColorTransferFunction()
color.AddRGBPoint(0.35, 0.3, 0.5, 1.0)
color.AddRGBPoint(0.65, 1.0, 0.7, 0.2)
properties = vtk.vtkVolumeProperty()
properties.SetColor(color)
properties.SetScalarOpacity(opacity)
properties.SetInterpolationTypeToLinear()
properties.ShadeOn()
properties.GetIsoSurfaceValues().SetValue(0, 0.35)
properties.GetIsoSurfaceValues().SetValue(1, 0.65)

mapper = teravox.vtkOutOfCoreVolumeMapper()
mapper.SetInputConnection(field.GetOutputPort())
mapper.SetBlendModeToIsoSurface()
volume = vtk.vtkVolume()
volume.SetMapper(mapper)
volume.SetProperty(properties)

renderer = vtk.vtkRenderer()
renderer.AddVolume(volume)
show(renderer)
