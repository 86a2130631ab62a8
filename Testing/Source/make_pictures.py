# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Writes small PNG and JPEG files of every kind (picture_files.py), PNM, BMP and TGA files
(bitmap_files.py), listed in `names.txt`: make_pictures.py FOLDER.
"""
import struct
import sys

import numpy as np

from bitmap_files import bmp, pnm, tga
from format_files import keep, volume
from image_files import Images
from picture_files import (GREY, GREY_ALPHA, PALETTE, RGB, RGBA, chunk, even, jpeg, meaning, png,
                           samples_of)

images = Images(sys.argv[1])
put, listed = images.put, images.listed


# A file for each slice; the lowest row comes first, as in VTK.
def stacked(name, pictures, data, ending=".png", **place):
    for z, content in enumerate(data):
        put(f"{name}/s{z}{ending}", content)
    listed(name, np.stack(pictures)[:, ::-1], **place)


for seed, (name, kind, bits, transparent) in enumerate((
        ("grey_1", GREY, 1, None), ("grey_2", GREY, 2, None), ("grey_4", GREY, 4, None),
        ("grey_8", GREY, 8, None), ("grey_16", GREY, 16, None), ("rgb_8", RGB, 8, None),
        ("rgb_16", RGB, 16, None), ("palette_1", PALETTE, 1, None), ("palette_2", PALETTE, 2, None),
        ("palette_4", PALETTE, 4, None), ("palette_8", PALETTE, 8, None),
        ("grey_alpha_8", GREY_ALPHA, 8, None), ("grey_alpha_16", GREY_ALPHA, 16, None),
        ("rgba_8", RGBA, 8, None), ("rgba_16", RGBA, 16, None), ("grey_2_clear", GREY, 2, [1]),
        ("grey_16_clear", GREY, 16, "some"), ("rgb_8_clear", RGB, 8, "some"), ("rgb_16_clear", RGB, 16, "some"),
        ("palette_4_clear", PALETTE, 4, [0, 130, 7]), ("palette_8_clear", PALETTE, 8, list(range(200))))):
    a = np.stack([volume((2, 33, 47), "u1" if bits < 16 else "u2", 110 + seed + i)
                  for i in range(samples_of[kind])], -1)
    a = a & (2 ** bits - 1)
    palette = np.random.default_rng(seed).integers(0, 256, (2 ** bits, 3)) if kind == PALETTE else None
    clear = a[0, 3, 5] if transparent == "some" else transparent
    pictures = [meaning(b, kind, bits, palette, clear) for b in a]
    density = (4000000, 2000000) if seed % 2 else None
    for interlaced in (False, True):
        stacked(f"png_{name}{'_interlaced' if interlaced else ''}", pictures,
                [png(b, kind, bits, interlaced, palette, clear, density, pieces=1 + seed % 3) for b in a],
                spacing=(0.00025, 0.0005, 0.00025) if density else (1, 1, 1))
a = volume((12, 33, 47), "<u2", 140)
for z in range(12):
    put(f"slices/a_{z + 95:03d}.png", png(a[z], GREY, 16, extra=[(b"tEXt", b"Title\0" + bytes(65)), (b"abCd", b"?")]))
    put(f"slices/b_{z + 95:03d}.jpg", b"not read")
    put(f"nameless/{z}", png(a[z], GREY, 16))
put("slices/notes.txt", b"no picture")
listed("slices/a_%03d.png", a[:, ::-1])
listed("slices/*.png", a[:, ::-1])
put("called.jpg", png(a[0], GREY, 16))
listed("called.jpg", a[:1, ::-1])
listed("nameless", a[:, ::-1])
put("one.PNG", png(a[0, :1, :1], GREY, 16))
listed("one.PNG", a[:1, :1, :1])
for seed, (name, n, options) in enumerate((
        ("grey", 1, dict(density=(0, 3, 4))), ("grey_progressive", 1, dict(progressive=True, density=(1, 300, 150))),
        ("grey_restart", 1, dict(restart=4, density=(2, 200, 200))),
        ("rgb", 3, {}), ("rgb_progressive", 3, dict(progressive=True, restart=7)))):
    a = np.random.default_rng(seed).integers(0, 256, (3, 5, 6) + ((n,) if n > 1 else ()), "u1")
    unit, *each = options.get("density", (0,))
    spacing = [(25.4 if unit == 1 else 10) / v for v in each] if unit else [1, 1]
    stacked(f"jpeg_{name}", [even(b, 47, 33) for b in a], [jpeg(b, 47, 33, **options) for b in a],
            [".jpg", ".JPEG"][seed % 2], spacing=(*spacing, spacing[0]))

# PNM: values are what the file says, whatever its largest one is.
grey, wide = volume((3, 33, 47), "u1", 150), volume((3, 33, 47), "<u2", 151) & 0xfff
colours = np.stack([volume((3, 33, 47), "u1", 152 + i) for i in range(4)], -1)
for name, a, options in (
        ("grey", grey, {}), ("wide", wide, dict(largest=4095)), ("rgb", colours[..., :3], {}),
        ("rgb_wide", np.stack([wide, wide // 3, wide // 7], -1), dict(largest=65535)),
        ("text", grey, dict(text=True, comment="# made\n#again\n")),
        ("text_wide", wide, dict(text=True, largest=4095, space=" ")),
        ("text_rgb", colours[..., :3], dict(text=True, space="\t")), ("lines", grey, dict(space="\r\n"))):
    stacked(f"pnm_{name}", list(a), [pnm(b, **options) for b in a], f".p{'p' if a.ndim == 4 else 'g'}m")

# BMP: what tomographs write has a grey palette, which is one value for each pixel.
greys = np.repeat(np.arange(256)[::-1, None], 3, 1)
for name, bits, options in (
        ("grey", 8, dict(palette=greys, density=(100000, 50000))), ("above", 8, dict(palette=greys, above=True)),
        ("few", 8, dict(palette=greys[:200], gap=5)), ("old", 8, dict(palette=greys, header=12)),
        ("one", 1, dict(palette=[(0, 0, 0), (255, 255, 255)])), ("four", 4, dict(palette=greys[::16])),
        ("palette_4", 4, dict(palette=greys[:16] ^ [1, 2, 4])), ("palette_8", 8, dict(palette=greys ^ [9, 0, 3])),
        ("rgb", 24, {}), ("rgb_old", 24, dict(header=12)), ("rgb_above", 24, dict(above=True, header=124)),
        ("rgbx", 32, {}), ("rgbx_masks", 32, dict(header=52)), ("rgba", 32, dict(header=108, alpha=True))):
    palette = options.get("palette")
    a = colours[..., :4 if options.get("alpha") else 3] if palette is None else grey % len(palette)
    shown = a if palette is None else np.asarray(palette, "u1")[a][..., slice(None) if name[:7] == "palette" else 0]
    spacing = [1000 / v for v in options["density"]] if "density" in options else [1, 1]
    stacked(f"bmp_{name}", list(shown), [bmp(b, bits, **options) for b in a], ".bmp", spacing=(*spacing, spacing[0]))

for seed, (name, options) in enumerate((
        ("grey", {}), ("rgb", {}), ("rgba", {}), ("rgbx", dict(alpha=0)), ("grey_palette", dict(palette=greys)),
        ("palette", dict(palette=greys ^ [9, 0, 3])), ("palette_first", dict(palette=(greys ^ [9, 0, 3])[:90], first=40)),
        ("palette_clear", dict(palette=np.concatenate([greys, greys[::-1, :1]], 1))))):
    palette = options.get("palette")
    a = (grey // 3 * 3 if name == "grey" else colours[..., :3] // 64 if name == "rgb" else
         colours // 64 if palette is None else (grey // 16 % len(palette)).astype("u1"))
    shown = a if palette is None else np.asarray(palette, "u1")[a]
    shown = shown[..., :3] if name == "rgbx" else shown[..., 0] if name == "grey_palette" else shown
    for corner, place in enumerate((dict(), dict(above=True), dict(right=True), dict(above=True, right=True))):
        files = [tga(b, runs=corner % 2 == seed % 2, identity=b"made" * corner, **place, **options) for b in a]
        stacked(f"tga_{name}_{corner}", list(shown), files, (".tga", ".TGA")[corner % 2])

# Several megabytes, of which the reader holds little.
a = volume((48, 128, 128), "<u2", 100) & 0xff00
keep(images.folder, "held", a)
for z in range(48):
    put(f"held/{z}.png", png(a[z, ::-1], GREY, 16, interlaced=z % 2 == 1))

# What is refused.
a = volume((2, 33, 47), "<u2", 141)
for name, first, second in (("sizes", a[0], a[0, :, :20]), ("types", a[0], a[0] >> 8)):
    put(f"png_{name}/1.png", png(first, GREY, 16))
    put(f"png_{name}/2.png", png(second, GREY, 8 if name == "types" else 16))
blocks = np.arange(12, dtype="u1").reshape(3, 4)
put("both/1.png", png(even(blocks, 20, 20), GREY, 8))
put("both/1.jpg", jpeg(blocks, 20, 20))
whole = png(a[0], GREY, 16)
put("cut.png", whole[:len(whole) // 2])
put("end.png", whole[:-13])
put("checksum.png", whole[:70] + bytes([whole[70] ^ 1]) + whole[71:])
put("empty.png", b"")
put("text.jpg", b"no picture at all")
put("largest.png", whole[:8] + chunk(
    b"IHDR", struct.pack(">IIBBBBB", 2 ** 31 - 1, 2 ** 31 - 1, 16, RGBA, 0, 0, 0)) + chunk(b"IDAT", b""))
put("large.png", whole[:8] + chunk(
    b"IHDR", struct.pack(">IIBBBBB", 2 ** 31 - 1, 2 ** 31 - 1, 1, GREY, 0, 0, 1)) + chunk(b"IDAT", b""))
whole = jpeg(blocks, 32, 24)
put("cut.jpg", whole[:-7])
put("end.jpg", whole[:-2])
put("cmyk.jpg", jpeg(blocks[..., None].repeat(4, 2), 32, 24))
put("two.jpg", jpeg(blocks[..., None].repeat(2, 2), 32, 24))
put("bits.jpg", jpeg(blocks, 32, 24, bits=12))
put("lossless.jpg", whole.replace(b"\xff\xc0", b"\xff\xc3"))
scans = jpeg(blocks, 32, 24, progressive=True)
put("scans.jpg", scans[:-2] + scans[scans.rindex(b"\xff\xda"):-2] * 2000 + b"\xff\xd9")
put("coefficients.jpg", scans.replace(struct.pack(">HH", 24, 32), struct.pack(">HH", 2000, 2000), 1))
whole = pnm(grey[0])
put("cut.pgm", whole[:-1])
put("letters.pgm", b"P2 3 1 255 1 x 2")
put("above.pgm", b"P2 3 1 255 1 256 2")
put("short.pgm", b"P2 3 1 255 1 2")
put("nothing.ppm", b"P6 0 1 255 ")
put("bits.pnm", b"P4 8 1 \0")
put("huge.pgm", b"P5 2147483647 2147483647 65535\n" + bytes(100))
put("larger.pgm", b"P5 99999999999999999999999 1 255\n" + bytes(100))
whole = bmp(grey[0], 8, greys)
put("cut.bmp", whole[:-1])
put("head.bmp", whole[:40])
put("runs.bmp", bmp(grey[0], 8, greys, compression=1))
put("pixels_16.bmp", bmp(colours[0, ..., :3], 24).replace(b"\x01\0\x18\0", b"\x01\0\x10\0"))
put("few.bmp", bmp(grey[0], 8, greys[:20]))
put("many.bmp", bmp(grey[0], 8, greys, colors=257))
put("order.bmp", bmp(colours[0], 32, header=52).replace(struct.pack("<I", 0xff0000), struct.pack("<I", 0xff), 1))
put("tall.bmp", bmp(grey[0], 8, greys, height=-2 ** 31))
put("both_grey/1.bmp", bmp(grey[0], 8, greys))
put("both_grey/2.bmp", bmp(grey[0], 8, greys ^ [9, 0, 3]))
whole = tga(colours[0] // 64, runs=True)
put("cut.tga", whole[:-1])
put("head.tga", whole[:17])
put("pixels_16.tga", whole[:16] + bytes([16]) + whole[17:])
put("few.tga", tga(grey[0], palette=greys[:20]))
put("below.tga", tga(grey[0], palette=greys[:20], first=200))
put("text.tga", b"no picture at all" * 3)
images.finish()
