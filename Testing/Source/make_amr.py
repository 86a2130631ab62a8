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


def write(name, domain, levels, dtype, components=1, first=LOW, **storage):
    """levels: (ratio against level 0, boxes as lists of imin, imax, jmin, jmax, kmin, kmax counted
    from the domain's first cell). Returns each level as one array; open cells are NaN."""
    whole, before = [], None
    with h5py.File(f"{folder}/{name}.vtkhdf", "w") as f:
        g = f.create_group("VTKHDF")
        g.attrs["Version"], g.attrs["Type"] = np.array([2, 2]), np.bytes_("OverlappingAMR")
        g.attrs["Origin"] = np.array([10.0, 20.0, 30.0])
        g.attrs["GridDescription"] = np.bytes_("XYZ")
        for l, (ratio, boxes) in enumerate(levels):
            ratio = np.array(ratio)
            size = tuple((np.array(domain) * ratio)[::-1])
            a = np.stack([volume(size, dtype, 10 * c + l) for c in range(components)], -1)
            a = a[..., 0] if components == 1 else a
            if before is None:
                dense = np.full_like(a, np.nan if a.dtype.kind == "f" else 0)
            else:
                up = ratio // before
                dense = whole[-1].repeat(up[2], 0).repeat(up[1], 1).repeat(up[0], 2)
            parts, table = [], []
            for i0, i1, j0, j1, k0, k1 in boxes:
                region = np.s_[k0:k1 + 1, j0:j1 + 1, i0:i1 + 1]
                dense[region] = a[region]
                parts.append(a[region].reshape((-1,) + a.shape[3:]))
                table.append(np.array([i0, i1, j0, j1, k0, k1]) + (first * ratio).repeat(2))
            level = g.create_group(f"Level{l}")
            level.attrs["Spacing"] = np.array([1.0, 2.0, 4.0]) / ratio
            level.create_dataset("AMRBox", data=np.array(table, "<i4"))
            cells = np.concatenate(parts)
            if "chunks" in storage:
                storage["chunks"] = (min(97, len(cells)),) + cells.shape[1:]
            level.create_dataset("CellData/density", data=cells, **storage)
            level.create_dataset("CellData/vtkGhostType", data=np.zeros(len(cells), "u1"))
            whole.append(dense)
            before = ratio
    for i, array in enumerate(whole[::-1]):
        keep(folder, f"{name}{i}", array)


three = [((1, 1, 1), [[0, 7, 0, 8, 0, 5], [8, 11, 0, 4, 0, 5], [8, 11, 5, 8, 0, 5]]),
         ((2, 2, 2), [[4, 17, 2, 9, 2, 11], [18, 23, 4, 17, 0, 7]]),
         ((4, 4, 4), [[40, 47, 10, 33, 3, 15], [9, 20, 6, 19, 5, 21]])]
write("boxes", (12, 9, 6), three, "<f4")
write("packed", (12, 9, 6), three, ">u2", chunks=True, compression="gzip", shuffle=True)
write("vectors", (12, 9, 6), three[:2], "u1", components=3)
# Refined in two axes only, by three; a hole in level 0.
write("uneven", (10, 10, 4), [((1, 1, 1), [[0, 9, 0, 9, 0, 1], [0, 9, 0, 3, 2, 3]]),
                              ((3, 3, 1), [[3, 20, 12, 17, 1, 3]])], "<f8", first=LOW * 0)


def spoil(name, change):
    with h5py.File(f"{folder}/boxes.vtkhdf") as source, \
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
spoil("nothing", lambda g: g["Level0"].__delitem__("CellData"))
spoil("no_levels", lambda g: g.__delitem__("Level0"))
