# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Writes one volume as an image of every kind that is converted piece by piece: make_streams.py FOLDER.

Each is larger than the memory that the tests allow. `volume.bin` holds the voxels alone; its size is
in DIMENSIONS of the test.
"""
import gzip
import os
import struct
import sys

import h5py
import numpy as np

from format_files import keep
from image_files import dicom, meta, mrc, nifti, tiff, vtk

folder = sys.argv[1]
z, y, x = np.ogrid[0:224, 0:256, 0:288]
noise = np.random.default_rng(1).integers(0, 8, (32, 256, 288)).astype("<u2")
a = ((x * y // 16 + 40 * z) % 4000).astype("<u2")
a += np.tile(noise, (7, 1, 1))
keep(folder, "volume", a)


def put(name, *parts):
    os.makedirs(os.path.dirname(f"{folder}/{name}"), exist_ok=True)
    with open(f"{folder}/{name}", "wb") as f:
        for part in parts:
            f.write(part)


raw = a.tobytes()
put("plain.mha", meta(a, "LOCAL"), raw)
put("packed.nii.gz", gzip.compress(nifti(a, "<") + raw, 1))
put("plain.mrc", mrc(a))
put("binary.vtk", vtk(a, a.astype(">u2").tobytes(), "BINARY"))
words = np.char.mod("%d ", np.arange(4008)).astype("S5")  # a line of text for each row of voxels
lines = [b"".join(words[row]) + b"\n" for row in a.reshape(-1, a.shape[2])]
put("text.vtk", vtk(a, b"", "ASCII"), *lines)
put("text.nrrd", b"NRRD0004\ntype: ushort\ndimension: 3\nsizes: 288 256 224\nencoding: ascii\n\n", *lines)
grey = np.arange(256) * 257
indices = (a & 255).astype("u1")
keep(folder, "indices", indices)
put("palette.tif", tiff(indices, packed=True, strip=64, palettes=[[grey] * 3] * a.shape[0]))
put("pages.tif", tiff(a, packed=True, strip=64))
for k in range(a.shape[0]):
    put(f"stack/slice{k}.tif", tiff(a[k:k + 1]))
    put(f"series/{k}.dcm", dicom(a[k], (0, 0, 2.0 * k)))


def vti(name, part, extent):
    content = np.ascontiguousarray(part).tobytes()
    put(name, (f'<?xml version="1.0"?>\n<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" '
               f'header_type="UInt64">\n<ImageData WholeExtent="{extent}" Origin="0 0 0" Spacing="1 1 1">\n'
               f'<Piece Extent="{extent}"><PointData Scalars="v"><DataArray type="UInt16" Name="v" '
               f'format="appended" offset="0"/></PointData></Piece></ImageData>\n'
               f'<AppendedData encoding="raw">_').encode(), struct.pack("<Q", len(content)), content,
        b"\n</AppendedData></VTKFile>\n")


vti("plain.vti", a, "0 287 0 255 0 223")
index = b""
for part, (i, j, k) in enumerate(np.ndindex(2, 2, 4)):  # that overlap by a layer
    x, y, z = [(n, min(n + d, last)) for n, d, last in ((144 * i, 144, 287), (128 * j, 128, 255), (56 * k, 56, 223))]
    extent = f"{x[0]} {x[1]} {y[0]} {y[1]} {z[0]} {z[1]}"
    vti(f"part{part}.vti", a[z[0]:z[1] + 1, y[0]:y[1] + 1, x[0]:x[1] + 1], extent)
    index += f'<Piece Extent="{extent}" Source="part{part}.vti"/>\n'.encode()
put("pieces.pvti", b'<?xml version="1.0"?>\n<VTKFile type="PImageData" version="1.0" byte_order="LittleEndian">\n'
    b'<PImageData WholeExtent="0 287 0 255 0 223" GhostLevel="0" Origin="0 0 0" Spacing="1 1 1">\n'
    b'<PPointData Scalars="v"><PDataArray type="UInt16" Name="v"/></PPointData>\n' + index +
    b"</PImageData></VTKFile>\n")
with h5py.File(f"{folder}/chunks.h5", "w") as f:
    f.create_dataset("v", data=a, chunks=(32, 32, 32), compression="lzf")
