# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Files, looks, pictures, conversion, type stubs."""
import ast
import inspect
import os
import tempfile
import unittest

import h5py
import numpy as np
import vtk
from vtkmodules.util.numpy_support import vtk_to_numpy

import teravox
from support import Scene, noise, run_script, shells


class Folder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)


class Files(Folder):
    def test_a_pyramid_is_opened_and_told(self):
        array = noise((70, 80, 90), "i2")
        result = teravox.convert(
            array, self.path("a.h5"), spacing=(1, 2, 3), origin=(4, 5, 6), progress=False
        )
        self.assertEqual(result["bytes"], array.nbytes)
        self.assertEqual(result["file_bytes"], os.path.getsize(self.path("a.h5")))
        reader = teravox.open(self.path("a.h5"))
        self.assertIsInstance(reader, teravox.vtkHDF5PyramidReader)
        about = teravox.info(reader)
        self.assertEqual(about["shape"], (70, 80, 90))
        # Small voxel edges are halved first.
        levels = [(70, 80, 90), (70, 80, 45), (70, 40, 23), (35, 20, 12)]
        self.assertEqual((about["levels"], result["levels"]), (levels, 4))
        self.assertEqual(about["dtype"], np.int16)
        self.assertEqual((about["spacing"], about["origin"]), ((1, 2, 3), (4, 5, 6)))
        self.assertEqual(about["range"], (array.min(), array.max()))
        np.testing.assert_array_equal(teravox.read(reader), array)

    def test_h5py_reads_what_is_written_with_deflate(self):
        array = noise((70, 40, 90), "f4")
        teravox.convert(array, self.path("a.h5"), compression="deflate", progress=False)
        with h5py.File(self.path("a.h5")) as file:
            np.testing.assert_array_equal(file["VTKHDF/PointData/scalars"][()], array)
            pairs = teravox.read(teravox.source(array), 1)
            np.testing.assert_array_equal(file["Pyramid/1"][()], pairs)

    def test_time_points_of_a_file_are_steps_that_are_read_ahead(self):
        steps = np.stack([np.roll(shells(48), 4 * t, 2) for t in range(3)])
        with h5py.File(self.path("t.h5"), "w") as file:
            file.create_dataset("density", data=steps, chunks=(1, 16, 16, 16), compression="gzip")
        reader = teravox.open(self.path("t.h5"), brick_size=16)
        reader.SetLevel(0)
        look = {"clim": (0, 255), "opacity": [0, 0.03, 0.2], "cmap": "viridis"}
        scene = Scene(teravox.volume(reader, **look))
        series = reader.GetNumberOfTimeSteps()
        self.assertEqual((series, reader.GetNumberOfTimePoints()), (3, 3))
        for t in (0, 1, 2, 1):
            reader.UpdateTimeStep(t)
            drawn = scene.accumulator()
            self.assertEqual(reader.GetPresentedTimeStep(), t)
            one = teravox.open(self.path("t.h5"), time=t, brick_size=16)
            np.testing.assert_array_equal(drawn, Scene(teravox.volume(one, **look)).accumulator())
            self.assertTrue(scene.mapper.WaitForReadAhead(60))
            if t == 0:
                ahead = scene.mapper.GetNumberOfBricksReadAhead()
                self.assertGreater(ahead, 10)
        # Another file begins with its first step, one of a chosen time has no steps.
        reader.SetTimePoint(2)
        self.assertEqual(reader.GetNumberOfTimeSteps(), 1)
        reader.UpdateInformation()
        steps_key = vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS()
        self.assertFalse(reader.GetOutputInformation(0).Has(steps_key))
        reader.SetTimePoint(-1)
        reader.UpdateInformation()
        self.assertEqual(reader.GetOutputInformation(0).Length(steps_key), 3)

    def test_channels_of_a_file_have_looks_of_their_own(self):
        array = np.stack([shells(40), shells(40) * 20.0 + 1000], -1).astype("f4")
        with h5py.File(self.path("c.h5"), "w") as file:
            file["recon"] = array
        look = teravox.volume(self.path("c.h5"), dataset="/recon").GetProperty()
        for c in range(2):
            # The visible range lies inside the channel's own.
            low, high = look.GetScalarOpacity(c).GetRange()
            self.assertTrue(array[..., c].min() <= low < high <= array[..., c].max() * 1.01, (c, low, high))
        self.assertNotEqual(look.GetRGBTransferFunction(0).GetColor(200), look.GetRGBTransferFunction(1).GetColor(5000))

    def test_what_cannot_be_opened_is_an_exception(self):
        with self.assertRaises(FileNotFoundError):
            teravox.open(self.path("none.h5"))
        with open(self.path("text.h5"), "w", encoding="ascii") as file:
            file.write("not HDF5")
        with self.assertRaisesRegex(RuntimeError, "text.h5"):
            teravox.open(self.path("text.h5"))
        with h5py.File(self.path("a.h5"), "w") as file:
            file["a"] = np.zeros((4, 4, 4), "c8")
        for dataset in ("/a", "/none"):
            with self.assertRaisesRegex(RuntimeError, dataset):
                teravox.open(self.path("a.h5"), dataset=dataset)
        with self.assertRaisesRegex(ValueError, "spacing"):
            teravox.source(self.path("a.h5"), spacing=(1, 1, 1))

    def test_images_are_converted(self):
        image = vtk.vtkImageData()
        image.SetDimensions(20, 30, 40)
        image.AllocateScalars(vtk.VTK_UNSIGNED_SHORT, 1)
        voxels = vtk_to_numpy(image.GetPointData().GetScalars())
        voxels[:] = np.arange(voxels.size) % 65521
        for name, writer in (("a.mha", vtk.vtkMetaImageWriter()), ("a.vti", vtk.vtkXMLImageDataWriter()),
                             ("a.pvti", vtk.vtkXMLPImageDataWriter())):
            if name == "a.pvti":
                writer.SetNumberOfPieces(3)
                writer.SetEndPiece(2)
            writer.SetInputData(image)
            writer.SetFileName(self.path(name))
            writer.Write()
            teravox.convert(self.path(name), self.path("b.h5"), progress=False)
            back = teravox.read(teravox.open(self.path("b.h5")))
            np.testing.assert_array_equal(back.ravel(), voxels)
        os.remove(self.path("a_1.vti"))
        with self.assertRaisesRegex(RuntimeError, "piece 'a_1.vti', but there is no such file"):
            teravox.convert(self.path("a.pvti"), self.path("c.h5"), progress=False)
        header = np.zeros(256, "<i4")
        header[:4] = 2, 2, 2, 4
        with open(self.path("c.mrc"), "wb") as file:
            file.write(header.tobytes())
        with self.assertRaisesRegex(RuntimeError, "mode 4, complex"):
            teravox.convert(self.path("c.mrc"), self.path("c.h5"), progress=False)
        with open(self.path("c.mha"), "w", encoding="ascii") as file:
            file.write("no")
        with self.assertRaisesRegex(RuntimeError, "c.mha"):
            teravox.convert(self.path("c.mha"), self.path("c.h5"), progress=False)

    def test_images_go_on_where_they_were_stopped(self):
        image = vtk.vtkImageData()
        image.SetDimensions(160, 150, 140)
        image.AllocateScalars(vtk.VTK_UNSIGNED_SHORT, 1)
        voxels = vtk_to_numpy(image.GetPointData().GetScalars())
        voxels[:] = np.arange(voxels.size) % 65521
        writer = vtk.vtkMetaImageWriter()
        writer.SetInputData(image)
        writer.SetFileName(self.path("a.mha"))
        writer.Write()
        options = {"memory": "24M", "brick_size": 32}
        teravox.convert(self.path("a.mha"), self.path("whole.h5"), progress=False, **options)

        class Enough(Exception):
            pass

        def stop(done, total):
            if done > total / 3:
                raise Enough

        for wanted in (False, True):
            with self.assertRaises(Enough):
                teravox.convert(
                    self.path("a.mha"), self.path("b.h5"), progress=stop, resume=wanted, **options
                )
            left = [n for n in os.listdir(self.folder) if n.startswith("b.h5")]
            self.assertEqual(len(left), 2 if wanted else 0, left)
        teravox.convert(
            self.path("a.mha"), self.path("b.h5"), resume=True, progress=False, **options
        )
        with open(self.path("whole.h5"), "rb") as whole, open(self.path("b.h5"), "rb") as resumed:
            self.assertTrue(whole.read() == resumed.read())
        back = teravox.read(teravox.open(self.path("b.h5")))
        np.testing.assert_array_equal(back.ravel(), voxels)

    def test_folders_and_patterns_of_slices_are_converted(self):
        slices = noise((5, 40, 30), "u2")
        os.mkdir(self.path("stack"))
        for z, plane in enumerate(slices):
            image = vtk.vtkImageData()
            image.SetDimensions(30, 40, 1)
            image.AllocateScalars(vtk.VTK_UNSIGNED_SHORT, 1)
            vtk_to_numpy(image.GetPointData().GetScalars())[:] = plane.ravel()
            writer = vtk.vtkTIFFWriter()
            writer.SetInputData(image)
            writer.SetFileName(self.path(f"stack/s{z}.tif"))
            writer.Write()
        for name in ("stack", "stack/s*.tif"):
            teravox.convert(self.path(name), self.path("s.h5"), progress=False)
            back = teravox.read(teravox.open(self.path("s.h5")))
            # TIFF's first row is the uppermost one, VTK's the lowest: written and read, they are the same.
            np.testing.assert_array_equal(back[:, ::-1], slices)
        place = {"spacing": (0.5, 0.25, 2), "origin": (1, 2, 3)}
        teravox.convert(self.path("stack"), self.path("placed.h5"), progress=False, **place)
        about = teravox.info(teravox.open(self.path("placed.h5")))
        self.assertEqual((about["spacing"], about["origin"]), ((0.5, 0.25, 2), (1, 2, 3)))
        with self.assertRaisesRegex(ValueError, "of its own|its own"):
            teravox.convert(self.path("placed.h5"), self.path("again.h5"), progress=False, **place)
        with self.assertRaises(FileNotFoundError):
            teravox.convert(self.path("none.nii"), self.path("s.h5"), progress=False)

    def test_slices_of_png_and_jpeg_are_what_vtk_reads(self):
        names = vtk.vtkStringArray()
        for kind, dtype, components in (
            ("PNG", "u1", 1), ("PNG", "u2", 2), ("PNG", "u2", 3), ("PNG", "u1", 4), ("JPEG", "u1", 1), ("JPEG", "u1", 3),
        ):
            folder = self.path(f"{kind}{dtype}{components}")
            os.mkdir(folder)
            names.Reset()
            for z, plane in enumerate(noise((3, 40, 30 * components), dtype)):
                image = vtk.vtkImageData()
                image.SetDimensions(30, 40, 1)
                image.AllocateScalars(vtk.VTK_UNSIGNED_CHAR if dtype == "u1" else vtk.VTK_UNSIGNED_SHORT, components)
                vtk_to_numpy(image.GetPointData().GetScalars()).reshape(-1)[:] = plane.ravel()
                writer = getattr(vtk, f"vtk{kind}Writer")()
                writer.SetInputData(image)
                names.InsertNextValue(f"{folder}/s{z}.{kind.lower()}")
                writer.SetFileName(names.GetValue(z))
                writer.Write()
            reader = getattr(vtk, f"vtk{kind}Reader")()
            reader.SetFileNames(names)
            reader.Update()
            wanted = vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars())
            for name in (folder, f"{folder}/s%d.{kind.lower()}"):
                teravox.convert(name, self.path("s.h5"), progress=False)
                back = teravox.read(teravox.open(self.path("s.h5")))
                self.assertEqual(back.dtype, wanted.dtype)
                np.testing.assert_array_equal(back.reshape(wanted.shape), wanted)

    def test_progress(self):
        array = noise((200, 200, 100), "u1")
        calls = []
        teravox.convert(
            array, self.path("a.h5"), memory="64M", progress=lambda *a: calls.append(a)
        )
        self.assertGreater(len(calls), 1)
        self.assertEqual(calls, sorted(calls))
        self.assertEqual(calls[-1], (array.nbytes, array.nbytes))

        class Enough(Exception):
            pass

        def stop(done, total):
            raise Enough

        with self.assertRaises(Enough):
            teravox.convert(array, self.path("b.h5"), progress=stop)
        self.assertEqual(os.listdir(self.folder), ["a.h5"])
        with self.assertRaisesRegex(ValueError, "compression"):
            teravox.convert(array, self.path("c.h5"), compression="zip")

    def test_a_bar_of_tqdm(self):
        done = run_script(
            f"""
            import numpy as np, teravox
            a = np.random.default_rng(1).integers(0, 255, (150, 200, 150), np.uint8)
            teravox.convert(a, {self.path("a.h5")!r})
            """
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("100%", done.stderr)
        self.assertIn("4.29M/4.29M", done.stderr)
        # Without tqdm there's no bar, and no error.
        done = run_script(
            f"""
            sys.modules["tqdm"] = None
            import numpy as np, teravox
            teravox.convert(np.zeros((20, 20, 20), np.uint8), {self.path("b.h5")!r})
            """
        )
        self.assertEqual((done.returncode, done.stderr), (0, ""))


class Looks(unittest.TestCase):
    def property_of(self, array, **arguments):
        return teravox.volume(array, **arguments).GetProperty()

    def test_the_default_leaves_the_background_out(self):
        array = np.full((40, 40, 40), 10, np.uint8)
        array[10:30, 10:30, 10:30] = 200
        opacity = self.property_of(array).GetScalarOpacity()
        self.assertEqual(opacity.GetValue(10), 0)
        self.assertGreater(opacity.GetValue(200), 0.1)
        # The same for what only looks like an array, of whose range nothing is known.
        lazy = type("Lazy", (), {"shape": array.shape, "dtype": array.dtype,
                                 "__getitem__": lambda self, box: array[box]})()
        other = self.property_of(lazy).GetScalarOpacity()
        for value in range(0, 256, 5):
            self.assertEqual(other.GetValue(value), opacity.GetValue(value))
        constant = self.property_of(np.full((9, 9, 9), 3.5))
        self.assertGreater(constant.GetScalarOpacity().GetValue(3.5), 0)
        self.property_of(np.full((9, 9, 9), np.nan))  # draws nothing, and is no error

    def test_opacity(self):
        array = np.zeros((9, 9, 9), np.float32)
        array[0, 0, 0] = 10
        for opacity, expected in (
            ([0, 1], {0: 0, 5: 0.5, 10: 1}),
            ([0, 0, 0.5], {5: 0, 7.5: 0.25, 10: 0.5}),
            ([(2, 0.25), (4, 0.75)], {3: 0.5, 9: 0.75}),
            (0.125, {-5: 0.125, 0: 0.125, 10: 0.125, 99: 0.125}),
        ):
            function = self.property_of(array, opacity=opacity).GetScalarOpacity()
            for value, alpha in expected.items():
                self.assertAlmostEqual(function.GetValue(value), alpha, msg=f"{opacity} {value}")
        function = self.property_of(array, opacity=[0, 1], clim=(5, 6)).GetScalarOpacity()
        self.assertAlmostEqual(function.GetValue(5.25), 0.25)
        own = vtk.vtkPiecewiseFunction()
        self.assertIs(self.property_of(array, opacity=own).GetScalarOpacity(), own)
        for wrong in (2, [0, 3], []):
            with self.assertRaises(ValueError):
                self.property_of(array, opacity=wrong)

    def test_colors(self):
        array = np.zeros((9, 9, 9), np.uint8)
        array[0, 0, 0] = 100

        def color(value, **arguments):
            function = self.property_of(array, **arguments).GetRGBTransferFunction()
            return tuple(round(c, 3) for c in function.GetColor(value))

        self.assertEqual(color(50, cmap="gray"), (0.5, 0.5, 0.5))
        self.assertEqual(color(0, cmap="viridis"), (0.267, 0.005, 0.329))
        self.assertEqual(color(0, colors=["red", "#00ff00"]), (1, 0, 0))
        self.assertEqual(color(50, colors=["red", "#00ff00"]), (0.5, 0.5, 0))
        self.assertEqual(color(30, colors=[(20, (0, 0, 1)), (40, "white")]), (0.5, 0.5, 1))
        for wrong in ({"cmap": "no such map"}, {"colors": ["no such colour"]}, {"colors": []},
                      {"colors": [(1, 2, 3)]}, {"cmap": "gray", "colors": ["red"]},
                      {"colors": ["#12"]}, {"clim": (3, 1)}):
            with self.assertRaises(ValueError):
                self.property_of(array, **wrong)

    def test_components_are_channels(self):
        z, y, x = np.mgrid[0:40, 0:40, 0:40].astype(float)
        for components in (2, 3, 4):
            array = np.zeros((40, 40, 40, components), np.uint8)
            for c in range(components):
                r = (x - 10 - 6 * c) ** 2 + (y - 20) ** 2 + (z - 20) ** 2
                array[..., c] = 200 * np.exp(-r / 30)
            pixels = teravox.screenshot(array, size=(90, 70), shade=False).astype(int)
            # Somewhere each channel's colour is the strongest.
            for c in range(min(components, 3)):
                others = np.delete(pixels, c, axis=2).max(axis=2)
                self.assertGreater((pixels[..., c] - others).max(), 40, (components, c))
            same = self.property_of(array, cmap="gray", opacity=[0, 0.1])
            own = self.property_of(array, cmap="gray", shade=False)
            for c in range(components):
                self.assertFalse(own.GetShade(c))
                self.assertIs(own.GetRGBTransferFunction(c), own.GetRGBTransferFunction(0))
                self.assertIs(same.GetScalarOpacity(c), same.GetScalarOpacity(0))
                self.assertIs(same.GetRGBTransferFunction(c), same.GetRGBTransferFunction(0))
                self.assertTrue(same.GetShade(c))

    def test_shade_and_budgets(self):
        array = shells(20)
        self.assertTrue(self.property_of(array).GetShade())
        self.assertFalse(self.property_of(array, shade=False).GetShade())
        mapper = teravox.volume(
            array, gpu_memory="0.5G", host_memory=123456789, tolerance=0.01, threads=3
        ).GetMapper()
        self.assertEqual(mapper.GetGPUMemoryBudget(), 1 << 29)
        self.assertEqual(mapper.GetHostMemoryBudget(), 123456789)
        self.assertEqual(mapper.GetImageErrorTolerance(), 0.01)
        self.assertEqual(mapper.GetNumberOfLoaderThreads(), 3)
        for wrong in ("lots", 0, "-1M"):
            with self.assertRaises(ValueError):
                teravox.volume(array, gpu_memory=wrong)


class Plotter:
    """What PyVista's plotter does with a prop that it gets by add_actor(), as far as VTK sees it: a dictionary by
    name, AddActor(), bounds of all props, a camera reset by them, culling and picking as far as the prop knows
    them, a light kit, screenshots."""

    def __init__(self, size=(120, 90)):
        self.actors = {}
        self.renderer = vtk.vtkRenderer()
        self.window = vtk.vtkRenderWindow()
        self.window.SetOffScreenRendering(1)
        self.window.SetMultiSamples(0)
        self.window.SetSize(*size)
        self.window.AddRenderer(self.renderer)
        self.renderer.AutomaticLightCreationOff()
        vtk.vtkLightKit().AddLightsToRenderer(self.renderer)

    def add_actor(self, actor, reset_camera=None, name=None, culling=False, pickable=True):
        if isinstance(actor, vtk.vtkMapper):
            raise TypeError("a mapper of surfaces")
        name = name or actor.GetAddressAsString("")
        self.remove_actor(name)
        actor.renderer = self
        self.renderer.AddActor(actor)
        self.actors[name] = actor
        if reset_camera or (reset_camera is None and len(self.actors) == 1):
            self.reset_camera()
        if culling:
            try:
                actor.GetProperty().BackfaceCullingOn()
            except AttributeError:
                pass
        actor.SetPickable(pickable)
        self.renderer.Modified()
        return actor, actor.GetProperty()

    def remove_actor(self, name):
        actor = self.actors.pop(name, None)
        if actor is not None:
            self.renderer.RemoveActor(actor)

    @property
    def bounds(self):
        found = [a.GetBounds() for a in self.actors.values() if hasattr(a, "GetBounds") and a.GetBounds()]
        return tuple(f(b[i] for b in found) for i, f in enumerate((min, max) * 3))

    def reset_camera(self):
        self.renderer.ResetCamera(self.bounds)

    def screenshot(self):
        self.window.Render()
        grab = vtk.vtkWindowToImageFilter()
        grab.SetInput(self.window)
        grab.ReadFrontBufferOff()
        grab.Update()
        width, height, _ = grab.GetOutput().GetDimensions()
        return vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars()).reshape(height, width, -1)[::-1, :, :3]


