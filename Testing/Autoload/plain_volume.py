# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""A script for VTK that knows of nothing else: plain_volume.py {GPU|Smart|MultiBlock} VOXELS OUT.png

Draws a bar of VOXELS x 16 x 16 voxels.
"""
import sys

import numpy
import vtk
from vtk.util.numpy_support import numpy_to_vtk

length = int(sys.argv[2])
x = numpy.arange(length)[None, None, :]
y = numpy.arange(16)[None, :, None]
z = numpy.arange(16)[:, None, None]
values = 128 + 100 * numpy.sin(x / length * 40) * numpy.cos(y / 5) * numpy.cos(z / 4)
scalars = numpy_to_vtk(values.astype(numpy.uint16).ravel(), deep=True)
scalars.SetName("wave")
image = vtk.vtkImageData()
image.SetDimensions(length, 16, 16)
image.SetSpacing(4096 / length, 32, 32)
image.GetPointData().SetScalars(scalars)

if sys.argv[1] == "MultiBlock":
    blocks = vtk.vtkMultiBlockDataSet()
    blocks.SetBlock(0, image)
    mapper = vtk.vtkMultiBlockVolumeMapper()
    mapper.SetInputDataObject(blocks)
elif sys.argv[1] == "Smart":
    mapper = vtk.vtkSmartVolumeMapper()
    mapper.SetInputData(image)
else:
    mapper = vtk.vtkGPUVolumeRayCastMapper()
    mapper.SetInputData(image)

opacity = vtk.vtkPiecewiseFunction()
opacity.AddPoint(0, 0)
opacity.AddPoint(100, 0)
opacity.AddPoint(228, 0.6)
color = vtk.vtkColorTransferFunction()
color.AddRGBPoint(0, 0, 0, 1)
color.AddRGBPoint(228, 1, 0.5, 0)
volume = vtk.vtkVolume()
volume.SetMapper(mapper)
volume.GetProperty().SetScalarOpacity(opacity)
volume.GetProperty().SetScalarOpacityUnitDistance(60)
volume.GetProperty().SetColor(color)
volume.GetProperty().SetInterpolationTypeToLinear()

renderer = vtk.vtkRenderer()
renderer.AddVolume(volume)
window = vtk.vtkRenderWindow()
window.SetOffScreenRendering(1)
window.SetSize(320, 120)
window.AddRenderer(renderer)
renderer.ResetCamera()
renderer.GetActiveCamera().Azimuth(25)
renderer.GetActiveCamera().Elevation(15)
renderer.GetActiveCamera().Zoom(2.2)
window.Render()

picture = vtk.vtkWindowToImageFilter()
picture.SetInput(window)
picture.ReadFrontBufferOff()
writer = vtk.vtkPNGWriter()
writer.SetFileName(sys.argv[3])
writer.SetInputConnection(picture.GetOutputPort())
writer.Write()
