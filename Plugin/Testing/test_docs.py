# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""The blocks of docs/paraview.md, with the plugin and a volume of the tests: test_docs.py <page> <build folder>."""
import os
import re
import shutil
import subprocess
import sys
import tempfile

from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOImage import vtkPNGReader

page = open(sys.argv[1], encoding="utf-8").read()
blocks = re.findall(r"```python\n(.*?)```", page, re.S)
assert len(blocks) == 1, len(blocks)
code, replaced = re.subn(r'LoadPlugin\("[^"]*"', 'LoadPlugin(os.environ["TERAVOX_PLUGIN"]', blocks[0])
assert replaced == 1
# The program starts as the page says, and tells its version instead of waiting for somebody.
shell, = re.findall(r"```sh\n(.*?)```", page, re.S)
prefix = os.path.join(sys.argv[2], "prefix")
if os.path.isdir(prefix):  # as Testing/plugin.sh makes it
    commands = shell.replace("build/paraview/prefix", prefix).rstrip() + " --version"
    said = subprocess.run(["bash", "-euc", commands], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert said.returncode == 0 and "paraview version 5.11" in said.stdout, said
with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    shutil.copy(os.path.join(os.environ["TERAVOX_VOLUMES"], "shells.h5"), "scan.h5")
    exec("import os\n" + code)
    picture = vtkPNGReader()
    picture.SetFileName("scan.png")
    picture.Update()
    colors = {tuple(pixel) for pixel in vtk_to_numpy(picture.GetOutput().GetPointData().GetScalars())[::7]}
    assert len(colors) > 150, len(colors)  # more than the background and axes
    assert display.Representation == "Volume (out of core)"
    os.chdir("/")
print("test_docs.py: passed")
