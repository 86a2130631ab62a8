# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""The first volume that one draws: a scan in colours, some of it transparent, with light.

After VTK's SimpleRayCast; the data are written into a pyramid here and read from it.
"""
import os
import tempfile

import vtk
import teravox
from common import show

# A pyramid file, as `teravox convert` writes it from a scan.
field = teravox.vtkProceduralVolumeSource()
field.SetFunctionName("marschner-lobb")
field.SetDimensions(64, 64, 64)
folder = tempfile.TemporaryDirectory()
writer = teravox.vtkHDF5PyramidWriter()
writer.SetInputConnection(field.GetOutputPort())
writer.SetFileName(os.path.join(folder.name, "scan.h5"))
writer.Write()

reader = teravox.vtkHDF5PyramidReader()
reader.SetFileName(writer.GetFileName())

opacity = vtk.vtkPiecewiseFunction()
opacity.AddPoint(90, 0.0)
opacity.AddPoint(255, 0.12)
color = vtk.vtkColorTransferFunction()
color.AddRGBPoint(0, 0.0, 0.0, 0.0)
color.AddRGBPoint(64, 1.0, 0.0, 0.0)
color.AddRGBPoint(128, 0.2, 0.3, 1.0)
color.AddRGBPoint(192, 0.1, 1.0, 0.4)
color.AddRGBPoint(255, 0.9, 1.0, 0.8)
properties = vtk.vtkVolumeProperty()
properties.SetColor(color)
properties.SetScalarOpacity(opacity)
properties.ShadeOn()
properties.SetInterpolationTypeToLinear()

mapper = teravox.vtkOutOfCoreVolumeMapper()
mapper.SetInputConnection(reader.GetOutputPort())
volume = vtk.vtkVolume()
volume.SetMapper(mapper)
volume.SetProperty(properties)

renderer = vtk.vtkRenderer()
renderer.AddVolume(volume)
show(renderer)
