# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Arrays as volumes: bits, types, strides, levels, threads, errors, lifetimes."""
import gc
import os
import tempfile
import threading
import time
import unittest
import weakref

import dask.array
import h5py
import numpy as np
import vtk
import zarr
from vtkmodules.util.numpy_support import numpy_to_vtk

import teravox
from support import Recorded, Scene, noise, picture_of, run_script, shells


class Bits(unittest.TestCase):
    TYPES = ("u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8")

    def test_all_types_bit_for_bit(self):
        for name in self.TYPES:
            for order in "<>":
                array = noise((70, 40, 67), order + name)
                source = teravox.source(array)
                back = teravox.read(source)
                self.assertEqual(back.dtype, np.dtype(name))
                np.testing.assert_array_equal(back, array)
                self.assertEqual(teravox.info(source)["range"], (array.min(), array.max()))

    def test_coarser_levels_are_box_averages(self):
        array = noise((130, 66, 70), "u2")
        source = teravox.source(array)
        levels = teravox.info(source)["levels"]
        self.assertEqual(levels, [(130, 66, 70), (65, 33, 35), (33, 17, 18)])
        padded = array.astype(np.int64)
        mean = (padded.reshape(65, 2, 33, 2, 35, 2).sum(axis=(1, 3, 5)) + 4) // 8
        np.testing.assert_array_equal(teravox.read(source, 1), mean)

    def test_levels_are_those_of_a_pyramid_file(self):
        array = noise((150, 131, 97), "f4", seed=2)
        array[3:90, 50:60, :] = np.nan
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "pyramid.h5")
            teravox.convert(array, path, progress=False)
            written, made = teravox.open(path), teravox.source(array)
            self.assertEqual(teravox.info(written)["levels"], teravox.info(made)["levels"])
            for level in range(len(teravox.info(made)["levels"])):
                np.testing.assert_array_equal(
                    teravox.read(written, level), teravox.read(made, level)
                )

    def test_bool_and_half_are_widened_exactly(self):
        mask = noise((20, 30, 40), bool)
        back = teravox.read(teravox.source(mask))
        self.assertEqual(back.dtype, np.uint8)
        np.testing.assert_array_equal(back, mask)
        half = noise((20, 30, 40), "f2")
        back = teravox.read(teravox.source(half))
        self.assertEqual(back.dtype, np.float32)
        np.testing.assert_array_equal(back, half)

    def test_other_types_are_a_type_error(self):
        for name in ("i8", "u8", "c8", "O", "S3", "M8[s]", "longdouble"):
            with self.assertRaisesRegex(TypeError, "astype"):
                teravox.source(np.zeros((4, 4, 4), np.dtype(name)))
        for thing in (7, None, [1, 2], {"a": 1}, b"abc"):
            with self.assertRaises(TypeError):
                teravox.source(thing)
        for shape in ((4, 4), (4,), (4, 4, 4, 5), (4, 0, 4), (2, 2, 2, 2, 2)):
            with self.assertRaisesRegex(ValueError, "z, y, x"):
                teravox.source(np.zeros(shape, np.uint8))

    def test_components(self):
        colors = noise((20, 30, 40, 3), "u1")
        source = teravox.source(colors)
        self.assertEqual(teravox.info(source)["components"], 3)
        np.testing.assert_array_equal(teravox.read(source), colors)

    def test_labels_have_levels_by_the_most_frequent_value(self):
        labels = np.zeros((80, 80, 80), np.uint8)
        labels[:, :, 41:] = 200
        source = teravox.source(labels, labels=True)
        self.assertEqual(set(np.unique(teravox.read(source, 1))), {0, 200})
        volume = teravox.volume(labels, labels=True)
        self.assertEqual(
            volume.GetProperty().GetInterpolationType(), vtk.VTK_NEAREST_INTERPOLATION
        )

    def test_boxes(self):
        array = noise((90, 80, 70), "i2")
        source = teravox.source(array)
        box = (slice(3, 77), slice(60, 80), slice(None, -5))
        np.testing.assert_array_equal(teravox.read(source, 0, box), array[box])
        for wrong in ((slice(0, 3),), (slice(5, 5),) * 3, (slice(0, 9, 2),) * 3):
            with self.assertRaises(IndexError):
                teravox.read(source, 0, wrong)
        with self.assertRaises(IndexError):
            teravox.read(source, 9)


