# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Writes a dataset `v` per filter and type: make_filters.py FOLDER.

Where HDF5 has the filter, h5py writes. Else the chunks are made here, as the filters' authors
describe them, with the codecs of numcodecs, and written as they are. `names.txt` lists the files:
name, bytes per voxel, x, y, z.
"""
import itertools
import struct
import sys

import h5py
import numpy as np
from numcodecs import lz4, zstd

from format_files import keep, volume

folder = sys.argv[1]
shape = (21, 34, 45)
names = []


def coarse(shape, dtype, seed):
    """Few of the bits have noise: LZF finds nothing in what has no repetitions."""
    a = volume(shape, dtype, seed)
    bits = a.dtype.itemsize * 8
    plain = a.view(a.dtype.str.replace("f", "u").replace("i", "u"))
    return (plain >> (bits // 2) << (bits // 2)).astype(plain.dtype).view(a.dtype)


def listed(name, a):
    keep(folder, name, a)
    names.append(f"{name} {a.dtype.itemsize} {a.shape[2]} {a.shape[1]} {a.shape[0]}\n")


def by_library(name, a, chunks, **options):
    with h5py.File(f"{folder}/{name}.h5", "w") as f:
        f.create_dataset("v", data=a, chunks=chunks, **options)
    listed(name, a)


def by_hand(name, a, chunks, filter_id, parameters, encode, shuffled=False):
    """The first chunk has no value, the second one is stored without its filters."""
    a = a.copy()
    a[tuple(slice(0, c) for c in chunks)] = 0
    with h5py.File(f"{folder}/{name}.h5", "w") as f:
        plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        plist.set_chunk(chunks)
        if shuffled:
            plist.set_shuffle()
        plist.set_filter(filter_id, h5py.h5z.FLAG_OPTIONAL, parameters)
        d = h5py.h5d.create(f.id, b"v", h5py.h5t.py_create(a.dtype), h5py.h5s.create_simple(a.shape),
                            plist)
        padded = np.pad(a, [(0, -n % c) for n, c in zip(a.shape, chunks)])
        grid = itertools.product(*[range(0, n, c) for n, c in zip(padded.shape, chunks)])
        for i, offset in enumerate(grid):
            block = padded[tuple(slice(o, o + c) for o, c in zip(offset, chunks))].tobytes()
            if i == 1:
                d.write_direct_chunk(offset, block, 3 if shuffled else 1)
            elif i > 1:
                if shuffled:
                    block = np.frombuffer(block, "u1").reshape(-1, a.dtype.itemsize).T.tobytes()
                d.write_direct_chunk(offset, encode(block), 0)
    listed(name, a)


def transposed(block, element):
    """Bits of whole elements, their number a multiple of eight: all first bits, all second ones ..."""
    bytes_ = np.frombuffer(block, "u1").reshape(-1, element)
    bits = np.unpackbits(bytes_, axis=1, bitorder="little")
    return np.packbits(bits.T, axis=1, bitorder="little").tobytes()


def bitshuffled(element, block_size, code):
    """The encoder of filter 32008; block_size in elements, code(bytes) or None."""
    def encode(data):
        count = len(data) // element
        out = b"" if code is None else struct.pack(">QI", len(data), block_size * element)
        at = 0
        while count - at >= 8:
            n = min(block_size, (count - at) // 8 * 8)
            bits = transposed(data[at * element:(at + n) * element], element)
            out += bits if code is None else struct.pack(">I", len(code(bits))) + code(bits)
            at += n
        return out + data[at * element:]
    return encode


def lz4_block(data):
    return lz4.compress(data, 1)[4:]  # numcodecs puts the size before it


types = ["<u1", "<i2", "<u2", ">u2", "<u4", "<f4", "<f8"]
for seed, dtype in enumerate(types):
    a = coarse(shape, dtype, seed)
    size = a.dtype.itemsize
    tag = {"<": "", ">": "big_"}[dtype[0]] + dtype[1:]
    by_library(f"lzf_{tag}", a, (8, 16, 20), compression="lzf", shuffle=size > 2)
    by_library(f"blosc_{tag}", a, (10, 16, 20), compression=32001,
               compression_opts=(0, 0, 0, 0, 5, seed % 3, [0, 1, 2, 4, 5][seed % 5]))
    if dtype[1] != "f":
        for coding, pixels in (("nn", 8), ("ec", 32)):
            # Entropy coding alone gains from small values only.
            b = a if coding == "nn" else (a >> (size * 6)).astype(a.dtype)
            by_library(f"szip_{coding}_{tag}", b, (7, 9, 21 if pixels == 8 else 45),
                       compression="szip", compression_opts=(coding, pixels))
    by_hand(f"zstd_{tag}", a, (8, 16, 20), 32015, (3,), lambda b: zstd.compress(b, 3),
            shuffled=size == 4)
    usual = max(8192 // size // 8 * 8, 128)
    # 7 x 9 x 11 voxels: no multiple of eight, and several blocks where one is small.
    for kind, block, chunks in (("", 0, (8, 16, 20)), ("small_", 64, (7, 9, 11))):
        for name, coding, code in (("bits", 0, None), ("bits_lz4", 2, lz4_block),
                                   ("bits_zstd", 3, lambda b: zstd.compress(b, 1))):
            by_hand(f"{name}_{kind}{tag}", a, chunks, 32008, (0, 4, size, block, coding),
                    bitshuffled(size, block or usual, code))
by_library("lzf_fletcher", coarse(shape, "<u2", 9), (8, 16, 20), compression="lzf", fletcher32=True)

# Noise: what a codec can't shrink.
noise = np.random.default_rng(3).integers(0, 65536, shape).astype("<u2")
by_library("noise_lzf", noise, (8, 16, 20), compression="lzf")
by_library("noise_blosc", noise, (8, 16, 20), compression=32001,
           compression_opts=(0, 0, 0, 0, 9, 1, 1))
by_hand("noise_zstd", noise, (8, 16, 20), 32015, (3,), lambda b: zstd.compress(b, 3))
by_hand("noise_bits_lz4", noise, (8, 16, 20), 32008, (0, 4, 2, 8, 2),
        bitshuffled(2, 8, lz4_block))

with open(f"{folder}/names.txt", "w") as f:
    f.writelines(names)
