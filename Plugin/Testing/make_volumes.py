#!/usr/bin/env python3
# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the volumes of the tests: make_volumes.py <folder>. Runs outside of ParaView, with h5py.

shells.h5    BigDataViewer, 2 set-ups, 2 time points, 176 x 160 x 144 voxels of 16 bits, 3 levels
huge.h5      BigDataViewer, 1 TiB of voxels of 16 bits, 9 levels, of which a ball in the middle of
             the volume and a column along x are stored, 2 MiB
plain.h5     a single dataset of 4 TiB without levels, nothing of it stored
vast.h5      a single dataset of 16 EiB without levels, nothing of it stored
corner.h5    a single dataset of 96^3 voxels of 8 bits; only a corner of 40^3 is stored
step_N.h5    a series: N = 0, 1, 2, constant volumes of value 10 (N + 1)
"""
import os
import sys

import h5py
import numpy as np


def half(a):
    """Box average by 2 along each axis, of even dimensions."""
    z, y, x = (n // 2 for n in a.shape)
    return a.reshape(z, 2, y, 2, x, 2).mean(axis=(1, 3, 5)).astype(a.dtype)


def shells(setup, time):
    z, y, x = np.mgrid[0:144, 0:160, 0:176].astype(np.float32)
    r = np.sqrt((x - 80) ** 2 + 1.2 * (y - 85) ** 2 + 0.8 * (z - 70) ** 2)
    value = 12000 + 9000 * np.cos(r / (6 + time)) * np.exp(-((r / 55) ** 2)) + 8000 * setup
    return value.astype("<i2")


def tables(f, setup, levels):
    group = f.create_group("s%02d" % setup)
    group["resolutions"] = np.array([(2**k,) * 3 for k in range(levels)], "<f8")
    group["subdivisions"] = np.array([(32,) * 3] * levels, "<i4")


def write_shells(folder):
    with h5py.File(os.path.join(folder, "shells.h5"), "w") as f:
        for setup in range(2):
            tables(f, setup, 3)
            for time in range(2):
                level = shells(setup, time)
                for k in range(3):
                    path = "t%05d/s%02d/%d/cells" % (time, setup, k)
                    f.create_dataset(path, data=level, chunks=(16, 32, 32), compression=1)
                    level = half(level) if k < 2 else level


def write_huge(folder):
    with h5py.File(os.path.join(folder, "huge.h5"), "w") as f:
        n, levels = 8192, 9
        tables(f, 0, levels)
        for k in range(levels):
            m = n >> k
            d = f.create_dataset("t00000/s00/%d/cells" % k, shape=(m,) * 3, dtype="<i2",
                                 chunks=(32,) * 3)
            # A ball of 64 level-0 voxels across and, where it is no more than 64 voxels of this
            # level, what is a 32nd of the volume across.
            for size in (64 >> k, 256 >> k):
                if 2 <= size <= 64:
                    a = m // 2 - size // 2
                    c = np.arange(size) + 0.5 - size / 2
                    r2 = c[:, None, None] ** 2 + c[None, :, None] ** 2 + c[None, None, :] ** 2
                    ball = np.where(r2 <= size * size / 4, 20000, 0).astype("<i2")
                    d[a:a + size, a:a + size, a:a + size] = ball
            if m <= 1024:
                w = max(m // 16, 1)
                d[m // 4:m // 4 + w, m // 4:m // 4 + w, :] = 12000


def write_plain(folder):
    with h5py.File(os.path.join(folder, "plain.h5"), "w") as f:
        f.create_dataset("volume", shape=(16384, 16384, 16384), dtype="u1", chunks=(128,) * 3)


def write_vast(folder):
    with h5py.File(os.path.join(folder, "vast.h5"), "w") as f:
        f.create_dataset("volume", shape=(2**21, 2**21, 2**21), dtype="<i2", chunks=(128,) * 3)


def write_corner(folder):
    with h5py.File(os.path.join(folder, "corner.h5"), "w") as f:
        d = f.create_dataset("volume", shape=(96,) * 3, dtype="u1", chunks=(16,) * 3, compression=1)
        d[:40, :40, :40] = np.random.default_rng(5).integers(60, 250, (40, 40, 40))


def write_series(folder):
    for n in range(3):
        with h5py.File(os.path.join(folder, "step_%d.h5" % n), "w") as f:
            f.create_dataset("volume", data=np.full((24, 20, 16), 10 * (n + 1), "u1"),
                             chunks=(8, 8, 8))


if __name__ == "__main__":
    target = sys.argv[1]
    os.makedirs(target, exist_ok=True)
    write_shells(target)
    write_huge(target)
    write_plain(target)
    write_vast(target)
    write_corner(target)
    write_series(target)