class Pictures(unittest.TestCase):
    def test_any_strides_give_the_same_bits(self):
        array = shells()
        expected = picture_of(array)
        self.assertGreater(expected.max(), 0.3)
        wide = np.zeros(tuple(2 * n for n in array.shape), np.uint8)
        wide[::2, ::2, ::2] = array
        flipped = np.ascontiguousarray(array[::-1, :, ::-1])
        for other in (
            np.asfortranarray(array),
            np.ascontiguousarray(array.transpose(2, 0, 1)).transpose(1, 2, 0),
            wide[::2, ::2, ::2],
            flipped[::-1, :, ::-1],
            np.lib.stride_tricks.as_strided(array, array.shape, array.strides, writeable=False),
        ):
            np.testing.assert_array_equal(picture_of(other), expected)
        flat = np.broadcast_to(array[:1], array.shape)  # no stride along z
        np.testing.assert_array_equal(picture_of(flat), picture_of(flat.copy()))

    def test_the_bits_of_the_same_voxels_in_an_image(self):
        # Noise: no brick of a single value, for which ranges of another kind could matter.
        array = noise((66, 72, 80), "u1")
        image = vtk.vtkImageData()
        image.SetDimensions(*array.shape[::-1])
        image.GetPointData().SetScalars(numpy_to_vtk(array.ravel(), deep=1))
        volume = teravox.volume(array, opacity=[0, 0.02], cmap="gray", clim=(0, 255))
        expected = Scene(volume).accumulator()
        mapper = teravox.vtkOutOfCoreVolumeMapper()
        mapper.SetInputData(image)
        other = vtk.vtkVolume()
        other.SetMapper(mapper)
        other.SetProperty(volume.GetProperty())
        np.testing.assert_array_equal(Scene(other).accumulator(), expected)

    def test_axes_are_z_y_x_and_the_world_is_x_y_z(self):
        array = np.zeros((10, 20, 30), np.uint8)
        array[2, 5, 25] = 255
        volume = teravox.volume(array, spacing=(1, 2, 3), origin=(100, 0, -7))
        np.testing.assert_allclose(volume.GetBounds(), (100, 129, 0, 38, -7, 20))
        source = volume.GetMapper().GetInputAlgorithm()
        source.SetLevel(0)
        source.Update()
        image = source.GetOutput()
        self.assertEqual(image.GetDimensions(), (30, 20, 10))
        self.assertEqual(image.GetScalarComponentAsDouble(25, 5, 2, 0), 255)
        self.assertEqual(image.GetPoint(image.ComputePointId((25, 5, 2))), (125, 10, -1))

    def test_any_budget_gives_the_same_bits(self):
        array = shells(140)
        expected = picture_of(array)
        scene = Scene(
            teravox.volume(
                array, brick_size=16, gpu_memory="64M", host_memory="64M", threads=1,
                opacity=[0.0, 0.03, 0.2], cmap="viridis", clim=(0, 255), value_range=(0, 255),
            )
        )
        scene.mapper.SetMaximumNumberOfSlots(24)
        small = scene.accumulator()
        self.assertTrue(scene.mapper.IsConverged())
        scene.mapper.SetMaximumNumberOfSlots(0)
        scene.mapper.SetPictureReuse(0)
        np.testing.assert_array_equal(scene.accumulator(), small)
        # Another brick size cuts rays at other places: the same within twice the tolerance.
        self.assertLess(np.abs(small - expected).max(), 2 / 255)


