# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Runs Examples/Cxx/SortLast with 1, 2, 3, 4 and 8 ranks: check_sortlast.py SORTLAST MPIEXEC TERAVOX PAGE

The pictures of several ranks are that of one within 1/255, whatever the marcher, the light and what
came before; each rank reads a part; a rank without its file leaves its block out, and the others'
are there. PAGE: docs/distributed.md, whose commands are run as they stand.
"""
import os
import re
import subprocess
import sys
import tempfile

import numpy

SORTLAST, MPIEXEC, TERAVOX, PAGE = sys.argv[1:5]
SIZE = 160
LINE = re.compile(
    r"frame (\d+) rank (\d+) block (\S+) (\S+) (\S+) read (\d+) bytes, (\d+) bricks; "
    r"drawn in (\S+) s, blended in (\S+) s, (\d+) bytes sent, (\d+) failures"
)
ENVIRONMENT = dict(
    os.environ,
    OMPI_ALLOW_RUN_AS_ROOT="1",
    OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
    OMPI_MCA_rmaps_base_oversubscribe="1",
    OMPI_MCA_hwloc_base_binding_policy="none",
    OMP_NUM_THREADS="1",
)


def run(ranks, file, *options):
    """The exit code, the float picture, what each rank reported (frame by frame), standard error."""
    for name in ("picture.png", "picture.raw"):
        if os.path.exists(name):
            os.remove(name)
    command = [MPIEXEC, "-np", str(ranks), SORTLAST, file, "picture.png"]
    command += ["--size", str(SIZE), str(SIZE), "--brick", "32", "--floats", "picture.raw", *options]
    done = subprocess.run(
        command, env=ENVIRONMENT, text=True, capture_output=True, check=False, timeout=500
    )
    if not os.path.exists("picture.raw"):
        raise RuntimeError(f"{' '.join(command)}: {done.returncode}\n{done.stdout}{done.stderr}")
    assert os.path.getsize("picture.png") > 100
    picture = numpy.fromfile("picture.raw", numpy.float32).reshape(SIZE, SIZE, 4)
    reports = [
        {
            "frame": int(m[1]),
            "rank": int(m[2]),
            "block": (m[3], m[4], m[5]),
            "bytes": int(m[6]),
            "bricks": int(m[7]),
            "draw": float(m[8]),
            "blend": float(m[9]),
            "sent": int(m[10]),
            "failures": int(m[11]),
        }
        for m in LINE.finditer(done.stdout)
    ]
    return done.returncode, picture, reports, done.stderr


def check_equal(file, options, several=(2, 3, 4, 8)):
    code, one, reports, _ = run(1, file, *options)
    assert code == 0 and one[..., 3].max() > 0.5, (code, one[..., 3].max())
    whole = reports[0]["bytes"]
    for ranks in several:
        code, picture, reports, _ = run(ranks, file, "--frames", "2", *options)
        assert code == 0, code
        off = numpy.abs(picture - one).max()
        first = [r for r in reports if r["frame"] == 0]
        second = [r for r in reports if r["frame"] == 1]
        assert len(first) == ranks and len({r["block"] for r in first}) == ranks, first
        read = [r["bytes"] for r in first]
        print(
            f"{' '.join(options) or 'unshaded'}, {ranks} ranks: {off:.5f} from one rank; bytes "
            f"{sum(read) / whole:.2f} x one rank's, most over mean "
            f"{max(read) * ranks / sum(read):.2f}; then {sum(r['bytes'] for r in second)} bytes; "
            f"drawn in {max(r['draw'] for r in first):.2f} s, blended in "
            f"{max(r['blend'] for r in first):.3f} s"
        )
        assert off <= 1 / 255, off
        # Statistics, and chunks of 16 voxels across faces of blocks of some 64, are read by several,
        # and so is what one rank knows to be hidden.
        assert whole <= sum(read) <= 2.5 * whole, (read, whole)
        assert max(read) < whole, (read, whole)


def check_missing_file(file):
    """Ranks with copies of their own, one of which is gone."""
    ranks, gone = 4, 1
    for rank in range(ranks):
        if rank != gone:
            os.link(file, f"copy{rank}.h5")
    _, whole, _, _ = run(ranks, file)
    code, picture, reports, errors = run(ranks, "copy%r.h5")
    assert code == 3, code
    assert f"rank {gone}: copy{gone}.h5 can't be read; its block is left out." in errors, errors
    assert [r["failures"] for r in reports] == [int(r == gone) for r in range(ranks)], reports
    assert reports[gone]["bytes"] == 0
    # Less opaque, nowhere more, and not nothing.
    assert (picture[..., 3] <= whole[..., 3] + 1e-5).all()
    assert 0.2 * whole[..., 3].sum() < picture[..., 3].sum() < 0.98 * whole[..., 3].sum()
    code, _, _, errors = run_nothing(ranks)
    assert code != 0 and "can't be read" in errors


def check_turned(file):
    """A preview, then a camera that turns: suspicions and blocks are those of the frames before."""
    options = ["--frames", "4", "--turn", "35", "--shade"]
    _, one, _, _ = run(1, file, *options)
    for ranks in (2, 4):
        code, picture, _, _ = run(ranks, file, *options, "--preview", "2")
        off = numpy.abs(picture - one).max()
        print(f"turned, {ranks} ranks: {off:.5f} from one rank")
        assert code == 0 and off <= 1 / 255, (code, off)


def check_page(page):
    """The commands of the documentation, in a folder with a volume of that name."""
    with open(page, encoding="utf-8") as text:
        commands = [line.strip() for line in text if re.match(r" {4}mpirun ", line)]
    assert len(commands) == 1, commands
    os.symlink(MPIEXEC, "mpirun")
    path = os.pathsep.join((os.getcwd(), os.path.dirname(SORTLAST), os.environ["PATH"]))
    for command in commands:
        done = subprocess.run(
            ["bash", "-euc", command], env=dict(ENVIRONMENT, PATH=path), text=True,
            capture_output=True, check=False, timeout=500
        )
        print(done.stdout, end="")
        assert done.returncode == 0 and "all ranks read" in done.stdout, (command, done)


def run_nothing(ranks):
    """No rank has a file: no picture."""
    command = [MPIEXEC, "-np", str(ranks), SORTLAST, "nothing%r.h5", "nothing.png"]
    done = subprocess.run(
        command, env=ENVIRONMENT, text=True, capture_output=True, check=False, timeout=100
    )
    assert not os.path.exists("nothing.png")
    return done.returncode, None, None, done.stderr


PAGE = os.path.abspath(PAGE)
with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    subprocess.run(
        [TERAVOX, "convert", "formula:marschner-lobb", "volume.h5", "--brick", "16"]
        + ["--dimensions", "128", "112", "144"],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    check_equal("volume.h5", [])
    check_equal("volume.h5", ["--shade", "--direction", "-1", "0.3", "0.2"])
    check_equal("volume.h5", ["--shade", "--marcher", "gpu"], several=(3, 4))
    check_turned("volume.h5")
    check_missing_file("volume.h5")
    os.remove("picture.png")
    check_page(PAGE)
    assert os.path.getsize("picture.png") > 10000
    os.chdir("/")
print("all equal")
