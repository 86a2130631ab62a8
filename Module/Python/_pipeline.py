# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""From files and arrays to sources, volumes and pyramid files."""
from __future__ import annotations

import itertools
import os
from typing import Any, Callable, Iterable, Sequence

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonExecutionModel import vtkAlgorithm
from vtkmodules.vtkRenderingCore import vtkVolume

from . import _interrupt, _levels, _look, _vtk
from .vtkRenderingOutOfCore import (
    vtkBrickSource,
    vtkBrickSourceAlgorithm,
    vtkHDF5PyramidReader,
    vtkHDF5PyramidWriter,
    vtkImagePiecesReader,
    vtkOutOfCoreVolumeMapper,
)


_SAMPLE = 1 << 21  # voxels that are read at once to learn what the values are like


def _bytes(size):
    """Bytes of a number, or of a text such as "512M" or "4G" (powers of 1024)."""
    if isinstance(size, str):
        text = size.strip().upper().removesuffix("B").removesuffix("I")
        factor = {"K": 1 << 10, "M": 1 << 20, "G": 1 << 30, "T": 1 << 40}.get(text[-1:], 1)
        try:
            size = float(text[:-1] if factor > 1 else text) * factor
        except ValueError:
            raise ValueError(f"{size!r} is no number of bytes such as 512M or 4G.") from None
    if not size > 0:
        raise ValueError(f"A budget of {size} bytes is too small.")
    return int(size)


def _three(name, values):
    values = tuple(float(v) for v in values)
    if len(values) != 3:
        raise ValueError(f"{name} has {len(values)} numbers; it needs three, as (x, y, z).")
    return values


def open(
    path: str | os.PathLike,
    *,
    dataset: str = "",
    channel: int = 0,
    time: int | None = None,
    brick_size: int | None = None,
) -> vtkHDF5PyramidReader:
    """Opens an HDF5 pyramid, the image of a VTKHDF file, or one 3-D dataset of an HDF5 file.

    Reads names, shapes and attributes only, whatever the size of the file.

    path: the file.
    dataset: path of a dataset (z, y, x[, component]) in the file; empty: the file's pyramid.
    channel: counted from 0; -1 takes all, at most four, as components.
    time: time point, counted from 0; None: the one that the pipeline asks for, at first the first.
    brick_size: inner edge of the bricks that are handed to the mapper, in voxels; default 64.

    Returns a vtkHDF5PyramidReader: a VTK source, see info() and read().
    Raises FileNotFoundError, or RuntimeError with a sentence that says why it can't be opened.
    """
    path = os.fspath(path)
    if not os.path.exists(path):
        raise FileNotFoundError(f"{path} doesn't exist.")
    reader = vtkHDF5PyramidReader()
    reader.SetFileName(path)
    reader.SetDatasetPath(dataset)
    reader.SetChannel(channel)
    reader.SetTimePoint(-1 if time is None else time)
    if brick_size is not None:
        reader.SetBrickSize(brick_size)
    with _vtk.errors_raised(reader):
        reader.GetBrickSource()
    return reader


