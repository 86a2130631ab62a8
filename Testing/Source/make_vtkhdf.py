# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Writes VTKHDF files as the specification of VTK has them: make_vtkhdf.py FOLDER."""
import sys

import h5py
import numpy as np

from format_files import keep, volume

folder = sys.argv[1]


def image(name, extent, steps=None, kind="ImageData"):
    f = h5py.File(f"{folder}/{name}.vtkhdf", "w")
    g = f.create_group("VTKHDF")
    g.attrs["Version"] = np.array([2, 0])
    g.attrs["Type"] = np.bytes_(kind)
    g.attrs["WholeExtent"] = np.array(extent)
    g.attrs["Origin"] = np.array([1.0, 2.0, 3.0])
    g.attrs["Spacing"] = np.array([0.5, 1.0, 2.0])
    g.attrs["Direction"] = np.array([1.0, 0, 0, 0, 1, 0, 0, 0, 1])
    if steps is not None:
        s = g.create_group("Steps")
        s.attrs["NSteps"] = len(steps)
        s.create_dataset("Values", data=np.array(steps, "<f8"))
    return f


extent = (0, 12, 0, 10, 0, 8)  # 13 x 11 x 9 points, 12 x 10 x 8 cells
with image("static", extent) as f:
    d = f["VTKHDF"].create_group("PointData")
    d.attrs["Scalars"] = np.bytes_("density")
    a = volume((9, 11, 13), "<f4", 1)
    d.create_dataset("density", data=a)
    keep(folder, "density", a)
    v = np.stack([volume((9, 11, 13), "<f4", k) for k in (2, 3, 4)], -1)
    d.create_dataset("Velocity", data=v, chunks=(4, 4, 4, 3), compression="gzip")
    keep(folder, "velocity", v)
with image("nine", extent) as f:
    a = np.stack([volume((9, 11, 13), "<u2", k) for k in range(9)], -1)
    f["VTKHDF"].create_dataset("PointData/tensor", data=a, chunks=(4, 5, 6, 9))
    keep(folder, "nine", a[..., 7])
with image("cells", extent) as f:
    a = volume((8, 10, 12), "<i2", 5)
    f["VTKHDF"].create_dataset("CellData/c", data=a)
    keep(folder, "cells", a)
for name, chunks in (("moving", (1, 9, 11, 13)), ("chunks_of_steps", (2, 4, 4, 5))):
    with image(name, extent, steps=[0.5, 1.0, 4.0]) as f:
        a = np.stack([volume((9, 11, 13), "<u2", 10 + t) for t in range(3)])
        d = f["VTKHDF"].create_dataset("PointData/p", data=a, chunks=chunks, compression="gzip",
                                       shuffle=True)
        d.attrs["Attribute"] = np.bytes_("Scalars")
        still = f["VTKHDF/PointData"].create_dataset("still", data=a[0])
        # The second and third step share one entry.
        f["VTKHDF/Steps"].create_dataset("PointDataOffsets/p", data=np.array([0, 2, 2]))
        for t, k in enumerate((0, 2, 2)):
            keep(folder, f"{name}.{t}", a[k])
with image("nine_moving", extent, steps=[0.0, 1.0]) as f:
    a = np.stack([np.stack([volume((9, 11, 13), "<f4", 20 + 9 * t + k) for k in range(9)], -1)
                  for t in range(2)])
    f["VTKHDF"].create_dataset("PointData/tensor", data=a, chunks=(1, 4, 5, 6, 9))
    v = np.stack([np.stack([volume((9, 11, 13), "u1", 50 + 3 * t + k) for k in range(3)], -1)
                  for t in range(2)])
    keep(folder, "nine_moving", a[1, ..., 7])
with image("three_moving", extent, steps=[0.0, 1.0]) as f:
    f["VTKHDF"].create_dataset("PointData/v", data=v, chunks=(1, 4, 5, 6, 3))
    keep(folder, "three_moving", v[1])
with image("flat", (0, 12, 0, 10, 4, 4)) as f:
    a = volume((1, 11, 13), "u1", 6)
    f["VTKHDF"].create_dataset("PointData/f", data=a[0])
    keep(folder, "flat", a)
with image("wrong_size", (0, 12, 0, 10, 0, 7)) as f:
    f["VTKHDF"].create_dataset("PointData/a", data=volume((9, 11, 13), "u1", 7))
with image("bad_extent", (0, -9223372036854775807, 0, 10, 0, 7)) as f:
    f["VTKHDF"].create_dataset("PointData/a", data=volume((9, 11, 13), "u1", 7))
with image("grid", extent, kind="UnstructuredGrid") as f:
    pass
