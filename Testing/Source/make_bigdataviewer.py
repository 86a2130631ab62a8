# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Writes BigDataViewer HDF5 and XML files as bdv-core does: make_bigdataviewer.py FOLDER.

legacy.h5/.xml: int16 that are uint16 by bits, scale-offset and deflate, anisotropic levels, two
set-ups, two time points; pyflavour.h5 without XML: uint8, gzip, levels by ceiling, blocks left out;
parts.h5: partitions by external links, of which one is missing.
"""
import os
import sys

import h5py
import numpy as np

from format_files import halved, keep, volume

folder = sys.argv[1]
resolutions = [(1, 1, 1), (2, 2, 1), (4, 4, 2)]  # x, y, z


def pyramid(a, rows=resolutions, ceil=False):
    levels = []
    for r in rows:
        f = r[::-1]
        shape = tuple(-(-n // k) for n, k in zip(a.shape, f)) if ceil else None
        levels.append(halved(a, f, shape))
    return levels


def tables(f, setup, rows=resolutions, data_type=None, resolution_type="<f8"):
    g = f.create_group(f"s{setup:02d}")
    g.create_dataset("resolutions", data=np.array(rows, resolution_type))
    g.create_dataset("subdivisions", data=np.array([(16, 16, 8)] * len(rows), "<i4"))
    if data_type:
        g.attrs["dataType"] = data_type


def scaled(group, name, a, chunk, fill=None):
    """Scale-offset, then deflate: INT_AUTO_SCALING_DEFLATE of JHDF5."""
    plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plist.set_chunk(tuple(min(c, n) for c, n in zip(chunk, a.shape)))
    plist.set_scaleoffset(h5py.h5z.SO_INT, 0)
    plist.set_deflate(4)
    if fill is not None:
        plist.set_fill_value(np.array(fill, a.dtype))
    space = h5py.h5s.create_simple(a.shape)
    gid = group.id
    d = h5py.h5d.create(gid, name.encode(), h5py.h5t.py_create(a.dtype), space, plist)
    h5py.Dataset(d)[...] = a


XML = """<?xml version="1.0" encoding="UTF-8"?>
<SpimData version="0.2">
  <BasePath type="relative">.</BasePath>
  <SequenceDescription>
    <ImageLoader format="{format}"><hdf5 type="relative">{file}</hdf5></ImageLoader>
    <ViewSetups>
      <ViewSetup><id>0</id><name>Left arm</name><size>43 37 13</size>
        <voxelSize><unit>micrometer</unit><size>0.5 0.5 2.0</size></voxelSize></ViewSetup>
      <ViewSetup><id>1</id><size>43 37 13</size>
        <voxelSize><unit>micrometer</unit><size>0.25 0.5 1.5</size></voxelSize></ViewSetup>
    </ViewSetups>
    <Timepoints type="range"><first>0</first><last>1</last></Timepoints>
  </SequenceDescription>
  <ViewRegistrations>
    <ViewRegistration timepoint="1" setup="0">
      <ViewTransform type="affine"><affine>1.0 0.0 0.0 100.0 0.0 1.0 0.0 -20.0 0.0 0.0 1.0 5.0</affine></ViewTransform>
      <ViewTransform type="affine"><affine>0.0 -0.5 0.0 0.0 0.5 0.0 0.0 0.0 0.0 0.0 {z} 0.0</affine></ViewTransform>
    </ViewRegistration>
  </ViewRegistrations>
