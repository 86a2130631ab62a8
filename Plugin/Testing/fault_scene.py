# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""For pvbatch of several processes, each in a folder of its own in which scan.h5 may be missing or damaged: pictures
as arrays, and what was said of them as JSON: fault_scene.py <folder> [<damaged file that is repaired>]."""
import json
import os
import sys
import time

import numpy as np

from support import array_name, fact, look, new_view, pv, screenshot, show, path_of, tell

SHELLS = [(4000, 0.1, 0.2, 0.8, 0), (12000, 0.2, 0.8, 0.3, 0.02), (21000, 1, 0.4, 0.1, 0.5)]
RETRY = 10  # seconds after which bricks that failed are asked for again

folder, *repaired = sys.argv[1:]
view = new_view()
told = {}


def picture(name, display):
    np.save(os.path.join(folder, name + ".npy"), screenshot(view))
    tell(view)
    told[name] = {f: fact(display, f) for f in ("Converged", "FailedBricks", "DrawsPyramid", "DrawsBlock")}


def shown(reader, array):
    display = show(reader, view, SHELLS, unit=2, name=array)
    display.MaximumLevel = 0
    return display


good = pv.OpenDataFile(path_of("shells.h5"))
array = array_name(good)
display = shown(good, array)
look(view)
picture("whole", display)
pv.Delete(good)
scan = pv.HDF5VolumeReader(FileName="scan.h5")
display = shown(scan, array)
picture("faulty", display)
if repaired:
    with open(path_of("shells.h5"), "rb") as whole, open(repaired[0], "r+b") as file:
        file.write(whole.read())
    time.sleep(RETRY + 1)
    picture("repaired", display)
pv.Delete(scan)
picture("again", shown(pv.OpenDataFile(path_of("shells.h5")), array))
with open(os.path.join(folder, "facts.json"), "w") as f:
    json.dump(told, f)
