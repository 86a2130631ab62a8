# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Writes files with one level, each as its layout has it: make_single.py FOLDER."""
import json
import sys

import h5py
import numpy as np

from format_files import keep, volume

folder = sys.argv[1]
a = volume((9, 11, 13), "<u2", 1)  # z, y, x
keep(folder, "a", a)

with h5py.File(f"{folder}/emd.emd", "w") as f:
    f.attrs["version_major"], f.attrs["version_minor"] = np.uint32(0), np.uint32(2)
    g = f.create_group("data/tomography")
    g.attrs["emd_group_type"] = np.uint32(1)
    # dim1 is x and varies slowest.
    d = g.create_dataset("data", data=np.ascontiguousarray(a.transpose(2, 1, 0)),
                         chunks=(5, 4, 3), compression="gzip")
    d.attrs["name"] = "intensity"
    for i, (n, step) in enumerate([(13, 0.5), (11, 0.25), (9, 2.0)], 1):
        dim = g.create_dataset(f"dim{i}", data=(10 * i + step * np.arange(n)).astype("<f4"))
        dim.attrs["name"], dim.attrs["units"] = "xyz"[i - 1], "[n_m]"
with h5py.File(f"{folder}/exchange.h5", "w") as f:
    f.create_dataset("exchange/data", data=a)
    f.create_dataset("exchange/data_dark", data=a[:2])
    f.create_dataset("exchange/theta", data=np.arange(9.0))
with h5py.File(f"{folder}/nexus.nxs", "w") as f:
    f.attrs["default"] = "second"
    for name in ("first", "second"):
        e = f.create_group(name)
        e.attrs["NX_class"], e.attrs["default"] = "NXentry", "recon"
        for child in ("other", "recon"):
            g = e.create_group(child)
            g.attrs["NX_class"], g.attrs["signal"] = "NXdata", "counts"
            right = (name, child) == ("second", "recon")
            g.create_dataset("counts", data=a if right else a * 0, chunks=(3, 11, 13))
    g.attrs["axes"] = ["slice", ".", "column"]
    g.create_dataset("slice", data=5.0 + 1.5 * np.arange(9))
    g.create_dataset("column", data=np.array([2.0 + i * i for i in range(13)]))  # uneven
# MINC 2: z runs backwards, x and y are turned about it; a series, and vectors.
cosine, sine = np.cos(0.3), np.sin(0.3)
axes = {"xspace": (0.5, -10, (cosine, sine, 0)), "yspace": (0.75, -20, (-sine, cosine, 0)),
        "zspace": (-2, 30, (0, 0, 1)), "time": (0.25, 1, None)}
for name, order, b in (("minc", "zspace,yspace,xspace", a), ("turned", "xspace,zspace,yspace", a.transpose(2, 0, 1)),
                       ("times", "time,zspace,yspace,xspace", np.stack([a // 2, a])),
                       ("vectors", "zspace,yspace,xspace,vector_dimension", np.stack([a, a // 2, a // 3], -1)),
                       ("twice", "zspace,zspace,xspace", a), ("other", "zspace,yspace,frequency", a)):
    with h5py.File(f"{folder}/{name}.mnc", "w") as f:
        for axis, (step, start, direction) in axes.items():
            d = f.create_dataset(f"minc-2.0/dimensions/{axis}", data=np.int32(0))
            d.attrs["step"], d.attrs["start"], d.attrs["units"] = float(step), float(start), np.bytes_("mm")
            if direction and axis != "zspace":
                d.attrs["direction_cosines"] = np.array(direction)
        g = f.create_group("minc-2.0/image/0")
        d = g.create_dataset("image", data=np.ascontiguousarray(b), chunks=True, compression="gzip")
        d.attrs["dimorder"] = np.bytes_(order)
        d.attrs["valid_range"] = np.array([0.0, 65535.0])
        g.create_dataset("image-min", data=np.zeros(9))
        g.create_dataset("image-max", data=np.arange(9.0) if name == "turned" else np.full(9, 100.0))
with open(f"{folder}/first.mnc", "wb") as f:
    f.write(b"CDF\1" + bytes(60))
keep(folder, "vectors", np.ascontiguousarray(np.stack([a, a // 2, a // 3], -1)))
with h5py.File(f"{folder}/ilastik.h5", "w") as f:
    b = np.stack([a, a + 1], 0)  # c, z, y, x
    d = f.create_dataset("exported_data", data=np.ascontiguousarray(b.transpose(3, 2, 1, 0)),
                         chunks=(6, 5, 4, 2), compression="gzip")
    d.attrs["axistags"] = json.dumps({"axes": [{"key": k} for k in "xyzc"]})
    keep(folder, "ilastik", np.ascontiguousarray(b.transpose(1, 2, 3, 0)))
with h5py.File(f"{folder}/many.h5", "w") as f:
    rng = np.random.default_rng(2)
    t = rng.integers(0, 60000, (3, 9, 11, 13)).astype("<u2")
    f.create_dataset("time", data=t, chunks=(2, 4, 4, 8), compression="gzip")
    keep(folder, "time.2", t[2])
    tc = rng.integers(0, 60000, (2, 3, 9, 11, 13)).astype("<u2")
    f.create_dataset("five", data=tc)
    keep(folder, "five.1.2", tc[1, 2])
    f.create_dataset("rgb", data=tc[0].transpose(1, 2, 3, 0), chunks=(4, 4, 4, 3))
    keep(folder, "rgb", np.ascontiguousarray(tc[0].transpose(1, 2, 3, 0)))
    d = f.create_dataset("labelled", data=np.ascontiguousarray(a.transpose(1, 0, 2)),
                         chunks=(4, 4, 4), scaleoffset=0)
    for axis, label in zip(d.dims, "yzx"):
        axis.label = label
    d.attrs["element_size_um"] = np.array([3.0, 2.0, 1.0])
    f.create_dataset("deep/er/still", data=a)
    f["deep/er/loop"] = h5py.SoftLink("/deep")
    f.create_dataset("boolean", data=a > 30000)
    keep(folder, "boolean", (a > 30000).astype("u1"))
    f.create_dataset("bad_tags", data=a).attrs["axistags"] = json.dumps({"axes": [{"key": "x"}] * 3})
with h5py.File(f"{folder}/one.h5", "w") as f:
    f.create_dataset("some/where", data=a)
    f.create_dataset("table", data=np.zeros((4, 4)))
# 2^31 + 2^33 voxels, nothing stored but one corner.
with h5py.File(f"{folder}/large.h5", "w") as f:
    d = f.create_dataset("v", shape=(2500, 2000, 2100), dtype="u1", chunks=(64, 64, 64))
    d[2436:2500, 1936:2000, 2048:2100] = 7
