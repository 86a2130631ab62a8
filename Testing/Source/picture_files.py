# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""PNG and JPEG files, with numpy, struct and zlib only: bytes of files, and the samples they stand for."""
import struct
import zlib

import numpy as np

from image_files import packed_bits

# PNG (W3C Recommendation, 2nd edition).
GREY, RGB, PALETTE, GREY_ALPHA, RGBA = 0, 2, 3, 4, 6
samples_of = {GREY: 1, RGB: 3, PALETTE: 1, GREY_ALPHA: 2, RGBA: 4}
adam7 = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2))


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


# Section 9: rows by one filter after another, from the bytes to the left, above, and left above.
def filtered(rows, step):
    height, width = rows.shape
    padded = np.zeros((height + 1, width + step), "i2")
    padded[1:, step:] = rows
    left, above, corner = padded[1:, :width], padded[:-1, step:], padded[:-1, :width]
    p = left + above - corner
    a, b, c = abs(p - left), abs(p - above), abs(p - corner)
    paeth = np.where((a <= b) & (a <= c), left, np.where(b <= c, above, corner))
    out = np.zeros((height, width + 1), "u1")
    for kind, guess in enumerate((0, left, above, (left + above) // 2, paeth)):
        out[kind::5, 0] = kind
        out[kind::5, 1:] = ((rows - guess) & 255)[kind::5]
    return out.tobytes()


def png(a, kind, bits, interlaced=False, palette=None, transparent=None, density=None, pieces=1,
        extra=()):
    """a: (y, x) or (y, x, samples); palette: (n, 3); transparent: tRNS, alphas of a palette's colours
    or one colour; density: pixels per metre along x and y, pieces: of IDAT."""
    a = a.reshape(a.shape[0], a.shape[1], samples_of[kind])
    step = max(1, a.shape[2] * bits // 8)
    passes = adam7 if interlaced else ((0, 0, 1, 1),)
    parts = [a[y::dy, x::dx] for x, y, dx, dy in passes]
    data = zlib.compress(b"".join(filtered(packed_bits(p, bits), step) for p in parts if p.size))
    out = b"\x89PNG\r\n\x1a\n" + chunk(
        b"IHDR", struct.pack(">IIBBBBB", a.shape[1], a.shape[0], bits, kind, 0, 0, interlaced))
    for name, content in extra:
        out += chunk(name, content)
    if density:
        out += chunk(b"pHYs", struct.pack(">IIB", *density, 1))
    if palette is not None:
        out += chunk(b"PLTE", np.asarray(palette, "u1").tobytes())
    if transparent is not None:
        form = "u1" if kind == PALETTE else ">u2"
        out += chunk(b"tRNS", np.asarray(transparent).astype(form).tobytes())
    size = -(-len(data) // pieces)
    for i in range(0, len(data), size):
        out += chunk(b"IDAT", data[i:i + size])
    return out + chunk(b"IEND", b"")


def meaning(a, kind, bits, palette=None, transparent=None):
    """What such a PNG stands for: colours for a palette's indices, 8 bits for less, alpha for a
    transparent colour."""
    a = a.reshape(*a.shape[:2], samples_of[kind])
    dtype = "<u2" if bits == 16 else "u1"
    if kind == PALETTE:
        colours = np.asarray(palette, "u1")[a[..., 0]]
        if transparent is None:
            return colours
        alphas = np.full(len(palette), 255, "u1")
        alphas[:len(transparent)] = transparent
        return np.concatenate([colours, alphas[a]], -1)
    top = 255 if bits < 16 else 65535
    out = (a.astype(int) * (top // (2 ** bits - 1))).astype(dtype)
    if transparent is not None:
        alpha = np.where((a == np.asarray(transparent)).all(-1), 0, top).astype(dtype)
        out = np.concatenate([out, alpha[..., None]], -1)
    return out[..., 0] if out.shape[2] == 1 else out


# JPEG (ITU-T T.81) whose blocks of 8 x 8 are each of one value, so that every decoder gives the same:
# the quantized coefficient of an even block is its value minus 128 where the table has an 8.
def marker(kind, data):
    return struct.pack(">BBH", 0xff, kind, len(data) + 2) + data


def entropy(bits):
    bits += "1" * (-len(bits) % 8)
    return bytes(int(bits[i:i + 8], 2) for i in range(0, len(bits), 8)).replace(b"\xff", b"\xff\0")


# Of the difference to the block before: a code of four bits for the length, then its bits.
def difference(d):
    length = abs(d).bit_length()
    return f"{length:04b}" + (f"{d if d > 0 else d + 2 ** length - 1:0{length}b}" if length else "")


def jpeg(blocks, width, height, progressive=False, density=None, restart=0, transform=0, bits=8):
    """blocks: (rows, columns) or (rows, columns, components), u1; density: (unit, x, y) of JFIF;
    restart: blocks after which a decoder may start again; transform: 0 for RGB or CMYK, 1, 2 for
    differences of colours (Adobe)."""
    blocks = blocks.reshape(blocks.shape[0] * blocks.shape[1], -1)
    n = blocks.shape[1]
    out = b"\xff\xd8"
    if density:
        out += marker(0xe0, b"JFIF\0" + struct.pack(">HBHHBB", 0x102, *density, 0, 0))
    if n > 1:
        out += marker(0xee, b"Adobe" + struct.pack(">HHHB", 100, 0, 0, transform))
    out += marker(0xfe, b"even blocks") + marker(0xdb, b"\0" + b"\x08" * 64)
    out += marker(0xc2 if progressive else 0xc0, struct.pack(">BHHB", bits, height, width, n) +
                  b"".join(bytes([c + 1, 0x11, 0]) for c in range(n)))
    # Nine lengths, 0 to 8, of four bits each; the end of a block as one bit.
    out += marker(0xc4, b"\0" + bytes([0, 0, 0, 9] + [0] * 12) + bytes(range(9)))
    out += marker(0xc4, b"\x10" + bytes([1] + [0] * 15) + b"\0")
    if restart:
        out += marker(0xdd, struct.pack(">H", restart))

    def scan(components, first, last, code):
        data = marker(0xda, bytes([len(components)]) + b"".join(bytes([c + 1, 0]) for c in components) +
                      bytes([first, last, 0]))
        step = restart or len(blocks)
        for number, start in enumerate(range(0, len(blocks), step)):
            before = dict.fromkeys(components, 128)
            text = ""
            for block in blocks[start:start + step]:
                for c in components:
                    text += code(int(block[c]) - before[c])
                    before[c] = int(block[c])
            data += (bytes([0xff, 0xd0 + (number - 1) % 8]) if number else b"") + entropy(text)
        return data

    if progressive:
        out += scan(range(n), 0, 0, difference)
        for c in range(n):
            out += scan([c], 1, 63, lambda _: "0")
    else:
        out += scan(range(n), 0, 63, lambda d: difference(d) + "0")
    return out + b"\xff\xd9"


def even(blocks, width, height):
    return blocks.repeat(8, 0).repeat(8, 1)[:height, :width]
