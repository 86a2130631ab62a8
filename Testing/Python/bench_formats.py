# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Opening and first pictures of files of each format beside h5py: bench_formats.py [REPETITIONS]

    open      teravox.open(): which layout it is, levels, channels, times, types, geometry
    h5py      the same file by h5py: each object's attributes, each dataset's shape, type, chunks
    picture   a complete picture of 200 x 150 pixels, of what was opened; window and context are there already

and of images that become a pyramid:

    open      vtkHDF5PyramidWriter.CanReadImageFile(): all that conversion reads of their headers
    VTK       UpdateInformation() of VTK's reader of the format, which reads the same header
    picture   teravox.convert(), and a complete picture of the pyramid

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
from teravox.vtkRenderingOutOfCore import vtkHDF5PyramidWriter

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
    ("MINC 2", "single", "minc.mnc", ""),
    ("ilastik", "single", "ilastik.h5", ""),
    ("a dataset", "single", "one.h5", ""),
]

IMAGES = [
    ("MetaImage", "local_u2.mha", vtk.vtkMetaImageReader),
    ("NRRD", "raw.nrrd", vtk.vtkNrrdReader),
    ("NIfTI", "plain_u2.nii", vtk.vtkNIFTIImageReader),
    ("NIfTI, gzip", "sform.nii.gz", vtk.vtkNIFTIImageReader),
    ("legacy VTK", "binary_u2.vtk", vtk.vtkStructuredPointsReader),
    ("MRC", "mode_i2_little.mrc", vtk.vtkMRCReader),
    ("TIFF", "pages_u2.tif", vtk.vtkTIFFReader),
    ("DICOM", "ct", vtk.vtkDICOMImageReader),
]


def milliseconds(call):
    begin = time.perf_counter()
    call()
    return (time.perf_counter() - begin) * 1e3


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

    def draw(file, dataset=""):
        volume = teravox.volume(teravox.open(file, dataset=dataset))
        renderer = vtk.vtkRenderer()
        renderer.AddVolume(volume)
        window.AddRenderer(renderer)
        window.Render()
        window.RemoveRenderer(renderer)
        assert volume.GetMapper().IsConverged(), file

    def measure(label, opening, peer, picture):
        # In turns, so that what else the machine does falls on both.
        pairs = [(milliseconds(opening), milliseconds(peer)) for _ in range(repetitions)]
        ratio = statistics.median(ours / theirs for ours, theirs in pairs)
        ours, theirs = (statistics.median(column) for column in zip(*pairs))
        drawing = statistics.median(milliseconds(picture) for _ in range(max(1, repetitions // 3)))
        print(f"{label:16}{ours:8.2f}{theirs:8.2f}{drawing:9.1f}{ratio:12.2f}", flush=True)

    with tempfile.TemporaryDirectory() as folder:
        print(f"{'format':16}{'open':>8}{'h5py':>8}{'picture':>9}{'open/h5py':>12}")
        made = set()
        for label, script, name, dataset in FILES:
            if script not in made:
                subprocess.run([sys.executable, "-B", str(scripts / f"make_{script}.py"), folder], check=True)
                made.add(script)
            file = f"{folder}/{name}"

            measure(label, lambda: teravox.open(file, dataset=dataset), lambda: by_h5py(file),
                    lambda: draw(file, dataset))
        print(f"{'format':16}{'open':>8}{'VTK':>8}{'picture':>9}{'open/VTK':>12}")
        subprocess.run([sys.executable, "-B", str(scripts / "make_images.py"), folder], check=True)
        for label, name, reader in IMAGES:
            file = f"{folder}/{name}"

            def by_vtk():
                instance = reader()
                (instance.SetDirectoryName if name == "ct" else instance.SetFileName)(file)
                instance.UpdateInformation()

            def convert_and_draw():
                teravox.convert(file, f"{folder}/converted.h5", progress=False)
                draw(f"{folder}/converted.h5")

            measure(label, lambda: vtkHDF5PyramidWriter.CanReadImageFile(file), by_vtk, convert_and_draw)


main()
