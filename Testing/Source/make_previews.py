# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Writes volumes with one level, and the coarser ones that a reader may make of a few voxels of each
group: make_previews.py FOLDER."""
import json
import sys
import warnings

import h5py
import numpy as np

from format_files import keep, volume

folder = sys.argv[1]
warnings.simplefilter("ignore", RuntimeWarning)  # nanmean of nothing is NaN, as it should be


def preview(a, factors, labels=False):
    """The mean of the two voxels in the middle of a group along each axis; factors in z,y,x."""
    samples = []
    offsets = [[f // 2] if labels else [(f - 1) // 2, f // 2] for f in factors]
    for dz in offsets[0]:
        for dy in offsets[1]:
            for dx in offsets[2]:
                grid = [np.minimum(np.arange(-(-n // f)) * f + d, n - 1)
                        for n, f, d in zip(a.shape, factors, (dz, dy, dx))]
                samples.append(a[np.ix_(*grid)].astype(np.longdouble))
    mean = np.nanmean(samples, axis=0)
    mean[np.isnan(mean)] = np.nan  # of one sign
    return np.floor(mean + 0.5).astype(a.dtype) if a.dtype.kind in "iu" else mean.astype(a.dtype)


def write(name, a, factors, labels=False, **storage):
    with h5py.File(f"{folder}/{name}.h5", "w") as f:
        path = "seg/data/s0" if labels else "volume"
        f.create_dataset(path, data=a, **storage)
        if labels:
            f["seg"].attrs["painteraData"] = json.dumps({"type": "label"})
            f["seg"].attrs["multiScale"] = True
    keep(folder, name + "0", a)
    for i, factor in enumerate(factors, 1):
        keep(folder, f"{name}{i}", preview(a, factor, labels))


cube = [(2, 2, 2), (4, 4, 4), (8, 8, 8)]
# Rows one by one at the coarsest level, boxes of 64 before it.
write("rows", volume((40, 70, 600), "<u2", 1), [(2, 2, 2), (4, 4, 4), (8, 8, 8), (16, 16, 16)])
write("chunks", volume((131, 66, 260), "i1", 2), cube, chunks=(16, 32, 20), compression="gzip")
# Slice by slice: the finer levels would read each slice many times.
write("slices", volume((270, 150, 140), "u1", 3), [(4, 4, 4), (8, 8, 8)], chunks=(1, 150, 140))
holes = volume((90, 100, 300), "<f4", 4)
holes[30:60, 20:70, 100:200] = np.nan
write("holes", holes, cube, chunks=(32, 32, 32))
write("labels", volume((70, 80, 260), "<u4", 5) // 1000000, cube, True, chunks=(64, 64, 64))
# Few bits, so that sums are exact in any order; eight of them aren't finite.
huge = volume((66, 66, 130), "<f8", 6).astype("<f2").astype("<f8") * 2.0 ** 1017
write("huge", huge, [(2, 2, 2), (4, 4, 4)], chunks=(64, 64, 64))

with h5py.File(f"{folder}/colors.h5", "w") as f:  # (z,y,x,c)
    parts = [volume((66, 70, 140), "u1", seed) for seed in (7, 8, 9)]
    f.create_dataset("volume", data=np.stack(parts, -1), chunks=(32, 32, 32, 3))
for i, factor in enumerate([(1, 1, 1), (2, 2, 2), (4, 4, 4)]):
    keep(folder, f"colors{i}", np.stack([preview(p, factor) for p in parts], -1))

with h5py.File(f"{folder}/sparse.h5", "w") as f:  # one chunk of many is stored; more than 2^28 voxels
    d = f.create_dataset("volume", (700, 700, 600), "u1", chunks=(50, 50, 50), fillvalue=9)
    d[300:350, 100:150, 500:550] = 200
