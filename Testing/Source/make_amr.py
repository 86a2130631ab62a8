# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Writes VTKHDF files of the type OverlappingAMR, as the specification of VTK has them, and their
levels as whole arrays: make_amr.py FOLDER."""
import sys

import h5py
import numpy as np

from format_files import keep, volume

folder = sys.argv[1]
LOW = np.array([-4, 2, 0])  # x, y, z of the domain's first cell at level 0


def refined(domain, levels, dtype, components, first, seed):
    """levels: (ratio against level 0, boxes as lists of imin, imax, jmin, jmax, kmin, kmax counted
    from the domain's first cell). Per level: the table of its boxes, their cells one after the other, and
    the whole level as one array, in which open cells are NaN."""
    result, before = [], None
    for l, (ratio, boxes) in enumerate(levels):
        ratio = np.array(ratio)
        size = tuple((np.array(domain) * ratio)[::-1])
        a = np.stack([volume(size, dtype, seed + 10 * c + l) for c in range(components)], -1)
        a = a[..., 0] if components == 1 else a
        if before is None:
            dense = np.full_like(a, np.nan if a.dtype.kind == "f" else 0)
        else:
            up = ratio // before
            dense = result[-1][2].repeat(up[2], 0).repeat(up[1], 1).repeat(up[0], 2)
        parts, table = [np.empty((0,) + a.shape[3:], a.dtype)], []
        for i0, i1, j0, j1, k0, k1 in boxes:
            region = np.s_[k0:k1 + 1, j0:j1 + 1, i0:i1 + 1]
            dense[region] = a[region]
            parts.append(a[region].reshape((-1,) + a.shape[3:]))
            table.append(np.array([i0, i1, j0, j1, k0, k1]) + (first * ratio).repeat(2))
        result.append((np.array(table, "<i4").reshape(-1, 6), np.concatenate(parts), dense))
        before = ratio
    return result


def create(name, version):
    f = h5py.File(f"{folder}/{name}.vtkhdf", "w")
    g = f.create_group("VTKHDF")
    g.attrs["Version"], g.attrs["Type"] = np.array(version), np.bytes_("OverlappingAMR")
    g.attrs["Origin"] = np.array([10.0, 20.0, 30.0])
    g.attrs["GridDescription"] = np.bytes_("XYZ")
    return f


def write(name, domain, levels, dtype, components=1, first=LOW, **storage):
    with create(name, [2, 2]) as f:
        made = refined(domain, levels, dtype, components, first, 0)
        for l, (table, cells, dense) in enumerate(made):
            level = f.create_group(f"VTKHDF/Level{l}")
            level.attrs["Spacing"] = np.array([1.0, 2.0, 4.0]) / np.array(levels[l][0])
            level.create_dataset("AMRBox", data=table)
            if "chunks" in storage:
                storage["chunks"] = (min(97, len(cells)),) + cells.shape[1:]
            level.create_dataset("CellData/density", data=cells, **storage)
            level.create_dataset("CellData/vtkGhostType", data=np.zeros(len(cells), "u1"))
            keep(folder, f"{name}{len(made) - 1 - l}", dense)


def write_steps(name, domain, steps, dtype, old):
    """Boxes that change with time. `still` has its cells of the first step in all that have its boxes."""
    with create(name, [2, 2 if old else 3]) as f:
        made = [refined(domain, levels, dtype, 1, LOW, 100 * t) for t, levels in enumerate(steps)]
        s = f.create_group("VTKHDF/Steps")
        s.attrs["NSteps"] = len(steps)
        s.create_dataset("Values", data=0.25 * np.arange(len(steps)) + 1)
        for l in range(len(steps[0])):
            level, lists = f.create_group(f"VTKHDF/Level{l}"), s.create_group(f"Level{l}")
            level.attrs["Spacing"] = np.array([1.0, 2.0, 4.0]) / np.array(steps[0][l][0])
            tables, cells = [m[l][0] for m in made], [m[l][1] for m in made]
            level.create_dataset("AMRBox", data=np.concatenate(tables))
            level.create_dataset("CellData/density", data=np.concatenate(cells))
            level.create_dataset("CellData/still", data=cells[0])
            begin = lambda parts: np.cumsum([0] + [len(p) for p in parts[:-1]])
            lists["AMRBoxOffset" if old else "AMRBoxOffsets"] = begin(tables)
            lists["NumberOfAMRBox" if old else "NumberOfAMRBoxes"] = [len(t) for t in tables]
            offsets = lists.create_group("CellDataOffset" if old else "CellDataOffsets")
            offsets["density"], offsets["still"] = begin(cells), [0] * len(steps)
            for t, m in enumerate(made):
                keep(folder, f"{name}.{t}.{len(steps[0]) - 1 - l}", m[l][2])


three = [((1, 1, 1), [[0, 7, 0, 8, 0, 5], [8, 11, 0, 4, 0, 5], [8, 11, 5, 8, 0, 5]]),
         ((2, 2, 2), [[4, 17, 2, 9, 2, 11], [18, 23, 4, 17, 0, 7]]),
         ((4, 4, 4), [[40, 47, 10, 33, 3, 15], [9, 20, 6, 19, 5, 21]])]
write("boxes", (12, 9, 6), three, "<f4")
write("packed", (12, 9, 6), three, ">u2", chunks=True, compression="gzip", shuffle=True)
write("vectors", (12, 9, 6), three[:2], "u1", components=3)
# Refined in two axes only, by three; a hole in level 0.
write("uneven", (10, 10, 4), [((1, 1, 1), [[0, 9, 0, 9, 0, 1], [0, 9, 0, 3, 2, 3]]),
                              ((3, 3, 1), [[3, 20, 12, 17, 1, 3]])], "<f8", first=LOW * 0)


# The second step has the boxes of the first one, the third one no fine ones.
later = three[:2] + [((4, 4, 4), [])]
for name, old in (("moving", False), ("moving_older", True)):
    write_steps(name, (12, 9, 6), [three, three, later, [later[0], ((2, 2, 2), [[0, 5, 0, 7, 0, 3]]), later[2]]],
                "<u2", old)


def spoil(name, change, of="boxes"):
    with h5py.File(f"{folder}/{of}.vtkhdf") as source, \
            h5py.File(f"{folder}/{name}.vtkhdf", "w") as f:
        source.copy("VTKHDF", f)
        change(f["VTKHDF"])


def replace(path, change):
    def apply(g):
        a = change(g[path][...])
        del g[path]
        g.create_dataset(path, data=a)
    return apply


def moved(table):
    table[0, :2] += 1000
    return table


write("hole", (4, 4, 4), [((1, 1, 1), [[0, 3, 0, 3, 0, 1], [0, 2, 0, 3, 2, 3]])], "<u2")
spoil("short", replace("Level1/CellData/density", lambda a: a[:-1]))
spoil("outside", replace("Level2/AMRBox", moved))
spoil("turned", replace("Level1/AMRBox", lambda t: t[:, ::-1]))
spoil("table", replace("Level0/AMRBox", lambda t: t[:, :5]))
spoil("spacing", lambda g: g["Level1"].attrs.__setitem__("Spacing", np.array([0.7, 1.0, 2.0])))
spoil("steps", lambda g: g.create_group("Steps"))
spoil("no_offsets", lambda g: g["Steps/Level1"].__delitem__("AMRBoxOffsets"), of="moving")
spoil("few_boxes", replace("Steps/Level1/NumberOfAMRBoxes", lambda n: n + 3), of="moving")
spoil("few_cells", replace("Level0/CellData/density", lambda a: a[:-1]), of="moving")
spoil("no_step", replace("Steps/Level0/CellDataOffsets/density", lambda a: -a), of="moving")
spoil("nothing", lambda g: g["Level0"].__delitem__("CellData"))
spoil("points", lambda g: [g[f"Level{n}"].move("CellData", "PointData") for n in range(3)])
spoil("both", lambda g: g["Level0"].create_dataset("PointData/speed", data=np.zeros(9)))
spoil("no_levels", lambda g: g.__delitem__("Level0"))
