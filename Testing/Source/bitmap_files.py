# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""PNM, BMP and TGA files, with numpy and struct only: bytes of files. The first row of arrays is the
upper one."""
import struct

import numpy as np

from image_files import packed_bits


def pnm(a, text=False, largest=255, space="\n", comment=""):
    """a: (y, x), or (y, x, 3) of red, green, blue; 16 bits for a largest value above 255."""
    kind = (2 if text else 5) + (a.ndim == 3)
    head = f"P{kind}{space}{comment}{a.shape[1]} {a.shape[0]}{space}{largest}{space}".encode()
    if text:
        rows = ("  ".join(str(v) for v in row.ravel()) for row in a)
        return head + "\n# values\n".join(rows).encode()
    return head + a.astype(">u2" if largest > 255 else "u1").tobytes()


def bmp(a, bits, palette=None, header=40, above=False, density=(0, 0), alpha=False, gap=0, colors=None,
        compression=None, height=None):
    """a: numbers (y, x) of a palette (n, 3), or colours (y, x, 3 or 4); header: its bytes, of which 12
    is OS/2's; above: the upper row first; density: pixels per metre."""
    rows = a if above else a[::-1]
    if bits <= 8:
        data = packed_bits(rows, bits)
    else:
        blue = rows[..., 2::-1]
        if bits == 32:
            last = rows[..., 3:] if alpha else np.full_like(rows[..., :1], 77)
            blue = np.concatenate([blue, last], -1)
        data = np.ascontiguousarray(blue).reshape(rows.shape[0], -1)
    data = np.pad(data, ((0, 0), (0, -data.shape[1] % 4)), constant_values=9)
    colours = b"" if palette is None else b"".join(
        bytes([b, g, r]) + bytes(header > 12) for r, g, b in palette)
    masks = struct.pack("<4I", 0xff0000, 0xff00, 0xff, 0xff000000 if alpha else 0)
    if compression is None:
        compression = 3 if bits == 32 and (header > 40 or alpha) else 0
    signed = (height if height is not None else a.shape[0]) * (-1 if above else 1)
    if header == 12:
        head = struct.pack("<IHHHH", 12, a.shape[1], a.shape[0], 1, bits)
    else:
        head = struct.pack("<IiiHHIIiiII", header, a.shape[1], signed, 1, bits, compression, 0, *density,
                           len(palette) if colors is None and palette is not None else colors or 0, 0)
        head += masks[:max(0, header - 40)] + bytes(max(0, header - 56))
    if compression == 3 and header == 40:
        head += masks[:12]
    offset = 14 + len(head) + len(colours) + gap
    return (b"BM" + struct.pack("<IHHI", offset + data.size, 0, 0, offset) + head + colours + bytes(gap) +
            data.tobytes())


def packets(pixels):
    """Runs of equal pixels as one, the others as they are; whatever rows they lie in."""
    out, i, n = b"", 0, len(pixels)
    while i < n:
        run = 1
        while i + run < n and run < 128 and (pixels[i + run] == pixels[i]).all():
            run += 1
        if run > 1:
            out += bytes([127 + run]) + pixels[i].tobytes()
            i += run
            continue
        j = i + 1
        while j < n and j - i < 128 and not (pixels[j] == pixels[j - 1]).all():
            j += 1
        out += bytes([j - i - 1]) + pixels[i:j].tobytes()
        i = j
    return out


def tga(a, palette=None, runs=False, above=False, right=False, first=0, alpha=8, identity=b""):
    """a: grey (y, x), colours (y, x, 3 or 4), or numbers (y, x) of a palette (n, 3 or 4); above, right:
    the corner that comes first."""
    rows = a if above else a[::-1]
    rows = rows[:, ::-1] if right else rows
    n = 1 if a.ndim == 2 else a.shape[2]
    pixels = rows.reshape(-1, n)
    if n >= 3:
        pixels = np.ascontiguousarray(pixels[:, [2, 1, 0, 3][:n]])
    elif palette is not None:
        pixels = pixels + np.uint8(first)
    kind = (1 if palette is not None else 3 if n == 1 else 2) + 8 * runs
    colours = b"" if palette is None else np.ascontiguousarray(
        np.asarray(palette, "u1")[:, [2, 1, 0, 3][:len(palette[0])]]).tobytes()
    head = struct.pack("<BBBHHBHHHHBB", len(identity), palette is not None, kind, first if palette is not None else 0,
                       0 if palette is None else len(palette), 0 if palette is None else 8 * len(palette[0]),
                       0, 0, a.shape[1], a.shape[0], 8 * n, (alpha if n == 4 else 0) | 16 * right | 32 * above)
    return head + identity + colours + (packets(pixels) if runs else pixels.tobytes())
