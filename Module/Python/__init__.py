# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Out-of-core volume rendering for VTK: `import teravox` beside `import vtk`.

open() and source() give VTK sources of files and arrays, volume() a vtkVolume that is ready to be
drawn, screenshot() a picture, convert() a pyramid file. The wrapped classes are here as well.

Axes of arrays are (z, y, x[, component]), as numpy, h5py and zarr have them; what lies in the
world (spacing, origin, camera) is (x, y, z), as VTK has it. Sizes in memory take numbers of bytes,
or texts such as "512M".

VTK isn't made for several threads: while one waits for a picture, others must leave its pipeline
alone. Python's interpreter lock is free meanwhile.
"""
import atexit as _atexit

from . import _vtk
from . import _callback
from .vtkRenderingOutOfCore import *
from ._pipeline import convert, info, open, read, source, volume
from ._picture import screenshot

# Before the interpreter ends, threads that load bricks must be out of it.
_atexit.register(_callback.close)
