# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Writes small HDF5 files that the tests open by dataset: make_hdf5_files.py FOLDER.

Every readable volume has value x + 10 y + 100 z (mod 251 for 8 bits) and shape (z,y,x) = (9,11,13).
"""
import sys

import h5py
import numpy as np

folder = sys.argv[1]
z, y, x = np.mgrid[0:9, 0:11, 0:13]
volume = x + 10 * y + 100 * z


def write(name, **options):
    data = options.pop("data", volume.astype(options.pop("dtype", "<u2")))
    with h5py.File(f"{folder}/{name}.h5", "w") as f:
        f.create_dataset("v", data=data, **options)


write("contiguous")
write("chunked", chunks=(4, 4, 4))
write("gzip", chunks=(4, 4, 4), compression="gzip")
write("gzip_shuffle_fletcher", chunks=(4, 5, 6), compression="gzip", shuffle=True, fletcher32=True)
write("big_endian", dtype=">u2", chunks=(4, 4, 4), compression="gzip", shuffle=True)
write("big_endian_float", dtype=">f8", chunks=(4, 4, 4))
write("scale_offset", dtype="<u2", chunks=(4, 4, 4), scaleoffset=0)
write("lzf", chunks=(4, 4, 4), compression="lzf")
write("one_chunk", chunks=(9, 11, 13), compression="gzip")
write("components", data=np.stack([volume, volume + 1, volume + 2], -1).astype("<u2"),
      chunks=(4, 4, 4, 3), compression="gzip")
write("split_components", data=np.stack([volume, volume + 1, volume + 2], -1).astype("<u2"),
      chunks=(4, 4, 4, 2), compression="gzip")
write("flat", data=volume[0].astype("<u2"), chunks=(4, 4))
# Bad ones.
write("compound", data=np.zeros((4, 4, 4), dtype=[("a", "u1"), ("b", "f4")]))
write("string", data=np.full((2, 2, 2), b"text", dtype="S4"))
write("int64", data=volume.astype("<i8"))
write("float16", data=volume.astype("<f2"))
write("rank1", data=np.arange(10, dtype="u1"))
with h5py.File(f"{folder}/zero.h5", "w") as f:
    f.create_dataset("v", shape=(4, 0, 4), dtype="u1")
with h5py.File(f"{folder}/huge.h5", "w") as f:
    f.create_dataset("v", shape=(4, 4, 2**31), dtype="u1", chunks=(4, 4, 4096))
with h5py.File(f"{folder}/unknown_filter.h5", "w") as f:
    plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plist.set_chunk((4, 4, 4))
    plist.set_filter(32013, h5py.h5z.FLAG_OPTIONAL, (0, 2))
    space = h5py.h5s.create_simple((9, 11, 13))
    h5py.h5d.create(f.id, b"v", h5py.h5t.STD_U16LE, space, plist)
with h5py.File(f"{folder}/empty.h5", "w") as f:
    f.create_group("nothing")


def image(name, **attributes):
    with h5py.File(f"{folder}/{name}.h5", "w") as f:
        g = f.create_group("VTKHDF")
        values = {
            "Version": np.array([1, 0]), "Type": np.bytes_("ImageData"),
            "WholeExtent": np.array([3, 15, 0, 10, 0, 8]), "Origin": np.array([1.0, 2.0, 3.0]),
            "Spacing": np.array([0.5, 1.0, 2.0]),
            "Direction": np.array([1.0, 0, 0, 0, 1, 0, 0, 0, 1])}
        values.update(attributes)
        for key, value in values.items():
            g.attrs[key] = value
        d = g.create_group("PointData")
        d.attrs["Scalars"] = np.bytes_("v")
        d.create_dataset("v", data=volume.astype("<u2"))


image("image")
image("negative_spacing", Spacing=np.array([0.5, -1.0, 2.0]))
image("singular", Direction=np.array([1.0, 1, 0, 1, 1, 0, 0, 0, 1]))
with h5py.File(f"{folder}/unfinished.h5", "w") as f:
    pass
image("unfinished")
with h5py.File(f"{folder}/unfinished.h5", "r+") as f:
    f.create_group("Pyramid")