class Plotters(unittest.TestCase):
    def test_a_volume_goes_in_by_add_actor(self):
        array = shells(40)
        plotter = Plotter()
        volume, look = plotter.add_actor(
            teravox.volume(array, spacing=(1, 2, 3), shade=False), name="scan", culling=True)
        self.assertIsInstance(look, vtk.vtkVolumeProperty)
        z, y, x = array.shape
        self.assertEqual(plotter.bounds, (0, x - 1, 0, 2 * (y - 1), 0, 3 * (z - 1)))
        picture = plotter.screenshot()
        self.assertTrue(volume.GetMapper().IsConverged())
        # The camera sees all of it, and nothing else: something in the middle, nothing at the rim.
        self.assertGreater(picture[30:60, 45:75].max(), 60)
        self.assertEqual(picture[[0, -1]].max(), 0)
        # As a volume of a renderer's.
        # Once more, because the filter of screenshots turns the camera's view angle by a rounding.
        plotter.window.Render()
        mine = vtk.vtkImageData()
        self.assertTrue(volume.GetMapper().GetColorAccumulator(mine))
        plotter.remove_actor("scan")
        scene = Scene(volume)
        scene.renderer.SetActiveCamera(plotter.renderer.GetActiveCamera())
        np.testing.assert_array_equal(vtk_to_numpy(mine.GetPointData().GetScalars()), scene.accumulator())

    def test_with_surfaces_by_name_and_removed(self):
        plotter = Plotter()
        plotter.add_actor(teravox.volume(shells(40)), name="scan")
        alone = plotter.screenshot()
        ball = vtk.vtkSphereSource()
        ball.SetCenter(20, 20, 60)
        ball.SetRadius(9)
        surface = vtk.vtkPolyDataMapper()
        surface.SetInputConnection(ball.GetOutputPort())
        actor = vtk.vtkActor()
        actor.SetMapper(surface)
        plotter.add_actor(actor, name="ball")
        # The ball is in front of the volume, which is seen beside it.
        self.assertGreater(plotter.bounds[5], 68)
        both = plotter.screenshot()
        changed = (np.abs(both.astype(int) - alone) > 8).any(axis=2)
        self.assertTrue(0.005 < changed.mean() < 0.6, changed.mean())
        plotter.remove_actor("ball")
        np.testing.assert_array_equal(plotter.screenshot(), alone)
        # Another volume of the same name takes its place.
        plotter.add_actor(teravox.volume(np.zeros((9, 9, 9), np.uint8), opacity=[0, 1], clim=(0, 255)), name="scan")
        self.assertEqual(plotter.renderer.GetVolumes().GetNumberOfItems(), 1)
        self.assertEqual(plotter.screenshot().max(), 0)


