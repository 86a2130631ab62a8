# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Every command of the README: check_readme.py README.md

Commands of the program run as they stand, its benchmarks with options behind them that make them short. What
installs, builds or tests everything can't run inside of a test: those commands are ones that the scripts of
Testing run, and that is checked. Python runs; C++ is that of the example, which a test builds.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile

import numpy

README = os.path.abspath(sys.argv[1])
ROOT = os.path.dirname(README)
BRAIN = "/usr/share/mricron/templates/ch2.nii.gz"
# A line of the page, what makes it short.
SHORT = {
    "teravox bench": "--volumes 32 --size 32 32 --frames 1",
    "teravox bench scale": "--volumes 64 --files 128 --size 16 16 --frames 1 --gpu-memory 16M --host-memory 64M",
    "teravox bench load": "--edge 320 --repetitions 1 --types u8 --filters none",
    "teravox bench error --scenes 'brain*' --plots curves": "--list",
}
# A line of the page, the script and what it runs there: the very same but for its own folders.
ELSEWHERE = {
    "bash Examples/demo.sh": ("Testing/packages.sh", r'bash "\$source/Examples/demo.sh"'),
    "bash Testing/run.sh": (".ci/run", r'bash "\$\(dirname "\$0"\)/\.\./Testing/run\.sh"'),
    "cmake -S . -B build/release -G Ninja -DCMAKE_BUILD_TYPE=Release": (
        "Testing/run.sh",
        r'cmake -S "\$root" -B "\$folder" -G Ninja .*\n(.*\n)*.*configure "\$build/release" -DCMAKE_BUILD_TYPE=Release',
    ),
    "cmake --build build/release": ("Testing/run.sh", r'cmake --build "\$build/release"'),
    "cmake --install build/release --prefix /usr/local": (
        "Testing/Cxx/InstallAndUse.cmake",
        r'"\$\{CMAKE_COMMAND\}" --install "\$\{BUILD\}" --prefix',
    ),
}

with open(README, encoding="utf-8") as file:
    text = file.read()


def blocks(kind):
    return re.findall(rf"^```{kind}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def read(name):
    with open(os.path.join(ROOT, name), encoding="utf-8") as opened:
        return opened.read()


def run(command):
    done = subprocess.run(
        ["bash", "-euc", command], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        text=True, check=False,
    )
    if done.returncode != 0:
        sys.exit(f"README.md: '{command}' ends with {done.returncode}:\n{done.stdout}")


def check_line(line):
    """Returns whether it was run here."""
    if line in ELSEWHERE:
        script, pattern = ELSEWHERE[line]
        if not re.search(pattern, read(script)):
            sys.exit(f"README.md: {script} doesn't run '{line}' any more.")
        return False
    if not line.startswith("teravox "):
        sys.exit(f"README.md: no test runs '{line}'.")
    if line.startswith("teravox bench") and line not in SHORT:
        sys.exit(f"README.md: say in check_readme.py what makes '{line}' short.")
    run(f"{line} {SHORT.get(line, '')}")
    return True


def check_cxx():
    example = [line.strip() for line in read("Examples/Cxx/RenderPyramid/main.cxx").splitlines()]
    block, = blocks("cpp")
    for line in block.splitlines():
        # The example takes the file's name from its command line.
        if line.strip() not in example and "SetFileName" not in line:
            sys.exit(f"README.md: '{line}' isn't in the example.")


with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    if os.path.exists(BRAIN):
        shutil.copy(BRAIN, "scan.nii.gz")
    else:
        run("teravox convert formula:marschner-lobb scan.h5 --dimensions 64 64 64")
    ran = elsewhere = 0
    for block in blocks("sh"):
        for line in block.splitlines():
            command = re.sub(r" +#.*", "", line)
            if command.startswith("teravox convert scan.nii.gz") and not os.path.exists("scan.nii.gz"):
                continue  # Debian's package mricron-data isn't installed
            here = check_line(command)
            ran += here
            elsewhere += not here
    assert os.path.getsize("scan.png") > 2000 and os.path.getsize("far.png") > 2000
    os.remove("scan.png")
    python, = blocks("python")
    exec(compile(python, README, "exec"), {"array": numpy.random.rand(20, 24, 28)})  # pylint: disable=exec-used
    assert os.path.getsize("scan.png") > 2000
    check_cxx()
    os.chdir("/")
print(f"{ran} commands run here, {elsewhere} elsewhere")
