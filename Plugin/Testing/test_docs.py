# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""The Python block of docs/paraview.md, with the plugin and a volume of the tests: test_docs.py <page>."""
import os
import re
import shutil
import sys
import tempfile

page = open(sys.argv[1], encoding="utf-8").read()
blocks = re.findall(r"```python\n(.*?)```", page, re.S)
assert len(blocks) == 1, len(blocks)
code, replaced = re.subn(r'LoadPlugin\("[^"]*"', 'LoadPlugin(os.environ["TERAVOX_PLUGIN"]', blocks[0])
assert replaced == 1
with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    shutil.copy(os.path.join(os.environ["TERAVOX_VOLUMES"], "shells.h5"), "scan.h5")
    exec("import os\n" + code)
    assert os.path.getsize("scan.png") > 2000
    assert display.Representation == "Volume (out of core)"
    os.chdir("/")
print("test_docs.py: passed")