</SpimData>
"""

with h5py.File(f"{folder}/legacy.h5", "w") as f:
    for s in range(2):
        tables(f, s)
        for t in range(2):
            for level, a in enumerate(pyramid(volume((13, 37, 43), "<u2", 5 + 10 * t + s))):
                g = f.create_group(f"t{t:05d}/s{s:02d}/{level}")
                scaled(g, "cells", a.view("<i2"), (8, 16, 16))
                keep(folder, f"legacy.{t}.{s}.{level}", a)
with open(f"{folder}/legacy.xml", "w") as out:
    out.write(XML.format(format="bdv.hdf5", file="legacy.h5", z="2.0"))
os.mkdir(f"{folder}/elsewhere")
with open(f"{folder}/elsewhere/moved.xml", "w") as out:
    out.write(XML.format(format="bdv.hdf5", file="../legacy.h5", z="2.0"))
for name, values in {"singular.xml": dict(format="bdv.hdf5", file="legacy.h5", z="0.0"),
                     "words.xml": dict(format="bdv.hdf5", file="legacy.h5", z="two"),
                     "n5.xml": dict(format="bdv.n5", file="legacy.n5", z="2.0"),
                     "lost.xml": dict(format="bdv.hdf5", file="lost.h5", z="2.0")}.items():
    with open(f"{folder}/{name}", "w") as out:
        out.write(XML.format(**values))
with open(f"{folder}/cut.xml", "w") as out:
    out.write(XML[:700])

# True types, with and without the attribute; blocks of zeros aren't written.
with h5py.File(f"{folder}/pyflavour.h5", "w") as f:
    tables(f, 0, rows=[(1, 1, 1), (2, 2, 2)], resolution_type="<f4")
    a = volume((40, 48, 45), "u1", 9)
    a[:, :, 20:] = 0
    for level, a in enumerate(pyramid(a, [(1, 1, 1), (2, 2, 2)], ceil=True)):
        d = f.create_group(f"t00000/s00/{level}").create_dataset(
            "cells", shape=a.shape, dtype="u1", chunks=(8, 8, 8), compression="gzip")
        for z in range(0, a.shape[0], 8):
            for y in range(0, a.shape[1], 8):
                for x in range(0, a.shape[2], 8):
                    block = a[z:z + 8, y:y + 8, x:x + 8]
                    if block.any():
                        d[z:z + 8, y:y + 8, x:x + 8] = block
        keep(folder, f"pyflavour.{level}", a)

# Signed data say so; 32-bit unsigned ones are stored as signed.
for name, data_type, stored in (("signed", "int16", "<i2"), ("wide", "uint32", "<i4")):
    with h5py.File(f"{folder}/{name}.h5", "w") as f:
        tables(f, 0, rows=[(1, 1, 1)], data_type=data_type)
        a = (volume((6, 8, 10), "<u4", 3).astype("<u8") * 4).astype("<u4") if name == "wide" else (
            volume((6, 8, 10), "<u2", 3).astype("<i4") - 30000).astype("<i2")
        f.create_dataset("t00000/s00/0/cells", data=a.view(stored), chunks=(4, 4, 4))
        keep(folder, name, a)

# Partitions: one a time point.
with h5py.File(f"{folder}/parts.h5", "w") as f:
    tables(f, 0, rows=[(1, 1, 1)])
    for t in range(2):
        a = volume((6, 8, 10), "<u2", 30 + t)
        part = f"parts-{t:02d}-00.h5"
        if t == 0:
            with h5py.File(f"{folder}/{part}", "w") as p:
                p.create_dataset("t00000/s00/0/cells", data=a.view("<i2"), chunks=(4, 4, 4))
            keep(folder, "parts", a)
        f[f"t{t:05d}/s00/0/cells"] = h5py.ExternalLink(part, f"/t{t:05d}/s00/0/cells")
    f["t00002/s00/0/cells"] = h5py.ExternalLink("pipe.h5", "/cells")
os.mkfifo(f"{folder}/pipe.h5")

# Scale-offset alone: every width of integers, signs, fill values, both byte orders.
with h5py.File(f"{folder}/scaleoffset.h5", "w") as f:
    rng = np.random.default_rng(4)
    for dtype in ("u1", "i1", "<u2", "<i2", ">u2", ">i2", "<u4", "<i4", ">i4"):
        info = np.iinfo(np.dtype(dtype))
        for bits in (0, 1, 5, 8, 13, 16, 27, 32):
            if bits > info.bits:
                continue
            span = 2**bits if bits < info.bits else 2**bits - 1
            low = info.min if bits % 2 else max(info.max - span, info.min)
            a = (low + rng.integers(0, span, (9, 11, 13))).astype(dtype)
            name = f"{dtype.replace('<', '').replace('>', 'be')}.{bits}"
            scaled(f, name, a, (4, 4, 8), fill=low if bits in (5, 13) else None)
            keep(folder, "scaleoffset." + name, a)
