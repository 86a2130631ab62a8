# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""For pvpython: the plugin is loaded from a folder, its libraries too, and draws: package_scene.py <folder>."""
import sys

from support import fact, look, new_view, pv, screenshot, show, path_of

SHELLS = [(4000, 0.1, 0.2, 0.8, 0), (12000, 0.2, 0.8, 0.3, 0.02), (21000, 1, 0.4, 0.1, 0.5)]

with open("/proc/self/maps") as f:
    mapped = {line.split(maxsplit=5)[5].strip() for line in f if ".so" in line}
ours = [p for p in mapped if "/Teravox" in p or "RenderingOutOfCore" in p]
assert len(ours) == 3 and all(p.startswith(sys.argv[1]) for p in ours), ours
view = new_view()
display = show(pv.OpenDataFile(path_of("shells.h5")), view, SHELLS, unit=2)
look(view)
assert (screenshot(view).max(axis=2) > 8).mean() > 0.1
assert fact(display, "DrawsPyramid") == 1 and fact(display, "Converged") == 1
print("package_scene.py: passed")
