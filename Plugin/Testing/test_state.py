# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""State files: saved and loaded, the same picture."""
import os
import tempfile

from support import SIZE, Case, fact, look, main, pv, screenshot, show, path_of

SHELLS = [(4000, 0.1, 0.2, 0.8, 0), (12000, 0.2, 0.8, 0.3, 0.02), (21000, 1, 0.4, 0.1, 0.5)]

# Those whose value changes the picture, and some that don't.
SETTINGS = {
    "Shade": 1,
    "MinimumLevel": 2,
    "MaximumLevel": 2,
    "ImageErrorTolerance": 0.01,
    "LevelOfDetailBias": 0.5,
    "GPUMemoryMiB": 200.0,
    "HostMemoryMiB": 300.0,
    "InteractiveFrameTime": 0.25,
    "Timeout": 45.0,
    "UseCropping": 1,
    "CroppingScale": [0.6, 1.0, 0.9],
}


class State(Case):
    def scene(self):
        reader = pv.OpenDataFile(path_of("shells.h5"))
        reader.Channel = 1
        display = show(reader, self.view, [(p[0] + 8000,) + p[1:] for p in SHELLS], unit=2)
        for name, value in SETTINGS.items():
            setattr(display, name, value)
        look(self.view)
        return reader, display

    def check(self, path, picture):
        pv.ResetSession()
        pv.LoadState(path)
        view = pv.GetRenderViews()[0]
        reader = list(pv.GetSources().values())[0]
        display = pv.GetDisplayProperties(reader, view)
        self.assertEqual(display.Representation, "Volume (out of core)")
        for name, value in SETTINGS.items():
            found = display.GetPropertyValue(name)
            self.assertEqual(list(found) if isinstance(value, list) else found, value, name)
        self.assertSamePicture(screenshot(view), picture, 0)
        self.assertEqual(fact(display, "DrawsPyramid"), 1)

    def test_state_file(self):
        reader, display = self.scene()
        picture = screenshot(self.view)
        self.assertShowsSomething(picture)
        for name in ("MinimumLevel", "Shade", "UseCropping"):  # the settings matter
            setattr(display, name, 0)
            self.assertGreater(abs(screenshot(self.view) - picture).max(), 4, name)
            setattr(display, name, SETTINGS[name])
        with tempfile.TemporaryDirectory() as folder:
            for path in (os.path.join(folder, "state.pvsm"), os.path.join(folder, "state.py")):
                pv.SaveState(path)
                self.check(path, picture)


if __name__ == "__main__":
    main()