def source(
    data: Any,
    *,
    spacing: Iterable[float] | None = None,
    origin: Iterable[float] | None = None,
    dataset: str = "",
    labels: bool = False,
    value_range: Sequence[float] | None = None,
    name: str = "",
    brick_size: int | None = None,
) -> vtkBrickSourceAlgorithm:
    """Makes a source of a file, an array, or a list of arrays.

    data: a path (see open()); an array, anything with `shape`, `dtype` and `__getitem__`, of numpy,
        h5py, zarr, dask and others; or a list of arrays, the finest first. Axes are (z, y, x) or
        (z, y, x, component), x fastest in memory by convention of C; any strides and byte order do.
        Arrays are read brick by brick by threads and must not change; the source keeps them alive.
        Types: integers of 8, 16, 32 bits, floats of 16 (read as 32), 32, 64 bits, bool (as 0, 1);
        else TypeError. A vtkBrickSourceAlgorithm is returned as it is.
    spacing, origin: edge lengths of a voxel of the finest level, and the world position of the
        centre of its first voxel, as (x, y, z); default 1 each, and 0 each. Not for files, which
        have their own.
    dataset: see open().
    labels: values are labels: nearest interpolation, coarser levels by the most frequent value.
    value_range: (smallest, largest) value where they are known for certain; of numpy arrays they
        are found.
    name: what messages call the volume.
    brick_size: inner edge of a brick in voxels; default 64.

    A list's levels must be the first one's size by whole factors, rounded up or down. If its last
    level is larger than a brick, coarser ones are made when they are needed, by averaging, and kept
    in main memory: a seventh of that level's size. An array without levels that is larger than
    memory is better converted (convert()).

    Returns a vtkBrickSourceAlgorithm: a VTK source.
    """
    if isinstance(data, vtkBrickSourceAlgorithm):
        given = {"spacing": spacing, "origin": origin, "value_range": value_range}
    elif isinstance(data, (str, os.PathLike)):
        given = {"spacing": spacing, "origin": origin, "value_range": value_range}
    else:
        levels = [data] if _levels.is_array(data) else list(data) if _iterable(data) else [data]
        if not levels:
            raise ValueError("The list has no level.")
        for level in levels:
            if not _levels.is_array(level):
                raise TypeError(
                    f"A volume is a path, an array, or a list of arrays (with shape, dtype and "
                    f"__getitem__), not {type(level).__name__}."
                )
        made = _levels.source_of_levels(
            levels,
            spacing=_three("spacing", (1, 1, 1) if spacing is None else spacing),
            origin=_three("origin", (0, 0, 0) if origin is None else origin),
            labels=labels,
            name=name,
            value_range=value_range,
            brick_size=brick_size,
        )
        with _vtk.errors_raised(made):
            made.GetBrickSource()
        return made
    for argument, value in given.items():
        if value is not None:
            raise ValueError(f"{argument} is for arrays; this volume has its own.")
    if isinstance(data, vtkBrickSourceAlgorithm):
        return data
    return open(data, dataset=dataset, brick_size=brick_size)


def _iterable(thing):
    return hasattr(thing, "__iter__") and not isinstance(thing, (bytes, dict, set))


def info(volume_source: vtkBrickSourceAlgorithm | vtkBrickSource) -> dict[str, Any]:
    """What a source says about itself, without reading a voxel.

    volume_source: what open() or source() returned, or its GetBrickSource().

    Returns a dict: `shape` (z, y, x) and `levels`, the shapes of all levels, the finest first;
    `components`, `dtype`, `spacing` and `origin` (x, y, z); `range`, None where it isn't known;
    `labels`, `name`.
    """
    bricks = _bricks(volume_source)
    levels = []
    for level in range(bricks.GetNumberOfLevels()):
        dimensions = [0, 0, 0]
        bricks.GetLevelDimensions(level, dimensions)
        levels.append(tuple(dimensions[::-1]))
    value_range, spacing, origin = [0.0, 0.0], [0.0] * 3, [0.0] * 3
    bricks.GetScalarRange(value_range)
    bricks.GetSpacing(spacing)
    bricks.GetOrigin(origin)
    return {
        "name": bricks.GetName(),
        "shape": levels[0],
        "levels": levels,
        "components": bricks.GetNumberOfComponents(),
        "dtype": _look.numpy_type(bricks.GetScalarType()),
        "range": tuple(value_range) if value_range[0] <= value_range[1] else None,
        "spacing": tuple(spacing),
        "origin": tuple(origin),
        "labels": bricks.HasLabels(),
    }


def _bricks(volume_source):
    if isinstance(volume_source, vtkBrickSourceAlgorithm):
        with _vtk.errors_raised(volume_source):
            return volume_source.GetBrickSource()
    return volume_source


def read(
    volume_source: vtkBrickSourceAlgorithm | vtkBrickSource,
    level: int = 0,
    box: Sequence[slice] | None = None,
) -> np.ndarray:
    """Reads a box of voxels of one level, with several threads.

    volume_source: what open() or source() returned.
    level: 0 is the finest.
    box: three slices (z, y, x) as for a numpy array, without steps; default: the whole level.

    Returns a numpy array (z, y, x[, component]). Raises IndexError for a box or level that isn't
    there, RuntimeError where the voxels can't be read.
    """
    bricks = _bricks(volume_source)
    about = info(bricks)
    if not 0 <= level < len(about["levels"]):
        raise IndexError(f"There is no level {level}; there are {len(about['levels'])}.")
    shape = about["levels"][level]
    ranges = [s.indices(n) for s, n in zip(box or (slice(None),) * 3, shape)]
    if len(ranges) != 3 or any(step != 1 or stop <= start for start, stop, step in ranges):
        raise IndexError(f"{box} is no box of voxels of a level of shape {shape}.")
    first = [r[0] for r in ranges]
    size = [r[1] - r[0] for r in ranges]
    with _vtk.errors_raised(bricks):
        array = bricks.ReadVoxels(level, first[::-1], size[::-1])
    voxels = vtk_to_numpy(array)
    return voxels.reshape(size + ([about["components"]] if about["components"] > 1 else []))


