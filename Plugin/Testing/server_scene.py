# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""For pvpython: a picture of a pyramid, drawn here or by a server, and facts about it as JSON:
server_scene.py <folder> [<port of pvserver>]."""
import json
import os
import sys

import numpy as np

from support import fact, look, new_view, pv, screenshot, show, path_of, tell

SHELLS = [(4000, 0.1, 0.2, 0.8, 0), (12000, 0.2, 0.8, 0.3, 0.02), (21000, 1, 0.4, 0.1, 0.5)]

folder = sys.argv[1]
remote = len(sys.argv) > 2
if remote:
    pv.Connect("localhost", int(sys.argv[2]))
    pv.LoadPlugin(os.environ["TERAVOX_PLUGIN"], remote=True, ns=vars(pv))
view = new_view()
reader = pv.OpenDataFile(path_of("shells.h5"))
display = show(reader, view, SHELLS, unit=2)
look(view)
np.save(os.path.join(folder, "picture.npy"), screenshot(view))
tell(view)
facts = {name: fact(display, name) for name in ("Converged", "DrawsPyramid", "DrawsBlock", "ReadMiB")}
facts["server"] = bool(pv.servermanager.ActiveConnection.IsRemote())
display.InteractiveFrameTime = 0.01
view.GetActiveCamera().Azimuth(70)
view.SMProxy.InteractiveRender()  # the server stays alive, and draws on
pv.Render(view)
np.save(os.path.join(folder, "turned.npy"), screenshot(view))
with open(os.path.join(folder, "facts.json"), "w") as f:
    json.dump(facts, f)
if remote:
    pv.Disconnect()
