# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Images as microscopes and scanners write them, with numpy and struct only: bytes of files."""
import os
import struct
import zlib

import numpy as np

from format_files import keep

identity = (1, 0, 0, 0, 1, 0, 0, 0, 1)


class Images:
    """A folder of images; `names.txt` lists them, a line each: name (a file, a folder or a pattern), array
    to compare with, type, components, x, y, z, spacing, origin, direction (row by row), all separated by
    blanks."""

    def __init__(self, folder):
        self.folder = folder
        self.lines = []

    def put(self, name, data):
        os.makedirs(os.path.dirname(f"{self.folder}/{name}"), exist_ok=True)
        with open(f"{self.folder}/{name}", "wb") as f:
            f.write(data)

    def listed(self, name, a, spacing=(1, 1, 1), origin=(0, 0, 0), direction=identity):
        components = a.shape[3] if a.ndim == 4 else 1
        array = name.replace("/", "_").replace("*", "x").replace("%", "p")
        keep(self.folder, array, a)
        numbers = [components, a.shape[2], a.shape[1], a.shape[0], *spacing, *origin, *direction]
        kind = a.dtype.kind + str(8 * a.dtype.itemsize)
        self.lines.append(" ".join([name, array, kind] + [repr(float(n)) for n in numbers]) + "\n")

    def finish(self):
        with open(f"{self.folder}/names.txt", "w") as f:
            f.writelines(self.lines)

# MetaImage.
met = {"u1": "MET_UCHAR", "i1": "MET_CHAR", "u2": "MET_USHORT", "i2": "MET_SHORT", "u4": "MET_UINT",
       "i4": "MET_INT", "f4": "MET_FLOAT", "f8": "MET_DOUBLE"}


def meta(a, data, spacing=(1, 1, 1), origin=(0, 0, 0), direction=identity, extra=""):
    n = a.shape[3] if a.ndim == 4 else 1
    m = np.array(direction).reshape(3, 3).T.ravel()  # one axis after another
    numbers = lambda v: " ".join(repr(float(x)) for x in v)
    return (f"ObjectType = Image\nNDims = 3\nBinaryData = True\n{extra}"
            f"TransformMatrix = {numbers(m)}\nOffset = {numbers(origin)}\n"
            f"ElementSpacing = {numbers(spacing)}\nDimSize = {a.shape[2]} {a.shape[1]} {a.shape[0]}\n"
            f"ElementNumberOfChannels = {n}\nElementType = {met[a.dtype.str[1:]]}\n"
            f"ElementDataFile = {data}\n").encode()


# Numbers as text, in lines of a few, with every blank that is allowed.
def text(a, separators=(" ",)):
    each = a.ravel()
    words = [repr(v.item()) for v in each]
    return "".join(w + ("\n" if i % 9 == 8 else separators[i % len(separators)])
                   for i, w in enumerate(words)).encode()


# Legacy VTK.
legacy = {"u1": "unsigned_char", "i1": "char", "u2": "unsigned_short", "i2": "short",
          "u4": "unsigned_int", "i4": "int", "f4": "float", "f8": "double"}


def vtk(a, data, form, spacing=(1, 1, 1), origin=(0, 0, 0), name="some%20values", spacing_key="SPACING"):
    n = a.shape[3] if a.ndim == 4 else 1
    numbers = lambda v: " ".join(repr(float(x)) for x in v)
    return (f"# vtk DataFile Version 3.0\na title\n{form}\nDATASET STRUCTURED_POINTS\n"
            f"DIMENSIONS {a.shape[2]} {a.shape[1]} {a.shape[0]}\n{spacing_key} {numbers(spacing)}\n"
            f"ORIGIN {numbers(origin)}\nPOINT_DATA {a.size // n}\n"
            f"SCALARS {name} {legacy[a.dtype.str[1:]]}{f' {n}' if n > 1 else ''}\n"
            f"LOOKUP_TABLE default\n").encode() + data


# NIfTI.
codes = {"u1": 2, "i2": 4, "i4": 8, "f4": 16, "f8": 64, "i1": 256, "u2": 512, "u4": 768}


def nifti(a, order, sform=None, qform=None, times=1, colour=False):
    h = bytearray(352)
    pack = lambda at, form, *v: struct.pack_into(order + form, h, at, *v)
    pack(0, "i", 348)
    pack(40, "8h", 4 if times > 1 else 3, a.shape[2], a.shape[1], a.shape[0], times, 1, 1, 1)
    pack(70, "hh", 128 if colour else codes[a.dtype.str[1:]], 8 * a.dtype.itemsize)
    pack(76, "8f", -1 if qform and qform[6] < 0 else 1, 0.5, 0.75, 2, 1, 1, 1, 1)
    pack(108, "f", 352)
    if qform:
        pack(252, "h", 1)
        pack(256, "6f", *qform[:6])
    if sform is not None:
        pack(254, "h", 2)
        pack(280, "12f", *sform)
    h[344:348] = b"n+1\0"
    return bytes(h)


