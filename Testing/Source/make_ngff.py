# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Writes OME-NGFF's metadata into HDF5 files, as its specification has them: make_ngff.py FOLDER."""
import json
import sys

import h5py
import numpy as np

from format_files import halved, keep, volume

folder = sys.argv[1]
factors = [(1, 1, 1), (1, 2, 2), (2, 4, 4)]  # z, y, x


def axes(names, unit="micrometer"):
    kinds = {"t": "time", "c": "channel"}
    return [{"name": n, "type": kinds.get(n, "space"), **({} if n in "tc" else {"unit": unit})}
            for n in names]


def transforms(scale, translation):
    return [{"type": "scale", "scale": scale}, {"type": "translation", "translation": translation}]


def write(group, names, arrays, spacing, origin, name="image", wrapped=False, told=True, version="0.4",
          omero=None):
    """arrays: per level; spacing and origin of level 0 in z, y, x."""
    datasets = []
    lead = [1.0] * (len(names) - 3)
    for level, (a, f) in enumerate(zip(arrays, factors)):
        group.create_dataset(f"scale{level}", data=a, chunks=tuple(min(16, n) for n in a.shape),
                             compression="gzip")
        scale = [s * k for s, k in zip(spacing, f)]
        place = [o + s * (k - 1) / 2 for o, s, k in zip(origin, spacing, f)]
        entry = {"path": f"scale{level}"}
        if told:
            entry["coordinateTransformations"] = transforms(lead + scale, [0.0] * len(lead) + place)
        datasets.append(entry)
    multiscale = {"version": version, "name": name, "datasets": datasets}
    if names != "old":
        multiscale["axes"] = axes(names)
    if wrapped:
        group.attrs["ome"] = json.dumps({"version": "0.5", "multiscales": [multiscale],
                                         **({"omero": omero} if omero else {})})
    else:
        group.attrs["multiscales"] = json.dumps([multiscale])
        if omero:
            group.attrs["omero"] = json.dumps(omero)


def levels(a):
    return [halved(a, f) for f in factors]


omero = {"channels": [{"label": "DAPI", "color": "0000FF", "window": {"start": 100, "end": 900}},
                      {"label": "GFP", "color": "00FF00",
                       "window": {"min": 0, "max": 65535, "start": 5, "end": 7}}]}
plain = levels(volume((18, 36, 44), "<u2", 1))
with h5py.File(f"{folder}/plain.h5", "w") as f:
    write(f.create_group("some/where"), "zyx", plain, (2.0, 0.5, 0.25), (1.0, 2.0, 3.0))
for level, a in enumerate(plain):
    keep(folder, f"plain.{level}", a)
# Five axes: two time points, two channels.
many = [[levels(volume((18, 36, 44), "u1", 10 + 2 * t + c)) for c in range(2)] for t in range(2)]
for name, wrapped in (("five", False), ("wrapped", True)):
    with h5py.File(f"{folder}/{name}.h5", "w") as f:
        arrays = [np.array([[many[t][c][level] for c in range(2)] for t in range(2)])
                  for level in range(3)]
        write(f, "tczyx", arrays, (2.0, 0.5, 0.5), (0.0, 0.0, 0.0), wrapped=wrapped, omero=omero)
for level in range(3):
    keep(folder, f"five.{level}", many[1][1][level])
# Before 0.4: no axes, no transformations.
with h5py.File(f"{folder}/old.h5", "w") as f:
    write(f, "old", [a[None, None] for a in plain], (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), told=False,
          version="0.1")
# Levels in another place, and a factor that isn't whole.
with h5py.File(f"{folder}/odd.h5", "w") as f:
    write(f, "zyx", plain, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0))
    m = json.loads(f.attrs["multiscales"])
    m[0]["datasets"][1]["coordinateTransformations"][1]["translation"] = [0, 0, 0]
    m[0]["datasets"][2]["coordinateTransformations"][0]["scale"] = [1.5, 4, 4]
    f.attrs["multiscales"] = json.dumps(m)


def bad(name, change):
    with h5py.File(f"{folder}/{name}.h5", "w") as f:
        write(f, "zyx", plain, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0))
        m = json.loads(f.attrs["multiscales"])
        change(m[0])
        f.attrs["multiscales"] = json.dumps(m)


def missing(m):
    m["datasets"][1]["path"] = "nowhere"


def short(m):
    m["datasets"][0]["coordinateTransformations"][0]["scale"] = [1, 1]


def axis(m):
    m["axes"][0]["name"] = "depth"


bad("missing", missing)
bad("short", short)
bad("axis", axis)
