# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Ordinary images in the representation, and filters on the image of a pyramid."""
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy

from support import (Case, array_name, fact, look, main, plain_picture, plain_window, pv, screenshot, show,
                     path_of)

WAVELET = [(40, 0.1, 0.2, 0.8, 0), (150, 0.2, 0.8, 0.3, 0.02), (270, 1, 0.4, 0.1, 0.5)]
SHELLS = [(4000, 0.1, 0.2, 0.8, 0), (12000, 0.2, 0.8, 0.3, 0.02), (21000, 1, 0.4, 0.1, 0.5)]


def output_of(source):
    source.UpdatePipeline()
    return source.GetClientSideObject().GetOutputDataObject(0)


def voxels(image):
    n = image.GetDimensions()
    return vtk_to_numpy(image.GetPointData().GetArray(0)).reshape(n[2], n[1], n[0])


class Images(Case):
    def same_as_plain(self, source, display, share=0.1):
        picture = screenshot(self.view)
        self.assertShowsSomething(picture, share)
        image = source.GetClientSideObject().GetOutputDataObject(0)
        window, _ = plain_window(display, self.view, image, display.ColorArrayName[1])
        self.assertSamePicture(picture, plain_picture(window))
        return picture

    def test_wavelet(self):
        source = pv.Wavelet()
        display = show(source, self.view, WAVELET, unit=1)
        look(self.view)
        self.same_as_plain(source, display)
        self.assertEqual(fact(display, "DrawsPyramid"), 0)
        source.Maximum = 200  # the image changes, the picture follows
        self.same_as_plain(source, display)

    def test_array_that_a_filter_computes(self):
        reader = pv.OpenDataFile(path_of("shells.h5"))
        name = array_name(reader)
        calculator = pv.Calculator(Input=reader, Function='"%s" / 100' % name, ResultArrayName="hundredth")
        points = [(p[0] / 100,) + p[1:] for p in SHELLS]
        display = show(calculator, self.view, SHELLS, unit=2, name=name)
        look(self.view)
        self.same_as_plain(calculator, display)
        self.assertEqual(fact(display, "DrawsPyramid"), 1)  # the array that was passed through
        display.ColorArrayName = ["POINTS", "hundredth"]
        pv.GetColorTransferFunction("hundredth").RGBPoints = [c for p in points for c in p[:4]]
        pv.GetOpacityTransferFunction("hundredth").Points = [
            c for p in points for c in (p[0], p[4], 0.5, 0.0)]
        display.LookupTable = pv.GetColorTransferFunction("hundredth")
        display.ScalarOpacityFunction = pv.GetOpacityTransferFunction("hundredth")
        self.same_as_plain(calculator, display)
        self.assertEqual(fact(display, "DrawsPyramid"), 0)

    def test_image_that_a_filter_moves(self):
        reader = pv.OpenDataFile(path_of("shells.h5"))
        moved = pv.ProgrammableFilter(Input=reader, OutputDataSetType="vtkImageData")
        moved.Script = """
image = self.GetInputDataObject(0, 0)
self.GetOutputDataObject(0).ShallowCopy(image)
self.GetOutputDataObject(0).SetOrigin(500, -300, 40)
"""
        display = show(moved, self.view, SHELLS, unit=2)
        look(self.view)
        picture = self.same_as_plain(moved, display)
        self.assertEqual(fact(display, "DrawsPyramid"), 1)
        pv.Hide(moved, self.view)
        show(reader, self.view, SHELLS, unit=2)
        self.assertLess(screenshot(self.view).mean(), 0.5 * picture.mean())  # it isn't there

    def test_extract_subset_at_the_chosen_level(self):
        reader = pv.OpenDataFile(path_of("shells.h5"))
        for level, box in ((0, [90, 120, 20, 44, 100, 130]), (1, [30, 60, 10, 30, 20, 50])):
            reader.PresentedLevel = level
            whole = voxels(output_of(reader))
            subset = pv.ExtractSubset(Input=reader, VOI=box)
            part = output_of(subset)
            self.assertEqual(list(part.GetExtent()), box)
            x0, x1, y0, y1, z0, z1 = box
            self.assertTrue(
                (voxels(part) == whole[z0:z1 + 1, y0:y1 + 1, x0:x1 + 1]).all())
            display = show(subset, self.view, SHELLS, unit=2)
            look(self.view)
            self.same_as_plain(subset, display)
            self.assertEqual(fact(display, "DrawsPyramid"), 0)
            pv.Delete(subset)

    def test_slice_at_the_chosen_level(self):
        reader = pv.OpenDataFile(path_of("shells.h5"))
        for level in (0, 1):
            reader.PresentedLevel = level
            image = output_of(reader)
            k = 20
            z = image.GetOrigin()[2] + k * image.GetSpacing()[2]
            cut = pv.Slice(Input=reader)
            cut.SliceType = "Plane"
            cut.SliceType.Origin = [0, 0, z]
            cut.SliceType.Normal = [0, 0, 1]
            values = vtk_to_numpy(output_of(cut).GetPointData().GetArray(0))
            self.assertTrue((np.sort(values) == np.sort(voxels(image)[k].ravel())).all())



if __name__ == "__main__":
    main()