# Rows of samples of 1 to 16 bits as bytes: the first one in the highest bits, big-endian.
def packed_bits(a, bits):
    flat = np.ascontiguousarray(a.reshape(a.shape[0], -1))
    if bits >= 8:
        return flat.astype(f">u{bits // 8}").view("u1")
    each = np.unpackbits(flat.astype("u1")[..., None], axis=-1)[..., 8 - bits:]
    return np.packbits(each.reshape(a.shape[0], -1), axis=1)


# VolVis: a text of numbers, a picture of three bytes per pixel, slices of bytes. Runs: a count and a
# byte, or with the highest bit a count and as many bytes; 0 at the end.
def runs(values):
    out, i = b"", 0
    while i < len(values):
        n = 1
        while n < 127 and i + n < len(values) and values[i + n] == values[i]:
            n += 1
        if n > 2:
            out += bytes([n, values[i]])
        else:
            n = min(100, len(values) - i)
            out += bytes([128 + n]) + bytes(values[i:i + n])
        i += n
    return out + b"\0"


def slc(a, coded=False, spacing=(1.0, 1.0, 1.0), icon=(3, 2), bits=8, kind=None):
    out = (f"11111\n{a.shape[2]} {a.shape[1]} {a.shape[0]} {bits}\n{spacing[0]!r} {spacing[1]!r} {spacing[2]!r}\n"
           f"1 1 0 {int(coded) if kind is None else kind}\n{icon[0]} {icon[1]} X").encode()
    out += bytes(range(88, 88 + 3 * icon[0] * icon[1]))
    for z in a:
        data = runs(z.ravel().tolist()) if coded else z.tobytes()
        out += (f"{len(data)} X".encode() if coded else b"") + data
    return out


# MRC2014.
modes = {"i1": 0, "u1": 0, "i2": 1, "f4": 2, "u2": 6, "f2": 12}


def mrc(a, order="<", mode=None, start=(0, 0, 0), intervals=None, cell=None, angles=(90, 90, 90), axes=(1, 2, 3),
        origin=(0, 0, 0), group=1, extended=b"", imod=None, stamp=None, name=b"MAP "):
    h = bytearray(1024)
    pack = lambda at, form, *v: struct.pack_into(order + form, h, at, *v)
    size = a.shape[2::-1]
    pack(0, "4i", *size, modes[a.dtype.str[1:]] if mode is None else mode)
    pack(16, "3i", *start)
    pack(28, "3i", *(size if intervals is None else intervals))
    pack(40, "6f", *(size if cell is None else cell), *angles)
    pack(64, "3i", *axes)
    pack(88, "2i", group, len(extended))
    pack(104, "4si", b"TEST", 20140)
    if imod is not None:
        pack(152, "4si", b"IMOD"[::1 if order == "<" else -1], imod)
    pack(196, "3f", *origin)
    h[208:212] = name
    h[212:214] = stamp or (b"DA" if order == "<" else b"\x11\x11")
    return bytes(h) + extended + a.astype(a.dtype.newbyteorder(order)).tobytes()


# TIFF.
def tiff(pages, order="<", strip=5, packed=False, tile=None, description="", resolution=None,
         orientation=1, thumbnail=False, palettes=None, bits=8):
    """With `palettes`, of each page 3 x 2^bits numbers, pages are indices (u1, or u2 if bits are 16)."""
    def packed_block(block):
        if palettes is None or bits >= 8:
            return block.tobytes()
        return packed_bits(block, bits).tobytes()

    out = bytearray(struct.pack(order + "2sHI", b"II" if order == "<" else b"MM", 42, 0))
    link = 4
    for number, page in enumerate(pages):
        n = page.shape[2] if page.ndim == 3 else 1
        rows = page[::-1] if orientation == 4 else page
        rows = rows.astype(rows.dtype.newbyteorder(order))
        h, w = page.shape[:2]
        blocks = []
        if tile:
            for y in range(0, h, tile):
                for x in range(0, w, tile):
                    block = np.zeros((tile, tile) + page.shape[2:], rows.dtype)
                    part = rows[y:y + tile, x:x + tile]
                    block[:part.shape[0], :part.shape[1]] = part
                    blocks.append(packed_block(block))
        else:
            blocks = [packed_block(rows[y:y + strip]) for y in range(0, h, strip)]
        blocks = [zlib.compress(b) if packed else b for b in blocks]
        starts = []
        for b in blocks:
            starts.append(len(out))
            out += b + b"\0" * (len(b) % 2)
        kind = {"u": 1, "i": 2, "f": 3}[page.dtype.kind]
        tags = [(256, 4, [w]), (257, 4, [h]), (258, 3, [bits if palettes is not None else 8 * page.dtype.itemsize] * n),
                (259, 3, [8 if packed else 1]), (262, 3, [3 if palettes is not None else 2 if n >= 3 else 1]),
                (274, 3, [orientation]), (277, 3, [n]), (339, 3, [kind] * n)]
        if palettes is not None:
            tags.append((320, 3, [int(v) for v in np.asarray(palettes[number]).ravel()]))
        if thumbnail and number % 2:
            tags.append((254, 4, [1]))
        if tile:
            tags += [(322, 3, [tile]), (323, 3, [tile]), (324, 4, starts),
                     (325, 4, [len(b) for b in blocks])]
        else:
            tags += [(273, 4, starts), (278, 4, [strip]), (279, 4, [len(b) for b in blocks])]
        if description and number == 0:
            tags.append((270, 2, list(description.encode() + b"\0")))
        if resolution:
            tags += [(282, 5, [resolution[0], 1000]), (283, 5, [resolution[1], 1000]),
                     (296, 3, [resolution[2]])]
        forms = {2: "B", 3: "H", 4: "I", 5: "I"}
        entries = b""
        for tag, form, values in sorted(tags):
            data = struct.pack(f"{order}{len(values)}{forms[form]}", *values)
            count = len(values) // 2 if form == 5 else len(values)
            if len(data) > 4:
                at = len(out)
                out += data + b"\0" * (len(data) % 2)
                data = struct.pack(order + "I", at)
            entries += struct.pack(order + "HHI", tag, form, count) + data.ljust(4, b"\0")
        struct.pack_into(order + "I", out, link, len(out))
        out += struct.pack(order + "H", len(tags)) + entries
        link = len(out)
        out += struct.pack(order + "I", 0)
    return bytes(out)


