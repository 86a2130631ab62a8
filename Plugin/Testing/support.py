# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""What the tests of the plugin share; inside pvpython or pvbatch.

Environment: TERAVOX_PLUGIN, the plugin's path, or its name; TERAVOX_VOLUMES, the folder of make_volumes.py.
"""
import os
import sys
import tempfile
import unittest

import numpy as np
from paraview import simple as pv
import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401, so that mappers come as volume mappers
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOImage import vtkPNGReader
from vtkmodules.vtkRenderingCore import vtkCamera, vtkRenderer, vtkRenderWindow, vtkVolume

pv._DisableFirstRenderCameraReset()
if os.path.isabs(os.environ["TERAVOX_PLUGIN"]):
    pv.LoadPlugin(os.environ["TERAVOX_PLUGIN"], remote=False, ns=vars(pv))
else:  # one that ParaView knows
    pv.LoadDistributedPlugin(os.environ["TERAVOX_PLUGIN"], remote=False, ns=vars(pv))

VOLUMES = os.environ["TERAVOX_VOLUMES"]
SIZE = (160, 120)
REPRESENTATION = "Volume (out of core)"


def path_of(name):
    return os.path.join(VOLUMES, name)


def new_view():
    view = pv.CreateView("RenderView")
    view.ViewSize = SIZE
    view.UseColorPaletteForBackground = 0
    view.Background = [0, 0, 0]
    view.OrientationAxesVisibility = 0
    view.UseFXAA = 0
    return view


def transfer(array, points):
    """Functions of an array: rows of value, red, green, blue, opacity."""
    colors = pv.GetColorTransferFunction(array)
    colors.RGBPoints = [c for p in points for c in p[:4]]
    colors.ColorSpace = "RGB"
    opacity = pv.GetOpacityTransferFunction(array)
    opacity.Points = [c for p in points for c in (p[0], p[4], 0.5, 0.0)]
    return colors


def show(source, view, points, unit=None, name=None, association="POINTS"):
    """The source in the view, with functions of an array, by default its first one."""
    display = pv.Show(source, view)
    name = name or array_name(source, association)
    display.ColorArrayName = [association, name]
    display.LookupTable = transfer(name, points)
    display.ScalarOpacityFunction = pv.GetOpacityTransferFunction(name)
    if unit is not None:
        display.ScalarOpacityUnitDistance = unit
    display.SetRepresentationType(REPRESENTATION)
    return display


def array_name(source, association="POINTS"):
    source.UpdatePipeline()
    data = source.PointData if association == "POINTS" else source.CellData
    return data.GetArray(0).GetName()


def look(view, azimuth=35, elevation=25, zoom=1.2):
    view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = [0, 0, 1], [0, 0, 0], [0, 1, 0]
    view.CameraViewAngle = 30
    view.ResetCamera()
    camera = view.GetActiveCamera()
    camera.Azimuth(azimuth)
    camera.Elevation(elevation)
    camera.Zoom(zoom)
    view.CameraPosition = camera.GetPosition()
    view.CameraFocalPoint = camera.GetFocalPoint()
    view.CameraViewUp = camera.GetViewUp()
    view.CameraViewAngle = camera.GetViewAngle()


def pixels_of(path):
    reader = vtkPNGReader()
    reader.SetFileName(path)
    reader.Update()
    image = reader.GetOutput()
    width, height, _ = image.GetDimensions()
    scalars = vtk_to_numpy(image.GetPointData().GetScalars())
    return scalars.reshape(height, width, -1)[:, :, :3].astype(int)


def screenshot(view, keep=None):
    """The pixels of SaveScreenshot: height x width x 3, 0...255."""
    with tempfile.TemporaryDirectory() as folder:
        path = keep or os.path.join(folder, "picture.png")
        pv.SaveScreenshot(path, view, ImageResolution=SIZE)
        return pixels_of(path)


def server_object(display):
    """The VTK object of the representation."""
    return display.SMProxy.GetClientSideObject().GetActiveRepresentation()


def plain_window(display, view, image, array, cell_data=False):
    """The same volume in a window of VTK's: a mapper of its own, without any part of ParaView."""
    actor = server_object(display).GetActor()
    mapper = actor.GetMapper().NewInstance()
    mapper.SetInputData(image)
    if cell_data:
        mapper.SetScalarModeToUseCellFieldData()
    else:
        mapper.SetScalarModeToUsePointFieldData()
    mapper.SelectScalarArray(array)
    prop = vtkVolume()
    prop.SetMapper(mapper)
    prop.SetProperty(actor.GetProperty())
    renderer = vtkRenderer()
    renderer.AddVolume(prop)
    theirs = view.GetRenderer()
    renderer.SetBackground(theirs.GetBackground())
    renderer.AutomaticLightCreationOff()
    lights = theirs.GetLights()
    for i in range(lights.GetNumberOfItems()):
        renderer.AddLight(lights.GetItemAsObject(i))
    renderer.SetTwoSidedLighting(theirs.GetTwoSidedLighting())
    camera = vtkCamera()
    camera.DeepCopy(theirs.GetActiveCamera())
    renderer.SetActiveCamera(camera)
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(*SIZE)
    window.AddRenderer(renderer)
    return window, mapper


def plain_picture(window):
    from vtkmodules.vtkRenderingCore import vtkWindowToImageFilter

    window.Render()
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.Update()
    image = grab.GetOutput()
    width, height, _ = image.GetDimensions()
    scalars = vtk_to_numpy(image.GetPointData().GetScalars())
    return scalars.reshape(height, width, -1)[:, :, :3].astype(int)


def facts(proxy, name):
    """The values of an information property."""
    proxy.SMProxy.UpdatePropertyInformation()
    values = proxy.SMProxy.GetProperty(name)
    return [values.GetElement(i) for i in range(values.GetNumberOfElements())]


def fact(proxy, name):
    return facts(proxy, name)[0]


def tell(view):
    """Has processes tell each other what they did up to now: that comes with the next update of the view."""
    view.SMProxy.MarkDirty(view.SMProxy)
    pv.Render(view)


def memory():
    """Bytes of this process in main memory."""
    with open("/proc/self/statm") as f:
        return int(f.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


class Case(unittest.TestCase):
    def setUp(self):
        pv.ResetSession()
        pv._DisableFirstRenderCameraReset()
        self.view = new_view()

    def assertSamePicture(self, a, b, tolerance=1):
        self.assertEqual(a.shape, b.shape)
        worst = np.abs(a - b).max()
        self.assertLessEqual(worst, tolerance, "%d pixels differ" % (np.abs(a - b) > tolerance).any(2).sum())

    def assertShowsSomething(self, picture, share=0.1):
        self.assertGreater((picture.max(axis=2) > 8).mean(), share)


def main():
    result = unittest.main(argv=sys.argv, verbosity=2, exit=False).result
    sys.stdout.flush()
    sys.stderr.flush()
    # Not sys.exit(): pvpython 5.11 crashes then, also without the plugin.
    if not result.wasSuccessful() or result.testsRun == 0:
        os._exit(1)
