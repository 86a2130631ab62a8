# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Writes small images of every kind but pictures of make_pictures.py (image_files.py), listed in `names.txt`:
make_images.py FOLDER.
"""
import gzip
import struct
import sys
import zlib

import numpy as np

from format_files import keep, volume
from image_files import Images, codes, dicom, legacy, meta, met, mrc, nifti, ome, slc, text, tiff, vtk

images = Images(sys.argv[1])
put, listed, folder = images.put, images.listed, images.folder
c, s = np.cos(0.3), np.sin(0.3)
turned = (c, -s, 0, s, c, 0, 0, 0, 1)  # about z, columns are the axes
mirrored = (-1, 0, 0, 0, 1, 0, 0, 0, 1)


def big(a):
    return a.astype(a.dtype.newbyteorder(">")).tobytes()


def colours(shape, dtype, count):
    return np.stack([volume(shape, dtype, 20 + i) for i in range(count)], -1)


# MetaImage.
for seed, (dtype, name) in enumerate(met.items()):
    a = volume((9, 17, 23), dtype, seed)
    place = dict(spacing=(0.5, 0.75, 2), origin=(10, -20, 30.5), direction=turned)
    put(f"local_{dtype}.mha", meta(a, "LOCAL", **place) + a.tobytes())
    listed(f"local_{dtype}.mha", a, **place)
a = colours((9, 17, 23), "<u2", 3)
put("big.mhd", meta(a, "big.bin", extra="BinaryDataByteOrderMSB = True\nHeaderSize = -1\n"))
put("big.bin", b"some header" + big(a))
listed("big.mhd", a)
a = volume((9, 17, 23), "<i2", 9)
put("packed.mha", meta(a, "LOCAL", extra="CompressedData = True\n") + zlib.compress(a.tobytes()))
listed("packed.mha", a)
put("list.mhd", meta(a, "LIST") + b"".join(f"slice{z}.bin\n".encode() for z in range(9)))
put("pattern.mhd", meta(a, "slice%d.bin 0 8 1"))
for z in range(9):
    put(f"slice{z}.bin", a[z].tobytes())
listed("list.mhd", a)
listed("pattern.mhd", a)

# VolVis.
a = volume((9, 17, 23), "u1", 60) // 9 * 9
for coded in (False, True):
    put(f"coded_{coded}.slc", slc(a, coded, spacing=(0.5, 0.75, 2.0)))
    listed(f"coded_{coded}.slc", a, spacing=(0.5, 0.75, 2))
put("cut.slc", slc(a)[:-1])
put("cut_coded.slc", slc(a, True)[:-1])
put("bits.slc", slc(a, bits=16))
put("kind.slc", slc(a, kind=2))
put("flat.slc", slc(a, spacing=(1.0, 0.0, 1.0)))
put("deep.slc", slc(a).replace(b" 17 9 8", b" 17 2000000000 8"))
put("wide.slc", slc(a, True).replace(b"23 17", b"24 17"))
put("text.slc", b"11111 2 2 two")

# NRRD.
a = volume((9, 17, 23), "<f4", 10)
steps = np.array(turned).reshape(3, 3).T * np.array([[0.5], [0.75], [2]])
vectors = " ".join("(" + ",".join(repr(float(x)) for x in v) + ")" for v in steps)
header = (f"NRRD0004\n# a comment\ntype: float\ndimension: 3\nspace: left-posterior-superior\n"
          f"sizes: 23 17 9\nspace directions: {vectors}\nkinds: domain domain domain\n"
          f"endian: little\nspace origin: (10,-20,30.5)\n")
place = dict(spacing=(0.5, 0.75, 2), origin=(10, -20, 30.5), direction=turned)
put("raw.nrrd", (header + "encoding: raw\n\n").encode() + a.tobytes())
listed("raw.nrrd", a, **place)
put("gzip.nrrd", (header + "encoding: gzip\n\n").encode() + gzip.compress(a.tobytes()))
listed("gzip.nrrd", a, **place)
put("apart.nhdr", (header + "encoding: raw\nbyte skip: -1\ndata file: apart.dat\n").encode())
put("apart.dat", b"before" + a.tobytes())
listed("apart.nhdr", a, **place)
a = colours((9, 17, 23), "<u1", 4)
put("colours.nrrd", b"NRRD0001\ntype: unsigned char\ndimension: 4\nsizes: 4 23 17 9\n"
    b"spacings: nan 2 3 4\nkinds: 4-color space space space\nencoding: raw\nbyte skip: 5\n\n12345" +
    a.tobytes())
listed("colours.nrrd", a, spacing=(2, 3, 4))

# Text.
put("ascii.nrrd", (header.replace("type: float", "type: uchar") + "encoding: ascii\n\n").encode() +
    text(a[..., 0]))
listed("ascii.nrrd", a[..., 0], **place)
for seed, dtype in enumerate(legacy):
    a = volume((9, 17, 23), dtype, 80 + seed)
    put(f"text_{dtype}.vtk", vtk(a, text(a, (" ", "  ", "\t", "\r\n")), "ASCII", (0.5, 0.75, 2), (10, -20, 30.5)))
    put(f"binary_{dtype}.vtk", vtk(a, big(a), "BINARY", (0.5, 0.75, 2), (10, -20, 30.5),
                                   spacing_key="ASPECT_RATIO"))
    for name in (f"text_{dtype}.vtk", f"binary_{dtype}.vtk"):
        listed(name, a, spacing=(0.5, 0.75, 2), origin=(10, -20, 30.5))
a = colours((9, 17, 23), "<i2", 3)
put("text.mha", meta(a, "LOCAL").replace(b"BinaryData = True", b"BinaryData = False") + text(a))
listed("text.mha", a)
put("apart_text.nhdr", b"NRRD0001\ntype: short\ndimension: 3\nsizes: 23 17 9\nencoding: txt\n"
    b"data file: apart.txt\n")
put("apart.txt", text(a[..., 1], (",", ", ")))
listed("apart_text.nhdr", a[..., 1])
put("cut.vtk", vtk(a[..., 0], text(a[..., 0])[:-40], "ASCII"))
put("word.vtk", vtk(a[..., 0], b"1 2 x 4", "ASCII"))
put("large.vtk", vtk(a[..., 0], b"1 2 40000 4", "ASCII"))
put("vectors.vtk", vtk(a, text(a), "ASCII").replace(b"SCALARS", b"VECTORS"))

# NIfTI.
for seed, dtype in enumerate(codes):
    a = volume((9, 17, 23), dtype, 30 + seed)
    put(f"plain_{dtype}.nii", nifti(a, "<") + a.tobytes())
    listed(f"plain_{dtype}.nii", a, spacing=(0.5, 0.75, 2))
a = volume((9, 17, 23), "<i2", 40)
m = np.array(turned).reshape(3, 3) * np.array([0.5, 0.75, 2])
sform = np.hstack([m, [[10], [-20], [30.5]]]).ravel()
put("sform.nii.gz", gzip.compress(nifti(a, ">", sform=sform) + big(a)))
listed("sform.nii.gz", a, **place)
# A quaternion of half a turn about y mirrors x and z, and the sign of pixdim[0] z again.
put("qform.nii", nifti(a, "<", qform=(0, 1, 0, 90, -126, -72, -1)) + a.tobytes())
listed("qform.nii", a, spacing=(0.5, 0.75, 2), origin=(90, -126, -72), direction=mirrored)
put("pair.hdr", nifti(a, "<")[:108] + struct.pack("<f", 0) + nifti(a, "<")[112:348])
put("pair.img", a.tobytes())
listed("pair.hdr", a, spacing=(0.5, 0.75, 2))
a = colours((9, 17, 23), "<u1", 3)
put("colours.nii", nifti(a[..., 0], "<", colour=True) + a.tobytes())
listed("colours.nii", a, spacing=(0.5, 0.75, 2))
a = volume((18, 17, 23), "<u2", 41)
put("series.nii", nifti(a[:9], "<", times=2) + a.tobytes())
listed("series.nii", a[:9], spacing=(0.5, 0.75, 2))


# TIFF.
for seed, dtype in enumerate(["u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8"]):
    a = volume((5, 33, 47), dtype, 50 + seed)
    put(f"pages_{dtype}.tif", tiff(a, order="<>"[seed % 2], packed=seed % 3 == 0,
                                   tile=16 if seed % 3 == 1 else None,
                                   orientation=4 if seed % 2 else 1))
    listed(f"pages_{dtype}.tif", a)
a = colours((5, 33, 47), "<u2", 3)
put("colours.tif", tiff(a, packed=True))
listed("colours.tif", a)
a = volume((12, 33, 47), "<u2", 60)
put("thumbnails.tif", tiff(np.repeat(a, 2, 0), thumbnail=True, resolution=(20000, 10000, 3)))
listed("thumbnails.tif", a, spacing=(0.5, 1, 0.5))
for z in range(12):
    put(f"stack/slice{z}.tif", tiff(a[z:z + 1], packed=z % 2 == 0))
    put(f"numbered/a_{z + 95:03d}.tif", tiff(a[z:z + 1]))
    put(f"numbered/b_{z + 95:03d}.tif", tiff(a[z:z + 1] * 0))
put("stack/readme.txt", b"not a picture")
listed("stack", a)
listed("stack/slice*.tif", a)
listed("numbered/a_%03d.tif", a)
# ImageJ: channels change fastest, then slices; 2 x 3 x 2.
put("imagej.tif", tiff(a, resolution=(4000, 4000, 1), description="ImageJ=1.53t\nimages=12\n"
    "channels=2\nslices=3\nframes=2\nhyperstack=true\nunit=micron\nspacing=1.5\nloop=false\n"))
listed("imagej.tif", a[0:6:2], spacing=(0.25, 0.25, 1.5))

# TIFF with palettes, one of its own for each page; 16-bit numbers, or 8-bit ones as old programs write.
for bits, kind, limit in ((1, "u1", 65535), (2, "u1", 65535), (4, "u1", 65535), (8, "u1", 65535),
                          (8, "u1", 255), (16, "u2", 65535)):
    a = volume((5, 33, 47), kind, 90 + bits) & (2 ** bits - 1)
    palettes = np.random.default_rng(bits).integers(0, limit + 1, (5, 3, 2 ** bits))
    palettes[:, :, 0] = limit
    colour = np.stack([palettes[z][:, a[z]] for z in range(5)])  # page, colour, y, x
    colour = np.moveaxis(colour, 1, -1) >> (8 if limit > 255 else 0)
    for tile in (None, 16):
        name = f"palette_{bits}_{limit}_{tile or 0}.tif"
        put(name, tiff(a, palettes=palettes, bits=bits, tile=tile, packed=bits == 8,
                       order="<>"[bits % 3 % 2], orientation=4 if bits == 2 else 1))
        listed(name, colour.astype("u1"))
a = volume((5, 33, 47), "u1", 99)
grey = np.arange(256)[::-1] * 257
put("palette_grey.tif", tiff(a, palettes=[[grey] * 3] * 5))
listed("palette_grey.tif", 255 - a)

# Several megabytes each, of which readers hold little.
a = volume((96, 128, 128), "<u2", 100)
keep(folder, "held", a)
words = text(a)
put("held.vtk", vtk(a, words, "ASCII"))
put("held_binary.vtk", vtk(a, big(a), "BINARY"))
put("held.nrrd", b"NRRD0001\ntype: ushort\ndimension: 3\nsizes: 128 128 96\nencoding: ascii\n\n" + words)
put("held.mrc.gz", gzip.compress(mrc(a), 1))
indices = (a >> 8).astype("u1")
keep(folder, "held_grey", 255 - indices)
put("held_palette.tif", tiff(indices, palettes=[[grey] * 3] * 96, packed=True))


# OME-TIFF: pages in the order that the XML says, or anywhere.
sizes = 'PhysicalSizeX="0.25" PhysicalSizeY="0.5" PhysicalSizeZ="1500" PhysicalSizeZUnit="nm"'
a = volume((24, 33, 47), "u2", 160).reshape(2, 3, 4, 33, 47)  # t, c, z
put("order.ome.tif", tiff(a.transpose(2, 0, 1, 3, 4).reshape(24, 33, 47),
                          description=ome("XYCTZ", a.shape, sizes=sizes)))
listed("order.ome.tif", a[0, 0], spacing=(0.25, 0.5, 1.5))
where = "".join(f'<TiffData FirstT="{t}" FirstC="{k}" FirstZ="{z}" IFD="{23 - (t * 12 + k * 4 + z)}" PlaneCount="1">'
                f'<UUID FileName="pages.ome.tif">urn:uuid:1</UUID></TiffData>' for t, k, z in np.ndindex(2, 3, 4))
put("pages.ome.tif", tiff(a.reshape(24, 33, 47)[::-1], packed=True,
                          description=ome("XYZCT", a.shape, where, prefix="OME:")))
listed("pages.ome.tif", a[0, 0])
put("renamed.ome.tif", tiff(a.reshape(24, 33, 47)[::-1], description=ome("XYZCT", a.shape, where)))
listed("renamed.ome.tif", a[0, 0])
keep(folder, "pages_2_1", a[1, 2])
put("colours.ome.tif", tiff(colours((4, 33, 47), "u1", 3), description=ome("XYCZT", (1, 3, 4))))
listed("colours.ome.tif", colours((4, 33, 47), "u1", 3))
# In several files: plane n is page n // 2 of the first or the second, by turns; the names may have a folder before them.
def parted(*names):
    return "".join(f'<TiffData FirstT="{t}" FirstC="{k}" FirstZ="{z}" IFD="{(t * 12 + k * 4 + z) // 2}" PlaneCount="1">'
                   f'<UUID FileName="{names[z % 2]}">urn:uuid:{z % 2}</UUID></TiffData>' for t, k, z in np.ndindex(2, 3, 4))


planes = a.reshape(24, 33, 47)
parts = ome("XYZCT", a.shape, parted("first.part.ome.tif", "D:\\data\\second.part.ome.tif"), sizes)
for number, part in enumerate(("first", "second")):
    put(f"{part}.part.ome.tif", tiff(planes[number::2], description=parts))
    listed(f"{part}.part.ome.tif", a[0, 0], spacing=(0.25, 0.5, 1.5))
    put(f"{part}.only.ome.tif", tiff(planes[number::2], description='<OME><BinaryOnly MetadataFile="all.companion.ome"/></OME>'))
    listed(f"{part}.only.ome.tif", a[0, 0])
put("all.companion.ome", ome("XYZCT", a.shape, parted("first.only.ome.tif", "second.only.ome.tif")).encode())
put("apart.ome.tif", tiff(a[0, 0], description=ome("XYZCT", a.shape, parted("first.ome.tif", "apart.ome.tif"))))
put("second.ome.tif", tiff(a[0, 0, :1]))
lost = "".join(f'<TiffData FirstZ="{z}" IFD="{z // 2}" PlaneCount="1"><UUID FileName="{name}.ome.tif">urn:uuid:1</UUID>'
               f'</TiffData>' for z, name in enumerate(("lost", "second") * 2))
put("lost.ome.tif", tiff(a[0, 0], description=ome("XYZCT", (1, 1, 4), lost)))
put("damaged.ome.tif", tiff(a[0, 0], description='<OME><BinaryOnly MetadataFile="damaged.companion.ome"/></OME>'))
put("damaged.companion.ome", parts[:-30].encode())
put("short.ome.tif", tiff(a[0, 0], description=ome("XYZCT", (1, 1, 5))))
put("axes.ome.tif", tiff(a[0, 0], description=ome("XYZZT", (1, 1, 4))))
put("broken.ome.tif", tiff(a[0, 0], description=ome("XYZCT", (1, 1, 4))[:-30]))
put("empty.ome.tif", tiff(a[0, 0], description='<OME><BinaryOnly MetadataFile="absent.companion.ome"/></OME>'))

# MRC: the place of the first voxel is ORIGIN or NXSTART; axes of the cell in any order, at any angles.
for seed, dtype in enumerate(("i1", "i2", "u2", "f4", "f2")):
    for order in "<>":
        a = volume((9, 17, 23), dtype, 140 + seed)
        name = f"mode_{dtype}_{'big' if order == '>' else 'little'}.mrc"
        put(name, mrc(a, order, cell=(11.5, 34, 4.5), start=(-3, 4, 5), extended=b"symmetry" * 10))
        listed(name, a.astype("f4") if dtype == "f2" else a, spacing=(0.5, 2, 0.5), origin=(-1.5, 8, 2.5))
a = np.array([0, 1, 2, 1023, 1024, 0x3555, 0x3c00, 0x7bff, 0x7c00, 0x7e00, 0x8000, 0x8001, 0xbc00, 0xfbff, 0xfc00,
              0xfe01], "<u2").view("<f2").reshape(2, 2, 4)  # denormal, the largest, infinite, no number
put("halves.mrc", mrc(a))
listed("halves.mrc", a.astype("<f4"))
a = volume((9, 17, 23), "u1", 150)
for name, flags in (("unsigned", 0), ("signed", 1)):
    put(f"imod_{name}.rec", mrc(a, imod=flags))
    listed(f"imod_{name}.rec", a.view("i1") if flags else a)
a = volume((9, 17, 23), "<i2", 151)
put("turned.map", mrc(a, ">", axes=(3, 1, 2), cell=(17, 18, 46), intervals=(17, 9, 23), start=(1, 2, 3)))
listed("turned.map", a, spacing=(2, 1, 2), origin=(2, 6, 2), direction=(0, 1, 0, 0, 0, 1, 1, 0, 0))
put("packed.map.gz", gzip.compress(mrc(a, ">", origin=(7, -8, 9), start=(1, 2, 3), extended=bytes(4))))
listed("packed.map.gz", a, origin=(7, -8, 9))
b = volume((9, 17, 23), "<f2", 152)
put("packed.mrc.gz", gzip.compress(mrc(b)))
listed("packed.mrc.gz", b.astype("<f4"))
put("hexagonal.ccp4", mrc(a, cell=(46, 34, 9), angles=(90, 90, 120)))
listed("hexagonal.ccp4", a, spacing=(2, 2, 1), direction=(1, -0.5, 0, 0, 0.75 ** 0.5, 0, 0, 0, 1))
put("nothing.st", mrc(a, cell=(0, 0, 0), intervals=(0, 0, 0), angles=(0, 0, 0), axes=(0, 0, 0), name=b"\0" * 4,
                      stamp=b"\0\0", origin=(float("nan"), 1, 1)))
listed("nothing.st", a)
put("wrong_stamp.ali", mrc(a, ">", stamp=b"DD"))
listed("wrong_stamp.ali", a)
a = colours((9, 17, 23), "<u1", 3)
put("colours.mrc", mrc(a, mode=16))
listed("colours.mrc", a)
a = volume((9, 17, 23), "<u2", 153)
put("volumes.mrcs", mrc(a, group=401, intervals=(23, 17, 3), cell=(23, 17, 6)))
listed("volumes.mrcs", a[:3], spacing=(1, 1, 2))
put("no_ending", mrc(a))
keep(folder, "no_ending", a)

# DICOM.
a = volume((7, 17, 23), "<u2", 70) >> 4
for z in range(7):
    # Written from the last to the first; without order in their names.
    put(f"ct/{(z * 5) % 7}.dcm", dicom(a[z], (-10, -20, 100 + 2.5 * z), explicit=z % 2 == 0,
                                       slope=("1", "-1024"), stored=12))
put("ct/notes.txt", b"no picture")
listed("ct", a.astype("<i2") - 1024, spacing=(0.5, 0.75, 2.5), origin=(-10, -20, 100))
b = volume((7, 17, 23), "<i2", 71)
for z in range(7):
    # Sagittal: rows along y, columns down z; the normal is -x.
    put(f"mr/s{z}", dicom(b[z], (30 - 2 * z, -20, 100), orientation="0\\1\\0\\0\\0\\-1"))
listed("mr", b, spacing=(0.5, 0.75, 2), origin=(30, -20, 100),
       direction=(0, 0, -1, 1, 0, 0, 0, -1, 0))
for z in range(3):
    put(f"pet/{z}", dicom(a[z], (0, 0, z), slope=("0.5", "1.25")))
listed("pet", (a[:3] * 0.5 + 1.25).astype("<f4"), spacing=(0.5, 0.75, 1))

# What is refused: name, and the word that the sentence has.
for z in (0, 1, 3, 4):
    put(f"gap/{z}.dcm", dicom(a[z], (0, 0, z)))
    put(f"two/{z}.dcm", dicom(a[z], (0, 0, z), series=f"1.2.{z % 2}"))
put("cut/0.dcm", dicom(a[0], (0, 0, 0))[:-1])
put("packed.dcm", dicom(a[0], (0, 0, 0)).replace(b"1.2.840.10008.1.2.1\0", b"1.2.840.10008.1.2.4."))
put("sizes/1.tif", tiff(a[:1]))
put("sizes/2.tif", tiff(a[:1, :, :20]))
whole = tiff(a, packed=True)
put("cut.tif", whole[:len(whole) // 2])
put("cut.mha", meta(a, "LOCAL") + a.tobytes()[:-1])
put("cut.nii.gz", gzip.compress(nifti(a, "<") + a.tobytes())[:2000])
put("cut.mrc", mrc(a)[:-1])
put("short.mrc", mrc(a)[:1023])
put("cut.map.gz", gzip.compress(mrc(a))[:1500])
put("four.mrc", mrc(a, mode=101))
put("complex.mrc", mrc(a, mode=4))
put("negative.mrc", mrc(a).replace(struct.pack("<2i", 1, 0) + bytes(8) + b"TEST",
                                   struct.pack("<2i", 1, -5) + bytes(8) + b"TEST"))
put("axes.mrc", mrc(a, axes=(1, 2, 2)))
put("flat.mrc", mrc(a, angles=(90, 90, 180)))
put("text.mrc", b"a text, not a volume " * 100)
put("long.mha", meta(a, "LOCAL").replace(b"MET_USHORT", b"MET_LONG") + a.tobytes() * 4)
put("text.nrrd", b"NRRD0001\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: bzip2\n\n12345678")
images.finish()
