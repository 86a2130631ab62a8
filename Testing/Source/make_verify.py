# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Writes pyramids of which one is right and the others are wrong as pyramids are: make_verify.py
FOLDER."""
import sys

import h5py
import numpy as np

from format_files import halved, volume

folder = sys.argv[1]
a = volume((33, 42, 51), "<u2", 1)
ceil = tuple(-(-n // 2) for n in a.shape)
right = halved(a, (2, 2, 2), ceil)
zeros = halved(np.pad(a, [(0, 1), (0, 0), (0, 1)]), (2, 2, 2), ceil)
# Averages of what there is of a group that is cut off are those with the last voxels repeated.
levels = {
    "right": right, "floored": halved(a, (2, 2, 2)), "moved": np.roll(right, 1, 2),
    "decimated": a[::2, ::2, ::2], "dark": zeros, "noise": right // 2}
levels["moved"][:, :, 0] = right[:, :, 0]
for name, level in levels.items():
    with h5py.File(f"{folder}/{name}.h5", "w") as f:
        g = f.create_group("v")
        for i, b in enumerate((a, level)):
            g.create_dataset(f"s{i}", data=b, chunks=(8, 16, 16), compression="gzip",
                             fletcher32=True)
        g["s1"].attrs["downsamplingFactors"] = np.array([2.0, 2.0, 2.0])
with h5py.File(f"{folder}/right.h5", "r") as f:
    info = f["v/s0"].id.get_chunk_info(5)
    offset, size = info.byte_offset, info.size
data = bytearray(open(f"{folder}/right.h5", "rb").read())
data[offset + size // 2] ^= 0x10
open(f"{folder}/bit.h5", "wb").write(data)
