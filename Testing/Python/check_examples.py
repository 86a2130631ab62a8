# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""One of Examples/Python/volumes beside VTK's own mapper and beside its baseline.

    check_examples.py EXAMPLE.py BASELINE.png FOLDER

The example runs as it is, and once more with one class name swapped: vtkGPUVolumeRayCastMapper in
the place of vtkOutOfCoreVolumeMapper, with short steps. Mean and 99th percentile of the difference
of their pictures are bounded: VTK's steps of 0.1 voxel and its 8-bit filtering make most of it; at
single pixels along edges the two may differ. The baseline, rendered by this very script, bounds
them more closely, since only compilers and drivers lie between.
"""
import os
import sys

import numpy
import vtk
from vtk.util.numpy_support import vtk_to_numpy

OURS = "teravox.vtkOutOfCoreVolumeMapper()"
# What the data's own 8 bits and steps need to be compared at all.
THEIRS = "fine_steps(vtk.vtkGPUVolumeRayCastMapper())"
MEAN_BESIDE_VTK = 2.0  # of 255
P99_BESIDE_VTK = 24.0  # grazing rays of surfaces and of steep functions
MEAN_OF_BASELINE = 0.1
MAX_OF_BASELINE = 8.0


def fine_steps(mapper):
    mapper.SetAutoAdjustSampleDistances(0)
    mapper.SetSampleDistance(0.1)
    return mapper


def run(source, name, picture):
    sys.argv = [name, picture]
    exec(compile(source, name, "exec"), {"__name__": "__main__", "fine_steps": fine_steps})


def pixels(file):
    reader = vtk.vtkPNGReader()
    reader.SetFileName(file)
    reader.Update()
    return vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars()).astype(float)[:, :3]


def main(example, baseline, folder):
    sys.path.insert(0, os.path.dirname(example))
    name = os.path.basename(example)[:-3]
    ours = os.path.join(folder, name + ".png")
    theirs = os.path.join(folder, name + "-vtk.png")
    source = open(example, encoding="utf-8").read()
    assert source.count(OURS) == 1, "the class name is there once"
    run(source, example, ours)
    run(source.replace(OURS, THEIRS), example, theirs)
    picture = pixels(ours)
    assert picture.std() > 10, "there is nothing to be seen"
    beside = numpy.abs(picture - pixels(theirs))
    mean, p99 = beside.mean(), numpy.percentile(beside, 99)
    print(f"beside VTK: mean {mean:.3f}, 99th percentile {p99:.1f}, max {beside.max():.0f} of 255")
    assert mean <= MEAN_BESIDE_VTK and p99 <= P99_BESIDE_VTK
    assert os.path.getsize(baseline) < 120 * 1024
    difference = numpy.abs(picture - pixels(baseline))
    print(f"baseline: mean {difference.mean():.4f}, max {difference.max():.0f} of 255")
    assert difference.mean() <= MEAN_OF_BASELINE and difference.max() <= MAX_OF_BASELINE


if __name__ == "__main__":
    main(*sys.argv[1:])
