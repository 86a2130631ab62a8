# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Writes N5 layouts in HDF5, as n5-hdf5, Paintera and bdv-core have them: make_n5.py FOLDER."""
import json
import sys

import h5py
import numpy as np

from format_files import halved, keep, volume

folder = sys.argv[1]
rows = [(1, 1, 1), (2, 2, 1), (4, 4, 2)]  # x, y, z


def levels(group, name, a, per_level=True, ceil=False):
    for level, r in enumerate(rows):
        f = r[::-1]
        b = halved(a, f, tuple(-(-n // k) for n, k in zip(a.shape, f)) if ceil else None)
        d = group.create_dataset(f"s{level}", data=b, chunks=tuple(min(16, n) for n in b.shape),
                                 compression="gzip")
        if per_level and level > 0:
            d.attrs["downsamplingFactors"] = np.array(r, "<f8")
        keep(folder, f"{name}.{level}", b)


with h5py.File(f"{folder}/plain.h5", "w") as f:
    g = f.create_group("volumes/raw")
    g.attrs["multiScale"] = True
    g.attrs["resolution"] = np.array([4.0, 4.0, 40.0])
    g.attrs["offset"] = np.array([1.0, 2.0, 3.0])
    levels(g, "plain", volume((17, 38, 45), "<u2", 1), ceil=True)
    f["volumes/again"] = f["volumes"]  # a cycle
# Nothing but the names; factors follow from the sizes.
with h5py.File(f"{folder}/names.h5", "w") as f:
    levels(f.create_group("a/b"), "names", volume((17, 38, 45), "u1", 2), per_level=False)
# Attributes as JSON texts.
with h5py.File(f"{folder}/json.h5", "w") as f:
    g = f.create_group("raw")
    g.attrs["multiScale"] = "true"
    g.attrs["downsamplingFactors"] = json.dumps(rows)
    g.attrs["resolution"] = "[2, 3, 5]"
    levels(g, "json", volume((17, 38, 45), "<f4", 3), per_level=False)
with h5py.File(f"{folder}/paintera.h5", "w") as f:
    g = f.create_group("segmentation")
    g.attrs["painteraData"] = json.dumps({"type": "label"})
    g.attrs["maxId"] = 7
    data = g.create_group("data")
    data.attrs["multiScale"] = True
    data.attrs["resolution"] = np.array([1.0, 1.0, 10.0])
    levels(data, "paintera", (volume((17, 38, 45), "<u4", 4) >> 27).astype("<u4"))
# 64-bit integers, as labels often are.
with h5py.File(f"{folder}/wide.h5", "w") as f:
    a = (volume((17, 20, 21), "<u4", 4) + 3e9).astype("<u8")
    s = volume((17, 20, 21), "<u4", 5).astype("<i8") - 10**9
    f.create_dataset("labels", data=a, chunks=(8, 8, 8), compression="gzip", shuffle=True)
    f.create_dataset("signed", data=s.astype(">i8"))
    f.create_dataset("scaled", data=s, chunks=(8, 8, 8), scaleoffset=0)
    f.create_dataset("turned", data=np.asfortranarray(a.T).copy("C"), chunks=(8, 8, 8))
    for axis, label in zip(f["turned"].dims, "xyz"):
        axis.label = label
    a[16, 19, 20] = 2**32
    f.create_dataset("beyond", data=a, chunks=(4, 4, 4), fillvalue=5)
    f.create_dataset("fill", data=a, chunks=(8, 8, 8), fillvalue=2**40)
    a[16, 19, 20] = 7
    f["labels"][16, 19, 20] = f["turned"][20, 19, 16] = 7
    keep(folder, "wide.labels", a.astype("<u4"))
    keep(folder, "wide.signed", s.astype("<i4"))
with h5py.File(f"{folder}/multiset.h5", "w") as f:
    g = f.create_group("segmentation")
    g.attrs["painteraData"] = json.dumps({"type": "label"})
    g.create_dataset("data/s0", data=np.zeros((2, 2, 2), "u1"))
    g["data"].attrs["isLabelMultiset"] = True
with h5py.File(f"{folder}/views.h5", "w") as f:
    for s in range(2):
        f.create_group(f"setup{s}").attrs["downsamplingFactors"] = np.array(rows, "<i8")
        for t in (0, 3):
            g = f.create_group(f"setup{s}/timepoint{t}")
            g.attrs["multiScale"] = True
            g.attrs["resolution"] = np.array([0.5, 0.5, 1.0 + s])
            levels(g, f"views.{t}.{s}", volume((9, 20, 30), "<u2", 20 + t + s), per_level=False)
with h5py.File(f"{folder}/fraction.h5", "w") as f:
    g = f.create_group("raw")
    g.attrs["multiScale"] = True
    g.create_dataset("s0", data=np.zeros((6, 6, 6), "u1"))
    g.create_dataset("s1", data=np.zeros((4, 4, 4), "u1"))
    g["s1"].attrs["downsamplingFactors"] = np.array([1.5, 1.5, 1.5])