def volume(
    data: Any,
    *,
    spacing: Iterable[float] | None = None,
    origin: Iterable[float] | None = None,
    dataset: str = "",
    labels: bool = False,
    value_range: Sequence[float] | None = None,
    name: str = "",
    brick_size: int | None = None,
    opacity: Any = None,
    cmap: str | None = None,
    colors: Any = None,
    clim: Sequence[float] | None = None,
    shade: bool | None = None,
    gpu_memory: int | str | None = None,
    host_memory: int | str | None = None,
    tolerance: float | None = None,
    threads: int | None = None,
) -> vtkVolume:
    """Makes a vtkVolume that is ready to be drawn: for a vtkRenderer's AddVolume(), or PyVista's
    add_actor().

    data, spacing, origin, dataset, labels, value_range, name, brick_size: see source().
    opacity: one number, 0...1 at all values; a list of numbers, spread evenly over clim; a list of
        (value, opacity); or a vtkPiecewiseFunction. The number is the opacity of a slab as thick as
        an average voxel edge. Default: from the histogram; what seems to be background is left out.
    cmap: name of a colour map: "gray", "bone", "hot", "viridis", "coolwarm", or any of matplotlib's
        if that is installed. colors: a list of colours (names, "#rrggbb", or (r, g, b) in 0...1)
        spread evenly over clim; a list of (value, colour); or a vtkColorTransferFunction. One of
        both; default: as for opacity.
        Components are channels: each has these functions; by default, the first to fourth one are
        red, green, blue, white. The property's IndependentComponentsOff() makes them luminance and
        opacity, or RGBA.
    clim: (low, high), the values that evenly spread opacities and colours go from and to; default:
        the range of the data where it is known, else of a sample of it.
    shade: light it? Default: yes, except labels.
    gpu_memory, host_memory: budgets in bytes, or as "512M", "4G". Default: see
        vtkOutOfCoreVolumeMapper.
    tolerance: largest error of a converged picture, 0...1 as colours are; default 1/255.
    threads: number of threads that load bricks; default: as many as processors, at most 8.

    Its mapper is a vtkOutOfCoreVolumeMapper. A brick that can't be read fires the mapper's
    BrickFailedEvent, is drawn from a coarser level, and keeps the picture from being converged.
    """
    made = source(
        data, spacing=spacing, origin=origin, dataset=dataset, labels=labels,
        value_range=value_range, name=name, brick_size=brick_size,
    )
    mapper = vtkOutOfCoreVolumeMapper()
    mapper.SetInputConnection(made.GetOutputPort())
    if gpu_memory is not None:
        mapper.SetGPUMemoryBudget(_bytes(gpu_memory))
    if host_memory is not None:
        mapper.SetHostMemoryBudget(_bytes(host_memory))
    if tolerance is not None:
        mapper.SetImageErrorTolerance(tolerance)
    if threads is not None:
        mapper.SetNumberOfLoaderThreads(threads)
    result = vtkVolume()
    result.SetMapper(mapper)
    _look.apply(
        made, result.GetProperty(), opacity=opacity, cmap=cmap, colors=colors, clim=clim,
        shade=shade,
    )
    return result


_IMAGE_READERS = {
    ".nii": ("vtkIOImage", "vtkNIFTIImageReader"),
    ".nii.gz": ("vtkIOImage", "vtkNIFTIImageReader"),
    ".mha": ("vtkIOImage", "vtkMetaImageReader"),
    ".mhd": ("vtkIOImage", "vtkMetaImageReader"),
    ".nrrd": ("vtkIOImage", "vtkNrrdReader"),
    ".nhdr": ("vtkIOImage", "vtkNrrdReader"),
    ".tif": ("vtkIOImage", "vtkTIFFReader"),
    ".tiff": ("vtkIOImage", "vtkTIFFReader"),
    ".vti": ("vtkIOXML", "vtkXMLImageDataReader"),
}

