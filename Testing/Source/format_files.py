# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""What the writers of foreign layouts share: arrays, and their copies for the tests to compare with."""
import numpy as np


def volume(shape, dtype, seed):
    """Smooth, with noise: (z,y,x), reproducible, most of the type's range in use."""
    rng = np.random.default_rng(seed)
    z, y, x = np.meshgrid(*[np.linspace(0, 1, n) for n in shape], indexing="ij")
    field = 0.4 + 0.3 * np.sin(7 * x + 5 * z) * np.cos(4 * y) + 0.2 * z + 0.05 * rng.random(shape)
    dtype = np.dtype(dtype)
    if dtype.kind == "f":
        return (field * 100 - 20).astype(dtype)
    top = min(float(np.iinfo(dtype).max), 1e9)
    return (field * top).astype(dtype)


def halved(a, factors, shape=None):
    """Averages of groups (factors in z,y,x); the last group is cut off as `shape` says (default:
    floor, at least one)."""
    shape = shape or tuple(max(n // f, 1) for n, f in zip(a.shape, factors))
    pads = [(0, max(n * f - m, 0)) for n, f, m in zip(shape, factors, a.shape)]
    a = np.pad(a, pads, mode="edge")[tuple(slice(0, n * f) for n, f in zip(shape, factors))]
    b = a.reshape([k for n, f in zip(shape, factors) for k in (n, f)]).mean((1, 3, 5),
                                                                              dtype=np.float64)
    return np.floor(b + 0.5).astype(a.dtype) if a.dtype.kind in "iu" else b.astype(a.dtype)


def keep(folder, name, array):
    """For the tests: the bytes, little-endian, x fastest."""
    array = np.ascontiguousarray(array)
    array.astype(array.dtype.newbyteorder("<")).tofile(f"{folder}/{name}.bin")
