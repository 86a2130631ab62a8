# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""A shaded scan of several tissues, one of them cut away by a plane.

After VTK's FixedPointVolumeRayCastMapperCT, with its skin over bone; here shells over shells.
"""
import vtk
import teravox
from common import show

scan = teravox.vtkProceduralVolumeSource()
scan.SetFunctionName("shells")
scan.SetDimensions(80, 80, 80)
scan.SetScalarType(vtk.VTK_SHORT)
scan.SetOutputRange(-1000, 1000)

opacity = vtk.vtkPiecewiseFunction()
opacity.AddPoint(-1000, 0.0)
opacity.AddPoint(-200, 0.0)
opacity.AddPoint(300, 0.1)
opacity.AddPoint(700, 0.5)
opacity.AddPoint(1000, 0.8)
color = vtk.vtkColorTransferFunction()
color.AddRGBPoint(-1000, 0.3, 0.3, 1.0)
color.AddRGBPoint(-200, 0.4, 0.2, 0.1)
color.AddRGBPoint(300, 1.0, 0.6, 0.4)
color.AddRGBPoint(1000, 1.0, 1.0, 0.9)
properties = vtk.vtkVolumeProperty()
properties.SetColor(color)
properties.SetScalarOpacity(opacity)
properties.SetScalarOpacityUnitDistance(0.9)
properties.SetInterpolationTypeToLinear()
properties.ShadeOn()
properties.SetAmbient(0.1)
properties.SetDiffuse(0.9)
properties.SetSpecular(0.2)
properties.SetSpecularPower(10)

mapper = teravox.vtkOutOfCoreVolumeMapper()
mapper.SetInputConnection(scan.GetOutputPort())
cut = vtk.vtkPlane()
cut.SetOrigin(39.5, 39.5, 50)
cut.SetNormal(0, 0.3, -1)
mapper.AddClippingPlane(cut)
volume = vtk.vtkVolume()
volume.SetMapper(mapper)
volume.SetProperty(properties)

renderer = vtk.vtkRenderer()
renderer.AddVolume(volume)
show(renderer, 40, 35, 1.5)
