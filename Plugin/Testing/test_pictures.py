# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of the representation: equal to the mapper's in plain VTK, complete, inside budgets."""
import os
import tempfile

import numpy as np
from paraview.modules.vtkRemotingViews import vtkSMTransferFunctionProxy
from vtkmodules.numpy_interface import dataset_adapter as dsa
from vtkmodules.util.numpy_support import vtk_to_numpy

from support import (Case, SIZE, array_name, fact, look, main, memory, pixels_of, plain_picture, plain_window, pv,
                     screenshot, server_object, show, path_of)

SHELLS = [(4000, 0.1, 0.2, 0.8, 0), (12000, 0.2, 0.8, 0.3, 0.02), (21000, 1, 0.4, 0.1, 0.5)]
HUGE = [(0, 0.2, 0.4, 0.9, 0), (4000, 0.2, 0.4, 0.9, 0), (12000, 0.3, 0.9, 0.4, 0.7),
        (20000, 1, 0.5, 0.2, 0.9)]


class Pictures(Case):
    def shells(self):
        reader = pv.OpenDataFile(path_of("shells.h5"))
        display = show(reader, self.view, SHELLS, unit=2)
        look(self.view)
        return reader, display

    def plain(self, reader, display):
        image = reader.GetClientSideObject().GetOutputDataObject(0)
        return plain_window(display, self.view, image, array_name(reader))

    def test_equals_plain_vtk(self):
        reader, display = self.shells()
        for shade in (0, 1):
            display.Shade = shade
            picture = screenshot(self.view)
            self.assertShowsSomething(picture)
            window, mapper = self.plain(reader, display)
            self.assertSamePicture(picture, plain_picture(window))
        self.assertEqual(fact(display, "DrawsPyramid"), 1)
        # All levels are drawn, not the one that is presented.
        self.assertEqual(reader.GetDataInformation().GetExtent()[1], 87)
        display.MinimumLevel = 1
        self.assertGreater(np.abs(screenshot(self.view) - picture).max(), 4)

    def test_without_an_array_to_colour_by(self):
        """ParaView leaves Solid Color when this representation is chosen: the first array, as it suits it."""
        reader = pv.OpenDataFile(path_of("shells.h5"))
        display = pv.Show(reader, self.view)
        pv.ColorBy(display, None)
        display.SetRepresentationType("Volume (out of core)")
        look(self.view)
        self.assertShowsSomething(screenshot(self.view))
        self.assertEqual(fact(display, "Converged"), 1)
        self.assertEqual(fact(display, "DrawsPyramid"), 1)
        # An array that is chosen is drawn by its own functions, and the first one again without it.
        automatic = screenshot(self.view)
        show(reader, self.view, SHELLS, unit=2)
        self.assertGreater(np.abs(screenshot(self.view) - automatic).mean(), 2)
        pv.ColorBy(display, None)
        self.assertSamePicture(screenshot(self.view), automatic, 0)

    def test_shares_settings_of_volume(self):
        reader, display = self.shells()
        display.Shade = 1
        display.SetRepresentationType("Volume")
        stock = screenshot(self.view)
        display.SetRepresentationType("Volume (out of core)")
        ours = screenshot(self.view)
        # Of another level and with another step: about the same, where the other functions or no
        # shading would be far off.
        self.assertLess(np.abs(stock - ours).mean(), 6)
        display.Shade = 0
        self.assertGreater(np.abs(screenshot(self.view) - ours).mean(), 6)

    def test_histogram_and_legend(self):
        """What the colour map editor draws: a histogram of the level that is presented, and the legend."""
        reader, display = self.shells()
        colours = display.LookupTable
        colours.RescaleTransferFunction(4000, 21000)
        picture = screenshot(self.view)
        table = vtkSMTransferFunctionProxy.ComputeDataHistogramTable(colours.SMProxy, 34)
        centres, counts = (vtk_to_numpy(table.GetColumn(i)) for i in range(2))
        image = dsa.WrapDataObject(pv.servermanager.Fetch(reader))
        values = np.asarray(image.PointData[array_name(reader)]).ravel()
        expected, edges = np.histogram(np.clip(values, 4000, 21000), 34, (4000, 21000))
        np.testing.assert_allclose(centres, (edges[1:] + edges[:-1]) / 2)
        self.assertEqual(counts.sum(), values.size)
        # A value on an edge belongs to either side.
        self.assertLess(np.abs(counts - expected).max(), 0.01 * values.size)
        self.assertGreater((counts > 0).sum(), 30)
        display.SetScalarBarVisibility(self.view, True)
        self.assertGreater(np.abs(screenshot(self.view) - picture).max(), 50)

    def test_cropping(self):
        reader, display = self.shells()
        whole = screenshot(self.view)
        display.UseCropping = 1
        self.assertSamePicture(screenshot(self.view), whole, 0)
        bounds = reader.GetDataInformation().GetBounds()
        display.CroppingScale = [0.5, 1, 1]
        display.CroppingOrigin = [0.5 * bounds[0], 0, 0]
        half = screenshot(self.view)
        window, mapper = self.plain(reader, display)
        mapper.CroppingOn()
        mapper.SetCroppingRegionFlags(0x2000)
        theirs = server_object(display).GetActor().GetMapper().GetCroppingRegionPlanes()
        self.assertAlmostEqual(theirs[1], 0.5 * (bounds[0] + bounds[1]))
        mapper.SetCroppingRegionPlanes(theirs)
        self.assertSamePicture(half, plain_picture(window))
        self.assertGreater(np.abs(half - whole).max(), 50)

    def test_maximum_level_and_debug_view(self):
        reader, display = self.shells()
        plain = screenshot(self.view)
        display.DebugView = "Levels"
        display.MaximumLevel = 0
        shades = set(np.unique(screenshot(self.view)))
        self.assertLessEqual(max(shades), 8)  # level 0: 1/32 of 255, premultiplied
        display.MinimumLevel = display.MaximumLevel = 2
        self.assertGreater(max(np.unique(screenshot(self.view))), 20)
        # Frames are over the picture, in the colours of the levels.
        display.MinimumLevel, display.MaximumLevel = 0, 31
        display.DebugView = "Brick Frames"
        framed = screenshot(self.view)
        frames = (framed != plain).any(axis=2)
        self.assertTrue(0.01 < frames.mean() < 0.5, frames.mean())
        colors = {tuple(c) for c in framed[frames]}
        self.assertLessEqual(colors, {(255, 255, 255), (255, 255, 0), (0, 255, 255)})
        # Samples: gray, at most 16 octaves of them, where the ray meets the volume.
        display.DebugView = "Samples per Pixel"
        samples = screenshot(self.view)
        self.assertTrue((samples.min(axis=2) == samples.max(axis=2)).all())
        self.assertShowsSomething(samples)
        self.assertGreater(len(np.unique(samples)), 10)
        self.assertTrue((samples.max(axis=2) == 0).any())
        display.DebugView = "None"
        self.assertSamePicture(screenshot(self.view), plain, 0)

    def test_screenshot_is_complete(self):
        reader, display = self.shells()
        truth = screenshot(self.view)
        self.assertEqual(fact(display, "Converged"), 1)
        # A new volume: interactive frames show what is at hand, screenshots everything.
        pv.Delete(reader)
        reader, display = self.shells()
        display.InteractiveFrameTime = 0.01
        self.view.SMProxy.InteractiveRender()
        self.assertEqual(fact(display, "Converged"), 0)
        self.assertGreater(fact(display, "MissingBricks"), 0)
        self.assertSamePicture(screenshot(self.view), truth, 0)
        self.assertEqual(fact(display, "Converged"), 1)
        self.assertEqual(fact(display, "MissingBricks"), 0)
        # So do they where ParaView would take them from interactive renders.
        pv.Delete(reader)
        reader, display = self.shells()
        display.InteractiveFrameTime = 0.01
        self.view.UseInteractiveRenderingForScreenshots = 1
        self.assertSamePicture(screenshot(self.view), truth, 0)

    def test_time_out(self):
        reader, display = self.shells()
        truth = screenshot(self.view)
        pv.Delete(reader)
        reader, display = self.shells()
        display.Timeout = 1e-5  # no brick comes as fast
        said = self.said_by(lambda: pv.Render(self.view))
        self.assertIn("The picture isn't complete: for 1e-05 s no brick has come.", said)
        self.assertEqual(fact(display, "Converged"), 0)
        display.Timeout = 60
        pictures = []
        said = self.said_by(lambda: pictures.append(screenshot(self.view)))
        self.assertNotIn("complete", said)
        self.assertEqual(fact(display, "Converged"), 1)
        self.assertSamePicture(pictures[0], truth, 0)

    def said_by(self, action):
        """What goes to VTK's output window meanwhile."""
        from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow

        before, window = vtkOutputWindow.GetInstance(), vtkStringOutputWindow()
        vtkOutputWindow.SetInstance(window)
        try:
            action()
        finally:
            vtkOutputWindow.SetInstance(before)
        return window.GetOutput()

    def test_saved_animation_is_complete(self):
        reader, display = self.shells()
        scene = pv.GetAnimationScene()
        scene.UpdateAnimationUsingDataTimeSteps()
        truth = []
        for time in (0, 1):
            scene.AnimationTime = time
            truth.append(screenshot(self.view))
        self.assertGreater(np.abs(truth[0] - truth[1]).max(), 30)
        # Nothing of a new reader is at hand. Also where windows stream, and frames are interactive.
        from paraview.modules.vtkRemotingViews import vtkPVView

        for streaming in (False, True):
            pv.Delete(reader)
            reader, display = self.shells()
            display.InteractiveFrameTime = 0.01
            scene.AnimationTime = 0
            self.view.UseInteractiveRenderingForScreenshots = int(streaming)
            vtkPVView.SetEnableStreaming(streaming)
            try:
                with tempfile.TemporaryDirectory() as folder:
                    pv.SaveAnimation(os.path.join(folder, "frame.png"), self.view, ImageResolution=SIZE,
                                     FrameWindow=[0, 1], SuffixFormat=".%d")
                    frames = [pixels_of(os.path.join(folder, "frame.%d.png" % n)) for n in (0, 1)]
            finally:
                vtkPVView.SetEnableStreaming(False)
            self.assertEqual(fact(display, "Converged"), 1)
            for frame, picture in zip(frames, truth):
                self.assertSamePicture(frame, picture, 0)

    def test_streaming(self):
        from paraview.modules.vtkRemotingViews import vtkPVView

        reader, display = self.shells()
        truth = screenshot(self.view)
        pv.Delete(reader)
        vtkPVView.SetEnableStreaming(True)
        try:
            reader, display = self.shells()
            display.InteractiveFrameTime = 0.01
            pv.Render(self.view)
            self.assertEqual(fact(display, "Converged"), 0)  # at once, not complete
            passes = 0
            while self.view.SMProxy.StreamingUpdate(True):
                passes += 1
                self.assertLess(passes, 50)
            self.assertEqual(fact(display, "Converged"), 1)
            self.assertGreater(passes, 1)
            self.assertSamePicture(screenshot(self.view), truth, 0)
            # A screenshot waits, whatever streams.
            self.view.GetActiveCamera().Azimuth(90)
            turned = screenshot(self.view)
            self.assertEqual(fact(display, "Converged"), 1)
            self.assertGreater(np.abs(turned - truth).max(), 30)
        finally:
            vtkPVView.SetEnableStreaming(False)

    def test_time_steps(self):
        reader, display = self.shells()
        scene = pv.GetAnimationScene()
        scene.UpdateAnimationUsingDataTimeSteps()
        pictures = []
        for time in (0, 1, 0):
            scene.AnimationTime = time
            pictures.append(screenshot(self.view))
            window, _ = self.plain(reader, display)
            self.assertSamePicture(pictures[-1], plain_picture(window))
        self.assertGreater(np.abs(pictures[0] - pictures[1]).max(), 30)
        self.assertSamePicture(pictures[0], pictures[2], 0)

    def test_cached_animation(self):
        reader, display = self.shells()
        scene = pv.GetAnimationScene()
        scene.UpdateAnimationUsingDataTimeSteps()
        pictures = {}
        self.view.SMProxy.GetProperty("UseCache").SetElement(0, 1)
        for round in range(2):
            for time in (0, 1):
                self.view.SMProxy.GetProperty("CacheKey").SetElement(0, time)
                self.view.SMProxy.UpdateVTKObjects()
                scene.AnimationTime = time
                picture = screenshot(self.view)
                self.assertSamePicture(picture, pictures.setdefault(time, picture), 0)
        self.assertGreater(np.abs(pictures[0] - pictures[1]).max(), 30)

    def test_huge(self):
        reader = pv.OpenDataFile(path_of("huge.h5"))
        display = show(reader, self.view, HUGE, unit=100)
        display.GPUMemoryMiB = 48
        display.HostMemoryMiB = 48
        look(self.view, zoom=1.5)
        before = memory()
        picture = screenshot(self.view)
        self.assertShowsSomething(picture, 0.01)
        self.assertEqual(fact(display, "Converged"), 1)
        self.assertEqual(fact(display, "DrawsPyramid"), 1)
        # The picture is of a few bricks, and the pipeline had one small level.
        self.assertLessEqual(fact(display, "InputVoxels"), 2 * 2**20)
        self.assertLess(fact(display, "ReadMiB"), 1024)
        self.assertLessEqual(fact(display, "GPUMemoryUsedMiB"), 48)
        self.assertLessEqual(fact(display, "HostMemoryUsedMiB"), 48)
        print("1 TiB: %.1f MiB of bricks read, %.1f MiB of memory more, %d voxels from the pipeline"
              % (fact(display, "ReadMiB"), (memory() - before) / 2**20,
                 fact(display, "InputVoxels")), flush=True)
        display.GPUMemoryMiB = display.HostMemoryMiB = 0
        self.assertSamePicture(screenshot(self.view), picture, 0)

    def test_larger_than_budgets(self):
        source = pv.ProceduralVolume(Function="Marschner-Lobb", Dimensions=[768, 768, 768])
        points = [(0, 0.1, 0.2, 0.9, 0), (100, 0.2, 0.7, 0.9, 0.0), (170, 1, 0.8, 0.3, 0.01),
                  (255, 1, 0.3, 0.1, 0.05)]
        display = show(source, self.view, points, unit=4)
        display.MaximumLevel = 1  # 54 MiB at least
        display.GPUMemoryMiB = 24
        display.HostMemoryMiB = 24
        look(self.view, zoom=1)
        picture = screenshot(self.view)
        self.assertShowsSomething(picture)
        self.assertEqual(fact(display, "Converged"), 1)
        self.assertLessEqual(fact(display, "GPUMemoryUsedMiB"), 24)
        self.assertGreater(fact(display, "BricksLoaded"), 120)  # of a quarter of a MiB and more
        display.GPUMemoryMiB = display.HostMemoryMiB = 1024
        self.assertSamePicture(screenshot(self.view), picture, 0)

    def test_repeated_volume(self):
        reader = pv.OpenDataFile(path_of("shells.h5"))
        repeat = pv.RepeatVolume(Input=reader, Repetitions=[6000, 5000, 4000])  # 900 TiB
        display = show(repeat, self.view, SHELLS, unit=2e4)
        look(self.view)
        self.assertShowsSomething(screenshot(self.view))
        self.assertEqual(fact(display, "DrawsPyramid"), 1)
        self.assertEqual(fact(display, "Converged"), 1)


if __name__ == "__main__":
    main()