class Likes(unittest.TestCase):
    """h5py, zarr, dask: the same bits as numpy."""

    @classmethod
    def setUpClass(cls):
        cls.array = shells(90)
        cls.expected = picture_of(cls.array)

    def test_h5py(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.h5")
            with h5py.File(path, "w") as file:
                file.create_dataset("a", data=self.array, chunks=(32, 32, 32), compression="gzip")
            with h5py.File(path) as file:
                np.testing.assert_array_equal(picture_of(file["a"]), self.expected)
                np.testing.assert_array_equal(
                    teravox.read(teravox.source(file["a"])), self.array
                )
            # The same file by our own reader beside h5py's library.
            opened = teravox.open(path, dataset="/a")
            np.testing.assert_array_equal(teravox.read(opened), self.array)

    def test_zarr(self):
        stored = zarr.array(self.array, chunks=(40, 30, 50))
        np.testing.assert_array_equal(picture_of(stored), self.expected)

    def test_dask(self):
        lazy = dask.array.from_array(self.array, chunks=(31, 64, 50))
        np.testing.assert_array_equal(picture_of(lazy + np.uint8(0)), self.expected)

    def test_what_nobody_knows_of_the_range_is_within_the_tolerance(self):
        # Twice: both pictures are within it.
        unknown = picture_of(Recorded(self.array), value_range=None)
        self.assertLess(np.abs(unknown - self.expected).max(), 2 / 255)

    def test_anything_is_read_brick_by_brick_by_other_threads(self):
        like = Recorded(self.array)
        np.testing.assert_array_equal(picture_of(like), self.expected)
        self.assertNotIn(threading.get_ident(), like.threads)
        for box in like.boxes:
            self.assertTrue(all(0 < s.stop - s.start <= 64 + 4 for s in box), box)


class Levels(unittest.TestCase):
    def test_factors(self):
        find = teravox._levels.find_factors
        self.assertEqual(
            find([(100, 50, 7), (50, 25, 7), (25, 13, 4), (13, 7, 2), (7, 4, 1)]),
            [(1, 1, 1), (2, 2, 1), (4, 4, 2), (8, 8, 4), (16, 16, 8)],
        )
        self.assertEqual(find([(301, 9, 4), (150, 4, 2)]), [(1, 1, 1), (2, 2, 2)])  # rounded down
        self.assertEqual(find([(99, 9, 9), (33, 3, 3)]), [(1, 1, 1), (3, 3, 3)])
        for wrong in ([(100, 50, 7), (70, 50, 7)], [(8, 8, 8), (4, 4, 4), (3, 3, 3)],
                      [(8, 8, 8), (16, 8, 8)]):
            with self.assertRaises(ValueError):
                find(wrong)

    def test_a_list_is_read_as_it_is_and_lazily(self):
        fine = Recorded(shells(150))
        coarse = Recorded(np.ascontiguousarray(fine.array[::2, ::2, ::2]))
        coarsest = Recorded(np.ascontiguousarray(fine.array[::4, ::4, ::4]))
        volume = teravox.volume([fine, coarse, coarsest], opacity=[0, 0.1], clim=(0, 255))
        self.assertEqual(fine.boxes, [])  # a sample of the coarsest level tells the colours
        self.assertEqual(coarse.boxes, [])
        source = volume.GetMapper().GetInputAlgorithm()
        np.testing.assert_array_equal(teravox.read(source, 1), coarse.array)
        np.testing.assert_array_equal(teravox.read(source, 2), coarsest.array)
        # From far away nothing is finer than needed.
        scene = Scene(volume, size=(40, 30))
        scene.accumulator()
        self.assertTrue(scene.mapper.IsConverged())
        self.assertEqual(fine.boxes, [])
        # Near, the finest level is.
        scene.renderer.GetActiveCamera().Zoom(8)
        scene.accumulator()
        self.assertTrue(scene.mapper.IsConverged())
        self.assertNotEqual(fine.boxes, [])

    def test_levels_must_agree(self):
        fine = np.zeros((20, 20, 20), np.uint8)
        with self.assertRaises(TypeError):
            teravox.source([fine, np.zeros((10, 10, 10), np.uint16)])
        with self.assertRaises(ValueError):
            teravox.source([fine, np.zeros((9, 7, 9), np.uint8)])
        with self.assertRaises(ValueError):
            teravox.source([])

    def test_what_needs_more_memory_than_there_is_says_so(self):
        with self.assertRaisesRegex(RuntimeError, "too small"):
            teravox.screenshot(shells(150), size=(40, 30), host_memory="1M")


class Locks(unittest.TestCase):
    """The thread that renders holds Python's lock; those that read need it."""

    def test_another_thread_of_python_runs_while_the_picture_is_waited_for(self):
        # Each read waits for a thread that can only answer while the renderer gives up the lock.
        asked, answered = threading.Semaphore(0), threading.Semaphore(0)

        def before(_):
            asked.release()
            if not answered.acquire(timeout=30):
                raise RuntimeError("nobody answered")

        stop = threading.Event()

        def answer():
            while not stop.is_set():
                if asked.acquire(timeout=0.05):
                    answered.release()

        thread = threading.Thread(target=answer)
        thread.start()
        try:
            pixels = picture_of(Recorded(shells(), before))
        finally:
            stop.set()
            thread.join()
        np.testing.assert_array_equal(pixels, picture_of(shells()))

    def test_a_volume_dies_while_it_is_read(self):
        entered, leave = threading.Event(), threading.Event()

        def before(box):
            entered.set()
            leave.wait(30)

        like = Recorded(shells(100), before)
        volume = teravox.volume(like, opacity=[0, 0.1], cmap="gray", clim=(0, 255))
        volume.GetMapper().SetBrickSource(
            volume.GetMapper().GetInputAlgorithm().GetBrickSource()
        )  # the presented level isn't read
        scene = Scene(volume)
        scene.mapper.SetFrameTimeBudget(0.05)
        rendering = threading.Timer(0.5, leave.set)
        rendering.start()
        scene.window.Render()
        self.assertTrue(entered.wait(30))
        del scene, volume
        gc.collect()  # joins the threads that read: they need the lock
        rendering.join()

    def test_rendering_in_another_thread_while_the_main_one_computes(self):
        result = []
        thread = threading.Thread(target=lambda: result.append(teravox.read(teravox.source(a))))
        a = shells(100)
        thread.start()
        count = 0
        while thread.is_alive():
            count += 1
        thread.join()
        np.testing.assert_array_equal(result[0], a)

    def test_sources_upon_sources(self):
        source = teravox.source(Recorded(shells(60)))
        repeated = teravox.vtkRepeatVolume()
        repeated.SetInputConnection(source.GetOutputPort())
        repeated.SetRepetitions(2, 1, 2)
        self.assertEqual(teravox.info(repeated)["shape"], (120, 66, 150))
        mapper = teravox.vtkOutOfCoreVolumeMapper()
        mapper.SetInputConnection(repeated.GetOutputPort())
        volume = vtk.vtkVolume()
        volume.SetMapper(mapper)
        teravox.vtkOutOfCoreTransferFunction.MakeAutomatic(
            repeated.GetBrickSource(), volume.GetProperty()
        )
        scene = Scene(volume)
        self.assertGreater(scene.accumulator().max(), 0.1)
        self.assertTrue(mapper.IsConverged())


class Errors(unittest.TestCase):
    def failing(self, where):
        def before(box):
            if where(box):
                raise OSError("the disk {x} is on fire\nreally: \u00e4")

        return before

    def test_a_brick_fails_and_the_rest_is_drawn(self):
        broken = [True]
        array = shells(150)
        coarse = np.ascontiguousarray(array[::2, ::2, ::2])
        fine = Recorded(array, self.failing(lambda box: broken[0] and box[2].start < 30))
        volume = teravox.volume([fine, coarse], opacity=[0, 0.1], cmap="gray", clim=(0, 255))
        scene = Scene(volume)
        scene.mapper.SetMaximumLevel(0)
        events = []

        def on_failure(_, __, text):
            events.append(text)

        on_failure.CallDataType = "string0"
        scene.mapper.AddObserver(scene.mapper.BrickFailedEvent, on_failure)
        scene.mapper.AddObserver("ErrorEvent", lambda *_: None)
        pixels = scene.accumulator()
        self.assertFalse(scene.mapper.IsConverged())
        self.assertGreater(scene.mapper.GetNumberOfFailedBricks(), 0)
        self.assertTrue(events)
        self.assertIn("OSError: the disk {x} is on fire", events[0])
        self.assertIn("level 0, brick (0, ", events[0])
        # Whole again.
        broken[0] = False
        scene.mapper.RetryFailedBricks()
        whole = scene.accumulator()
        self.assertTrue(scene.mapper.IsConverged())
        # Meanwhile the coarser level took its place: no hole.
        covered = whole[:, 3] > 0.2
        self.assertGreater((pixels[covered, 3] > 0.1).mean(), 0.99)
        self.assertFalse(np.array_equal(pixels, whole))

    def test_nothing_can_be_read(self):
        like = Recorded(shells(60), self.failing(lambda box: True))
        with self.assertWarnsRegex(RuntimeWarning, "on fire"):
            pixels = teravox.screenshot(like, size=(40, 30), timeout=30)
        self.assertEqual(pixels.max(), 0)
        with self.assertRaisesRegex(RuntimeError, "on fire"):
            teravox.read(teravox.source(like))

    def test_convert_of_what_fails_leaves_nothing(self):
        like = Recorded(shells(130), self.failing(lambda box: box[0].start > 0))
        with tempfile.TemporaryDirectory() as folder:
            with self.assertRaisesRegex(RuntimeError, "on fire"):
                teravox.convert(like, os.path.join(folder, "a.h5"), progress=False)
            self.assertEqual(os.listdir(folder), [])

    def test_liars(self):
        class Liar:
            shape, dtype = (40, 40, 40), np.dtype("u1")

            def __init__(self, lie):
                self.lie = lie

            def __getitem__(self, box):
                return self.lie

        for lie in (np.zeros((3, 3, 3), "u1"), np.zeros((40, 40, 40), "f4"), None, "text",
                    np.zeros((40, 40, 40), "O"), 5):
            with self.assertRaisesRegex(RuntimeError, "level 0, brick"):
                teravox.read(teravox.source(Liar(lie)))

    def test_the_reads_own_errors_of_every_kind(self):
        for error in (KeyboardInterrupt, SystemExit, MemoryError, RecursionError, StopIteration):

            def before(_, error=error):
                raise error

            with self.assertRaisesRegex(RuntimeError, error.__name__):
                teravox.read(teravox.source(Recorded(shells(20), before)))


class Lifetimes(unittest.TestCase):
    def test_the_volume_keeps_the_array(self):
        like = Recorded(shells())
        expected = picture_of(shells())
        alive = weakref.ref(like)
        volume = teravox.volume(
            like, opacity=[0.0, 0.03, 0.2], cmap="viridis", clim=(0, 255), value_range=(0, 255)
        )
        del like
        gc.collect()
        self.assertIsNotNone(alive())
        scene = Scene(volume)
        np.testing.assert_array_equal(scene.accumulator(), expected)
        del scene, volume
        for _ in range(100):  # it is let go of when Python next looks
            gc.collect()
            if alive() is None:
                break
            time.sleep(0.01)
        self.assertIsNone(alive())

    def test_the_program_ends_while_bricks_are_read(self):
        for _ in range(3):
            done = run_script(
                """
                import time
                import teravox
                from support import Recorded, Scene, shells

                like = Recorded(shells(150), lambda box: time.sleep(0.05))
                volume = teravox.volume(like, opacity=[0, 0.1], cmap="gray", clim=(0, 255))
                source = volume.GetMapper().GetInputAlgorithm()
                volume.GetMapper().SetBrickSource(source.GetBrickSource())
                scene = Scene(volume)
                scene.mapper.SetFrameTimeBudget(0.01)
                scene.window.Render()
                assert not scene.mapper.IsConverged()
                print("end")
                """
            )
            self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "end\n", ""))


