#!/usr/bin/env python3
# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""What the native marcher spends its time on, scene by scene.

    profile.py <program teravox> [--tolerance T] [--frames N] [--size PIXELS] scene...

Runs `teravox bench error` for each scene under perf (Debian: linux-perf), and adds up the samples of the
clock by the source file that each instruction comes from; small helpers (vectors of lanes, the fixed
point) count for whom they were inlined into. Needs line numbers in the program and its libraries:
cmake -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS=-g1. Scenes are those of `teravox bench error --list`.
Prints a Markdown table, shares in percent. Exit codes: 0 success, 1 failure, 77 without perf or line numbers.
"""
import argparse
import bisect
import collections
import os
import re
import shutil
import subprocess
import sys
import tempfile

# Columns, and the files whose instructions they count. What is in none of them is counted last.
STAGES = [
    ("walk, leaps", r"Kernel(Walk|Brick|Watch\w*)\.h|DirectoryReader|MarchParameters"),
    ("corners, cubics", r"KernelCells\.h"),
    ("cuts", r"Kernel(Cut|Turns)\.h"),
    ("pieces", r"Kernel(\w*Pieces|Transfer|Extinction|Gradient|Components?|ComponentTables)\.h"),
    ("spans", r"KernelSpan\.h"),
    ("light", r"KernelLight\.h"),
    ("rays, lattice", r"Kernel(|Ray|Draw|Lattice|\w*Projection\w*)\.h|Kernel\w*\.cxx|NativeMarcher|ImageLattice"),
]
HELPERS = re.compile(r"Kernel(Vector|Fixed)\.h|/include/|intrin\.h|EachWay|/shared/", re.IGNORECASE)
OTHERS = ["engine", "OpenGL, VTK", "kernel, waiting"]


def text_segments(path):
    """[(file offset, size, address)] of what is executable in an ELF file."""
    out = subprocess.run(["readelf", "-lW", path], capture_output=True, text=True, check=True).stdout
    found = re.findall(r"LOAD\s+0x(\w+)\s+0x(\w+)\s+0x\w+\s+0x(\w+)\s+0x\w+\s+R E", out)
    return [(int(offset, 16), int(size, 16), int(address, 16)) for offset, address, size in found]


class Mappings:
    """Where the files of each process lie in its memory."""

    LINE = re.compile(r"PERF_RECORD_MMAP2?\s+(-?\d+)/\s*\d+: \[0x(\w+)\(0x(\w+)\) @ (?:0x)?(\w+) .*?\]: r-xp (.*)$")

    def __init__(self):
        self.of = collections.defaultdict(list)

    def add(self, line):
        match = self.LINE.search(line)
        if match:
            pid, begin, size, offset, path = match.groups()
            self.of[int(pid)].append((int(begin, 16), int(size, 16), int(offset, 16), path.strip()))
            self.of[int(pid)].sort()
        return bool(match)

    def find(self, pid, address):
        """(file, offset in the file), or None."""
        regions = self.of.get(pid, [])
        at = bisect.bisect_right(regions, (address, 1 << 64, 0, "")) - 1
        if at < 0 or address >= regions[at][0] + regions[at][1]:
            return None
        begin, _, offset, path = regions[at]
        return path, address - begin + offset


def skip(why):
    print("profile.py: SKIPPED: " + why)
    sys.exit(77)


def record(command, data):
    perf = ["perf", "record", "-q", "-F", "997", "-e", "cpu-clock", "-o", data, "--"]
    run = subprocess.run(perf + command, capture_output=True, text=True)
    if run.returncode and not os.path.exists(data):
        skip("perf can't record here: " + run.stderr.strip()[:300])
    if run.returncode:
        raise RuntimeError(run.stderr or run.stdout)


def samples(data):
    """{(pid, address): count} and the mappings; of the processes that draw."""
    out = subprocess.run(
        ["perf", "script", "-i", data, "--show-mmap-events", "-F", "comm,pid,ip"],
        capture_output=True, text=True, check=True).stdout
    mappings = Mappings()
    counts = collections.Counter()
    for line in out.splitlines():
        if not mappings.add(line):
            match = re.match(r"\s*\S.*?\s(\d+)\s+([0-9a-f]+)\s*$", line)
            if match:
                counts[(int(match.group(1)), int(match.group(2), 16))] += 1
    return counts, mappings


def source_files(binary, addresses):
    """{address: [innermost file, ..., outermost]}"""
    found = {}
    addresses = sorted(addresses)
    text = "\n".join("0x%x" % address for address in addresses)
    out = subprocess.run(["addr2line", "-a", "-i", "-e", binary], input=text, capture_output=True, text=True,
                         check=True).stdout
    current = None
    for line in out.splitlines():
        if line.startswith("0x"):
            current = found.setdefault(int(line, 16), [])
        else:
            current.append(line.rsplit(":", 1)[0])
    return found


def stage_of(files):
    for name in files:
        if HELPERS.search(name):
            continue
        for stage, pattern in STAGES:
            if re.search("(^|/)(" + pattern + ")", name):
                return stage
        return None
    return None


def shares(data, ours):
    """{stage: samples} of the processes that draw; `ours` are the files with line numbers."""
    counts, mappings = samples(data)
    wanted = collections.defaultdict(list)
    result = collections.defaultdict(collections.Counter)
    for (pid, address), count in counts.items():
        file, at = mappings.find(pid, address) or ("[kernel]", 0)
        file = os.path.realpath(file) if file.startswith("/") else file
        if file in ours:
            wanted[file] += [(at - offset + start, pid, count) for offset, size, start in ours[file]
                             if offset <= at < offset + size]
        else:
            result[pid][OTHERS[2 if re.search(r"libgomp|libc\.so|\[", file) else 1]] += count
    drawing = set()
    for binary, places in wanted.items():
        files = source_files(binary, {address for address, _, _ in places})
        for address, pid, count in places:
            stage = stage_of(files.get(address, []))
            result[pid][stage or OTHERS[0]] += count
            if stage:
                drawing.add(pid)
    return sum((result[pid] for pid in drawing), collections.Counter())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--tolerance", default="1", help="in 1/255 (default 1)")
    parser.add_argument("--frames", default="20", help="frames of a scene (default 20)")
    parser.add_argument("--size", default="512", help="pixels per side (default 512)")
    options = parser.parse_args()
    program = os.path.realpath(options.program)
    if not shutil.which("perf"):
        skip("there is no perf")
    linked = subprocess.run(["ldd", program], capture_output=True, text=True, check=True).stdout
    library = re.search(r"=> (\S*libvtkRenderingOutOfCore\S*)", linked)
    ours = {path: text_segments(path) for path in [program] + [os.path.realpath(m) for m in
                                                               ([library.group(1)] if library else [])]}
    if not any(".debug_line" in subprocess.run(["readelf", "-SW", path], capture_output=True, text=True,
                                               check=True).stdout for path in ours):
        skip("the program has no line numbers")
    columns = [name for name, _ in STAGES] + OTHERS
    print("| scene | " + " | ".join(columns) + " |\n|" + " --- |" * (len(columns) + 1))
    for scene in options.scenes:
        with tempfile.TemporaryDirectory() as folder:
            data = os.path.join(folder, "perf.data")
            record([program, "bench", "error", "--scenes", scene, "--mappers", "teravox", "--tolerances",
                    options.tolerance, "--frames", options.frames, "--size", options.size, options.size,
                    "--every", "16"], data)
            result = shares(data, ours)
        total = sum(result.values())
        if total == 0:
            raise RuntimeError("no samples of " + scene)
        print("| %s | %s |" % (scene, " | ".join("%.0f" % (100 * result[c] / total) for c in columns)), flush=True)


if __name__ == "__main__":
    main()
