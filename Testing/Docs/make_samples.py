# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the files of a reader of docs/getting-started.md here: make_samples.py cells|tomograph|simulation"""
import sys

import h5py
import numpy as np


def grid(*shape):
    return np.meshgrid(*(np.linspace(-1, 1, n, dtype="f4") for n in shape), indexing="ij")


def text(group, name, value):
    """Imaris' texts: arrays of strings of one character."""
    group.attrs.create(name, np.frombuffer(str(value).encode(), dtype="S1"))


def halved(a):
    """Every two voxels along each axis averaged; a last odd one is left out."""
    z, y, x = (n // 2 for n in a.shape)
    a = a[: 2 * z, : 2 * y, : 2 * x].reshape(z, 2, y, 2, x, 2)
    return a.mean((1, 3, 5)).astype("u2")


def cells():
    """Two channels of blobs with and without an inside, two time points, two levels."""
    rng = np.random.default_rng(1)
    shape = (48, 96, 128)
    z, y, x = grid(*shape)
    nuclei, membrane = np.zeros(shape, "f4"), np.zeros(shape, "f4")
    for center in rng.uniform(-0.8, 0.8, (24, 3)):
        r = np.sqrt((z - center[0]) ** 2 + (y - center[1]) ** 2 + (x - center[2]) ** 2)
        nuclei = np.maximum(nuclei, np.exp(-((r / 0.12) ** 4)))
        membrane = np.maximum(membrane, np.exp(-(((r - 0.2) / 0.03) ** 2)))
    with h5py.File("cells.ims", "w", libver=("earliest", "v108")) as file:
        text(file, "ImarisDataSet", "ImarisDataSet")
        text(file, "ImarisVersion", "5.5.0")
        image = file.create_group("DataSetInfo/Image")
        for i, (axis, n, step) in enumerate([("X", 128, 0.2), ("Y", 96, 0.2), ("Z", 48, 0.5)]):
            text(image, axis, n)
            text(image, f"ExtMin{i}", 0)
            text(image, f"ExtMax{i}", n * step)
        text(image, "Unit", "um")
        text(file.create_group("DataSetInfo/TimeInfo"), "DatasetTimePoints", 2)
        for c, (name, color) in enumerate([("Nuclei", "0.2 0.5 1.0"), ("Membrane", "1.0 0.4 0.1")]):
            group = file.create_group(f"DataSetInfo/Channel {c}")
            for key, value in (("Name", name), ("ColorMode", "BaseColor"), ("Color", color),
                               ("ColorRange", "2000 50000")):
                text(group, key, value)
        for t in range(2):
            for c, field in enumerate((nuclei, membrane)):
                level = (np.roll(field, 10 * t, 2) * 55000 + rng.normal(1000, 100, shape)).astype("u2")
                for i in range(2):
                    group = file.create_group(f"DataSet/ResolutionLevel {i}/TimePoint {t}/Channel {c}")
                    group.create_dataset("Data", data=level, chunks=(16, 32, 32), compression="gzip")
                    for axis, n in zip("ZYX", level.shape):
                        text(group, "ImageSize" + axis, n)
                    level = halved(level)


def tomograph():
    """A foam: a Data Exchange file of floats, and raw 16-bit voxels."""
    z, y, x = grid(60, 80, 100)
    foam = np.sin(9 * x) * np.cos(8 * y) + np.sin(8 * y) * np.cos(7 * z) + np.sin(7 * z) * np.cos(9 * x)
    foam = (1 / (1 + np.exp(8 * foam))).astype("f4")
    with h5py.File("recon.h5", "w") as file:
        file.create_dataset("exchange/data", data=foam, chunks=(20, 40, 50), compression="gzip")
    (foam * 50000).astype("<u2").tofile("scan.raw")


def simulation():
    """Two steps of a vortex pair, (t, z, y, x)."""
    z, y, x = grid(48, 48, 96)
    steps = [sum(np.exp(-(((x - s * d) / 0.5) ** 2 + y**2 + z**2) * 8) for s in (-1, 1)) for d in (0.2, 0.5)]
    with h5py.File("run.h5", "w") as file:
        file.create_dataset("density", data=np.array(steps, "f4"), chunks=(1, 24, 24, 48))


{"cells": cells, "tomograph": tomograph, "simulation": simulation}[sys.argv[1]]()
