# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Opacity and colour of a volume from short arguments."""
import numbers

import numpy as np
from vtkmodules.util.numpy_support import get_vtk_to_numpy_typemap, numpy_to_vtk
from vtkmodules.vtkCommonColor import vtkNamedColors
from vtkmodules.vtkCommonDataModel import vtkPiecewiseFunction
from vtkmodules.vtkRenderingCore import vtkColorTransferFunction

from .vtkRenderingOutOfCore import vtkOutOfCoreTransferFunction

_BINS = 256

# Evenly spread points of a few maps, for where matplotlib isn't installed. viridis: S. van der
# Walt and N. Smith 2015; coolwarm: K. Moreland, Diverging Color Maps for Scientific
# Visualization, 2009.
_MAPS = {
    "gray": [(0, 0, 0), (1, 1, 1)],
    "bone": [(0, 0, 0), (0.33, 0.33, 0.45), (0.65, 0.78, 0.78), (1, 1, 1)],
    "hot": [(0.04, 0, 0), (1, 0, 0), (1, 1, 0), (1, 1, 1)],
    "viridis": [
        (0.267, 0.005, 0.329), (0.283, 0.141, 0.458), (0.254, 0.265, 0.530),
        (0.207, 0.372, 0.553), (0.164, 0.471, 0.558), (0.128, 0.567, 0.551),
        (0.135, 0.659, 0.518), (0.267, 0.749, 0.441), (0.478, 0.821, 0.318),
        (0.741, 0.873, 0.150), (0.993, 0.906, 0.144),
    ],
    "coolwarm": [(0.230, 0.299, 0.754), (0.865, 0.865, 0.865), (0.706, 0.016, 0.150)],
}


def numpy_type(vtk_type):
    """The numpy dtype of VTK's number of a scalar type."""
    return np.dtype(get_vtk_to_numpy_typemap()[vtk_type])


def _rgb(color):
    """(r, g, b) in 0...1 of a name, "#rrggbb", or three numbers."""
    if isinstance(color, str):
        names = vtkNamedColors()
        if color.startswith("#"):
            digits = color[1:]
            if len(digits) != 6:
                raise ValueError(f"{color!r} isn't #rrggbb.")
            return tuple(int(digits[i : i + 2], 16) / 255 for i in (0, 2, 4))
        if not names.ColorExists(color):
            raise ValueError(f"There is no colour named {color!r}.")
        return tuple(names.GetColor3d(color))
    rgb = tuple(float(c) for c in color)[:3]
    if len(rgb) != 3 or not all(0 <= c <= 1 for c in rgb):
        raise ValueError(f"{color!r} isn't a colour: a name, '#rrggbb', or three numbers in 0...1.")
    return rgb


def _map_colors(name):
    if name in _MAPS:
        return _MAPS[name]
    try:
        import matplotlib
    except ImportError:
        raise ValueError(
            f"There is no colour map {name!r}; without matplotlib there are {', '.join(_MAPS)}."
        ) from None
    try:
        cmap = matplotlib.colormaps[name]
    except KeyError:
        raise ValueError(f"There is no colour map {name!r}.") from None
    return [tuple(cmap(i / 63))[:3] for i in range(64)]



def _pairs(values, clim, is_plain):
    """[(value, thing)] of a list of things spread over clim, or of such pairs."""
    values = list(values)
    if not values:
        raise ValueError("An empty list has neither opacities nor colours.")
    if not is_plain(values[0]):
        return [(float(v), thing) for v, thing in values]
    steps = max(len(values) - 1, 1)
    low, high = clim
    return [(low + (high - low) * i / steps, thing) for i, thing in enumerate(values)]


def _opacity(opacity, clim):
    if isinstance(opacity, vtkPiecewiseFunction):
        return opacity
    if isinstance(opacity, numbers.Real):
        opacity = [(clim[0], opacity)]
    function = vtkPiecewiseFunction()
    for value, alpha in _pairs(opacity, clim, lambda v: isinstance(v, numbers.Real)):
        if not 0 <= alpha <= 1:
            raise ValueError(f"The opacity {alpha} isn't in 0...1.")
        function.AddPoint(value, float(alpha))
    return function


def _is_color(thing):
    return isinstance(thing, str) or (
        len(thing) in (3, 4) and all(isinstance(c, numbers.Real) for c in thing)
    )


def _colors(cmap, colors, clim):
    if isinstance(colors, vtkColorTransferFunction):
        return colors
    function = vtkColorTransferFunction()
    for value, color in _pairs(_map_colors(cmap) if colors is None else colors, clim, _is_color):
        function.AddRGBPoint(value, *_rgb(color))
    return function


def _sample(source, known):
    """Finite values of some voxels, and the range: the known one, else theirs, None without any."""
    from . import _pipeline

    values = _pipeline.sample(source)
    if values.dtype.kind == "f":
        values = values[np.isfinite(values)]
    if known is None and values.size:
        known = (float(values.min()), float(values.max()))
    return values, known


def apply(source, volume_property, *, opacity, cmap, colors, clim, shade):
    """Fills a vtkVolumeProperty: from the histogram, then by what is given."""
    from . import _pipeline

    if cmap is not None and colors is not None:
        raise ValueError("cmap and colors say the same thing: give one of them.")
    bricks = source.GetBrickSource()
    about = _pipeline.info(bricks)
    known = about["range"]
    all_given = opacity is not None and (cmap is not None or colors is not None)
    if all_given and (clim or known):
        # What is given is used below: no voxel is read for it.
        low, high = clim or known
        vtkOutOfCoreTransferFunction.MakeAutomatic(bricks, low, high, None, volume_property)
    elif source.IsA("vtkCallbackVolumeSource"):
        # Nobody has a histogram: a sample has.
        values, known = _sample(source, known)
        low, high = known or (0.0, 1.0)
        counts = np.histogram(values, bins=_BINS, range=known)[0] if low < high and values.size else []
        counts = numpy_to_vtk(np.asarray(counts, dtype=np.float64), deep=1)
        vtkOutOfCoreTransferFunction.MakeAutomatic(bricks, low, high, counts, volume_property)
    else:
        # What a file wishes comes first, channel by channel.
        vtkOutOfCoreTransferFunction.MakeAutomatic(bricks, volume_property)
        if known is None and clim is None and (opacity is not None or cmap or colors is not None):
            _, known = _sample(source, known)
    clim = tuple(float(v) for v in (clim or known or (0.0, 1.0)))
    if len(clim) != 2 or not clim[0] <= clim[1]:
        raise ValueError(f"clim is {clim}; it must be (low, high).")
    if opacity is not None:
        volume_property.SetScalarOpacity(_opacity(opacity, clim))
    if cmap is not None or colors is not None:
        volume_property.SetColor(_colors(cmap, colors, clim))
    if shade is not None:
        volume_property.SetShade(bool(shade))
    for i in range(1, about["components"]):
        # What is given is given for all; the rest each component has of its own.
        if opacity is not None:
            volume_property.SetScalarOpacity(i, volume_property.GetScalarOpacity(0))
        if cmap is not None or colors is not None:
            volume_property.SetColor(i, volume_property.GetRGBTransferFunction(0))
        if shade is not None:
            volume_property.SetShade(i, bool(shade))