# What only the writer reads: it says why it can't.
_NO_OTHER_READER = (".mrc", ".mrcs", ".map", ".ccp4", ".rec", ".st", ".ali", ".mrc.gz", ".map.gz", ".ccp4.gz",
                    ".png", ".jpg", ".jpeg", ".bmp", ".pnm", ".pgm", ".ppm", ".tga", ".slc",
                    ".dcm")


def _image_reader(path):
    """A reader for an image file that the writer doesn't read itself, or None for HDF5."""
    if path.lower().endswith(".pvti"):
        reader = vtkImagePiecesReader()
        reader.SetFileName(path)
        with _vtk.errors_raised(reader, reader.GetExecutive()):
            reader.UpdateInformation()
        return reader
    for extension, (module, name) in _IMAGE_READERS.items():
        if path.lower().endswith(extension):
            reader = getattr(__import__(f"vtkmodules.{module}", fromlist=[name]), name)()
            if not reader.CanReadFile(path):
                raise RuntimeError(
                    f"{path} isn't what its extension says, or it is damaged."
                )
            reader.SetFileName(path)
            return reader
    return None


def convert(
    data: Any,
    path: str | os.PathLike,
    *,
    spacing: Iterable[float] | None = None,
    origin: Iterable[float] | None = None,
    dataset: str = "",
    labels: bool = False,
    compression: str = "lz4",
    compression_level: int = 0,
    brick_size: int = 64,
    memory: int | str = "1G",
    resume: bool = False,
    progress: Callable[[int, int], object] | bool | None = None,
) -> dict[str, int]:
    """Writes a volume into an HDF5 pyramid, in bounded memory.

    data: a path of an image (NIfTI, MetaImage, NRRD, MRC, TIFF, PNG, JPEG, BMP, DICOM, VTI) or HDF5 file,
        of a folder of TIFF, PNG, JPEG or DICOM slices, or a pattern of their names (slice*.tif,
        slice%03d.png); an array (of a list, the finest is written); a VTK algorithm with an image as
        output.
    path: the file to write. It appears when it is complete; an error or Ctrl-C leaves nothing,
        unless with resume.
    spacing, origin: (x, y, z) of an array, or instead of what an image says: distance of voxels,
        centre of the first one. HDF5 and VTI files have their own; ValueError.
    dataset, labels: see source(). dataset is also the UID of a DICOM series.
    compression: "lz4" (fastest to read), "deflate" (smallest, read by all HDF5 programs), "none".
    compression_level: 1 (fast) to 12 (small); 0 takes 1.
    brick_size: edge of a storage chunk in voxels, a multiple of 8.
    memory: bytes that the writing may take, also as "512M".
    resume: go on from what a conversion of the same data to this path, also with resume, left when
        it was killed, failed or was interrupted; the same file as an undisturbed one writes.
        That the data are the same is checked for files (names, sizes, times), not for arrays.
    progress: a function of (bytes done, bytes in total); False: none. Default: a bar of tqdm, if
        that is installed.

    Returns a dict: `levels`, `bytes` of the voxels, `file_bytes`.
    Raises FileNotFoundError, RuntimeError with a sentence, KeyboardInterrupt.
    """
    compressions = {"none": 0, "deflate": 1, "lz4": 2}
    if compression not in compressions:
        raise ValueError(f"compression is {compression!r}; it may be {', '.join(compressions)}.")
    writer = vtkHDF5PyramidWriter()
    sources = [writer]
    if isinstance(data, (str, os.PathLike)):
        name = os.fspath(data)
        if not os.path.exists(name) and not any(c in name for c in "*%"):
            raise FileNotFoundError(f"{name} doesn't exist.")
        if writer.CanReadImageFile(name) or name.lower().endswith(_NO_OTHER_READER):
            if spacing is not None:
                writer.SetImageSpacing(_three("spacing", spacing))
            if origin is not None:
                writer.SetImageOrigin(_three("origin", origin))
            writer.SetImageFileName(name)
            writer.SetImageSeries(dataset)
            data = None
        else:
            data = _image_reader(name) or open(name, dataset=dataset)
            files = [name]
            if isinstance(data, vtkImagePiecesReader):
                files += [data.GetPieceFileName(i) for i in range(data.GetNumberOfPieces())]
            about = [os.stat(file) for file in files]
            writer.SetSourceName(f"{name} {dataset} {[(a.st_size, a.st_mtime_ns) for a in about]}")
    if data is not None:
        if isinstance(data, vtkBrickSourceAlgorithm) or not isinstance(data, vtkAlgorithm):
            data = source(data, spacing=spacing, origin=origin, labels=labels)
            labels = labels or info(data)["labels"]
            data.SetLevel(0)
        elif spacing is not None or origin is not None:
            raise ValueError("spacing and origin are for arrays and files of slices or raw voxels; "
                             "this volume has its own.")
        writer.SetInputConnection(data.GetOutputPort())
        sources.append(data)
    writer.SetFileName(os.fspath(path))
    writer.SetCompression(compressions[compression])
    writer.SetCompressionLevel(compression_level)
    writer.SetBrickSize(brick_size)
    writer.SetMemoryLimit(_bytes(memory))
    writer.SetResume(resume)
    writer.SetDownsampling(writer.MODE if labels else writer.AVERAGE)
    with _Progress(progress) as show, _interrupt.noted() as interrupt:
        # One call into C++: what an observer raises would only be printed.
        raised = []

        def on_progress(_, __):
            try:
                show(writer.GetBytesDone(), writer.GetBytesTotal())
            except BaseException as error:  # pylint: disable=broad-except
                raised.append(error)
            if interrupt.pressed or raised:
                for algorithm in sources:
                    algorithm.SetAbortExecute(1)
                _levels.cancel(data)

        tags = [(o, o.AddObserver("ProgressEvent", on_progress)) for o in sources]
        try:
            with _vtk.errors_raised(*sources[::-1]) as messages:
                written = writer.Write()
                if raised or interrupt.pressed:
                    messages.clear()
        finally:
            for o, tag in tags:
                o.RemoveObserver(tag)
            for algorithm in sources[1:]:
                algorithm.SetAbortExecute(0)
            _levels.cancel(data, False)
        if raised:
            raise raised[0]
        if not written and not interrupt.pressed:
            raise RuntimeError(f"{path} can't be written.")
    return {
        "levels": writer.GetNumberOfLevels(),
        "bytes": writer.GetBytesTotal(),
        "file_bytes": writer.GetFileBytes(),
    }


