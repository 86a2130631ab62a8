# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""The reader: Open dialogue, properties, what it says of a volume, time, files that are too large."""
import time

from vtkmodules.util.numpy_support import vtk_to_numpy

from support import Case, facts, main, memory, pv, path_of


def field(source, name):
    """What the Information tab lists of the field data."""
    array = source.GetDataInformation().DataInformation.GetArrayInformation(name, 2)
    return array.GetRangesAsString() if array else None


class Reader(Case):
    def test_open_dialogue(self):
        reader = pv.OpenDataFile(path_of("shells.h5"))
        self.assertEqual(reader.GetXMLName(), "HDF5VolumeReader")
        reader.UpdatePipeline()
        self.assertEqual(reader.GetDataInformation().GetExtent(), (0, 87, 0, 79, 0, 71))

    def test_says_what_a_volume_has(self):
        reader = pv.OpenDataFile(path_of("shells.h5"))
        reader.UpdatePipelineInformation()
        self.assertEqual(facts(reader, "NumberOfLevels"), [3])
        self.assertEqual(facts(reader, "TimeSteps"), [2])
        self.assertEqual(len(facts(reader, "Channels")), 2)
        self.assertEqual(facts(reader, "Levels")[1], "88 x 80 x 72, 8 bricks, 990 KiB")
        self.assertEqual(facts(reader, "Bricks"), [27 + 8 + 1])
        self.assertEqual(facts(reader, "Bytes"), [2 * (176 * 160 * 144 + 88 * 80 * 72 + 44 * 40 * 36)])
        reader.UpdatePipeline()
        self.assertEqual(field(reader, "Bricks"), "[36, 36]")
        self.assertEqual(field(reader, "Time steps"), "[2, 2]")
        self.assertEqual(field(reader, "Level 2"), "44 x 40 x 36, 1 brick, 123.8 KiB")
        self.assertEqual(field(reader, "Channels"), "set-up 0, set-up 1")

    def test_level_and_channel(self):
        reader = pv.OpenDataFile(path_of("shells.h5"))
        reader.PresentedLevel = 2
        reader.UpdatePipeline()
        self.assertEqual(reader.GetDataInformation().GetExtent(), (0, 43, 0, 39, 0, 35))
        first = reader.PointData.GetArray(0).GetRange()
        reader.Channel = 1
        reader.UpdatePipeline()
        second = reader.PointData.GetArray(0).GetRange()
        self.assertAlmostEqual(second[0] - first[0], 8000, delta=2)

    def test_time(self):
        reader = pv.OpenDataFile(path_of("shells.h5"))
        reader.PresentedLevel = 2
        self.assertEqual(list(reader.TimestepValues), [0, 1])
        voxels = []
        for step in reader.TimestepValues:
            reader.UpdatePipeline(step)
            image = reader.GetClientSideObject().GetOutputDataObject(0)
            voxels.append(vtk_to_numpy(image.GetPointData().GetArray(0)).copy())
        self.assertFalse((voxels[0] == voxels[1]).all())
        reader.TimePoint = 0
        reader.UpdatePipeline(1)
        image = reader.GetClientSideObject().GetOutputDataObject(0)
        self.assertTrue((vtk_to_numpy(image.GetPointData().GetArray(0)) == voxels[0]).all())

    def test_series(self):
        reader = pv.OpenDataFile([path_of("step_%d.h5" % n) for n in range(3)])
        self.assertEqual(list(reader.TimestepValues), [0, 1, 2])
        self.assertEqual(facts(reader, "TimeSteps"), [3])
        for step in (2, 0, 1):
            reader.UpdatePipeline(step)
            self.assertEqual(reader.PointData.GetArray(0).GetRange(), (10 * step + 10,) * 2)

    def test_huge(self):
        before, began = memory(), time.monotonic()
        reader = pv.OpenDataFile(path_of("huge.h5"))
        reader.UpdatePipelineInformation()
        opened, held = time.monotonic() - began, memory() - before
        self.assertTrue(facts(reader, "Levels")[0].endswith("2097152 bricks, 1 TiB"))
        reader.UpdatePipeline()
        applied, after = time.monotonic() - began, memory() - before
        print("1 TiB: opened after %.3f s and %.1f MiB, applied after %.3f s and %.1f MiB"
              % (opened, held / 2**20, applied, after / 2**20), flush=True)
        self.assertLess(held, 32 * 2**20)
        self.assertLess(after, 64 * 2**20)
        self.assertLessEqual(reader.GetDataInformation().GetNumberOfPoints(), 2 * 2**20)

    def test_more_bytes_than_64_bits_count(self):
        reader = pv.OpenDataFile(path_of("vast.h5"))
        reader.UpdatePipelineInformation()
        self.assertEqual(facts(reader, "Levels")[0],
                         "2097152 x 2097152 x 2097152, 35184372088832 bricks, 16 EiB")
        self.assertEqual(facts(reader, "Bytes"), [2**63 - 1])
        self.refuses(reader)
        reader.BrickSize = 4
        reader.UpdatePipelineInformation()
        self.assertIn(" 144115188075855872 bricks", facts(reader, "Levels")[0])

    def test_level_that_fits_no_memory(self):
        self.refuses(pv.OpenDataFile(path_of("plain.h5")))

    def refuses(self, reader):
        reader.PresentedLevel = 0
        before = memory()
        try:
            reader.UpdatePipeline()
        except RuntimeError:
            pass
        self.assertLess(memory() - before, 64 * 2**20)
        self.assertEqual(reader.GetDataInformation().GetNumberOfPoints(), 0)


if __name__ == "__main__":
    main()
