# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Runs what stands in a page of the documentation, block after block, in a folder of its own: run_page.py PAGE.md

    ```python   runs in this interpreter; names are kept from block to block
    ```sh       runs in bash; the first command that fails ends it
    ```console  lines that begin with "$ " are run, fail or not; what follows is what they print,
                where an ellipsis (U+2026) stands for any text within a line
    <!-- run    as ```sh, for what a reader has already

Blocks of another kind (```text, ```cpp) aren't run. The program `teravox` is the one on the path; SAMPLES is the script
that makes a reader's files.
"""
import os
import re
import subprocess
import sys
import tempfile

page = os.path.abspath(sys.argv[1])
with open(page, encoding="utf-8") as file:
    text = file.read()
pattern = r"^```(python|sh|console)\n(.*?)^```$|^<!-- (run)\n(.*?)^-->$"
environment = dict(os.environ, SAMPLES=os.path.join(os.path.dirname(os.path.abspath(__file__)), "make_samples.py"))


def shell(script):
    """Runs a script: its exit code and all that it printed."""
    result = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", script], env=environment, text=True, stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False,
    )
    return result.returncode, result.stdout


def run_console(block, line):
    """Compares what each command prints with what the page says."""
    for part in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
        command, _, expected = part.partition("\n")
        _, printed = shell(command)
        like = ".*".join(re.escape(piece) for piece in expected.strip().split("\u2026"))
        if not re.fullmatch(like, printed.strip()):
            sys.exit(f"{page}, block at line {line}: '{command}' prints\n{printed}\ninstead of\n{expected}")


names = {}
kinds = []
with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    for match in re.finditer(pattern, text, re.MULTILINE | re.DOTALL):
        kind = match.group(1) or match.group(3)
        block = match.group(2) or match.group(4)
        line = text.count("\n", 0, match.start()) + 1
        kinds.append(kind)
        if kind == "python":
            # So that errors tell the line of the page.
            exec(compile("\n" * line + block, page, "exec"), names)  # pylint: disable=exec-used
        elif kind == "console":
            run_console(block, line)
        else:
            code, printed = shell(block)
            print(printed, end="")
            if code != 0:
                sys.exit(f"{page}, block at line {line}: exit code {code}.")
    pictures = [name for name in os.listdir(folder) if name.endswith(".png")]
    os.chdir("/")
fences = re.findall(r"^```(python|sh|console)$|^<!-- (run)$", text, re.MULTILINE)
if len(kinds) != len(fences) or not kinds:
    sys.exit(f"{page}: {len(fences)} blocks begin, {len(kinds)} end.")
print(f"{len(kinds)} blocks, {len(pictures)} pictures")
