#!/usr/bin/env python3
# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Several processes of pvbatch against one: test_parallel.py <pvbatch> <mpirun>. Runs outside of ParaView."""
import glob
import json
import os
import subprocess
import sys
import tempfile

import numpy as np

pvbatch, mpirun = sys.argv[1:]
script = os.path.join(os.path.dirname(os.path.abspath(__file__)), "parallel_scene.py")

# Each process draws a block, and IceT blends 8 bits of each.
FEW = {"pyramid", "behind", "above", "shaded"}
BALANCED = {"moved", "still"}
BALL = {"coarse", "hidden", "near", "farther"}
BLOCKS = FEW | {"parallel", "inside", "cropped", "scaled", "again"}
# The first process draws all, IceT brings its 8 bits onto the background.
FIRST = {"turned", "maximum", "two"}
# Pieces of an ordinary image, each drawn by itself.
PIECES = {"wavelet"}


def run(launcher, *arguments):
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([*launcher, pvbatch, script, folder, *arguments], check=True, timeout=400)
        pictures = {os.path.basename(p)[:-4]: np.load(p) for p in glob.glob(os.path.join(folder, "*.npy"))}
        with open(os.path.join(folder, "facts.json")) as f:
            return pictures, json.load(f)


def compare(one, many, facts, processes):
    for name in sorted(many):
        share = 0.02 if name in BALANCED else 0.1  # of a corner
        assert (one[name].max(axis=2) > 8).mean() > share, name + " is empty"
        difference = np.abs(one[name] - many[name])
        print("%d processes, %s: largest difference %d, mean %.3f, blocks %d" % (
            processes, name, difference.max(), difference.mean(), facts["blocks"][name]), flush=True)
        right = difference.mean() < 1.5 if name in PIECES else difference.max() <= processes
        if not right or facts["blocks"][name] != (name in BLOCKS | BALANCED | BALL) or facts["converged"][name] != 1:
            yield "%s by %d processes" % (name, processes)


one, alone = run([])
assert set(one) == BLOCKS | FIRST | PIECES, sorted(one)
assert not any(alone["blocks"].values()), alone
whole, = alone["read"]["pyramid"]
assert np.abs(one["pyramid"] - one["behind"]).max() > 20  # there is an order to be right or wrong
failures = []
for processes, names in ((2, set(one)), (3, FEW)):
    many, told = run([mpirun, "-np", str(processes), "--oversubscribe"], *(["few"] if names == FEW else []))
    assert set(many) == names, sorted(many)
    failures += compare(one, many, told, processes)
    read = told["read"]["pyramid"]
    print("%d processes read %s MiB, one reads %.2f" % (
        processes, " + ".join("%.2f" % r for r in read), whole), flush=True)
    assert len(read) == processes and all(0 < r < 0.9 * whole for r in read), read

# Blocks move to where rays need more, and stay there.
one, _ = run([], "balance")
for processes in (2, 4):
    many, told = run([mpirun, "-np", str(processes), "--oversubscribe"], "balance")
    failures += compare(one, many, told, processes)
    busiest = {name: max(needed) * processes / sum(needed) for name, needed in told["needed"].items()}
    print("%d processes: the busiest needs %s times the mean; MiB read by each: %s, then %s, then %s" % (
        processes, ", ".join("%.2f" % busiest[n] for n in ("even", "moved", "still")),
        *[" + ".join("%.2f" % r for r in told["read"][n]) for n in ("even", "moved", "still")]), flush=True)
    assert busiest["even"] > 1.4 and busiest["moved"] < 0.8 * busiest["even"], busiest
    assert told["needed"]["still"] == told["needed"]["moved"], told["needed"]
    assert told["read"]["still"] == told["read"]["moved"], told["read"]

# What a process knows to be hidden by the others isn't read, and is no part of the picture.
one, _ = run([], "seen")
for processes in (2, 4):
    launcher = [mpirun, "-np", str(processes), "--oversubscribe"]
    read = {}
    for mode in ("seen", "hidden"):
        many, told = run(launcher, mode)
        assert set(many) == BALL, sorted(many)
        failures += compare(one, many, told, processes)
        read[mode] = {name: sum(told["read"][name]) for name in BALL}
    print("%d processes, MiB read: %s" % (processes, "; ".join("%s %.2f, knowing of each other %.2f" % (
        name, read["seen"][name], read["hidden"][name]) for name in ("coarse", "hidden", "near", "farther"))), flush=True)
    assert abs(read["hidden"]["coarse"] - read["seen"]["coarse"]) < 0.01 * read["seen"]["coarse"], read
    for name in ("hidden", "near", "farther"):
        assert read["hidden"][name] < 0.93 * read["seen"][name], (name, read)
assert not failures, failures
