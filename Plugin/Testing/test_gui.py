# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""The plugin in ParaView's window, with a mouse: test_gui.py <paraview>.

Starts an X server and the program, which goes through gui_scene.py and is closed by its menu's key. Settings are
those of a user who has switched streaming on; they lie in a folder of the test's own.
"""
import json
import os
import re
import select
import shutil
import signal
import subprocess
import sys
import tempfile

TIMEOUT = 180  # seconds until the program is killed


def skip(why):
    print("SKIPPED: " + why)
    sys.exit(0)


def start_server(folder):
    """An X server of its own on a free display: the process, and the display's number."""
    server = subprocess.Popen(["Xvfb", "-displayfd", "1", "-screen", "0", "1280x1024x24", "-fbdir", folder,
                               "-nolisten", "tcp", "-noreset"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    ready, _, _ = select.select([server.stdout], [], [], 30)
    number = server.stdout.readline().decode().strip() if ready else ""
    if not number:
        server.kill()
        sys.exit("Xvfb doesn't start.")
    return server, number


def write_settings(home):
    folder = os.path.join(home, ".config", "ParaView")
    os.makedirs(folder)
    with open(os.path.join(folder, "ParaView-UserSettings.json"), "w") as file:
        json.dump({"settings": {"GeneralSettings": {"EnableStreaming": 1}}}, file)
    with open(os.path.join(folder, "ParaView5.11.0.ini"), "w") as file:
        file.write("[General]\nGeneralSettings.ShowWelcomeDialog=false\n")


def run(program, display, folder):
    """The program's exit code, what it said on stdout and on stderr."""
    home = os.path.join(folder, "home")
    write_settings(home)
    plugin = os.environ["TERAVOX_PLUGIN"]
    here = os.path.dirname(os.path.abspath(__file__))
    path = os.pathsep.join([here, os.environ.get("PYTHONPATH", "")])
    environment = dict(os.environ, PYTHONPATH=path, HOME=home, XDG_CONFIG_HOME=os.path.join(home, ".config"), XDG_RUNTIME_DIR=home,
                       DISPLAY=":" + display, TERAVOX_SCREEN=os.path.join(folder, "Xvfb_screen0"),
                       QT_QPA_PLATFORM="xcb")
    os.chmod(home, 0o700)
    process = subprocess.Popen(
        [program, "--plugin-search-paths", os.path.dirname(plugin), "--plugins", "Teravox",
         "--script=" + os.path.join(here, "gui_scene.py")],
        env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    try:
        out, err = process.communicate(timeout=TIMEOUT)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        out, err = process.communicate()
        err += "\nKilled after %d s." % TIMEOUT
    return process.returncode, out, err


def main():
    for tool in ("Xvfb", "xdotool"):
        if not shutil.which(tool):
            skip("there is no %s." % tool)
    with tempfile.TemporaryDirectory() as folder:
        server, display = start_server(folder)
        try:
            code, out, err = run(sys.argv[1], display, folder)
        finally:
            server.terminate()
            server.wait()
    print(out, err, sep="\n")
    if "Could not load the Qt platform plugin" in err:
        skip("Qt's platform plugin xcb misses a library.")
    if code != 0 or not re.search(r"RESULT: passed$", out, re.M) or err.strip():
        sys.exit("test_gui.py: failed, exit code %d; stderr is to be empty." % code)
    print("test_gui.py: passed")


if __name__ == "__main__":
    main()
