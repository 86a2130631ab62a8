# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Opening and first pictures of files of each format beside h5py: bench_formats.py [REPETITIONS]

    open      teravox.open(): which layout it is, levels, channels, times, types, geometry
    h5py      the same file by h5py: each object's attributes, each dataset's shape, type, chunks
    picture   a complete picture of 200 x 150 pixels, of what was opened; window and context are there already

Medians in milliseconds. The files are those of Testing/Source/make_*.py: small, so that it is names and attributes that count.
"""
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import h5py
import vtk

import teravox

FILES = [
    ("Imaris", "imaris", "small.ims", ""),
    ("BigDataViewer", "bigdataviewer", "legacy.h5", ""),
    ("VTKHDF", "vtkhdf", "static.vtkhdf", ""),
    ("VTKHDF AMR", "amr", "boxes.vtkhdf", ""),
    ("OME-NGFF", "ngff", "five.h5", ""),
    ("N5 in HDF5", "n5", "plain.h5", "/volumes/raw"),
    ("Paintera", "n5", "paintera.h5", ""),
    ("EMD", "single", "emd.emd", ""),
    ("Data Exchange", "single", "exchange.h5", ""),
    ("NeXus", "single", "nexus.nxs", ""),
    ("ilastik", "single", "ilastik.h5", ""),
    ("a dataset", "single", "one.h5", ""),
]


def milliseconds(call, repetitions):
    """The median time of a call, and what the last one returned."""
    times = []
    for _ in range(repetitions):
        begin = time.perf_counter()
        result = call()
        times.append((time.perf_counter() - begin) * 1e3)
    return statistics.median(times), result


def by_h5py(name):
    seen = []

    def visit(path, thing):
        seen.append((path, dict(thing.attrs)))
        if isinstance(thing, h5py.Dataset):
            seen.append((thing.shape, thing.dtype, thing.chunks))

    with h5py.File(name, locking=False) as file:
        seen.append(dict(file.attrs))
        file.visititems(visit)
    return seen


def main():
    repetitions = int(sys.argv[1]) if len(sys.argv) > 1 else 21
    scripts = pathlib.Path(__file__).parents[1] / "Source"
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetSize(200, 150)
    window.Render()
    print(f"{'format':16}{'open':>8}{'h5py':>8}{'picture':>9}")
    with tempfile.TemporaryDirectory() as folder:
        made = set()
        for label, script, name, dataset in FILES:
            if script not in made:
                subprocess.run([sys.executable, "-B", str(scripts / f"make_{script}.py"), folder], check=True)
                made.add(script)
            file = f"{folder}/{name}"

            def picture():
                volume = teravox.volume(teravox.open(file, dataset=dataset))
                renderer = vtk.vtkRenderer()
                renderer.AddVolume(volume)
                window.AddRenderer(renderer)
                window.Render()
                window.RemoveRenderer(renderer)
                assert volume.GetMapper().IsConverged(), file

            opening, _ = milliseconds(lambda: teravox.open(file, dataset=dataset), repetitions)
            reading, _ = milliseconds(lambda: by_h5py(file), repetitions)
            drawing, _ = milliseconds(picture, max(1, repetitions // 3))
            print(f"{label:16}{opening:8.2f}{reading:8.2f}{drawing:9.1f}")


main()
