# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Writes Imaris 5.5 files as "Imaris 5.5 File Format Description" has them: make_imaris.py FOLDER.

small.ims: two channels, three time points, u16, levels floored, data padded to whole chunks.
minimal.ims: u8, no sizes as attributes, one level, a histogram of another length.
"""
import sys

import h5py
import numpy as np

from format_files import halved, keep, volume

folder = sys.argv[1]


def text(group, name, value):
    """A rank-1 array of strings of one character."""
    group.attrs.create(name, np.frombuffer(str(value).encode(), dtype="S1"))


def levels_of(a):
    """Axis i is halved if (10 s_i)^2 > s_j s_k; sizes are floored."""
    levels = [a]
    while levels[-1].size > 400:
        s = levels[-1].shape
        factors = [2 if (10 * s[i])**2 > s[(i + 1) % 3] * s[(i + 2) % 3] and s[i] > 1 else 1
                   for i in range(3)]
        levels.append(halved(levels[-1], factors))
    return levels


def write_level(group, a, chunk, **options):
    padded = [-(-n // c) * c for n, c in zip(a.shape, chunk)]
    d = group.create_dataset("Data", shape=padded, dtype=a.dtype, chunks=chunk, **options)
    # What is behind the image isn't the image's: a value that nothing else has.
    full = np.full(padded, np.iinfo(a.dtype).max, a.dtype)
    full[:a.shape[0], :a.shape[1], :a.shape[2]] = a
    d[...] = full
    for axis, n in zip("ZYX", a.shape):
        text(group, "ImageSize" + axis, n)


shape = (21, 53, 101)
with h5py.File(f"{folder}/small.ims", "w", libver=("earliest", "v108")) as f:
    text(f, "ImarisDataSet", "ImarisDataSet")
    text(f, "ImarisVersion", "5.5.0")
    text(f, "DataSetInfoDirectoryName", "DataSetInfo")
    text(f, "DataSetDirectoryName", "DataSet")
    f.attrs.create("NumberOfDataSets", np.array([1], "<u4"))
    image = f.create_group("DataSetInfo/Image")
    for i, (low, high) in enumerate([(10.0, 10.0 + 101 * 0.25), (-5.0, -5.0 + 53 * 0.25),
                                     (100.0, 100.0 + 21 * 1.5)]):
        text(image, f"ExtMin{i}", f"{low:.9f}")
        text(image, f"ExtMax{i}", f"{high:.9f}")
    for axis, n in zip("ZYX", shape):
        text(image, axis, n)
    text(image, "Unit", "um")
    info = f.create_group("DataSetInfo/TimeInfo")
    text(info, "DatasetTimePoints", 3)
    for c, color in enumerate(["1.000 0.000 0.500", "0.000 1.000 0.000"]):
        g = f.create_group(f"DataSetInfo/Channel {c}")
        text(g, "Name", ["Nuclei", "Membrane"][c])
        text(g, "ColorMode", "BaseColor")
        text(g, "Color", color)
        text(g, "ColorRange", f"{1000 + c}.000 {40000 + c}.000")
    for t in range(3):
        for c in range(2):
            for level, a in enumerate(levels_of(volume(shape, "<u2", 10 * t + c))):
                g = f.create_group(f"DataSet/ResolutionLevel {level}/TimePoint {t}/Channel {c}")
                write_level(g, a, (8, 16, 16), compression="gzip", compression_opts=2,
                            shuffle=c == 1)
                counts, _ = np.histogram(a, 256, (int(a.min()), int(a.max())))
                g.create_dataset("Histogram", data=counts.astype("<u8"))
                text(g, "HistogramMin", f"{a.min():.3f}")
                text(g, "HistogramMax", f"{a.max():.3f}")
                keep(folder, f"small.{t}.{c}.{level}", a)

with h5py.File(f"{folder}/minimal.ims", "w") as f:
    a = volume((8, 16, 32), "u1", 3)
    g = f.create_group("DataSet/ResolutionLevel 0/TimePoint 0/Channel 0")
    g.create_dataset("Data", data=a, chunks=(8, 16, 16))
    g.create_dataset("Histogram", data=np.zeros(257, "<u8"))
    keep(folder, "minimal", a)

# Ones that contradict themselves; the rest is as above.
def damaged(name, change):
    with h5py.File(f"{folder}/{name}.ims", "w") as out, h5py.File(f"{folder}/small.ims", "r") as f:
        for key in ("DataSet", "DataSetInfo"):
            f.copy(key, out)
        change(out)


finest = "DataSet/ResolutionLevel 0/TimePoint 0/Channel 0"
second = "DataSet/ResolutionLevel 1/TimePoint 0/Channel 0"


def retext(group, name, value):
    del group.attrs[name]
    text(group, name, value)


damaged("too_large", lambda f: retext(f[finest], "ImageSizeX", 100000))
damaged("no_number", lambda f: retext(f[finest], "ImageSizeX", "nan"))
damaged("other_sizes", lambda f: retext(f[second], "ImageSizeX", 1009))
damaged("negative_extent", lambda f: retext(f["DataSetInfo/Image"], "ExtMax0", "-1e9"))
damaged("no_data", lambda f: f.__delitem__(second + "/Data"))
damaged("no_level", lambda f: f.__delitem__("DataSet/ResolutionLevel 1"))
damaged("no_times", lambda f: f.__delitem__("DataSet/ResolutionLevel 0/TimePoint 0"))


def loop(f):
    del f[finest]
    f[finest] = h5py.SoftLink("/" + finest)


damaged("loop", loop)