# The XML of OME-TIFF. `shape` is (t, c, z).
def ome(order, shape, pages="<TiffData/>", sizes="", prefix=""):
    xml = (f'<?xml version="1.0" encoding="UTF-8"?><!-- a warning --><OME xmlns="http://www.openmicroscopy.org/'
           f'Schemas/OME/2016-06"><Image ID="Image:0"><Pixels ID="Pixels:0" DimensionOrder="{order}" Type="uint16" '
           f'SizeT="{shape[0]}" SizeC="{shape[1]}" SizeZ="{shape[2]}" {sizes}><Channel ID="Channel:0:0"/>{pages}'
           f'</Pixels></Image></OME>')
    return xml.replace("</", "</" + prefix).replace("<", "<" + prefix).replace(f"<{prefix}/", "</").replace(
        f"<{prefix}?", "<?").replace(f"<{prefix}!", "<!") if prefix else xml


# DICOM.
def element(tag, kind, value):
    if isinstance(value, str):
        value = value.encode()
    value += (b"\0" if kind in ("UI", "OW", "OB") else b" ") * (len(value) % 2)
    head = struct.pack("<HH", tag >> 16, tag & 0xffff)
    if kind is None:  # types are implied
        return head + struct.pack("<I", len(value)) + value
    if kind in ("OW", "OB", "SQ", "UN"):
        return head + kind.encode() + struct.pack("<HI", 0, len(value)) + value
    return head + kind.encode() + struct.pack("<H", len(value)) + value


def dicom(pixels, position, explicit=True, slope=None, stored=16, orientation="1\\0\\0\\0\\1\\0",
          series="1.2.3"):
    signed = pixels.dtype.kind == "i"
    syntax = "1.2.840.10008.1.2" + (".1" if explicit else "")
    short = lambda v: struct.pack("<H", v)
    # A sequence of undefined length, with an item of undefined length that has pixels of its own.
    icon = element(0x00280010, "US" if explicit else None, short(1)) + \
        element(0x7fe00010, "OW" if explicit else None, b"12")
    sequence = struct.pack("<HH", 0x0008, 0x1140) + \
        (b"SQ\0\0" if explicit else b"") + b"\xff\xff\xff\xff" + \
        struct.pack("<HHI", 0xfffe, 0xe000, 0xffffffff) + icon + \
        struct.pack("<HHI", 0xfffe, 0xe00d, 0) + struct.pack("<HHI", 0xfffe, 0xe0dd, 0)
    tags = [(0x00180050, "DS", "3"), (0x0020000e, "UI", series),
            (0x00200032, "DS", "\\".join(repr(float(p)) for p in position)),
            (0x00200037, "DS", orientation), (0x00280002, "US", short(1)),
            (0x00280010, "US", short(pixels.shape[0])), (0x00280011, "US", short(pixels.shape[1])),
            (0x00280030, "DS", "0.75\\0.5"), (0x00280100, "US", short(8 * pixels.dtype.itemsize)),
            (0x00280101, "US", short(stored)), (0x00280103, "US", short(int(signed)))]
    if slope:
        tags += [(0x00281052, "DS", slope[1]), (0x00281053, "DS", slope[0])]
    body = sequence + b"".join(element(t, k if explicit else None, v) for t, k, v in tags)
    body += element(0x7fe00010, "OW" if explicit else None, pixels.tobytes())
    meta = element(0x00020010, "UI", syntax)
    return b"\0" * 128 + b"DICM" + element(0x00020000, "UL", struct.pack("<I", len(meta))) + meta + body
