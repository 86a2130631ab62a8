# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Programs that know of VTK only, with and without libTeravoxAutoload.so.

check_autoload.py {GPU|Smart|MultiBlock|Switch|F3D} FOLDER. Exit code 77: what it needs isn't here.
"""
import os
import pathlib
import subprocess
import sys

import numpy
import vtk
from vtk.util.numpy_support import vtk_to_numpy

HERE = pathlib.Path(__file__).resolve().parent
PLAIN = HERE / "plain_volume.py"
AUTOLOAD = os.environ["TERAVOX_AUTOLOAD_PATH"]
LONG = 4096  # voxels; VTK's mapper ends at the largest edge of a 3-D texture, 2048 with Mesa
SHORT = 1024

folder = pathlib.Path(sys.argv[2])
folder.mkdir(parents=True, exist_ok=True)


def run(command, autoload, replace=None):
    """Standard output and error; the program has to end well."""
    env = {k: v for k, v in os.environ.items() if k not in ("VTK_AUTOLOAD_PATH", "TERAVOX_REPLACE")}
    if autoload:
        env["VTK_AUTOLOAD_PATH"] = AUTOLOAD
    if replace is not None:
        env["TERAVOX_REPLACE"] = replace
    done = subprocess.run(
        [str(c) for c in command], env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    assert done.returncode == 0, f"{command} ended with {done.returncode}:\n{done.stdout}"
    return done.stdout


def read(name):
    reader = vtk.vtkPNGReader()
    reader.SetFileName(str(name))
    reader.Update()
    return vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars()).astype(int)


def script(source, kind, voxels, name, **how):
    picture = folder / f"{name}.png"
    picture.unlink(missing_ok=True)
    messages = run([sys.executable, source, kind, voxels, picture], **how)
    return read(picture), messages


def swapped():
    """The plain script with one class name changed."""
    text = PLAIN.read_text()
    assert text.count("vtk.vtkGPUVolumeRayCastMapper") == 1
    text = text.replace("vtk.vtkGPUVolumeRayCastMapper", "teravox.vtkOutOfCoreVolumeMapper")
    path = folder / "swapped.py"
    path.write_text(text.replace("import vtk\n", "import vtk\nimport teravox\n", 1))
    return path


def check_script(kind):
    direct, messages = script(swapped(), "GPU", LONG, "direct", autoload=False)
    assert "WARN" not in messages and "ERR" not in messages, messages
    assert direct.max() > 150 and direct.std() > 10, "the direct picture shows nothing"
    without, messages = script(PLAIN, kind, LONG, "without", autoload=False)
    assert "Invalid texture dimensions" in messages, "VTK's own mapper has drawn this volume"
    assert without.max() == 0, "VTK's own mapper has drawn something"
    replaced, messages = script(PLAIN, kind, LONG, "replaced", autoload=True)
    assert "WARN" not in messages and "ERR" not in messages, messages
    assert (replaced == direct).all(), f"differs by {abs(replaced - direct).max()}/255 from the direct one"
    # Where VTK's mapper can: what both show is the same thing. Its samples lie as far apart as it
    # chooses, hence the bound, which is for a mean over pixels of which a third show the volume.
    theirs, _ = script(PLAIN, kind, SHORT, "vtk", autoload=False)
    ours, _ = script(PLAIN, kind, SHORT, "ours", autoload=True)
    difference = abs(theirs - ours)
    print(f"{kind}: mean difference from VTK's picture {difference.mean():.2f}/255, max {difference.max()}")
    assert theirs.max() > 150 and difference.mean() < 2


def check_switch():
    theirs, _ = script(PLAIN, "GPU", SHORT, "vtk", autoload=False)
    ours, _ = script(PLAIN, "GPU", SHORT, "on", autoload=True)
    assert (theirs != ours).any(), "nothing was replaced"
    for value, on in (("0", False), ("off", False), ("No", False), ("1", True), ("", True)):
        picture, _ = script(PLAIN, "GPU", SHORT, "switched", autoload=True, replace=value)
        assert (picture == (ours if on else theirs)).all(), f"TERAVOX_REPLACE={value}"


def check_f3d():
    program = os.environ.get("F3D_PROGRAM", "")
    if not program or program.endswith("NOTFOUND"):
        print("f3d isn't installed")
        sys.exit(77)
    length = LONG
    x = numpy.arange(length)[None, None, :]
    y = numpy.arange(16)[None, :, None]
    z = numpy.arange(16)[:, None, None]
    values = 128 + 100 * numpy.sin(x / 100) * numpy.cos(y / 5) * numpy.cos(z / 4)
    image = vtk.vtkImageData()
    image.SetDimensions(length, 16, 16)
    image.SetSpacing(1, 32, 32)
    scalars = vtk.util.numpy_support.numpy_to_vtk(values.astype(numpy.uint16).ravel(), deep=True)
    scalars.SetName("wave")
    image.GetPointData().SetScalars(scalars)
    file = folder / "bar.vti"
    writer = vtk.vtkXMLImageDataWriter()
    writer.SetFileName(str(file))
    writer.SetInputData(image)
    writer.Write()

    def draw(name, autoload, replace=None):
        picture = folder / f"{name}.png"
        picture.unlink(missing_ok=True)
        run([program, "--volume", "--resolution", "320,240", "--output", picture, file], autoload, replace)
        return read(picture)

    without = draw("without", False)
    assert without.std() == 0, "VTK's own mapper has drawn something"
    replaced = draw("replaced", True)
    # The background is grey; f3d's colours are black, red, yellow, white.
    shown = (replaced != without).any(axis=1).mean()
    print(f"f3d: {100 * shown:.1f} % of the picture show the volume")
    assert 0.02 < shown < 0.5
    assert replaced[:, 0].max() > 200 and replaced[:, 0].min() < without[0, 0]
    assert (draw("off", True, "0") == without).all()


{"Switch": check_switch, "F3D": check_f3d}.get(sys.argv[1], lambda: check_script(sys.argv[1]))()
