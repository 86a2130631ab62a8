#!/usr/bin/env python3
# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Two processes of pvbatch, one of which finds no file, or a damaged one: test_faults.py <pvbatch> <mpirun>. Runs
outside of ParaView. A relative file name is another file for each of them."""
import glob
import json
import os
import shutil
import subprocess
import sys
import tempfile

import h5py
import numpy as np

pvbatch, mpirun = sys.argv[1:]
script = os.path.join(os.path.dirname(os.path.abspath(__file__)), "fault_scene.py")
whole_file = os.path.join(os.environ["TERAVOX_VOLUMES"], "shells.h5")


def damage(path):
    """Flips bytes of the chunks of level 0, of the first set-up and time point; the coarser levels stay."""
    with h5py.File(path) as f:
        d = f["t00000/s00/0/cells"].id
        chunks = [d.get_chunk_info(i) for i in range(d.get_num_chunks())]
    with open(path, "r+b") as f:
        for chunk in chunks:
            f.seek(chunk.byte_offset)
            data = f.read(chunk.size)
            f.seek(chunk.byte_offset)
            f.write(bytes(b ^ 0x5A for b in data))


def run(first, second):
    """Pictures, facts and text of two processes whose files are "whole", "damaged" or "missing"."""
    with tempfile.TemporaryDirectory() as folder:
        command, damaged = [mpirun, "--oversubscribe"], []
        for rank, state in enumerate((first, second)):
            place = os.path.join(folder, "rank%d" % rank)
            os.mkdir(place)
            if state != "missing":
                shutil.copy(whole_file, os.path.join(place, "scan.h5"))
            if state == "damaged":
                damaged.append(os.path.join(place, "scan.h5"))
                damage(damaged[-1])
            command += [":"] * rank + ["-np", "1", "--wdir", place, pvbatch, script, folder] + damaged
        done = subprocess.run(command, timeout=300, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        print("== %s, %s\n%s" % (first, second, done.stdout), flush=True)
        assert done.returncode == 0, done.returncode
        pictures = {os.path.basename(p)[:-4]: np.load(p) for p in glob.glob(os.path.join(folder, "*.npy"))}
        with open(os.path.join(folder, "facts.json")) as f:
            return pictures, json.load(f), done.stdout


def difference(pictures, name):
    """Shares of the pixels of the whole volume's picture: off by more than 8 bits of two processes; and the mean."""
    off = np.abs(pictures[name] - pictures["whole"])
    return (off.max(axis=2) > 2).mean(), off.mean()


for states in (("damaged", "whole"), ("whole", "missing"), ("missing", "whole")):
    pictures, facts, text = run(*states)
    assert (pictures["whole"].max(axis=2) > 8).mean() > 0.1
    assert facts["whole"] == {"Converged": 1, "FailedBricks": 0, "DrawsPyramid": 1, "DrawsBlock": 1}, facts
    off, mean = difference(pictures, "faulty")
    print("%s, %s: %.3f of the pixels differ, mean difference %.2f; %s" % (*states, off, mean, facts["faulty"]))
    # The session goes on, with the same picture as before.
    assert difference(pictures, "again")[0] == 0 and facts["again"] == facts["whole"], facts
    if "damaged" in states:
        # One process' part comes from a coarser level, which is close to the finest one; that is said.
        assert off < 0.1 and 0 < mean < 2, (off, mean)
        assert facts["faulty"]["FailedBricks"] > 0 and facts["faulty"]["Converged"] == 0, facts
        assert facts["faulty"]["DrawsBlock"] == 1, facts
        assert text.count("A brick can't be read and is drawn from a coarser level.") == 1, text
        # Once the file is whole again, so is the picture.
        assert difference(pictures, "repaired")[0] == 0 and facts["repaired"] == facts["whole"], facts
    else:
        # The process that has the file draws all of it, and the other one says what it lacks.
        assert off == 0, off
        assert facts["faulty"] == {"Converged": 1, "FailedBricks": 0, "DrawsPyramid": 1, "DrawsBlock": 0}, facts
        assert "scan.h5" in text, text
