# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Checks pyramid files with h5py and numpy alone: check_pyramid.py FOLDER [--vtk].

Levels, statistics and the stock layout are computed anew from level 0, and level 0 from the formula
of WritePyramidSamples.cxx. With --vtk, VTK's own reader must deliver level 0. Exit code 77: skipped.
"""
import json
import pathlib
import sys

try:
    import h5py
    import numpy as np
except ImportError as error:
    print("skipped:", error)
    sys.exit(77)

SEAMS = "seams"


def formula(shape, kind):
    nz, ny, nx = shape[:3]
    components = shape[3] if len(shape) > 3 else 1
    z, y, x, c = np.meshgrid(*(np.arange(n) for n in (nz, ny, nx, components)), indexing="ij")
    value = ((x * x + 3 * y * z + 7 * z + 11 * c) % 97).astype(float)
    if kind != "u":
        value -= 40
    if kind == "f":
        value[(x // 3 + y // 5 + z // 4) % 5 == 0] = np.nan
    value[(x > nx // 2) & (y > ny // 2)] = 0
    return value.reshape(shape)


def groups(volume, ratio):
    """Yields (index, voxels) of each group of one component."""
    rz, ry, rx = ratio
    nz, ny, nx = volume.shape
    for z in range(0, nz, rz):
        for y in range(0, ny, ry):
            for x in range(0, nx, rx):
                yield ((z // rz, y // ry, x // rx),
                       volume[z:z + rz, y:y + ry, x:x + rx].ravel())


def combine(values, method):
    if values.dtype.kind == "f":
        values = values[~np.isnan(values)]
        if values.size == 0:
            return np.nan
    if method == "mode":
        unique, counts = np.unique(values, return_counts=True)
        return unique[np.argmax(counts)]
    if values.dtype.kind == "f":
        return values.astype(np.longdouble).sum() / values.size
    total, n = int(values.astype(np.int64).sum()), values.size
    return (2 * total + n) // (2 * n)


def downsample(fine, ratio, method):
    shape = tuple(-(-n // r) for n, r in zip(fine.shape[:3], ratio)) + fine.shape[3:]
    coarse = np.empty(shape, fine.dtype)
    if fine.ndim == 3:
        for index, values in groups(fine, ratio):
            coarse[index] = combine(values, method)
    else:
        for c in range(fine.shape[3]):
            coarse[..., c] = downsample(fine[..., c], ratio, method)
    return coarse


def gradient(volume, spacing):
    """Magnitude of central differences, one-sided at the ends; NaN counts as no difference."""
    total = np.zeros(volume.shape)
    v = volume.astype(float)
    for axis in range(3):
        n = v.shape[axis]
        if n == 1:
            continue
        i = np.arange(n)
        above, below = np.minimum(i + 1, n - 1), np.maximum(i - 1, 0)
        shape = [1] * 3
        shape[axis] = n
        step = (above - below).reshape(shape) * spacing[axis]
        d = (np.take(v, above, axis) - np.take(v, below, axis)) / step
        total += np.where(np.isnan(d), 0, d) ** 2
    return np.sqrt(total)


def check_statistics(group, level, volume, spacing, seams):
    planes = volume if volume.ndim == 4 else volume[..., None]
    edge = 8
    while True:
        cells = group[f"{level}/{edge}/Range"][()]
        slopes = group[f"{level}/{edge}/Gradient"][()].reshape(cells.shape[:3] + (-1,))
        assert cells.shape[3] == 2 * planes.shape[3]
        for c in range(planes.shape[3]):
            true_slope = gradient(planes[..., c], spacing)
            valid = ~np.isnan(planes[..., c].astype(float))
            for index, values in groups(planes[..., c], (edge,) * 3):
                low, high = cells[index][2 * c:2 * c + 2]
                values = values[~np.isnan(values.astype(float))]
                if values.size == 0:
                    assert not low <= high, (level, edge, index)
                else:
                    assert (low, high) == (values.min(), values.max()), (level, edge, index)
            for index, values in groups(np.where(valid, true_slope, 0), (edge,) * 3):
                # With the type's rounding; the bound is exact where there are no seams.
                assert slopes[index][c] >= values.max() * (1 - 1e-6), (level, edge, index)
                if not seams and planes.dtype.kind != "f":
                    assert slopes[index][c] <= values.max() * (1 + 1e-5) + 1e-30, (level, edge, index)
        if edge >= max(volume.shape[:3]):
            break
        edge *= 8
    assert cells.shape[:3] == (1, 1, 1)


def check(path):
    with h5py.File(path, "r") as f:
        image = f["VTKHDF"]
        assert image.attrs["Type"] == b"ImageData" and list(image.attrs["Version"]) == [1, 0]
        cell_data = "CellData" in image
        data = image["CellData" if cell_data else "PointData"]
        name = data.attrs["Scalars"].decode()
        assert name == "density"
        finest = data[name]
        assert f["Pyramid/0"] == finest
        shape = np.array(finest.shape[2::-1])
        extent = image.attrs["WholeExtent"]
        assert list(extent[1::2] - extent[::2] + 1) == list(shape + (1 if cell_data else 0))
        assert list(extent[::2]) == [0, 0, 0]
        assert list(f["Pyramid"].attrs["ExtentStart"]) == [4, 0, -2]
        first = np.array([0.5 if cell_data else 0] * 3)
        assert np.allclose(image.attrs["Origin"] + first * image.attrs["Spacing"], [10, 20, 30])

        volume = finest[()]
        expected = formula(volume.shape, volume.dtype.kind)
        assert np.array_equal(volume.astype(float), expected, equal_nan=True)

        method = f["Pyramid"].attrs["Downsampling"]
        method = method.decode() if isinstance(method, bytes) else method
        text = f["Pyramid"].attrs["multiscales"]
        multiscale = json.loads(text)[0]
        assert multiscale["version"] == "0.4" and multiscale["type"] == method
        assert [a["name"] for a in multiscale["axes"]] == ["z", "y", "x"]
        base = np.array(multiscale["datasets"][0]["coordinateTransformations"][0]["scale"])
        assert list(base[::-1]) == list(image.attrs["Spacing"])
        last = np.array([1, 1, 1])
        for level, entry in enumerate(multiscale["datasets"]):
            scale, move = entry["coordinateTransformations"]
            factor = np.rint(np.array(scale["scale"]) / base).astype(int)
            assert np.allclose(move["translation"], base * (factor - 1) / 2)
            stored = f["Pyramid"][entry["path"]]
            assert stored.dtype == finest.dtype
            if level > 0:
                volume = downsample(volume, tuple(factor // last), method)
                tolerance = 1e-6 if volume.dtype == np.float32 else 1e-14
                assert volume.shape == stored.shape
                if volume.dtype.kind == "f":
                    assert np.allclose(stored[()], volume, tolerance, 1e-300, equal_nan=True)
                    volume = stored[()]
                else:
                    assert np.array_equal(stored[()], volume), level
            last = factor
            check_statistics(f["Pyramid/Statistics"], level, volume, base * factor,
                             SEAMS in path.name)
        assert max(volume.shape[:3]) <= 16

        valid = expected[~np.isnan(expected)]
        statistics = f["Pyramid/Statistics"].attrs
        if valid.size == 0:
            assert statistics["Range"][0] > statistics["Range"][1]
        else:
            assert list(statistics["Range"]) == [valid.min(), valid.max()]
            assert statistics["Histogram"].sum() == valid.size
            assert statistics["Histogram"].shape == (256,)
            if finest.dtype.itemsize <= 2:
                low, high = statistics["Range"]
                bins = np.minimum(((valid - low) * 256 // max(high - low, 1)).astype(int), 255)
                assert np.array_equal(statistics["Histogram"], np.bincount(bins, minlength=256))


def check_vtk(path):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOHDF import vtkHDFReader
    with h5py.File(path, "r") as f:
        finest = f["Pyramid/0"][()]
        cell_data = "CellData" in f["VTKHDF"]
    if 1 in finest.shape[:3]:
        print("not checked, vtkHDFReader 9.1 wants no axes of one voxel:", path.name)
        return
    if cell_data:
        print("not checked, vtkHDFReader 9.1 takes cells for points:", path.name)
        return
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    assert reader.CanReadFile(str(path))
    reader.Update()
    image = reader.GetOutputDataObject(0)
    attributes = image.GetCellData() if cell_data else image.GetPointData()
    array = vtk_to_numpy(attributes.GetArray("density"))
    assert np.array_equal(array.reshape(finest.shape), finest, equal_nan=finest.dtype.kind == "f")
    assert image.GetOrigin()[0] == (9.5 if cell_data else 10)


def main():
    paths = sorted(pathlib.Path(sys.argv[1]).glob("*.h5"))
    assert len(paths) >= 10, "the samples weren't written"
    vtk = "--vtk" in sys.argv
    if vtk:
        try:
            import vtkmodules.vtkIOHDF  # noqa: F401
        except ImportError as error:
            print("skipped:", error)
            return 77
    lz4 = h5py.h5z.filter_avail(32004)
    skipped = 0
    for path in paths:
        with h5py.File(path, "r") as f:
            needs_lz4 = "32004" in f["Pyramid/0"]._filters
        if needs_lz4 and not lz4:
            print("not checked, HDF5's LZ4 filter isn't installed:", path.name)
            skipped += 1
            continue
        (check_vtk if vtk else check)(path)
        print("good:", path.name)
    return 77 if skipped else 0


sys.exit(main())
