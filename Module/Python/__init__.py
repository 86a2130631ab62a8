# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Out-of-core volume rendering for VTK: `import teravox` beside `import vtk`."""

# The wrapped superclasses must be known before the classes below are loaded, and VTK's factories
# must be registered before the first render window is made.
import vtkmodules.vtkCommonCore
import vtkmodules.vtkCommonDataModel
import vtkmodules.vtkCommonExecutionModel
import vtkmodules.vtkRenderingCore
import vtkmodules.vtkRenderingVolume
import vtkmodules.vtkRenderingOpenGL2
import vtkmodules.vtkRenderingVolumeOpenGL2
import vtkmodules.vtkInteractionStyle

from .vtkRenderingOutOfCore import *
