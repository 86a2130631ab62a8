#!/usr/bin/env python3
# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""The model of docs/distributed.md: time and memory of a sort-last picture, 8 to 1024 ranks.

distributed_model.py            prints the table
distributed_model.py --check PAGE.md   exits with 1 unless the page has exactly these rows
"""
import sys

# Measured: see "Constants" in the page.
CELL_SECONDS = 100e-9  # of one core, per cell of a shaded ray
DECODE_BYTES = 138e6  # voxels per second and core, shuffle + deflate
BLEND_SECONDS = 45e-9  # of one core, per pixel and layer: find, pack, blend, gather
MESSAGE_SECONDS = 20e-6  # of one core, per rank and exchange of sizes among 8 ranks
RAY_BYTES = 60  # of state per pixel, on each rank
ADDRESS_BYTES = 0.75e6  # page table, directory
BORDER = (68 / 64) ** 3  # bricks hold their neighbours' voxels
HIDDEN = 1.6  # read though another rank hides it, and shared by several
IMBALANCE = 1.3  # the slowest rank over the mean, weighed by need

# Assumed of the machine.
CORES = 32  # per rank
STORAGE_BYTES = 2e9  # per second and rank, and
ALL_STORAGE_BYTES = 200e9  # of all together, compressed
RATIO = 2.3  # compression
NETWORK_BYTES = 10e9  # per second and rank
LATENCY = 5e-6  # per message, of which a rank sends one to each other

WIDTH, HEIGHT = 3840, 2160
VOXEL_BYTES = 2
# Cells that the rays of a picture meet, and voxels that it needs: a pixel's width along the ray.
DEPTH = max(WIDTH, HEIGHT)
FILLED = 0.5


def levels_of(volume_bytes):
    """Levels of a cube with bricks of 64 voxels."""
    edge = (volume_bytes / VOXEL_BYTES) ** (1 / 3)
    levels = 1
    while edge > 64:
        edge /= 2
        levels += 1
    return levels


def row(volume_bytes, ranks):
    pixels = WIDTH * HEIGHT * FILLED
    # Of a volume with fewer voxels than the picture wants there are no more.
    voxels = min(pixels * DEPTH, volume_bytes / VOXEL_BYTES)
    share = voxels * HIDDEN * IMBALANCE / ranks
    brick_bytes = share * BORDER * VOXEL_BYTES
    read = brick_bytes / RATIO / min(STORAGE_BYTES, ALL_STORAGE_BYTES / ranks)
    decode = brick_bytes / DECODE_BYTES / CORES
    draw = pixels * DEPTH * CELL_SECONDS * IMBALANCE / ranks / CORES
    # Each pixel is seen by as many blocks as lie behind each other.
    layers = ranks ** (1 / 3) * pixels / ranks
    blend = (layers * (BLEND_SECONDS + 16 / NETWORK_BYTES)) + ranks * (LATENCY + MESSAGE_SECONDS / 8)
    gather = WIDTH * HEIGHT * 16 / NETWORK_BYTES
    memory = brick_bytes + ADDRESS_BYTES + WIDTH * HEIGHT * RAY_BYTES
    times = {"read": read, "decode": decode, "draw": draw, "blend": blend + gather}
    still = max(read, decode) + draw + blend + gather
    again = draw + blend + gather
    return (
        f"| {volume_bytes / 1e12:.0f} TB | {levels_of(volume_bytes)} | {ranks} | {read:.2f} | "
        f"{decode:.2f} | {draw:.3f} | {blend:.3f} | {gather:.3f} | {still:.2f} | {again:.2f} | "
        f"{memory / 1e9:.1f} GB | {max(times, key=times.get)} |"
    )


def table():
    lines = [
        "| volume | levels | ranks | read s | decode s | draw s | blend s | gather s "
        "| first picture s | next picture s | memory per rank | longest |",
        "| --- " * 12 + "|",
    ]
    for volume in (1e12, 30e12, 1e15):
        lines += [row(volume, ranks) for ranks in (8, 32, 128, 512, 1024)]
    return lines


if __name__ == "__main__":
    if len(sys.argv) > 2:
        with open(sys.argv[2], encoding="utf-8") as page:
            text = page.read().splitlines()
        missing = [line for line in table() if line not in text]
        print(f"{len(missing)} rows differ")
        sys.exit(1 if missing else 0)
    print("\n".join(table()))