class Interrupts(unittest.TestCase):
    """Ctrl-C: an exception, not the end of the program; nothing is left."""

    INTERRUPT = """
        import os, signal, threading, time
        import teravox
        import numpy as np
        from support import Recorded

        sent, reads = [], []
        def before(box):
            reads.append(box)
            if len(reads) > 2 and not sent:
                sent.append(len(reads))
                os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.02)

        like = Recorded(np.zeros((420, 400, 430), np.uint8), before)
    """

    def check(self, text):
        done = run_script(self.INTERRUPT + text)
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        self.assertEqual(done.stdout, "interrupted\nalive\n")

    def test_screenshot(self):
        self.check(
            """
        try:
            teravox.screenshot(like, size=(60, 40), opacity=[0, 0.1], cmap="gray", clim=(0, 255))
        except KeyboardInterrupt:
            print("interrupted")
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
        assert len(reads) < 60, "all was read in spite of it"
        print("alive")
    """
        )

    def test_convert(self):
        self.check(
            """
        import tempfile
        with tempfile.TemporaryDirectory() as folder:
            try:
                teravox.convert(like, folder + "/a.h5", progress=False)
            except KeyboardInterrupt:
                print("interrupted")
            assert os.listdir(folder) == []
            assert len(reads) < 60, "all was read in spite of it"
        print("alive")
    """
        )


if __name__ == "__main__":
    unittest.main()
