#!/usr/bin/env python3
# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""A client of pvserver against pvpython alone: test_server.py <pvpython> <pvserver> [<mpirun>]. Runs outside of
ParaView. With mpirun also against a server of two processes."""
import json
import os
import queue
import socket
import subprocess
import sys
import tempfile
import threading

import numpy as np

pvpython, pvserver, *mpirun = sys.argv[1:]
script = os.path.join(os.path.dirname(os.path.abspath(__file__)), "server_scene.py")
NAMES = ("picture", "turned")


def client(*port):
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([pvpython, script, folder, *port], check=True, timeout=400)
        with open(os.path.join(folder, "facts.json")) as f:
            return {n: np.load(os.path.join(folder, n + ".npy")) for n in NAMES}, json.load(f)


def with_server(*launcher):
    with socket.socket() as s:
        s.bind(("localhost", 0))
        port = str(s.getsockname()[1])
    server = subprocess.Popen([*launcher, pvserver, "--server-port=" + port], stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True)
    lines = queue.Queue()

    def listen():
        for line in server.stdout:
            lines.put(line)
        lines.put("")

    threading.Thread(target=listen, daemon=True).start()
    said = ""
    try:
        while "Accepting connection" not in said:
            line = lines.get(timeout=120)
            assert line, "pvserver ended: " + said
            said += line
        result = client(port)
        assert server.wait(timeout=60) == 0, server.returncode  # it ends with its client
        return result
    finally:
        server.kill()
        server.wait()
        while not lines.empty():
            said += lines.get()
        print(said, flush=True)


alone, facts = client()
assert facts["server"] is False and facts["Converged"] == 1, facts
assert np.abs(alone["picture"] - alone["turned"]).max() > 20
for processes, launcher in ((1, []), (2, [*mpirun, "-np", "2", "--oversubscribe"]))[:1 + len(mpirun)]:
    served, facts = with_server(*launcher)
    print(processes, facts)
    assert facts["server"] is True and facts["Converged"] == 1 and facts["DrawsPyramid"] == 1, facts
    assert facts["DrawsBlock"] == (processes > 1) and facts["ReadMiB"] > 0, facts
    for name in NAMES:
        assert (alone[name].max(axis=2) > 8).mean() > 0.1, name + " is empty"
        difference = np.abs(alone[name] - served[name]).max()
        print("server of %d processes, %s: largest difference %d" % (processes, name, difference), flush=True)
        assert difference <= processes, name
