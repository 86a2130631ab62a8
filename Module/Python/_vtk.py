# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Imports VTK before the wrapped classes, and turns VTK's errors into exceptions."""
import contextlib

# The wrapped superclasses must be known before the classes below are loaded, and VTK's factories
# must be registered before the first render window is made.
import vtkmodules.vtkCommonCore
import vtkmodules.vtkCommonDataModel
import vtkmodules.vtkCommonExecutionModel
import vtkmodules.vtkRenderingCore
import vtkmodules.vtkRenderingVolume
import vtkmodules.vtkRenderingOpenGL2
import vtkmodules.vtkRenderingVolumeOpenGL2
import vtkmodules.vtkInteractionStyle

from . import vtkRenderingOutOfCore


def sentence(text):
    """The message of VTK's error text, without file, line and address."""
    text = text.strip()
    if text.startswith(("ERROR:", "Warning:")):
        text = text.split("\n", 1)[-1]
    head, separator, tail = text.partition("): ")
    if separator and "(0x" in head:
        text = tail
    return " ".join(text.split())


@contextlib.contextmanager
def errors_raised(*objects):
    """Raises the first error that one of the VTK objects reports in the block as a RuntimeError.

    Their errors aren't printed meanwhile. Yields the list of messages.
    """
    messages = []

    def observer(_, __, text):
        messages.append(sentence(text))

    observer.CallDataType = "string0"
    tags = [(o, o.AddObserver("ErrorEvent", observer)) for o in objects]
    try:
        yield messages
    finally:
        for o, tag in tags:
            o.RemoveObserver(tag)
    if messages:
        raise RuntimeError(messages[0])