class _Progress:
    """Shows (done, total): by the user's function, by tqdm, or not at all."""

    def __init__(self, progress):
        self.function = progress if callable(progress) else None
        self.bar = None
        if progress is None or progress is True:
            try:
                from tqdm import tqdm
            except ImportError:
                return
            self.bar = tqdm(unit="B", unit_scale=True, unit_divisor=1024)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.bar is not None:
            self.bar.close()

    def __call__(self, done, total):
        if total <= 0:
            return
        if self.function:
            self.function(done, total)
        elif self.bar is not None:
            self.bar.total = total
            self.bar.update(done - self.bar.n)


def sample(volume_source):
    """Voxels that tell what the values are like: the coarsest level that nobody has to make, if it
    is small, else boxes spread over it. A flat numpy array; empty if some of it can't be read."""
    bricks = _bricks(volume_source)
    level = bricks.GetNumberOfLevels() - 1
    if volume_source.IsA("vtkCallbackVolumeSource"):
        level = volume_source.GetNumberOfGivenLevels() - 1
    dimensions = [0, 0, 0]
    bricks.GetLevelDimensions(level, dimensions)
    try:
        if np.prod(dimensions, dtype=float) <= _SAMPLE:
            return read(bricks, level).ravel()
        edge, steps = 16, 5
        starts = [
            sorted({(n - min(n, edge)) * i // (steps - 1) for i in range(steps)})
            for n in dimensions[::-1]
        ]
        boxes = [
            tuple(slice(f, f + edge) for f in first) for first in itertools.product(*starts)
        ]
        return np.concatenate([read(bricks, level, box).ravel() for box in boxes])
    except RuntimeError:
        return np.empty(0)
