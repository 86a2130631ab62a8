# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""docs/vtk-options.md against VTK's classes and against the mapper.

    check_options.py docs/vtk-options.md MapperScene.cxx

Each Set... and Select... that VTK has is in the table, and nothing else. Each setter is called with
a value that isn't the default: a warned one gives one warning by name, however often it is drawn;
supported, partly supported and pointless ones give none. Each name that the mapper's
FindUnsupported() knows has a row that says so.
"""
import re
import sys

import vtk
import teravox

CLASSES = ["vtkAbstractMapper", "vtkAbstractVolumeMapper", "vtkVolumeMapper",
           "vtkGPUVolumeRayCastMapper", "vtkVolumeProperty", "vtkVolume", "vtkProp3D", "vtkProp"]
STATUSES = {"supported", "partly", "warned", "pointless"}


def read_table(path):
    """(class, setter) -> status."""
    rows = {}
    of = None
    for line in open(path, encoding="utf-8"):
        if line.startswith("## "):
            of = line[3:].strip()
            assert of in CLASSES, f"{of} isn't looked at"
        match = re.match(r"\| `(\w+)` \| (\w+) \| .*\|$", line)
        if match:
            setter, status = match.groups()
            assert status in STATUSES, f"{setter}: {status}"
            assert (of, setter) not in rows, f"{setter} is there twice"
            rows[of, setter] = status
        else:
            assert not line.startswith("| `"), f"not a row: {line}"
    return rows


class Scene:
    """A small image, drawn by the mapper, with its warnings."""

    def __init__(self):
        source = vtk.vtkRTAnalyticSource()
        source.SetWholeExtent(0, 15, 0, 15, 0, 15)
        source.Update()
        self.image = source.GetOutput()
        self.image.GetPointData().GetScalars().SetName("first")
        low, high = self.image.GetScalarRange()
        cells = vtk.vtkFloatArray()
        cells.SetName("of cells")
        cells.SetNumberOfTuples(self.image.GetNumberOfCells())
        cells.FillComponent(0, 0.5 * (low + high))
        self.image.GetCellData().SetScalars(cells)
        self.mapper = teravox.vtkOutOfCoreVolumeMapper()
        self.mapper.SetGPUMemoryBudget(64 << 20)
        self.mapper.SetInputData(self.image)
        self.opacity = vtk.vtkPiecewiseFunction()
        self.opacity.AddPoint(low, 0)
        self.opacity.AddPoint(high, 0.4)
        self.property = vtk.vtkVolumeProperty()
        self.property.SetScalarOpacity(self.opacity)
        self.property.SetInterpolationTypeToLinear()
        self.volume = vtk.vtkVolume()
        self.volume.SetMapper(self.mapper)
        self.volume.SetProperty(self.property)
        self.renderer = vtk.vtkRenderer()
        self.renderer.AddVolume(self.volume)
        self.window = vtk.vtkRenderWindow()
        self.window.SetOffScreenRendering(1)
        self.window.SetSize(24, 24)
        self.window.AddRenderer(self.renderer)
        self.warnings = []
        self.errors = []

        def warned(_, __, text):
            self.warnings.append(text)

        def failed(_, __, text):
            self.errors.append(text)

        warned.CallDataType = failed.CallDataType = vtk.VTK_STRING
        self.mapper.AddObserver("WarningEvent", warned)
        self.mapper.AddObserver("ErrorEvent", failed)

    def of(self, name):
        if name == "vtkVolumeProperty":
            return self.property
        return self.volume if name in ("vtkVolume", "vtkProp3D", "vtkProp") else self.mapper

    def draw(self):
        self.renderer.ResetCamera()
        self.window.Render()


def function(*points):
    result = vtk.vtkPiecewiseFunction()
    for value, opacity in points:
        result.AddPoint(value, opacity)
    return result


def plane():
    result = vtk.vtkPlane()
    result.SetOrigin(8, 8, 8)
    return result


def planes():
    result = vtk.vtkPlaneCollection()
    result.AddItem(plane())
    return result


def functions_2d():
    image = vtk.vtkImageData()
    image.SetDimensions(4, 4, 1)
    image.AllocateScalars(vtk.VTK_FLOAT, 4)
    image.GetPointData().GetScalars().FillComponent(0, 0.1)
    return image


def mask():
    image = vtk.vtkImageData()
    image.SetDimensions(16, 16, 16)
    image.AllocateScalars(vtk.VTK_UNSIGNED_CHAR, 1)
    image.GetPointData().GetScalars().FillComponent(0, 255)
    return image


def connection(scene):
    scene.producer = vtk.vtkTrivialProducer()  # the port doesn't keep it alive
    scene.producer.SetOutput(scene.image)
    return scene.producer.GetOutputPort()


def matrix():
    result = vtk.vtkMatrix4x4()
    result.SetElement(0, 3, 2)
    return result


def transform():
    result = vtk.vtkTransform()
    result.RotateX(20)
    return result


def shader(_):
    result = vtk.vtkOpenGLShaderProperty()
    result.AddFragmentShaderReplacement("//VTK::Base::Dec", True, "//VTK::Base::Dec\n", False)
    return result


NATIVE = vtk.vtkGPUVolumeRayCastMapper.NATIVE
GPU = vtk.vtkGPUVolumeRayCastMapper
# Arguments that aren't the default's, as a tuple, or a function from the scene to one argument.
# Setters whose name says it all (SetXToY) have none.
ARGUMENTS = {
    "SetClippingPlanes": lambda s: planes(),
    "SelectScalarArray": (0,),
    "SetArrayAccessMode": (vtk.VTK_GET_ARRAY_BY_NAME,),
    "SetScalarMode": (vtk.VTK_SCALAR_MODE_USE_CELL_DATA,),
    "SetInputData": lambda s: s.image,
    "SetBlendMode": (vtk.vtkVolumeMapper.MAXIMUM_INTENSITY_BLEND,),
    "SetAverageIPScalarRange": (50, 200),
    "SetCropping": (1,),
    "SetCroppingRegionPlanes": (3, 9, 3, 9, 3, 9),
    "SetCroppingRegionFlags": (0x2000,),
    "SetInputConnection": connection,
    "SetSampleDistance": (0.3,),
    "SetAutoAdjustSampleDistances": (0,),
    "SetLockSampleDistanceToInputSpacing": (1,),
    "SetImageSampleDistance": (2,),
    "SetMinimumImageSampleDistance": (2,),
    "SetMaximumImageSampleDistance": (5,),
    "SetUseJittering": (1,),
    "SetUseDepthPass": (1,),
    "SetFinalColorWindow": (0.5,),
    "SetFinalColorLevel": (0.2,),
    "SetRenderToImage": (1,),
    "SetDepthImageScalarType": (vtk.VTK_UNSIGNED_CHAR,),
    "SetClampDepthToBackface": (1,),
    "SetMaskInput": lambda s: mask(),
    "SetMaskType": (GPU.BinaryMaskType,),
    "SetMaskBlendFactor": (0.5,),
    "SetMaxMemoryInBytes": (100 << 20,),
    "SetMaxMemoryFraction": (0.5,),
    "SetReportProgress": (False,),
    "SetColorRangeType": (NATIVE,),
    "SetScalarOpacityRangeType": (NATIVE,),
    "SetGradientOpacityRangeType": (NATIVE,),
    "SetTransfer2DYAxisArray": ("first",),
    "SetIndependentComponents": (0,),
    "SetComponentWeight": (0, 0.5),
    "SetColor": lambda s: function((0, 1), (255, 0)),
    "SetScalarOpacity": lambda s: function((0, 0), (255, 0.2)),
    "SetScalarOpacityUnitDistance": (0.5,),
    "SetGradientOpacity": lambda s: function((0, 0), (20, 1)),
    "SetDisableGradientOpacity": (1,),
    "SetTransferFunction2D": lambda s: functions_2d(),
    "SetTransferFunctionMode": (vtk.vtkVolumeProperty.TF_2D,),
    "SetLabelColor": (1, vtk.vtkColorTransferFunction()),
    "SetLabelScalarOpacity": (1, function((0, 0), (255, 0.2))),
    "SetLabelGradientOpacity": (1, function((0, 0), (255, 1))),
    "SetInterpolationType": (vtk.VTK_NEAREST_INTERPOLATION,),
    "SetShade": (1,),
    "SetAmbient": (0.4,),
    "SetDiffuse": (0.4,),
    "SetSpecular": (0.4,),
    "SetSpecularPower": (4,),
    "SetUseClippedVoxelIntensity": (1,),
    "SetClippedVoxelIntensity": (50,),
    "SetSliceFunction": lambda s: plane(),
    "SetMapper": lambda s: s.mapper,
    "SetProperty": lambda s: s.property,
    "SetOrientation": (10, 20, 30),
    "SetOrigin": (1, 2, 3),
    "SetPosition": (1, 2, 3),
    "SetScale": (1, 2, 3),
    "SetUserMatrix": lambda s: matrix(),
    "SetUserTransform": lambda s: transform(),
    "SetVisibility": (0,),
    "SetAllocatedRenderTime": lambda s: 5.0,
    "SetShaderProperty": shader,
    "SetUseBounds": (False,),
    "SetPickable": (0,),
    "SetDragable": (0,),
    "SetPropertyKeys": (None,),
    "SetEstimatedRenderTime": (1.0,),
    "SetRenderTimeMultiplier": (2.0,),
}


def call(scene, name, setter):
    method = getattr(scene.of(name), setter)
    arguments = ARGUMENTS.get(setter)
    if setter == "SetAllocatedRenderTime":
        method(5.0, scene.renderer)
    elif setter == "SetTransferFunctionMode":
        scene.property.SetTransferFunction2D(functions_2d())
        scene.property.SetTransferFunctionMode(vtk.vtkVolumeProperty.TF_1D)
        method(*arguments)
    elif setter == "SetBlendModeToSlice":
        scene.property.SetSliceFunction(plane())
        method()
    elif callable(arguments):
        method(arguments(scene))
    elif arguments is not None:
        method(*arguments)
    else:
        assert re.match(r"Set\w+To[A-Z]", setter), f"{setter}: no value is known"
        if "FieldData" in setter:
            scene.mapper.SelectScalarArray("of cells" if "Cell" in setter else "first")
        method()


def names_in_source(path):
    text = open(path, encoding="utf-8").read()
    body = text[text.index("FindUnsupported("):]
    body = body[:body.index("return names;")]
    names = set()
    for literal in re.findall(r'"([^"]+)"\)', body):
        names.update(word for word in re.findall(r"[A-Z]\w+", literal))
    assert len(names) > 3, "FindUnsupported() isn't where it was"
    return names


def main(table, source):
    rows = read_table(table)
    problems = []
    for name in CLASSES:
        has = {m for m in getattr(vtk, name).__dict__ if re.match("Set[A-Z]|SelectScalarArray", m)}
        told = {setter for (of, setter) in rows if of == name}
        problems += [f"{name}::{m} isn't in the table" for m in sorted(has - told)]
        problems += [f"{name} has no {m}" for m in sorted(told - has)]

    for (name, setter), status in rows.items():
        scene = Scene()
        call(scene, name, setter)
        for _ in range(3):
            scene.draw()
        text = " ".join(scene.warnings)
        if scene.errors:
            problems.append(f"{setter}: {scene.errors}")
        if status == "warned":
            word = re.sub("To(Binary|UnsignedChar|UnsignedShort)$", "", setter[3:])
            naming = [w for w in scene.warnings if word in w]
            others = [w for w in scene.warnings if word not in w]
            if len(naming) != 1 or others:
                problems.append(f"{setter} is to warn once of {word}; warnings: {scene.warnings}")
        elif scene.warnings:
            problems.append(f"{setter} is {status}, but there is: {text}")

    warned = {setter[3:] for (_, setter), status in rows.items() if status in ("warned", "partly")}
    known = {setter[3:] for (_, setter) in rows}  # of VTK, and no other words of a warning
    for word in sorted((names_in_source(source) & known) - warned):
        problems.append(f"FindUnsupported() warns of {word}, of which the table doesn't tell")
    print(f"{len(rows)} setters")
    print("\n".join(problems))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
