# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Draws an HDF5 pyramid off-screen: render_pyramid.py FILE.h5 OUT.png"""
import sys

import vtk
import teravox

reader = teravox.vtkHDF5PyramidReader()
reader.SetFileName(sys.argv[1])
mapper = teravox.vtkOutOfCoreVolumeMapper()
mapper.SetInputConnection(reader.GetOutputPort())
mapper.SetGPUMemoryBudget(512 << 20)
volume = vtk.vtkVolume()
volume.SetMapper(mapper)
teravox.vtkOutOfCoreTransferFunction.MakeAutomatic(reader.GetBrickSource(), volume.GetProperty())
renderer = vtk.vtkRenderer()
renderer.AddVolume(volume)
window = vtk.vtkRenderWindow()
window.SetOffScreenRendering(1)
window.SetSize(800, 600)
window.AddRenderer(renderer)
window.Render()
print("converged:", mapper.IsConverged(), "bricks:", mapper.GetNumberOfBricksLoaded())
picture = vtk.vtkWindowToImageFilter()
picture.SetInput(window)
writer = vtk.vtkPNGWriter()
writer.SetInputConnection(picture.GetOutputPort())
writer.SetFileName(sys.argv[2])
writer.Write()
