# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Writes what fuzzing starts from, a folder per target: small files of every format, their XML files,
chunks of every set of filters: make_seeds.py FOLDER. Exit code 77: h5py or numpy is missing."""
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import zlib

try:
    import h5py  # noqa: F401
    import numpy  # noqa: F401
except ImportError as error:
    print(error)
    sys.exit(77)

LARGEST = 300000  # bytes
here = pathlib.Path(__file__).resolve().parent
folder = pathlib.Path(sys.argv[1])
shutil.rmtree(folder, ignore_errors=True)
for target in ("FuzzFile", "FuzzXml", "FuzzChunk", "FuzzImport"):
    (folder / target).mkdir(parents=True)

for kind in ("imaris", "bigdataviewer", "n5", "ngff", "vtkhdf", "amr", "single", "filters"):
    with tempfile.TemporaryDirectory() as made:
        subprocess.run([sys.executable, "-B", here.parent / "Source" / f"make_{kind}.py", made],
                       check=True, stdout=subprocess.DEVNULL)
        for file in sorted(pathlib.Path(made).iterdir()):
            if file.is_file() and file.suffix != ".bin" and file.stat().st_size <= LARGEST:
                target = "FuzzXml" if file.suffix == ".xml" else "FuzzFile"
                shutil.copy(file, folder / target / f"{kind}-{file.name}")

# Images: the first byte says what the rest is, by the order of extensions in FuzzImport.cxx.
KINDS = (".mha", ".mhd", ".nrrd", ".nhdr", ".nii", ".nii.gz", ".hdr", ".vtk", ".tif", ".dcm", ".png", ".jpg", ".mrc",
         ".pgm", ".bmp", ".tga", ".slc",
         "raw", "pattern", ".pvti")
LARGEST_IMAGE = 40000
SAME = {"jpeg": "jpg"} | dict.fromkeys(("mrcs", "map", "ccp4", "rec", "st", "ali", "map.gz", "mrc.gz"), "mrc") | {"ppm": "pgm", "pnm": "pgm"}
ENDINGS = re.compile(r"\.(" + "|".join(SAME).replace(".", r"\.") + ")$")


def image(name, kind, content):
    (folder / "FuzzImport" / name).write_bytes(bytes([KINDS.index(kind)]) + content)


for script in ("make_images.py", "make_pictures.py"):
    with tempfile.TemporaryDirectory() as made:
        subprocess.run([sys.executable, "-B", here.parent / "Source" / script, made],
                       check=True, stdout=subprocess.DEVNULL)
        for file in sorted(pathlib.Path(made).rglob("*")):
            ending = next((kind for kind in KINDS[::-1]
                           if ENDINGS.sub(lambda m: "." + SAME[m[1]], file.name.lower()).endswith(kind)), None)
            parts = file.relative_to(made).parts
            if file.is_file() and ending and file.stat().st_size <= LARGEST_IMAGE and parts[0] != "held":
                image("-".join(parts), ending, file.read_bytes())
for flags in (0, 1, 2, 4):  # plain, big-endian, compressed, text
    content = zlib.compress(bytes(480)) if flags == 2 else b"12 -3,4\n" * 60 if flags == 4 else bytes(480)
    head = struct.pack("<5q3B5x", 5, 4, 3, 0, 0, flags, 0, 3)
    image(f"raw-{flags}", "raw", head + content)
for number, name in enumerate(("a*b%03d.tif", "%d*", "**%2d*%d.dcm", "teravox*%d*.raw")):
    image(f"pattern-{number}", "pattern", name.encode())
# A piece must be a file; any is.
pieces = "".join(f'<Piece Extent="{extent}" Source="/proc/self/status"/>' for extent in (
    "0 9 0 9 0 4", "0 5 0 9 4 9", "5 9 0 6 3 9", "4 9 5 9 4 9"))
image("pieces", ".pvti", f"""<VTKFile type="PImageData"><PImageData WholeExtent="0 9 0 9 0 9" Origin="0 0 0"
Spacing="1 1 1" Direction="1 0 0 0 1 0 0 0 1"><PPointData Scalars="a"><PDataArray type="Int8" Name="a"/></PPointData>
<PCellData><PDataArray type="Int64" Name="c" NumberOfComponents="3"/></PCellData>{pieces}</PImageData></VTKFile>
""".encode())

data = bytes(i * i % 251 for i in range(1024))
lz4 = struct.pack(">QII", len(data), len(data), len(data)) + data  # one stored block
for mask in list(range(32)) + [1 << bit for bit in range(5, 10)]:
    raw = zlib.compress(data) if mask & 4 else lz4 if mask & 8 else data
    for element in range(4):
        head = bytes([mask & 31, element, 1024 // 64 // (1 << element) - 1])
        head += bytes([2, 0, 0, 2] * 5) + bytes([mask >> 5])
        (folder / "FuzzChunk" / f"{mask}-{element}").write_bytes(head + raw)
