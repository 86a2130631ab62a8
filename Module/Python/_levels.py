# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Arrays as levels of a volume: numpy, h5py, zarr, dask, and what looks like them."""
import operator
import weakref

import numpy as np
from vtkmodules.util.numpy_support import get_vtk_array_type

from . import _callback
from .vtkRenderingOutOfCore import vtkCallbackVolumeSource

# What is read as something else, without loss.
_WIDENED = {np.dtype(np.bool_): np.dtype(np.uint8), np.dtype(np.float16): np.dtype(np.float32)}
_SUPPORTED = ("u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8")


def is_array(thing):
    """Has it `shape`, `dtype` and `__getitem__`?"""
    return all(hasattr(thing, name) for name in ("shape", "dtype", "__getitem__"))


def _voxel_type(array):
    """The dtype that voxels of the array are read as, in the machine's byte order."""
    dtype = np.dtype(array.dtype)
    dtype = _WIDENED.get(dtype.newbyteorder("="), dtype.newbyteorder("="))
    if dtype.kind + str(dtype.itemsize) not in _SUPPORTED:
        raise TypeError(
            f"Volumes have integers of 8, 16 and 32 bits and floats of 16, 32 and 64 bits, not "
            f"{array.dtype}: convert the array, for instance with astype()."
        )
    return dtype


def _voxel_shape(array):
    """(z, y, x, components)."""
    shape = tuple(operator.index(n) for n in array.shape)
    if len(shape) == 3:
        shape += (1,)
    if len(shape) != 4 or not 1 <= shape[3] <= 4 or min(shape) < 1:
        raise ValueError(
            f"A volume has the axes (z, y, x), or (z, y, x, component) with up to 4 components, "
            f"none of them empty; this array has the shape {tuple(array.shape)}."
        )
    return shape


def find_factors(shapes):
    """Voxels of the first level that make one of each level, as (z, y, x), from their shapes.

    Along each axis the smallest multiple of the factor before that gives the level's size, rounded
    up or else rounded down.
    """
    factors = [(1, 1, 1)]
    for number, shape in enumerate(shapes[1:], 1):
        factor = []
        for axis in range(3):
            fine, coarse, before = shapes[0][axis], shape[axis], factors[-1][axis]
            up = before * -(-fine // (coarse * before))
            down = before * (fine // ((coarse + 1) * before) + 1)
            if -(-fine // up) == coarse:
                factor.append(up)
            elif fine // down == coarse:
                factor.append(down)
            else:
                raise ValueError(
                    f"Level {number} has the shape {tuple(shape[:3])}, which is not "
                    f"{tuple(shapes[0][:3])} by whole factors that are multiples of the level's "
                    f"before, {factors[-1]}."
                )
        factors.append(tuple(factor))
    return factors


class _Reader:
    """Reads boxes of the levels; called by threads of the mapper."""

    def __init__(self, levels, dtype, components):
        self.levels = levels
        self.dtype = dtype
        self.components = components
        self.cancelled = False

    def __call__(self, level, first, size, view):
        if self.cancelled:
            raise InterruptedError("nobody waits for it any more")
        array = self.levels[level]
        box = tuple(slice(f, f + n) for f, n in zip(first, size))
        voxels = np.asarray(array[box])
        shape = size if np.ndim(voxels) == 3 else size + (self.components,)
        if voxels.shape != shape or _voxel_type(voxels) != self.dtype:
            raise ValueError(
                f"voxels {box} of level {level} came with the shape {voxels.shape} and the type "
                f"{voxels.dtype} instead of {shape} and {self.dtype}"
            )
        out = np.frombuffer(view, self.dtype).reshape(shape)
        np.copyto(out, voxels, casting="equiv" if voxels.dtype == out.dtype else "safe")


def source_of_levels(levels, *, spacing, origin, labels, name, value_range, brick_size):
    """A vtkCallbackVolumeSource that reads the arrays; spacing and origin as (x, y, z)."""
    shapes = [_voxel_shape(a) for a in levels]
    types = [_voxel_type(a) for a in levels]
    if len(set(types)) != 1 or len({s[3] for s in shapes}) != 1:
        raise TypeError(
            "All levels need the same type and number of components; these have "
            + ", ".join(f"{a.dtype} {tuple(a.shape)}" for a in levels)
            + "."
        )
    dtype, components = types[0], shapes[0][3]
    source = vtkCallbackVolumeSource()
    source.SetScalarType(get_vtk_array_type(dtype))
    source.SetNumberOfComponents(components)
    source.SetLabels(bool(labels))
    source.SetSpacing(*spacing)
    source.SetOrigin(*origin)
    source.SetName(name or f"{type(levels[0]).__name__} {shapes[0][:3]}")
    if brick_size is not None:
        source.SetBrickSize(operator.index(brick_size))
    for shape, factor in zip(shapes, find_factors(shapes)):
        source.AddLevel(shape[2::-1], factor[::-1])
    if value_range is None and isinstance(levels[0], np.ndarray):
        value_range = _range_of(levels[0])
    if value_range is not None:
        source.SetScalarRange(float(value_range[0]), float(value_range[1]))
    reader = _Reader(tuple(levels), dtype, components)
    _callback.set_reader(source, reader, dtype.itemsize * components)
    # Weakly: VTK keeps attributes for a while after an object's death.
    source.teravox_reader = weakref.ref(reader)
    return source


def cancel(algorithm, cancelled=True):
    """Lets all reads of an array's source fail at once, or no longer. What has been given up can't
    be: one brick of a coarse level may stand for the whole array."""
    reader = getattr(algorithm, "teravox_reader", lambda: None)()
    if reader is not None:
        reader.cancelled = cancelled


def _range_of(array):
    """Range of an array in memory without its NaN; None without any value."""
    low, high = np.inf, -np.inf
    for part in array:  # slice by slice: no temporary as large as the array
        part_low, part_high = np.fmin.reduce(part, axis=None), np.fmax.reduce(part, axis=None)
        if part_low <= part_high:  # not NaN
            low, high = min(low, float(part_low)), max(high, float(part_high))
    return (low, high) if low <= high else None