class Screenshots(Folder):
    def test_the_picture_is_the_window_s(self):
        array = shells()
        volume = teravox.volume(array)
        pixels = teravox.screenshot(volume, self.path("a.png"), size=(120, 90), background="navy")
        self.assertEqual((pixels.shape, pixels.dtype), ((90, 120, 3), np.uint8))
        self.assertEqual(tuple(pixels[0, 0]), (0, 0, 128))
        reader = vtk.vtkPNGReader()
        reader.SetFileName(self.path("a.png"))
        reader.Update()
        back = vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars()).reshape(90, 120, 3)
        np.testing.assert_array_equal(back[::-1], pixels)
        # The same volume again, and a new one: the same picture.
        np.testing.assert_array_equal(
            teravox.screenshot(volume, size=(120, 90), background="navy"), pixels
        )
        np.testing.assert_array_equal(
            teravox.screenshot(array, size=(120, 90), background=(0, 0, 128 / 255)), pixels
        )
        # A volume can go on in another window.
        self.assertGreater(Scene(volume).accumulator().max(), 0.1)

    def test_camera_and_which_way_is_up(self):
        array = np.zeros((40, 40, 40), np.uint8)
        array[30:, :, :20] = 255  # high z, low x
        look = {"opacity": [0, 1], "colors": ["red", "red"], "shade": False, "size": (60, 60)}
        camera = ((20, -150, 20), (20, 20, 20), (0, 0, 1))  # x to the right, z upwards
        pixels = teravox.screenshot(array, camera=camera, **look)
        ys, xs = np.nonzero(pixels[:, :, 0] > 128)
        self.assertLess(ys.max(), 30)
        self.assertLess(xs.max(), 31)
        self.assertGreater(len(ys), 50)
        near = teravox.screenshot(array, camera=camera, zoom=2, **look)
        self.assertGreater((near > 128).sum(), 3 * (pixels > 128).sum())

    def test_files_by_extension(self):
        for name in ("a.png", "a.jpg", "a.tiff"):
            teravox.screenshot(shells(30), self.path(name), size=(30, 20))
            self.assertGreater(os.path.getsize(self.path(name)), 100)
        with self.assertRaisesRegex(ValueError, "png"):
            teravox.screenshot(shells(30), self.path("a.gif"))
        with self.assertRaises(RuntimeError):
            teravox.screenshot(shells(30), self.path("no such folder/a.png"), size=(30, 20))

    def test_a_time_out_says_so(self):
        done = run_script(
            """
            import time
            import numpy as np, teravox
            from support import Recorded

            like = Recorded(np.zeros((400, 400, 400), np.uint8), lambda box: time.sleep(0.02))
            try:
                teravox.screenshot(like, size=(40, 30), timeout=0.5)
            except TimeoutError as error:
                print(error)
            """
        )
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        self.assertRegex(done.stdout, r"after 0\.5 s")

    def test_arguments_that_cannot_be(self):
        with self.assertRaises(TypeError):
            teravox.screenshot(teravox.volume(shells(20)), opacity=[0, 1])
        with self.assertRaises(TypeError):
            teravox.screenshot(vtk.vtkVolume())
        with self.assertRaises(TypeError):
            teravox.screenshot(shells(20), no_such_argument=1)

    def test_without_a_display(self):
        done = run_script(
            """
            import os
            os.environ.pop("DISPLAY", None)
            import numpy as np, teravox
            try:
                teravox.screenshot(np.zeros((9, 9, 9), np.uint8))
            except RuntimeError as error:
                print(error)
            """
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("xvfb-run", done.stdout)


class Stubs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = os.path.dirname(teravox.__file__)
        with open(os.path.join(cls.folder, "vtkRenderingOutOfCore.pyi"), encoding="ascii") as file:
            cls.tree = ast.parse(file.read())

    def test_all_that_is_wrapped_has_types(self):
        self.assertTrue(os.path.exists(os.path.join(self.folder, "py.typed")))
        stubs = {n.name: n for n in self.tree.body if isinstance(n, ast.ClassDef)}
        module = teravox.vtkRenderingOutOfCore
        classes = {n: c for n, c in vars(module).items() if inspect.isclass(c)}
        self.assertGreaterEqual(len(classes), 9)
        self.assertEqual(set(stubs), set(classes))
        for name, wrapped in classes.items():
            names = set()
            for node in stubs[name].body:
                if isinstance(node, ast.AnnAssign):
                    names.add(node.target.id)
                elif isinstance(node, (ast.FunctionDef, ast.ClassDef)):
                    names.add(node.name)
            public = {k for k in vars(wrapped) if not k.startswith("_")}
            self.assertEqual(names, public, name)

    def test_signatures(self):
        text = {}
        for node in self.tree.body:
            if isinstance(node, ast.ClassDef):
                for member in node.body:
                    if isinstance(member, ast.FunctionDef):
                        text.setdefault(f"{node.name}.{member.name}", []).append(ast.unparse(member))
        def get(name):
            return [" ".join(t.split()) for t in text[name]]

        self.assertEqual(
            get("vtkHDF5PyramidReader.SetFileName"), ["def SetFileName(self, name: str) -> None: ..."]
        )
        self.assertIn("-> vtkBrickSource", get("vtkBrickSourceAlgorithm.GetBrickSource")[0])
        self.assertIn("first: Sequence[int]", get("vtkBrickSource.ReadVoxels")[0])
        self.assertEqual(len(text["vtkOutOfCoreTransferFunction.MakeAutomatic"]), 2)
        self.assertIn("@overload", text["vtkOutOfCoreTransferFunction.MakeAutomatic"][0])
        vague = [n for n, ts in text.items() if "*args: Any" in ts[0]]
        self.assertEqual(vague, [])

    def test_functions_have_types_and_documentation(self):
        for name in ("convert", "info", "open", "read", "source", "volume", "screenshot"):
            function = getattr(teravox, name)
            self.assertGreater(len(function.__doc__), 100, name)
            signature = inspect.signature(function)
            self.assertIsNot(signature.return_annotation, inspect.Signature.empty, name)
            for parameter in signature.parameters.values():
                self.assertIsNot(parameter.annotation, inspect.Parameter.empty, (name, parameter))
                if parameter.kind is not parameter.VAR_KEYWORD:
                    # Told in the docstring, or said to be another function's.
                    self.assertRegex(function.__doc__, rf"\b{parameter.name}\b", name)


if __name__ == "__main__":
    unittest.main()
